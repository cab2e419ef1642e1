# SPDX-License-Identifier: GPL-3.0-or-later
"""Missions to a MultiWii with navigation: nothing half-written can be flown."""

from dataclasses import replace

import pytest

from bridge.controllers.nav.check import NavRules
from protocols.mission_item import MissionItem
from protocols.msp.nav import Nav
from tests.bridge.controllers.nav.test_mission_store import ACCEPTED, DENIED, found, fresh, packed, plan
from tests.support.conversations import Download, Upload
from tests.support.fake_inav import FakeMultiwii, nav_config
from tests.support.nav_lists import INAV, LAT, LON, MULTIWII, WP, C, findings_for, item, jump, verdict_on


def test_multiwii_holds_a_return_home_until_the_list_is_complete() -> None:
    multiwii, world, station = fresh(FakeMultiwii)
    first = plan(20)
    assert Upload(station, first).run() is ACCEPTED
    assert multiwii.flown == packed(first)
    multiwii.drop = lambda frame: "request" if frame.command == Nav.SET_WP and frame.payload[0] == 9 else ""
    upload = Upload(station, plan(15, 1), tries=60)
    seen: set[tuple[bytes, ...]] = set()
    while not upload.is_over:
        world.run(0.01)
        seen.add(tuple(multiwii.flown))
    assert upload.result is DENIED
    # At any moment it would have flown the old list or a return home.
    assert {len(flown) for flown in seen - {tuple(packed(first))}} == {1}


def test_a_multiwiis_own_limits_are_warned_of_and_read_for_each_list() -> None:
    multiwii, _, station = fresh(FakeMultiwii)
    sent = plan(10)
    sent[5] = replace(sent[5], lat_e7=453848000)  # 110 m away
    sent[6] = replace(sent[6], command=201, lon_e7=84733400)  # a ROI, 11 m away
    assert Upload(station, sent).run() is ACCEPTED
    assert not [text for text in station.texts() if "WP" in text]
    multiwii.answers = {**multiwii.answers, 122: nav_config(60, 100, 25, wp_radius=900)}
    assert Upload(station, sent).run() is ACCEPTED
    texts = " ".join(station.texts())
    assert "flown at 25 m (nav_max_altitude)" in texts
    assert "WP 5: leg of 100 m or more: stops there (+1)" in texts
    assert "WP 7: passes the ROI within 14 m: may end there" in texts


def test_a_multiwii_that_arms_during_a_read_is_not_written() -> None:
    """Not even the one that clears the record in RAM, although telemetry has not noticed arming yet."""
    multiwii, world, station = fresh(FakeMultiwii)
    assert Upload(station, plan(10)).run() is ACCEPTED
    honest = multiwii.read

    def read(number: int) -> bytes:
        if number and not multiwii.armed:
            multiwii.armed = True
            multiwii.commands.clear()
        return honest(number)

    multiwii.read = read  # type: ignore[method-assign]
    world.run(3)
    assert multiwii.armed
    assert Nav.SET_WP not in multiwii.commands


@pytest.mark.parametrize("erased", [bytes(19) + b"\xfe", b"\xff" * 20])
def test_reading_a_multiwii_ends_at_an_erased_record(erased: bytes) -> None:
    multiwii = FakeMultiwii()
    multiwii.erased = erased
    multiwii.places[1] = packed(plan(9))[0]
    world, station = found(multiwii)
    assert Download(station).run()[1:] == []
    asked = [frame for frame in world.requests() if frame.command == Nav.WP]
    assert {frame.payload[0] for frame in asked} == {0, 1, 2}


def test_records_that_a_multiwii_already_holds_are_not_written() -> None:
    multiwii, _, station = fresh(FakeMultiwii)
    assert Upload(station, plan(20)).run() is ACCEPTED
    written = multiwii.writes
    assert Upload(station, plan(20)).run() is ACCEPTED
    # Only the return home for the time of the check, and the first record again.
    assert multiwii.writes == written + 2


def test_only_some_records_are_read_to_notice_changes() -> None:
    world, station = found(FakeMultiwii())
    assert Upload(station, plan(40)).run() is ACCEPTED
    world.run(3)
    asked = [frame for frame in world.requests_during(20) if frame.command == Nav.WP]
    # Not as many as if all 39 were read each second.
    assert 20 <= len(asked) < 20 * 39


def test_a_warning_for_legs_at_which_a_multiwii_stops() -> None:
    """Waypoints 400 m apart: only the jump back is too long. A heading change in between is not a leg."""
    second, third = (replace(WP, lat_e7=LAT + 36_000 * place) for place in (1, 2))
    yaw = item(C.CONDITION_YAW, at=False, p1=90.0)
    legs = (WP, second, yaw, third, jump(1), third)
    assert findings_for(*legs, rules=MULTIWII) == [(5, "lat_e7", 0, 0)]
    assert findings_for(*legs) == []


def test_a_warning_for_legs_that_a_multiwii_ends_at_a_region_of_interest() -> None:
    """By default within 1 m of it, and a craft strays by 5 m."""

    def north(metres: float, command: int = C.NAV_WAYPOINT, east: float = 0.0) -> MissionItem:
        return item(command, lat_e7=LAT + round(metres * 90), lon_e7=LON + round(east * 128))

    def warned(*items: MissionItem, rules: NavRules = MULTIWII) -> list[int | None]:
        return [finding.seq for finding in verdict_on(*items, rules=rules).findings if finding.is_warning]

    roi, aside, none = north(50, C.NAV_ROI), north(50, C.NAV_ROI, east=7), item(C.DO_SET_ROI_NONE, at=False)
    assert warned(north(0), roi, north(100), north(200)) == [3]
    assert warned(north(0), north(50, C.NAV_ROI, east=5), north(100)) == [3]
    assert warned(north(0), aside, north(100)) == []
    assert warned(north(0), roi, north(100), rules=INAV) == []
    assert warned(north(0), roi, none, north(100)) == []
    assert warned(north(0), roi, item(C.CONDITION_YAW, at=False, p1=90), north(100)) == []
    assert warned(roi, north(50)) == [2]
    # After the jump, the ROI is in force on the earlier legs, too.
    assert warned(north(0), north(100), roi, north(120), north(140), jump(1), north(160)) == [6]
    assert warned(north(0), north(100), roi, north(120), north(140), none, jump(1), north(160)) == []
