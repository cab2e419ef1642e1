# SPDX-License-Identifier: GPL-3.0-or-later
"""Every button of a ground station has an answer: its pilot reads why nothing happens, once."""

from dataclasses import replace

import pytest
from pymavlink.dialects.v20 import ardupilotmega as m

from protocols.float32 import single
from protocols.mavlink.dialect import Message
from protocols.mission_item import Command, MissionItem, MissionResult
from simulator.commands.fc_kinds import make_board
from tests.support.conversations import Download, Upload, count_message, list_message, waypoints
from tests.support.qgc_upload import QGC_HEARTBEAT
from tests.support.screens import Screens
from tests.support.world import GroundStation, World

JOYSTICK, CAMERA = "Joystick ignored: fly with the transmitter", "Cameras and gimbals are not controlled here"
#: Mission Planner's list "Actions": the command of each entry that was not answered by a text of its own.
ACTIONS = {
    "Trigger Camera NOW": m.MAV_CMD_DO_DIGICAM_CONTROL,
    "Do Parachute": m.MAV_CMD_DO_PARACHUTE,
    "Engine Start": m.MAV_CMD_DO_ENGINE_CONTROL,
    "Battery Reset": m.MAV_CMD_BATTERY_RESET,
    "ADSB Out Ident": m.MAV_CMD_DO_ADSB_OUT_IDENT,
    "Scripting cmd stop": m.MAV_CMD_SCRIPTING,
    "HighLatency Enable": m.MAV_CMD_CONTROL_HIGH_LATENCY,
    "Format SD Card": m.MAV_CMD_STORAGE_FORMAT,
    "Preflight Reboot": m.MAV_CMD_PREFLIGHT_REBOOT_SHUTDOWN,
    "Mission Start": m.MAV_CMD_MISSION_START,
    "System Time": m.MAV_CMD_DO_SET_PARAMETER,
    "Toggle Safety Switch": m.MAV_CMD_DO_SET_SAFETY_SWITCH_STATE,
    "Point Camera Here": m.MAV_CMD_DO_SET_ROI,
    "Capture image": m.MAV_CMD_IMAGE_START_CAPTURE,
}


def connected(kind: str = "naze", heartbeat: Message = QGC_HEARTBEAT) -> tuple[World, GroundStation]:
    peer = None if kind == "naze" else make_board(kind)
    world = World(speeds=(115200,), peer=peer)
    world.run(15) if peer else world.wait_ready()
    station = GroundStation(world)
    station.send(heartbeat, wait_s=5)
    station.take()
    return world, station


def command(number: int) -> Message:
    return m.MAVLink_command_long_message(1, 1, number, 0, 1, 0, 0, 0, 0, 0, 0)


@pytest.mark.parametrize("action", ACTIONS)
def test_every_action_is_answered_by_a_text(action: str) -> None:
    _world, station = connected()
    station.send(command(ACTIONS[action]), wait_s=0.5)
    assert station.messages("COMMAND_ACK")[0].result in (m.MAV_RESULT_DENIED, m.MAV_RESULT_UNSUPPORTED)
    (text,) = station.messages("STATUSTEXT")
    assert text.severity <= m.MAV_SEVERITY_WARNING
    assert len(text.text) <= 50


def test_a_refusal_in_qgroundcontrol_is_a_dialog_without_a_banner() -> None:
    world, station = connected()
    screen = Screens(station).qgc
    station.heartbeat = QGC_HEARTBEAT
    world.run(2)
    began = world.now
    station.send(command(m.MAV_CMD_COMPONENT_ARM_DISARM), wait_s=5)
    assert (screen.banners, screen.heard(began)[0]) == ([], "Arm and disarm with the transmitter")


@pytest.mark.parametrize(
    ("number", "text"),
    [
        (m.MAV_CMD_DO_DIGICAM_CONTROL, CAMERA),
        # "Toggle Safety Switch": base_mode is SAFETY_ARMED, without a mode.
        (m.MAV_CMD_DO_SET_MODE, "Arm and disarm with the transmitter"),
    ],
    ids=["trigger", "safety"],
)
def test_both_messages_of_a_button_of_mission_planner_have_the_same_answer(number: int, text: str) -> None:
    world, station = connected()
    station.send(m.MAVLink_command_long_message(1, 1, number, 0, 128, 1, 0, 0, 0, 0, 0))
    if number == m.MAV_CMD_DO_SET_MODE:
        station.send(m.MAVLink_set_mode_message(1, 128, 1))
    elif number == m.MAV_CMD_DO_DIGICAM_CONTROL:
        station.send(m.MAVLink_digicam_control_message(1, 1, 0, 0, 0, 0, 1, 0, 0, 0))
    world.run(0.5)
    assert station.texts() == [text]


@pytest.mark.parametrize("number", [519, 521, 525, 2504])
def test_a_programs_own_requests_are_refused_silently(number: int) -> None:
    _world, station = connected()
    station.send(command(number), wait_s=0.5)
    assert station.messages("COMMAND_ACK")[0].result == m.MAV_RESULT_UNSUPPORTED
    assert station.texts() == []


@pytest.mark.parametrize(
    ("message", "text"),
    [
        (m.MAVLink_rc_channels_override_message(1, 1, *[1500] * 8), JOYSTICK),
        (m.MAVLink_manual_control_message(1, 0, 0, 0, 0, 0), JOYSTICK),
        (m.MAVLink_mount_control_message(1, 1, 0, 0, 0, 0), CAMERA),
        (m.MAVLink_set_gps_global_origin_message(1, 1, 1, 1), "The origin is home, set by the flight controller"),
        (
            m.MAVLink_set_home_position_message(1, 1, 1, 1, 0, 0, 0, [1, 0, 0, 0], 0, 0, 0),
            "Home is set where the craft is armed",
        ),
    ],
    ids=["override", "manual control", "mount", "origin", "home"],
)
def test_messages_without_an_acknowledgement_are_answered_once(message: Message, text: str) -> None:
    """A joystick sends 50 a second, and must not use up what the station may still ask for."""
    _world, station = connected()
    for _ in range(300):
        station.send(message, wait_s=0.02)
    assert station.texts() == [text]
    station.ask(list_message(), wait_s=1)
    assert station.messages("MISSION_COUNT")


def test_a_plan_with_only_a_fence_clears_the_mission_with_two_notes() -> None:
    """QGroundControl writes its mission as an empty list, and leaves out the fence that is not stored here."""
    world, station = connected()
    items = waypoints(5)
    assert Upload(station, items).run() is MissionResult.ACCEPTED
    world.run(12)
    station.ask(count_message(0), wait_s=3)
    assert {ack.type for ack in station.messages("MISSION_ACK")} == {MissionResult.ACCEPTED}
    said = station.texts()
    assert said[0] == "Plan without waypoints: fences are not stored here"
    assert "Mission on the flight controller cleared" in said
    assert world.stored == ()


@pytest.mark.parametrize("kind", ["betaflight", "lost"])
def test_reading_a_missing_mission_returns_an_empty_list_and_the_reason(kind: str) -> None:
    """QGroundControl reads at each connection: a refusal would be a dialog each time."""
    world, station = connected("betaflight" if kind == "betaflight" else "naze")
    if kind == "lost":
        world.power_off()
        world.run(10)
        station.take()
    station.send(list_message(), wait_s=1)
    (count,) = station.messages("MISSION_COUNT")
    assert count.count <= 1
    assert station.messages("MISSION_ACK") == []
    (text,) = [text for text in station.messages("STATUSTEXT") if text.text.startswith("No mission to read: ")]
    assert text.severity == m.MAV_SEVERITY_INFO
    assert Upload(station, waypoints(5)).run() in (MissionResult.DENIED, MissionResult.UNSUPPORTED)


def test_resume_mission_names_the_way_back() -> None:
    """Mission Planner writes home, a TAKEOFF and the rest of the list as it read them, in single precision."""
    world, station = connected()
    items = waypoints(9)
    assert Upload(station, items).run() is MissionResult.ACCEPTED
    world.run(5)
    read = Download(station).run()
    takeoff = replace(read[1], seq=1, command=Command.NAV_TAKEOFF, lat_e7=0, lon_e7=0, alt_m=10.0)
    rest = [replace(item, lat_e7=round(single((item.lat_e7 or 0) / 1e7) * 1e7)) for item in read[5:]]
    resumed: list[MissionItem] = [read[0], takeoff, *(replace(item, seq=n) for n, item in enumerate(rest, 2))]
    station.take()
    assert Upload(station, resumed).run() is MissionResult.ACCEPTED
    assert any("missions restore" in text for text in station.texts())
    station.take()
    assert Upload(station, waypoints(4, seed=5)).run() is MissionResult.ACCEPTED
    assert not any("missions restore" in text for text in station.texts())


@pytest.mark.parametrize(("ids", "component", "why"), [
    ((1, 1), 1, "sent with the vehicle's own sysid and compid"),
    ((255, 190), 190, "addressed to component 190 instead of 1"),
    ((255, 190), 25, "addressed to component 25 instead of 1"),
])  # fmt: skip
def test_a_sender_that_is_not_heard_is_counted_with_the_reason(ids: tuple[int, int], component: int, why: str) -> None:
    world, _ = connected()
    station = GroundStation(world, "other", sysid=ids[0], compid=ids[1])
    station.send(QGC_HEARTBEAT, wait_s=1)
    for _ in range(3):
        station.send(m.MAVLink_mission_count_message(1, component, 3))
    world.run(1)
    assert world.bridge.counters().refused == {("udp", why): 3}
    assert station.messages("MISSION_REQUEST") == []
    assert [event.facts["why"] for event in world.events("gcs.refused")] == [why]
