# SPDX-License-Identifier: GPL-3.0-or-later
"""The overview of a vehicle fits 60 bytes and has only recent values."""

from bridge.model.flight_mode import FlightMode
from bridge.model.vehicle_groups import Battery, Group, Link, MissionIdentity, Position, Status, VehicleReport
from payloads import compact
from payloads.keys import OVERVIEW, PayloadEncoding
from payloads.overview import overview_of
from payloads.payload import Payloads, plain


def state_of(age_s: float | None) -> VehicleReport:
    kinds = VehicleReport.__annotations__
    groups = {group.value: kinds[group.value]() for group in Group if group is not Group.LINK}
    groups["status"] = Status(armed=True, mode=max((mode.name for mode in FlightMode), key=len), age_s=age_s)
    groups["battery"] = Battery(voltage_v=25.2, age_s=age_s)
    groups["position"] = Position(lat_deg=-45.3838123, lon_deg=-178.4733456, height_m=-1200.4, age_s=age_s)
    return VehicleReport(link=Link(state="MSP"), mission=MissionIdentity(146, "deadbeef"), settings=None, **groups)


def test_the_longest_overview_of_a_day_fits() -> None:
    payloads = Payloads(PayloadEncoding.JSON, lambda: 1_777_636_800.123)
    overview = overview_of(plain(state_of(1.0)))
    for _ in range(86_400 // 10):
        payloads.head(OVERVIEW)
    sample = payloads.encode(OVERVIEW, payloads.head(OVERVIEW) | plain(overview))
    assert len(sample) <= 60
    read = compact.loads("overview", sample)
    assert (read["battery_cv"], read["lat_e7"], read["lon_e7"]) == (2520, -453838123, -1784733456)
    assert (read["height_m"], read["mission_count"], read["mission_checksum"]) == (-1200, 146, 0xDEADBEEF)


def test_old_values_are_omitted() -> None:
    for age_s in (None, 11.0):
        overview = overview_of(plain(state_of(age_s)))
        assert (overview.armed, overview.mode, overview.battery_cv, overview.lat_e7) == (None, None, None, None)
        assert (overview.link, overview.mission_count) == ("MSP", 146)
