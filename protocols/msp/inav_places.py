# SPDX-License-Identifier: GPL-3.0-or-later
"""INAV's safehomes over MSP v2, both directions (src/main/fc/fc_msp.c)."""

import struct
from typing import NamedTuple

from protocols.msp.frame import request

SAFEHOME, SET_SAFEHOME = 0x2038, 0x2039
#: MAX_SAFE_HOMES.
SAFEHOMES = 8
_SAFEHOME = struct.Struct("<BBii")
SAFEHOME_SIZE = _SAFEHOME.size


class Safehome(NamedTuple):
    """A place to return to instead of home; degrees * 1e7. number: from 0."""

    number: int
    enabled: bool
    lat_e7: int
    lon_e7: int


def encode_read_safehome(number: int) -> bytes:
    return request(SAFEHOME, bytes((number,)))


def decode_safehome(payload: bytes) -> Safehome | None:
    """Read a reply; None if it is cut."""
    if len(payload) < SAFEHOME_SIZE:
        return None
    number, enabled, lat_e7, lon_e7 = _SAFEHOME.unpack_from(payload)
    return Safehome(number, bool(enabled), lat_e7, lon_e7)
