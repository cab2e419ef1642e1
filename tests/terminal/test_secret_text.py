# SPDX-License-Identifier: GPL-3.0-or-later
"""A secret is for the person at the terminal: a log or a pipe gets the name of the file that has it."""

import pytest

from terminal import sentences
from terminal.sentences import show_secret


@pytest.mark.parametrize("is_terminal", [True, False])
def test_only_a_terminal_gets_the_secret(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], is_terminal: bool
) -> None:
    monkeypatch.setattr(sentences, "is_terminal", lambda: is_terminal)
    show_secret("Its token", "hush", "/var/lib/x/token", "http://x/#hush")
    printed = capsys.readouterr().out
    assert ("hush" in printed) is is_terminal
    assert ("Its token: in /var/lib/x/token" in printed) is not is_terminal
    assert len(printed.splitlines()) > 10 or not is_terminal  # with the code
