# SPDX-License-Identifier: GPL-3.0-or-later
"""The cost of hundreds of vehicles for a router: `python -m benchmarks.light_fleet [COUNT...]`.

A light vehicle is a zenoh session that declares the same as a bridge (a liveliness token, its queryables) and publishes
a state and a position of typical size once a second. The sessions share one process; the router runs in another, on the
loopback: $ZENOHD, or the router of the Python package. One subscriber reads everything.
"""

import json
import subprocess
import sys
import tempfile
import time
from contextlib import ExitStack
from functools import partial
from pathlib import Path
from socket import SOCK_STREAM

from benchmarks.processes import ROOT, cpu_s, resident_mb, running, wait_for
from tests.support.programs import NAZE_BRIDGE, free_port
from tests.support.zenoh_router import client, running_router

_COUNTS = (1, 100, 400)
_WATCHED_S = 20.0
#: Each session has its own threads and shakes hands with the router: a second on a busy machine.
_OPENING_S = 1.0
_VEHICLES = """
import json, sys, threading, time, zenoh
endpoint, first, count = sys.argv[1], int(sys.argv[2]), int(sys.argv[3])
config = zenoh.Config()
config.insert_json5("mode", '"client"')
config.insert_json5("connect/endpoints", json.dumps([endpoint]))
config.insert_json5("transport/shared_memory/enabled", "false")
held = []
STATE = json.dumps({"link": {"state": "MSP"}, "as_long_as_usual": 850 * "x"}).encode()
def state_of(key):
    def answer(query):
        with query:
            query.reply(key, STATE, encoding="application/json")
    return answer
for number in range(first, first + count):
    session, own = zenoh.open(config), f"fleet/light-{number}/v1"
    queryables = [session.declare_queryable(f"{own}/{key}", state_of(f"{own}/{key}"))
                  for key in ("state", "mission/current", "mission/list")]
    token = session.liveliness().declare_token(f"{own}/alive/{session.zid()}")
    publishers = [(session.declare_publisher(f"{own}/{key}", congestion_control=zenoh.CongestionControl.DROP), size)
                  for key, size in (("state", 900), ("telemetry/position", 280))]
    held.append((session, queryables, token, publishers))
print("up", flush=True)
while True:
    began_at = time.monotonic()
    for *_, publishers in held:
        for publisher, size in publishers:
            publisher.put(bytes(size))
        time.sleep(0.5 / len(held))
    time.sleep(max(0.0, began_at + 1 - time.monotonic()))
"""


def main(counts: tuple[int, ...]) -> None:
    """Print a line per fleet size."""
    print("vehicles  opened in s  router MB  router CPU %  samples/s  list s  vehicles' process MB")
    for count in counts:
        with tempfile.TemporaryDirectory() as name, ExitStack() as stack:
            endpoint = f"tcp/127.0.0.1:{free_port(SOCK_STREAM)}"
            config = _config(Path(name), endpoint)
            router = stack.enter_context(running_router(Path(name), endpoint, config)).process.pid
            before_mb = resident_mb(router)
            log, began_at = Path(name) / "vehicles.log", time.monotonic()
            command = [sys.executable, "-c", _VEHICLES, endpoint, "0", str(count)]
            vehicles = stack.enter_context(running(command, log))
            wait_for(partial(_is_up, log), "the vehicles are up", _OPENING_S * count + 30)
            opened_s = time.monotonic() - began_at
            received = [0]

            def take(_sample: object, received: list[int] = received) -> None:
                received[0] += 1

            with client(endpoint) as session, session.declare_subscriber("fleet/**", take):
                time.sleep(2.0)
                received[0], before_s = 0, cpu_s(router)
                time.sleep(_WATCHED_S)
                cpu_percent = 100 * (cpu_s(router) - before_s) / _WATCHED_S
                rate_hz = received[0] / _WATCHED_S
            router_mb = resident_mb(router)
            list_s = _listed_s(endpoint, count)
            print(
                f"{count:8} {opened_s:12.1f} {before_mb:5.1f}->{router_mb:.1f} {cpu_percent:9.2f} {rate_hz:12.1f}"
                f" {list_s:7.2f} {resident_mb(vehicles.pid):10.1f}",
                flush=True,
            )


def _is_up(log: Path) -> bool:
    return b"up" in log.read_bytes()


def _config(folder: Path, endpoint: str) -> Path:
    """Write the router's configuration, which admits more sessions than zenoh's own."""
    path = folder / "router.json5"
    settings = {
        "mode": "router",
        "listen": {"endpoints": [endpoint]},
        "scouting": {"multicast": {"enabled": False}},
        "transport": {"unicast": {"max_sessions": 12000, "accept_pending": 1000}, "shared_memory": {"enabled": False}},
    }
    path.write_text(json.dumps(settings))
    return path


def _listed_s(endpoint: str, count: int) -> float:
    began_at = time.monotonic()
    command = [*NAZE_BRIDGE, "fleet", "list", "--json", "--connect", endpoint]
    listed = subprocess.run(command, cwd=ROOT, capture_output=True, check=True)
    took_s = time.monotonic() - began_at
    found = len(json.loads(listed.stdout)["vehicles"])
    if found != count:
        print(f"only {found} of {count} are listed", flush=True)
    return took_s


if __name__ == "__main__":
    main(tuple(map(int, sys.argv[1:])) or _COUNTS)
