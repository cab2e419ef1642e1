# SPDX-License-Identifier: GPL-3.0-or-later
"""The table of an upload's states and events."""

from collections.abc import Iterator

import pytest

from bridge.transfers.upload_states import TRANSITIONS, Event, Fixed, UploadState


def kinds(base: type[object]) -> Iterator[str]:
    """The names of all classes derived from `base`, except private ones."""
    for kind in base.__subclasses__():
        if not kind.__name__.startswith("_"):
            yield kind.__name__
        yield from kinds(kind)


def test_every_event_in_every_state_has_an_entry() -> None:
    assert {state.__name__ for state in TRANSITIONS} == {*kinds(UploadState)}
    for row in TRANSITIONS.values():
        assert {event.__name__ for event in row} == {*kinds(Event)}


@pytest.mark.parametrize("state", TRANSITIONS)
def test_every_state_has_a_deadline_and_can_end(state: type[UploadState]) -> None:
    assert 0 < state.seconds <= 60
    assert Fixed.END in TRANSITIONS[state].values()
