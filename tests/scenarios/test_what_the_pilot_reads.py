# SPDX-License-Identifier: GPL-3.0-or-later
"""What the pilot reads in Mission Planner and QGroundControl, 1, 9 and 30 s after each event."""

from dataclasses import replace
from functools import partial
from itertools import pairwise
from math import inf
from typing import Any

import pytest
from pymavlink.dialects.v20 import ardupilotmega as m

from bridge.controllers.harakiri.profile import arming_blockers
from bridge.gcs.rights import LinkAccess
from bridge.model.vehicle import Source, Sticks, Vehicle
from protocols.mavlink.dialect import Message
from protocols.mission_item import Frame, MissionResult
from simulator.board.msp_options import MspOptions
from simulator.board.msp_sensors import SensorReplies
from simulator.board.options import Faults, SimOptions, TelemetryProtocol
from simulator.commands.fc_kinds import make_board
from simulator.inav.boxes import BOXES as INAV_BOXES
from tests.bridge.controllers.inav.test_approaches import set_approaches
from tests.bridge.controllers.inav.test_place_store import RALLY, RALLY_ITEMS
from tests.support.conversations import Upload, ack_message, clear_message, count_message, item_message, waypoints
from tests.support.qgc_upload import QGC_HEARTBEAT
from tests.support.screens import Glance, Screens
from tests.support.world import GroundStation, World

#: Harakiri's boxes.
ANGLE, BARO = 1 << 0, 1 << 2
#: INAV's arming flags.
NOT_LEVEL, RC_LINK = 1 << 8, 1 << 18
#: INAV's permanent number of the box.
FAILSAFE = 27
NOT_FOUND = "No flight controller found: check power, wiring"
HEARTBEAT = m.MAVLink_heartbeat_message(m.MAV_TYPE_GCS, m.MAV_AUTOPILOT_INVALID, 0, 0, 0, 3)
Indoors = tuple[World, GroundStation, Screens]
LOST, LOST_ON_GROUND = "Flight controller lost: silent for", "PreArm: flight controller lost"


def connected(world: World, seconds: float = 15.0) -> tuple[GroundStation, Screens]:
    """A station on a world that has run for a while: what came before is no longer on the screens."""
    station = GroundStation(world)
    # As Mission Planner is known by, with the usual rate.
    station.send(m.MAVLink_request_data_stream_message(1, 1, m.MAV_DATA_STREAM_EXTRA3, 1, 1))
    screens = Screens(station)
    world.run(seconds)
    return station, screens


def on_the_ground(**options: Any) -> tuple[World, GroundStation, Screens]:
    world = World(SimOptions(**options), speeds=(115200,))
    world.wait_ready()
    return world, *connected(world)


def inav(blockers: int = 0) -> tuple[World, GroundStation, Screens]:
    faults = Faults(boxes=0, arming_blockers=blockers)
    proven = {"udp": LinkAccess(may_write=lambda _peer: True)}  # an open link must not set the waypoint
    world = World(speeds=(115200,), peer=make_board("inav", MspOptions(), faults), links=proven)
    world.faults = faults
    return world, *connected(world)


def ask(station: GroundStation, message: Message) -> None:
    station.send(message)
    station.world.run(0.5)


def command(number: int, param1: float = 0.0) -> Message:
    return m.MAVLink_command_long_message(1, 1, number, 0, param1, 0, 0, 0, 0, 0, 0)


def is_quiet(glance: Glance) -> bool:
    """Nothing on the HUD, ready, and no trouble."""
    return glance.hud in ("", "PreArm: ready") and glance.ready_to_arm and not (glance.failsafe or glance.safe)


def times_shown(screens: Screens, text: str, began: float) -> int:
    """How often the HUD has shown a text for at least 0.4 s: until the next SYS_STATUS."""
    changes = [(at, line) for at, line in screens.mission_planner.line.changes if at >= began]
    ends = [at for at, _ in changes[1:]] + [inf]
    return sum(line == text and end >= at + 0.4 for (at, line), end in zip(changes, ends, strict=True))


class TestConnecting:
    def test_a_healthy_craft_is_quiet(self) -> None:
        world = World(speeds=(115200,))
        world.wait_ready()
        _, screens = connected(world, 0)
        for glance in screens.look():
            assert is_quiet(glance), glance
            assert glance.qgc == "Ready"
        assert screens.mission_planner.heard() == []

    def test_a_board_that_is_never_found_is_not_a_ready_vehicle(self) -> None:
        world = World(speeds=(115200,), powered=False)
        _, screens = connected(world, 0)
        first, ninth, last = screens.look()
        assert [glance.ready_to_arm for glance in (first, ninth, last)] == [False] * 3
        assert [glance.qgc for glance in (first, ninth, last)] == ["Not Ready"] * 3
        assert not first.failsafe
        for glance in (last, *screens.look()):
            assert glance.hud in ("PreArm: no flight controller: check power, wiring", NOT_FOUND)
            assert glance.failsafe
            assert glance.qgc_reason.startswith("PreArm: no flight controller")
        assert screens.mission_planner.heard() == [NOT_FOUND]
        assert screens.mission_planner.line.longest_gap_s(12, world.now) < 1.1

    def test_the_receiver_is_not_missing_before_the_channels_are_read(self) -> None:
        """Mission Planner's "NO RC Receiver" was also shown while nothing asked the board for its channels."""
        world, station, screens = on_the_ground()
        ask(station, m.MAVLink_command_long_message(1, 1, 511, 0, m.MAVLINK_MSG_ID_RC_CHANNELS, -1, 0, 0, 0, 0, 0))
        world.run(10)
        assert all(is_quiet(glance) for glance in screens.look())

    def test_a_restarted_station_is_greeted_again(self) -> None:
        """Mission Planner on a known endpoint: home stays at 0, 0 until HOME_POSITION comes."""
        world, _, _ = inav(NOT_LEVEL)
        before = GroundStation(world, "restarted")
        before.send(HEARTBEAT)
        world.run(20)
        again = GroundStation(world, "restarted")
        again.send(HEARTBEAT)
        world.run(1.1)
        assert len(again.messages("HEARTBEAT")) >= 5
        assert again.messages("HOME_POSITION")
        assert again.texts() == ["PreArm: not level"]

    def test_a_station_that_is_never_silent_is_greeted_once(self) -> None:
        world, station, _ = on_the_ground()
        station.take()
        world.run(20)
        assert len(station.messages("HEARTBEAT")) == pytest.approx(20, abs=1)

    @pytest.mark.parametrize("asked", [m.MAV_CMD_DO_SEND_BANNER, m.MAV_CMD_REQUEST_AUTOPILOT_CAPABILITIES])
    def test_home_comes_with_the_version_and_the_banner(self, asked: int) -> None:
        _, station, _ = on_the_ground()
        station.take()
        ask(station, command(asked, 1))
        assert len(station.messages("HOME_POSITION")) == 1


class TestLostFlightController:
    def test_on_the_ground_it_stays_until_the_board_is_back(self) -> None:
        world, _, screens = on_the_ground()
        world.power_off()
        world.run(4.5)
        began = world.now
        for glance in screens.look():
            assert glance.hud.startswith((LOST, LOST_ON_GROUND))
            assert glance.failsafe
            assert not glance.safe
            assert (glance.ready_to_arm, glance.qgc, glance.qgc_reason) == (False, "Not Ready", LOST_ON_GROUND)
        assert screens.mission_planner.line.longest_gap_s(began, world.now) == 0
        assert screens.mission_planner.heard(began - 2)[0] == f"{LOST} 3 s"
        world.power_on()
        world.wait_ready()
        for glance in screens.look():
            assert is_quiet(glance), glance
            assert glance.qgc == "Ready"
            assert glance.qgc_reason in ("PreArm: ready", "")

    def test_in_flight_only_the_failsafe_is_shown(self) -> None:
        world, _, screens = on_the_ground()
        world.faults.armed = True
        world.run(20)
        world.faults.hang = True
        world.run(3.5)
        began = world.now
        for glance in screens.look():
            assert glance.hud.startswith(LOST)
            assert glance.failsafe
            assert glance.armed
            assert not glance.safe
        assert screens.mission_planner.line.longest_gap_s(began, world.now) == 0
        lines = screens.mission_planner.line.values(began - 3)
        assert all(line.startswith(LOST) for line in lines), lines
        world.faults.hang = False
        world.wait_ready()
        assert [glance.hud.split(" after")[0] for glance in screens.look()] == ["Flight controller back"] * 2 + [""]

    @pytest.mark.parametrize("protocol", TelemetryProtocol)
    def test_a_change_of_protocol_on_arming_is_not_a_loss(self, protocol: TelemetryProtocol) -> None:
        world = World(SimOptions(tele_prot=protocol))
        world.wait_ready()
        _, screens = connected(world)
        began = world.now
        world.faults.armed = True
        world.run(3)
        for glance in screens.look():
            assert glance.armed
            assert not glance.safe
            assert not glance.failsafe
        assert set(screens.mission_planner.line.values(began)) == set()


class TestArming:
    def test_reasons_not_to_arm_stay_while_they_hold(self) -> None:
        world, _, screens = inav(NOT_LEVEL | RC_LINK)
        began = world.now
        for glance in screens.look():
            assert glance.hud == glance.qgc_reason == "PreArm: not level, no RC link"
            assert (glance.ready_to_arm, glance.qgc) == (False, "Not Ready")
        assert screens.mission_planner.line.longest_gap_s(began, world.now) < 1.1
        assert screens.mission_planner.heard() == []
        world.faults.arming_blockers = NOT_LEVEL
        world.run(5)
        assert [glance.hud for glance in screens.look()] == ["PreArm: not level"] * 3
        world.faults.arming_blockers = 0
        world.run(1.5)
        for glance in screens.look():
            assert is_quiet(glance)
            assert glance.qgc == "Ready"

    def test_the_prearm_window_is_answered(self) -> None:
        world, station, screens = inav(NOT_LEVEL)
        screens.mission_planner.asked_for_prearm_checks(world.now)
        world.run(0.01)
        ask(station, command(m.MAV_CMD_RUN_PREARM_CHECKS))
        world.run(1)
        assert station.messages("COMMAND_ACK")[-1].result == m.MAV_RESULT_ACCEPTED
        assert screens.mission_planner.prearm_window(world.now) == ["PreArm: not level"]

    def test_many_reasons_take_several_whole_lines(self) -> None:
        _, _, screens = inav(sum(1 << bit for bit in (8, 9, 10, 11, 12, 13, 14, 15, 16, 18, 19)))
        texts = [text for text in screens.mission_planner.texts() if text.startswith("PreArm: ")]
        assert max(map(len, texts)) <= 50
        assert " ".join(texts).count("accelerometer not calibrated") == len(screens.mission_planner.texts()) // len(
            texts
        )

    def test_a_harakiri_does_not_arm_with_the_barometers_switch_on(self) -> None:
        world, _, screens = on_the_ground()
        world.faults.boxes = ANGLE | BARO
        world.run(1)
        # Every ten seconds the line is empty until the next SYS_STATUS.
        assert [glance.hud for glance in screens.look(1, 9, 31)] == ["PreArm: switch BARO off"] * 3

    def test_a_harakiri_does_not_arm_with_a_raised_throttle(self) -> None:
        for throttle_us, blockers in ((1250, ("throttle not low",)), (1249, ()), (1000, ())):
            vehicle = Vehicle()
            vehicle.hear(Sticks(0.0, Source.MSP, (1500, 1500, throttle_us, 1500)))
            assert arming_blockers(vehicle, 0.5) == blockers

    def test_armed_and_disarmed(self) -> None:
        world, _, screens = on_the_ground()
        world.faults.armed = True
        for glance in screens.look():
            assert (glance.armed, glance.hud, glance.safe, glance.failsafe) == (True, "", False, False)
            assert glance.qgc == "Flying"
        world.faults.armed = False
        for glance in screens.look():
            assert is_quiet(glance)
            assert (glance.armed, glance.qgc) == (False, "Ready")


class TestWritingMissions:
    """Indoors: the GPS has no fix, so "Unhealthy GPS Signal" would replace every text."""

    @pytest.fixture
    def indoors(self, monkeypatch: pytest.MonkeyPatch) -> tuple[World, GroundStation, Screens]:
        monkeypatch.setattr("simulator.board.msp_port.SensorReplies", partial(SensorReplies, fix_3d=0))
        world, station, screens = on_the_ground()
        assert screens.glance().hud == "Unhealthy GPS Signal"
        return world, station, screens

    def test_a_verified_mission_is_not_a_warning(self) -> None:
        _, station, screens = on_the_ground()
        assert Upload(station, waypoints(9)).run() is MissionResult.ACCEPTED
        assert all(is_quiet(glance) for glance in screens.look())
        assert screens.mission_planner.texts()[-1].startswith("9 of 9 stored: ")

    def test_the_summary_of_a_lossy_write_stays_and_is_spoken(self, indoors: Indoors) -> None:
        world, station, screens = indoors
        items = waypoints(9)
        items[3], items[4] = replace(items[3], command=178), replace(items[4], frame=Frame.GLOBAL)
        began, summary = world.now, "8 of 9 stored: 1 dropped, 1 Alt now relative, 7 m"
        assert Upload(station, items).run() is MissionResult.ACCEPTED
        last = screens.look()[-1]
        assert times_shown(screens, summary, began) >= 2
        assert last.hud in ("Unhealthy GPS Signal", "")
        assert screens.mission_planner.heard(began)[0] == summary
        assert screens.mission_planner.texts(began)[-3:] == [summary] * 3
        # A blocker or failsafe that begins meanwhile must not wait.
        times = [at for at, message in station.received if message.get_type() == "SYS_STATUS" and at > began]
        assert max(after - before for before, after in pairwise(times)) < 0.6

    def test_a_summary_that_stays_on_the_hud_is_not_repeated(self) -> None:
        world, station, screens = on_the_ground()
        items = waypoints(9)
        items[3] = replace(items[3], command=178)
        began = world.now
        assert Upload(station, items).run() is MissionResult.ACCEPTED
        assert [glance.hud[:13] for glance in screens.look(1, 9)] == ["8 of 9 stored"] * 2
        assert times_shown(screens, screens.glance().hud, began) == 1

    def test_an_erased_mission_stays(self, indoors: Indoors) -> None:
        _, station, screens = indoors
        assert Upload(station, waypoints(9)).run() is MissionResult.ACCEPTED
        items = waypoints(2)
        items[1] = replace(items[1], command=178)
        began = station.world.now
        assert Upload(station, items).run() is MissionResult.ACCEPTED
        screens.look()
        assert times_shown(screens, "Mission erased: no command left", began) >= 2

    def test_a_cleared_mission_stays(self, indoors: Indoors) -> None:
        _, station, screens = indoors
        assert Upload(station, waypoints(9)).run() is MissionResult.ACCEPTED
        began = station.world.now
        ask(station, clear_message())
        screens.look()
        assert times_shown(screens, "Mission on the flight controller cleared", began) >= 2

    def test_the_reason_for_a_refusal_stays(self, indoors: Indoors) -> None:
        _, station, screens = indoors
        items = waypoints(9)
        items[4] = replace(items[4], lat_e7=950_000_000)
        began = station.world.now
        assert Upload(station, items).run() is MissionResult.INVALID_PARAM5_X
        screens.look()
        assert times_shown(screens, "Rejected, WP 4: latitude beyond 90 deg", began) >= 2

    def test_write_fast_does_not_warn_of_home(self) -> None:
        """It sends home in frame 3, and ends with its own MISSION_ACK."""
        world, station, screens = on_the_ground()
        items = waypoints(9)
        items[0] = replace(items[0], frame=Frame.GLOBAL_RELATIVE_ALT)
        ask(station, count_message(len(items)))
        for seq, item in enumerate(items):
            station.send(item_message(seq, item))
        ask(station, ack_message(MissionResult.ACCEPTED))
        world.run(5)
        assert any("9 of 9 stored: 7 m" in text for text in station.texts())
        assert all(is_quiet(glance) for glance in screens.look())

    def test_another_list_whose_home_is_a_waypoint_is_a_warning(self) -> None:
        """A script that sends its first waypoint as item 0, in frame 3."""
        _, station, _ = on_the_ground()
        items = waypoints(9)
        items[0] = replace(items[0], frame=Frame.GLOBAL_RELATIVE_ALT)
        assert Upload(station, items).run() is MissionResult.ACCEPTED
        assert "Home: item 0 became home, not flown to" in station.texts()
        assert station.texts()[-1].startswith("9 of 9 stored: check home")

    @pytest.mark.parametrize("radius_cm", [3000.0, 199.949])
    def test_requests_after_a_write_do_not_raise_an_error(self, radius_cm: float) -> None:
        """Its default radius of 30 m, or 6.56 ft for 2 m; 10 s later PREFLIGHT_STORAGE, perhaps in flight."""
        world, station, screens = on_the_ground()
        assert Upload(station, waypoints(9)).run() is MissionResult.ACCEPTED
        ask(station, m.MAVLink_param_set_message(1, 1, b"WPNAV_RADIUS", radius_cm, 9))
        assert station.messages("PARAM_VALUE")[-1].param_value == 200
        world.faults.armed = True
        world.run(10)
        ask(station, command(m.MAV_CMD_PREFLIGHT_STORAGE, 1))
        assert station.messages("COMMAND_ACK")[-1].result == m.MAV_RESULT_ACCEPTED
        assert [glance.hud for glance in screens.look()] == [""] * 3
        assert screens.qgc.dialogs == []

    def test_a_long_summary_is_one_line(self) -> None:
        _, station, screens = on_the_ground()
        items = waypoints(146)
        for seq in range(10, 120):
            items[seq] = replace(items[seq], command=178)
        for seq in range(120, 146):
            items[seq] = replace(items[seq], frame=Frame.GLOBAL, alt_m=0.0)
        assert Upload(station, items).run() is MissionResult.ACCEPTED
        assert screens.look(1)[0].hud.startswith("36 of 146 stored: 110 dropped, ")


class TestRestart:
    def test_a_board_that_restarts_is_lost_and_back(self) -> None:
        world, _, screens = on_the_ground()
        world.power_off()
        world.power_on()
        seen = {glance.hud.split(":")[0] for glance in screens.look(*range(4, 8))}
        assert seen <= {"Flight controller lost", "PreArm", "Flight controller back after 7 s"}
        world.wait_ready()
        assert all(is_quiet(glance) for glance in screens.look())

    def test_a_failsafe_in_flight_is_read_and_ends(self) -> None:
        world, _, screens = inav()
        world.faults.armed = True
        world.run(5)
        world.faults.boxes = 1 << INAV_BOXES["9.1.0"].index(FAILSAFE)
        world.run(1)
        first, ninth, last = screens.look()
        assert first.hud == ninth.hud == "Failsafe: the flight controller has taken over"
        assert (first.failsafe, ninth.failsafe, last.failsafe) == (True, True, True)
        world.faults.boxes = 0
        world.run(1)
        assert not any(glance.failsafe for glance in screens.look())


def test_set_wp_on_an_inav_is_refused_only_while_it_does_not_fly_the_mission() -> None:
    world, station, screens = inav()
    home = world.bridge.vehicle.home
    assert home is not None
    first, *legs = waypoints(4)
    legs = [replace(leg, lat_e7=home.lat_e7 + 900 * n, lon_e7=home.lon_e7) for n, leg in enumerate(legs, 1)]
    assert Upload(station, [first, *legs]).run() is MissionResult.ACCEPTED
    assert world.faults is not None
    world.faults.armed = True
    world.run(15)
    began = world.now
    ask(station, m.MAVLink_mission_set_current_message(1, 1, 2))
    world.faults.boxes = 1 << INAV_BOXES["9.1.0"].index(28)
    world.run(1)
    ask(station, m.MAVLink_mission_set_current_message(1, 1, 3))
    world.run(60)
    assert screens.qgc.heard(began) == ["Set WP: only in flight, in NAV WP mode"]
    assert screens.mission_planner.heard(began) == ["Set WP: only in flight, in NAV WP mode"]
    assert screens.glance().hud == ""


def test_a_deleted_rally_points_landing_approach_is_read_in_full() -> None:
    """Mission Planner's HUD has the summary; QGroundControl joins the pieces of the sentence and says it."""
    world, station, screens = inav()
    assert Upload(station, RALLY_ITEMS, mission_type=RALLY).run() is MissionResult.ACCEPTED
    set_approaches(world.naze, 0)
    began = world.now
    assert Upload(station, RALLY_ITEMS[1:], mission_type=RALLY).run() is MissionResult.ACCEPTED
    world.run(1)
    lost = "Safehome 0 was deleted or moved, and lost FW approach 0"
    summary = "Rally points verified: 2 items, warnings: 1"
    assert lost in [" ".join(text.split()) for text in screens.qgc.heard(began)]
    assert screens.mission_planner.texts(began)[-1] == screens.glance().hud == summary


def test_once_after_the_first_write_qgroundcontrol_hears_that_only_missions_are_stored() -> None:
    """It leaves out the others silently; Mission Planner asks, and gets the refusal."""
    world, station, screens = on_the_ground()
    station.send(QGC_HEARTBEAT)
    for _ in range(2):
        assert Upload(station, waypoints(9)).run() is MissionResult.ACCEPTED
        world.run(5.0)
    notices = [text for text in station.texts() if text == "Fences and rally points are not stored here"]
    assert len(notices) == 1
    assert all(glance.hud != notices[0] for glance in screens.look())
