# SPDX-License-Identifier: GPL-3.0-or-later
"""docs/events.md lists exactly the events that the log can have."""

import ast
import re
from pathlib import Path

_REPOSITORY = Path(__file__).parents[2]
_EVENT = re.compile(r"[a-z]+\.[a-z_]+")
#: Functions called with an event's name as the first or second argument.
_LEVELS = {"debug", "info", "warning", "error", "exception", "level"}
_SPEAKERS = _LEVELS | {"log_event", "_log_event", "note", "_note", "_complain", "warn_once"}


def _events_of_the_code() -> set[str]:
    found: set[str] = set()
    for file in [*_REPOSITORY.glob("service/**/*.py"), *_REPOSITORY.glob("bridge/**/*.py")]:
        for node in ast.walk(ast.parse(file.read_text())):
            if not isinstance(node, ast.Call):
                continue
            name = node.func.attr if isinstance(node.func, ast.Attribute) else getattr(node.func, "id", "")
            if name in _SPEAKERS:
                texts = [each.value for each in ast.walk(ast.Tuple(node.args[:2])) if isinstance(each, ast.Constant)]
                found |= {text for text in texts if isinstance(text, str) and _EVENT.fullmatch(text)}
    return found


def _events_of_the_page() -> set[str]:
    rows = [line for line in (_REPOSITORY / "docs" / "events.md").read_text().splitlines() if line.startswith("| `")]
    return {event for row in rows for event in re.findall(r"`([a-z]+\.[a-z_]+)`", row.split("|")[1])}


def test_the_page_lists_the_events_of_the_code() -> None:
    events = _events_of_the_code()
    assert "mission.upload_ended" in events
    assert events == _events_of_the_page()
