# SPDX-License-Identifier: GPL-3.0-or-later
"""Commands and parameters: each command is acknowledged once, and none acts on the aircraft."""

import math
from collections.abc import Callable

import pytest
from pymavlink.dialects.v20 import ardupilotmega as messages

from bridge.vehicle.telemetry_table import TELEMETRY
from protocols.mavlink.dialect import Message
from tests.support.world import GroundStation, World, ready_world

m = messages
ACCEPTED, TEMPORARILY_REJECTED, DENIED, UNSUPPORTED = 0, 1, 2, 3
#: Minimum time between two equal refusal texts.
_SILENCE_S = 10.1
#: Unsolicited messages.
TELEMETRY_TYPES = {"HEARTBEAT", "MISSION_CURRENT"} | {
    m.mavlink_map[row.msgid].msgname for row in TELEMETRY if row.reading is not None and row.interval_s < math.inf
}


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


def test_all_command_numbers_are_acknowledged() -> None:
    """In a world of its own: after some of them later refusals have other words."""
    numbers = [*range(700), *range(3000, 3010), *range(42400, 42440)]
    world, station, _ = two_stations()
    received = []
    for first in range(0, len(numbers), 100):
        world.run(4.0)  # faster would exceed the rate limit
        received += answers((world, station), *(long(number) for number in numbers[first : first + 100]))
    # A calibration is refused only after a request to the flight controller.
    assert sorted(ack[0] for ack in acks(received)) == numbers


@pytest.mark.parametrize(
    ("command", "words"),
    [
        (400, "transmitter"),  # arm, disarm
        (176, "transmitter"),  # set mode
        (246, "cannot be rebooted"),
        (300, "mission"),  # start
        (22, "transmitter"),
        (21, "transmitter"),
        (20, "transmitter"),
        (224, "cannot fly missions"),
        (183, "cannot be driven"),  # servo
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
    _world, asking, other = two_stations()
    asking.send(refused, wait_s=3)
    assert asking.texts()
    assert other.texts() == []


def test_the_current_waypoint_cannot_be_set() -> None:
    """A MISSION_CURRENT would be another request to MAVSDK, which requests no streams."""
    world, asking, other = two_stations()
    asking.send(m.MAVLink_mission_set_current_message(1, 1, 3), wait_s=3)
    assert "This flight controller cannot fly missions" in asking.texts()
    assert asking.messages("MISSION_CURRENT") == []
    assert len(other.messages("MISSION_CURRENT")) == 3
    world.run(3)
    assert asking.messages("MISSION_CURRENT")


def test_set_wp_in_mission_planner_ends_at_once() -> None:
    """Without one MISSION_CURRENT its window hangs for 12 s, while it repeats the request six times."""
    world, asking, other = two_stations()
    asking.send(m.MAVLink_request_data_stream_message(1, 1, m.MAV_DATA_STREAM_EXTENDED_STATUS, 2, 1), wait_s=5)
    for _ in range(2):
        asking.take()
        other.take()
        asking.send(m.MAVLink_mission_set_current_message(1, 1, 3), wait_s=0.1)
        answers = [message.get_type() for message in asking.messages("STATUSTEXT", "MISSION_CURRENT")]
        assert answers[:2] == ["STATUSTEXT", "MISSION_CURRENT"]
        assert not any("cannot fly missions" in text for text in other.texts())
        world.run(5)
    assert len([text for text in asking.texts() if "cannot fly missions" in text]) == 1


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
    # Mission Planner would ask for a file of parameters first, and wait.
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


def test_a_stations_clock_is_remembered(flying: tuple[World, GroundStation]) -> None:
    world, _ = flying
    answers(flying, m.MAVLink_system_time_message(0, 5000))  # a station without a clock
    assert world.bridge.vehicle.station_epoch_s is None
    answers(flying, m.MAVLink_system_time_message(int((1_790_000_000 + world.now) * 1e6), 0))
    assert world.bridge.vehicle.station_epoch_s == pytest.approx(1_790_000_000, abs=2)


# Parameters.
