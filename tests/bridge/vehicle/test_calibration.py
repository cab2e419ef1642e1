# SPDX-License-Identifier: GPL-3.0-or-later
"""Calibrations as seen in Mission Planner's compass and accelerometer pages, from the start to the result.

Its rules (ConfigHWCompass2.cs, ConfigAccelerometerCalibration.cs, doCommand): the compass page takes only
MAG_CAL_PROGRESS and MAG_CAL_REPORT, ignores a report of the first compass with an x of 0, and demands a reboot after an
"autosaved" one. The accelerometer's wizard ends at a text with "calibration successful" or "calibration failed"; for
level and simple it waits 25 s for the next COMMAND_ACK.
"""

from itertools import pairwise
from typing import Any

import pytest
from pymavlink.dialects.v20 import ardupilotmega as m

from simulator.board.options import Faults, SimOptions
from simulator.commands.fc_kinds import make_board
from tests.support.fake_inav import FakeInav
from tests.support.screens import Screens
from tests.support.world import GroundStation, ready_world

ACCEPTED, TEMPORARILY_REJECTED, DENIED, UNSUPPORTED, FAILED, IN_PROGRESS = range(6)
START_MAG_CAL, ACCEPT_MAG_CAL, CANCEL_MAG_CAL = 42424, 42425, 42426
WIZARD, LEVEL, SIMPLE = 1, 2, 4
ACK_TIMEOUT_S = 25.0


class CalibrationPages:
    """The two pages, on a station of a simulated world."""

    def __init__(self, peer: Any = None, faults: Faults | None = None) -> None:
        self.world = ready_world(SimOptions(), faults, peer=peer)
        self.station = GroundStation(self.world)
        self.station.stay_connected(wait_s=4)
        self.screens = Screens(self.station)
        self.began_at = self.world.now
        self.station.take()

    def command(self, number: int, *params: float) -> None:
        self.station.send(m.MAVLink_command_long_message(1, 1, number, 0, *params, *[0] * (7 - len(params))))

    def start_compass(self, wait_s: float = 0.0) -> None:
        """*Start* on the compass page."""
        self.command(START_MAG_CAL, 0, 1, 1)
        self.world.run(wait_s)

    def start_accelerometer(self, kind: int, wait_s: float = 0.0) -> None:
        self.command(m.MAV_CMD_PREFLIGHT_CALIBRATION, 0, 0, 0, 0, kind)
        self.world.run(wait_s)

    def acks(self, number: int) -> list[int]:
        return [ack.result for ack in self.station.messages("COMMAND_ACK") if ack.command == number]

    def longest_wait_for_ack_s(self, number: int) -> float:
        """Until the final one."""
        times = [self.began_at]
        for at, message in self.station.received:
            if message.get_type() == "COMMAND_ACK" and message.command == number:
                times.append(at)
        return max(after - before for before, after in pairwise(times))

    @property
    def bar(self) -> list[int]:
        """The compass page's progress bar over time."""
        return [message.completion_pct for message in self.station.messages("MAG_CAL_PROGRESS")]

    @property
    def results(self) -> list[int]:
        """The compass page's result lines."""
        reports = self.station.messages("MAG_CAL_REPORT")
        return [report.cal_status for report in reports if report.compass_id or report.ofs_x != 0]

    @property
    def demands_reboot(self) -> bool:
        return any(report.autosaved for report in self.station.messages("MAG_CAL_REPORT"))

    @property
    def wizard_result(self) -> str:
        """The accelerometer wizard's last line, empty while it waits."""
        ends = ("calibration successful", "calibration failed")
        return next((text for text in self.station.texts() if any(end in text for end in ends)), "")

    def assert_nothing_was_lost(self) -> None:
        assert not [text for text in self.screens.mission_planner.texts(self.began_at) if "lost" in text.lower()]
        assert True not in self.screens.mission_planner.failsafe.values(self.began_at)


def test_the_compass_page_follows_a_harakiri_to_the_end() -> None:
    pages = CalibrationPages()
    pages.start_compass(wait_s=1)
    assert pages.acks(START_MAG_CAL) == [ACCEPTED]
    assert any("Turn the craft" in text for text in pages.station.texts())
    pages.world.run(59)
    assert pages.results == []
    assert pages.bar == sorted(pages.bar)
    assert 90 <= pages.bar[-1] < 100
    pages.world.run(30)
    assert pages.results == [m.MAG_CAL_SUCCESS]
    assert pages.bar[-1] == 100
    assert not pages.demands_reboot
    assert pages.world.naze.counters.resets == 1
    pages.assert_nothing_was_lost()
    pages.command(ACCEPT_MAG_CAL, 0, 0, 1)
    pages.world.run(0.2)
    assert pages.acks(ACCEPT_MAG_CAL) == [ACCEPTED]


def test_cancelling_a_frozen_compass_calibration_is_refused() -> None:
    pages = CalibrationPages()
    pages.command(CANCEL_MAG_CAL)  # QGroundControl asks in this way if there is such a calibration
    pages.world.run(0.2)
    pages.start_compass(wait_s=3)
    pages.command(CANCEL_MAG_CAL)
    pages.start_compass()
    pages.start_accelerometer(LEVEL, wait_s=1)
    assert pages.acks(CANCEL_MAG_CAL) == [ACCEPTED, DENIED]
    assert pages.acks(START_MAG_CAL) == [ACCEPTED, IN_PROGRESS]
    assert pages.acks(m.MAV_CMD_PREFLIGHT_CALIBRATION) == [TEMPORARILY_REJECTED]
    assert any("Cannot be cancelled" in text for text in pages.station.texts())


def test_a_compass_calibration_cut_by_a_reset_has_failed() -> None:
    pages = CalibrationPages()
    pages.start_compass(wait_s=10)
    pages.world.power_off()
    pages.world.run(1)
    pages.world.power_on()
    pages.world.run(20)
    assert pages.results == [m.MAG_CAL_FAILED]
    assert any("Compass calibration failed" in text for text in pages.station.texts())


def test_a_board_that_stays_silent_is_lost() -> None:
    pages = CalibrationPages()
    pages.start_compass(wait_s=5)
    pages.world.power_off()
    pages.world.run(350)
    pages.assert_nothing_was_lost()
    pages.world.run(20)
    assert pages.results == [m.MAG_CAL_FAILED]
    assert any("Flight controller lost" in text for text in pages.station.texts())


@pytest.mark.parametrize("kind", [WIZARD, LEVEL, SIMPLE])
def test_the_accelerometer_page_ends_with_success_after_the_restart(kind: int) -> None:
    pages = CalibrationPages()
    pages.start_accelerometer(kind, wait_s=9)
    assert pages.wizard_result == ""
    pages.world.run(21)
    assert pages.wizard_result == "Accel calibration successful"
    acks = pages.acks(m.MAV_CMD_PREFLIGHT_CALIBRATION)
    # Another loop of Mission Planner may take an acknowledgement from the loop that waits for it.
    assert list(dict.fromkeys(acks)) == [IN_PROGRESS, ACCEPTED]
    assert acks.count(ACCEPTED) == 6
    assert pages.longest_wait_for_ack_s(m.MAV_CMD_PREFLIGHT_CALIBRATION) < ACK_TIMEOUT_S
    pages.assert_nothing_was_lost()


def test_mission_planner_sees_at_once_that_a_calibrating_craft_is_not_ready() -> None:
    pages = CalibrationPages()
    pages.start_accelerometer(WIZARD, wait_s=2)
    assert not pages.screens.mission_planner.ready.at(pages.world.now)


def test_another_loss_afterwards_is_reported() -> None:
    pages = CalibrationPages()
    pages.start_accelerometer(LEVEL, wait_s=30)
    pages.world.power_off()
    pages.world.run(6)
    assert any("Flight controller lost" in text for text in pages.station.texts())


def test_a_multiwii_calibrates_while_it_answers() -> None:
    pages = CalibrationPages(make_board("multiwii", faults=Faults(boxes=0)))
    pages.start_compass(wait_s=20)
    assert pages.results == []
    pages.world.run(15)
    assert pages.results == [m.MAG_CAL_SUCCESS]
    pages.station.take()
    pages.start_accelerometer(SIMPLE, wait_s=8)
    assert pages.wizard_result == "Accel calibration successful"
    assert set(pages.acks(m.MAV_CMD_PREFLIGHT_CALIBRATION)) == {IN_PROGRESS, ACCEPTED}
    # The next button is not answered by the result of the last.
    pages.start_accelerometer(LEVEL, wait_s=6)
    pages.station.take()
    pages.start_accelerometer(SIMPLE, wait_s=2)
    assert pages.acks(m.MAV_CMD_PREFLIGHT_CALIBRATION) == [IN_PROGRESS]


def test_the_usual_time_counts_from_the_boards_reply() -> None:
    pages = CalibrationPages(make_board("multiwii", faults=Faults(boxes=0)))
    pages.start_compass(wait_s=35)
    times = {message.get_type(): at for at, message in pages.station.received}
    # MultiWii collects compass values for 30 s.
    assert times["MAG_CAL_REPORT"] - times["COMMAND_ACK"] >= 31.0


def test_an_unsupported_calibration_is_refused_with_a_text() -> None:
    pages = CalibrationPages(FakeInav())
    pages.start_accelerometer(WIZARD, wait_s=0.5)
    assert pages.acks(m.MAV_CMD_PREFLIGHT_CALIBRATION) == [UNSUPPORTED]
    assert any("INAV Configurator" in text for text in pages.station.texts())
