# SPDX-License-Identifier: GPL-3.0-or-later
"""The interface between a simulated MSP board and the firmware: INAV, MultiWii, and those with telemetry only."""

from abc import ABC, abstractmethod
from collections.abc import Callable
from dataclasses import dataclass

from simulator.board.flight import Craft, FlightState
from simulator.board.msp_options import MspOptions
from simulator.board.options import Counters, Faults

_STEP_S = 0.05


class CrashError(Exception):
    """The firmware accessed invalid memory: the board is dead until a power cycle."""


@dataclass(frozen=True, slots=True)
class PortHabits:
    """The serial behaviour of a firmware.

    `buffer_size`: the largest payload. `cli_guard_s`: the silence after a '#' that opens the CLI; None without a CLI.
    `obeys_r`: an 'R' restarts it into its bootloader. `writes_first`: commands whose replies wait until
    the EEPROM is written. `speaks_v2`: it also understands MSP v2. `reads_buffer`: its handlers get the whole receive
    buffer, and what earlier requests left in it, because they read without regard to the payload's size.
    """

    buffer_size: int
    cli_guard_s: float | None = None
    obeys_r: bool = False
    writes_first: frozenset[int] = frozenset()
    speaks_v2: bool = False
    reads_buffer: bool = False


@dataclass(frozen=True, slots=True)
class Boot:
    """The inputs of a firmware at boot. `now` in seconds."""

    options: MspOptions
    faults: Faults
    counters: Counters
    eeprom: memoryview
    now: float


class MspFirmware(ABC):
    """The firmware from one boot to the next: a new object is a reset. Times are seconds and never go back.

    The bits of `faults.boxes` are in the order of MSP_BOXIDS.
    """

    habits: PortHabits

    def __init__(self, boot: Boot) -> None:
        self._options, self._faults, self._counters = boot.options, boot.faults, boot.counters
        self._clock = boot.now
        self._busy = 0.0
        #: True if the craft is armed.
        self.armed = False
        self._home: tuple[int, int] | None = None

    @property
    def stored(self) -> list[bytes]:
        """The waypoints that survive a reset, each in the firmware's own format."""
        return []

    @abstractmethod
    def follow_pilot(self, now: float) -> None:
        """Fly until `now` and follow the pilot's switches. CrashError."""

    @abstractmethod
    def answer(self, command: int, payload: bytes, now: float) -> bytes | None:
        """The reply frame, or None for silence."""

    def take_busy_seconds(self) -> float:
        """How long the firmware has been blocked since the last call."""
        busy, self._busy = self._busy, 0.0
        return busy

    def craft_at(self, now: float) -> Craft:
        """The sensor values."""
        self._fly_until(now)
        return Craft(self._state(), self.armed, self._flags(), self._home)

    def _fly_until(self, now: float) -> None:
        if not self.armed:
            self._clock = now
        while self._clock + _STEP_S <= now:
            self._clock += _STEP_S
            self._fly(_STEP_S)

    @abstractmethod
    def _fly(self, seconds: float) -> None:
        """Let the armed craft move. CrashError."""

    @abstractmethod
    def _state(self) -> FlightState:
        """The flight's current state."""

    @abstractmethod
    def _flags(self) -> int:
        """The modes in MSP_STATUS."""


BootFirmware = Callable[[Boot], MspFirmware]
