# SPDX-License-Identifier: GPL-3.0-or-later
"""INAV's own settings decide whether it arms, and at what height it flies."""

import struct

import pytest

from protocols.msp.inav_places import FEATURE, SET_GEOZONE, SET_GEOZONE_VERTEX
from protocols.msp.nav import NavAction
from simulator.board.msp_options import MspOptions
from simulator.board.options import Faults
from simulator.inav.boxes import BOXES
from simulator.inav.boxes import NAV_WP as WP_MODE
from simulator.inav.places import SET_FEATURE
from tests.support.msp_bench import MspBench, waypoint

INAV_STATUS, EEPROM_WRITE = 0x2000, 250
NAV_WP = 1 << 13
LAT, LON = 453838000, 84733000


def blockers(bench: MspBench) -> int:
    """The arming flags of MSP2_INAV_STATUS that prevent arming."""
    flags: int = struct.unpack_from("<I", bench.payload_v2(INAV_STATUS), 9)[0]
    return flags & ~0b1100


@pytest.mark.parametrize(
    ("first", "within_m", "flags"),
    [
        (waypoint(8), 100, 0),
        (waypoint(12), 100, 1 << 11),
        (waypoint(12), 0, 0),
        (waypoint(12), 200, 0),
        (waypoint(12, NavAction.SET_POI), 100, 1 << 11),
        (waypoint(0, NavAction.RTH, lat_e7=0, lon_e7=0), 100, 0),
    ],
)
def test_a_first_waypoint_that_is_too_far_prevents_arming(first: object, within_m: int, flags: int) -> None:
    bench = MspBench("inav", faults=Faults(boxes=0))
    bench.set("nav_wp_max_safe_distance", within_m)
    bench.upload([first, waypoint(90)])  # type: ignore[list-item]
    assert blockers(bench) == flags
    bench.faults.armed = True
    bench.run(0.5)
    assert bench.board.armed == (not flags)


@pytest.mark.parametrize(
    ("version", "enforced_cm", "flown_m"), [("9.1.0", 0, 15.0), ("9.1.0", 100, 20.0), ("7.1.2", 0, 20.0)]
)
def test_a_leg_is_flown_no_higher_than_nav_max_altitude_unless_heights_are_enforced(
    version: str, enforced_cm: int, flown_m: float
) -> None:
    bench = MspBench("inav", MspOptions(version=version), faults=Faults(boxes=0))
    bench.set("nav_max_altitude", 1500)
    bench.set("nav_wp_enforce_altitude", enforced_cm)
    bench.upload([waypoint(8)])
    bench.faults.armed, bench.faults.boxes = True, 1 << BOXES[version].index(WP_MODE)
    bench.run(60)
    truth = bench.board.truth(bench.now)
    assert truth is not None
    assert truth.flight.height_m == pytest.approx(flown_m)


def with_zone(kind: int, lat: int, radius_cm: int, *, feature: bool = True) -> MspBench:
    """Restarted with one circular zone."""
    bench = MspBench("inav", faults=Faults(boxes=0))
    features = int.from_bytes(bench.payload(FEATURE), "little") | feature << 4
    assert bench.payload(SET_FEATURE, features.to_bytes(4, "little")) == b""
    assert bench.payload_v2(SET_GEOZONE, struct.pack("<BBBiiBBB", 0, kind, 0, 0, 0, 0, 0, 2)) == b""
    assert bench.payload_v2(SET_GEOZONE_VERTEX, struct.pack("<BBiii", 0, 0, lat, LON, radius_cm)) == b""
    assert blockers(bench) == 0
    assert bench.payload(EEPROM_WRITE) == b""
    bench.restart()
    return bench


@pytest.mark.parametrize(
    ("kind", "lat", "radius_cm", "feature", "flags"),
    [
        (0, LAT, 5000, True, 1 << 6),
        (0, LAT, 5000, False, 0),
        (0, LAT + 90_000, 5000, True, 0),
        (1, LAT, 5000, True, 0),
        (1, LAT + 90_000, 5000, True, 1 << 6),
        (1, LAT + 270_000, 5000, True, 0),
    ],
)
def test_a_geozone_prevents_arming_after_the_next_boot(
    kind: int, lat: int, radius_cm: int, feature: bool, flags: int
) -> None:
    """Inside of an exclusive one, or outside of an inclusive one that is up to 2 km away; if the feature is on."""
    assert blockers(with_zone(kind, lat, radius_cm, feature=feature)) == flags


def test_a_repeated_vertex_is_added_twice_and_turns_all_zones_off() -> None:
    bench = with_zone(0, LAT, 5000)
    assert bench.payload_v2(SET_GEOZONE_VERTEX, struct.pack("<BBiii", 0, 0, LAT, LON, 5000)) == b""
    assert bench.payload(EEPROM_WRITE) == b""
    bench.restart()
    assert blockers(bench) == 0
