# SPDX-License-Identifier: GPL-3.0-or-later
"""The common part of all boards: a power switch, a reset line, and a serial line that damages bytes.

No board has its own clock: `now` is in seconds of any monotonic clock.
"""

import random
from abc import ABC, abstractmethod
from enum import Enum, auto

from simulator.board.flight import Craft
from simulator.board.line import disturb
from simulator.board.options import BoardCounters, BoardFaults
from simulator.board.traps import HazardWatch


class Power(Enum):
    """The state of the CPU. CRASHED ends only by the reset line or a power cycle, BOOTLOADER also by the host."""

    OFF = auto()
    BOOTING = auto()
    RUNNING = auto()
    CLI = auto()
    CRASHED = auto()
    BOOTLOADER = auto()


class SimulatedBoard(ABC):
    """A board, created without power. `faults` may be changed and `counters` read at any time.

    `boot_s`: the time from power on to the first reply. `seed`: of the random faults.
    """

    faults: BoardFaults
    counters: BoardCounters

    def __init__(self, boot_s: float, seed: int) -> None:
        self.power = Power.OFF
        self._boot_s = boot_s
        self._random = random.Random(seed)
        self._hazards = HazardWatch()

    @property
    @abstractmethod
    def baud(self) -> int:
        """The current speed of the port."""

    @property
    @abstractmethod
    def armed(self) -> bool:
        """True if the craft is armed; `faults.armed` is only the pilot's request."""

    @property
    def protocol(self) -> Enum | None:
        """The firmware's current protocol, or None if it has only one, or does not run."""
        return None

    @property
    @abstractmethod
    def stored_records(self) -> list[bytes]:
        """The mission records that the next boot would load."""

    def truth(self, _: float) -> Craft | None:
        """The craft's true state, or None while no firmware runs, and for a board without a simulated flight."""
        return None

    def power_on(self, now: float) -> None:
        """Switch the power on; the board boots."""
        if self.power is Power.OFF:
            self._boot(now)

    def power_on_booted(self, now: float) -> None:
        """Switch the power on early enough that the board has booted by `now`."""
        self.power_on(now - self._boot_s)

    def power_off(self, now: float) -> None:
        """Cut the power: RAM and bytes in transit are lost, flash is kept."""
        self._run_until(now)
        self._cut_power()

    def reset(self, now: float) -> None:
        """Pull the CPU's reset line: it boots again."""
        self._run_until(now)
        if self.power is not Power.OFF:
            self._reset(now)

    def receive(self, data: bytes, now: float) -> None:
        """Put bytes on the wire to the RX pin. They arrive at line rate."""
        self._run_until(now)
        data = self._disturb(data)
        self.counters.hazard_runs += self._hazards.runs_in(data)
        if self.power is not Power.OFF:
            self._hear(data, now)

    def advance(self, now: float) -> bytes:
        """The bytes sent from the TX pin until `now` since the last call."""
        self._run_until(now)
        return self._disturb(self._take_sent(now))

    @abstractmethod
    def next_wakeup(self, now: float) -> float:
        """The time for the next call of `advance`, or infinity if nothing will happen by itself."""

    @abstractmethod
    def _boot(self, now: float) -> None:
        """Start booting, after power on or a reset."""

    @abstractmethod
    def _cut_power(self) -> None:
        """Lose everything but the flash."""

    @abstractmethod
    def _run_until(self, now: float) -> None:
        """Let time pass."""

    @abstractmethod
    def _hear(self, data: bytes, now: float) -> None:
        """Put bytes on the RX wire."""

    @abstractmethod
    def _take_sent(self, now: float) -> bytes:
        """The bytes on the TX wire since the last call."""

    def _reset(self, now: float) -> None:
        self.counters.resets += 1
        self._boot(now)

    def _disturb(self, data: bytes) -> bytes:
        return disturb(data, self.faults.lost_byte_rate, self.faults.bit_error_rate, self._random)
