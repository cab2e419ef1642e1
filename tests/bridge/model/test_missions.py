# SPDX-License-Identifier: GPL-3.0-or-later
"""The record that the craft flies to, and the last one reached."""

from bridge.model.missions import FlownMission, MissionProgress
from protocols.msp.nav import NavAction, NavMode, NavState, NavStatus
from reports.vehicle_groups import Progress

ON_ITS_WAY = 5


def status(number: int, action: int = NavAction.WAYPOINT, *, mode: int = NavMode.MISSION, state: int = ON_ITS_WAY,
           error: int = 0) -> NavStatus:  # fmt: skip
    return NavStatus(mode, state, action, number, error, 0)


def test_a_record_is_reached_once_when_the_next_is_flown_to() -> None:
    progress = MissionProgress()
    assert [progress.take(status(number)) for number in (1, 1, 2, 2, 4)] == [(), (), (1,), (), (2,)]
    assert (progress.number, progress.progress) == (4, Progress.ACTIVE)


def test_a_record_without_a_place_is_never_reached() -> None:
    progress = MissionProgress()
    taken = [progress.take(status(*each)) for each in ((1,), (2, NavAction.JUMP), (3,))]
    assert taken == [(), (1,), ()]


def test_a_craft_that_waits_at_a_record_has_reached_it() -> None:
    progress = MissionProgress()
    holds = status(2, NavAction.POSHOLD_TIME, state=NavState.HOLD_TIMED)
    assert [progress.take(each) for each in (status(2, NavAction.POSHOLD_TIME), holds, holds)] == [(), (2,), ()]


def test_the_return_home_at_the_end_completes_the_mission_and_another_ends_it() -> None:
    progress = MissionProgress()
    progress.take(status(3, NavAction.RTH))
    home = status(3, NavAction.RTH, mode=NavMode.RTH, state=NavState.HOVER_ABOVE_HOME)
    assert (progress.take(home), progress.progress) == ((3,), Progress.COMPLETE)
    progress.take(status(0, 0, mode=0))
    assert (progress.number, progress.progress) == (0, Progress.NOT_STARTED)
    progress.take(home)
    assert progress.progress is Progress.NOT_STARTED, "the pilot's own switch is no mission"


def test_a_finished_mission_is_complete() -> None:
    progress = MissionProgress()
    assert progress.take(status(4, error=4)) == (4,)
    assert progress.progress is Progress.COMPLETE


def test_an_empty_mission_lacks_a_last_item() -> None:
    assert FlownMission().counted(()) == (0, 0)
