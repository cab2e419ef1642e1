# SPDX-License-Identifier: GPL-3.0-or-later
"""Readers of values: what they accept, and how they refuse the rest."""

from enum import Enum
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from service.settings.key import Reader, Unfit, choice, file_name, several, text, whole, yes_no

HERE = Path("/etc/naze-bridge")


class Colour(Enum):
    RED = "red"


READERS = [text(), file_name(), whole(1, 9), yes_no(), choice(Colour), several("words", lambda entry, _: entry)]
VALUES = st.none() | st.booleans() | st.integers() | st.floats() | st.text() | st.lists(st.integers()) | st.just("red")


@pytest.mark.parametrize("reader", READERS)
@given(value=VALUES | st.just(10**5000))
def test_any_value_is_read_or_refused_in_one_line(reader: Reader, value: object) -> None:
    refusal = ""
    try:
        reader.read(value, HERE)
    except Unfit as error:
        refusal = str(error)
    assert "\n" not in refusal


@given(value=st.integers())
def test_a_number_is_accepted_from_the_least_to_the_most(value: int) -> None:
    if 1 <= value <= 9:
        assert whole(1, 9).read(value, HERE) == value
    else:
        with pytest.raises(Unfit, match=r"1\.\.9"):
            whole(1, 9).read(value, HERE)


def test_true_is_not_a_number_and_1_is_not_true() -> None:
    with pytest.raises(Unfit, match="whole number"):
        whole(0, 1).read(True, HERE)
    with pytest.raises(Unfit, match="true or false"):
        yes_no().read(1, HERE)


def test_a_relative_file_is_in_the_configurations_folder_only_where_that_is_meant() -> None:
    assert file_name(in_config_folder=True).read("gcs.key", HERE) == HERE / "gcs.key"
    assert file_name().read("gcs.key", HERE) == Path("gcs.key")
