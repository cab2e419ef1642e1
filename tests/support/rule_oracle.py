# SPDX-License-Identifier: GPL-3.0-or-later
"""A second implementation of docs/mission-rules.md, as different as possible: no table, no record type.

The document does not say which of several faults is reported, so a rejection is the set of acceptable codes.
"""

import math
import struct
from collections.abc import Sequence

from protocols.mission_item import MissionItem

INVALID_FRAME, NO_SPACE, INVALID, BAD_LAT, BAD_LON, BAD_HEIGHT = 2, 4, 5, 10, 11, 12


def expected(
    items: Sequence[MissionItem], capacity: int, radius_cm: int, takeoff_max: int, fallback: tuple[int, int] | None
) -> set[int] | list[bytes]:
    """The acceptable codes, or the records; without records the list is cleared."""
    if len(items) == 0:
        return []
    if len(items) == 1:
        one = items[0]
        zeros = all(value in (0, None) or value != value for value in (one.p1, one.p2, one.p3, one.p4, one.alt_m))
        blank = zeros and (one.lat_e7 in (0, None) or one.lon_e7 in (0, None))
        return [] if one.command == 16 and one.frame in (3, 6) and blank else {INVALID}
    if len(items) > capacity:
        return {NO_SPACE}
    faults = set().union(*(faults_as_received(items, n, fallback) for n in range(len(items))))
    if faults:
        return faults
    kept: list[tuple[int, bytes]] = []
    roi = False
    for n, it in enumerate(items):
        if it.command == 197:
            roi = False
        made = record(it, n, radius_cm, takeoff_max, roi, fallback)
        if made is None:
            continue
        roi = roi or it.command in (80, 195, 201)
        kept.append((it.command, made))
    commands = [command for command, _ in kept[1:]]
    if commands and commands[-1] in (80, 195, 201):
        return {INVALID}
    if [c for c in commands if c not in (80, 195, 201)] in ([20], [21], [22]):
        return {INVALID}
    return [made for _, made in kept] if commands else []


def faults_as_received(items: Sequence[MissionItem], n: int, fallback: tuple[int, int] | None) -> set[int]:
    it, last = items[n], len(items) - 1
    faults = set()
    located = it.command in (16, 17, 18, 19, 80, 195, 201)
    used = located or it.command in (20, 21, 22)
    lost = located and n > 0 and (it.lat_e7 in (0, None) or it.lon_e7 in (0, None))
    lost = lost or (it.command in (16, 17, 18, 19, 22) and n > 0 and not math.isfinite(it.alt_m))
    if used and not lost and it.frame not in (0, 3, 5, 6, 10, 11) and (it.frame != 2 or located):
        faults.add(INVALID_FRAME)
    if (n == 0 and it.command != 16) or (it.command in (17, 21) and n < last) or (it.command == 22 and n != 1):
        faults.add(INVALID)
    if it.command in (80, 195, 201) and n == last:
        faults.add(INVALID)
    if located and it.lat_e7 is not None and not -900000000 <= it.lat_e7 <= 900000000:
        faults.add(BAD_LAT)
    if located and it.lon_e7 is not None and not -1800000000 <= it.lon_e7 <= 1800000000:
        faults.add(BAD_LON)
    if n == 0 and not math.isfinite(it.alt_m):
        faults.add(BAD_HEIGHT)
    if n == 0 and fallback is None and (it.lat_e7 in (0, None) or it.lon_e7 in (0, None)):
        faults.add(BAD_LAT)
    return faults


def whole(value: float) -> int:
    return 0 if math.isnan(value) or math.isinf(value) else int(value)


def record(
    it: MissionItem, n: int, radius_cm: int, takeoff_max: int, roi: bool, fallback: tuple[int, int] | None
) -> bytes | None:
    lat, lon = it.lat_e7 or 0, it.lon_e7 or 0
    if n == 0 and fallback and (lat == 0 or lon == 0):
        lat, lon = fallback
    if it.command not in (16, 17, 18, 19, 20, 21, 22, 80, 195, 201):
        return None
    if it.command in (16, 17, 18, 19, 80, 195, 201) and (lat == 0 or lon == 0):
        return None
    if it.command in (16, 17, 18, 19, 22) and not math.isfinite(it.alt_m):
        return None
    height = sorted((-32767, whole(it.alt_m), 32767))[1]
    height = 2 if height == 0 else height
    smallest = 0
    while smallest * 100 < radius_cm and smallest < 255:
        smallest += 1
    radius = sorted((smallest, whole(it.p2), 255))[1]
    nose = 1 if roi and whole(it.p4) >= 1 else 0
    match it.command:
        case 16:
            fields = (lat, lon, height, nose, 1 if whole(it.p1) >= 1 else 0, radius, 0, 0)
        case 17:
            fields = (lat, lon, height, nose, 0, radius, 0, 1)
        case 18:
            turns = sorted((-127, whole(it.p1), 127))[1]
            fields = (lat, lon, height, 0, 0, radius, turns if turns else 1, 2)
        case 19:
            fields = (lat, lon, height, nose, sorted((1, whole(it.p1), 255))[1], radius, 0, 3)
        case 20:
            fields = (0, 0, height, 0, 0, 0, 0, 4)
        case 21:
            fields = (0, 0, 0, 0, 0, 0, 0, 5)
        case 22:
            fields = (0, 0, sorted((2, whole(it.alt_m), takeoff_max))[1], 0, 0, 0, 0, 6)
        case _:
            fields = (lat, lon, 0, 0, 0, 0, 0, 7)
    return struct.pack("<iihhBBbB", *fields)
