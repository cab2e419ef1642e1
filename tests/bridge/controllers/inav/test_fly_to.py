# SPDX-License-Identifier: GPL-3.0-or-later
"""Set waypoint against an INAV that answers wrongly, late or not at all."""

from dataclasses import replace
from struct import pack

import pytest

from bridge.controllers.inav.mission_store import fly_to
from bridge.controllers.inav.profile import PROFILE
from bridge.fc.profile import FlightController
from bridge.line.conversation import Conversation, Receive
from bridge.model.missions import Refusal
from protocols.mission_item import MissionResult
from protocols.msp.commands import Msp
from protocols.msp.frame import Direction, MspFrame
from protocols.msp.nav import FINISHED, NavAction, NavRecord, NavState

RECORD = NavRecord(NavAction.WAYPOINT, 453838000, 84733000, 2000)
BOARD = FlightController(PROFILE, "INAV", boxes=("ARM", "NAV WP"), version=(9, 1, 0))
ENROUTE = (3, NavState.WP_ENROUTE, NavAction.WAYPOINT)


class Inav:
    """Answers the conversation's requests; `obeys` False: it acknowledges and flies on as before."""

    def __init__(self, *, boxes: int = 0b11, obeys: bool = True, lost: frozenset[int] = frozenset()) -> None:
        self.boxes, self.obeys, self.lost = boxes, obeys, lost
        self.mode, self.state, self.action = ENROUTE
        self.number, self.error = 1, 0
        self.direction = Direction.REPLY
        self.set_to: list[int] = []

    def answer(self, asked: Receive) -> MspFrame | None:
        assert asked.request is not None
        command = asked.request.command
        reply, direction = b"", Direction.REPLY
        if command == Msp.INAV_STATUS:
            reply = pack("<HHHHBIQ", 500, 0, 0, 0, 0, 0, self.boxes)
        elif command == Msp.NAV_STATUS:
            reply = pack("<5BH", self.mode, self.state, self.action, self.number, self.error, 0)
        else:
            assert command == 0x2221
            self.set_to.append(asked.request.frame[-2] + 1)
            direction = self.direction
            if self.obeys and direction is Direction.REPLY:
                self.number = self.set_to[-1]
        return None if command in self.lost else MspFrame(direction, command, reply)


def refusal(inav: Inav, held: NavRecord | None = RECORD) -> Refusal:
    found = run(inav, held)
    assert found is not None
    return found


def run(inav: Inav, held: NavRecord | None = RECORD) -> Refusal | None:
    def read() -> Conversation[NavRecord | None]:
        yield from ()
        return held

    conversation = fly_to(3, RECORD, read(), BOARD)
    answer: MspFrame | None = None
    try:
        while True:
            effect = conversation.send(answer)
            answer = inav.answer(effect) if isinstance(effect, Receive) else None
    except StopIteration as stop:
        result: Refusal | None = stop.value
        return result


def test_it_is_sent_once_and_verified() -> None:
    inav = Inav()
    assert run(inav) is None
    assert inav.set_to == [3]


def test_a_lost_reply_is_not_a_failure_if_the_craft_flies_there() -> None:
    inav = Inav(lost=frozenset((0x2221,)))
    assert run(inav) is None
    assert inav.set_to == [3], "not repeated"


@pytest.mark.parametrize(
    ("inav", "ack", "text"),
    [
        (Inav(obeys=False), MissionResult.ERROR, "Set WP failed: INAV flies on as before"),
        (Inav(obeys=False, lost=frozenset((0x2221,))), MissionResult.ERROR, "no answer"),
        (Inav(lost=frozenset((Msp.NAV_STATUS,))), MissionResult.ERROR, "no answer"),
        (Inav(lost=frozenset((Msp.INAV_STATUS,))), MissionResult.ERROR, "no answer"),
    ],
)
def test_a_craft_that_does_not_fly_there_is_a_failure(inav: Inav, ack: MissionResult, text: str) -> None:
    refused = refusal(inav)
    assert refused.ack is ack
    assert text in refused.text
    assert len(inav.set_to) == (inav.lost <= {0x2221})


@pytest.mark.parametrize(
    ("changed", "text"),
    [
        ({"boxes": 0b01}, "only in flight"),
        ({"boxes": 0b10}, "only in flight"),
        ({"mode": 2}, "only in flight"),
        *(({"state": state}, "landing") for state in (8, 9, 10, 11, 12, 14)),
        ({"error": FINISHED, "action": NavAction.LAND}, "landing"),
    ],
)
def test_refuses_unless_the_mission_is_in_flight(changed: dict[str, int], text: str) -> None:
    inav = Inav()
    vars(inav).update(changed)
    assert text in refusal(inav).text
    assert inav.set_to == []


@pytest.mark.parametrize("held", [None, replace(RECORD, alt_cm=2001)])
def test_refuses_if_the_board_holds_another_record(held: NavRecord | None) -> None:
    inav = Inav()
    assert refusal(inav, held).text == "Set WP: read the mission from the board first"
    assert inav.set_to == []


def test_a_new_version_may_refuse_for_other_reasons() -> None:
    inav = Inav()
    inav.direction = Direction.ERROR
    assert refusal(inav).text == "Set WP: INAV refused it"
