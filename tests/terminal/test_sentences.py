# SPDX-License-Identifier: GPL-3.0-or-later
"""Sentences on a terminal of 80 columns are wrapped between words; in a pipe they are one line."""

import sys

import pytest

from terminal.sentences import complain, say

PATH = "/var/lib/naze-bridge/" + "very-long-name/" * 6


@pytest.mark.parametrize("columns", [40, 80])
def test_a_sentence_is_wrapped_between_words(
    columns: int, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setenv("COLUMNS", str(columns))
    monkeypatch.setattr(sys.stderr, "isatty", lambda: True)
    words = f"no daemon answers: start one (sudo systemctl start naze-bridge), or free {PATH} by-and-by " * 2
    complain(words)
    lines = capsys.readouterr().err.splitlines()
    assert " ".join(lines).split() == ["naze-bridge:", *words.split()]
    assert all(len(line) <= columns or line == PATH for line in lines)
    assert len(lines) > 2


def test_further_lines_are_indented(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:
    monkeypatch.setenv("COLUMNS", "30")
    monkeypatch.setattr(sys.stdout, "isatty", lambda: True)
    say("searching on every port\nof this machine", prefix="Flight controller  ", indent=19)
    assert capsys.readouterr().out.splitlines() == [
        *("Flight controller  searching on every", " " * 19 + "port", " " * 19 + "of this machine")
    ]


def test_in_a_pipe_it_is_one_line(capsys: pytest.CaptureFixture[str]) -> None:
    complain("word " * 100)
    assert capsys.readouterr().err.count("\n") == 1
