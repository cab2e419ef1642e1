# SPDX-License-Identifier: GPL-3.0-or-later
"""The floors that need their own program: `python -m benchmarks.floors NAME`.

echo                         sends every UDP datagram back; prints its port
vehicle                      answers heartbeats, and accepts any mission without storing it; prints its port
poll LINK                    polls a flight controller as the idle daemon does, and ignores the replies
attitude LINK PORT MSP=HZ... polls a flight controller at these rates by MSP command, others as often as the daemon
                             itself needs them, and sends each attitude to a UDP port of the loopback
"""

import asyncio
import os
import socket
import struct
import sys
from collections.abc import Callable, Mapping
from math import inf, radians

import serial
from fastcrc.crc16 import mcrf4xx

from bridge.line.poll_schedule import POLLS, Poll
from bridge.vehicle.telemetry_table import TELEMETRY
from protocols.mavlink.codec import FrameWriter, pack
from protocols.mavlink.dialect import CRC_EXTRA, Message
from protocols.mavlink.dialect import messages as m
from protocols.mavlink.frame import MavlinkFrame, MavlinkSplitter
from protocols.msp.commands import Msp

_QUADROTOR = 2
_MSP_REPLY, _MSP_OVERHEAD = b"$M>", 6
_ANGLES = struct.Struct("<3h")
_ATTITUDE = struct.Struct("<BBBBBBBHBI6f")
_ATTITUDE_PAYLOAD = 28
_ATTITUDE_CRC_EXTRA = CRC_EXTRA[m.MAVLINK_MSG_ID_ATTITUDE]


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
        if row.poll is not None:
            intervals[row.poll] = min(row.interval_s, intervals.get(row.poll, inf))
    _ask_all(loop, port, intervals)


def _send_attitudes(loop: asyncio.AbstractEventLoop, link: str, udp_port: int, rates_hz: Mapping[int, float]) -> None:
    """The least that Python can do: one reader, no checks, precompiled formats."""
    port = serial.Serial(link, 115200, timeout=0)
    fileno = port.fileno()
    ground = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
    ground.connect(("127.0.0.1", udp_port))
    ground.setblocking(False)
    waiting = b""
    seq = 0

    def readable() -> None:
        nonlocal waiting, seq
        waiting += os.read(fileno, 4096)
        while len(waiting) >= _MSP_OVERHEAD and len(waiting) >= (size := waiting[3] + _MSP_OVERHEAD):
            reply, waiting = waiting[:size], waiting[size:]
            if reply[4] == Msp.ATTITUDE and reply.startswith(_MSP_REPLY):
                roll_ddeg, pitch_ddeg, heading_deg = _ANGLES.unpack_from(reply, 5)
                angles = radians(roll_ddeg / 10), radians(-pitch_ddeg / 10), radians(heading_deg)
                seq = (seq + 1) & 0xFF
                boot_ms = int(loop.time() * 1000) & 0xFFFFFFFF
                frame = _ATTITUDE.pack(0xFD, _ATTITUDE_PAYLOAD, 0, 0, seq, 1, 1, 30, 0, boot_ms, *angles, 0, 0, 0)
                ground.send(frame + mcrf4xx(frame[1:] + _ATTITUDE_CRC_EXTRA).to_bytes(2, "little"))

    loop.add_reader(fileno, readable)
    _ask_all(loop, port, {command: 1 / rate_hz for command, rate_hz in rates_hz.items()})


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
        case ["echo"]:
            _serve(loop, lambda data: [data])
        case ["vehicle"]:
            _serve(loop, _Vehicle().answers)
        case ["poll", link]:
            _poll(loop, link)
        case ["attitude", link, port, *rates]:
            wanted = (rate.split("=") for rate in rates)
            _send_attitudes(loop, link, int(port), {int(command): float(hz) for command, hz in wanted})
    loop.run_forever()


if __name__ == "__main__":
    main()
