# SPDX-License-Identifier: GPL-3.0-or-later
"""A ground station whose own time is not counted: frames are packed beforehand, clocks read next to the socket."""

import socket
import time
from collections.abc import Sequence
from contextlib import suppress
from dataclasses import dataclass

from benchmarks.processes import BenchmarkError
from protocols.mavlink.codec import FrameWriter, item_message, pack
from protocols.mavlink.dialect import messages
from protocols.mavlink.frame import MavlinkFrame, MavlinkSplitter
from protocols.mission_item import MissionItem, MissionResult

_SYSID, _COMPID = 255, 190
_VEHICLE = (1, 1)
_TIMEOUT_S = 10.0


@dataclass(frozen=True, slots=True)
class Upload:
    """The times of one upload, seconds.

    steps: from each item but the last to the request that answers it. total: from MISSION_COUNT to the final ack.
    last_item_to_ack: while the list is pushed and verified.
    """

    steps: list[float]
    total: float
    last_item_to_ack: float


class Station:
    """One UDP socket, connected to the loopback's `port`; it waits for `link_s` before it sends anything."""

    def __init__(self, port: int, link_s: float = 0.0) -> None:
        self._link_s = link_s
        self._writer = FrameWriter(_SYSID, _COMPID)
        self._socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self._socket.connect(("127.0.0.1", port))
        self._socket.settimeout(_TIMEOUT_S)

    def close(self) -> None:
        self._socket.close()

    def upload(self, items: Sequence[MissionItem]) -> Upload:
        """Write a mission; BenchmarkError if it is not accepted unchanged."""
        count = messages.MAVLink_mission_count_message(*_VEHICLE, len(items))
        frames = [self._writer.frame(pack(item_message(item, *_VEHICLE, as_int=True)), 2) for item in items]
        steps: list[float] = []
        drain(self._socket)  # the final ack of an earlier upload is sent three times
        began_at = sent_at = self._send(self._writer.frame(pack(count), 2))
        for seq, frame in enumerate(frames):
            request, received_at = self._receive(messages.MAVLINK_MSG_ID_MISSION_REQUEST)
            if (asked := int.from_bytes(request.raw[10:12], "little")) != seq:
                raise BenchmarkError(f"item {asked} was asked for instead of {seq}")
            if seq:
                steps.append(received_at - sent_at)
            sent_at = self._send(frame)
        ack, received_at = self._receive(messages.MAVLINK_MSG_ID_MISSION_ACK)
        # target system, target component, result; MAVLink 2 leaves trailing zeros out, and ACCEPTED is zero.
        if ack.raw[1] > 2 and ack.raw[12] != MissionResult.ACCEPTED:
            raise BenchmarkError(f"the mission was not accepted: result {ack.raw[12]}")
        return Upload(steps, received_at - began_at, received_at - sent_at)

    def echo(self, size: int) -> float:
        """Send a datagram to an echo server; returns the round trip, seconds."""
        sent_at = self._send(bytes(size))
        self._socket.recv(2048)
        return time.perf_counter() - sent_at

    def _send(self, frame: bytes) -> float:
        if self._link_s:
            time.sleep(self._link_s)
        sent_at = time.perf_counter()
        self._socket.send(frame)
        return sent_at

    def _receive(self, msgid: int) -> tuple[MavlinkFrame, float]:
        """Wait for a message; telemetry is skipped."""
        while True:
            datagram = self._socket.recv(2048)
            received_at = time.perf_counter()
            for frame in MavlinkSplitter().feed(datagram):
                if frame.msgid == msgid:
                    return frame, received_at
                if frame.msgid == messages.MAVLINK_MSG_ID_MISSION_ACK:
                    raise BenchmarkError("the upload was refused")


def drain(ground: socket.socket) -> None:
    """Drop all datagrams received so far; the following ones are waited for."""
    ground.setblocking(False)
    with suppress(BlockingIOError):
        while True:
            ground.recv(2048)
    ground.settimeout(_TIMEOUT_S)
