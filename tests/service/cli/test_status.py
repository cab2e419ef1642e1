# SPDX-License-Identifier: GPL-3.0-or-later
"""`status` shows the flight controller and where to connect."""

from pathlib import Path

import pytest

from service.cli.status import status_lines
from service.machine.host import Host
from service.machine.raspberry_pi import clock_trouble
from tests.service.cli.test_mission_commands import ask
from tests.support.faulty_machine import FaultyMachine
from tests.support.programs import Daemon


def test_status_shows_the_flight_controller_and_the_address(daemon: Daemon) -> None:
    lines = dict(line.split("  ", 1) for line in ask(daemon, "status").stdout.splitlines())
    assert ", firmware 2.1.1, on sim:, MSP" in lines["Flight controller"]
    assert ", for " in lines["Flight controller"]
    assert "disarmed" in lines["Vehicle"]
    assert lines["Settings"].strip() in ("not read yet", f"seal {(daemon.status() or {})['settings_seal']}")
    assert lines["Connect to"].strip() == f"UDP 127.0.0.1, port {daemon.port}"


def test_a_page_that_cannot_be_opened_is_reported(daemon: Daemon) -> None:
    facts = daemon.status()
    assert facts is not None
    taken = facts | {"page": "0.0.0.0:8080", "page_trouble": "Address already in use"}
    assert dict(status_lines(taken, [], Host()))["Page"].startswith(
        "0.0.0.0:8080 cannot be opened: Address already in use"
    )
    assert dict(status_lines(taken | {"page_trouble": ""}, ["10.0.0.7"], Host()))["Page"] == "http://10.0.0.7:8080/"


def test_a_silent_mini_uart_and_a_wrong_clock_are_named(daemon: Daemon, tmp_path: Path) -> None:
    pi = FaultyMachine(tmp_path)
    pi.is_a("Raspberry Pi 3 Model B", header="ttyS0")
    facts = daemon.status()
    assert facts is not None
    silent = facts | {"flight_controller": None, "trouble": "", "where": "/dev/serial0"}
    lines = dict(status_lines(silent | {"clock_trouble": clock_trouble(-90000, "a ground station")}, [], pi))
    assert lines["Flight controller"].endswith("on /dev/serial0, the mini-UART; see sudo naze-bridge doctor")
    assert lines["Clock"] == (
        "the Pi's clock is 1 day, 1:00:00 ahead of a ground station: sudo date --set '-90000 seconds'"
    )


@pytest.mark.parametrize(("age_s", "said"), [(None, ""), (1.2, ""), (75.0, ", 1 min ago")])
def test_values_that_no_longer_arrive_are_shown_with_their_age(daemon: Daemon, age_s: float | None, said: str) -> None:
    facts = daemon.status()
    assert facts is not None
    assert facts["status_age_s"] < 5
    ages = dict.fromkeys(("status_age_s", "gps_age_s", "battery_age_s"), age_s)
    lines = dict(status_lines(facts | ages | {"battery_v": 11.1, "fix": "3D", "satellites": 9}, [], Host()))
    assert lines["Battery"] == f"11.1 V{said}"
    assert lines["GPS"] == f"3D fix, 9 satellites{said}"
    assert lines["Vehicle"].endswith(said or lines["Vehicle"])
