# SPDX-License-Identifier: GPL-3.0-or-later
"""The words of INAV's OSD as texts: when they change, with the item numbers of each ground station."""

import pytest
from pymavlink.dialects.v20 import ardupilotmega as m

from bridge.vehicle.nav_words import NavWords, nav_words, sentence_for
from bridge.voice.happening import Severity
from protocols.mission_item import Command, MissionItem, MissionResult
from protocols.msp.nav import FINISHED, NavAction, NavMode, NavState, NavStatus
from tests.bridge.vehicle.test_item_numbers import HOME, LEGS, WITH_TAKEOFF, bench
from tests.support.conversations import Upload
from tests.support.fake_inav import FakeInav
from tests.support.world import GroundStation, World

S = NavState
MISSION, RTH = NavMode.MISSION, NavMode.RTH
RTL = MissionItem(0, Command.NAV_RETURN_TO_LAUNCH, 3, 0, 0, 0, 0, 0, 0, 0)


def status(mode: int, state: int, number: int = 1, action: int = NavAction.WAYPOINT, error: int = 0) -> NavStatus:
    return NavStatus(mode, state, action, number, error, 0)


@pytest.mark.parametrize(
    ("report", "words"),
    [
        (status(MISSION, S.WP_ENROUTE), "TO WP {}/{}"),
        (status(MISSION, S.HOLD_TIMED), "HOLDING WP {}/{}"),
        (status(MISSION, S.LAND_IN_PROGRESS), "LANDING"),
        (status(MISSION, S.WP_ENROUTE, error=FINISHED), "WP END>HOLDING POSITION"),
        (status(MISSION, S.WP_ENROUTE, action=NavAction.LAND, error=FINISHED), "WP END>LANDED"),
        (status(RTH, S.RTH_START), "STARTING RTH"),
        (status(RTH, S.RTH_CLIMB), "ADJUSTING RTH ALTITUDE"),
        (status(RTH, S.RTH_ENROUTE), "EN ROUTE TO HOME"),
        (status(RTH, S.LAND_SETTLE), "PREPARING TO LAND"),
        (status(RTH, S.HOVER_ABOVE_HOME), "HOVERING"),
        (status(RTH, S.LANDED), "LANDED"),
        (status(15, S.EMERGENCY_LANDING), "EMERGENCY LANDING"),
        (status(0, 0), ""),
        (status(1, 3), ""),
        (status(MISSION, 6), ""),
        (status(MISSION, 99), ""),
    ],
)
def test_each_state_has_the_words_of_the_osd(report: NavStatus, words: str) -> None:
    assert nav_words(report, is_plane=False) == words


def test_a_plane_circles_above_home() -> None:
    assert nav_words(status(RTH, S.HOVER_ABOVE_HOME), is_plane=True) == "LOITERING AROUND HOME"


def test_only_an_emergency_landing_is_shown_on_the_hud_of_mission_planner() -> None:
    assert sentence_for("EMERGENCY LANDING").severity is Severity.CRITICAL
    assert sentence_for("TO WP {}/{}").severity is Severity.NOTICE


def test_words_are_said_once_and_not_more_often_than_every_two_seconds() -> None:
    words, home = NavWords(), status(RTH, S.RTH_ENROUTE)
    reports = [(0.0, 1), (0.5, 1), (1.0, 2), (1.5, 3), (2.0, 3), (2.5, 3)]
    said = [words.changed(status(MISSION, S.WP_ENROUTE, number), at, is_plane=False) for at, number in reports]
    assert said == ["TO WP {}/{}", "", "", "", "TO WP {}/{}", ""]
    assert words.changed(home, 5.0, is_plane=False) == "EN ROUTE TO HOME"
    assert words.changed(None, 6.0, is_plane=False) == ""
    assert words.changed(home, 9.0, is_plane=False) == "EN ROUTE TO HOME", "a second return"


def fly(world: World, board: FakeInav, *reports: tuple[int, ...]) -> None:
    board.armed = True
    for report in reports:
        board.nav = (*report, 0)  # type: ignore[assignment]
        world.run(2.5)


def words_of(station: GroundStation) -> list[str]:
    return [message.text for message in station.messages("STATUSTEXT") if message.severity == m.MAV_SEVERITY_NOTICE]


def test_the_numbers_are_those_of_each_stations_plan() -> None:
    """Item 1 as sent, the TAKEOFF, is not stored."""
    world, board = bench()
    sender, other = GroundStation(world, "sender"), GroundStation(world, "other", sysid=254)
    other.stay_connected()
    assert Upload(sender, WITH_TAKEOFF).run() is MissionResult.ACCEPTED
    world.run(1)
    for station in (sender, other):
        station.received.clear()
    fly(world, board, (3, S.WP_ENROUTE, 1, 1, 0), (3, S.WP_ENROUTE, 1, 2, 0))
    assert words_of(sender) == ["TO WP 2/4", "TO WP 3/4"]
    assert words_of(other) == ["TO WP 1/3", "TO WP 2/3"]


def test_a_newcomer_does_not_get_old_words_and_the_ground_has_none() -> None:
    world, board = bench()
    station = GroundStation(world)
    assert Upload(station, [HOME, *LEGS[:2], RTL]).run() is MissionResult.ACCEPTED
    world.run(1)
    board.nav = (3, S.WP_ENROUTE, 1, 1, 0, 0)
    station.received.clear()
    world.run(3)
    assert words_of(station) == []
    fly(world, board, (3, S.WP_ENROUTE, 1, 2, 0), (2, S.RTH_ENROUTE, 4, 3, 0))
    newcomer = GroundStation(world, "newcomer", sysid=254)
    newcomer.stay_connected()
    world.run(5)
    assert words_of(station) == ["TO WP 2/3", "EN ROUTE TO HOME"]
    assert not {*words_of(newcomer)} & {*words_of(station)}


def test_without_a_known_list_only_words_without_numbers_are_said() -> None:
    board = FakeInav(drop=lambda frame: "request" if frame.command == 118 else "")
    board.records, board.is_valid = [bytes(20)], True
    world = World(speeds=(115200,), peer=board)
    world.wait_until(lambda world: world.is_found, 10)
    station = GroundStation(world)
    station.stay_connected()
    world.run(1)
    station.received.clear()
    fly(world, board, (3, S.WP_ENROUTE, 1, 1, 0), (2, S.RTH_ENROUTE, 4, 1, 0))
    assert words_of(station) == ["EN ROUTE TO HOME"]
