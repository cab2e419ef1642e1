# SPDX-License-Identifier: GPL-3.0-or-later
"""Flight controllers that must behave identically: the firmware's C core and the simulated Naze."""

from typing import Protocol

from simulator.board.flash import ERASED, NorFlash, PowerCutError
from simulator.board.options import Faults, SimOptions
from simulator.naze.compiled_core import load_core
from simulator.naze.mission_commands import MissionCommands
from simulator.naze.mission_slots import StoredConfig, flash_size
from simulator.naze.missions import Board, BootMissions
from tests.support.c_core import PowerCut, library


class Device(Protocol):
    """A flight controller without its serial port."""

    def request(self, command: int, payload: bytes) -> bytes | None:
        """Return the reply's payload; None if the command does not belong to the extension. PowerCut."""

    def advance(self, milliseconds: int) -> None: ...

    def arm(self, armed: bool) -> None: ...

    def set_busy(self, busy: bool) -> None:
        """Schedule a write of the configuration, or let it finish."""

    def power_cycle(self) -> None: ...

    def cut_power_at(self, operation: int) -> None:
        """Cut the power within the n-th flash operation from now on; 0: never."""

    def fail_at(self, operation: int) -> None:
        """Let the n-th flash operation from now on fail; 0: none."""

    @property
    def list(self) -> bytes:
        """The records that the firmware uses."""


class Simulated:
    """The simulated Naze's mission extension, with the interface of the C core."""

    def __init__(self, boot_missions: BootMissions) -> None:
        self._boot_missions = boot_missions
        self._options = SimOptions()
        self._faults = Faults()
        size = flash_size(self._options)
        self._flash = NorFlash(memoryview(bytearray((ERASED,)) * size), self._faults)
        # The configuration has separate flash, so that faults meant for the list do not hit it.
        config_flash = NorFlash(memoryview(bytearray((ERASED,)) * size), Faults())
        self._config = StoredConfig(config_flash, self._options)
        self.power_cycle()

    def request(self, command: int, payload: bytes) -> bytes | None:
        try:
            return self._missions.answer(command, payload, self._now)
        except PowerCutError:
            raise PowerCut from None

    def advance(self, milliseconds: int) -> None:
        self._now += milliseconds / 1000
        due = self._board.config_write_due
        if due is not None and not self._board.armed and self._now >= due:
            self._config.erase()
            self._config.program(self._board.wp_radius_cm)
            self._board.config_write_due = None

    def arm(self, armed: bool) -> None:
        self._board.armed = armed
        self._missions.drop_stale(self._now)  # like the main loop

    def set_busy(self, busy: bool) -> None:
        self._faults.busy = busy

    def power_cycle(self) -> None:
        self._now = 0.0
        self._faults.busy = False
        self.cut_power_at(0)
        self.fail_at(0)
        self._board = Board(self._options, self._faults, self._config.load())
        self._missions = self._boot_missions(self._flash, self._board)

    def cut_power_at(self, operation: int) -> None:
        self._faults.power_cut_at_flash_operation = operation

    def fail_at(self, operation: int) -> None:
        assert operation in (0, 1), "the simulated flash lets the next operations fail, not a later one"
        self._faults.flash_failures = operation

    @property
    def list(self) -> bytes:
        return self._missions.stored


def model() -> Simulated:
    """The simulated Naze with its own model."""
    return Simulated(MissionCommands)


def simulated_core() -> Simulated:
    """The simulated Naze with the compiled core."""
    return Simulated(load_core(library()))
