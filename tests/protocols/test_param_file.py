# SPDX-License-Identifier: GPL-3.0-or-later
"""Files of settings: those of each ground station are read, and errors name the line."""

import math

import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from protocols.float32 import single
from protocols.param_file import (
    ParamFileError,
    is_equal,
    is_setting_name,
    read_param_file,
    shown_value,
    write_param_file,
)

NAMES = st.text(st.sampled_from("abcXYZ019_-.[]"), min_size=1, max_size=32).filter(is_setting_name)
FLOATS = st.floats(-(2.0**127), 2.0**127, width=32)
TEXTS = st.text(st.sampled_from("aZ 0,#.;"), max_size=16)
WHOLE = st.integers(-(2**31), 2**32 - 1).map(float)


def test_each_ground_stations_lines_are_read() -> None:
    text = (
        "\ufeff# Onboard parameters\r\n#NOTE: today\r\nA_1,1.50\r\nB\t-2\nC    3e1  # text\n1\t1\tD_\t4.000\t9\n\nE, 5"
    )
    assert read_param_file(text.encode(), "x").values == {"A_1": 1.5, "B": -2.0, "C": 30.0, "D_": 4.0, "E": 5.0}


def test_the_board_is_kept_in_a_comment() -> None:
    text = write_param_file({"p_roll": 40.0, "gps_wp_radius": 0.1}, "Harakiri 2.11", ["taken today"])
    assert text == "# board: Harakiri 2.11\n# taken today\np_roll,40\ngps_wp_radius,0.1\n"
    assert read_param_file(text.encode(), "x").board == "Harakiri 2.11"


@given(st.dictionaries(NAMES, FLOATS | WHOLE | TEXTS, min_size=1))
def test_a_written_file_reads_back_equal(values: dict[str, float | str]) -> None:
    read = read_param_file(write_param_file(values).encode(), "x").values
    assert list(read) == list(values)
    assert all(is_equal(values[name], read[name]) for name in values)


@given(FLOATS)
def test_a_boards_value_is_written_exactly(value: float) -> None:
    assert single(float(shown_value(value))) == single(value)


def test_a_text_is_a_comment_to_ground_stations() -> None:
    text = write_param_file({"name": "Kite, 2", "p": 1.0})
    assert text == "# text: name,Kite, 2\np,1\n"
    assert read_param_file(text.replace("\n", "\r\n").encode(), "x").values == {"name": "Kite, 2", "p": 1.0}


def test_a_value_that_is_not_a_number_is_left_out() -> None:
    assert write_param_file({"a": math.nan, "b": 1.0}) == "b,1\n"


@pytest.mark.parametrize(
    ("text", "place", "what"),
    [
        (b"A,1\nB,1,5\n", "line 2", "decimal point"),
        (b"A,1\nB\n", "line 2", "NAME,VALUE"),
        (b"".join(b"A%d,1\n" % number for number in range(9999)), "line 1501", "over 1500 settings"),
        (b"A,1\n\n# x\nB,high\n", "line 4", "not a number"),
        (b"A,nan\n", "line 1", "not a number"),
        (b"A,1e999\n", "line 1", "not a number"),
        (b"A,1_0\n", "line 1", "not a number"),
        (b"A,1\nB,2\nA,3\n", "line 3", "1 in line 1 and 3 here"),
        (b"A,1\n\xff,2\n", "line 2", "not a setting's name"),
        ("ä,1\n".encode(), "line 1", "not a setting's name"),
        (b"A\x1b[31m,1\n", "line 1", "not a setting's name"),
        (b"51.1 0.1\n51.2 0.2\n", "line 1", "not a setting's name"),  # a fence
        (b"QGC WPL 110\n0\t1\n", "line 1", "mission"),
        (b"# only comments\n", "", "not contain settings"),
    ],
)
def test_an_error_names_the_line_and_the_problem(text: bytes, place: str, what: str) -> None:
    with pytest.raises(ParamFileError) as caught:
        read_param_file(text, "my.param")
    sentence = str(caught.value)
    assert sentence.startswith(f"my.param, {place}: " if place else "my.param: ")
    assert what in sentence
    assert sentence.isprintable()


@pytest.mark.parametrize("encoding", ["cp1252", "latin-1", "utf-8", "utf-8-sig", "utf-16"])
def test_a_comment_may_be_in_any_encoding(encoding: str) -> None:
    assert read_param_file("# f\u00fcr den S\u00fcdhang\nA,1\n".encode(encoding), "x").values == {"A": 1.0}


def test_a_repeated_equal_line_is_not_an_error() -> None:
    assert read_param_file(b"A,1\nA,1.0\n", "x").values == {"A": 1.0}


@given(st.binary(max_size=200))
@example(b"1\t1\tA\t\xb2\t9")
def test_any_bytes_are_read_or_refused_in_one_line(data: bytes) -> None:
    try:
        found = read_param_file(data, "x")
    except ParamFileError as error:
        sentence = str(error)
    else:
        sentence = "read"
        assert all(isinstance(value, str) or math.isfinite(value) for value in found.values.values())
    assert sentence.isprintable()


@given(st.text(st.sampled_from("A1,\t #.-e\n"), max_size=60))
def test_any_text_like_a_file_is_read_or_refused(text: str) -> None:
    try:
        found = read_param_file(text.encode(), "x").values
    except ParamFileError:
        return
    assert read_param_file(write_param_file(found).encode(), "x").values.keys() == found.keys()
