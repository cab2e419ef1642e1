# SPDX-License-Identifier: GPL-3.0-or-later
"""Splits a byte stream into MAVLink 1 and 2 frames (https://mavlink.io/en/guide/serialization.html).

Frames are checked by CRC but not decoded: forwarding needs only the bytes.
"""

import re
from collections.abc import Iterable
from dataclasses import dataclass

from fastcrc.crc16 import mcrf4xx

from protocols.mavlink.dialect import MESSAGE_FORMATS

MAGIC_V1 = 0xFE
MAGIC_V2 = 0xFD
_HEADER_V1 = 6
_HEADER_V2 = 10
_CRC_SIZE = 2
_SIGNATURE_SIZE = 13
_SIGNED = 0x01
_HEARTBEAT, _HEARTBEAT_SIZE = 0, 9
_AUTOPILOT, _NO_AUTOPILOT = 5, 8
_BASE_MODE, _SAFETY_ARMED = 6, 0x80

_MAGIC = re.compile(rb"[\xfd\xfe]")
#: CRC_EXTRA by header fields. MAVLink 2: by the message id's bytes. The payload may be shorter than the message,
#: without trailing zeros, or longer, with newer extensions. MAVLink 1: by payload size and message id. It lacks
#: extensions, but pymavlink sends them anyway, and mavlink's C parser accepts them.
_CRC_EXTRA_V2 = {msgid.to_bytes(3, "little"): bytes((known.crc_extra,)) for msgid, known in MESSAGE_FORMATS.items()}
_CRC_EXTRA_V1 = {
    (size, msgid): bytes((known.crc_extra,))
    for msgid, known in MESSAGE_FORMATS.items()
    if known.base_size is not None
    for size in range(known.base_size, known.full_size + 1)
}
#: Offsets of target_system and target_component in the payload, by the message id's bytes in the header: three in
#: MAVLink 2, one in MAVLink 1.
_TARGETS = {
    msgid.to_bytes(size, "little"): (known.target_system_at, known.target_component_at)
    for msgid, known in MESSAGE_FORMATS.items()
    if known.target_system_at is not None
    for size in (1, 3)
    if msgid < 256**size
}


@dataclass(slots=True)  # not frozen: that doubles the time to create one, and there are thousands per second
class MavlinkFrame:
    """A frame with a valid CRC. `raw` is the whole frame, signature included."""

    raw: bytes

    @property
    def version(self) -> int:
        return 2 if self.raw[0] == MAGIC_V2 else 1

    @property
    def seq(self) -> int:
        """The sender's sequence number, 0..255."""
        raw = self.raw
        return raw[4] if raw[0] == MAGIC_V2 else raw[2]

    @property
    def sysid(self) -> int:
        raw = self.raw
        return raw[5] if raw[0] == MAGIC_V2 else raw[3]

    @property
    def compid(self) -> int:
        raw = self.raw
        return raw[6] if raw[0] == MAGIC_V2 else raw[4]

    @property
    def sender(self) -> tuple[int, int]:
        raw = self.raw
        return (raw[5], raw[6]) if raw[0] == MAGIC_V2 else (raw[3], raw[4])

    @property
    def msgid(self) -> int:
        raw = self.raw
        return raw[7] | raw[8] << 8 | raw[9] << 16 if raw[0] == MAGIC_V2 else raw[5]

    @property
    def target(self) -> tuple[int, int]:
        """The target system and component. 0 means all: the message lacks the field, or MAVLink 2 has omitted it."""
        raw = self.raw
        is_v2 = raw[0] == MAGIC_V2
        places = _TARGETS.get(raw[7:10] if is_v2 else raw[5:6])
        if places is None:
            return 0, 0
        start = _HEADER_V2 if is_v2 else _HEADER_V1
        size = raw[1]
        system_at, component_at = places
        system = raw[start + system_at] if system_at < size else 0
        component = raw[start + component_at] if component_at is not None and component_at < size else 0
        return system, component

    @property
    def has_target_field(self) -> bool:
        raw = self.raw
        return (raw[7:10] if raw[0] == MAGIC_V2 else raw[5:6]) in _TARGETS

    @property
    def is_signed(self) -> bool:
        """True if a signature follows the CRC. It is not checked here."""
        return self.raw[0] == MAGIC_V2 and bool(self.raw[2] & _SIGNED)

    @property
    def payload(self) -> bytes:
        """The message's bytes. MAVLink 2 omits trailing zeros."""
        start = _HEADER_V2 if self.raw[0] == MAGIC_V2 else _HEADER_V1
        return self.raw[start : start + self.raw[1]]


def kinds(frames: Iterable[bytes]) -> list[bytes]:
    """The bytes of each whole frame's header that hold the sender and message id."""
    return [frame[5:10] if frame[0] == MAGIC_V2 else frame[3:6] for frame in frames]


def is_plausible_heartbeat(frame: MavlinkFrame) -> bool:
    """True for a HEARTBEAT with legal length, type, autopilot, state and version (common.xml): evidence of MAVLink."""
    if frame.msgid != _HEARTBEAT or len(payload := frame.payload) != _HEARTBEAT_SIZE:
        return False
    vehicle_type, autopilot, _, state, version = payload[4:]
    return version == 3 and vehicle_type <= 45 and autopilot <= 20 and state <= 8 and frame.sysid != 0


def is_autopilot_heartbeat(frame: MavlinkFrame) -> bool:
    """True for an autopilot's HEARTBEAT: not a camera's, a gimbal's or a radio's."""
    return is_plausible_heartbeat(frame) and frame.payload[_AUTOPILOT] != _NO_AUTOPILOT


def is_disarmed_heartbeat(frame: MavlinkFrame) -> bool:
    """True for a HEARTBEAT whose base_mode lacks the bit SAFETY_ARMED."""
    return is_plausible_heartbeat(frame) and not frame.payload[_BASE_MODE] & _SAFETY_ARMED


class MavlinkSplitter:
    """Finds frames in a byte stream. Never raises: other bytes are counted and skipped.

    >>> for frame in splitter.feed(port.read(512)):
    ...     print(frame.sender, frame.msgid, frame.target)

    After a CRC failure the search resumes ONE byte later, so a frame behind a false or truncated header is not lost.
    A header is rejected at once if its message is unknown (the CRC could not be checked), if a MAVLink 1 size does
    not fit the message, or if it has an unknown incompatibility flag, as the protocol requires.

    Any other header is trusted until its frame is complete, or until `is_end`. A truncated frame therefore delays at
    most 279 following bytes. Frames inside an incomplete frame are not returned: a log downloaded over MAVLink contains
    whole frames as data.

    Signatures lack a CRC. If part of it is missing, the next frame starts inside it, so it is scanned like noise.
    """

    def __init__(self) -> None:
        self._buffer = b""
        self.bad_frames = 0  # of a known message, with a wrong CRC
        self.skipped_bytes = 0

    @property
    def is_waiting(self) -> bool:
        """True while a frame is incomplete."""
        return bool(self._buffer)

    def feed(self, data: bytes, *, is_end: bool = False) -> list[MavlinkFrame]:
        """Take received bytes. Return the completed frames.

        `is_end` (silence, end of a datagram): drop an incomplete frame, and find those in its bytes.
        """
        return [*map(MavlinkFrame, self.split(data, is_end=is_end))]

    def split(self, data: bytes, *, is_end: bool = False) -> list[bytes]:
        """Like feed, for frames that are only forwarded.

        One loop, without a call per frame except the CRC's: this is the main cost of forwarding a frame.
        """
        data = self._buffer + data
        frames: list[bytes] = []
        start, size = 0, len(data)
        while start < size:
            magic = data[start]
            crc_extra = None
            if magic == MAGIC_V2:
                if start + _HEADER_V2 + _CRC_SIZE <= size:
                    crc_at = start + _HEADER_V2 + data[start + 1]
                    end = crc_at + _CRC_SIZE
                    flags = data[start + 2]
                    if flags == _SIGNED:
                        end += _SIGNATURE_SIZE
                    if flags <= _SIGNED:
                        crc_extra = _CRC_EXTRA_V2.get(data[start + 7 : start + 10])
                elif not is_end:
                    break
            elif magic == MAGIC_V1:
                if start + _HEADER_V1 + _CRC_SIZE <= size:
                    crc_at = start + _HEADER_V1 + data[start + 1]
                    end = crc_at + _CRC_SIZE
                    crc_extra = _CRC_EXTRA_V1.get((data[start + 1], data[start + 5]))
                elif not is_end:
                    break
            if crc_extra is not None:
                if end <= size:
                    # The CRC of bytes that end in their own CRC is 0.
                    if not mcrf4xx(data[start + 1 : crc_at] + crc_extra + data[crc_at : crc_at + _CRC_SIZE]):
                        frames.append(data[start:end])
                        start = end
                        if end > crc_at + _CRC_SIZE:
                            start -= _SIGNATURE_SIZE
                            self.skipped_bytes -= _SIGNATURE_SIZE
                        continue
                    self.bad_frames += 1
                elif not is_end:
                    break
            found = _MAGIC.search(data, start + 1)
            following = found.start() if found else size
            self.skipped_bytes += following - start
            start = following
        self._buffer = data[start:]
        return frames
