# SPDX-License-Identifier: GPL-3.0-or-later
"""Readings of an autopilot that speaks MAVLink itself."""

import math

from pymavlink.dialects.v20 import ardupilotmega as m

from reports.vehicle_groups import Attitude, Battery, Gps, Group, Position, Rc, Status
from tests.bridge.fc.states.test_pass_through import Autopilot, passing
from tests.bridge.vehicle.test_vehicle_report import without_age
from tests.support.world import World


def heard() -> tuple[World, Autopilot]:
    """A disarmed copter in GUIDED, whose values are wanted."""
    world, autopilot, _ = passing()
    world.bridge.watch(Group)
    autopilot.send(m.MAVLink_heartbeat_message(2, 3, 81, 4, 4, 3))
    return world, autopilot


def test_groups_are_made_from_a_mavlink_autopilot() -> None:
    world, autopilot, _ = passing()
    world.bridge.watch(Group)
    autopilot.send(m.MAVLink_heartbeat_message(2, 3, 81 | 128, 4, 4, 3))
    autopilot.send(m.MAVLink_attitude_message(1, 0.1, -0.2, -0.3, 0, 0, 0))
    autopilot.send(m.MAVLink_global_position_int_message(1, 453838000, 84733000, 131000, 20000, 100, -200, -50, 9000))
    autopilot.send(m.MAVLink_gps_raw_int_message(1, 2, 0, 0, 0, 120, 65535, 65535, 65535, 255))
    autopilot.send(m.MAVLink_sys_status_message(7, 7, 6, 0, 12600, -1, -1, 0, 0, 0, 0, 0, 0))
    autopilot.send(m.MAVLink_rc_channels_raw_message(1, 0, 1500, 1501, 1000, 1502, *[65535] * 4, 127))
    # A gimbal on board is not the autopilot.
    gimbal = m.MAVLink(None, srcSystem=1, srcComponent=154)
    autopilot.outgoing += m.MAVLink_heartbeat_message(26, 8, 0, 0, 4, 3).pack(gimbal)
    autopilot.outgoing += m.MAVLink_attitude_message(1, 1.0, 1.0, 1.0, 0, 0, 0).pack(gimbal)
    world.run(0.05)
    bridge = world.bridge
    assert world.take_published() == {
        Group.ATTITUDE, Group.POSITION, Group.GPS, Group.BATTERY, Group.RC, Group.STATUS
    }  # fmt: skip
    assert without_age(bridge.group(Group.ATTITUDE, world.now)) == Attitude(
        5.73, -11.46, round(math.degrees(-0.3), 2) % 360
    )
    assert without_age(bridge.group(Group.POSITION, world.now)) == Position(
        45.3838, 8.4733, 131.0, 20.0, 0.5, 1.0, -2.0
    )
    assert without_age(bridge.group(Group.GPS, world.now)) == Gps("2D", None, 1.2, None, None)
    assert without_age(bridge.group(Group.BATTERY, world.now)) == Battery(12.6, None, None, 3, 100)
    assert without_age(bridge.group(Group.RC, world.now)) == Rc((1500, 1501, 1000, 1502), 50.0)
    assert without_age(bridge.group(Group.STATUS, world.now)) == Status(True, "4", ("accelerometer", "compass"))
    assert bridge.group(Group.LINK, world.now).state == "MAVLink"


def test_two_autopilots_on_one_line_are_not_mixed() -> None:
    world, autopilot, _ = passing()
    autopilot.heartbeat = m.MAVLink_heartbeat_message(2, 3, 81, 4, 4, 3)
    world.bridge.watch(Group)
    other = m.MAVLink(None, srcSystem=7, srcComponent=1)
    for _ in range(40):
        autopilot.outgoing += m.MAVLink_heartbeat_message(2, 3, 81 | 128, 4, 4, 3).pack(other)
        autopilot.outgoing += m.MAVLink_attitude_message(1, 0.5, 0, 0, 0, 0, 0).pack(other)
        world.run(0.5)
        assert world.bridge.vehicle.armed is False
        assert world.bridge.group(Group.ATTITUDE, world.now).roll_deg is None


def test_a_companion_on_board_does_not_replace_an_autopilot_that_restarts() -> None:
    world, autopilot, _ = passing()
    companion = m.MAVLink(None, srcSystem=1, srcComponent=191)
    own, autopilot.mavlink = autopilot.mavlink, companion
    autopilot.heartbeat = m.MAVLink_heartbeat_message(18, 0, 0, 0, 4, 3)
    world.run(20)
    for _ in range(3):
        autopilot.outgoing += m.MAVLink_heartbeat_message(2, 3, 81 | 128, 4, 4, 3).pack(own)
        world.run(1)
    assert world.bridge.vehicle.armed


def test_an_unused_channel_does_not_move_the_others() -> None:
    world, autopilot = heard()
    autopilot.send(m.MAVLink_rc_channels_message(1, 5, 1500, 1501, 65535, 1502, 1800, *[65535] * 13, 127))
    world.run(0.05)
    assert world.bridge.group(Group.RC, world.now).channels_us == (1500, 1501, 0, 1502, 1800)


def test_the_autopilots_own_remaining_charge_is_shown() -> None:
    world, autopilot = heard()
    autopilot.send(m.MAVLink_sys_status_message(7, 7, 6, 0, 12600, 100, 43, 0, 0, 0, 0, 0, 0))
    world.run(0.05)
    assert world.bridge.group(Group.BATTERY, world.now).remaining_percent == 43


def test_the_second_block_of_channels_does_not_replace_the_first() -> None:
    world, autopilot = heard()
    for port in (0, 1):
        autopilot.send(m.MAVLink_rc_channels_raw_message(1, port, *[1500 + port] * 8, 127))
        world.run(0.05)
    assert world.bridge.group(Group.RC, world.now).channels_us == (1500,) * 8


def test_a_voltage_is_not_renewed_by_the_consumption() -> None:
    world, autopilot = heard()
    autopilot.send(m.MAVLink_sys_status_message(7, 7, 6, 0, 12600, 100, -1, 0, 0, 0, 0, 0, 0))
    for battery in (0, 1):
        world.run(5)
        consumed = 500 + battery
        autopilot.send(m.MAVLink_battery_status_message(battery, 0, 0, 0, [65535] * 10, 100, consumed, -1, 50))
    world.run(0.05)
    power = world.bridge.group(Group.BATTERY, world.now)
    assert power.voltage_v is None
    assert (power.drawn_mah, power.age_s) == (None, 5.0)
    autopilot.send(m.MAVLink_battery_status_message(0, 0, 0, 0, [65535] * 10, 100, 502, -1, 50))
    world.run(0.05)
    power = world.bridge.group(Group.BATTERY, world.now)
    assert (power.voltage_v, power.drawn_mah) == (None, 502)
    assert power.age_s is not None
    assert power.age_s <= 0.1


def test_a_consumption_is_not_renewed_by_the_voltage() -> None:
    world, autopilot, _ = passing()
    autopilot.send(m.MAVLink_battery_status_message(0, 0, 0, 0, [65535] * 10, 100, 500, -1, 50))
    for _ in range(5):
        world.run(0.5)
        autopilot.send(m.MAVLink_sys_status_message(7, 7, 6, 0, 12600, 100, -1, 0, 0, 0, 0, 0, 0))
    world.run(0.05)
    power = world.bridge.group(Group.BATTERY, world.now)
    assert (power.voltage_v, power.drawn_mah) == (12.6, None)


def test_without_a_fix_the_height_is_current_but_not_the_place() -> None:
    world, autopilot, _ = passing()
    where = m.MAVLink_global_position_int_message(1, 453838000, 84733000, 131000, 20000, 0, 0, 0, 9000)
    autopilot.send(m.MAVLink_gps_raw_int_message(1, 1, 0, 0, 0, 120, 65535, 65535, 65535, 3))
    autopilot.send(where)
    world.run(0.05)
    position = world.bridge.group(Group.POSITION, world.now)
    assert (position.lat_deg, position.height_m, position.age_s) == (None, 20.0, 0.0)


def test_autopilots_on_mavlink_1_and_2_are_reported_separately() -> None:
    world, autopilot, _ = passing(Autopilot(version=1))
    autopilot.send(m.MAVLink_heartbeat_message(2, 3, 81, 4, 4, 3))
    autopilot.send(m.MAVLink_attitude_message(1, 0.5, 0, 0, 0, 0, 0))
    world.run(0.05)
    assert world.bridge.group(Group.ATTITUDE, world.now).roll_deg == 28.65
