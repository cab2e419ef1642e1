# SPDX-License-Identifier: GPL-3.0-or-later
"""TE MS5611-01BA03, barometer (data sheet, "Commands"; application note AN520 for the checksum of its PROM)."""

import random

ADDRESS = 0x77
_READ_ADC, _READ_PROM = 0x00, 0xA0
#: The coefficients and the conversions of the data sheet's example: 20 degrees, 1000 hPa.
_PROM = (0x1234, 40127, 36924, 23317, 23282, 33464, 28312)
_PRESSURE, _TEMPERATURE = 9_085_466, 8_569_150
_PRESSURE_NOISE = 100


class Ms5611:
    """In still air. `noise` is added to the pressure."""

    def __init__(self, noise: random.Random) -> None:
        self._noise = noise
        self._prom = b"".join(word.to_bytes(2, "big") for word in (*_PROM, _checksum(_PROM)))
        self._command = 0
        self._awaits_command = False
        self._converted = 0
        self._answer = b""

    def begin(self, is_read: bool) -> None:
        """Begin a transfer: a write starts with a command, a read gets the last command's result."""
        self._awaits_command = not is_read
        if is_read:
            self._answer = self._read_command()

    def write(self, byte: int) -> None:
        """Receive a command; further bytes are ignored."""
        if not self._awaits_command:
            return
        self._awaits_command = False
        self._command = byte
        match byte & 0xF0:
            case 0x40:  # pressure
                self._converted = self._pressure()
            case 0x50:  # temperature
                self._converted = _TEMPERATURE

    def _pressure(self) -> int:
        return _PRESSURE + self._noise.randint(-_PRESSURE_NOISE, _PRESSURE_NOISE)

    def read(self) -> int:
        byte, self._answer = self._answer[:1], self._answer[1:]
        return byte[0] if byte else 0

    def _read_command(self) -> bytes:
        if self._command == _READ_ADC:
            return self._converted.to_bytes(3, "big")
        if self._command & 0xF0 == _READ_PROM:
            at = self._command & 0x0E
            return self._prom[at : at + 2]
        return b""


def converted_pressure(pressure_pa: float) -> int:
    """The converter's value at a pressure and the example's temperature (the data sheet's formulas, solved for D1)."""
    _, sensitivity, offset, sensitivity_slope, offset_slope, reference, _ = _PROM
    difference = _TEMPERATURE - reference * 2**8
    off = offset * 2**16 + offset_slope * difference / 2**7
    sens = sensitivity * 2**15 + sensitivity_slope * difference / 2**8
    return round((pressure_pa * 2**15 + off) * 2**21 / sens)


def _checksum(words: tuple[int, ...]) -> int:
    """The last word of the PROM, whose low four bits are a CRC over the seven others (AN520)."""
    remainder = 0
    for word in (*words, 0):
        for byte in divmod(word, 256):
            remainder ^= byte
            for _ in range(8):
                remainder = remainder << 1 ^ (0x3000 if remainder & 0x8000 else 0)
            remainder &= 0xFFFF
    return remainder >> 12
