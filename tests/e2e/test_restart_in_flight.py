# SPDX-License-Identifier: GPL-3.0-or-later
"""The daemon is killed in flight and started again: no ground station sees the craft disarmed, or in another mode."""

import json
from pathlib import Path

from pymavlink.dialects.v20 import ardupilotmega as m

from service.daemon.kept_state import FLIGHT_FILE
from tests.support.benches import Starter
from tests.support.plain_station import PlainStation, udp_station
from tests.support.programs import until

LOITER, ARMED = 5, m.MAV_MODE_FLAG_SAFETY_ARMED


def _heartbeats(station: PlainStation, count: int) -> set[tuple[bool, int]]:
    seen = set()
    for _ in range(count):
        station.send_heartbeat()
        beat = station.wait_for("HEARTBEAT")
        seen.add((bool(beat.base_mode & ARMED), beat.custom_mode))
    return seen


def _remembers_the_mode(file: Path) -> bool:
    flight = json.loads(file.read_text())["flight"] if file.exists() else None
    return flight is not None and flight["mode"] == "LOITER"


def test_the_craft_stays_armed_and_in_the_mode(start: Starter) -> None:
    bench = start.bench("--tele-prot", "2")
    bench.board.set("boxes 128")
    until(lambda: (bench.daemon.status() or {}).get("mode") == "LOITER", "the mode")
    bench.board.set("armed 1")
    bench.daemon.wait("MAVLink")
    with udp_station(bench.daemon.address) as station:
        until(lambda: _heartbeats(station, 1) == {(True, LOITER)}, "the flight")
        # It is written again when the mode changes.
        until(lambda: _remembers_the_mode(bench.daemon.state_dir / FLIGHT_FILE), "the memory")
        bench.daemon.kill_and_restart()
        bench.daemon.wait_up()
    with udp_station(bench.daemon.address) as station:
        assert _heartbeats(station, 25) == {(True, LOITER)}
        bench.daemon.wait("MAVLink")
        assert _heartbeats(station, 5) == {(True, LOITER)}
