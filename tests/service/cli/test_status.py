# SPDX-License-Identifier: GPL-3.0-or-later
"""`status` shows the flight controller and where to connect."""

from tests.service.cli.test_mission_commands import ask
from tests.support.programs import Daemon


def test_status_shows_the_flight_controller_and_the_address(daemon: Daemon) -> None:
    lines = dict(line.split("  ", 1) for line in ask(daemon, "status").stdout.splitlines())
    assert ", firmware 2.1.1, on sim:, MSP" in lines["Flight controller"]
    assert ", for " in lines["Flight controller"]
    assert "disarmed" in lines["Vehicle"]
    assert lines["Settings"].strip() in ("not read yet", f"seal {(daemon.status() or {})['settings_seal']}")
    assert lines["Connect to"].strip() == f"UDP 127.0.0.1, port {daemon.port}"
