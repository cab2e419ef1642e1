# SPDX-License-Identifier: GPL-3.0-or-later

import pytest
from hypothesis import given
from hypothesis import strategies as st

from protocols.msp.mode_ranges import range_writes, ranges_text

ARM, ANGLE, UNUSED = b"\0\0\x20\x30", b"\1\1\x10\x20", bytes(4)
HELD = st.tuples(st.integers(0, 255), st.integers(0, 255), st.integers(0, 48), st.integers(0, 48)).map(bytes)
RANGES = st.lists(st.tuples(st.integers(0, 13), st.integers(0, 47), st.integers(1, 48)), max_size=4)


def carried_out(payload: bytes, writes: list[bytes]) -> bytes:
    held = bytearray(payload)
    for number, *one in writes:
        held[4 * number : 4 * number + 4] = bytes(one)
    return bytes(held)


def test_a_mode_is_shown_with_channel_and_pulses() -> None:
    payload = ARM + ANGLE + UNUSED + b"\1\0\0\x10"
    assert [ranges_text(payload, number) for number in range(3)] == [
        "AUX1 1700-2100", "AUX1 900-1300; AUX2 1300-1700", "",
    ]  # fmt: skip


@given(held=st.lists(HELD, min_size=8, max_size=8), wanted=RANGES, number=st.integers(1, 3))
def test_writing_a_modes_ranges_leaves_other_modes(
    held: list[bytes], wanted: list[tuple[int, int, int]], number: int
) -> None:
    payload = b"".join(held)
    text = ranges_text(b"".join(bytes((number, *each)) for each in wanted), number)
    writes = range_writes(payload, number, text)
    if writes is None:
        return
    after = carried_out(payload, writes)
    assert ranges_text(after, number) == text
    for other in {each[0] for each in held} - {number}:
        assert ranges_text(after, other) == ranges_text(payload, other)
    assert range_writes(after, number, text) == []


def test_each_write_is_a_whole_range() -> None:
    assert range_writes(ARM + UNUSED, 1, "AUX2 1300-1700") == [b"\1" + ANGLE]


def test_ranges_that_the_board_holds_in_other_places_are_not_written() -> None:
    assert range_writes(b"\1\1\x10\x20" + b"\1\0\x10\x20", 1, "AUX1 1300-1700; AUX2 1300-1700") == []


def test_a_board_with_too_few_ranges_is_not_written() -> None:
    assert range_writes(ARM + ANGLE, 2, "AUX2 1300-1700") is None


@pytest.mark.parametrize(
    "text",
    ["AUX0 1300-1700", "AUX15 1300-1700", "AUX1 1700-1300", "AUX1 1310-1700", "AUX1 800-1700", "AUX1 1300-2125",
     "AUX1 1300", "1 1300-1700", "aux1 1300-1700", "AUX2 1300-1700; AUX1 1300-1700", "AUX1 1300-1700;"],
)  # fmt: skip
def test_another_form_is_refused_with_an_example(text: str) -> None:
    with pytest.raises(ValueError, match="write AUX1 1300-1700"):
        range_writes(UNUSED * 4, 1, text)
