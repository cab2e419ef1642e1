# SPDX-License-Identifier: GPL-3.0-or-later
"""The overview of a vehicle fits 80 bytes."""

from bridge.model.craft import FlightMode
from payloads import compact
from payloads.keys import OVERVIEW, PayloadEncoding
from payloads.mission_data import plain
from payloads.overview import overview_of
from payloads.payload import Payloads
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
    payloads = Payloads(PayloadEncoding.JSON, lambda: 1_777_636_800.123)
    overview = overview_of(plain(state_of()))
    for _ in range(86_400 // 10):
        payloads.head(OVERVIEW)
    sample = payloads.encode(OVERVIEW, payloads.head(OVERVIEW) | plain(overview))
    assert len(sample) <= 80
    read = compact.loads("overview", sample)
    assert (read["battery_cv"], read["lat_e7"], read["lon_e7"]) == (2520, -453838123, -1784733456)
    assert (read["height_m"], read["mission_count"], read["mission_checksum"]) == (-1200, 146, 0xDEADBEEF)
    assert [read[name] for name in ("heading_deg", "speed_dm_s", "fix", "mission_state")] == [359, 402, 3, 2]
