# SPDX-License-Identifier: GPL-3.0-or-later
"""One incident can be followed through the log by its id."""

from collections import defaultdict
from typing import Any

from tests.support.benches import Starter
from tests.support.plain_station import udp_station
from tests.support.plan import plain_plan
from tests.support.programs import Daemon, until


def _by_incident(daemon: Daemon) -> dict[str, list[str]]:
    found: dict[str, list[str]] = defaultdict(list)
    for event in daemon.events():
        if "incident" in event:
            found[event["incident"]].append(event["event"])
    return found


def test_the_lines_of_one_incident_have_one_id(start: Starter) -> None:
    bench = start.bench()
    with udp_station(bench.daemon.address) as station:
        station.send_heartbeat()
        station.wait_for("HEARTBEAT")
        station.upload(plain_plan(5))
        station.upload(plain_plan(147))
    bench.daemon.push(plain_plan(6))
    bench.board.end()
    until(lambda: bench.daemon.has_logged("fc.port_lost"), "the loss")
    start.board()
    until(lambda: [*_by_incident(bench.daemon).values()].count(["fc.port_lost", "fc.found"]) == 1, "the return")
    lines: list[Any] = [*_by_incident(bench.daemon).values()]
    assert lines == [
        ["fc.found"],
        ["mission.upload_started", "mission.upload_ended"],
        ["mission.refused"],
        ["mission.push_started", "mission.push_ended"],
        ["fc.port_lost", "fc.found"],
    ]
