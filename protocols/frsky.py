# SPDX-License-Identifier: GPL-3.0-or-later
"""FrSky hub telemetry as Harakiri sends it at 9600 baud while armed with tele_prot 1 (Harakiri: telemetry.c).

A value is 0x5E, an id and two bytes, low byte first; 0x5E and 0x5D among these are sent as 0x5D and the byte XOR 0x60.
One more 0x5E ends a group of values. There is no checksum, so a group counts only if it has exactly the values that
Harakiri sends together, each within its range.
"""

from collections.abc import Mapping
from dataclasses import dataclass

FRSKY_SPEED = 9600
_MARK = 0x5E
_ESCAPE = 0x5D
_ESCAPED = {0x3E: 0x5E, 0x3D: 0x5D}
#: All ids of the hub protocol are below this.
_LAST_ID = 0x3F
_VALUE_SIZE = 3
#: No group has more values than this.
_LONGEST_GROUP = 10

_TEMPERATURE, _CELL, _VOLTS, _DECIVOLTS = 0x02, 0x06, 0x3A, 0x3B
_HEIGHT_M, _HEIGHT_CM, _HEADING, _HEADING_FRACTION = 0x10, 0x21, 0x14, 0x1C
_LATITUDE, _LONGITUDE = (0x13, 0x1B, 0x23), (0x12, 0x1A, 0x22)
_SIGNS = {(_LATITUDE, ord("N")): 1, (_LATITUDE, ord("S")): -1, (_LONGITUDE, ord("E")): 1, (_LONGITUDE, ord("W")): -1}
_HEIGHT_GROUP = (_HEIGHT_M, _HEIGHT_CM, _HEADING, _HEADING_FRACTION)
_POWER, _PLACE = (_CELL, _VOLTS, _DECIVOLTS), (*_LATITUDE, *_LONGITUDE)
#: Without a voltage sensor or a GPS, its values are missing.
_SLOW_GROUPS = {(_TEMPERATURE, *power, *place) for power in ((), _POWER) for place in ((), _PLACE)}
#: Groups that are complete with their last value. Harakiri pauses for 0.1 s after most of them: if they counted only
#: when the next group begins, climb and speed would be derived from the wrong times.
_WHOLE_GROUPS = {_HEIGHT_GROUP, (_TEMPERATURE, *_POWER, *_PLACE)}
_CELLS = range(2, 7)


@dataclass(frozen=True, slots=True)
class FrskyReport:
    """One group: height and heading twice a second, or voltage and position once a second. None: not sent, or unknown.

    height_m: above the launch point; Harakiri sends 0 for every height below it, so 0 is unknown. heading_deg: whole
    degrees, 0 without a compass. voltage_v: to 0.1 V. place_e7: degrees * 1e7, to 1/10000 of a minute, also after the
    GPS has lost its fix.
    """

    height_m: float | None = None
    heading_deg: int | None = None
    voltage_v: float | None = None
    place_e7: tuple[int, int] | None = None


class FrskyParser:
    """Finds values and groups among other bytes."""

    def __init__(self) -> None:
        #: Consecutive values without a foreign byte between them.
        self.values_in_a_row = 0
        self._group: list[tuple[int, int]] = []
        self._value = bytearray()
        self._is_escaped = False
        self._inside = False

    def feed(self, data: bytes) -> list[FrskyReport]:
        """Take bytes as they come. A group is complete when it has its last value, or when the next one begins."""
        reports = []
        for byte in data:
            if byte == _MARK:
                report = self._mark()
                if report is not None:
                    reports.append(report)
            elif not self._inside:
                self.values_in_a_row = 0
            elif byte == _ESCAPE and not self._is_escaped:
                self._is_escaped = True
            else:
                self._add(byte)
        return reports

    def _add(self, byte: int) -> None:
        value = _ESCAPED.get(byte) if self._is_escaped else byte
        self._is_escaped = False
        if value is None or len(self._value) == _VALUE_SIZE:
            self._break()
            self._inside = False
        else:
            self._value.append(value)

    def _mark(self) -> FrskyReport | None:
        """End a value; a mark right after a mark ends a group."""
        report = None
        if self._is_escaped or len(self._value) not in (0, _VALUE_SIZE):
            self._break()
        elif self._value:
            self._end_value()
            if tuple(identifier for identifier, _ in self._group) in _WHOLE_GROUPS:
                report = self._end_group()
        elif self._inside:
            report = self._end_group()
        self._value.clear()
        self._inside = True
        return report

    def _end_value(self) -> None:
        identifier, low, high = self._value
        if identifier > _LAST_ID or len(self._group) == _LONGEST_GROUP:
            self._break()
            return
        self.values_in_a_row += 1
        self._group.append((identifier, high << 8 | low))

    def _end_group(self) -> FrskyReport | None:
        report = _read(self._group)
        self._group.clear()
        return report

    def _break(self) -> None:
        self.values_in_a_row = 0
        self._group.clear()
        self._value.clear()
        self._is_escaped = False


def _read(group: list[tuple[int, int]]) -> FrskyReport | None:
    """Other groups (acceleration, minutes and seconds since the start) are not used."""
    identifiers, values = tuple(identifier for identifier, _ in group), dict(group)
    if identifiers == _HEIGHT_GROUP:
        return _read_height(values)
    if identifiers in _SLOW_GROUPS:
        return FrskyReport(voltage_v=_voltage_v(values), place_e7=_place_e7(values))
    return None


def _read_height(values: Mapping[int, int]) -> FrskyReport | None:
    metres, centimetres, heading = values[_HEIGHT_M], values[_HEIGHT_CM], values[_HEADING]
    if metres > 0x7FFF or centimetres >= 100 or heading >= 360 or values[_HEADING_FRACTION]:
        return None
    return FrskyReport((metres * 100 + centimetres) / 100 or None, heading)


def _voltage_v(values: Mapping[int, int]) -> float | None:
    """The voltage is sent times 110/21, and divided by the number of cells: both must agree."""
    if _CELL not in values:
        return None
    # 10 tenths are possible: Harakiri rounds up without carrying.
    volts, tenths, cell = values[_VOLTS], values[_DECIVOLTS], values[_CELL]
    battery_dv = round((volts * 10 + tenths) * 21 / 11)
    number, cell_dv = cell >> 4 & 0xF, ((cell & 0xF) << 8 | cell >> 8) / 50
    agrees = any(abs(battery_dv - cells * cell_dv) <= cells for cells in _CELLS if number < cells)
    return battery_dv / 10 if battery_dv and tenths <= 10 and agrees else None


def _place_e7(values: Mapping[int, int]) -> tuple[int, int] | None:
    latitude, longitude = _angle_e7(_LATITUDE, values, 90), _angle_e7(_LONGITUDE, values, 180)
    return (latitude, longitude) if latitude and longitude else None


def _angle_e7(identifiers: tuple[int, int, int], values: Mapping[int, int], limit: int) -> int | None:
    """Degrees and minutes as dddmm, the minutes' next four digits, and N, S, E or W."""
    whole, fraction, letter = (values.get(identifier, -1) for identifier in identifiers)
    degrees, minutes = divmod(whole, 100)
    sign = _SIGNS.get((identifiers, letter))
    if sign is None or not (0 <= degrees < limit and minutes < 60 and fraction < 10_000):
        return None
    return sign * round((degrees * 600_000 + minutes * 10_000 + fraction) * 1000 / 60)
