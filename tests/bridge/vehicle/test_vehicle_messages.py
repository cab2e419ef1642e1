# SPDX-License-Identifier: GPL-3.0-or-later
"""Unknown values are sent as MAVLink's "unknown", never as 0; replies of every firmware are understood."""

import math
import struct
from dataclasses import replace
from typing import Any

import pytest
from pymavlink.dialects.v20 import ardupilotmega as mavlink

from bridge.controllers import other
from bridge.controllers.harakiri import profile as harakiri
from bridge.controllers.inav import profile as inav
from bridge.controllers.table import PROFILES
from bridge.fc.msp_telemetry import hear_msp
from bridge.fc.profile import FlightController, Profile, Spoken
from bridge.model.craft import Airframe
from bridge.model.vehicle import FlightState, GlobalPosition, Power, ReadingT, Source, Vehicle
from bridge.vehicle import vehicle_messages as make
from bridge.vehicle.telemetry_table import TELEMETRY
from protocols.mavlink.codec import FrameWriter, Packed, pack
from protocols.mavlink.dialect import messages as m
from protocols.msp.commands import Msp
from protocols.msp.frame import Direction, MspFrame

HARAKIRI_BOXES = ("ANGLE", "HORIZON", "BARO", "MAG", "CAMSTAB", "ARM", "GPS HOME", "GPS HOLD", "GPS AUTO")
HARAKIRI = FlightController(harakiri.UNPATCHED, "Harakiri", Airframe.QUADROTOR, HARAKIRI_BOXES)
INAV_BOXES = (
    "ARM;ANGLE;HORIZON;NAV ALTHOLD;NAV POSHOLD;NAV RTH;NAV WP;MANUAL;NAV LAUNCH;NAV COURSE HOLD;NAV CRUISE;ANGLE HOLD"
)
INAV = FlightController(inav.PROFILE, "INAV", None, tuple(INAV_BOXES.split(";")))
BETAFLIGHT = FlightController(other.OTHER_MSP, "BTFL", None, ("ARM", "ANGLE", "HORIZON", "ALT HOLD", "GPS RESCUE"))
ALL_SENSORS = 0b1111
U16, U8 = 65535, 255


def at(vehicle: Vehicle, boot_ms: int = 0) -> make.Moment:
    """A moment at which everything has just been received."""
    return make.Moment(vehicle, 0.0, boot_ms)


def with_replies(state: Vehicle, who: FlightController, **replies: bytes) -> Vehicle:
    """Pass replies (payloads by command name) to a vehicle; return it."""
    for name, payload in replies.items():
        hear_msp(state, MspFrame(Direction.REPLY, Msp[name], payload), who, 0.0)
    return state


def status(sensors: int = ALL_SENSORS, flags: int = 1, i2c_errors: int = 0) -> bytes:
    return struct.pack("<HHHIB", 3000, i2c_errors, sensors, flags, 0)


def gps(fix: int = 1, lat: int = 453838000, lon: int = 84733000, speed: int = 250, more: bytes = b"") -> bytes:
    return struct.pack("<BBiihH", fix, 9, lat, lon, 131, speed) + more


def attitude(roll: int = 0, pitch: int = 0, heading: int = 0) -> bytes:
    return struct.pack("<4h", roll, pitch, heading, 0)


def sent(message: Packed) -> Any:
    """The message as received."""
    return mavlink.MAVLink(None).decode(bytearray(FrameWriter(1, 1).frame(message, 2)))


def fields(message: Any) -> dict[str, Any]:
    kind = getattr(mavlink, f"MAVLink_{message.get_type().lower()}_message")
    return {name: getattr(message, name) for name in kind.fieldnames}


def test_without_readings_there_are_no_messages() -> None:
    for row in TELEMETRY:
        if row.reading is not None and row.msgid != m.MAVLINK_MSG_ID_SYS_STATUS:
            assert at(Vehicle()).made(row.maker) == []


def test_errors_and_short_replies_are_ignored() -> None:
    state = Vehicle()
    for poll in Msp:
        hear_msp(state, MspFrame(Direction.ERROR, poll, bytes(40)), HARAKIRI, 0.0)
        hear_msp(state, MspFrame(Direction.REPLY, poll, b"\x01"), HARAKIRI, 0.0)
    assert (state.news, state.home) == (set(), None)


@pytest.mark.parametrize("fill", [0x00, 0x01, 0x7F, 0x80, 0xFF])
@pytest.mark.parametrize("profile", [each for each in PROFILES if each.spoken is Spoken.MSP], ids=lambda it: it.name)
def test_every_message_can_be_packed_for_any_reply(profile: Profile, fill: int) -> None:
    who = FlightController(profile, profile.name, None, HARAKIRI_BOXES)
    state = with_replies(Vehicle(), who, **{poll.name: bytes((fill,)) * 68 for poll in Msp if poll is not Msp.BOX})
    for row in TELEMETRY:
        for message in at(state, boot_ms=0xFFFFFFFF).made(row.maker):
            assert pack(message).payload_v2


def test_a_current_sensor_below_zero_is_not_a_huge_consumption() -> None:
    """INAV's current and consumption are signed: a wrong offset makes both negative."""
    analog = struct.pack("<BHhiiiIBH", 3 << 4, 1200, -40, -480, -7, -80, 0, 90, 800)
    (message,) = at(with_replies(Vehicle(), INAV, INAV_ANALOG=analog)).made(make.battery_status)
    assert (message.current_battery, message.current_consumed) == (-40, -7)


def test_without_a_fix_there_is_no_position() -> None:
    state = with_replies(Vehicle(), HARAKIRI, STATUS=status(), RAW_GPS=gps(fix=0), ALTITUDE=bytes(6))
    assert make.gps_raw_int(at(state)).fix_type == mavlink.GPS_FIX_TYPE_NO_FIX
    position = fields(make.global_position_int(at(state)))
    assert [position[name] for name in ("lat", "lon", "alt", "relative_alt", "vx", "vy", "vz")] == [0] * 7
    assert at(state).made(make.home_position) == []
    with_replies(state, HARAKIRI, ATTITUDE=attitude(), RC=struct.pack("<8H", *[1500] * 8))
    hud = fields(make.vfr_hud(at(state)))
    assert math.isnan(hud["groundspeed"])
    assert math.isnan(hud["airspeed"])
    assert math.isnan(hud["alt"])


def test_harakiri_does_not_send_a_course_or_dilution() -> None:
    raw = fields(make.gps_raw_int(at(with_replies(Vehicle(), HARAKIRI, RAW_GPS=gps()), 5)))
    assert (raw["cog"], raw["eph"], raw["epv"], raw["time_usec"]) == (U16, U16, U16, 5000)


def test_the_first_fix_in_motion_lacks_a_direction() -> None:
    state = with_replies(Vehicle(), HARAKIRI, STATUS=status(), ALTITUDE=struct.pack("<ih", 150, 20), RAW_GPS=gps())
    assert at(state).made(make.global_position_int) == []
    with_replies(state, HARAKIRI, RAW_GPS=gps(lat=453838000 + 90))  # a metre to the north
    position = fields(make.global_position_int(at(state)))
    assert (position["vx"], position["vy"], position["vz"], position["relative_alt"]) == (250, 0, -20, 1500)
    assert position["hdg"] == U16


def need(state: Vehicle, kind: type[ReadingT]) -> ReadingT:
    last = state.last(kind)
    assert last is not None
    return last


def test_the_height_is_shown_without_a_fix() -> None:
    """Mission Planner shows only relative_alt of GLOBAL_POSITION_INT. ArduPilot sends the last known place, too."""
    state = with_replies(Vehicle(), HARAKIRI, STATUS=status(), ALTITUDE=struct.pack("<ih", 3000, -70))
    with_replies(state, HARAKIRI, RAW_GPS=gps(fix=0))
    position = fields(make.global_position_int(at(state)))
    assert (position["lat"], position["lon"], position["relative_alt"], position["vz"]) == (0, 0, 30000, 70)
    with_replies(state, HARAKIRI, RAW_GPS=gps())
    with_replies(state, HARAKIRI, RAW_GPS=gps(lat=453838000 + 90))
    shown = fields(make.global_position_int(at(state)))
    state.hear(replace(need(state, GlobalPosition), heard_at=-10.0))
    with_replies(state, HARAKIRI, ALTITUDE=struct.pack("<ih", 1000, -70), RAW_GPS=gps(fix=0))
    lost = fields(make.global_position_int(at(state)))
    assert (lost["lat"], lost["lon"]) == (shown["lat"], shown["lon"])
    assert (lost["relative_alt"], lost["vx"], lost["vy"], lost["alt"]) == (10000, 0, 0, 141_000)


@pytest.mark.parametrize("height_m", [-30, 30])
def test_a_craft_far_above_or_below_the_home_is_in_the_air(height_m: int) -> None:
    altitude = struct.pack("<ih", height_m * 100, 0)
    state = with_replies(Vehicle(), HARAKIRI, STATUS=status(flags=1 << 5), ALTITUDE=altitude, RAW_GPS=gps(speed=0))
    assert state.armed
    assert make.extended_sys_state(at(state)).landed_state == m.MAV_LANDED_STATE_IN_AIR


@pytest.mark.parametrize(("fix", "healthy"), [(0, False), (1, False), (2, True)])
def test_a_gps_without_a_3d_fix_is_not_healthy(fix: int, *, healthy: bool) -> None:
    """As with ArduPilot: to MAVSDK the bit means that the global position is good."""
    state = with_replies(Vehicle(), INAV, STATUS=status(), RAW_GPS=gps(fix=fix))
    shown = make.sys_status(at(state))
    assert shown.onboard_control_sensors_present & m.MAV_SYS_STATUS_SENSOR_GPS
    assert bool(shown.onboard_control_sensors_health & m.MAV_SYS_STATUS_SENSOR_GPS) == healthy


def test_a_craft_that_never_moved_has_zero_velocity() -> None:
    state = with_replies(Vehicle(), HARAKIRI, STATUS=status(), ALTITUDE=bytes(6), RAW_GPS=gps(speed=0))
    position = fields(make.global_position_int(at(state)))
    assert (position["vx"], position["vy"], position["relative_alt"]) == (0, 0, 0)


def test_a_reported_course_is_used() -> None:
    state = with_replies(Vehicle(), INAV, STATUS=status(), ALTITUDE=bytes(10))
    with_replies(state, INAV, RAW_GPS=gps(fix=2, more=struct.pack("<HH", 900, 140)))
    position, raw = fields(make.global_position_int(at(state))), fields(make.gps_raw_int(at(state)))
    assert (position["vx"], position["vy"]) == (0, 250)
    assert (raw["cog"], raw["eph"], raw["fix_type"]) == (9000, 140, mavlink.GPS_FIX_TYPE_3D_FIX)


@pytest.mark.parametrize(
    ("who", "fix", "fix_type"), [(INAV, 0, 1), (INAV, 1, 2), (INAV, 2, 3), (HARAKIRI, 1, 3), (BETAFLIGHT, 1, 3)]
)
def test_only_inav_reports_the_kind_of_fix(who: FlightController, fix: int, fix_type: int) -> None:
    assert make.gps_raw_int(at(with_replies(Vehicle(), who, RAW_GPS=gps(fix=fix)), 0)).fix_type == fix_type


def test_without_a_barometer_there_is_no_height() -> None:
    state = with_replies(Vehicle(), HARAKIRI, STATUS=status(sensors=0b1101), ALTITUDE=bytes(6), RAW_GPS=gps(speed=0))
    assert at(state).made(make.global_position_int) == []
    with_replies(state, HARAKIRI, ATTITUDE=attitude(), RC=struct.pack("<8H", *[1500] * 8))
    assert math.isnan(make.vfr_hud(at(state)).climb)
    # A board that derives height from GPS reports one.
    with_replies(state, BETAFLIGHT, ALTITUDE=struct.pack("<ih", 20, 0))
    assert make.global_position_int(at(state)).relative_alt == 200


def test_without_a_compass_the_heading_is_unknown() -> None:
    state = with_replies(Vehicle(), HARAKIRI, STATUS=status(sensors=0b1011), ALTITUDE=bytes(6), RAW_GPS=gps(speed=0))
    with_replies(state, HARAKIRI, ATTITUDE=attitude(heading=0))
    assert make.global_position_int(at(state)).hdg == U16


@pytest.mark.parametrize(("heading", "shown"), [(-170, 190), (170, 170), (190, 190), (359, 359), (0, 0), (-1, 359)])
@pytest.mark.parametrize("who", [HARAKIRI, INAV, BETAFLIGHT])
def test_signs_are_the_same_on_all_firmware(who: FlightController, heading: int, shown: int) -> None:
    state = with_replies(Vehicle(), who, STATUS=status(), ALTITUDE=bytes(6), RAW_GPS=gps(fix=2, speed=0))
    with_replies(state, who, ATTITUDE=attitude(roll=105, pitch=32, heading=heading), RC=bytes(16))
    shown_attitude = fields(sent(make.attitude(at(state, 7))))
    assert math.degrees(shown_attitude["roll"]) == pytest.approx(10.5)
    assert math.degrees(shown_attitude["pitch"]) == pytest.approx(-3.2)
    assert math.degrees(shown_attitude["yaw"]) % 360 == pytest.approx(shown)
    assert -180 <= math.degrees(shown_attitude["yaw"]) <= 180
    assert all(math.isnan(shown_attitude[f"{axis}speed"]) for axis in ("roll", "pitch", "yaw"))
    assert make.global_position_int(at(state)).hdg == shown * 100
    assert make.vfr_hud(at(state)).heading == shown


def test_an_unmeasured_battery_is_unknown() -> None:
    state = with_replies(Vehicle(), HARAKIRI, STATUS=status())
    for reply in (None, struct.pack("<BHH", 0, 0, 0)):
        if reply:
            with_replies(state, HARAKIRI, ANALOG=reply)
        power = fields(make.sys_status(at(state)))
        assert (power["voltage_battery"], power["current_battery"], power["battery_remaining"]) == (U16, -1, -1)
        assert at(state).made(make.battery_status) == []


def battery_mv(message: Any) -> int:
    """The voltage of BATTERY_STATUS, as ground stations add it up."""
    return sum(cell for cell in message.voltages if cell != U16)


@pytest.mark.parametrize(("cells", "voltage_v"), [(None, 12.61), (3, 12.61), (1, 4.2), (10, 41.99), (12, 50.4)])
def test_the_cells_add_up_to_the_battery(cells: int | None, voltage_v: float) -> None:
    state = with_replies(Vehicle(), INAV, STATUS=status())
    state.hear(Power(0.0, Source.MSP, voltage_v, cells=cells))
    battery = make.battery_status(at(state))
    assert battery_mv(battery) == round(voltage_v * 1000)
    shown = [cell for cell in battery.voltages if cell != U16]
    assert len(shown) == {None: 3, 12: 1}.get(cells, cells)
    assert max(shown) - min(shown) <= 1


def test_a_current_of_0_without_consumption_is_unknown() -> None:
    state = with_replies(Vehicle(), BETAFLIGHT, STATUS=status(), ANALOG=struct.pack("<BHHh", 124, 350, 0, 1234))
    battery = fields(make.battery_status(at(state)))
    assert (battery["voltages"], battery["current_battery"], battery["current_consumed"]) == (
        [4134, 4133, 4133, *[U16] * 7],
        1234,
        350,
    )
    assert (battery["temperature"], battery["battery_remaining"], battery["energy_consumed"]) == (32767, 93, -1)
    assert make.sys_status(at(state)).current_battery == 1234
    state = with_replies(Vehicle(), BETAFLIGHT, STATUS=status(), ANALOG=struct.pack("<BHHh", 124, 0, 0, 0))
    assert make.battery_status(at(state)).current_battery == make.battery_status(at(state)).current_consumed == -1


def test_signal_strength_is_unknown_until_it_was_above_0() -> None:
    state = with_replies(Vehicle(), HARAKIRI, RC=struct.pack("<4H", 1500, 1500, 1500, 1000))
    assert make.rc_channels(at(state)).rssi == U8
    with_replies(state, HARAKIRI, ANALOG=struct.pack("<BHH", 120, 0, 0))
    assert make.rc_channels(at(state)).rssi == U8
    for sent, shown in ((1020, 254), (1023, 254), (510, 127), (0, 0)):
        with_replies(state, HARAKIRI, ANALOG=struct.pack("<BHH", 120, 0, sent))
        assert make.rc_channels(at(state)).rssi == shown


def test_missing_channels_are_0_as_of_an_ardupilot() -> None:
    state = with_replies(Vehicle(), HARAKIRI, RC=struct.pack("<6H", 1501, 1502, 1503, 1004, 1005, 1006))
    channels = make.rc_channels(at(state))
    assert channels.chancount == 6
    sent = [1501, 1502, 1004, 1503, 1005, 1006]  # throttle before yaw
    assert [getattr(channels, f"chan{n}_raw") for n in range(1, 19)] == [*sent, *[0] * 12]


@pytest.mark.parametrize(("throttle", "shown"), [(900, 0), (1000, 0), (1450, 45), (2000, 100), (2100, 100)])
def test_the_throttle_stick_is_sent_in_percent(throttle: int, shown: int) -> None:
    state = with_replies(Vehicle(), HARAKIRI, ATTITUDE=attitude(), RC=struct.pack("<4H", 1500, 1500, 1500, throttle))
    assert make.vfr_hud(at(state)).throttle == shown


def test_home_in_flight_is_lower_than_the_craft() -> None:
    state = with_replies(
        Vehicle(),
        HARAKIRI,
        STATUS=status(flags=1 << 5),
        RAW_GPS=gps(),
        WP=struct.pack("<BiiHB", 0, 453830000, 84730000, 0, 0),
    )
    assert at(state).made(make.home_position) == []  # the craft's height is unknown
    with_replies(state, HARAKIRI, ALTITUDE=struct.pack("<ih", 2150, 0))
    home = make.home_position(at(state))
    assert (home.latitude, home.longitude, home.altitude) == (453830000, 84730000, 109_500)
    assert all(math.isnan(value) for value in (*home.q, home.approach_x))


def test_inavs_home_has_the_altitude_in_centimetres() -> None:
    home = struct.pack("<BBiiihhhB", 0, 4, 453830000, 84730000, 13147, 0, 0, 0, 0xA5)
    mission_record = struct.pack("<BBiiihhhB", 1, 1, 453838000, 84733000, 2000, 0, 0, 0, 0xA5)
    height = struct.pack("<ihi", 1012, 0, 0)
    state = with_replies(Vehicle(), INAV, STATUS=status(flags=1), RAW_GPS=gps(speed=0), ALTITUDE=height, WP=home)
    with_replies(state, INAV, WP=mission_record)
    assert make.home_position(at(state)).altitude == 131_470
    assert make.global_position_int(at(state)).alt == make.gps_raw_int(at(state)).alt == 131_000
    with_replies(state, INAV, RAW_GPS=gps(fix=0))
    state.hear(replace(need(state, GlobalPosition), heard_at=-10.0))
    assert make.global_position_int(at(state)).alt == 141_590


def test_an_inav_without_a_voltage_does_not_report_a_battery() -> None:
    analog = struct.pack("<BHHIIIIBH", 3 << 4, 0, 0, 0, 0, 0, 0, 0, 0)
    assert at(with_replies(Vehicle(), INAV, INAV_ANALOG=analog)).made(make.battery_status) == []


def test_sensors_and_i2c_errors_are_reported() -> None:
    present = make.sys_status(at(with_replies(Vehicle(), HARAKIRI, STATUS=status(sensors=0b0001, i2c_errors=9)), 0))
    assert (present.errors_comm, present.load) == (9, 0)
    assert not present.onboard_control_sensors_present & m.MAV_SYS_STATUS_SENSOR_GPS
    assert not present.onboard_control_sensors_health & m.MAV_SYS_STATUS_SENSOR_GPS


@pytest.mark.parametrize(
    ("volts", "percent"), [((16.8,), 100), ((12.6,), 100), ((12.6, 11.4), 45), ((12.6, 10.5), 5), ((12.6, 9.0), 0)]
)
def test_remaining_charge_is_estimated(volts: tuple[float, ...], percent: int) -> None:
    """From the number of cells, determined while the battery is full; it does not change as the battery drains."""
    state = with_replies(Vehicle(), HARAKIRI, STATUS=status())
    for voltage in volts:
        with_replies(state, HARAKIRI, ANALOG=struct.pack("<BHH", round(voltage * 10), 0, 0))
    assert make.sys_status(at(state)).battery_remaining == percent
    assert make.battery_status(at(state)).battery_remaining == percent


@pytest.mark.parametrize(
    ("pause_s", "armed", "cells", "percent"), [(15.0, False, 3, 100), (5.0, False, 4, 0), (15.0, True, 4, 0)]
)
def test_a_smaller_battery_is_recognised_after_a_pause(pause_s: float, armed: bool, cells: int, percent: int) -> None:
    state = Vehicle()
    for now, voltage in ((0.0, 16.8), (pause_s, 12.6)):
        state.hear(FlightState(now, Source.MSP, armed))
        state.hear(Power(now, Source.MSP, voltage))
    power = state.last(Power)
    assert power is not None
    assert (power.cells, power.remaining_percent) == (cells, percent)


def test_no_charge_is_estimated_on_usb_power() -> None:
    state = with_replies(Vehicle(), HARAKIRI, STATUS=status(), ANALOG=struct.pack("<BHH", 3, 0, 0))
    assert (make.battery_status(at(state)).voltages[0], make.sys_status(at(state)).battery_remaining) == (300, -1)


def test_a_receiver_is_healthy_while_it_has_a_signal() -> None:
    state = with_replies(Vehicle(), HARAKIRI, STATUS=status())
    bit = m.MAV_SYS_STATUS_SENSOR_RC_RECEIVER
    assert not make.sys_status(at(state)).onboard_control_sensors_present & bit
    with_replies(state, HARAKIRI, RC=struct.pack("<8H", *[1500] * 8))
    assert make.sys_status(at(state)).onboard_control_sensors_health & bit
    with_replies(state, HARAKIRI, ANALOG=struct.pack("<BHH", 120, 0, 500))
    with_replies(state, HARAKIRI, ANALOG=struct.pack("<BHH", 120, 0, 0))
    power = make.sys_status(at(state))
    assert power.onboard_control_sensors_present & bit
    assert not power.onboard_control_sensors_health & bit


@pytest.mark.parametrize(
    ("flags", "height_cm", "climb_cms", "speed", "landed"),
    [
        (1, 2000, 0, 0, m.MAV_LANDED_STATE_ON_GROUND),
        (1 << 5, 20, 0, 0, m.MAV_LANDED_STATE_ON_GROUND),
        (1 << 5, 200, 0, 0, m.MAV_LANDED_STATE_IN_AIR),
        (1 << 5, 20, 80, 0, m.MAV_LANDED_STATE_IN_AIR),
        (1 << 5, -200, 0, 300, m.MAV_LANDED_STATE_IN_AIR),
    ],
)
def test_height_and_speed_determine_the_landed_state(
    flags: int, height_cm: int, climb_cms: int, speed: int, landed: int
) -> None:
    state = with_replies(Vehicle(), HARAKIRI, STATUS=status(flags=flags), RAW_GPS=gps(speed=speed))
    with_replies(state, HARAKIRI, ALTITUDE=struct.pack("<ih", height_cm, climb_cms))
    assert make.extended_sys_state(at(state)).landed_state == landed


def test_local_position_is_reported() -> None:
    state = with_replies(Vehicle(), HARAKIRI, STATUS=status(), RAW_GPS=gps(speed=0))
    with_replies(state, HARAKIRI, STATUS=status(flags=1 << 5), ALTITUDE=struct.pack("<ih", 1500, 20))
    with_replies(state, HARAKIRI, RAW_GPS=gps(lat=453838000 + 1797, more=struct.pack("<H", 0)))
    local = make.local_position_ned(at(state))
    assert (local.x, local.y, local.z) == (pytest.approx(20, abs=0.1), pytest.approx(0, abs=0.1), -15)
    assert (local.vx, local.vy, local.vz) == (pytest.approx(2.5), pytest.approx(0), pytest.approx(-0.2))


@pytest.mark.parametrize(("roll", "pitch", "yaw"), [(0, 0, 0), (30, 0, 0), (0, -20, 0), (10, 20, 170), (-5, 3, -90)])
def test_the_quaternion_is_the_same_attitude(roll: int, pitch: int, yaw: int) -> None:
    state = with_replies(Vehicle(), HARAKIRI, STATUS=status(), ATTITUDE=attitude(roll * 10, -pitch * 10, yaw))
    sent = make.attitude_quaternion(at(state))
    w, x, y, z = sent.q1, sent.q2, sent.q3, sent.q4
    assert math.degrees(math.atan2(2 * (w * x + y * z), 1 - 2 * (x * x + y * y))) == pytest.approx(roll)
    assert math.degrees(math.asin(2 * (w * y - z * x))) == pytest.approx(pitch)
    assert math.degrees(math.atan2(2 * (w * z + x * y), 1 - 2 * (y * y + z * z))) == pytest.approx(yaw)
