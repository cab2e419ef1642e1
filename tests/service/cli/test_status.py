# SPDX-License-Identifier: GPL-3.0-or-later
"""`status` shows the flight controller and where to connect."""

import pytest

from service.cli.status import status_lines
from tests.service.cli.test_mission_commands import ask
from tests.support.programs import Daemon


def test_status_shows_the_flight_controller_and_the_address(daemon: Daemon) -> None:
    lines = dict(line.split("  ", 1) for line in ask(daemon, "status").stdout.splitlines())
    assert ", firmware 2.1.1, on sim:, MSP" in lines["Flight controller"]
    assert ", for " in lines["Flight controller"]
    assert "disarmed" in lines["Vehicle"]
    assert lines["Settings"].strip() in ("not read yet", f"seal {(daemon.status() or {})['settings_seal']}")
    assert lines["Connect to"].strip() == f"UDP 127.0.0.1, port {daemon.port}"


def test_a_page_that_cannot_be_opened_is_said_to_be(daemon: Daemon) -> None:
    facts = daemon.status()
    assert facts is not None
    taken = facts | {"page": "0.0.0.0:8080", "page_trouble": "Address already in use"}
    assert dict(status_lines(taken, []))["Page"].startswith("0.0.0.0:8080 cannot be opened: Address already in use")
    assert dict(status_lines(taken | {"page_trouble": ""}, ["10.0.0.7"]))["Page"] == "http://10.0.0.7:8080/"


@pytest.mark.parametrize(("age_s", "said"), [(None, ""), (1.2, ""), (75.0, ", 1 min ago")])
def test_values_that_no_longer_arrive_are_shown_with_their_age(daemon: Daemon, age_s: float | None, said: str) -> None:
    facts = daemon.status()
    assert facts is not None
    assert facts["status_age_s"] < 5
    ages = dict.fromkeys(("status_age_s", "gps_age_s", "battery_age_s"), age_s)
    lines = dict(status_lines(facts | ages | {"battery_v": 11.1, "fix": "3D", "satellites": 9}, []))
    assert lines["Battery"] == f"11.1 V{said}"
    assert lines["GPS"] == f"3D fix, 9 satellites{said}"
    assert lines["Vehicle"].endswith(said or lines["Vehicle"])
