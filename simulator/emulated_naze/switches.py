# SPDX-License-Identifier: GPL-3.0-or-later
"""Faults and counters that only an emulated board has."""

from dataclasses import dataclass

from simulator.board.options import BoardCounters, BoardFaults


@dataclass(slots=True, kw_only=True)
class EmulatedFaults(BoardFaults):
    """The positions of sticks and switches, in microseconds.

    With `armed`, throttle and yaw are overridden until the firmware arms, and without it until it disarms.
    """

    roll: int = 1500
    pitch: int = 1500
    throttle: int = 1000
    yaw: int = 1500
    aux1: int = 1000
    aux2: int = 1000
    aux3: int = 1000
    aux4: int = 1000


@dataclass(slots=True, kw_only=True)
class EmulatedCounters(BoardCounters):
    """Pages erased and half-words programmed."""

    flash_erases: int = 0
    flash_programs: int = 0
