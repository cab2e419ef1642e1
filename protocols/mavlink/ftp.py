# SPDX-License-Identifier: GPL-3.0-or-later
"""MAVLink FTP is not offered: requests get a NAK at once (https://mavlink.io/en/services/ftp.html)."""

import struct
from collections.abc import Sequence

_HEADER = struct.Struct("<HBBBBBBI")
_PAYLOAD_SIZE = 251
_NAK = 129
_LIST_DIRECTORY, _OPEN_FILE_RO, _CALC_FILE_CRC32 = 3, 4, 14
_FILE_NOT_FOUND = bytes((10,))
#: FailErrno and EOPNOTSUPP. Mission Planner ignores "unknown command" and repeats its request for 70 s.
_NOT_SUPPORTED = bytes((2, 95))
#: By opcode. Without its parameter file QGroundControl requests the parameters one by one; after any other error it
#: waits 5 s and tries again.
_ERRORS = dict.fromkeys((_LIST_DIRECTORY, _OPEN_FILE_RO, _CALC_FILE_CRC32), _FILE_NOT_FOUND)


def refuse(payload: Sequence[int]) -> list[int] | None:
    """The payload of the NAK to a request's payload; None if it is not a request."""
    request = bytes(payload)
    if len(request) < _HEADER.size:
        return None
    seq, session, opcode, *_ = _HEADER.unpack_from(request)
    if opcode >= _NAK - 1:
        return None
    error = _ERRORS.get(opcode, _NOT_SUPPORTED)
    header = _HEADER.pack((seq + 1) & 0xFFFF, session, _NAK, len(error), opcode, 0, 0, 0)
    return list((header + error).ljust(_PAYLOAD_SIZE, b"\0"))
