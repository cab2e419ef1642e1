# SPDX-License-Identifier: GPL-3.0-or-later
"""The reports of a Harakiri with mission flight, which `Faults.flight` decides (firmware/harakiri_flight.c)."""

from protocols.mavlink.codec import Packed, pack
from protocols.mavlink.dialect import messages
from protocols.msp.mission_flight import FLIGHT
from simulator.board.options import Faults

#: In slots of the MAVLink stream.
_CURRENT_EVERY, _REACHED_EVERY = 97, 7


class MissionFlight:
    """Answers FLIGHT and makes the messages of the MAVLink stream; does neither without `Faults.flight`."""

    def __init__(self, faults: Faults) -> None:
        self._faults = faults
        self._announced: int | None = None

    def answer(self, command: int, payload: bytes) -> bytes | None:
        flight = self._faults.flight
        return None if command != FLIGHT or payload or flight is None else flight.encode()

    def message(self, slot: int) -> Packed | None:
        """FlightCurrent() and FlightReached(): each record is announced once."""
        flight = self._faults.flight
        if flight is None:
            return None
        if not slot % _CURRENT_EVERY and flight.in_command and flight.record is not None:
            return pack(messages.MAVLink_mission_current_message(flight.record))
        if slot % _REACHED_EVERY:
            return None
        reached, announced = flight.reached, self._announced
        if reached is None or (announced is not None and reached < announced):
            announced = self._announced = None
        if reached == announced or reached is None:
            return None
        self._announced = reached if announced is None else announced + 1
        return pack(messages.MAVLink_mission_item_reached_message(self._announced))
