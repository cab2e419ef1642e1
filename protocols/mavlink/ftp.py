# SPDX-License-Identifier: GPL-3.0-or-later
"""MAVLink FTP, the reading half: virtual files, no folders (https://mavlink.io/en/services/ftp.html). Sans-IO.

Requests that write are refused. A path names one of the virtual files, or does not exist.
"""

import struct
from collections.abc import Callable, Iterator, Sequence
from enum import IntEnum
from zlib import crc32

from protocols.plain_text import plain_text

_HEADER = struct.Struct("<HBBBBBBI")
_PAYLOAD_SIZE, _OPCODE_AT = 251, 3
MOST_DATA = _PAYLOAD_SIZE - _HEADER.size
#: Packets of one burst. The client asks for the next.
_BURST = 16
_ACK, _NAK = 128, 129
#: FailErrno and EOPNOTSUPP. Mission Planner ignores "unknown command" and repeats its request for 70 s.
_NOT_SUPPORTED = bytes((2, 95))
_INVALID_SESSION, _END_OF_FILE, _FILE_NOT_FOUND = bytes((4,)), bytes((6,)), bytes((10,))
_SIZE = struct.Struct("<I")
_INVERTED = 0xFFFFFFFF


class FtpOp(IntEnum):
    """Opcodes of requests."""

    NONE = 0
    TERMINATE_SESSION = 1
    RESET_SESSIONS = 2
    LIST_DIRECTORY = 3
    OPEN_FILE_RO = 4
    READ_FILE = 5
    CALC_FILE_CRC32 = 14
    BURST_READ_FILE = 15


class FtpSession:
    """The one file that a ground station has open. `find`: the content of a path, or None if there is none.

    The station chooses the session's number, mostly 0, because Mission Planner does not look at the one in the reply.
    """

    def __init__(self, find: Callable[[str], bytes | None]) -> None:
        self._find = find
        self._file: bytes | None = None

    def answer(self, payload: Sequence[int]) -> Iterator[list[int]]:
        """The payloads of the replies to a request's payload, or none if it is not a request."""
        request = bytes(payload)
        if len(request) < _HEADER.size:
            return
        seq, session, opcode, size, _, _, _, offset = _HEADER.unpack_from(request)
        if opcode >= _ACK:
            return
        data = request[_HEADER.size : _HEADER.size + size]

        def reply(kind: int, body: bytes = b"", at: int = 0, number: int = 0, *, is_last: bool = False) -> list[int]:
            fields = ((seq + 1 + number) & 0xFFFF, session, kind, len(body), opcode, is_last, 0, at)
            return list((_HEADER.pack(*fields) + body).ljust(_PAYLOAD_SIZE, b"\0"))

        match opcode:
            case FtpOp.NONE:
                yield reply(_ACK)
            case FtpOp.TERMINATE_SESSION | FtpOp.RESET_SESSIONS:
                self._file = None
                yield reply(_ACK)
            case FtpOp.OPEN_FILE_RO | FtpOp.CALC_FILE_CRC32:
                found = self._find(plain_text(data.split(b"\0")[0]))
                if found is None:
                    yield reply(_NAK, _FILE_NOT_FOUND)
                elif opcode == FtpOp.CALC_FILE_CRC32:
                    yield reply(_ACK, _SIZE.pack(file_crc32(found)))
                else:
                    self._file = found
                    yield reply(_ACK, _SIZE.pack(len(found)))
            case FtpOp.READ_FILE | FtpOp.BURST_READ_FILE:
                yield from self._read(
                    reply, offset, min(size or MOST_DATA, MOST_DATA), is_burst=opcode == FtpOp.BURST_READ_FILE
                )
            case FtpOp.LIST_DIRECTORY:
                yield reply(_NAK, _FILE_NOT_FOUND)
            case _:
                yield reply(_NAK, _NOT_SUPPORTED)

    def _read(self, reply: Callable[..., list[int]], offset: int, size: int, *, is_burst: bool) -> Iterator[list[int]]:
        if self._file is None:
            yield reply(_NAK, _INVALID_SESSION)
        elif offset >= len(self._file):
            yield reply(_NAK, _END_OF_FILE)
        else:
            ends = range(offset, len(self._file), size)[: _BURST if is_burst else 1]
            for number, at in enumerate(ends):
                yield reply(_ACK, self._file[at : at + size], at, number, is_last=is_burst and at == ends[-1])


def is_opening(payload: Sequence[int]) -> bool:
    """True if a request's payload asks for a file."""
    return len(payload) >= _HEADER.size and payload[_OPCODE_AT] == FtpOp.OPEN_FILE_RO


def refuse(payload: Sequence[int]) -> list[int] | None:
    """The payload of the NAK to a station without rights, or None if it is not a request."""
    return next(FtpSession(lambda _path: None).answer(payload), None)


def file_crc32(data: bytes) -> int:
    """MAVLink's checksum of a file: zlib's without its two inversions."""
    return crc32(data, _INVERTED) ^ _INVERTED
