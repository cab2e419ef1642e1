# SPDX-License-Identifier: GPL-3.0-or-later
"""The real DroneKit: its missions on an empty and on a full board.

Its telemetry is tested in test_shown_telemetry.py.
"""

from collections.abc import Sequence
from typing import Any

import pytest

from protocols.mission_item import Command
from simulator.board.flight import FIELD_LAT_E7, FIELD_LON_E7
from tests.support.benches import Bench
from tests.support.dronekit import GaveUp, command, vehicle_at
from tests.support.programs import until

HOME = FIELD_LAT_E7 / 1e7, FIELD_LON_E7 / 1e7


def download(vehicle: Any) -> Any:
    vehicle.commands.download()
    vehicle.commands.wait_ready(timeout=60)
    return vehicle.commands


def upload(vehicle: Any, commands: Sequence[Any]) -> None:
    """Item 0 stays the downloaded home."""
    vehicle.commands.clear()
    for each in commands:
        vehicle.commands.add(each)
    vehicle.commands.upload(timeout=60)


def test_missions_are_written_to_an_empty_and_to_a_full_board(shared: Bench) -> None:
    with vehicle_at(shared.daemon.port) as vehicle:
        assert len(download(vehicle)) == 0
        home = vehicle.home_location
        assert (home.lat, home.lon, home.alt) == (*map(pytest.approx, HOME), 131)
        flight = [
            command(Command.NAV_TAKEOFF, 0, 0, 10),
            command(Command.NAV_WAYPOINT, HOME[0] + 1e-3, HOME[1], 20),
            command(Command.NAV_LAND, 0, 0, 0),
        ]
        upload(vehicle, flight)
        until(lambda: len(shared.board.records()) == 4, "the mission in flash")
        assert [each.command for each in download(vehicle)] == [each.command for each in flight]
        # A clear, then a longer list at once; it ignores acks and does not repeat MISSION_COUNT.
        upload(vehicle, [command(Command.NAV_WAYPOINT, HOME[0] + step * 1e-4, HOME[1], 20) for step in range(145)])
        until(lambda: len(shared.board.records()) == 146, "the long mission in flash")
        held = download(vehicle)
        assert [each.x for each in held] == [pytest.approx(HOME[0] + step * 1e-4, abs=1e-5) for step in range(145)]
        assert held.next == 0


def test_an_upload_without_a_download_needs_a_timeout(shared: Bench, caplog: pytest.LogCaptureFixture) -> None:
    """Its first command is item 0 then. It ignores the ack that rejects the list; the reason is in its log."""
    with vehicle_at(shared.daemon.port) as vehicle:
        vehicle.commands.clear()
        vehicle.commands.add(command(Command.NAV_TAKEOFF, 0, 0, 10))
        vehicle.commands.add(command(Command.NAV_WAYPOINT, HOME[0] + 1e-3, HOME[1], 20))
        with pytest.raises(GaveUp):
            vehicle.commands.upload(timeout=5)
        until(lambda: "put home first" in caplog.text, "the reason")
