# SPDX-License-Identifier: GPL-3.0-or-later
"""docs/inav.md says what the rules do: for each command the action that is stored, and whether it is dropped."""

import re
from pathlib import Path

import pytest

from bridge.controllers.nav.check import NavRules
from bridge.controllers.nav.rules import inav_profile, multiwii_profile
from bridge.missions.list_check import check_list
from bridge.model.finding import DROPPED
from protocols.mission_item import Command, MissionItem
from protocols.msp.nav import NavAction

PAGE = (Path(__file__).parents[1] / "docs" / "inav.md").read_text()
ROWS = {int(number): (record, mw) for number, record, mw in
        re.findall(r"^\| [A-Z_]+ (\d+) \| (.*?) \| .* \| (.*?) \|$", PAGE, re.MULTILINE)}  # fmt: skip
WAYPOINT = MissionItem(0, 16, 3, 0, 0, 0, 0, 453838000, 84733000, 30)


def one_of(command: int) -> MissionItem:
    """An item that is nothing but its command; a jump goes to the first waypoint."""
    is_jump = command == Command.DO_JUMP
    return MissionItem(0, command, 3, float(is_jump), 5.0 if command == 178 else 0.0, 0, 0, 453838000, 84733000, 30)


def test_every_command_that_is_known_is_on_the_page() -> None:
    assert set(ROWS) == set(Command)


@pytest.mark.parametrize("command", ROWS)
def test_the_page_names_the_action_that_is_stored(command: int) -> None:
    text, multiwii = ROWS[command]
    sent = [WAYPOINT, WAYPOINT, WAYPOINT, one_of(command), WAYPOINT]
    verdict = check_list(sent, NavRules(inav_profile()))
    if text.startswith("none"):
        assert len(verdict.records) == 3
        assert text.startswith("none: dropped") == any(finding.becomes == DROPPED for finding in verdict.findings)
    else:
        number, name = text.split()[:2]
        assert NavAction(verdict.records[2].action) is NavAction[name.rstrip(",")] is NavAction(int(number))
    other = check_list(sent, NavRules(multiwii_profile()))
    if multiwii[0].isdigit():
        assert other.records[2].action == int(multiwii[0])
    elif multiwii == "dropped":
        assert any(finding.becomes == DROPPED for finding in other.findings)
    else:
        assert len(other.records) == len(verdict.records)
