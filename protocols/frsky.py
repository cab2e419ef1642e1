# SPDX-License-Identifier: GPL-3.0-or-later
"""Recognises FrSky hub telemetry, which an armed Harakiri with tele_prot 1 sends at 9600 baud (Harakiri: telemetry.c).

A value is 0x5E, an id, two bytes; 0x5E and 0x5D within it are sent as 0x5D and the byte XOR 0x60. Nothing here is read:
the values are meant for a radio. There is no checksum, so only a run of whole values is evidence.
"""

FRSKY_SPEED = 9600
_MARK = 0x5E
_ESCAPE = 0x5D
#: The ids that the hub protocol has are below this.
_LAST_ID = 0x3F
_VALUE_SIZE = 3


class FrskyWatch:
    """Counts whole values that follow each other without a byte in between that does not belong there."""

    def __init__(self) -> None:
        self.values_in_a_row = 0
        self._value = bytearray()
        self._escaped = False
        self._inside = False

    def feed(self, data: bytes) -> None:
        """Take bytes as they come."""
        for byte in data:
            if byte == _MARK:
                # A frame's last mark and the next value's first one follow each other.
                self._end()
            elif not self._inside:
                self.values_in_a_row = 0
            elif byte == _ESCAPE and not self._escaped:
                self._escaped = True
            else:
                self._value.append(byte ^ 0x60 if self._escaped else byte)
                self._escaped = False
                if len(self._value) > _VALUE_SIZE:
                    self._break()

    def _end(self) -> None:
        if self._inside and self._value:
            if len(self._value) == _VALUE_SIZE and self._value[0] <= _LAST_ID:
                self.values_in_a_row += 1
            else:
                self.values_in_a_row = 0
        self._value.clear()
        self._escaped = False
        self._inside = True

    def _break(self) -> None:
        self.values_in_a_row = 0
        self._value.clear()
        self._inside = False
