# SPDX-License-Identifier: GPL-3.0-or-later
"""Frames that a TCP client has not read yet; above a limit the oldest telemetry is dropped first."""

from collections import deque

from protocols.mavlink.dialect import messages as m
from protocols.mavlink.frame import MavlinkSplitter

#: Never dropped, because they are not sent again: a transfer, command or parameter would fail. Files and logs are
#: not among them: they fill the queue at once, and their reader asks again for missing parts.
_KEPT = frozenset(
    {
        m.MAVLINK_MSG_ID_PARAM_VALUE,
        m.MAVLINK_MSG_ID_PARAM_EXT_VALUE,
        m.MAVLINK_MSG_ID_PARAM_EXT_ACK,
        m.MAVLINK_MSG_ID_MISSION_REQUEST_PARTIAL_LIST,
        m.MAVLINK_MSG_ID_MISSION_WRITE_PARTIAL_LIST,
        m.MAVLINK_MSG_ID_MISSION_ITEM,
        m.MAVLINK_MSG_ID_MISSION_REQUEST,
        m.MAVLINK_MSG_ID_MISSION_REQUEST_LIST,
        m.MAVLINK_MSG_ID_MISSION_COUNT,
        m.MAVLINK_MSG_ID_MISSION_CLEAR_ALL,
        m.MAVLINK_MSG_ID_MISSION_ITEM_REACHED,
        m.MAVLINK_MSG_ID_MISSION_ACK,
        m.MAVLINK_MSG_ID_MISSION_REQUEST_INT,
        m.MAVLINK_MSG_ID_MISSION_ITEM_INT,
        m.MAVLINK_MSG_ID_COMMAND_LONG,
        m.MAVLINK_MSG_ID_COMMAND_INT,
        m.MAVLINK_MSG_ID_COMMAND_ACK,
        m.MAVLINK_MSG_ID_AUTOPILOT_VERSION,
        m.MAVLINK_MSG_ID_MESSAGE_INTERVAL,
        m.MAVLINK_MSG_ID_STATUSTEXT,
    }
)


class SendQueue:
    """At most `limit` bytes. A partly sent frame stays whole."""

    def __init__(self, limit: int) -> None:
        self._limit = limit
        self._size = 0
        self._telemetry_size = 0
        self._chunks: deque[tuple[bytes, bool]] = deque()
        self._sent = 0  # of the first chunk
        self.dropped = 0

    def __bool__(self) -> bool:
        return bool(self._chunks)

    def add(self, chunk: bytes) -> bool:
        """Append whole frames; False if they fit only by dropping some that must be kept."""
        kept = any(frame.msgid in _KEPT for frame in MavlinkSplitter().feed(chunk))
        self._chunks.append((chunk, kept))
        self._size += len(chunk)
        self._telemetry_size += 0 if kept else len(chunk)
        if self._size > self._limit:
            self._drop_telemetry()
        return self._size <= self._limit

    def first(self) -> memoryview:
        return memoryview(self._chunks[0][0])[self._sent :]

    def sent(self, size: int) -> None:
        chunk, kept = self._chunks[0]
        self._sent += size
        if self._sent == len(chunk):
            self._sent = 0
            self._chunks.popleft()
            self._forget(chunk, kept)

    def _drop_telemetry(self) -> None:
        """Drop the older half of the telemetry: one at a time would cost a search for each new frame."""
        began = [self._chunks.popleft()] if self._sent else []
        kept_size = self._size - self._telemetry_size
        spared = min(self._telemetry_size // 2, self._limit - kept_size)
        rest: deque[tuple[bytes, bool]] = deque(began)
        for chunk, kept in self._chunks:
            if kept or self._telemetry_size <= spared:
                rest.append((chunk, kept))
            else:
                self._forget(chunk, kept)
                self.dropped += 1
        self._chunks = rest

    def _forget(self, chunk: bytes, kept: bool) -> None:
        self._size -= len(chunk)
        self._telemetry_size -= 0 if kept else len(chunk)
