# SPDX-License-Identifier: GPL-3.0-or-later
"""The models of what Mission Planner and QGroundControl show follow the rules of their sources."""

from pymavlink.dialects.v20 import ardupilotmega as m

from protocols.mavlink.codec import FrameWriter
from protocols.mavlink.dialect import Message
from tests.support.mission_planner_screen import MissionPlannerScreen
from tests.support.packing import pack
from tests.support.qgc_screen import MISSING, NEEDS_SETUP, QgcScreen

MOTORS, GYRO, GPS, PREARM = (
    m.MAV_SYS_STATUS_SENSOR_MOTOR_OUTPUTS,
    m.MAV_SYS_STATUS_SENSOR_3D_GYRO,
    m.MAV_SYS_STATUS_SENSOR_GPS,
    m.MAV_SYS_STATUS_PREARM_CHECK,
)


def text(words: str, severity: int = m.MAV_SEVERITY_WARNING) -> Message:
    return m.MAVLink_statustext_message(severity, words.encode())


def sensors(enabled: int, healthy: int) -> Message:
    return m.MAVLink_sys_status_message(enabled, enabled, healthy, 0, 0, -1, -1, 0, 0, 0, 0, 0, 0)


def heartbeat(status: int = m.MAV_STATE_STANDBY, *, armed: bool = False) -> Message:
    base_mode = m.MAV_MODE_FLAG_CUSTOM_MODE_ENABLED | (m.MAV_MODE_FLAG_SAFETY_ARMED if armed else 0)
    return m.MAVLink_heartbeat_message(m.MAV_TYPE_QUADROTOR, 3, base_mode, 5, status, 3)


def received(message: Message, version: int = 2) -> Message:
    return m.MAVLink(None).decode(bytearray(FrameWriter(1, 1).frame(pack(message), version)))


def planner(*fed: tuple[float, Message]) -> MissionPlannerScreen:
    screen = MissionPlannerScreen()
    for at, message in fed:
        screen.take(at, received(message))
    return screen


def qgc(*fed: tuple[float, Message]) -> QgcScreen:
    screen = QgcScreen()
    for at, message in fed:
        screen.take(at, received(message))
    return screen


class TestMissionPlanner:
    def test_the_hud_keeps_the_last_warning_for_ten_seconds(self) -> None:
        screen = planner((1, text("first")), (1.1, text("last")), (1.2, text("notice", m.MAV_SEVERITY_NOTICE)))
        assert [screen.hud(at) for at in (0.5, 1, 1.2, 11, 11.2)] == ["", "first", "last", "last", ""]

    def test_the_same_text_does_not_renew_the_line(self) -> None:
        screen = planner((0, text("lost")), (9, text("lost")), (18, text("lost")))
        assert [screen.hud(at) for at in (9, 11, 17, 18)] == ["lost", "", "", "lost"]
        assert screen.line.longest_gap_s(0, 28) == 8

    def test_an_unhealthy_sensor_replaces_the_line_only_while_it_is_enabled(self) -> None:
        screen = planner((0, text("lost")), (1, sensors(MOTORS, 0)), (2, sensors(MOTORS | GYRO | GPS, MOTORS)))
        assert [screen.hud(at) for at in (1.5, 2)] == ["lost", "Unhealthy GPS Signal"]

    def test_while_prearm_is_unhealthy_the_last_such_text_is_shown(self) -> None:
        notice = text("PreArm: no RC link", m.MAV_SEVERITY_INFO)
        status = [(at, sensors(MOTORS | PREARM, MOTORS)) for at in range(2, 40)]
        screen = planner((0, notice), (1, text("another")), *status)
        assert [screen.hud(at) for at in (0, 1)] == ["PreArm: no RC link", "another"]
        assert [screen.hud(at) for at in (2, 39)] == ["PreArm: no RC link"] * 2
        assert not screen.ready.at(39)
        screen.asked_for_prearm_checks(39)
        assert screen.prearm_window(40.5)[0] == "Prearm checks failing"
        screen.take(40.6, received(notice))
        assert screen.prearm_window(41) == ["PreArm: no RC link"]

    def test_the_voice_says_the_first_of_several_and_then_the_line(self) -> None:
        screen = planner((0, text("first")), (0.1, text("second")), (0.2, text("third")), (5, heartbeat()))
        assert screen.heard() == ["first", "third"]
        assert planner((0, text("PreArm: first")), (5, heartbeat())).heard() == []

    def test_motor_outputs_that_are_not_enabled_read_safety(self) -> None:
        screen = planner((0, sensors(GYRO, GYRO)), (1, heartbeat(armed=True)))
        assert screen.hud(1) == "(SAFETY)"
        assert screen.safe.at(1)

    def test_armed_mode_and_failsafe_come_from_the_heartbeat(self) -> None:
        screen = planner((0, heartbeat()), (1, heartbeat(m.MAV_STATE_CRITICAL, armed=True)))
        assert [(screen.armed.at(at), screen.failsafe.at(at), screen.mode.at(at)) for at in (0, 1)] == [
            (False, False, "Loiter"),
            (True, True, "Loiter"),
        ]


class TestQgc:
    def test_readiness_is_the_prearm_bit_once_it_was_enabled(self) -> None:
        beats = [(at, heartbeat()) for at in range(6)]
        screen = qgc(*beats[:2], (1, sensors(PREARM, 0)), *beats[2:4], (3, sensors(PREARM, PREARM)), *beats[4:])
        screen.take(5, received(sensors(GYRO, 0)))
        assert [screen.status(at) for at in (1, 3, 5, 9)] == ["Not Ready", "Ready", "Ready", "Comms Lost"]

    def test_without_component_parameters_it_shows_two_dialogs_and_leaves_the_map(self) -> None:
        screen = qgc((0, heartbeat()), (1, m.MAVLink_param_value_message(b"SYSID_THISMAV", 1, 9, 1, 0)))
        assert [words.split(" Missing params")[0] for _, words in screen.dialogs] == [MISSING, NEEDS_SETUP]
        assert screen.is_in_setup
        assert screen.status(1) == "Not Ready"

    def test_the_reason_not_to_arm_is_shown_for_35_s_and_is_spoken_at_most_every_10_s(self) -> None:
        reason = text("PreArm: no RC link")
        screen = qgc(*((at, reason) for at in (0, 5, 12)))
        assert [screen.prearm_error.at(at) for at in (46, 48)] == ["PreArm: no RC link", ""]
        assert len(screen.heard()) == 2

    def test_an_error_is_a_banner_and_info_is_not_spoken(self) -> None:
        screen = qgc((0, text("refused", m.MAV_SEVERITY_ERROR)), (1, text("small", m.MAV_SEVERITY_INFO)))
        assert [words for _, words in screen.banners] == screen.heard() == ["refused"]
        assert qgc((0, text("lost"))).banners == []

    def test_an_armed_craft_flies_unless_it_stands_by(self) -> None:
        states = (m.MAV_STATE_STANDBY, m.MAV_STATE_CRITICAL, m.MAV_STATE_STANDBY, m.MAV_STATE_ACTIVE)
        screen = qgc(*((at, heartbeat(state, armed=True)) for at, state in enumerate(states)))
        assert [screen.status(at) for at in range(4)] == ["Armed", "Flying", "Armed", "Flying"]

    def test_the_first_packet_decides_the_version(self) -> None:
        screen = QgcScreen()
        screen.take(0, received(heartbeat(), 1))
        screen.take(1, received(heartbeat(), 2))
        assert screen.mavlink_version == 1

    def test_a_refused_read_is_a_dialog_and_a_stray_ack_is_not(self) -> None:
        screen = qgc((0, m.MAVLink_mission_ack_message(255, 190, m.MAV_MISSION_DENIED)))
        screen.sent(m.MAVLink_mission_request_list_message(1, 1))
        screen.take(1, received(m.MAVLink_mission_ack_message(255, 190, m.MAV_MISSION_DENIED)))
        assert [at for at, _ in screen.dialogs] == [1]
