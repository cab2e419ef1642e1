# SPDX-License-Identifier: GPL-3.0-or-later
"""The table of an upload's states and events."""

from collections.abc import Iterator

import pytest

from bridge.transfers.upload_states import TRANSITIONS, Event, Fixed, UploadState


def kinds(base: type) -> list[type]:
    return [*_below(base)]


def _below(base: type) -> Iterator[type]:
    for kind in base.__subclasses__():
        if not kind.__name__.startswith("_"):
            yield kind
        yield from _below(kind)


def test_every_event_in_every_state_has_an_entry() -> None:
    assert {*TRANSITIONS} == {*kinds(UploadState)}
    assert all({*row} == {*kinds(Event)} for row in TRANSITIONS.values())


@pytest.mark.parametrize("state", kinds(UploadState))
def test_every_state_has_a_deadline_and_can_end(state: type[UploadState]) -> None:
    assert 0 < state.seconds <= 60
    assert Fixed.END in TRANSITIONS[state].values()
