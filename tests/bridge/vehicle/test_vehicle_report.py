# SPDX-License-Identifier: GPL-3.0-or-later
"""The vehicle's published groups, the same for every protocol of the flight controller."""

from dataclasses import replace
from typing import Any

import pytest
from pymavlink.dialects.v20 import ardupilotmega as m

from bridge.controllers.harakiri import profile as harakiri
from reports.vehicle_groups import Attitude, Battery, Gps, Group, Position, Rc, Status
from simulator.board.options import SimOptions, TelemetryProtocol
from tests.bridge.fc.states.test_pass_through import passing
from tests.support.world import World

EMPTY: dict[Group, Any] = {
    Group.ATTITUDE: Attitude(),
    Group.POSITION: Position(),
    Group.GPS: Gps(),
    Group.BATTERY: Battery(),
    Group.RC: Rc(),
    Group.STATUS: Status(),
}


def without_age(group: Any) -> Any:
    return replace(group, age_s=None)


def test_everything_is_unknown_before_a_flight_controller_is_found() -> None:
    world = World(plugged=False)
    bridge = world.bridge
    assert {group: bridge.group(group, world.now) for group in EMPTY} == EMPTY
    assert bridge.group(Group.LINK, world.now).state == "no port"
    assert bridge.report(world.now).mission is None


def test_after_a_lost_link_arming_mode_and_place_are_kept_with_their_age() -> None:
    world = World()
    world.wait_ready(then_s=3.0)
    bridge = world.bridge
    known = bridge.report(world.now)
    assert None not in (known.position.lat_deg, known.attitude.roll_deg, known.status.mode)
    world.unplug()
    world.run(10)
    home = {name: getattr(known.position, name) for name in ("home_lat_deg", "home_lon_deg")}
    lost = Status(readiness="lost", not_ready_why=("flight controller lost",))
    expected = EMPTY | {Group.POSITION: Position(**home), Group.STATUS: lost}
    assert {group: without_age(bridge.group(group, world.now)) for group in EMPTY} == expected
    assert all(bridge.group(group, world.now).age_s > 9 for group in EMPTY if group is not Group.BATTERY)
    last = bridge.report(world.now).last_heard
    assert (last.armed, last.mode) == (False, known.status.mode)
    assert (last.lat_deg, last.lon_deg) == (known.position.lat_deg, known.position.lon_deg)
    assert None not in (last.armed_age_s, last.mode_age_s, last.place_age_s)
    assert min(last.armed_age_s or 0, last.mode_age_s or 0, last.place_age_s or 0) > 9


def test_watched_groups_are_polled_and_published_with_each_reply() -> None:
    world = World()
    world.wait_ready()
    bridge = world.bridge
    assert world.take_published() == set()
    bridge.watch({Group.ATTITUDE})
    found = 0
    for _ in range(100):
        world.run(0.02)
        fresh = world.take_published()
        assert fresh <= {Group.ATTITUDE}
        found += len(fresh)
    assert 15 <= found <= 25
    bridge.watch(())
    world.run(2.0)
    assert world.take_published() == set()


def test_a_values_age_grows_while_the_line_is_silent() -> None:
    world, autopilot, _ = passing()
    world.bridge.watch(Group)
    autopilot.send(m.MAVLink_attitude_message(1, 0.25, 0, 0, 0, 0, 0))
    world.run(0.1)
    heard_at = world.now
    world.unplug()
    # No tick and no input in between: the age is that of the moment of the question.
    assert world.bridge.group(Group.ATTITUDE, heard_at + 10).age_s == pytest.approx(10, abs=0.2)
    assert world.bridge.report(heard_at + 10).attitude.age_s == pytest.approx(10, abs=0.2)


def test_groups_continue_when_an_armed_harakiri_switches_to_mavlink() -> None:
    world = World(SimOptions(tele_prot=TelemetryProtocol.MAVLINK))
    world.wait_ready(then_s=2.0)
    before = world.bridge.report(world.now)
    world.faults.armed = True
    world.wait_until(lambda w: w.kind is harakiri.MAVLINK, 10, then_s=3.0)
    now = world.bridge.report(world.now)
    assert now.status.armed
    assert now.position.lat_deg == pytest.approx(before.position.lat_deg, abs=0.01)
    assert now.battery.voltage_v == pytest.approx(before.battery.voltage_v, abs=1.0)
    assert now.position.height_m is not None
    assert now.position.home_lat_deg is not None
    assert None not in (now.attitude.roll_deg, now.gps.satellites, now.rc.channels_us)
