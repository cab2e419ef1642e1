# SPDX-License-Identifier: GPL-3.0-or-later
"""Texts that the documentation shows: doctor's report, quoted messages, and JSON."""

import ast
import json
import re
from datetime import UTC, datetime
from functools import cache
from pathlib import Path

import pytest

from service.cli.doctor.command import _print as print_check
from service.cli.doctor.machine import check_clock
from service.cli.doctor.port import check_console, check_port
from tests.support.doc_pages import PAGES, blocks, place_of, prose_of, spans
from tests.support.faulty_machine import PORT, FaultyMachine
from tests.support.programs import REPOSITORY

#: Quoted texts of other programs (Mission Planner, INAV Configurator), of code and of tables.
NOT_OURS = {
    "No Heartbeat Packets Received",
    "Unhealthy GPS Signal",
    "Bad Gyro Health",
    "Not Ready to Arm",
    "Ready To Fly",
    "please reduce the number of wp's",
    "rejected by the Mav, item had a bad option wp# N",
    "Upload MISSION failed ... DENIED",
    "Upload MISSION failed ... UNSUPPORTED",
    "begin, send, wait, commit",
    "only item 1",
}
#: Placeholders of the pages for numbers and names.
_PLACEHOLDER = re.compile(r"\b(?:N|NAME|pid N|\d+|\d+ items|udp [\d.:]+)\b|\.\.\.")
_CLAUSES = re.compile(r"[:;,] | \.\.\. ")


def test_the_report_of_doctor(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    pi = FaultyMachine(tmp_path / "root")
    pi.write("/boot/firmware/cmdline.txt", "console=serial0,115200 console=tty1 rootwait\n")
    pi.path("/run/systemd/timesync/synchronized").unlink()
    (block,) = [block for block in blocks() if block.language == "console"]
    time = re.search(r"clock: (\S+ \S+) UTC", block.text)
    assert time is not None
    now = datetime.fromisoformat(time[1]).replace(tzinfo=UTC)
    for checked in (check_port(pi, PORT), check_console(pi, PORT), check_clock(pi, now)):
        assert checked is not None
        print_check(checked, as_json=False)
    assert capsys.readouterr().out == block.text


@cache
def texts() -> str:
    """All texts in the code and the status page, one per line, with \\0 for each inserted value."""
    found = []
    for package in ("bridge", "fleet", "payloads", "protocols", "reports", "service", "terminal"):
        for file in (REPOSITORY / package).rglob("*.py"):
            for node in ast.walk(ast.parse(file.read_text())):
                if isinstance(node, ast.JoinedStr):
                    found.append("".join(map(_part, node.values)))
                elif isinstance(node, ast.Constant):
                    found.append(_part(node))
    found += [file.read_text() for file in (REPOSITORY / "service" / "web").rglob("*.js")]
    return "\n".join(found)


@cache
def templates() -> list[re.Pattern[str]]:
    """The clauses with inserted values, and at least two words of their own."""
    clauses = (clause for line in texts().splitlines() for clause in _CLAUSES.split(line))
    made = {clause for clause in clauses if "\0" in clause and _is_telling(clause)}
    return [re.compile(".+".join(map(re.escape, clause.split("\0")))) for clause in made]


def _is_telling(clause: str) -> bool:
    words = re.findall("[a-z]{2,}", clause)
    return len(words) >= 2 and len("".join(words)) >= 6


def _part(part: ast.expr) -> str:
    """A text, also of the table of sentences, with \\0 for each inserted value."""
    is_text = isinstance(part, ast.Constant) and isinstance(part.value, str)
    return re.sub(r"\{[\d:.f]*\}", "\0", part.value) if is_text else "\0"  # type: ignore[attr-defined]


@cache
def keys() -> set[str]:
    """The keys of all objects that the service makes."""
    files = (file for package in ("fleet", "payloads", "service") for file in (REPOSITORY / package).rglob("*.py"))
    trees = (ast.parse(file.read_text()) for file in files)
    made = (node for tree in trees for node in ast.walk(tree) if isinstance(node, ast.Dict))
    return {_part(key) for each in made for key in each.keys if key is not None}


QUOTED = sorted(
    {
        (" ".join(quoted.split()), place_of(page))
        for page in PAGES
        if page.name != "CONTRIBUTING.md"  # it quotes code
        for quoted in re.findall(r'"([^"`]+)"', re.sub(r"`[^`]*`", "`", prose_of(page)))
        if quoted.count(" ") >= 2
    }
)


def test_quoted_messages_are_ours() -> None:
    """Each clause of them: messages are made of several."""
    clauses = {(place, clause) for text, place in QUOTED if text not in NOT_OURS for clause in _CLAUSES.split(text)}
    assert [each for each in sorted(clauses) if not is_ours(each[1])] == []


def is_ours(clause: str) -> bool:
    pieces = [re.escape(piece.strip()) for piece in _PLACEHOLDER.split(clause)]
    return bool(re.search(r"[^\n]*".join(pieces), texts())) or any(each.search(clause) for each in templates())


def test_every_foreign_message_is_quoted() -> None:
    assert {quoted for quoted, _ in QUOTED} >= NOT_OURS


@pytest.mark.parametrize("page", ["docs/zenoh.md", "docs/status-page.md"])
def test_objects_have_keys_of_the_service(page: str) -> None:
    shown = [json.loads(span.replace("...", "")) for span in spans(REPOSITORY / page) if span.startswith('{"')]
    assert shown
    assert [each for each in shown if not each.keys() <= keys()] == []
