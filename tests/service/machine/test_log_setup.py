# SPDX-License-Identifier: GPL-3.0-or-later
"""A program's log, with and without a reader."""

import json
import os
import subprocess
import sys

import pytest

from service.machine.log_setup import sentence
from tests.support.programs import REPOSITORY, TIMEOUT_S

BEGIN = """
import sys, time
now = [0.0]
time.monotonic = lambda: now[0]
import structlog
from service.machine.log_setup import set_up_logging
set_up_logging("info")
log = structlog.get_logger()
"""


def run(script: str, *shell: str) -> subprocess.CompletedProcess[str]:
    command = [*shell, sys.executable, "-c", BEGIN + script]
    return subprocess.run(command, cwd=REPOSITORY, capture_output=True, text=True, timeout=TIMEOUT_S, check=True)


def test_suppressed_lines_are_reported_even_without_a_repeat() -> None:
    printed = run("""
for _ in range(50): log.info("gcs.found", station="one")
log.warning("fc.lost")
now[0] = 11.0
log.info("fc.found")
log.info("gcs.found", station="two")
""").stderr
    events = [json.loads(line) for line in printed.splitlines()]
    assert [event["event"] for event in events] == ["gcs.found"] * 20 + [
        "fc.lost",
        "log.left_out",
        "fc.found",
        "gcs.found",
    ]
    assert (events[21]["of"], events[21]["times"], events[21]["level"]) == ("gcs.found", 30, "warning")


def test_the_journal_gets_each_line_with_the_priority(monkeypatch: pytest.MonkeyPatch) -> None:
    """sd-daemon(3): <4> is a warning. The journal has its own times."""
    monkeypatch.setenv("JOURNAL_STREAM", "8:1")
    printed = run('log.warning("fc.lost"); log.info("fc.found", speed=115200)').stderr
    priorities, lines = zip(*((line[:3], json.loads(line[3:])) for line in printed.splitlines()), strict=True)
    assert priorities == ("<4>", "<6>")
    assert lines == (
        {"event": "fc.lost", "level": "warning"},
        {"event": "fc.found", "level": "info", "speed": 115200},
    )


def test_foreign_escape_sequences_do_not_reach_the_terminal() -> None:
    ours, terminal = os.openpty()
    script = BEGIN + 'log.info("fc.lost", why="a\\x1b[2Jb")'
    subprocess.run([sys.executable, "-c", script], cwd=REPOSITORY, stderr=terminal, timeout=TIMEOUT_S, check=True)
    shown = os.read(ours, 4096)
    os.close(ours)
    os.close(terminal)
    assert b"a[2Jb" in shown


def test_a_line_longer_than_the_pipe_does_not_block_or_damage_others() -> None:
    script = """
log.info("fc.lost", why="x" * 1_000_000)
log.info("never.read")
print("went on", flush=True)
sys.stdin.readline()
log.info("fc.found")
"""
    unread, full = os.pipe()
    command = [sys.executable, "-c", BEGIN + script]
    pipes = {"stdin": subprocess.PIPE, "stdout": subprocess.PIPE, "stderr": full}
    with subprocess.Popen(command, cwd=REPOSITORY, **pipes) as program, os.fdopen(unread, "rb", 0) as log:  # type: ignore[call-overload]
        os.close(full)
        try:
            assert program.stdout.readline() == b"went on\n"
            log.read(1 << 20)
            program.stdin.write(b"\n")
            program.stdin.flush()
            lines = log.read(1 << 20).splitlines()
        finally:
            program.kill()
    assert json.loads(lines[-1])["event"] == "fc.found"


def test_a_program_whose_standard_error_is_closed_continues() -> None:
    ended = run('log.error("fc.lost")\nprint("went on")', "sh", "-c", 'exec "$@" 2>&-', "sh")
    assert ended.stdout == "went on\n"


@pytest.mark.parametrize(
    ("event", "words"),
    [
        ({"event": "vehicle.armed"}, "Craft armed"),
        (
            {"event": "fc.lost", "why": "no answer for 3 s", "speed_baud": 115200},
            "Flight controller lost: no answer for 3 s, speed 115200 baud",
        ),
        (
            {"event": "settings.read", "settings": 201, "changed": ["p", "i"]},
            "Settings read: settings 201, changed p, i",
        ),
        (
            {"event": "store.failed", "why": "disk full", "what": "", "level": "error"},
            "Mission store failed: disk full",
        ),
    ],
)
def test_the_page_shows_events_as_sentences(event: dict[str, object], words: str) -> None:
    assert sentence(event) == words
