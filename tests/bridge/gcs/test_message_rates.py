# SPDX-License-Identifier: GPL-3.0-or-later
"""Each ground station gets the messages and rates it requested, independently of the others."""

import math

import pytest
from pymavlink.dialects.v20 import all as messages

from bridge.fc.profile import POLL_FOR
from bridge.vehicle.telemetry_table import TELEMETRY, Row
from protocols.mavlink.dialect import Message
from protocols.msp.commands import Msp
from tests.support.world import GroundStation, World

m = messages
ACCEPTED, TEMPORARILY_REJECTED, DENIED, UNSUPPORTED = 0, 1, 2, 3
ATTITUDE, GPS_RAW_INT = m.MAVLINK_MSG_ID_ATTITUDE, m.MAVLINK_MSG_ID_GPS_RAW_INT
#: Sent without a request for messages.
_UNASKED = {"HEARTBEAT", "HOME_POSITION"}
#: Mission Planner's requests (stream, rate), sent twice at the first heartbeat.
MISSION_PLANNER = ((2, 2), (6, 2), (10, 4), (11, 4), (12, 2), (1, 2), (3, 2))


def station_of(world: World, name: str) -> GroundStation:
    # Different ids: with the same ids it would be one station that has moved.
    station = GroundStation(world, name, sysid=255 - len(world.stations))
    station.send(station.heartbeat, wait_s=1.1)
    return station


def ask(station: GroundStation, command: int, *params: float) -> int:
    """Send a command; return its result."""
    station.ask(m.MAVLink_command_long_message(1, 1, command, 0, *params, *[0.0] * (7 - len(params))), wait_s=0.05)
    (ack,) = station.messages("COMMAND_ACK")
    assert ack.command == command
    result: int = ack.result
    return result


def stream(number: int, rate_hz: int, *, start: int = 1) -> Message:
    return m.MAVLink_request_data_stream_message(1, 1, number, rate_hz, start)


def rates_hz(station: GroundStation, seconds: float = 10) -> dict[str, float]:
    """The rate of each message, measured over `seconds`."""
    station.take()
    station.world.run(seconds)
    names = [message.get_type() for message in station.messages()]
    return {name: names.count(name) / seconds for name in names}


def polls_hz(world: World, command: Msp, seconds: float = 6) -> float:
    return sum(frame.command == command for frame in world.requests_during(seconds)) / seconds


def test_mission_planner_gets_the_rates_it_requests(world: World) -> None:
    planner, other = station_of(world, "planner"), station_of(world, "other")
    for _ in range(2):
        for number, rate_hz in MISSION_PLANNER:
            planner.send(stream(number, rate_hz))
    world.run(1)
    planner.take()
    of_other = rates_hz(other)
    names = [message.get_type() for message in planner.messages()]
    of_planner = {name: names.count(name) / 10 for name in names}
    expected = {
        "ATTITUDE": 4, "VFR_HUD": 4, "GPS_RAW_INT": 2, "GLOBAL_POSITION_INT": 2, "SYS_STATUS": 2, "RC_CHANNELS": 2,
        "BATTERY_STATUS": 2, "EXTENDED_SYS_STATE": 2,
    }  # fmt: skip
    assert {name: of_planner[name] for name in expected} == pytest.approx(expected, rel=0.1)
    assert of_planner["MISSION_CURRENT"] == pytest.approx(1, rel=0.1)
    assert of_other["ATTITUDE"] == pytest.approx(10, rel=0.05)
    assert of_other["GPS_RAW_INT"] == pytest.approx(5, rel=0.05)
    # A faster station can make a message up to a quarter of its interval early.
    assert of_planner["ATTITUDE"] <= 4.2


def test_all_streams_may_be_requested_at_once_as_by_mavproxy(world: World) -> None:
    station = station_of(world, "mavproxy")
    station.send(stream(0, 4), wait_s=1)
    rates = rates_hz(station)
    for name in ("ATTITUDE", "GPS_RAW_INT", "GLOBAL_POSITION_INT", "VFR_HUD", "SYS_STATUS", "RC_CHANNELS"):
        assert rates[name] == pytest.approx(4, rel=0.1)
    station.send(stream(0, 0), wait_s=0.1)
    assert set(rates_hz(station)) <= _UNASKED
    station.send(stream(10, 5))
    station.send(stream(6, 5, start=0))
    assert set(rates_hz(station)) - _UNASKED == {"ATTITUDE"}


def test_a_stations_requests_set_the_poll_rates_until_it_leaves(world: World) -> None:
    station = station_of(world, "gcs")
    assert polls_hz(world, Msp.ATTITUDE) == pytest.approx(10, rel=0.05)
    assert ask(station, 511, ATTITUDE, 200_000) == ACCEPTED
    assert polls_hz(world, Msp.ATTITUDE) == pytest.approx(5, rel=0.1)
    assert ask(station, 511, ATTITUDE, 20_000) == ACCEPTED
    assert polls_hz(world, Msp.ATTITUDE) == pytest.approx(50, rel=0.05)
    world.run(62)
    # Without a station, the bridge itself polls it once a second.
    assert polls_hz(world, Msp.ATTITUDE) == pytest.approx(1, rel=0.15)
    back = station_of(world, "gcs")
    assert rates_hz(back)["ATTITUDE"] == pytest.approx(10, rel=0.05)


def test_a_message_is_sent_at_the_requested_interval(world: World) -> None:
    station = station_of(world, "gcs")
    for interval_us, expected_hz in ((50_000, 20), (-1, 0), (0, 10), (20_000, 50)):
        station.send(station.heartbeat)
        assert ask(station, 511, ATTITUDE, interval_us) == ACCEPTED
        assert rates_hz(station).get("ATTITUDE", 0) == pytest.approx(expected_hz, rel=0.05)


def test_unknown_messages_cannot_be_requested(world: World) -> None:
    station = station_of(world, "gcs")
    for msgid in (271, 0, 30_000, -1, math.nan, math.inf):
        assert ask(station, 511, msgid, 100_000) == UNSUPPORTED
    for interval_us in (-2, math.nan, math.inf):
        assert ask(station, 511, ATTITUDE, interval_us) == DENIED
    assert rates_hz(station)["ATTITUDE"] == pytest.approx(10, rel=0.05)


def test_requests_do_not_exceed_the_lines_capacity(world: World) -> None:
    stations = [station_of(world, f"gcs{number}") for number in range(3)]
    for station in stations:
        for row in TELEMETRY:
            station.send(m.MAVLink_command_long_message(1, 1, 511, 0, row.msgid, 1, 0, 0, 0, 0, 0))
    world.run(2)
    rates = rates_hz(stations[1], 10)
    assert 2 < rates["ATTITUDE"] < 100
    assert 300 < sum(rates.values()) < 500
    world.assert_line_was_clean()


@pytest.mark.parametrize(
    "row", [row for row in TELEMETRY if row.reading in POLL_FOR], ids=lambda row: m.mavlink_map[row.msgid].msgname
)
def test_each_message_can_be_requested_once(world: World, row: Row) -> None:
    msgid = row.msgid
    world.faults.armed = True
    station = station_of(world, "gcs")
    world.run(4)
    name = m.mavlink_map[msgid].msgname
    ask(station, 511, msgid, -1)
    assert ask(station, 512, msgid) == ACCEPTED
    assert name in {message.get_type() for message in station.messages()}


def test_without_a_flight_controller_messages_are_temporarily_rejected() -> None:
    world = World(powered=False)
    station = station_of(world, "gcs")
    for row in TELEMETRY:
        if row.reading is not None and row.msgid != m.MAVLINK_MSG_ID_SYS_STATUS:
            assert ask(station, 512, row.msgid) == TEMPORARILY_REJECTED
    assert ask(station, 512, m.MAVLINK_MSG_ID_MISSION_CURRENT) == ACCEPTED
    assert set(rates_hz(station, 5)) == {"HEARTBEAT", "MISSION_CURRENT", "SYS_STATUS"}


def test_rates_requested_before_the_flight_controller_is_found_are_kept() -> None:
    world = World(speeds=(115200,), powered=False)
    station = station_of(world, "gcs")
    assert ask(station, 511, ATTITUDE, 100_000) == ACCEPTED
    world.power_on()
    world.wait_ready()
    assert rates_hz(station)["ATTITUDE"] == pytest.approx(10, rel=0.05)


def test_the_modes_are_listed(world: World) -> None:
    station = station_of(world, "gcs")
    assert ask(station, 512, m.MAVLINK_MSG_ID_AVAILABLE_MODES) == ACCEPTED
    listed = station.messages("AVAILABLE_MODES")
    assert [(mode.mode_index, mode.number_modes) for mode in listed] == [(number, 6) for number in range(1, 7)]
    names = {mode.custom_mode: mode.mode_name for mode in listed}
    assert names == {0: "STABILIZE", 1: "ACRO", 2: "ALT_HOLD", 3: "AUTO", 5: "LOITER", 6: "RTL"}
    assert ask(station, 512, m.MAVLINK_MSG_ID_AVAILABLE_MODES, 3) == ACCEPTED
    assert [mode.mode_index for mode in station.messages("AVAILABLE_MODES")] == [3]
    assert ask(station, 512, m.MAVLINK_MSG_ID_AVAILABLE_MODES, 7) == UNSUPPORTED
    assert {mode.custom_mode: mode.standard_mode for mode in listed}[2] == m.MAV_STANDARD_MODE_ALTITUDE_HOLD
