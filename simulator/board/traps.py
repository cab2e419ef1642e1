# SPDX-License-Identifier: GPL-3.0-or-later
"""Bytes that Harakiri acts on outside of any protocol (serialCom): entering the CLI, or a reset."""

from enum import Enum, auto

from protocols.msp.frame import HAZARDS, RUN_LENGTH

_CARRIAGE_RETURN, _NUMBER_SIGN, _LETTER_R = 0x0D, 0x23, 0x52


class Trap(Enum):
    """The effect of a run of bytes."""

    CLI = auto()
    RESET = auto()


class TrapCounters:
    """The firmware's three counters. Those for AUTOSENSE keep their value outside of it."""

    def __init__(self) -> None:
        self.clear()

    def clear(self) -> None:
        """Start counting again."""
        self._returns = self._number_signs = self._letters_r = 0

    def count(self, byte: int, autosense: bool, armed: bool) -> Trap | None:
        if autosense:
            self._number_signs = self._number_signs + 1 if byte == _NUMBER_SIGN else 0
            if self._number_signs >= RUN_LENGTH:
                return Trap.CLI
            self._letters_r = self._letters_r + 1 if byte == _LETTER_R else 0
            if self._letters_r >= RUN_LENGTH:
                return Trap.RESET
        self._returns = self._returns + 1 if byte == _CARRIAGE_RETURN and not armed else 0
        return Trap.CLI if self._returns >= RUN_LENGTH else None


class HazardWatch:
    """Counts the runs that a careful sender avoids, even if they had no effect: a run of any length counts once."""

    def __init__(self) -> None:
        self._byte, self._length = -1, 0

    def runs_in(self, data: bytes) -> int:
        """The number of runs that these bytes complete."""
        runs = 0
        for byte in data:
            self._length = self._length + 1 if byte == self._byte else 1
            self._byte = byte
            runs += self._length == RUN_LENGTH and byte in HAZARDS
        return runs
