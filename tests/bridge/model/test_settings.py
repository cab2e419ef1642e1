# SPDX-License-Identifier: GPL-3.0-or-later

from hypothesis import given
from hypothesis import strategies as st

from bridge.model.settings import SettingsChange


@given(count=st.integers(1, 40), most=st.integers(40, 200))
def test_a_long_report_is_cut_between_names_and_gives_the_number_left_out(count: int, most: int) -> None:
    change = SettingsChange(tuple(f"name_{at}" for at in range(count)), 0.0)
    text = change.text(most)
    assert len(text) <= most
    named, _, more = text.partition("+")
    assert named.count("name_") + int(more or 0) == count
    assert change.text().count("name_") == count
