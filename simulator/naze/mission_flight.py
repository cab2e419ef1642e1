# SPDX-License-Identifier: GPL-3.0-or-later
"""The reports of a Harakiri with mission flight, which `Faults.flight` decides (firmware/harakiri_flight.c)."""

from protocols.mavlink.codec import Packed, pack
from protocols.mavlink.dialect import messages
from protocols.msp.mission_flight import FLIGHT, SUMMARY
from simulator.board.options import Faults
from simulator.naze.replies import encode_flight

#: In slots of the MAVLink stream.
_CURRENT_EVERY, _REACHED_EVERY, _SUMMARY_EVERY = 97, 7, 37


class MissionFlight:
    """Answers FLIGHT and makes the messages of the MAVLink stream. Does neither without `Faults.flight`."""

    def __init__(self, faults: Faults) -> None:
        self._faults = faults
        self._announced: int | None = None

    def answer(self, command: int, payload: bytes) -> bytes | None:
        flight = self._faults.flight
        return None if command != FLIGHT or payload or flight is None else encode_flight(flight)

    def message(self, slot: int) -> Packed | None:
        """FlightCurrent(), FlightReached() and FlightSummary()."""
        flight = self._faults.flight
        if flight is None:
            return None
        if not slot % _CURRENT_EVERY and flight.in_command and flight.record is not None:
            return pack(messages.MAVLink_mission_current_message(flight.record))
        if not slot % _REACHED_EVERY and (reached := self._reached(flight.reached)) is not None:
            return pack(messages.MAVLink_mission_item_reached_message(reached))
        if slot % _SUMMARY_EVERY or not (flight.is_enabled or flight.switch_on):
            return None
        return pack(messages.MAVLink_named_value_int_message(0, SUMMARY.encode(), flight.summary))

    def _reached(self, reached: int | None) -> int | None:
        """A record that was reached and not announced yet."""
        announced = self._announced
        if reached is None or (announced is not None and reached < announced):
            announced = self._announced = None
        if reached == announced or reached is None:
            return None
        self._announced = reached if announced is None else announced + 1
        return self._announced
