# SPDX-License-Identifier: GPL-3.0-or-later
"""Texts of a file in a sentence about it, and files without a mission."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from protocols.mission_file import MissionFileError, read_mission_file
from protocols.mission_file.error import refuse_other_plans
from protocols.plain_text import shown

SETTINGS = "settings; give the mission's own file; `naze-bridge settings restore`"


@given(found=st.text() | st.binary() | st.floats() | st.lists(st.text()) | st.dictionaries(st.text(), st.text()))
def test_anything_in_a_file_is_quoted_printable_and_on_one_line(found: object) -> None:
    assert shown(found).isascii()
    assert shown(found).isprintable()


def test_a_file_of_another_kind_of_plan_is_refused_by_the_name() -> None:
    refuse_other_plans([5001, 16], "x.plan")
    with pytest.raises(MissionFileError, match=r"x\.plan.*a fence and rally points"):
        refuse_other_plans([5001, 5100], "x.plan")


@pytest.mark.parametrize(
    ("data", "what"),
    [
        (b"\0\x05\xf1\x02\x8f\x10\xaa\x01\xfd\x09\0\0", "a telemetry log (.tlog)"),
        (b"\xa3\x95\x80\x80Y\0\0", "an ArduPilot log (.bin)"),
        (b"\x89PNG\r\n\x1a\n\0\0", "a picture"),
        (b"\x7fELF\1\1\0", "a firmware image"),
        (b":020000040800F2\n:10000000\n", "a firmware image"),
        (b"H Product:Blackbox flight data recorder\n", "a flight log"),
        (b"$GPGGA,123519,4807.038,N\n", "a log of a GPS receiver"),
        (b"# INAV/SITL 9.1.0\nbatch start\nset a = 1\n", SETTINGS),
        (b"#NOTE: H\xf6he\ngps_wp_radius,300\n", SETTINGS),
        (b"# Onboard parameters\n1\t1\tWP_RADIUS\t200\t9\n", SETTINGS),
        (b"%PDF-1.4\n", "a PDF document"),
        (b"<!doctype HTML>\n<html></html>", "a web page; download the file itself"),
        (b"FMT, 128, 89, FMT, BBnNZ, Type\n", "a flight log"),
        (b"0\t1\t0\t16\t0\t0\t0\t0\t51.4\t0.1\t46\t1\n", "items without the header; write QGC WPL 110 into a line"),
        ("Breite;Länge;Höhe\n51,4;0,1;30\n".encode(), "latitude and longitude; name the columns in the first line"),
        (b"Hello pilot,\n", "a mission does not begin with 'Hello pilot,'; save the mission as QGC WPL 110"),
        (b"RALLY 51.4 0.1 20 0 0 0\n", "rally points; give the mission's own file"),
    ],
)
def test_names_the_content(data: bytes, what: str) -> None:
    with pytest.raises(MissionFileError) as caught:
        read_mission_file(data, "x.waypoints")
    assert what in str(caught.value)
