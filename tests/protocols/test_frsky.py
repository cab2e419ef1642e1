# SPDX-License-Identifier: GPL-3.0-or-later
"""FrSky telemetry: Harakiri's values are recognised, also in pieces, and foreign bytes end a row of them."""

import itertools

import pytest
from hypothesis import given
from hypothesis import strategies as st

from protocols.frsky import FrskyWatch
from simulator.board.flight import fly
from simulator.naze import frsky

#: The values 0x5E and 0x5D have to be escaped.
HEADING_94 = bytes.fromhex("5e 10 0c 00 5e 21 5d3d 00 5e 14 5d3e 00 5e 1c 00 00 5e")


def in_a_row(*chunks: bytes) -> int:
    watch = FrskyWatch()
    for chunk in chunks:
        watch.feed(chunk)
    return watch.values_in_a_row


def test_values_of_a_group_are_counted() -> None:
    assert in_a_row(HEADING_94) == 4
    assert in_a_row(HEADING_94, HEADING_94) == 8


@given(st.integers(1, 80), st.lists(st.integers(0, 200), max_size=4))
def test_telemetry_of_the_simulator_is_recognised_in_any_pieces(number: int, cuts: list[int]) -> None:
    sent = frsky.frames(fly(0, 0, True), number, 61.0)
    pieces = [sent[start:end] for start, end in itertools.pairwise([0, *sorted(cuts), len(sent)])]
    assert in_a_row(*pieces) == in_a_row(sent) >= 3


@pytest.mark.parametrize(
    "foreign", [b"\x5e\x06\x08\x5e", b"\x5e\x06\x08\x02\x00\x5e", b"\x5e\x77\x08\x02\x5e", bytes(9)]
)
def test_foreign_bytes_end_the_row(foreign: bytes) -> None:
    assert in_a_row(HEADING_94, foreign) == 0


@given(st.lists(st.one_of(st.binary(max_size=40), st.sampled_from([HEADING_94, HEADING_94[:7]]))))
def test_any_bytes_are_accepted_without_an_error(chunks: list[bytes]) -> None:
    assert in_a_row(*chunks) >= 0
