# SPDX-License-Identifier: GPL-3.0-or-later
"""A flight in a telemetry log, as the bridge records it, is judged like a simulated one."""

from collections.abc import Iterator

import pytest
from pymavlink.dialects.v20 import ardupilotmega as m

from protocols.mavlink.codec import FrameWriter, pack
from protocols.mavlink.dialect import Message
from protocols.msp.mission import WpCommand, WpRecord
from protocols.msp.mission_flight import SUMMARY, FlightPhase, FlightProgress, FlightReason
from protocols.tlog import tlog_records
from simulator.flights.logged_flight import logged_sortie
from simulator.flights.sortie import SortieError
from simulator.sky.earth import Place

PLACE = Place()
NORTH_LAT, NORTH_LON = PLACE.coordinates((40.0, 0.0, 0.0))
HOME = WpRecord(round(PLACE.lat * 1e7), round(PLACE.lon * 1e7), 0, 0, 0, 2, 0, WpCommand.WAYPOINT)
RECORDS = (HOME, WpRecord(round(NORTH_LAT * 1e7), round(NORTH_LON * 1e7), 10, 0, 1, 2, 0, WpCommand.WAYPOINT))


def flight(speed: float, last: FlightProgress) -> Iterator[tuple[float, Message]]:
    """To the north for 20 s, at a height of 10 m, and there for 10 s more."""
    for step in range(150):
        at_s = step / 5
        north = min(speed * at_s, 40.0)
        lat, lon = PLACE.coordinates((north, 0.0, 10.0))
        yield at_s, m.MAVLink_heartbeat_message(2, 3, m.MAV_MODE_FLAG_SAFETY_ARMED, 0, 4, 3)
        yield at_s, m.MAVLink_attitude_message(step * 200, 0.0, -0.1, 0.0, 0, 0, 0)
        vx = round(speed * 100) if north < 40 else 0
        place = round(lat * 1e7), round(lon * 1e7), 500_000, 10_000
        yield at_s, m.MAVLink_global_position_int_message(step * 200, *place, vx, 0, 0, 0)
        leg = FlightProgress(FlightPhase.LEG, switch_on=True, in_command=True, record=1)
        if north == 40.0 and last.reason is FlightReason.FLOWN:
            yield at_s, m.MAVLink_mission_item_reached_message(1)
        progress = last if at_s > 20 else leg
        if at_s and at_s != 20.2:  # reported when it changes
            continue
        yield at_s, m.MAVLink_named_value_int_message(step * 200, SUMMARY.encode(), progress.summary)


def tlog(messages: Iterator[tuple[float, Message]]) -> bytes:
    writer = FrameWriter(1, 1)
    records = (tlog_records([writer.frame(pack(message), 2)], round(1.8e15 + at_s * 1e6)) for at_s, message in messages)
    return b"".join(records)


DONE = FlightProgress(FlightPhase.DONE, FlightReason.FLOWN, switch_on=True, in_command=True, record=1)
HELD = FlightProgress(FlightPhase.HELD, FlightReason.STALLED, switch_on=True, in_command=True, record=1)


def test_a_flight_to_the_end_of_the_list() -> None:
    found = logged_sortie(tlog(flight(2.0, DONE)) + b"cut off", RECORDS)
    assert found.is_flown
    assert found.items[0].reached_s == pytest.approx(20, abs=0.5)
    assert found.extremes.farthest_m == pytest.approx(40, abs=0.5)
    assert found.extremes.fastest == pytest.approx(2.0, abs=0.01)
    assert found.extremes.steepest_deg == pytest.approx(5.7, abs=0.1)


def test_a_stopped_flight_reports_the_reason() -> None:
    found = logged_sortie(tlog(flight(1.0, HELD)), RECORDS)
    assert not found.is_flown
    assert found.items[0].problems == ["not reached", "the flight was stopped: stalled"]


def test_a_log_without_a_mission_flight_is_refused() -> None:
    pilots = FlightProgress()
    messages = [each for each in flight(2.0, pilots) if each[1].get_type() != "NAMED_VALUE_INT"]
    with pytest.raises(SortieError, match="no mission flight"):
        logged_sortie(tlog(iter(messages)), RECORDS)
