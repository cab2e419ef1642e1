# SPDX-License-Identifier: GPL-3.0-or-later
"""Texts of a file in a sentence about it."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from protocols.mission_file.error import MissionFileError, refuse_other_plans
from protocols.plain_text import shown


@given(found=st.text() | st.binary() | st.floats() | st.lists(st.text()) | st.dictionaries(st.text(), st.text()))
def test_anything_in_a_file_is_quoted_printable_and_on_one_line(found: object) -> None:
    assert shown(found).isascii()
    assert shown(found).isprintable()


def test_a_file_of_another_kind_of_plan_is_refused_by_its_name() -> None:
    refuse_other_plans([5001, 16], "x.plan")
    with pytest.raises(MissionFileError, match=r"x\.plan.*a fence and rally points"):
        refuse_other_plans([5001, 5100], "x.plan")
