# SPDX-License-Identifier: GPL-3.0-or-later
"""The firmware's mission core, compiled for this machine, on a board in memory (firmware/sim/sim_board.h)."""

import ctypes
import subprocess
from ctypes import POINTER, c_bool, c_int, c_uint8, c_uint16, c_uint32, c_void_p
from fcntl import LOCK_EX, flock
from functools import cache
from pathlib import Path

from protocols.msp.mission import RECORD_SIZE
from simulator.naze.compiled_core import open_library

FIRMWARE = Path(__file__).parents[2] / "firmware"

_BUFFER_SIZE = 243
_CAPACITY = 146
_NO_COMMAND, _POWER_CUT = -1, -2

_SIGNATURES = {
    "sim_create": (c_void_p, []),
    "sim_destroy": (None, [c_void_p]),
    "sim_power_up": (None, [c_void_p]),
    "sim_cut_at": (None, [c_void_p, c_uint32, c_int]),
    "sim_fail_at": (None, [c_void_p, c_uint32, c_int]),
    "sim_request": (c_int, [c_void_p, c_uint8, POINTER(c_uint8), c_uint8]),
    "sim_advance": (None, [c_void_p, c_uint32]),
    "sim_arm": (None, [c_void_p, c_bool]),
    "sim_set_write_pending": (None, [c_void_p, c_bool]),
    "sim_config_intact": (c_bool, [c_void_p]),
    "sim_operations": (c_uint32, [c_void_p]),
    "sim_violations": (c_uint32, [c_void_p]),
    "sim_list": (c_uint16, [c_void_p, POINTER(c_uint8)]),
}


class PowerCut(Exception):
    """Power was lost during a flash operation; `power_cycle` restarts the board."""


@cache
def library() -> Path:
    """Build the shared library of the core and its board in memory, once for all workers."""
    with (FIRMWARE / "Makefile").open() as lock:
        flock(lock, LOCK_EX)
        subprocess.run(["make", "-s", "-C", FIRMWARE, "sim"], check=True)
    return FIRMWARE / "build" / "libnaze_mission.so"


@cache
def _functions() -> ctypes.CDLL:
    return open_library(library(), _SIGNATURES)


class CCore:
    """A board with new flash, powered up, disarmed."""

    def __init__(self) -> None:
        self._c = _functions()
        self._board = c_void_p(self._c.sim_create())

    def __del__(self) -> None:
        self._c.sim_destroy(self._board)

    def request(self, command: int, payload: bytes) -> bytes | None:
        """Return the reply's payload; None if the core does not know the command. PowerCut."""
        buffer = (c_uint8 * _BUFFER_SIZE)(*payload)
        length = self._c.sim_request(self._board, command, buffer, len(payload))
        if length == _POWER_CUT:
            raise PowerCut
        return None if length == _NO_COMMAND else bytes(buffer[:length])

    def advance(self, milliseconds: int) -> None:
        self._c.sim_advance(self._board, milliseconds)

    def arm(self, armed: bool) -> None:
        self._c.sim_arm(self._board, armed)

    def set_busy(self, busy: bool) -> None:
        """Schedule a write of the configuration, or let it finish."""
        self._c.sim_set_write_pending(self._board, busy)

    def power_cycle(self) -> None:
        """Switch off and on; only the flash and gps_wp_radius are kept."""
        self._c.sim_power_up(self._board)

    def cut_power_at(self, operation: int) -> None:
        """Cut the power within the n-th flash operation from now on; 0: never."""
        self._c.sim_cut_at(self._board, operation, 1)

    def fail_at(self, operation: int) -> None:
        """Let the n-th flash operation from now on fail; 0: none."""
        self._c.sim_fail_at(self._board, operation, 0)

    @property
    def list(self) -> bytes:
        """The records that the firmware around the core holds in RAM."""
        buffer = (c_uint8 * (_CAPACITY * RECORD_SIZE))()
        return bytes(buffer[: self._c.sim_list(self._board, buffer) * RECORD_SIZE])

    @property
    def is_intact(self) -> bool:
        """True if every flash operation was allowed and the configuration is untouched."""
        return bool(self._c.sim_config_intact(self._board)) and self._c.sim_violations(self._board) == 0
