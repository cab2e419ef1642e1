# SPDX-License-Identifier: GPL-3.0-or-later
"""The rules for rally points on INAV."""

import struct
from dataclasses import replace

import pytest

from bridge.controllers.inav.places import RallyRules, read_approaches, read_safehomes
from bridge.line.conversation import Conversation
from bridge.missions.list_check import check_list
from protocols.mission_item import Command, MissionResult
from protocols.msp.frame import Direction, MspFrame
from protocols.msp.inav_places import FW_APPROACH, SAFEHOME
from tests.bridge.controllers.inav.test_place_store import RALLY_ITEMS, place


def test_points_with_a_height_or_without_a_place_are_named() -> None:
    items = [replace(RALLY_ITEMS[0], alt_m=30.0), replace(RALLY_ITEMS[1], lon_e7=0)]
    verdict = check_list(items, RallyRules())
    assert [finding.text() for finding in verdict.findings] == [
        "Item 0: Alt changed from 30 to 0 m (safehomes lack a height: see nav_rth_altitude)",
        "Item 1: RALLY_POINT dropped, no Lat/Long",
    ]
    assert [each.enabled for each in verdict.records] == [True] + 7 * [False]


def test_more_than_eight_points_and_other_items_are_rejected() -> None:
    assert check_list([place(Command.RALLY_POINT, n) for n in range(9)], RallyRules()).ack is MissionResult.NO_SPACE
    assert check_list([place(16)], RallyRules()).ack is MissionResult.UNSUPPORTED


@pytest.mark.parametrize(
    ("reading", "reply"),
    [
        (read_safehomes(), MspFrame(Direction.REPLY, SAFEHOME, struct.pack("<BBii", 200, 1, 453838000, 84733000))),
        (read_approaches(range(8)), MspFrame(Direction.REPLY, FW_APPROACH, struct.pack("<BiiBhhB", 200, *6 * (0,)))),
    ],
)
def test_a_reply_about_another_place_is_not_an_answer(reading: Conversation[object], reply: MspFrame) -> None:
    next(reading)
    with pytest.raises(StopIteration) as ended:
        reading.send(reply)
    assert ended.value.value is None
