# SPDX-License-Identifier: GPL-3.0-or-later
"""MAVLink FTP is not offered: requests get a NAK at once (https://mavlink.io/en/services/ftp.html)."""

import struct
from collections.abc import Sequence

_HEADER = struct.Struct("<HBBBBBBI")
_PAYLOAD_SIZE = 251
_NAK = 129
#: The only code that ends Mission Planner's request: it ignores "unknown command" and repeats for 70 s.
_FAIL_ERRNO = 2
_EOPNOTSUPP = 95


def refuse(payload: Sequence[int]) -> list[int] | None:
    """Return the payload of the NAK to a request's payload; None if it is not a request."""
    request = bytes(payload)
    if len(request) < _HEADER.size:
        return None
    seq, session, opcode, *_ = _HEADER.unpack_from(request)
    if opcode >= _NAK - 1:
        return None
    header = _HEADER.pack((seq + 1) & 0xFFFF, session, _NAK, 2, opcode, 0, 0, 0)
    return list((header + bytes((_FAIL_ERRNO, _EOPNOTSUPP))).ljust(_PAYLOAD_SIZE, b"\0"))
