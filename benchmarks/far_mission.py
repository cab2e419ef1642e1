# SPDX-License-Identifier: GPL-3.0-or-later
"""Mission Planner's Write and Read of 146 items through `fleet mavlink`: `python -m benchmarks.far_mission [RTT_MS]`.

The vehicle is a real daemon with a simulated Naze, behind a proxy that delays every byte to and from the router by half
the round trip. The ground station behaves like Mission Planner and is next to the relay.
"""

import asyncio
import json
import sys
import tempfile
import threading
import time
from contextlib import ExitStack, suppress
from pathlib import Path
from socket import SOCK_STREAM

from tests.service.cli.test_vehicle_relay import relay
from tests.support.fleet_bench import I_KNOW, Fleet
from tests.support.mission_planner import MissionPlanner
from tests.support.plan import judge, plain_plan, records_of
from tests.support.programs import free_port, until

_RTT_MS = 120.0
_COUNT, _TIMES = 146, 3


def main(rtt_ms: float) -> None:
    """Print a line per transfer."""
    with tempfile.TemporaryDirectory() as name, ExitStack() as stack:
        folder = Path(name)
        fleet = Fleet(folder, stack)
        near, port = fleet.router.endpoint, free_port(SOCK_STREAM)
        threading.Thread(target=asyncio.run, args=(_proxy(near, port, rtt_ms / 2e3),), daemon=True).start()
        fleet.router.endpoint = f"tcp/127.0.0.1:{port}"  # for the vehicle alone
        board = fleet.board("kite")
        fleet.start("kite", fc=board.fc, commands=I_KNOW + "mavlink_in = true\n")
        fleet.router.endpoint = near
        until(lambda: fleet.listed().get("kite", {}).get("mission_count") is not None, "the vehicle")
        address = ("127.0.0.1", free_port())
        with relay(folder, fleet, "kite", f"udpin:127.0.0.1:{address[1]}"), MissionPlanner(address) as planner:
            planner.skip_connecting()
            time.sleep(2.0)
            for number in range(_TIMES):
                plan = plain_plan(_COUNT, start=number)
                began_at = time.monotonic()
                planner.write(plan)
                written_s = time.monotonic() - began_at
                assert board.records() == records_of(judge(plan))
                began_at = time.monotonic()
                assert len(planner.read()) == _COUNT
                read_s = time.monotonic() - began_at
                print(json.dumps({"rtt_ms": rtt_ms, "write_s": round(written_s, 2), "read_s": round(read_s, 2)}))


async def _proxy(endpoint: str, port: int, delay_s: float) -> None:
    host, _, to = endpoint.partition("/")[2].rpartition(":")

    async def connected(reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        far_reader, far_writer = await asyncio.open_connection(host, int(to))
        await asyncio.gather(_pass(reader, far_writer, delay_s), _pass(far_reader, writer, delay_s))

    server = await asyncio.start_server(connected, "127.0.0.1", port)
    await server.serve_forever()


async def _pass(reader: asyncio.StreamReader, writer: asyncio.StreamWriter, delay_s: float) -> None:
    loop = asyncio.get_running_loop()
    with suppress(ConnectionError):
        while data := await reader.read(1 << 16):
            loop.call_later(delay_s, writer.write, data)
    writer.close()


if __name__ == "__main__":
    main(float(sys.argv[1]) if len(sys.argv) > 1 else _RTT_MS)
