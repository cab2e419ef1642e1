# SPDX-License-Identifier: GPL-3.0-or-later
"""Names and texts of others can be printed on root's terminal."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from protocols.plain_text import plain_text


@pytest.mark.parametrize(
    ("text", "shown"),
    [
        ("Süßwiese №7 - 測試 נחיתה.plan", "Süßwiese №7 - 測試 נחיתה.plan"),
        ("u\u0308ber.plan", "u\u0308ber.plan"),
        ("\x1b[2J\x1b]0;root\x07a", "[2J]0;roota"),
        ("\x9b2Ja\x85b", "2Ja b"),
        ("a\u202egnp.plan\u2066", "agnp.plan"),
        ("two\r\nlines\u2028three", "two  lines three"),
        ("caf\udce9.plan", "caf?.plan"),
    ],
)
def test_control_and_direction_marks_are_left_out(text: str, shown: str) -> None:
    assert plain_text(text) == shown


@given(st.text() | st.binary())
def test_any_text_becomes_printable(text: str | bytes) -> None:
    shown = plain_text(text)
    assert shown.isprintable()
    assert plain_text(shown) == shown
