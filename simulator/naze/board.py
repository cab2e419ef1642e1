# SPDX-License-Identifier: GPL-3.0-or-later
"""The simulated board: power, wires and flash around the firmware, without its own clock.

Time is passed in (seconds of any monotonic clock). Events between two calls are computed at their nominal times, so a
late call changes only the time at which bytes are collected.
"""

from math import inf

from protocols.msp.mission import RECORD_SIZE
from simulator.board.boot_loader import BootLoader
from simulator.board.flash import ERASED, NorFlash, PowerCutError
from simulator.board.flight import Craft
from simulator.board.options import Counters, Faults, SimOptions
from simulator.board.receive_ring import GATHER_SECONDS
from simulator.board.simulated_board import Power, SimulatedBoard
from simulator.naze.firmware import Firmware, Protocol, ResetError
from simulator.naze.mission_commands import MissionCommands
from simulator.naze.mission_slots import StoredConfig, flash_size
from simulator.naze.missions import Board, BootMissions
from simulator.naze.uart import Uart
from simulator.naze.whole_flash import WholeFlash


class SimulatedNaze(SimulatedBoard):
    """A Naze32 with Harakiri.

    `memory` is the flash chip, of `flash_size(options)` bytes. Without it the board has its own blank one.
    `boot_missions` makes the mission extension, at every boot.
    """

    faults: Faults
    counters: Counters

    def __init__(
        self,
        options: SimOptions | None = None,
        faults: Faults | None = None,
        memory: memoryview | None = None,
        boot_missions: BootMissions = MissionCommands,
    ) -> None:
        self.options = options or SimOptions()
        super().__init__(self.options.boot_ms / 1000, self.options.seed)
        self.faults = faults or Faults()
        self.counters = Counters()
        if memory is None:
            memory = memoryview(bytearray((ERASED,)) * flash_size(self.options))
        self._flash = NorFlash(memory, self.faults)
        self._whole_flash = WholeFlash(self._flash, self.faults)
        self._boot_loader: BootLoader | None = None
        self._boot_loader_sent = b""
        self._boot_missions = boot_missions
        self._uart = Uart(self.options.baud, self.counters, self.options.tree.value)
        self._boots_at = 0.0
        # None while the board boots or is without power.
        self._firmware: Firmware | None = None

    @property
    def baud(self) -> int:
        return self._uart.baud

    @property
    def protocol(self) -> Protocol | None:
        return self._firmware.protocol if self._firmware else None

    @property
    def armed(self) -> bool:
        return self._firmware is not None and self._firmware.armed

    def truth(self, now: float) -> Craft | None:
        self._run_until(now)
        return self._firmware.craft_at(now) if self._firmware else None

    @property
    def stored(self) -> bytes:
        """The valid mission records in flash, as the next boot would load them."""
        if not (self.faults.extension or StoredConfig(self._flash, self.options).is_valid):
            return b""
        return self._boot_missions(self._flash, Board(self.options, self.faults, self.options.wp_radius_cm)).stored

    @property
    def stored_records(self) -> list[bytes]:
        stored = self.stored
        return [stored[at : at + RECORD_SIZE] for at in range(0, len(stored), RECORD_SIZE)]

    @property
    def flash_contents(self) -> bytes:
        """The whole chip's flash, with a stand-in for the program."""
        return self._whole_flash.contents

    @property
    def flash_operations(self) -> int:
        """The number of erases and programs so far."""
        return self._flash.operations

    def next_wakeup(self, now: float) -> float:
        if self._boot_loader:
            return max(now, min(self._boot_loader.next_event(), self._uart.next_departure() or inf))
        # Late loops are computed at their nominal times, so close requests are handled in one call.
        work = self._next_event()
        if work is None:
            work = inf
        elif self._firmware and self._uart.last_arrival() > work:
            work = min(self._firmware.loop_at(self._uart.last_arrival()), work + GATHER_SECONDS)
        return max(now, min(work, self._uart.next_departure() or inf))

    def _next_event(self) -> float | None:
        """The next time that the CPU has work to do."""
        if self.faults.hang or self.power in (Power.OFF, Power.CRASHED, Power.BOOTLOADER):
            return None
        return self._firmware.next_loop() if self._firmware else self._boots_at

    def _run_until(self, now: float) -> None:
        if self._boot_loader:
            self._run_boot_loader(self._boot_loader, now)
        while (at := self._next_event()) is not None and at <= now:
            if self._firmware:
                self._run_loop(self._firmware, at)
            else:
                heard_ms = min(self.options.reception_ms, self.options.boot_ms)
                self._uart.discard_arrived(at + (heard_ms - self.options.boot_ms) / 1000)
                self._uart.keep_arrived(at)
                self._start_firmware(at)
        if self._firmware and self.faults.hang:
            self._firmware.hold(now)

    def _start_firmware(self, at: float) -> None:
        try:
            self._firmware = Firmware(
                self.options, self.faults, self.counters, self._uart, self._flash, self._boot_missions, at
            )
            self.power = Power.RUNNING
        except PowerCutError:
            self._cut_power()

    def _run_loop(self, firmware: Firmware, at: float) -> None:
        try:
            firmware.run_loop(at)
            if firmware.in_cli:
                self.power = Power.CLI
        except PowerCutError:
            self._cut_power()
        except ResetError as reset:
            self._reset(at)
            if reset.to_boot_loader:
                self._enter_boot_loader()

    def _run_boot_loader(self, boot_loader: BootLoader, now: float) -> None:
        try:
            boot_loader.run_until(now)
        except PowerCutError:
            self._cut_power()

    def _enter_boot_loader(self) -> None:
        self.counters.bootloader_entered = True
        self.power = Power.BOOTLOADER
        self._boot_loader = BootLoader(self._whole_flash, self._start_program)

    def _start_program(self, now: float) -> None:
        assert self._boot_loader
        self._boot_loader_sent = self._boot_loader.sent(now)
        self._boot(now)

    def _boot(self, now: float) -> None:
        self._firmware = self._boot_loader = None
        if self.faults.boot_pads:
            self._enter_boot_loader()
            return
        if not self._whole_flash.start():
            self.power = Power.CRASHED
            self.counters.crashes += 1
            return
        self.power = Power.BOOTING
        self._boots_at = now + self._boot_s
        self._uart.set_baud(self.options.baud, now)

    def _cut_power(self) -> None:
        self.power = Power.OFF
        self._firmware = self._boot_loader = None
        self._flash.take_busy_seconds()
        self._uart.power_off()

    def _hear(self, data: bytes, now: float) -> None:
        if self._boot_loader:
            self._boot_loader.receive(data, now)
        else:
            self._uart.receive(data, now)

    def _take_sent(self, now: float) -> bytes:
        boot_loader_sent, self._boot_loader_sent = self._boot_loader_sent, b""
        return boot_loader_sent + (self._boot_loader.sent(now) if self._boot_loader else self._uart.transmitted(now))
