# SPDX-License-Identifier: GPL-3.0-or-later
"""Splits a byte stream into MAVLink 1 and 2 frames (https://mavlink.io/en/guide/serialization.html).

Frames are checked by CRC but not decoded: what is only passed on stays bytes.
"""

import re
from dataclasses import dataclass

from fastcrc.crc16 import mcrf4xx

from protocols.mavlink.message_table import MESSAGE_FORMATS

MAGIC_V1 = 0xFE
MAGIC_V2 = 0xFD
_HEADER_V1 = 6
_HEADER_V2 = 10
_CRC_SIZE = 2
_SIGNATURE_SIZE = 13
_SIGNED = 0x01

_MAGIC = re.compile(rb"[\xfd\xfe]")
#: CRC_EXTRA by what the header says. MAVLink 2: by the message id's bytes; its payload may be shorter than the
#: message, without its trailing zeros, or longer, with extensions that are newer than we are. MAVLink 1: by payload
#: size and message id. It has no extensions, but pymavlink sends them all the same, and mavlink's C parser takes them.
_CRC_EXTRA_V2 = {msgid.to_bytes(3, "little"): bytes((known.crc_extra,)) for msgid, known in MESSAGE_FORMATS.items()}
_CRC_EXTRA_V1 = {
    (size, msgid): bytes((known.crc_extra,))
    for msgid, known in MESSAGE_FORMATS.items()
    if known.base_size is not None
    for size in range(known.base_size, known.full_size + 1)
}


@dataclass(slots=True)  # not frozen: that doubles the price of making one, and thousands are made in a second
class MavlinkFrame:
    """One frame whose CRC is right. `raw` is the whole of it, signature included."""

    raw: bytes

    @property
    def version(self) -> int:
        """1 or 2."""
        return 2 if self.raw[0] == MAGIC_V2 else 1

    @property
    def seq(self) -> int:
        """The sender's running number, 0..255."""
        raw = self.raw
        return raw[4] if raw[0] == MAGIC_V2 else raw[2]

    @property
    def sysid(self) -> int:
        """The sending system."""
        raw = self.raw
        return raw[5] if raw[0] == MAGIC_V2 else raw[3]

    @property
    def compid(self) -> int:
        """The sending component."""
        raw = self.raw
        return raw[6] if raw[0] == MAGIC_V2 else raw[4]

    @property
    def msgid(self) -> int:
        """Which message it is."""
        raw = self.raw
        return raw[7] | raw[8] << 8 | raw[9] << 16 if raw[0] == MAGIC_V2 else raw[5]

    @property
    def is_signed(self) -> bool:
        """Whether a signature follows the CRC; whether that is right is not known here."""
        return self.raw[0] == MAGIC_V2 and bool(self.raw[2] & _SIGNED)

    @property
    def payload(self) -> bytes:
        """The message's bytes; MAVLink 2 leaves trailing zeros out."""
        start = _HEADER_V2 if self.raw[0] == MAGIC_V2 else _HEADER_V1
        return self.raw[start : start + self.raw[1]]


class MavlinkSplitter:
    """Finds frames in a byte stream. Never raises: what is not a frame is counted and skipped.

    After a bad CRC the search goes on ONE byte later: a frame behind a false or cut header is not lost with it.
    A header that cannot be one is given up at once: a message that nobody knows (its frame could not be checked), in
    MAVLink 1 a size that its message cannot have, an incompatibility flag that we do not know (which the protocol
    demands).

    Any other header is believed until its frame is there, or `reset`. A cut frame so holds back what follows it, by as
    many bytes as were cut off, 279 at most. To give out whole frames from within an incomplete one would be wrong: a
    log that is downloaded over MAVLink is full of them.

    No CRC covers a signature. If bytes are missing in it, the next frame has begun within: it is searched like noise.
    """

    def __init__(self) -> None:
        self._buffer = b""
        self.bad_frames = 0  # of a known message, whose CRC was wrong
        self.skipped_bytes = 0

    @property
    def is_waiting(self) -> bool:
        """Whether a frame has begun that is not whole."""
        return bool(self._buffer)

    def feed(self, data: bytes) -> list[MavlinkFrame]:
        """Take bytes as they come and return the frames that they complete."""
        return self._split(self._buffer + data, is_end=False)

    def reset(self) -> list[MavlinkFrame]:
        """Give up on an incomplete frame (silence, end of a datagram); return the frames its bytes were hiding."""
        return self._split(self._buffer, is_end=True)

    def _split(self, data: bytes, *, is_end: bool) -> list[MavlinkFrame]:
        """Return the frames in `data` and keep its incomplete rest; at an end there is no rest.

        All in one loop, without a call per frame but the CRC's: this is what passing a frame on costs.
        """
        frames: list[MavlinkFrame] = []
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
                    if mcrf4xx(data[start + 1 : crc_at] + crc_extra) == data[crc_at] | data[crc_at + 1] << 8:
                        frames.append(MavlinkFrame(data[start:end]))
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
