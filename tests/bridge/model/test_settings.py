# SPDX-License-Identifier: GPL-3.0-or-later
"""Settings that changed without the bridge: their seal, and the text for the pilot."""

from hypothesis import given
from hypothesis import strategies as st

from bridge.model.settings import ChangedPart, Seal, SettingsChange
from protocols.msp.settings import Part

PARTS = st.dictionaries(st.sampled_from(Part), st.binary(max_size=3))


@given(one=PARTS, other=PARTS)
def test_seals_are_alike_only_if_every_part_is(one: dict[Part, bytes], other: dict[Part, bytes]) -> None:
    assert (str(Seal(one)) == str(Seal(other))) is (one == other)


@given(counts=st.lists(st.integers(0, 20), min_size=1, max_size=4), most=st.integers(80, 200))
def test_every_part_is_named_however_little_room_there_is(counts: list[int], most: int) -> None:
    parts = [ChangedPart(part, tuple(f"name {at}" for at in range(count))) for part, count in zip(Part, counts)]  # noqa: B905
    change = SettingsChange(parts, 0.0)
    assert all(each.part.value in change.text(most) for each in parts)
    assert len(change.text(most)) <= most
    assert change.text().count("name ") == sum(counts)
