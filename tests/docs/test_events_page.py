# SPDX-License-Identifier: GPL-3.0-or-later
"""docs/events.md lists exactly the events that the log can have, and all their facts."""

import ast
import re
from collections import defaultdict
from dataclasses import fields
from pathlib import Path

import service.zenoh_link.session  # noqa: F401 - it has events of its own
from bridge.model.events import BridgeEvent

_REPOSITORY = Path(__file__).parents[2]
_EVENT = re.compile(r"[a-z]+\.[a-z_]+")
#: Functions called with a log line's name as the first or second argument.
_SPEAKERS = {"debug", "info", "warning", "error", "exception", "level", "_complain", "warn_once"}
_TYPED = {event.name_in_log: event for event in BridgeEvent.__subclasses__()}


def _lines_of_the_code() -> dict[str, set[str]]:
    """The names of the facts of each plain log line, as far as the call shows them."""
    found: dict[str, set[str]] = defaultdict(set)
    for file in _REPOSITORY.glob("service/**/*.py"):
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


def _rows_of_the_page() -> dict[str, tuple[set[str], set[str]]]:
    """The levels and facts in the line of each event; events that share a line share them."""
    lines = re.findall(
        r"^- ((?:`[^`]*`,? )+)([^:]*): (.*)$", (_REPOSITORY / "docs" / "events.md").read_text(), re.MULTILINE
    )
    return {
        name: ({*re.findall(r"\w+", levels)}, {*re.findall(r"\w+", "".join(re.findall(r"\(([^()]*)\)$", text)))})
        for names, levels, text in lines
        for name in re.findall(_EVENT, names)
    }


def test_the_page_lists_the_events_of_the_code() -> None:
    lines = _lines_of_the_code()
    assert "daemon.started" in lines
    assert lines.keys() | _TYPED.keys() == _rows_of_the_page().keys()


def test_the_page_lists_the_facts_of_each_plain_log_line() -> None:
    page = _rows_of_the_page()
    assert {line: facts - page[line][1] for line, facts in _lines_of_the_code().items() if facts - page[line][1]} == {}


def test_the_page_lists_the_level_and_the_facts_of_each_typed_event() -> None:
    for name, event in _TYPED.items():
        levels, facts = _rows_of_the_page()[name]
        assert {field.name for field in fields(event)} - {"level"} <= facts, name
        assert event.level in levels, name
