# SPDX-License-Identifier: GPL-3.0-or-later
"""The board's MAVLink: when it is spoken, its contents, and the speed (decoded with pymavlink)."""

from collections import Counter

import pytest
from pymavlink.dialects.v10 import common as mavlink1
from pymavlink.dialects.v20 import common as mavlink2

from protocols.msp.frame import request
from simulator.board.options import SimOptions, TelemetryProtocol
from simulator.naze.firmware import Protocol
from simulator.naze.replies import encode_radius
from tests.support.naze_bench import Bench

IDENT = request(100)


def decode(data: bytes) -> list[mavlink1.MAVLink_message]:
    """Decode bytes, all of which must belong to MAVLink 1 frames of the exact length of version 1."""
    parser = mavlink1.MAVLink(None)
    messages = parser.parse_buffer(data) or []
    assert sum(len(message.get_msgbuf()) for message in messages) == len(data)
    return list(messages)


def ground_station_heartbeat(version: int = 1) -> bytes:
    module = mavlink1 if version == 1 else mavlink2
    sender = module.MAVLink(None, srcSystem=255, srcComponent=190)
    message = module.MAVLink_heartbeat_message(6, 8, 0, 0, 4, 3)
    return bytes(message.pack(sender))


def test_autosense_sends_ardupilot_heartbeats_once_a_second() -> None:
    bench = Bench()
    messages = decode(bench.run(10.2))
    assert len(messages) == 10
    for number, message in enumerate(messages):
        assert message.get_type() == "HEARTBEAT"
        assert (message.get_srcSystem(), message.get_srcComponent(), message.get_seq()) == (1, 200, number)
        assert (message.autopilot, message.type) == (mavlink1.MAV_AUTOPILOT_ARDUPILOTMEGA, mavlink1.MAV_TYPE_QUADROTOR)
        assert not message.base_mode & mavlink1.MAV_MODE_FLAG_SAFETY_ARMED


def protocol(bench: Bench) -> Protocol | None:
    """The current protocol; a function because mypy narrows a property to a constant."""
    return bench.naze.protocol


def test_msp_stops_the_heartbeats_until_four_seconds_of_silence() -> None:
    bench = Bench()
    assert bench.ask(IDENT) is not None
    assert protocol(bench) is Protocol.MSP
    assert bench.run(3.9) == b""
    assert [message.get_type() for message in decode(bench.run(1.3))] == ["HEARTBEAT"]
    assert protocol(bench) is Protocol.AUTOSENSE


def test_a_mavlink_1_frame_switches_the_board_away_from_msp() -> None:
    bench = Bench()
    bench.send(ground_station_heartbeat())
    bench.run(0.05)
    assert bench.naze.protocol is Protocol.MAVLINK
    assert bench.ask(IDENT, timeout=0.5) is None


def test_a_mavlink_2_frame_is_ignored() -> None:
    bench = Bench()
    bench.send(ground_station_heartbeat(version=2))
    bench.run(0.1)
    assert bench.naze.protocol is Protocol.AUTOSENSE


def test_the_stream_has_the_firmwares_rates() -> None:
    bench = Bench()
    for _ in range(30):
        bench.send(ground_station_heartbeat())
        bench.run(1.0)
    assert bench.naze.protocol is Protocol.MAVLINK
    bench.received.clear()
    for _ in range(30):
        bench.send(ground_station_heartbeat())
        bench.run(1.0)
    rates = {name: count / 30 for name, count in Counter(m.get_type() for m in decode(bytes(bench.received))).items()}
    expected = {
        "HEARTBEAT": 0.99, "SYS_STATUS": 1.87, "GPS_RAW_INT": 2.1, "RC_CHANNELS_RAW": 2.2, "VFR_HUD": 8.6,
        "ATTITUDE": 28.5, "SCALED_PRESSURE": 0.5,
    }  # fmt: skip
    assert rates == pytest.approx(expected, rel=0.06)


@pytest.mark.parametrize(
    ("tele_prot", "baud", "protocol"),
    [
        (TelemetryProtocol.MSP, 115200, Protocol.MSP),
        (TelemetryProtocol.MAVLINK, 115200, Protocol.MAVLINK),
        (TelemetryProtocol.MAVLINK_57600, 57600, Protocol.MAVLINK),
    ],
)
def test_arming_selects_protocol_and_speed(tele_prot: TelemetryProtocol, baud: int, protocol: Protocol) -> None:
    bench = Bench(SimOptions(tele_prot=tele_prot))
    assert bench.ask(IDENT) is not None
    bench.naze.faults.armed = True
    received = bench.run(10)
    assert (bench.naze.armed, bench.naze.baud, bench.naze.protocol) == (True, baud, protocol)
    assert (len(decode(received)) > 300) is (protocol is Protocol.MAVLINK)
    assert (bench.ask(IDENT, timeout=0.3) is not None) is (protocol is Protocol.MSP)
    bench.naze.faults.armed = False
    bench.run(0.5)
    assert (bench.naze.armed, bench.naze.baud) == (False, 115200)
    # After four seconds without valid input: AUTOSENSE, where MSP is found again.
    bench.run(4.1)
    assert bench.ask(IDENT) is not None


def test_frsky_is_sent_at_9600_eight_times_a_second() -> None:
    bench = Bench(SimOptions(tele_prot=TelemetryProtocol.FRSKY_9600))
    assert bench.ask(IDENT) is not None
    bench.naze.faults.armed = True
    received = bench.run(4.0)
    assert bench.naze.baud == 9600
    assert received[:2] == b"\x5e\x24"
    # A frame ends with a single mark byte, and the next begins with one.
    assert received.count(b"\x5e\x5e\x24") in (30, 31, 32)


def test_arming_is_refused_while_a_configuration_write_is_scheduled() -> None:
    bench = Bench(SimOptions(config_write_delay_ms=1000))
    assert bench.ask(encode_radius(300)) is not None
    bench.naze.faults.armed = True
    bench.run(0.5)
    assert not bench.naze.armed
    bench.run(1.0)
    assert bench.naze.armed
