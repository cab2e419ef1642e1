# SPDX-License-Identifier: GPL-3.0-or-later
"""Harakiri's FLIGHT reports as readings: the current record, the reached one, and why a flight stopped."""

import struct

import pytest

from bridge.controllers.harakiri.mission_flight import FLIGHT_DECODERS, FLIGHT_POLL
from bridge.controllers.harakiri.profile import FLYING, PATCHED
from bridge.fc.msp_telemetry import hear_msp
from bridge.fc.profile import FlightController
from bridge.model.mission_progress import MissionProgress, Progress
from bridge.model.vehicle import MissionLeg, MissionStop, Vehicle
from protocols.msp.commands import Msp
from protocols.msp.frame import Direction, MspFrame
from protocols.msp.mission_flight import FLIGHT, FLIGHT_REQUEST, FlightPhase, FlightReason

NONE = 0xFFFF
IN_COMMAND = 7


def reply(
    phase: FlightPhase, record: int = NONE, reached: int = NONE, reason: int = 0, flags: int = IN_COMMAND
) -> bytes:
    return struct.pack("<6B3HIHhI", 0, 1, flags, phase, reason, 0, record, reached, 5, 0, 0, 0, 0)


class Board:
    """The readings after a number of replies."""

    def __init__(self) -> None:
        self.vehicle = Vehicle()
        self.progress = MissionProgress()

    def hear(self, payload: bytes) -> int | None:
        """The record that this reply shows as reached."""
        frame = MspFrame(Direction.REPLY, FLIGHT, payload)
        hear_msp(self.vehicle, frame, FlightController(FLYING, FLYING.name), 0.0)
        leg = self.vehicle.last(MissionLeg)
        return None if leg is None else self.progress.take(leg.status)

    @property
    def stop(self) -> str:
        found = self.vehicle.last(MissionStop)
        assert found is not None
        return found.text


def test_the_command_is_the_extensions() -> None:
    assert FLIGHT == Msp.FLIGHT == FLIGHT_POLL.command
    assert FLIGHT_POLL.frame == FLIGHT_REQUEST
    assert set(FLIGHT_DECODERS) == {FLIGHT}
    assert FLIGHT_POLL in FLYING.polls
    assert FLIGHT_POLL not in PATCHED.polls


def test_a_list_is_followed_record_by_record() -> None:
    board = Board()
    assert board.hear(reply(FlightPhase.OFF, flags=1)) is None
    assert (board.progress.number, board.progress.progress) == (0, Progress.NOT_STARTED)
    assert board.hear(reply(FlightPhase.LEG, 1)) is None
    assert (board.progress.number, board.progress.progress) == (1, Progress.ACTIVE)
    assert board.hear(reply(FlightPhase.LEG, 2, 1)) == 1
    assert board.hear(reply(FlightPhase.LOITER, 2, 2)) == 2, "at the arrival, not when it leaves"
    assert board.hear(reply(FlightPhase.LOITER, 2, 2)) is None
    assert board.hear(reply(FlightPhase.LEG, 3, 2)) is None
    assert board.hear(reply(FlightPhase.DONE, 3, 3)) == 3
    assert board.progress.progress is Progress.COMPLETE


@pytest.mark.parametrize("phase", [FlightPhase.HELD, FlightPhase.NO_FIX, FlightPhase.HANDS, FlightPhase.OFF])
def test_a_stopped_flight_flies_no_record(phase: FlightPhase) -> None:
    board = Board()
    board.hear(reply(FlightPhase.LEG, 2, 1))
    assert board.hear(reply(phase, 2, 1, FlightReason.STICKS)) is None
    assert board.progress.number == 0
    assert "stick" in board.stop


@pytest.mark.parametrize("reason", FlightReason)
def test_each_reason_is_one_short_sentence_or_none(reason: FlightReason) -> None:
    board = Board()
    board.hear(reply(FlightPhase.HELD, 1, NONE, reason))
    by_the_pilot = reason in (FlightReason.NONE, FlightReason.SWITCHED_OFF, FlightReason.DISARMED)
    assert (board.stop == "") is by_the_pilot
    assert len(board.stop.encode()) <= 50, "STATUSTEXT"


@pytest.mark.parametrize("payload", [b"", b"\x0b" + bytes(23), b"\0\x09" + bytes(22), reply(FlightPhase.LEG, 1)[:-1]])
def test_other_replies_change_nothing(payload: bytes) -> None:
    board = Board()
    assert board.hear(payload) is None
    assert board.vehicle.last(MissionLeg) is None
