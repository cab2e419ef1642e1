# SPDX-License-Identifier: GPL-3.0-or-later
"""Files that hold no mission are named."""

import pytest

from protocols.mission_file import MissionFileError, read_mission_file

SETTINGS = "settings; give the mission's own file; `naze-bridge settings restore`"


@pytest.mark.parametrize(
    ("data", "what"),
    [
        (b"\0\x05\xf1\x02\x8f\x10\xaa\x01\xfd\x09\0\0", "a telemetry log (.tlog)"),
        (b"\xa3\x95\x80\x80Y\0\0", "an ArduPilot log (.bin)"),
        (b"\x89PNG\r\n\x1a\n\0\0", "a picture"),
        (b"\x7fELF\1\1\0", "a firmware image"),
        (b":020000040800F2\n:10000000\n", "a firmware image"),
        (b"H Product:Blackbox flight data recorder\n", "a blackbox log"),
        (b"$GPGGA,123519,4807.038,N\n", "a log of a GPS receiver"),
        (b"# INAV/SITL 9.1.0\nbatch start\nset a = 1\n", SETTINGS),
        (b"#NOTE: H\xf6he\ngps_wp_radius,300\n", SETTINGS),
        (b"# Onboard parameters\n1\t1\tWP_RADIUS\t200\t9\n", SETTINGS),
        (b"RALLY 51.4 0.1 20 0 0 0\n", "rally points; give the mission's own file"),
    ],
)
def test_names_the_content(data: bytes, what: str) -> None:
    with pytest.raises(MissionFileError) as caught:
        read_mission_file(data, "x.waypoints")
    assert what in str(caught.value)
