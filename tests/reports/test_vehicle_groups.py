# SPDX-License-Identifier: GPL-3.0-or-later
"""Each published group has the same values as the MAVLink messages made from the same vehicle.

Both are compared as received: messages from a packed frame, groups from JSON and CBOR. A null in a group is unknown
in MAVLink, and a value that MAVLink omits as stale is null.
"""

import math
from dataclasses import dataclass
from typing import Any

from hypothesis import given
from hypothesis import strategies as st
from pymavlink.dialects.v20 import ardupilotmega as m

from bridge.bridge import Bridge
from bridge.model.craft import FlightMode, Home
from bridge.model.ground_track import bearing_deg, distance_m
from bridge.model.vehicle import (
    STALE_S,
    Charge,
    Fix,
    FlightState,
    GlobalPosition,
    GpsFix,
    Health,
    Height,
    Mode,
    Orientation,
    Power,
    Reading,
    Signal,
    Source,
    Sticks,
    Vehicle,
)
from bridge.vehicle import vehicle_messages as make
from bridge.vehicle.vehicle_messages import Maker
from payloads.keys import TELEMETRY
from payloads.mission_data import plain
from payloads.payload import Payloads, decoded, encode, encoding_of
from protocols.mavlink.codec import FrameWriter, pack
from protocols.msp.telemetry import Sensor
from reports.vehicle_groups import Group
from tests.bridge.vehicle.test_vehicle_messages import battery_mv
from tests.support.world import World

NOW = 100.0
U16 = 0xFFFF
ROUNDED = 0.0051


def number(low: float, high: float) -> st.SearchStrategy[float]:
    return st.floats(low, high)


def readings(kind: type[Reading], **values: st.SearchStrategy[Any]) -> st.SearchStrategy[Reading | None]:
    ages = st.sampled_from([0.0, 0.3, STALE_S - 0.01, STALE_S + 0.2, 90.0])
    return st.none() | st.builds(kind, heard_at=ages.map(lambda age: NOW - age), source=st.just(Source.MSP), **values)


VELOCITY = st.tuples(number(-90, 90), number(-90, 90)) | st.just((None, None))
POSITIONS = st.builds(
    lambda place, velocity: place and GlobalPosition(*place, *velocity),
    st.none()
    | st.tuples(
        st.sampled_from([NOW, NOW - 0.5, NOW - 60]),
        st.just(Source.MSP),
        st.integers(-850000000, 850000000),
        st.integers(-1800000000, 1799999999),
        number(-400, 8000),
    ),
    VELOCITY,
)
READINGS = st.tuples(
    readings(
        Orientation,
        roll_deg=number(-180, 180),
        pitch_deg=number(-90, 90),
        heading_deg=number(0, 359.999),
        is_north_known=st.booleans(),
    ),
    readings(
        GpsFix,
        fix=st.sampled_from(Fix),
        satellites=st.none() | st.integers(0, 40),
        ground_speed_m_s=st.none() | number(0, 600),
        course_deg=st.none() | number(0, 359.999),
        hdop=st.none() | number(0, 99),
    ),
    POSITIONS,
    readings(Height, height_m=number(-500, 5000), climb_m_s=number(-100, 100)),
    readings(Power, voltage_v=st.none() | number(0.1, 60), current_a=st.none() | number(0, 300)),
    readings(Charge, drawn_mah=st.integers(0, 30000)),
    readings(Sticks, channels_us=st.lists(st.integers(800, 2200), min_size=4, max_size=18).map(tuple)),
    readings(Signal, strength=number(0, 1)),
    readings(FlightState, armed=st.none() | st.booleans()),
    readings(Mode, mode=st.sampled_from(FlightMode)),
    readings(
        Health,
        sensors=st.integers(0, 31).map(Sensor),
        cycle_time_us=st.none() | st.integers(0, 65535),
        i2c_errors=st.none() | st.integers(0, 65535),
    ),
)
HOMES = st.none() | st.tuples(st.integers(1, 850000000), st.integers(1, 1799999999))


@dataclass(frozen=True)
class Receivers:
    """A vehicle as seen by subscribers and by ground stations."""

    vehicle: Vehicle
    bridge: Bridge

    def group(self, group: Group) -> Any:
        key, payloads = TELEMETRY[group], Payloads(lambda: 0.0)
        body = payloads.head(key) | plain(self.bridge.group(group, NOW))
        return decoded(encode(key, body), str(encoding_of(key)))

    def message(self, maker: Maker) -> Any:
        """The message as received; None if it is not sent."""
        for made in make.Moment(self.vehicle, NOW, boot_ms=1).made(maker):
            return m.MAVLink(None).decode(bytearray(FrameWriter(1, 1).frame(pack(made), 2)))
        return None


def near(value: float | None, other: float, within: float) -> bool:
    return value is not None and abs(value - other) <= within


def near_on_circle(value: float, other: float, within: float) -> bool:
    return abs((value - other + 180) % 360 - 180) <= within


@given(READINGS, HOMES)
def test_groups_have_the_values_of_mavlink_messages(
    readings: tuple[Reading | None, ...], home: tuple[int, int] | None
) -> None:
    bridge = World(powered=False, plugged=False).bridge
    vehicle = bridge.vehicle
    for reading in readings:
        if reading is not None:
            vehicle.hear(reading)
    if home is not None:
        vehicle.hear_home(*home)
    receivers = Receivers(vehicle, bridge)
    attitude_is_true(receivers)
    position_is_true(receivers)
    home_is_true(receivers)
    gps_is_true(receivers)
    battery_is_true(receivers)
    rc_is_true(receivers)
    status_is_true(receivers)


def attitude_is_true(receivers: Receivers) -> None:
    group, sent = receivers.group(Group.ATTITUDE), receivers.message(make.attitude)
    assert (sent is not None) == (group["roll_deg"] is not None)
    if sent is None:
        return
    assert near(group["roll_deg"], math.degrees(sent.roll), ROUNDED)
    assert near(group["pitch_deg"], math.degrees(sent.pitch), ROUNDED)
    if group["heading_deg"] is not None:
        assert 0 <= group["heading_deg"] < 360
        assert near_on_circle(group["heading_deg"], math.degrees(sent.yaw), ROUNDED)
    where = receivers.message(make.global_position_int)
    if where is not None:
        assert (where.hdg == U16) == (group["heading_deg"] is None)
        assert where.hdg == U16 or near_on_circle(group["heading_deg"], where.hdg / 100, 0.011)


def position_is_true(receivers: Receivers) -> None:
    group, sent = receivers.group(Group.POSITION), receivers.message(make.global_position_int)
    raw = receivers.message(make.gps_raw_int)
    if raw is not None and raw.lat:
        assert group["altitude_m"] is not None
        assert near(group["altitude_m"], raw.alt / 1000, 0.001)
    if sent is None:
        return
    # MAVLink has no "unknown" for these: without a fix they are the last known place, or 0.
    assert group["lat_deg"] is None or (group["lat_deg"], group["lon_deg"]) == (sent.lat / 1e7, sent.lon / 1e7)
    assert near(group["height_m"], sent.relative_alt / 1000, ROUNDED + 0.001)
    assert near(group["climb_m_s"], -sent.vz / 100, 0.011)
    assert near(group["north_m_s"] or 0.0, sent.vx / 100, 0.011)
    assert near(group["east_m_s"] or 0.0, sent.vy / 100, 0.011)


def home_is_true(receivers: Receivers) -> None:
    group = receivers.group(Group.POSITION)
    sent = receivers.message(make.home_position)
    if sent is not None:
        assert (group["home_lat_deg"], group["home_lon_deg"]) == (sent.latitude / 1e7, sent.longitude / 1e7)
    shown = receivers.message(make.global_position_int)
    if sent is not None and shown is not None and group["lat_deg"] is not None:
        here, home = Home(shown.lat, shown.lon), Home(sent.latitude, sent.longitude)
        assert near(group["home_distance_m"], distance_m(here, home), 0.051)
        assert 0 <= group["home_direction_deg"] < 360
        assert near_on_circle(group["home_direction_deg"], bearing_deg(here, home), ROUNDED)


def gps_is_true(receivers: Receivers) -> None:
    group, sent = receivers.group(Group.GPS), receivers.message(make.gps_raw_int)
    assert (sent is not None) == (group["fix"] is not None)
    if sent is None:
        return
    assert group["fix"] == {1: "none", 2: "2D", 3: "3D"}[sent.fix_type]
    assert group["satellites"] == (None if sent.satellites_visible == 255 else sent.satellites_visible)
    for name, value, parts in (("hdop", sent.eph, 100), ("ground_speed_m_s", sent.vel, 100)):
        assert (group[name] is None) == (value == U16)
        assert value == U16 or near(group[name], value / parts, 0.0051 + 0.005)
    assert (group["course_deg"] is None) == (sent.cog == U16)
    if sent.cog != U16:
        assert 0 <= group["course_deg"] < 360
        assert near_on_circle(group["course_deg"], sent.cog / 100, 0.011)


def battery_is_true(receivers: Receivers) -> None:
    group, sent = receivers.group(Group.BATTERY), receivers.message(make.battery_status)
    assert (sent is not None) == (group["voltage_v"] is not None)
    if sent is None:
        return
    assert near(group["voltage_v"], battery_mv(sent) / 1000, 0.0005)
    assert (group["current_a"] is None) == (sent.current_battery == -1)
    assert group["current_a"] is None or near(group["current_a"], sent.current_battery / 100, 0.005)
    assert group["drawn_mah"] == (None if sent.current_consumed == -1 else sent.current_consumed)
    assert group["remaining_percent"] == (None if sent.battery_remaining == -1 else sent.battery_remaining)


def rc_is_true(receivers: Receivers) -> None:
    group, sent = receivers.group(Group.RC), receivers.message(make.rc_channels)
    assert (sent is not None) == (group["channels_us"] is not None)
    if sent is None:
        return
    assert group["channels_us"] == [getattr(sent, f"chan{channel + 1}_raw") for channel in range(sent.chancount)]
    if sent.rssi != 255:
        assert near(group["rssi_percent"], sent.rssi / 254 * 100, 0.5)


def status_is_true(receivers: Receivers) -> None:
    group, sent = receivers.group(Group.STATUS), receivers.message(make.heartbeat)
    assert group["armed"] in (None, bool(sent.base_mode & m.MAV_MODE_FLAG_SAFETY_ARMED))
    if group["mode"] is not None:
        modes = {"STABILIZE": 0, "ACRO": 1, "ALT_HOLD": 2, "AUTO": 3, "LOITER": 5, "RTL": 6}
        modes |= {"HORIZON": 0, "MANUAL": 1, "CRUISE": 5, "LAUNCH": 0}
        assert sent.custom_mode == modes[group["mode"]]
    health = receivers.message(make.sys_status)
    if group["sensors"] is not None:
        bits = {"accelerometer": 2, "barometer": 8, "compass": 4, "gps": 32, "sonar": 256}
        shown = {name for name, bit in bits.items() if health.onboard_control_sensors_present & bit}
        assert set(group["sensors"]) == shown
        assert (group["i2c_errors"] or 0) == health.errors_comm
