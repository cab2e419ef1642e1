"""Splits a byte stream into MAVLink 1 and 2 frames (https://mavlink.io/en/guide/serialization.html).

Frames are checked by CRC but not decoded: what is only passed on stays bytes.
"""

from dataclasses import dataclass

from fastcrc.crc16 import mcrf4xx

from protocols.mavlink.dialect import CRC_EXTRA

MAGIC_V1 = 0xFE
MAGIC_V2 = 0xFD
_HEADER_V1 = 6
_HEADER_V2 = 10
_CRC_SIZE = 2
_SIGNATURE_SIZE = 13
_SIGNED = 0x01


@dataclass(frozen=True, slots=True)
class MavlinkFrame:
    """One frame whose CRC is right. `raw` is the whole of it, signature included."""

    version: int
    seq: int
    sysid: int
    compid: int
    msgid: int
    raw: bytes

    @property
    def payload(self) -> bytes:
        """The message's bytes; MAVLink 2 leaves trailing zeros out."""
        start = _HEADER_V1 if self.version == 1 else _HEADER_V2
        return self.raw[start : start + self.raw[1]]


class MavlinkSplitter:
    """Finds frames in a byte stream. Never raises: what is not a frame is counted and skipped.

    After a bad CRC the search goes on ONE byte later: a frame behind a false or cut header is not lost with it.
    Frames of unknown messages cannot be checked and are skipped in the same way; so are frames that
    announce an incompatibility flag that we do not know, as the protocol demands.
    """

    def __init__(self) -> None:
        self._buffer = bytearray()
        self.bad_frames = 0
        self.skipped_bytes = 0

    def feed(self, data: bytes) -> list[MavlinkFrame]:
        """Take bytes as they come and return the frames that they complete."""
        buffer = self._buffer
        buffer += data
        frames: list[MavlinkFrame] = []
        start = 0
        size = len(buffer)
        while start < size:
            magic = buffer[start]
            if magic == MAGIC_V1:
                header = _HEADER_V1
            elif magic == MAGIC_V2:
                header = _HEADER_V2
            else:
                self.skipped_bytes += 1
                start += 1
                continue
            if size - start < header:
                break
            end = start + header + buffer[start + 1] + _CRC_SIZE
            if magic == MAGIC_V2:
                flags = buffer[start + 2]
                if flags & ~_SIGNED:
                    self._skip_bad()
                    start += 1
                    continue
                if flags & _SIGNED:
                    end += _SIGNATURE_SIZE
            frame = self._check(start, header) if end <= size else None
            if end > size:
                break
            if frame is None:
                self._skip_bad()
                start += 1
                continue
            frames.append(frame)
            start = end
        del buffer[:start]
        return frames

    def reset(self) -> list[MavlinkFrame]:
        """Give up on an incomplete frame (silence, end of a datagram); return the frames its bytes were hiding."""
        frames: list[MavlinkFrame] = []
        while self._buffer:
            self.skipped_bytes += 1
            rest = bytes(self._buffer[1:])
            self._buffer.clear()
            frames += self.feed(rest)
        return frames

    def _skip_bad(self) -> None:
        self.bad_frames += 1
        self.skipped_bytes += 1

    def _check(self, start: int, header: int) -> MavlinkFrame | None:
        buffer = self._buffer
        crc_at = start + header + buffer[start + 1]
        if header == _HEADER_V1:
            version, seq, sysid, compid, msgid = 1, *buffer[start + 2 : start + 6]
        else:
            version, (seq, sysid, compid) = 2, buffer[start + 4 : start + 7]
            msgid = int.from_bytes(buffer[start + 7 : start + 10], "little")
        crc_extra = CRC_EXTRA.get(msgid)
        if crc_extra is None:
            return None
        crc = mcrf4xx(bytes(buffer[start + 1 : crc_at]) + bytes((crc_extra,)))
        if crc != int.from_bytes(buffer[crc_at : crc_at + _CRC_SIZE], "little"):
            return None
        signed = version == 2 and buffer[start + 2] & _SIGNED
        end = crc_at + _CRC_SIZE + (_SIGNATURE_SIZE if signed else 0)
        return MavlinkFrame(version, seq, sysid, compid, msgid, bytes(buffer[start:end]))
