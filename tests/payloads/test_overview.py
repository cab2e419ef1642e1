# SPDX-License-Identifier: GPL-3.0-or-later
"""The overview of a vehicle fits 80 bytes, and its numbers never change."""

from contextlib import suppress

import cbor2
from hypothesis import given
from hypothesis import strategies as st

from bridge.model.craft import FlightMode
from payloads.keys import OVERVIEW
from payloads.mission_data import plain
from payloads.overview import CBOR_NUMBERS, overview_of, unpacked
from payloads.payload import Payloads, encode
from reports.vehicle_groups import (
    Attitude,
    Battery,
    Gps,
    Group,
    LastHeard,
    Link,
    MissionIdentity,
    Position,
    Status,
    VehicleReport,
)


def state_of() -> VehicleReport:
    kinds = VehicleReport.__annotations__
    groups = {group.value: kinds[group.value]() for group in Group if group is not Group.LINK}
    groups["status"] = Status(armed=True, mode=max((mode.name for mode in FlightMode), key=len))
    groups["battery"] = Battery(voltage_v=25.2)
    groups["attitude"], groups["gps"] = Attitude(heading_deg=359.4), Gps(fix="3D", ground_speed_m_s=40.2)
    groups["position"] = Position(lat_deg=-45.3838123, lon_deg=-178.4733456, height_m=-1200.4)
    mission = MissionIdentity(146, "deadbeef", "not started")
    return VehicleReport(link=Link(state="MSP"), mission=mission, settings=None, last_heard=LastHeard(), **groups)


def test_the_longest_overview_of_a_day_fits() -> None:
    payloads = Payloads(lambda: 1_777_636_800.123)
    overview = overview_of(plain(state_of()))
    for _ in range(86_400 // 10):
        payloads.head(OVERVIEW)
    sample = encode(OVERVIEW, payloads.head(OVERVIEW) | plain(overview))
    assert len(sample) <= 80
    read = unpacked(sample)
    assert (read["battery_cv"], read["lat_e7"], read["lon_e7"]) == (2520, -453838123, -1784733456)
    assert (read["height_m"], read["mission_count"], read["mission_checksum"]) == (-1200, 146, 0xDEADBEEF)
    assert [read[name] for name in ("heading_deg", "speed_dm_s", "fix", "mission_state")] == [359, 402, 3, 2]


def test_the_numbers_of_the_fields_are_those_published() -> None:
    names = "v seq time_s link armed mode battery_cv lat_e7 lon_e7 height_m mission_count mission_checksum heading_deg"
    assert list(CBOR_NUMBERS) == [*names.split(), "speed_dm_s", "fix", "mission_state"]
    assert list(CBOR_NUMBERS.values()) == list(range(16))


def test_an_unknown_number_is_ignored() -> None:
    assert unpacked(cbor2.dumps({99: "news", 6: 1110})) == {"battery_cv": 1110}


@given(st.binary(max_size=60))
def test_garbage_is_a_value_error(data: bytes) -> None:
    with suppress(ValueError, RecursionError, cbor2.CBORError):
        unpacked(data)
