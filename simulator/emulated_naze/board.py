# SPDX-License-Identifier: GPL-3.0-or-later
"""The emulated board on a bench: power, wires and a pilot around the chip, without a clock of its own.

Time is passed in (seconds of any monotonic clock), as to the simulated Naze.
"""

import logging
import random
from enum import Enum, auto
from math import inf

from simulator.emulated_naze.chip import Chip
from simulator.emulated_naze.cpu import CpuFaultError
from simulator.emulated_naze.harakiri_memory import HarakiriMemory, SpokenProtocol
from simulator.emulated_naze.image import FLASH_SIZE, Image
from simulator.emulated_naze.switches import EmulatedCounters, EmulatedFaults
from simulator.flight import Craft
from simulator.line import disturb
from simulator.traps import HazardWatch

#: From power on to the main loop, without a GPS module.
BOOT_S = 8.0
#: A client's bytes are taken and given so often.
_STEP_S = 0.002
_STICK_LOW_US, _STICK_HIGH_US = 1000, 2000

_log = logging.getLogger(__name__)


class EmulatedPower(Enum):
    """What the core is doing."""

    OFF = auto()
    RUNNING = auto()
    BOOT_LOADER = auto()
    CRASHED = auto()


class EmulatedNaze:
    """A Naze32 that runs `image`, made without power: see `power_on`.

    `faults` may be changed and `counters` read at any time. `flash` is the chip of 128 KB, whose program is replaced by
    the image and whose rest stays; without it the rest is blank. With `longest_step_s`, a caller who comes later than
    that finds the board's time to have stood still meanwhile: so a computer that is too slow gets a slow board.
    """

    def __init__(
        self,
        image: Image,
        faults: EmulatedFaults | None = None,
        flash: memoryview | None = None,
        *,
        seed: int = 0,
        longest_step_s: float = inf,
    ) -> None:
        self.faults = faults or EmulatedFaults()
        self.power = EmulatedPower.OFF
        if flash is None:
            flash = memoryview(bytearray(b"\xff" * FLASH_SIZE))
        flash[: len(image.program)] = image.program
        self.flash = flash
        self._chip = Chip(flash, len(image.program), seed)
        self._chip.flash_controller.on_power_cut = self._on_power_cut
        self._memory = HarakiriMemory(image, self._chip.cpu, flash)
        self._longest_step_s = longest_step_s
        # What the clock of the callers shows when that of the chip is at zero.
        self._offset_s = 0.0
        self._random = random.Random(seed)
        self._hazards = HazardWatch()
        self._counters = EmulatedCounters()
        self._lost_power = False

    # -- what can be seen ------------------------------------------------------------------------------------

    @property
    def baud(self) -> int:
        """The speed of the UART at this moment."""
        return self._chip.usart1.baud

    @property
    def armed(self) -> bool:
        """Whether the craft is armed, which `faults.armed` only wishes."""
        return self.power is EmulatedPower.RUNNING and self._memory.armed

    @property
    def protocol(self) -> SpokenProtocol | None:
        """What the firmware believes to be spoken; None while it does not run."""
        return self._memory.protocol if self.power is EmulatedPower.RUNNING else None

    @property
    def stored_records(self) -> list[bytes]:
        """The mission that outlives a power cut."""
        return self._memory.stored_records

    @property
    def counters(self) -> EmulatedCounters:
        """What has happened so far."""
        controller = self._chip.flash_controller
        self._counters.flash_erases, self._counters.flash_programs = controller.erases, controller.programs
        return self._counters

    @property
    def flash_operations(self) -> int:
        """Erases and programs so far."""
        return self._chip.flash_controller.operations

    def peek(self, address: int, size: int) -> bytes:
        """Bytes of the chip's RAM, as a debugger would see them."""
        return self._chip.cpu.load(address, size)

    def poke(self, address: int, data: bytes) -> None:
        """Overwrite bytes of the chip's RAM, as a debugger would."""
        self._chip.cpu.store(address, data)

    def truth(self, _: float) -> Craft | None:
        """None: the board lies on a bench."""
        return None

    # -- what can be done ------------------------------------------------------------------------------------

    def power_on(self, now: float) -> None:
        """Supply the board; it boots."""
        if self.power is EmulatedPower.OFF:
            self._offset_s = now - self._chip.clock.now_ns / 1e9
            self._chip.power_on()
            self.power = EmulatedPower.RUNNING

    def power_on_booted(self, now: float) -> None:
        """Supply the board as if long enough ago that it has booted by `now`."""
        self.power_on(now - BOOT_S)
        self._run_until(now)

    def power_off(self, now: float) -> None:
        """Cut the supply: RAM and everything under way is lost, flash stays as it is."""
        self._catch_up(now)
        self._cut_power()

    def reset(self, now: float) -> None:
        """Pull the chip's reset line: it boots again."""
        self._catch_up(now)
        if self.power is not EmulatedPower.OFF:
            self._reset()

    def receive(self, data: bytes, now: float) -> None:
        """Put bytes on the wire to the RX pin; they arrive at line rate."""
        self._catch_up(now)
        data = disturb(data, self.faults.lost_byte_rate, self.faults.bit_error_rate, self._random)
        self._counters.hazard_runs += self._hazards.runs_in(data)
        if self.power is not EmulatedPower.OFF:
            self._chip.usart1.receive(data)

    def advance(self, now: float) -> bytes:
        """Return the bytes that have left the TX pin until `now` and were not returned before."""
        self._catch_up(now)
        sent = bytes(self._chip.usart1.sent)
        self._chip.usart1.sent.clear()
        return disturb(sent, self.faults.lost_byte_rate, self.faults.bit_error_rate, self._random)

    def next_wakeup(self, now: float) -> float:
        """Tell when it is next worth calling `advance`; infinity if nothing will happen by itself."""
        return now + _STEP_S if self.power is EmulatedPower.RUNNING else inf

    # -- time ------------------------------------------------------------------------------------------------

    def _catch_up(self, now: float) -> None:
        late_s = now - self._offset_s - self._chip.clock.now_ns / 1e9 - self._longest_step_s
        if late_s > 0:
            self._offset_s += late_s
        self._run_until(now)

    def _run_until(self, now: float) -> None:
        """Run the core up to a moment, unless something stops it."""
        chip, end_ns = self._chip, int((now - self._offset_s) * 1e9)
        self._move_sticks()
        self._set_flash_faults()
        while self.power is EmulatedPower.RUNNING and not self.faults.hang and chip.clock.now_ns < end_ns:
            try:
                chip.cpu.run_until(end_ns, self._goes_on)
            except CpuFaultError as error:
                _log.error("the core has crashed: %s", error)
                self._counters.crashes += 1
                self.power = EmulatedPower.CRASHED
            if self._lost_power:
                self._cut_power()
            elif chip.wants_reset:
                self._reset()
            elif chip.is_in_boot_loader:
                self._counters.bootloader_entered = True
                self.power = EmulatedPower.BOOT_LOADER
        if self.power is not EmulatedPower.OFF:
            chip.clock.advance(end_ns)
        self._get_flash_faults()

    def _goes_on(self) -> bool:
        chip = self._chip
        return not (self._lost_power or chip.wants_reset or chip.is_in_boot_loader)

    def _on_power_cut(self) -> None:
        self._lost_power = True
        self._chip.cpu.pause()

    def _reset(self) -> None:
        self._counters.resets += 1
        self._chip.reset()
        self.power = EmulatedPower.RUNNING

    def _cut_power(self) -> None:
        self._lost_power = False
        self._chip.power_off()
        self.power = EmulatedPower.OFF

    def _set_flash_faults(self) -> None:
        controller, faults = self._chip.flash_controller, self.faults
        controller.cut_after, controller.failures = faults.power_cut_at_flash_operation, faults.flash_failures

    def _get_flash_faults(self) -> None:
        controller, faults = self._chip.flash_controller, self.faults
        faults.power_cut_at_flash_operation, faults.flash_failures = controller.cut_after, controller.failures

    def _move_sticks(self) -> None:
        faults = self.faults
        throttle, yaw = faults.throttle, faults.yaw
        if self.power is EmulatedPower.RUNNING and faults.armed != self.armed:
            throttle, yaw = _STICK_LOW_US, _STICK_HIGH_US if faults.armed else _STICK_LOW_US
        switches = (faults.aux1, faults.aux2, faults.aux3, faults.aux4)
        self._chip.receiver.channels[:] = (faults.roll, faults.pitch, throttle, yaw, *switches)
