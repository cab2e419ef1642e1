# SPDX-License-Identifier: GPL-3.0-or-later

import struct

import pytest
from pymavlink.mavftp import MAVFTP

from protocols.mavlink.param_pack import encode_param_pack

VALUES = {
    "SYSID_THISMAV": 1.0,
    "p_roll": 35.0,
    "p_pitch": 36.5,
    "A": -1.0,
    "gps_ph_setlspeed": 1e6,
    "gps_ph_minbrkpct": 0.0,
}


def test_pymavlink_reads_the_file() -> None:
    found = MAVFTP.ftp_param_decode(encode_param_pack(VALUES))
    assert found is not None
    assert {name.decode(): value for name, value, _ in found.params} == VALUES


def test_an_empty_file_has_a_header_only() -> None:
    assert encode_param_pack({}) == struct.pack("<HHH", 0x671B, 0, 0)


@pytest.mark.parametrize("count", [1, 17, 800])
def test_equal_beginnings_are_sent_once(count: int) -> None:
    values = {f"osd_element_{number:03}": float(number) for number in range(count)}
    packed = encode_param_pack(values)
    assert len(packed) < 6 + 16 + 10 * count
    found = MAVFTP.ftp_param_decode(packed)
    assert found is not None
    assert len(found.params) == count
