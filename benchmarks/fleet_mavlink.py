# SPDX-License-Identifier: GPL-3.0-or-later
"""A fleet in one ground station, `fleet mavlink --all`: `python -m benchmarks.fleet_mavlink [COUNT]`.

Real daemons with a simulated Naze each, behind a router of the Python package or $ZENOHD, on one machine. The ground
station behaves like Mission Planner. CPU time and memory are those of the command alone.
"""

import sys
import tempfile
import time
from contextlib import ExitStack
from pathlib import Path

from benchmarks.processes import cpu_s, resident_mb
from tests.service.cli.test_vehicle_relay import relay
from tests.support.fleet_bench import I_KNOW, Fleet
from tests.support.mission_planner import MissionPlanner
from tests.support.plan import plain_plan
from tests.support.programs import free_port

_COUNT = 20
_AT_ONCE = 5
_ITEMS, _TIMES = 146, 3
_WATCHED_S = 10.0


def main(count: int) -> None:
    """Print the relay's cost, and the time of a Write and a Read to one vehicle among them."""
    with tempfile.TemporaryDirectory() as name, ExitStack() as stack:
        folder, names = Path(name), [f"naze-{number}" for number in range(1, count + 1)]
        fleet = Fleet(folder, stack)
        for sysid, vehicle in enumerate(names, 1):
            fleet.start(vehicle, commands=I_KNOW + "mavlink_in = true\n", sysid=sysid)
            if sysid % _AT_ONCE == 0:
                fleet.wait(*names[:sysid])
        port = free_port()
        with (
            relay(folder, fleet, "--all", f"udpout:127.0.0.1:{port}") as program,
            MissionPlanner(("127.0.0.1", port), listen=True) as planner,
        ):
            planner.skip_connecting()
            planner.listen(3.0)
            pid, before_s, heard = program.process.pid, cpu_s(program.process.pid), len(planner.received)
            began_at = time.monotonic()
            planner.listen(_WATCHED_S)
            took_s = time.monotonic() - began_at
            percent = 100 * (cpu_s(pid) - before_s) / took_s
            rate = (len(planner.received) - heard) / took_s
            seen = {message.get_srcSystem() for message in planner.messages("HEARTBEAT")}
            print(f"{len(seen)} of {count} vehicles, {rate:.0f} messages/s: {percent:.1f} % of a core", end="")
            print(f", {resident_mb(pid):.0f} MB", flush=True)
            planner.vehicle = count, 1
            for start in range(_TIMES):
                began_at = time.monotonic()
                planner.write(plain_plan(_ITEMS, start=start))
                written_s = time.monotonic() - began_at
                began_at = time.monotonic()
                assert len(planner.read()) == _ITEMS
                print(f"write {written_s:.2f} s, read {time.monotonic() - began_at:.2f} s", flush=True)


if __name__ == "__main__":
    main(int(sys.argv[1]) if len(sys.argv) > 1 else _COUNT)
