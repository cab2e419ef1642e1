# SPDX-License-Identifier: GPL-3.0-or-later
"""QGC WPL 110 files: accepted files, and refusals with their messages."""

import math
import random
from dataclasses import replace

import pytest
from hypothesis import given
from hypothesis import strategies as st

from protocols.mission_file import MissionFileError, read_mission_file, write_qgc_wpl
from protocols.mission_item import MissionItem

HEADER = "QGC WPL 110"
HOME = "0\t1\t0\t16\t0\t0\t0\t0\t45.3838000\t8.4733000\t131.000000\t1"
POINT = "1\t0\t3\t16\t1.00000000\t2.5\t0\tnan\t45.38401410\t-8.47413890\t-13.5\t1"
ITEMS = [
    MissionItem(0, 16, 0, 0.0, 0.0, 0.0, 0.0, 453838000, 84733000, 131.0),
    MissionItem(1, 16, 3, 1.0, 2.5, 0.0, math.nan, 453840141, -84741389, -13.5),
]


def read(*lines: str, end: str = "\n") -> list[MissionItem]:
    return read_mission_file(end.join([*lines, ""]).encode(), "field.waypoints")


def error(*lines: str) -> str:
    with pytest.raises(MissionFileError) as caught:
        read(*lines)
    text = str(caught.value)
    assert text.isprintable()
    assert "\n" not in text
    return text


def refusal(data: bytes) -> str | None:
    try:
        read_mission_file(data, "garbage")
    except MissionFileError as error:
        return str(error)
    return None


def same(one: list[MissionItem], other: list[MissionItem]) -> bool:
    return repr(one) == repr(other)  # here NaN equals NaN


@pytest.mark.parametrize("end", ["\n", "\r\n"])
def test_a_file_written_by_mission_planner_is_read(end: str) -> None:
    assert same(read(HEADER, HOME, POINT, end=end), ITEMS)


@pytest.mark.parametrize(
    "lines",
    [
        ["\ufeff" + HEADER, HOME, POINT],
        [HEADER, HOME.replace("\t", " "), POINT.replace("\t", "   ")],
        ["QGC\tWPL  110 ", "", f"  {HOME}  ", "# a remark", POINT, " ", ""],
    ],
    ids=["byte order mark", "spaces", "blank lines and remarks"],
)
def test_files_written_by_other_programs_are_read(lines: list[str]) -> None:
    assert same(read(*lines), ITEMS)


def noted(*lines: str) -> tuple[list[MissionItem], list[str]]:
    notes: list[str] = []
    return read_mission_file("\n".join([*lines, ""]).encode(), "field.waypoints", notes.append), notes


@pytest.mark.parametrize(
    ("lines", "note"),
    [
        ([HOME, "2" + POINT[1:]], "item 2 where item 1 was expected: renumbered by their order"),
        ([HOME, "0" + POINT[1:]], "item 0 where item 1 was expected: renumbered by their order"),
        ([HOME.replace("\t0\t16\t", "\t3\t0\t"), POINT], "home has command 0, treated as a WAYPOINT"),
        ([HOME, POINT.removesuffix("\t1")], "line 3: autocontinue is missing"),
        ([HOME.replace("\t", ","), POINT.replace("\t", ", ")], None),
        ([HOME.replace("0\t1\t", "0\t2\t"), POINT], None),
    ],
    ids=["a gap", "a repeat", "home with command 0", "11 fields", "commas", "current = 2"],
)
def test_files_that_mission_planner_accepts_are_read_with_a_note(lines: list[str], note: str | None) -> None:
    items, notes = noted(HEADER, *lines)
    assert same(items, ITEMS)
    assert notes == ([note] if note else [])


def test_a_file_without_home_gets_a_home_without_a_position() -> None:
    items, notes = noted(HEADER, POINT)
    assert notes == ["there is no item 0: home is missing"]
    assert (items[0].seq, items[0].command, items[0].lat_e7) == (0, 16, None)
    assert same(items[1:], ITEMS[1:])


def test_a_last_line_without_the_end_and_autocontinue_is_truncated() -> None:
    with pytest.raises(MissionFileError, match="11 fields"):
        read_mission_file("\n".join([HEADER, HOME, POINT.removesuffix("\t1")]).encode(), "x")


def test_the_last_line_does_not_need_a_newline() -> None:
    assert same(read_mission_file("\n".join([HEADER, HOME, POINT]).encode(), "x"), ITEMS)


@pytest.mark.parametrize(
    ("degrees", "e7"),
    [
        ("45.38401415", 453840142),  # rounded, not truncated
        ("-0.00000005", 0),  # to even, as in IEEE 754
        ("-0.00000006", -1),
        ("1e1", 100000000),
        ("999", 9990000000),  # left to the rules
        ("nan", None),
    ],
)
def test_degrees_are_rounded_to_1e_7(degrees: str, e7: int | None) -> None:
    assert read(HEADER, HOME.replace("45.3838000", degrees))[0].lat_e7 == e7


@pytest.mark.parametrize(
    ("lines", "words"),
    [
        ([], ["no items"]),
        (["", "  "], ["no items"]),
        ([HEADER], ["no items"]),
        (["QGC WPL 100", HOME], ["line 2", "12 fields", "has 13"]),
        (["QGC WPL 130", HOME], ["line 1", "'QGC WPL 130'", "QGC WPL 110"]),
        (["QGC WPL PB 110", HOME], ["line 1", "'QGC WPL PB 110'"]),
        (["", HOME], ["items without the header", "write QGC WPL 110"]),
        (["MZ\x90\x00\x03"], ["a binary file"]),
        ([HEADER, HOME, "1\t0\t3\t16\t0\t0\t0\t0\t45.38"], ["line 3", "9 fields", "12"]),
        ([HEADER, HOME, POINT + "\t1"], ["line 3", "13 fields"]),
        ([HEADER, HOME, POINT.replace("45.38401410", "45,384")], ["line 3", "'45,384' has a decimal comma", "a point"]),
        ([HEADER, HOME, POINT.replace("\t", ";").replace(".", ",")], ["line 3", "'1,00000000' has a decimal comma"]),
        ([HEADER, HOME, POINT.replace("45.38401410", "1e4003")], ["line 3", "latitude is inf", "degrees"]),
        ([HEADER, HOME, POINT.replace("45.38401410", "1e305")], ["line 3", "latitude is 1e+305"]),
        ([HEADER, HOME.replace("8.4733000", "-inf")], ["line 2", "longitude is -inf"]),
        ([HEADER, HOME, POINT.replace("2.5", "2_5")], ["line 3", "param2", "'2_5'"]),
        ([HEADER, HOME, POINT.replace("2.5", "0x10")], ["line 3", "param2"]),
        ([HEADER, HOME, POINT.replace("-13.5", "٣")], ["line 3", "altitude"]),
        ([HEADER, HOME, POINT.replace("-13.5", "1" * 500 + "x")], ["line 3", "altitude"]),
        ([HEADER, HOME, POINT.replace("\t16\t", "\t16.0\t")], ["line 3", "command", "'16.0'", "65535"]),
        ([HEADER, HOME, POINT.replace("\t16\t", "\t65536\t")], ["line 3", "command", "65535"]),
        ([HEADER, HOME, POINT.replace("\t3\t", "\t-1\t")], ["line 3", "frame", "'-1'"]),
        ([HEADER, HOME, POINT.replace("\t3\t", "\t256\t")], ["line 3", "frame", "255"]),
        ([HEADER, "", HOME, "# x", POINT + "\t1"], ["line 5"]),
        ([HEADER, HOME, POINT.replace("\t16\t", "\t5001\t")], ["contains a fence", "the mission's own file"]),
        ([HEADER, HOME, POINT.replace("\t16\t", "\t5100\t")], ["contains rally points"]),
        (["#saved by Mission Planner", "45.383\t8.473", "45.384\t8.474"], ["contains a fence"]),
        (["RALLY\t45.383\t8.473\t100\t0\t0\t0"], ["contains rally points"]),
    ],
)
def test_a_damaged_file_is_refused_with_the_line(lines: list[str], words: list[str]) -> None:
    text = error(*lines)
    assert text.startswith("field.waypoints")
    for word in words:
        assert word in text
    assert "; " in text  # and the remedy


def test_a_truncated_file_never_reads_as_another_mission() -> None:
    """Only truncation at the end of an item leaves a shorter list; within a line it is detected."""
    whole = "\n".join([HEADER, HOME, POINT]).encode()
    for length in range(len(whole)):
        try:
            items = read_mission_file(whole[:length], "cut")
        except MissionFileError:
            continue
        assert same(items, ITEMS[: len(items)])


numbers = st.floats() | st.integers(-300, 300).map(float)
degrees_e7 = st.integers(-1_800_000_000, 1_800_000_000) | st.none()
any_items = st.lists(
    st.builds(
        MissionItem,
        seq=st.just(0),
        command=st.integers(1, 4999) | st.integers(5200, 65535),
        frame=st.integers(0, 255),
        **dict.fromkeys(("p1", "p2", "p3", "p4"), numbers),
        lat_e7=degrees_e7,
        lon_e7=degrees_e7,
        alt_m=numbers,
    ),
    min_size=1,
    max_size=5,
).map(lambda items: [replace(item, seq=seq) for seq, item in enumerate(items)])


@given(any_items)
def test_a_written_file_reads_back_the_same(items: list[MissionItem]) -> None:
    assert same(read_mission_file(write_qgc_wpl(items).encode(), "x"), items)


@given(st.binary(max_size=300), st.sampled_from([b"", HEADER.encode() + b"\n", (HEADER + "\n" + HOME + "\n").encode()]))
def test_garbage_is_one_clear_error(garbage: bytes, before: bytes) -> None:
    refused = refusal(before + garbage)
    assert refused is None or (refused.startswith("garbage") and refused.isprintable())


@given(st.lists(st.sampled_from(["0", "1", "16", "3", "-1", "1e9", "nan", "x", "45.1", "1" * 400]), max_size=14))
def test_any_line_of_fields_is_read_or_refused(fields: list[str]) -> None:
    refused = refusal("\n".join([HEADER, HOME, "\t".join(fields)]).encode())
    assert refused is None or "line 3" in refused


@pytest.mark.parametrize("start", [b"", HEADER.encode() + b"\n", (HEADER + "\n" + HOME + "\n1 0 3 16 ").encode(), b"{"])
@pytest.mark.parametrize("kind", ["bytes", "zeros", "digits", "text", "brackets"])
@pytest.mark.parametrize("name", ["a.waypoints", "a.plan"])
def test_long_garbage_yields_a_single_error(start: bytes, kind: str, name: str) -> None:
    noise = random.Random(7)
    size = 2**18
    garbage = {
        "bytes": noise.randbytes(size),
        "zeros": bytes(size),
        "digits": b"1" * size,
        "text": bytes(noise.choices(b'0123456789.-e \t\n{}[]",:', k=size)),
        "brackets": b"[" * size,
    }[kind]
    with pytest.raises(MissionFileError, match=r"^a\.(waypoints|plan)") as caught:
        read_mission_file(start + garbage, name)
    assert len(str(caught.value)) < 200
