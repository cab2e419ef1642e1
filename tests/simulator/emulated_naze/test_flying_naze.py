# SPDX-License-Identifier: GPL-3.0-or-later
"""The emulated board in the simulated sky, without a firmware."""

import struct

import pytest

from simulator.emulated_naze.flying_naze import FlyingNaze
from simulator.emulated_naze.image import Image

#: Stack pointer, entry, and a jump to itself.
LOOP = struct.pack("<II", 0x2000_5000, 0x0800_0009) + b"\xfe\xe7"


@pytest.mark.parametrize("tempo", [0.5, 1.0, 4.0])
def test_board_and_sky_follow_the_tempo(tempo: float) -> None:
    naze = FlyingNaze(Image(LOOP), tempo=tempo)
    naze.power_on(100.0)
    naze.truth(100.04)
    begun_s = naze.sky.now_s
    naze.truth(100.1)
    assert naze.sky.now_s - begun_s == pytest.approx(0.06 * tempo, abs=0.0011)
