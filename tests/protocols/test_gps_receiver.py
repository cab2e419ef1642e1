# SPDX-License-Identifier: GPL-3.0-or-later
"""GPS receivers are recognised by intact sentences and frames only, however the bytes arrive."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from protocols.gps_receiver import GpsWatch

SENTENCE = b"$GPGGA,123519,4807.038,N,01131.000,E,1,08,0.9,545.4,M,46.9,M,,*47\r\n"
#: ACK-ACK of CFG-PRT.
FRAME = bytes.fromhex("b562 0501 0200 0600 0e37")
KINDS = pytest.mark.parametrize(("whole", "name"), [(SENTENCE, "NMEA"), (FRAME, "UBX")])


def heard(*chunks: bytes) -> str:
    watch = GpsWatch()
    for chunk in chunks:
        watch.feed(chunk)
    return watch.heard


@KINDS
@given(before=st.text("\0U,*,\n7", max_size=40), cut=st.integers(0, 80))
def test_it_is_heard_wherever_a_read_ends(whole: bytes, name: str, before: str, cut: int) -> None:
    data = before.encode() + whole
    assert heard(data[:cut], data[cut:]) == name


@KINDS
@given(at=st.integers(1, 1000), bit=st.integers(0, 7))
def test_a_damaged_one_is_not_heard(whole: bytes, name: str, at: int, bit: int) -> None:
    data = bytearray(whole.rstrip(b"\r\n"))
    data[at % len(data)] ^= 1 << bit
    assert heard(bytes(data)) == ""
