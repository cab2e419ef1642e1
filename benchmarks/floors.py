# SPDX-License-Identifier: GPL-3.0-or-later
"""The floors that need their own program: `python -m benchmarks.floors echo`, or `... poll LINK`.

echo        sends every UDP datagram back; prints its port
poll LINK   asks a flight controller what the idle daemon asks it, as often, and looks at nothing that comes back
"""

import asyncio
import os
import socket
import sys
from math import inf

import serial

from bridge.fc.msp_telemetry import POLL_FOR
from bridge.line.poll_schedule import POLLS, Poll
from bridge.vehicle.telemetry_table import TELEMETRY


def _echo(loop: asyncio.AbstractEventLoop) -> None:
    port = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
    port.bind(("127.0.0.1", 0))
    port.setblocking(False)

    def readable() -> None:
        data, sender = port.recvfrom(2048)
        port.sendto(data, sender)

    loop.add_reader(port, readable)
    print(port.getsockname()[1], flush=True)


def _poll(loop: asyncio.AbstractEventLoop, link: str) -> None:
    port = serial.Serial(link, 115200, timeout=0)
    loop.add_reader(port.fileno(), lambda: os.read(port.fileno(), 4096))

    def ask(poll: Poll, interval_s: float) -> None:
        os.write(port.fileno(), poll.frame)
        loop.call_later(interval_s, ask, poll, interval_s)

    for poll in POLLS:
        interval_s = min(poll.needed_s, *(row.interval_s for row in TELEMETRY if POLL_FOR[row.reading] is poll.command))
        if interval_s < inf:
            ask(poll, interval_s)


def main() -> None:
    """Run until SIGTERM."""
    loop = asyncio.new_event_loop()
    match sys.argv[1:]:
        case ["echo"]:
            _echo(loop)
        case ["poll", link]:
            _poll(loop, link)
    loop.run_forever()


if __name__ == "__main__":
    main()
