# SPDX-License-Identifier: GPL-3.0-or-later
"""Recognises FrSky hub telemetry, as Harakiri sends it at 9600 baud while armed with tele_prot 1 (the telemetry.c).

A value is 0x5E, an id and two bytes; 0x5E and 0x5D among these are sent as 0x5D and the byte XOR 0x60. One more 0x5E
ends a group of values. There is no checksum, so no value is read.
"""

FRSKY_SPEED = 9600
_MARK = b"\x5e"
_ESCAPES = ((b"\x5d\x3e", b"\x5e"), (b"\x5d\x3d", b"\x5d"))
#: All ids of the hub protocol are below this.
_LAST_ID = 0x3F
_VALUE_SIZE, _LONGEST = 3, 5


class FrskyWatch:
    """Feed bytes. `values_in_a_row`: consecutive values without a foreign byte between them."""

    def __init__(self) -> None:
        self.values_in_a_row = 0
        self._rest = b""

    def feed(self, data: bytes) -> None:
        *whole, rest = (self._rest + data).split(_MARK)
        for value in whole:
            if value:
                self.values_in_a_row = self.values_in_a_row + 1 if _is_value(value) else 0
        if len(rest) > _LONGEST:
            self.values_in_a_row = 0
        self._rest = rest[: _LONGEST + 1]


def _is_value(sent: bytes) -> bool:
    for escape, byte in _ESCAPES:
        sent = sent.replace(escape, byte)
    return len(sent) == _VALUE_SIZE and sent[0] <= _LAST_ID
