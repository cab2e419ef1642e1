# SPDX-License-Identifier: GPL-3.0-or-later
"""docs/events.md lists exactly the events that the log can have, and all their facts."""

import ast
import re
from collections import defaultdict
from pathlib import Path

_REPOSITORY = Path(__file__).parents[2]
_EVENT = re.compile(r"[a-z]+\.[a-z_]+")
#: Functions called with an event's name as the first or second argument.
_LEVELS = {"debug", "info", "warning", "error", "exception", "level"}
_SPEAKERS = _LEVELS | {"log_event", "_log_event", "note", "_note", "_complain", "warn_once"}


def _events_of_the_code() -> dict[str, set[str]]:
    """The names of the facts of each event, as far as the call shows them."""
    found: dict[str, set[str]] = defaultdict(set)
    for file in [*_REPOSITORY.glob("service/**/*.py"), *_REPOSITORY.glob("bridge/**/*.py")]:
        for node in ast.walk(ast.parse(file.read_text())):
            if not isinstance(node, ast.Call):
                continue
            name = node.func.attr if isinstance(node.func, ast.Attribute) else getattr(node.func, "id", "")
            if name in _SPEAKERS:
                texts = [each.value for each in ast.walk(ast.Tuple(node.args[:2])) if isinstance(each, ast.Constant)]
                facts = {keyword.arg for keyword in node.keywords if keyword.arg}
                for text in texts:
                    if isinstance(text, str) and _EVENT.fullmatch(text):
                        found[text] |= facts - {"exc_info"}
    return found


def _events_of_the_page() -> dict[str, set[str]]:
    """The facts in the row of each event; events that share a row share them."""
    rows = [line for line in (_REPOSITORY / "docs" / "events.md").read_text().splitlines() if line.startswith("| `")]
    cells = [row.split(" | ") for row in rows]
    return {name: {*re.findall(r"\w+", row[-1])} for row in cells for name in re.findall(_EVENT, row[0])}


def test_the_page_lists_the_events_of_the_code() -> None:
    events = _events_of_the_code()
    assert "mission.upload_ended" in events
    assert events.keys() == _events_of_the_page().keys()


def test_the_page_lists_the_facts_of_each_event() -> None:
    page = _events_of_the_page()
    assert {event: facts - page[event] for event, facts in _events_of_the_code().items() if facts - page[event]} == {}
