# SPDX-License-Identifier: GPL-3.0-or-later
"""The flight controller behind a free port: silent, in its command line, or asked by the daemon."""

from bridge.fc.states.cli import Cli
from payloads.mission_data import Json
from service.cli.doctor.flight_controller import check_flight_controller
from service.daemon.client import ControlError
from tests.support.doctor import STATUS, assert_note, assert_ok, assert_problem, no_answer
from tests.support.faulty_machine import PORT


def test_a_silent_flight_controller_is_a_problem() -> None:
    assert_problem(check_flight_controller(PORT, None, no_answer), "no flight controller answers", "TX goes to RX")
    silent = STATUS | {"flight_controller": None, "state": "searching"}
    (_, found) = check_flight_controller(PORT, silent, None)
    assert_problem(found, "no reply on /dev/serial0: searching", "TX goes to RX")
    (_, found) = check_flight_controller(PORT, silent | {"state": "no port"}, None)
    assert_note(found, "/dev/serial0 cannot be opened yet")


def test_a_flight_controller_in_its_command_line_is_recognised() -> None:
    (_, found) = check_flight_controller(PORT, STATUS | {"flight_controller": None, "state": Cli.name}, None)
    assert_problem(found, Cli.trouble, "naze-bridge doctor` again")

    def listened() -> Json:
        raise ControlError(Cli.trouble)

    assert_problem(check_flight_controller(PORT, None, listened), Cli.trouble, "naze-bridge doctor` again")


def test_a_daemon_is_asked_and_the_port_left_alone() -> None:
    (daemon, found) = check_flight_controller(PORT, STATUS, no_answer)
    assert_ok(daemon, "running")
    assert_ok(found, "Harakiri, MSP at 115200 baud, disarmed")
