# SPDX-License-Identifier: GPL-3.0-or-later
"""The flight controller behind a free port, or asked by the daemon; and the troubles that a daemon's status shows."""

import pytest

from bridge.fc.states.msp import Cli
from payloads.mission_data import Json
from service.cli.doctor.flight_controller import check_flight_controller, check_running
from service.daemon.client import ControlError
from service.settings.addresses import parse_fc
from tests.support.doctor import STATUS, assert_ok, assert_problem, no_answer
from tests.support.faulty_machine import PORT


def test_a_silent_flight_controller_is_a_problem() -> None:
    assert_problem(check_flight_controller(PORT, None, no_answer), "no flight controller answers", "Connect TX to RX")


def test_a_flight_controller_in_the_command_line_is_recognised() -> None:
    def listened() -> Json:
        raise ControlError(Cli.trouble.text)

    assert_problem(check_flight_controller(PORT, None, listened), Cli.trouble.text, "naze-bridge doctor` again")


def test_a_daemon_is_asked_and_the_port_not_touched() -> None:
    (daemon, found) = check_flight_controller(PORT, STATUS, no_answer)
    assert_ok(daemon, "running")
    assert_ok(found, "Harakiri, MSP at 115200 baud, disarmed")


@pytest.mark.parametrize(
    ("damaged", "found_s", "is_bad"), [(5000, 3600.0, True), (9, 5.0, False), (12, 36000.0, False), (0, None, False)]
)
def test_a_line_that_damages_replies(damaged: int, found_s: float | None, *, is_bad: bool) -> None:
    found = list(check_running(STATUS | {"bad_checksums": damaged, "found_s": found_s}))
    if is_bad:
        assert_problem(found, "5000 damaged replies in 60 min", "GND at both ends")
    else:
        assert found == []


def test_a_board_behind_a_network_is_not_asked_about_wires() -> None:
    silent = STATUS | {"flight_controller": None, "state": "searching", "fc_bytes_received": 0}
    for fc in ("tcp:10.0.0.7:5760", "udp:10.0.0.7:14550"):
        (found,) = check_flight_controller(parse_fc(fc), None, lambda: silent)
        assert "ping 10.0.0.7" in found.remedy
        assert "TX" not in found.remedy
    (refused,) = check_flight_controller(parse_fc("tcp:10.0.0.7:5760"), None, no_answer)
    assert "TX" not in refused.remedy
