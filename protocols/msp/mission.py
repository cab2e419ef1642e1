# SPDX-License-Identifier: GPL-3.0-or-later
"""Harakiri's mission extension: the records, requests and replies (docs/msp-mission.md)."""

import struct
from collections.abc import Sequence
from dataclasses import dataclass
from enum import IntEnum, IntFlag
from typing import Any, NamedTuple

from protocols.mission_item import ListIdentity
from protocols.msp.frame import clean_masked_request, masked_request, request

VERSION = 1
#: Mask, place and records of a CHUNK must fit a frame's 255 bytes.
MAX_CHUNK_RECORDS = 15


class MissionCommand(IntEnum):
    """MSP command numbers of the extension."""

    INFO = 190
    BEGIN = 191
    CHUNK = 192
    COMMIT = 193
    ABORT = 194
    READ = 195
    RADIUS = 196


class ReplyStatus(IntEnum):
    """The result of a request: the first byte of every reply."""

    OK = 0
    SAME = 1
    ARMED = 2
    BUSY = 3
    NO_TRANSFER = 4
    SEQUENCE = 5
    NO_SPACE = 6
    RANGE = 7
    CHECKSUM = 8
    INCOMPLETE = 9
    FLASH = 10
    BAD_REQUEST = 11
    BAD_RECORD = 12


_LAST_STATUS = max(ReplyStatus)


class InfoFlag(IntFlag):
    """Flags of an INFO reply."""

    ARMED = 1
    WRITE_PENDING = 2
    TRANSFER_OPEN = 4
    WRITES_SPENT = 8


_RECORD = struct.Struct("<iihhBBbB")
_INFO = struct.Struct("<BBBBBBHHIHHHI")
#: Replies to BEGIN, CHUNK and COMMIT.
_PROGRESS = struct.Struct("<BHI")
_LIST = struct.Struct("<HI")
#: Reply to READ, before the records: the first's number.
_SHORT = struct.Struct("<BH")

#: Payload size of an INFO reply of version 1.
INFO_SIZE = _INFO.size
RECORD_SIZE = _RECORD.size


class WpCommand(IntEnum):
    """The command of a record (MavlnkCommand in floppy.c)."""

    WAYPOINT = 0
    LOITER_UNLIM = 1
    LOITER_TURNS = 2
    LOITER_TIME = 3
    RETURN_TO_LAUNCH = 4
    LAND = 5
    TAKEOFF = 6
    SETROI = 7


class WpRecord(NamedTuple):
    """One record, `wp_t` in mw.h. Its number is the position in the list, record 0 is the home point.

    lat_e7, lon_e7: degrees * 1e7. height_m: above the launch point. roi_heading: 1 = nose to the region of interest.
    time: LOITER_TIME seconds 1..255, WAYPOINT 1 = brake. radius_m: hit radius. turns: LOITER_TURNS, negative CCW.
    `command` is a plain int because a flight controller may have an unknown number.
    """

    lat_e7: int
    lon_e7: int
    height_m: int
    roi_heading: int
    time: int
    radius_m: int
    turns: int
    command: int

    def pack(self) -> bytes:
        """The 16 bytes. Raises struct.error if a field does not fit, which is a bug in the caller."""
        return _RECORD.pack(*self)


def unpack_records(data: bytes) -> list[WpRecord]:
    """Read every complete record in `data`. A shorter rest is ignored."""
    whole = len(data) - len(data) % RECORD_SIZE
    return [WpRecord(*fields) for fields in _RECORD.iter_unpack(data[:whole])]


class Info(NamedTuple):
    """The flight controller's state and limits. Radius in cm, timeout in ms."""

    version: int
    flags: InfoFlag
    chunk_records: int
    chunk_window: int
    read_records: int
    capacity: int
    stored: ListIdentity
    wp_radius_cm: int
    inter_byte_timeout_ms: int
    staged: int
    flash_writes: int


class Staged(NamedTuple):
    """Reply to BEGIN and CHUNK: the next expected record, and the checksum of those staged before it."""

    status: ReplyStatus
    next: int
    checksum: int


class Stored(NamedTuple):
    """Reply to COMMIT: the list now in flash."""

    status: ReplyStatus
    stored: ListIdentity


class Records(NamedTuple):
    """Reply to READ."""

    status: ReplyStatus
    first: int
    records: Sequence[WpRecord]


def decode_info(payload: bytes) -> Info | None:
    """Read an INFO reply. Returns None if it is shorter than version 1 or does not make sense."""
    reply = _reply(_INFO, payload)
    if reply is None:
        return None
    status, version, flags, chunk, window, read, capacity, count, checksum, *rest = reply
    if status is not ReplyStatus.OK or not (version and chunk and window and read):
        return None
    return Info(version, InfoFlag(flags & 15), chunk, window, read, capacity, ListIdentity(count, checksum), *rest)


def decode_progress(payload: bytes) -> Staged | None:
    """Read the reply to BEGIN or CHUNK."""
    reply = _reply(_PROGRESS, payload)
    return None if reply is None else Staged(*reply)


def decode_stored(payload: bytes) -> Stored | None:
    reply = _reply(_PROGRESS, payload)
    return None if reply is None else Stored(reply[0], ListIdentity(*reply[1:]))


def decode_records(payload: bytes) -> Records | None:
    reply = _reply(_SHORT, payload)
    return None if reply is None else Records(reply[0], reply[1], unpack_records(payload[_SHORT.size :]))


def _reply(layout: struct.Struct, payload: bytes) -> tuple[Any, ...] | None:
    """The status and the other fields, or None if the payload is too short or the status unknown."""
    if len(payload) < layout.size or payload[0] > _LAST_STATUS:
        return None
    status, *fields = layout.unpack_from(payload)
    return ReplyStatus(status), *fields


def encode_begin(identity: ListIdentity) -> bytes:
    """Encode BEGIN for a list. An empty one clears the stored list."""
    return masked_request(MissionCommand.BEGIN, _LIST.pack(identity.count, identity.checksum))


def encode_commit(identity: ListIdentity) -> bytes:
    return masked_request(MissionCommand.COMMIT, _LIST.pack(identity.count, identity.checksum))


def encode_read(first: int, count: int) -> bytes:
    return masked_request(MissionCommand.READ, struct.pack("<HBB", first, count, 0))


@dataclass(frozen=True, slots=True)
class Chunk:
    """An encoded CHUNK request, and the records in it."""

    first: int
    count: int
    frame: bytes


def encode_chunk(packed: bytes, first: int, most: int) -> Chunk:
    """Encode the largest clean CHUNK of at most `most` of the `packed` records (15 fit a frame) from `first` on."""
    for count in range(min(most, MAX_CHUNK_RECORDS, len(packed) // RECORD_SIZE - first), 0, -1):
        body = first.to_bytes(2, "little") + packed[first * RECORD_SIZE : (first + count) * RECORD_SIZE]
        frame = clean_masked_request(MissionCommand.CHUNK, body)
        if frame is not None:
            return Chunk(first, count, frame)
    raise AssertionError("a chunk of one record always has a mask")


INFO_REQUEST = request(MissionCommand.INFO)
ABORT_REQUEST = request(MissionCommand.ABORT)
