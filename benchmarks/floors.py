# SPDX-License-Identifier: GPL-3.0-or-later
"""The floors that need their own program: `python -m benchmarks.floors NAME`.

vehicle    answers heartbeats, and accepts any mission without storing it; prints its port
poll LINK  polls a flight controller as the idle daemon does, and ignores the replies
"""

import asyncio
import os
import socket
import sys
from collections.abc import Callable, Mapping
from math import inf

import serial

from bridge.fc.profile import POLL_FOR
from bridge.line.poll_schedule import POLLS, Poll
from bridge.vehicle.telemetry_table import TELEMETRY
from protocols.mavlink.codec import FrameWriter, pack
from protocols.mavlink.dialect import Message
from protocols.mavlink.dialect import messages as m
from protocols.mavlink.frame import MavlinkFrame, MavlinkSplitter

_QUADROTOR = 2


def _serve(loop: asyncio.AbstractEventLoop, answers: Callable[[bytes], list[bytes]]) -> None:
    port = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
    port.bind(("127.0.0.1", 0))
    port.setblocking(False)

    def readable() -> None:
        data, sender = port.recvfrom(2048)
        for answer in answers(data):
            port.sendto(answer, sender)

    loop.add_reader(port, readable)
    print(port.getsockname()[1], flush=True)


class _Vehicle:
    """An ideal vehicle for one ground station at a time."""

    def __init__(self) -> None:
        self._writer = FrameWriter(1, 1)
        self._count = self._seq = 0

    def answers(self, data: bytes) -> list[bytes]:
        """The frames that answer a datagram."""
        answers = [self._answer(frame) for frame in MavlinkSplitter().feed(data)]
        return [self._writer.frame(pack(answer), 2) for answer in answers if answer is not None]

    def _answer(self, frame: MavlinkFrame) -> Message | None:
        match frame.msgid:
            case m.MAVLINK_MSG_ID_HEARTBEAT:
                return m.MAVLink_heartbeat_message(_QUADROTOR, m.MAV_AUTOPILOT_ARDUPILOTMEGA, 0, 0, 3, 3)
            case m.MAVLINK_MSG_ID_MISSION_COUNT:
                self._count, self._seq = int.from_bytes(frame.payload[:2], "little"), 0
            case m.MAVLINK_MSG_ID_MISSION_ITEM_INT:
                self._seq += 1
            case _:
                return None
        if self._seq < self._count:
            return m.MAVLink_mission_request_message(frame.sysid, frame.compid, self._seq)
        return m.MAVLink_mission_ack_message(frame.sysid, frame.compid, m.MAV_MISSION_ACCEPTED)


def _poll(loop: asyncio.AbstractEventLoop, link: str) -> None:
    port = serial.Serial(link, 115200, timeout=0)
    loop.add_reader(port.fileno(), lambda: os.read(port.fileno(), 4096))
    intervals: dict[int, float] = {}
    for row in TELEMETRY:
        if row.reading is not None and (poll := POLL_FOR.get(row.reading)) is not None:
            intervals[poll] = min(row.interval_s, intervals.get(poll, inf))
    _ask_all(loop, port, intervals)


def _ask_all(loop: asyncio.AbstractEventLoop, port: serial.Serial, intervals_s: Mapping[int, float]) -> None:
    """Send each poll at its interval, or as often as the daemon itself needs it."""

    def ask(poll: Poll, interval_s: float, due: float) -> None:
        os.write(port.fileno(), poll.frame)
        loop.call_at(due + interval_s, ask, poll, interval_s, due + interval_s)

    for poll in POLLS:
        interval_s = min(poll.needed_s, intervals_s.get(poll.command, inf))
        if interval_s < inf:
            ask(poll, interval_s, loop.time())


def main() -> None:
    loop = asyncio.new_event_loop()
    match sys.argv[1:]:
        case ["vehicle"]:
            _serve(loop, _Vehicle().answers)
        case ["poll", link]:
            _poll(loop, link)
    loop.run_forever()


if __name__ == "__main__":
    main()
