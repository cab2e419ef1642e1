# SPDX-License-Identifier: GPL-3.0-or-later
"""The simulated board: power, wires and flash around the firmware, without a clock of its own.

Time is passed in (seconds of any monotonic clock). Events between two calls are computed at their nominal times, so a
late call changes only the time at which bytes are collected.
"""

import random
from enum import Enum, auto
from math import inf

from protocols.wp_record import RECORD_SIZE
from simulator.firmware import Firmware, Protocol, ResetError
from simulator.flash import ERASED, NorFlash, PowerCutError
from simulator.flight import Craft
from simulator.line import disturb
from simulator.mission_commands import MissionCommands
from simulator.mission_slots import flash_size
from simulator.missions import Board, BootMissions
from simulator.options import Counters, Faults, SimOptions
from simulator.traps import HazardWatch
from simulator.uart import GATHER_SECONDS, Uart


class Power(Enum):
    """The state of the CPU."""

    OFF = auto()
    BOOTING = auto()
    RUNNING = auto()
    CLI = auto()


class SimulatedNaze:
    """A Naze32 with Harakiri, created without power: see `power_on`.

    `faults` may be changed and `counters` read at any time. `memory` is the flash chip, of `flash_size(options)` bytes;
    without it the board has a blank one of its own. `boot_missions` makes the mission extension, at every boot.
    """

    def __init__(
        self,
        options: SimOptions | None = None,
        faults: Faults | None = None,
        memory: memoryview | None = None,
        boot_missions: BootMissions = MissionCommands,
    ) -> None:
        self.options = options or SimOptions()
        self.faults = faults or Faults()
        self.counters = Counters()
        if memory is None:
            memory = memoryview(bytearray((ERASED,)) * flash_size(self.options))
        self._flash = NorFlash(memory, self.faults)
        self._boot_missions = boot_missions
        self._uart = Uart(self.options.baud, self.counters, self.options.tree.value)
        self._random = random.Random(self.options.seed)
        self._hazards = HazardWatch()
        # No firmware while the board boots, and no boot time while it has no power.
        self._boots_at: float | None = None
        self._firmware: Firmware | None = None

    @property
    def baud(self) -> int:
        """The current speed of the UART."""
        return self._uart.baud

    @property
    def power(self) -> Power:
        """The state of the CPU."""
        if self._firmware:
            return Power.CLI if self._firmware.in_cli else Power.RUNNING
        return Power.OFF if self._boots_at is None else Power.BOOTING

    @property
    def protocol(self) -> Protocol | None:
        """The firmware's present protocol; None while no firmware runs."""
        return self._firmware.protocol if self._firmware else None

    @property
    def armed(self) -> bool:
        """True if the craft is armed; `faults.armed` is only the pilot's request."""
        return self._firmware is not None and self._firmware.armed

    def truth(self, now: float) -> Craft | None:
        """The craft's true state, which only the simulation knows; None while no firmware runs."""
        self._run_until(now)
        return self._firmware.craft_at(now) if self._firmware else None

    @property
    def stored(self) -> bytes:
        """The valid mission records in flash, as the next boot would load them."""
        return self._boot_missions(self._flash, Board(self.options, self.faults, self.options.wp_radius_cm)).stored

    @property
    def stored_records(self) -> list[bytes]:
        """The same, record by record."""
        stored = self.stored
        return [stored[at : at + RECORD_SIZE] for at in range(0, len(stored), RECORD_SIZE)]

    @property
    def flash_operations(self) -> int:
        """The number of erases and programs so far."""
        return self._flash.operations

    def power_on(self, now: float) -> None:
        """Switch the power on; the board boots."""
        if self.power is Power.OFF:
            self._boot(now)

    def power_on_booted(self, now: float) -> None:
        """Switch the power on early enough that the board has booted by `now`."""
        self.power_on(now - self.options.boot_ms / 1000)

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
        """Put bytes on the wire to the RX pin; they arrive at line rate."""
        self._run_until(now)
        data = self._disturb(data)
        self.counters.hazard_runs += self._hazards.runs_in(data)
        if self.power is not Power.OFF:
            self._uart.receive(data, now)

    def advance(self, now: float) -> bytes:
        """The bytes sent from the TX pin until `now` since the last call."""
        self._run_until(now)
        return self._disturb(self._uart.transmitted(now))

    def next_wakeup(self, now: float) -> float:
        """The time for the next call of `advance`; infinity if nothing will happen by itself.

        Late loops are computed at their nominal times, so close requests are handled in one call.
        """
        work = self._next_event()
        if work is None:
            work = inf
        elif self._firmware and self._uart.last_arrival() > work:
            work = min(self._firmware.loop_at(self._uart.last_arrival()), work + GATHER_SECONDS)
        return max(now, min(work, self._uart.next_departure() or inf))

    def _next_event(self) -> float | None:
        """The next time that the CPU has work to do."""
        if self.faults.hang:
            return None
        return self._firmware.next_loop() if self._firmware else self._boots_at

    def _run_until(self, now: float) -> None:
        while (at := self._next_event()) is not None and at <= now:
            if self._firmware:
                self._run_loop(self._firmware, at)
            else:
                heard_ms = min(self.options.reception_ms, self.options.boot_ms)
                self._uart.discard_arrived(at + (heard_ms - self.options.boot_ms) / 1000)
                self._uart.keep_arrived(at)
                self._firmware = Firmware(
                    self.options, self.faults, self.counters, self._uart, self._flash, self._boot_missions, at
                )
        if self._firmware and self.faults.hang:
            self._firmware.hold(now)

    def _run_loop(self, firmware: Firmware, at: float) -> None:
        try:
            firmware.run_loop(at)
        except PowerCutError:
            self._cut_power()
        except ResetError:
            self._reset(at)

    def _reset(self, now: float) -> None:
        self.counters.resets += 1
        self._boot(now)

    def _boot(self, now: float) -> None:
        self._firmware = None
        self._boots_at = now + self.options.boot_ms / 1000
        self._uart.set_baud(self.options.baud, now)

    def _cut_power(self) -> None:
        self._firmware = self._boots_at = None
        self._flash.take_busy_seconds()
        self._uart.power_off()

    def _disturb(self, data: bytes) -> bytes:
        return disturb(data, self.faults.lost_byte_rate, self.faults.bit_error_rate, self._random)
