# SPDX-License-Identifier: GPL-3.0-or-later
"""The rates of telemetry messages: defaults by line speed, and those of the polls behind them."""

import pytest

from bridge.controllers.harakiri import profile as harakiri
from bridge.vehicle.telemetry_table import TELEMETRY
from protocols.msp.commands import Msp
from tests.bridge.fc.test_msp_telemetry import flown, m, polls, rate_hz, send_heartbeat

#: Bytes of each of Harakiri's telemetry requests and its reply.
ROUND_TRIPS = {101: 23, 105: 28, 106: 26, 108: 20, 109: 18, 110: 17, 113: 42, 118: 25}


@pytest.mark.parametrize("baud", [115200, 19200, 4800, 1200])
def test_telemetry_takes_only_a_share_of_the_line(baud: int) -> None:
    world, station = flown(2, baud=baud)
    for row in TELEMETRY:
        station.send(m.MAVLink_command_long_message(1, 1, 511, 0, row.msgid, 10_000, 0, 0, 0, 0, 0))
    world.run(20)
    world.written.clear()
    station.take()
    world.run(15)
    bytes_sent = sum(count * ROUND_TRIPS[command] for command, count in polls(world).items())
    share, last_round_trip = 0.6 * baud / 10, max(ROUND_TRIPS.values())  # which may end later
    assert 0.75 * share * 15 < bytes_sent <= share * (15 + 0.05) + last_round_trip
    world.assert_line_was_clean()
    assert world.naze.counters.max_outstanding_reply_bytes <= 224
    # For other programs; refused.
    not_polled = {Msp.MOTOR, Msp.RAW_IMU, Msp.SERVO, Msp.COMP_GPS, Msp.DEBUG, Msp.FLIGHT}
    assert set(polls(world)) == {poll.command for poll in harakiri.PATCHED.polls} - not_polled


@pytest.mark.parametrize(("baud", "attitude_hz", "position_hz", "status_hz"), [
    (115200, 10, 5, 4), (19200, 10, 5, 4), (9600, 7.6, 4, 4), (1200, 0.6, 0.3, 0.7),
])  # fmt: skip
def test_default_rates_depend_on_the_line_speed(
    baud: int, attitude_hz: float, position_hz: float, status_hz: float
) -> None:
    world, station = flown(5, baud=baud)
    station.take()
    world.written.clear()
    world.run(30)
    assert rate_hz(station, "ATTITUDE", 30) == pytest.approx(attitude_hz, rel=0.2)
    assert rate_hz(station, "GPS_RAW_INT", 30) == pytest.approx(position_hz, rel=0.35)
    assert polls(world)[Msp.STATUS] / 30 == pytest.approx(status_hz, rel=0.2)


@pytest.mark.parametrize("baud", [1200, 4800])
def test_on_a_slow_line_combined_messages_keep_the_rate_of_their_polls(baud: int) -> None:
    world, station = flown(10, baud=baud)
    station.received.clear()
    world.run(40)
    fixes = len(station.messages("GPS_RAW_INT"))
    assert fixes >= 40 / 5 - 2
    for name in ("GLOBAL_POSITION_INT", "VFR_HUD"):  # with each fix and each height
        assert fixes - 2 <= len(station.messages(name)) <= 2 * fixes + 2, name
    # Missing values become unknown as soon as the loss is noticed.
    world.faults.hang = True
    send_heartbeat(station)
    world.run(12)
    station.received.clear()
    world.run(5)
    assert {status.voltage_battery for status in station.messages("SYS_STATUS")} == {65535}
