# SPDX-License-Identifier: GPL-3.0-or-later
"""The emulated board on a bench: power, wires and a pilot around the chip.

Time is passed in (seconds of any monotonic clock), as for the simulated Naze.
"""

import logging
from collections.abc import Callable
from math import inf

from protocols.firmware_image import FLASH_SIZE, PROGRAM_END
from simulator.board.boot_loader import BootLoader
from simulator.board.flash import PowerCutError
from simulator.board.simulated_board import Power, SimulatedBoard
from simulator.emulated_naze.chip import Chip, CpuFaultError
from simulator.emulated_naze.controlled_flash import ControlledFlash
from simulator.emulated_naze.harakiri_memory import HarakiriMemory, SpokenProtocol
from simulator.emulated_naze.image import Image
from simulator.emulated_naze.switches import EmulatedCounters, EmulatedFaults

#: From power on to the main loop, without a GPS module.
BOOT_S = 8.0
#: How often a client's bytes are exchanged.
_STEP_S = 0.002
_STICK_LOW_US, _STICK_HIGH_US = 1000, 2000
#: Between the defaults of esc_moff and esc_min.
_MOTORS_STOPPED_US = 1050
_BOOT_STEP_S = 0.25

_log = logging.getLogger(__name__)


class EmulatedNaze(SimulatedBoard):
    """A Naze32 that runs `image`, without a simulated flight: it lies on a bench.

    `flash` is the chip of 128 KB: the image replaces its program, and the rest is kept; without it the rest is blank.
    The board's time runs `tempo` times as fast as its callers'. Between two calls at most `longest_step_s` pass: a
    computer that is too slow gets a slow board.
    """

    faults: EmulatedFaults
    counters: EmulatedCounters

    def __init__(
        self,
        image: Image,
        faults: EmulatedFaults | None = None,
        flash: memoryview | None = None,
        *,
        seed: int = 0,
        longest_step_s: float = inf,
        tempo: float = 1.0,
    ) -> None:
        super().__init__(BOOT_S / tempo, seed)
        self.faults = faults or EmulatedFaults()
        if flash is None:
            flash = memoryview(bytearray(b"\xff" * FLASH_SIZE))
        flash[: len(image.program)] = image.program
        self.flash = flash
        self.counters = EmulatedCounters()
        self._image = image
        self._seed = seed
        self._chip = self._make_chip(len(image.program), seed)
        self._chip.flash_controller.on_power_cut = self._on_power_cut
        self._memory = HarakiriMemory(image, self._chip, flash)
        self._boot_loader: BootLoader | None = None
        self._boot_loader_sent = b""
        self._longest_step_s = longest_step_s
        self._ns_per_s = 1e9 * tempo
        # The callers' time when the chip's clock was zero.
        self._offset_s = 0.0
        self._lost_power = False
        self.on_boot: Callable[[float], None] = lambda _: None

    def _make_chip(self, program_size: int, seed: int) -> Chip:
        return Chip(self.flash, program_size, self.faults, self.counters, seed)

    # -- the state -------------------------------------------------------------------------------------------

    @property
    def baud(self) -> int:
        return self._chip.baud(1)

    @property
    def armed(self) -> bool:
        if self.power is not Power.RUNNING:
            return False
        armed = self._memory.armed
        return max(self._chip.motors_us()) > _MOTORS_STOPPED_US if armed is None else armed

    @property
    def protocol(self) -> SpokenProtocol | None:
        return self._memory.protocol if self.power is Power.RUNNING else None

    @property
    def stored_records(self) -> list[bytes]:
        return self._memory.stored_records

    @property
    def flash_operations(self) -> int:
        return self.counters.flash_erases + self.counters.flash_programs

    def peek(self, address: int, size: int) -> bytes:
        """Bytes of the chip's RAM, as a debugger would see them."""
        return self._chip.load(address, size)

    def poke(self, address: int, data: bytes) -> None:
        """Overwrite bytes of the chip's RAM, as a debugger would."""
        self._chip.store(address, data)

    # -- controls --------------------------------------------------------------------------------------------

    def power_on_booted(self, now: float) -> None:
        """Switch the power on and let the board boot at once. `on_boot` gets the progress, 0 to 1."""
        super().power_on_booted(now)
        begun = now - self._boot_s
        while begun < now:
            begun = min(begun + _BOOT_STEP_S, now)
            self._run_chip_until(begun)
            self.on_boot(1 - (now - begun) / self._boot_s)

    def next_wakeup(self, now: float) -> float:
        return now + _STEP_S if self.power in (Power.RUNNING, Power.BOOTLOADER) else inf

    # -- time ------------------------------------------------------------------------------------------------

    def _run_until(self, now: float) -> None:
        late_s = now - self._seconds(self._chip.now_ns) - self._longest_step_s
        if late_s > 0:
            self._offset_s += late_s
        self._run_chip_until(now)

    def _run_chip_until(self, now: float) -> None:
        """Run the core up to a time, unless something stops it."""
        chip, end_ns = self._chip, self._chip_ns(now)
        self._move_sticks()
        while self.power is Power.RUNNING and not self.faults.hang and chip.now_ns < end_ns:
            try:
                chip.run(end_ns)
            except CpuFaultError as error:
                _log.error("the core has crashed: %s", error)
                self.counters.crashes += 1
                self.power = Power.CRASHED
            if self._lost_power:
                self._cut_power()
            elif chip.wants_reset:
                self._reset(now)
            elif chip.is_in_boot_loader:
                self._enter_boot_loader()
        if self._boot_loader:
            self._run_boot_loader(self._boot_loader, now)
        elif self.power is not Power.OFF:
            chip.advance(end_ns)

    def _chip_ns(self, now: float) -> int:
        """The chip's time at a caller's time, and back."""
        return round((now - self._offset_s) * self._ns_per_s)

    def _seconds(self, chip_ns: int) -> float:
        return chip_ns / self._ns_per_s + self._offset_s

    def _on_power_cut(self) -> None:
        self._lost_power = True
        self._chip.pause()

    def _boot(self, now: float) -> None:
        self._offset_s = now - self._chip.now_ns / self._ns_per_s
        self._chip.power_on()
        self._begin()

    def _begin(self) -> None:
        self.power = Power.RUNNING
        if self.faults.boot_pads:
            self._enter_boot_loader()

    def _reset(self, now: float) -> None:
        self.counters.resets += 1
        if self._boot_loader:
            self._leave_boot_loader()
            self._boot(now)
            return
        self._chip.reset()
        self._begin()

    def _cut_power(self) -> None:
        self._lost_power = False
        self._chip.power_off()
        self.power = Power.OFF
        if self._boot_loader:
            self._leave_boot_loader()

    def _hear(self, data: bytes, now: float) -> None:
        if self._boot_loader:
            self._boot_loader.receive(data, now)
        else:
            self._chip.receive(1, data)

    def _take_sent(self, now: float) -> bytes:
        boot_loader_sent, self._boot_loader_sent = self._boot_loader_sent, b""
        return boot_loader_sent + (self._boot_loader.sent(now) if self._boot_loader else self._chip.take_sent(1))

    # -- the chip's own boot loader ---------------------------------------------------------------------------

    def _enter_boot_loader(self) -> None:
        self.counters.bootloader_entered = True
        self.power = Power.BOOTLOADER
        flash = ControlledFlash(self._chip, self._chip_ns, lambda: self._lost_power)
        self._boot_loader = BootLoader(flash, self._start_program)

    def _run_boot_loader(self, boot_loader: BootLoader, now: float) -> None:
        try:
            boot_loader.run_until(now)
        except PowerCutError:
            self._cut_power()

    def _start_program(self, now: float) -> None:
        assert self._boot_loader is not None
        self._boot_loader_sent = self._boot_loader.sent(now)
        self._leave_boot_loader()
        self._boot(now)

    def _leave_boot_loader(self) -> None:
        """Replace the chip: the core holds a copy of the program, whose end may have changed."""
        self._boot_loader = None
        now_ns = self._chip.now_ns
        program = bytes(self.flash[:PROGRAM_END]).rstrip(b"\xff")
        self._chip = self._make_chip(len(program), self._seed)
        self._chip.advance(now_ns)
        self._chip.flash_controller.on_power_cut = self._on_power_cut
        image = self._image if program == self._image.program.rstrip(b"\xff") else Image(program)
        self._memory = HarakiriMemory(image, self._chip, self.flash)

    def _move_sticks(self) -> None:
        faults = self.faults
        throttle, yaw = faults.throttle, faults.yaw
        if self.power is Power.RUNNING and faults.armed != self.armed:
            throttle, yaw = _STICK_LOW_US, _STICK_HIGH_US if faults.armed else _STICK_LOW_US
        switches = (faults.aux1, faults.aux2, faults.aux3, faults.aux4)
        self._chip.set_receiver([faults.roll, faults.pitch, throttle, yaw, *switches])
