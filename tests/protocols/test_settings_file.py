# SPDX-License-Identifier: GPL-3.0-or-later
"""Settings in files: dumps of command lines, and .param files."""

import pytest

from protocols.msp.inav_places import Safehome
from protocols.plain_text import FileError
from protocols.settings_file import SavedSettings, read_settings_file, unread_text, write_dump

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
    unread = ((4, "feature"), (10, "battery_profile 2"))
    places = (Safehome(0, True, 453838000, -84733000),)
    assert read_settings_file(DUMP, "dump") == SavedSettings(values, places, "INAV 9.1.0", unread)


def test_any_other_file_is_read_as_a_param_file() -> None:
    assert read_settings_file(b"nav_rth_altitude,2000\n", "a.param").values == {"nav_rth_altitude": 2000}


@pytest.mark.parametrize(
    "line", [b"set a_b =  10", b"SET A_B = 10", b"set a_b=10", b"  set\ta_b = 10 \r", b"\xef\xbb\xbfset a_b = 10"]
)
def test_reads_set_lines_as_inavs_command_line_does(line: bytes) -> None:
    assert read_settings_file(line + b"\nset other = GPS M8\n", "dump").values == {"a_b": "10", "other": "GPS M8"}


@pytest.mark.parametrize(
    ("text", "why"),
    [
        (b"", "not contain settings"),
        (b"safehome 0 1 45.3 8\n", "line 1: 'safehome 0 1 45.3 8' cannot be read; write safehome NUMBER"),
        (
            b"set a = 1\nset nav_rth_altitude 2000\n",
            "line 2: 'set nav_rth_altitude 20... cannot be read; write set NAME",
        ),
    ],
)
def test_refuses_unreadable_lines_with_their_number(text: bytes, why: str) -> None:
    with pytest.raises(FileError, match=why):
        read_settings_file(text, "dump")


INAV_DIFF = b"""# diff all

# version
# INAV/MATEKF405 7.1.2 Jul 26 2024 / 10:29:05 (4e1e59eb)
# GCC-10.3.1

# start the command batch
batch start
defaults noreboot
feature GPS
serial 0 1 115200 115200 0 115200
serial 1 2 115200 115200 0 115200
# master
set nav_wp_max_safe_distance = 500
# mixer_profile 1
mixer_profile 1
set model_preview_type = 3
mixer_profile 2
# control_profile
control_profile 1
control_profile 2
set mc_p_pitch = 55
battery_profile 1
set bat_voltage_src = RAW
battery_profile 2
# restore original profile selection
mixer_profile 1
control_profile 1
battery_profile 1
# save configuration
save
"""


def test_only_the_selected_profiles_count_and_other_lines_are_listed() -> None:
    found = read_settings_file(INAV_DIFF, "diff.txt")
    assert found.board == "INAV 7.1.2"
    assert found.values == {"nav_wp_max_safe_distance": "500", "model_preview_type": "3", "bat_voltage_src": "RAW"}
    assert unread_text(found.unread) == "10 (feature), 11-12 (serial), 22 (control_profile 2)"


def test_reads_the_dumps_of_other_firmwares() -> None:
    betaflight = b"# Betaflight / STM32F7X2 (S7X2) 4.4.2 Jun  1 2023 / 06:05:08 (23d066d08)\nset p_roll = 45\nsave\n"
    assert read_settings_file(betaflight, "x")[0::2] == ({"p_roll": "45"}, "Betaflight 4.4.2")
    cleanflight = b"# Cleanflight/NAZE 1.13.0 Jul 17 2016 / 10:00:00 (abcdef0)\nset p_roll = 40\n"
    assert read_settings_file(cleanflight, "x").board == "Cleanflight 1.13.0"
    harakiri = b"Config:\nFW: TestCode3\nCurrent settings: \nrc_db = 20\nrc_trm_rll =  -0.500\n"
    found = read_settings_file(harakiri, "x")
    assert found.values == {"rc_db": "20", "rc_trm_rll": "-0.500"}
    assert unread_text(found.unread) == "1 (Config:), 2 (FW:), 3 (Current)"


def test_a_written_dump_reads_back() -> None:
    text = write_dump({"nav_rth_alt_mode": "FIXED", "MODE_ANGLE": "AUX1 1300-1700"}, "INAV 8.0.1", ["taken: today"])
    assert text.splitlines()[1:] == ["# taken: today", "set nav_rth_alt_mode = FIXED", *text.splitlines()[3:]]
    assert text.splitlines()[3:] == ["# MODE_ANGLE = AUX1 1300-1700", "save"]
    found = read_settings_file(text.encode(), "x")
    assert (found.values, found.board, found.unread) == ({"nav_rth_alt_mode": "FIXED"}, "INAV 8.0.1", ())


def test_a_dump_without_a_setting_is_not_read_as_a_param_file() -> None:
    with pytest.raises(FileError, match=r"this file does not contain settings; give a \.param file or a dump"):
        read_settings_file(b"# INAV/X 7.1.2\nbatch start\nwp 0 0 0 0 0 0 0 0 0\nsave\n", "x")
