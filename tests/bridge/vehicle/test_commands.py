# SPDX-License-Identifier: GPL-3.0-or-later
"""Commands and parameters: each command is acknowledged once, and none acts on the aircraft."""

import math
from collections.abc import Callable

import pytest

from bridge.controllers.harakiri.mission_store import HarakiriMissions
from bridge.missions.fc_mission_store import PushFailure
from bridge.vehicle.telemetry_table import TELEMETRY
from protocols.mavlink.dialect import Message, messages
from simulator.board.options import Faults, SimOptions, TelemetryProtocol
from simulator.commands.fc_kinds import make_board
from tests.support.screens import Screens
from tests.support.world import GroundStation, World, ready_world

m = messages
ACCEPTED, TEMPORARILY_REJECTED, DENIED, UNSUPPORTED = 0, 1, 2, 3
#: Minimum time between two equal refusal texts.
_SILENCE_S = 10.1
#: Unsolicited messages.
TELEMETRY_TYPES = {"HEARTBEAT", "MISSION_CURRENT", "CURRENT_MODE"} | {
    m.mavlink_map[row.msgid].msgname for row in TELEMETRY if row.reading is not None and row.interval_s < math.inf
}


@pytest.fixture(scope="module")
def flying() -> tuple[World, GroundStation]:
    """A world whose board has a fix and a home."""
    world = ready_world()
    world.run(7)
    station = GroundStation(world)
    # A new station gets HOME_POSITION within a second: that is not a reply.
    station.stay_connected()
    world.run(1.2)
    return world, station


def two_stations() -> tuple[World, GroundStation, GroundStation]:
    """Two connected ground stations without unread messages."""
    world = ready_world()
    stations = GroundStation(world, "asking"), GroundStation(world, "other", sysid=254)
    for station in stations:
        station.send(m.MAVLink_heartbeat_message(m.MAV_TYPE_GCS, m.MAV_AUTOPILOT_INVALID, 0, 0, 0, 3))
    world.run(3)
    for station in stations:
        station.take()
    return world, *stations


def long(command: int, param1: float = 0.0, *, system: int = 1, component: int = 1) -> Message:
    return m.MAVLink_command_long_message(system, component, command, 0, param1, 0, 0, 0, 0, 0, 0)


def integer(command: int, param1: float = 0.0) -> Message:
    return m.MAVLink_command_int_message(1, 1, 3, command, 0, 0, param1, 0, 0, 0, 0, 0, 0)


def answers(flying: tuple[World, GroundStation], *sent: Message) -> list[Message]:
    """Send messages; return the replies without telemetry."""
    world, station = flying
    station.take()
    for message in sent:
        station.send(message)
    world.run(0.05)
    return [message for message in station.messages() if message.get_type() not in TELEMETRY_TYPES]


def acks(received: list[Message]) -> list[tuple[int, int, int, int]]:
    return [
        (ack.command, ack.result, ack.target_system, ack.target_component)
        for ack in received
        if ack.get_type() == "COMMAND_ACK"
    ]


@pytest.mark.parametrize("make", [long, integer])
@pytest.mark.parametrize(
    ("command", "param1", "result", "also"),
    [
        (512, 148, ACCEPTED, ["AUTOPILOT_VERSION", "HOME_POSITION"]),
        (520, 1, ACCEPTED, ["AUTOPILOT_VERSION", "HOME_POSITION"]),
        (410, 0, ACCEPTED, ["HOME_POSITION"]),
        (512, 242, ACCEPTED, ["HOME_POSITION"]),
        (42428, 0, ACCEPTED, ["STATUSTEXT", "HOME_POSITION"]),
        (511, 33, ACCEPTED, []),
        (512, 259, UNSUPPORTED, []),
        (512, 269, UNSUPPORTED, []),
        (512, 280, UNSUPPORTED, []),
        (512, math.nan, UNSUPPORTED, []),
        (512, math.inf, UNSUPPORTED, []),
        (512, -1, UNSUPPORTED, []),
        (521, 1, UNSUPPORTED, []),
        (0, 0, UNSUPPORTED, []),
        (65535, 0, UNSUPPORTED, []),
    ],
)
def test_every_command_is_acknowledged_once(
    flying: tuple[World, GroundStation],
    make: Callable[[int, float], Message],
    command: int,
    param1: float,
    result: int,
    also: list[str],
) -> None:
    received = answers(flying, make(command, param1))
    assert acks(received) == [(command, result, 255, 190)]
    others = [message.get_type() for message in received if message.get_type() != "COMMAND_ACK"]
    assert others == also


def test_all_command_numbers_are_acknowledged(flying: tuple[World, GroundStation]) -> None:
    numbers = [*range(700), *range(3000, 3010), *range(42400, 42440)]
    world, _ = flying
    received = []
    for first in range(0, len(numbers), 100):
        world.run(4.0)  # faster would exceed the rate limit
        received += answers(flying, *(long(number) for number in numbers[first : first + 100]))
    # A calibration is refused only after a request to the flight controller.
    assert sorted(ack[0] for ack in acks(received)) == numbers


@pytest.mark.parametrize(
    ("command", "words"),
    [
        (400, "transmitter"),  # arm, disarm
        (176, "transmitter"),  # set mode
        (246, "cannot be rebooted"),
        (300, "transmitter"),  # mission start
        (22, "transmitter"),
        (21, "transmitter"),
        (20, "transmitter"),
        (224, "waypoint cannot be set"),
        (601, "waypoint cannot be set"),  # jump tag
        (181, "cannot be driven"),  # relay
        (207, "no fence"),
    ],
)
def test_commands_that_act_on_the_aircraft_are_denied_with_a_reason(
    flying: tuple[World, GroundStation], command: int, words: str
) -> None:
    world, _ = flying
    world.run(_SILENCE_S)
    before = len(world.written)
    received = answers(flying, long(command, 1.0))
    assert acks(received) == [(command, DENIED, 255, 190)]
    texts = [message for message in received if message.get_type() == "STATUSTEXT"]
    assert len(texts) == 1
    assert words in texts[0].text
    assert texts[0].severity == 3
    # The flight controller got only polls.
    assert all(data[4] < 190 for _, _, data in world.written[before:])
    assert not world.naze.armed


def test_a_mode_change_is_refused_with_a_text(flying: tuple[World, GroundStation]) -> None:
    flying[0].run(_SILENCE_S)
    received = answers(flying, m.MAVLink_set_mode_message(1, 1, 4))
    assert [message.get_type() for message in received] == ["STATUSTEXT"]
    assert "transmitter switches" in received[0].text


@pytest.mark.parametrize(
    "refused",
    [
        *(long(command, 1.0) for command in (400, 176, 246, 300)),
        m.MAVLink_set_mode_message(1, 1, 4),
        m.MAVLink_mission_set_current_message(1, 1, 3),
        m.MAVLink_param_set_message(1, 1, b"WPNAV_RADIUS", -1.0, 9),
        m.MAVLink_mission_item_message(1, 1, 0, 3, 16, 2, 0, 0, 0, 0, 0, 45.0, 8.0, 20.0),
        m.MAVLink_mission_write_partial_list_message(1, 1, 1, 2),
    ],
    ids=lambda message: message.get_type(),
)
def test_only_the_sender_gets_the_refusal(refused: Message) -> None:
    world, asking, other = two_stations()
    asking.send(refused)
    world.run(3)
    assert asking.texts()
    assert other.texts() == []


def test_the_current_waypoint_cannot_be_set() -> None:
    """A MISSION_CURRENT would be another request to MAVSDK, which requests no streams."""
    world, asking, other = two_stations()
    asking.send(m.MAVLink_mission_set_current_message(1, 1, 3))
    world.run(3)
    assert any("cannot be set" in text for text in asking.texts())
    assert asking.messages("MISSION_CURRENT") == []
    assert len(other.messages("MISSION_CURRENT")) == 3
    world.run(3)
    assert asking.messages("MISSION_CURRENT")


def test_set_wp_in_mission_planner_ends_at_once() -> None:
    """Without one MISSION_CURRENT its window hangs for 12 s, while it repeats the request six times."""
    world, asking, other = two_stations()
    asking.send(m.MAVLink_request_data_stream_message(1, 1, m.MAV_DATA_STREAM_EXTENDED_STATUS, 2, 1))
    world.run(5)
    for _ in range(2):
        asking.take()
        other.take()
        asking.send(m.MAVLink_mission_set_current_message(1, 1, 3))
        world.run(0.1)
        answers = [message.get_type() for message in asking.messages("STATUSTEXT", "MISSION_CURRENT")]
        assert answers[:2] == ["STATUSTEXT", "MISSION_CURRENT"]
        assert not any(text for text in other.texts() if "cannot be set" in text)
        world.run(5)
    assert len([text for text in asking.texts() if "cannot be set" in text]) == 1


def test_a_command_for_another_system_is_not_answered(flying: tuple[World, GroundStation]) -> None:
    for system, component in ((2, 1), (1, 100), (255, 0)):
        assert answers(flying, long(400, 1.0, system=system, component=component)) == []
    for system, component in ((0, 0), (1, 0), (0, 1)):
        assert len(acks(answers(flying, long(512, 148, system=system, component=component)))) == 1


def test_autopilot_version_has_no_ftp_capability(flying: tuple[World, GroundStation]) -> None:
    version, _home = answers(flying, m.MAVLink_autopilot_version_request_message(1, 1))
    assert version.get_type() == "AUTOPILOT_VERSION"
    assert version.flight_sw_version == 0x020101FF  # 2.1.1, official
    can = version.capabilities
    assert can & m.MAV_PROTOCOL_CAPABILITY_MISSION_INT
    assert can & m.MAV_PROTOCOL_CAPABILITY_MISSION_FLOAT
    assert can & m.MAV_PROTOCOL_CAPABILITY_MAVLINK2
    assert not can & m.MAV_PROTOCOL_CAPABILITY_FTP


def test_requesting_an_unknown_home_is_temporarily_rejected() -> None:
    world = World(powered=False)
    world.run(0.5)
    received = answers((world, GroundStation(world)), long(410), long(512, 242))
    assert [(ack[0], ack[1]) for ack in acks(received)] == [(410, TEMPORARILY_REJECTED), (512, TEMPORARILY_REJECTED)]


def test_the_banner_names_the_flight_controller(flying: tuple[World, GroundStation]) -> None:
    received = answers(flying, long(42428))
    text = "".join(message.text for message in received if message.get_type() == "STATUSTEXT")
    assert "Harakiri with the mission extension" in text


def test_there_are_no_logs(flying: tuple[World, GroundStation]) -> None:
    """Mission Planner waits 25 s for an answer, without reading its link otherwise."""
    (entry,) = answers(flying, m.MAVLink_log_request_list_message(1, 1, 0, 0xFFFF))
    assert entry.get_type() == "LOG_ENTRY"
    assert (entry.id, entry.num_logs, entry.last_log_num) == (0, 0, 0)


@pytest.mark.parametrize(
    ("opcode", "error"),
    [
        # List, open to read, CRC: on "File Not Found" QGroundControl requests the parameters in the usual way at once;
        # after any other error it waits 5 s and tries again.
        (3, [1, 10]),
        (4, [1, 10]),
        (14, [1, 10]),
        # FailErrno: Mission Planner ignores "unknown command" and keeps asking for 70 s.
        (6, [2, 2, 95]),
        (7, [2, 2, 95]),
    ],
)
def test_a_file_request_is_refused_at_once(flying: tuple[World, GroundStation], opcode: int, error: list[int]) -> None:
    payload = bytes((7, 0, 3, opcode, 0, 0, 0, 0, 0, 0, 0, 0)).ljust(251, b"\0")
    (answer,) = answers(flying, m.MAVLink_file_transfer_protocol_message(0, 1, 1, list(payload)))
    assert (answer.target_system, answer.target_component) == (255, 190)
    size, *data = error
    assert list(answer.payload[:6]) == [8, 0, 3, 129, size, opcode]
    assert list(answer.payload[12:]) == [*data, *[0] * (239 - size)]
    # A refusal is not a request and gets no reply.
    assert answers(flying, m.MAVLink_file_transfer_protocol_message(0, 1, 1, list(answer.payload))) == []


def test_a_ping_request_is_answered_but_not_a_ping_reply(flying: tuple[World, GroundStation]) -> None:
    (answer,) = answers(flying, m.MAVLink_ping_message(123456789, 42, 0, 0))
    assert (answer.time_usec, answer.seq, answer.target_system, answer.target_component) == (123456789, 42, 255, 190)
    assert answers(flying, m.MAVLink_ping_message(123456789, 42, 1, 1)) == []


def test_timesync_is_answered(flying: tuple[World, GroundStation]) -> None:
    world, _ = flying
    (answer,) = answers(flying, m.MAVLink_timesync_message(0, 777))
    assert answer.ts1 == 777
    assert abs(answer.tc1 / 1e9 - world.now) < 1
    assert answers(flying, m.MAVLink_timesync_message(5, 777)) == []


# Parameters.


#: The parameters of a patched Harakiri; of other boards one less.
COUNT = 36


def param_set(name: bytes, value: float) -> Message:
    return m.MAVLink_param_set_message(1, 1, name, value, 9)


def values(received: list[Message]) -> list[tuple[str, float, int, int]]:
    return [
        (message.param_id, message.param_value, message.param_index, message.param_count)
        for message in received
        if message.get_type() == "PARAM_VALUE"
    ]


def radius_world() -> tuple[World, GroundStation]:
    world = ready_world()
    return world, GroundStation(world)


def test_the_parameter_list_is_short_and_complete(flying: tuple[World, GroundStation]) -> None:
    received = answers(flying, m.MAVLink_param_request_list_message(1, 1))
    found = values(received)
    assert found[0] == ("SYSID_THISMAV", 1.0, 0, COUNT)
    assert found[-1] == ("WPNAV_RADIUS", 200.0, COUNT - 1, COUNT)
    assert [index for _, _, index, _ in found] == list(range(COUNT))
    assert {message.param_type for message in received} == {9}


@pytest.mark.parametrize(
    ("name", "index", "expected"),
    [
        (b"", 0, "SYSID_THISMAV"),
        (b"", 1, "RCMAP_ROLL"),
        (b"", 35, "WPNAV_RADIUS"),
        (b"WPNAV_RADIUS", -1, "WPNAV_RADIUS"),
        (b"SYSID_THISMAV", -1, "SYSID_THISMAV"),
        (b"WPNAV_RADIUS", 0, "SYSID_THISMAV"),  # the index takes precedence
        (b"", 36, None),
        (b"", 32767, None),
        (b"NO_SUCH_NAME", -1, None),
        (b"WPNAV_RADIUS1234", -1, None),
        (b"", -1, None),
        (b"WPNAV_RADIUS", -2, "WPNAV_RADIUS"),
        (b"\xff\xfe", -1, None),
    ],
)
def test_a_parameter_is_read_by_index_or_by_name(
    flying: tuple[World, GroundStation], name: bytes, index: int, expected: str | None
) -> None:
    received = answers(flying, m.MAVLink_param_request_read_message(1, 1, name, index))
    assert [value[0] for value in values(received)] == ([expected] if expected else [])


@pytest.mark.parametrize("board", ["harakiri", "inav", "multiwii"])
@pytest.mark.parametrize("is_armed", [False, True])
def test_qgroundcontrol_shows_no_dialog_and_stays_on_the_map(board: str, is_armed: bool) -> None:
    """It checks receiver, compass and accelerometer as soon as it has read the parameters."""
    faults = Faults(armed=is_armed, boxes=0)
    world = World(faults=faults, peer=None if board == "harakiri" else make_board(board, faults=faults))
    world.wait_until(lambda w: w.is_found, 20)
    world.run(3)
    station = GroundStation(world)
    screen = Screens(station).qgc
    station.send(m.MAVLink_param_request_list_message(1, 1))
    world.run(1)
    assert len(screen.parameters) >= COUNT - 1
    assert (screen.dialogs, screen.is_in_setup) == ([], False)
    assert screen._components_ok
    # These make Mission Planner ask for fences and show another compass page, and QGroundControl for a frame.
    assert not {"FENCE_TOTAL", "RALLY_TOTAL", "COMPASS_PRIO1_ID", "FRAME_CLASS"} & screen.parameters.keys()


def test_qgroundcontrol_is_ready_before_a_flight_controller_is_found() -> None:
    """It reads the parameters once; those of the board are sent when they are known."""
    world = World(powered=False)
    station = GroundStation(world)
    screen = Screens(station).qgc
    station.send(m.MAVLink_param_request_list_message(1, 1))
    world.run(1)
    assert (screen.dialogs, screen.is_in_setup, screen.parameters["COMPASS_USE"]) == ([], False, 0.0)
    world.power_on()
    world.run(world.naze.options.boot_ms / 1000 + 5)
    assert (screen.parameters["COMPASS_USE"], screen.parameters["COMPASS_OFS_X"]) == (1.0, 1.0)


@pytest.mark.parametrize(("blocker", "name"), [(13, "INS_ACCOFFS_X"), (12, "COMPASS_OFS_X")])
def test_a_sensor_that_inav_reports_as_not_calibrated_has_no_offset(blocker: int, name: str) -> None:
    faults = Faults(boxes=0)
    world = World(faults=faults, peer=make_board("inav", faults=faults))
    world.wait_ready()
    world.run(3)
    station = GroundStation(world)
    received = answers((world, station), m.MAVLink_param_request_list_message(1, 1))
    assert {value[0]: value[1] for value in values(received)}[name] != 0
    station.take()
    faults.arming_blockers = 1 << blocker
    world.run(3)
    assert values(station.messages("PARAM_VALUE"))[0][:2] == (name, 0.0)


def test_the_radius_is_set_on_the_flight_controller() -> None:
    world, station = radius_world()
    operations = world.naze.flash_operations
    other = GroundStation(world, "other", sysid=254)
    other.send(m.MAVLink_ping_message(0, 0, 0, 0))
    station.send(param_set(b"WPNAV_RADIUS", 350.0))
    world.wait_until(lambda _: bool(station.messages("PARAM_VALUE")), 1)
    assert values(station.messages()) == values(other.messages()) == [("WPNAV_RADIUS", 350.0, COUNT - 1, COUNT)]
    assert station.texts() == []
    world.run(2)
    # The firmware applies it in its next loop.
    assert world.naze.flash_operations > operations
    world.power_off()
    world.power_on()
    world.run(world.naze.options.boot_ms / 1000 + 3)
    assert values(answers((world, station), m.MAVLink_param_request_list_message(1, 1)))[-1][1] == 350.0


@pytest.mark.parametrize("value", [200.0, 200.4, 199.949, 199.99998])
def test_an_unchanged_value_is_not_written(value: float) -> None:
    world, station = radius_world()
    before, operations = len(world.written), world.naze.flash_operations
    received = answers((world, station), param_set(b"WPNAV_RADIUS", value))
    assert values(received) == [("WPNAV_RADIUS", 200.0, COUNT - 1, COUNT)]
    assert all(data[4] < 190 for _, _, data in world.written[before:])
    world.run(2)
    assert world.naze.flash_operations == operations


@pytest.mark.parametrize("value", [math.nan, math.inf, -math.inf, -1.0, 2001.0, 1e30])
def test_a_value_out_of_range_is_refused_with_a_text(value: float) -> None:
    world, station = radius_world()
    received = answers((world, station), param_set(b"WPNAV_RADIUS", value))
    assert values(received) == [("WPNAV_RADIUS", 200.0, COUNT - 1, COUNT)]
    assert station.texts() == ["WPNAV_RADIUS stays 200: 0..2000 cm"]


@pytest.mark.parametrize("value", [0.0, 1.0, 13.0, 35.0, 82.0, 209.99998, 2000.0])
def test_every_radius_in_range_is_set(value: float) -> None:
    world, station = radius_world()
    station.send(param_set(b"WPNAV_RADIUS", value))
    world.wait_until(lambda _: bool(station.messages("PARAM_VALUE")), 1)
    assert values(station.messages())[0][1] == round(value)
    world.assert_line_was_clean()


def test_a_parameter_that_cannot_be_set_is_answered_with_its_value() -> None:
    world, station = radius_world()
    for name, present in ((b"SYSID_THISMAV", 1.0), (b"RC3_MIN", 1000.0), (b"COMPASS_USE2", 0.0)):
        assert values(answers((world, station), param_set(name, 7.0)))[0][:2] == (name.decode(), present)
        assert station.texts() == [f"{name.decode()} is read-only"]
        # An unchanged value is no news.
        assert values(answers((world, station), param_set(name, present)))[0][:2] == (name.decode(), present)
        assert station.texts() == []
    (missing,) = answers((world, station), param_set(b"NO_SUCH_NAME", 7.0))
    assert (missing.get_type(), missing.param_id) == ("PARAM_ERROR", "NO_SUCH_NAME")
    assert missing.error == m.MAV_PARAM_ERROR_DOES_NOT_EXIST


def test_setting_the_radius_while_armed_is_refused_with_a_text() -> None:
    world, station = radius_world()
    world.faults.armed = True
    world.run(1)
    received = answers((world, station), param_set(b"WPNAV_RADIUS", 400.0))
    assert values(received) == [("WPNAV_RADIUS", 200.0, COUNT - 1, COUNT)]
    assert any("disarm" in text for text in station.texts())


def test_a_radius_refused_for_flash_wear_is_reported() -> None:
    world, station = radius_world()
    for radius_cm in range(301, 301 + 250):
        ended: list[object] = []
        change = world.bridge.missions.fc_store.set_wp_radius(radius_cm)  # type: ignore[union-attr]
        world.bridge.runner.start(change, lambda failure, _, ended=ended: ended.append(failure), world.now)  # type: ignore[misc]
        world.wait_until(lambda _, ended=ended: bool(ended), 5)  # type: ignore[misc]
        assert ended == [None]
    station.send(param_set(b"WPNAV_RADIUS", 400.0))
    world.wait_until(lambda _: bool(station.messages("PARAM_VALUE")), 5)
    assert values(station.messages()) == [("WPNAV_RADIUS", 550.0, COUNT - 1, COUNT)]
    assert " ".join(station.texts()) == f"WPNAV_RADIUS stays 550: {PushFailure.WRITES_SPENT.value}"


def test_setting_the_radius_of_a_silent_board_fails_with_a_text() -> None:
    world, station = radius_world()
    world.faults.hang = True
    station.send(param_set(b"WPNAV_RADIUS", 400.0))
    world.wait_until(lambda _: bool(station.texts()), 5)
    assert station.texts()[0] == "No answer: WPNAV_RADIUS may be set, read it again"


def test_a_radius_set_just_before_arming_is_not_reported_as_unchanged() -> None:
    """The board changes it, then speaks MAVLink before it is read back."""
    world = World(SimOptions(tele_prot=TelemetryProtocol.MAVLINK), speeds=(115200,))
    world.wait_ready()
    station = GroundStation(world)
    station.send(param_set(b"WPNAV_RADIUS", 400.0))
    world.run(0.02)
    world.faults.armed = True
    world.wait_until(lambda _: bool(station.texts()), 10)
    assert station.texts() == ["No answer: WPNAV_RADIUS may be set, read it again"]
    world.faults.armed = False
    world.run(8)
    received = answers((world, station), m.MAVLink_param_request_read_message(1, 1, b"WPNAV_RADIUS", -1))
    assert ("WPNAV_RADIUS", 400.0, COUNT - 1, COUNT) in values(received)


def test_without_the_extension_there_is_no_radius() -> None:
    world = World(faults=Faults(extension=False))
    world.wait_ready()
    station = GroundStation(world)
    received = answers((world, station), m.MAVLink_param_request_list_message(1, 1), param_set(b"WPNAV_RADIUS", 300.0))
    assert "WPNAV_RADIUS" not in [name for name, *_ in values(received)]
    assert values(received)[0] == ("SYSID_THISMAV", 1.0, 0, COUNT - 1)


def test_repeated_sets_are_done_one_at_a_time() -> None:
    world, station = radius_world()
    for number in range(2000):
        station.send(param_set(b"WPNAV_RADIUS", 300.0 + number % 5))
        if number % 9 == 0:
            world.run(0.0001)
    world.run(4)
    received = answers((world, station), m.MAVLink_param_request_list_message(1, 1))
    assert 300 <= values(received)[-1][1] <= 304
    world.assert_line_was_clean()


def test_a_late_reply_to_the_first_set_does_not_confirm_the_second() -> None:
    """The board hangs after the first PARAM_SET and answers both when it resumes."""
    for hang_s in (0.1, 0.2, 0.3, 0.5, 0.8):
        world, station = radius_world()
        world.faults.hang = True
        station.send(param_set(b"WPNAV_RADIUS", 300.0))
        world.run(0.02)
        world.after(hang_s, lambda world=world: setattr(world.faults, "hang", False))  # type: ignore[misc]
        world.run(hang_s - 0.01)
        station.send(param_set(b"WPNAV_RADIUS", 500.0))
        world.run(3)
        radius_cm = values(station.messages())[-1][1]
        assert radius_cm == values(answers((world, station), m.MAVLink_param_request_list_message(1, 1)))[-1][1]
        info = world.bridge.missions.fc_store
        assert isinstance(info, HarakiriMissions)
        assert world.naze._firmware._board.wp_radius_cm == info.wp_radius_cm == radius_cm
