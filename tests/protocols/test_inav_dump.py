# SPDX-License-Identifier: GPL-3.0-or-later
"""INAV's settings in a file."""

import pytest

from protocols.inav_dump import SavedSettings, read_inav_settings
from protocols.msp.inav_places import Safehome
from protocols.plain_text import FileError

DUMP = b"""# INAV/SITL 9.1.0
batch start
safehome 0 1 453838000 -84733000
feature GPS
set nav_rth_alt_mode = FIXED
set nav_rth_altitude = 2000
battery_profile 1
set vbat_warning_cell_voltage = 350
battery_profile 2
set vbat_warning_cell_voltage = 300
"""


def test_a_dump_has_settings_and_safehomes_and_the_first_profiles_values() -> None:
    values = {"nav_rth_alt_mode": "FIXED", "nav_rth_altitude": "2000", "vbat_warning_cell_voltage": "350"}
    assert read_inav_settings(DUMP, "dump") == SavedSettings(values, (Safehome(0, True, 453838000, -84733000),))


def test_any_other_file_is_read_as_a_param_file() -> None:
    assert read_inav_settings(b"nav_rth_altitude,2000\n", "a.param").values == {"nav_rth_altitude": 2000}


@pytest.mark.parametrize(
    "line", [b"set a_b =  10", b"SET A_B = 10", b"set a_b=10", b"  set\ta_b = 10 \r", b"\xef\xbb\xbfset a_b = 10"]
)
def test_reads_set_lines_as_inavs_command_line_does(line: bytes) -> None:
    assert read_inav_settings(line + b"\nset other = GPS M8\n", "dump").values == {"a_b": "10", "other": "GPS M8"}


@pytest.mark.parametrize(
    ("text", "why"),
    [
        (b"", "no settings"),
        (b"safehome 0 1 45.3 8\n", "line 1: 'safehome 0 1 45.3 8' cannot be read; write safehome NUMBER"),
        (
            b"set a = 1\nset nav_rth_altitude 2000\n",
            "line 2: 'set nav_rth_altitude 20... cannot be read; write set NAME",
        ),
    ],
)
def test_refuses_what_it_cannot_read_with_the_line(text: bytes, why: str) -> None:
    with pytest.raises(FileError, match=why):
        read_inav_settings(text, "dump")
