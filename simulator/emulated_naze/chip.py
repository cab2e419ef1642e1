# SPDX-License-Identifier: GPL-3.0-or-later
"""The STM32F103CB of a Naze32 with the chips around it: wiring and memory. Its time passes only in calls."""

import ctypes
import random
from collections.abc import Mapping
from typing import Protocol
from weakref import finalize

from protocols.firmware_image import FLASH_BASE, FLASH_SIZE
from simulator.emulated_naze import hmc5883l, mpu6050, ms5611
from simulator.emulated_naze.bus import Bus, Registers
from simulator.emulated_naze.flash_controller import FlashController
from simulator.emulated_naze.native_chip import Outside, load_native_chip
from simulator.emulated_naze.rcc import Rcc
from simulator.emulated_naze.switches import EmulatedCounters, EmulatedFaults

RAM_BASE, RAM_SIZE = 0x2000_0000, 0x5000
#: The battery's divider: 12.4 V.
_BATTERY = 1550
_STORED_ONLY = {
    "AFIO": 0x4001_0000,
    "EXTI": 0x4001_0400,
    "PWR": 0x4000_7000,
    "BKP": 0x4000_6C00,
    "SPI2": 0x4000_3800,
    "I2C1": 0x4000_5400,
    "ADC2": 0x4001_2800,
}
# Timer and offset of the compare register of each motor's pin, in the order of the firmware's quad X: rear right, front
# right, rear left, front left.
_MOTOR_PINS = ((3, 0x34), (3, 0x40), (2, 0x34), (2, 0x38))
_MOST_SENT = 4096


class CpuFaultError(Exception):
    """The code caused a fault exception; one sentence."""


class I2cDevice(Protocol):
    """A chip on the bus that always acknowledges."""

    def begin(self, is_read: bool) -> None:
        """Handle being addressed, for reading or writing."""

    def read(self) -> int:
        """Return the next byte."""

    def write(self, byte: int) -> None:
        """Receive a byte."""


class Chip:
    """`flash` is the flash's contents. The first `program_size` bytes are the program. NativeChipError.

    Flash that the firmware writes must not share a page of 4 KB with the program: those pages are read-only. `devices`
    are the chips on the I2C bus by address. Without them the board is level and still.
    """

    def __init__(
        self,
        flash: memoryview,
        program_size: int,
        faults: EmulatedFaults,
        counters: EmulatedCounters,
        seed: int,
        devices: Mapping[int, I2cDevice] | None = None,
    ) -> None:
        self._random = random.Random(seed)
        self._library = load_native_chip()
        self._devices = devices or {
            mpu6050.ADDRESS: mpu6050.Mpu6050(self._random),
            hmc5883l.ADDRESS: hmc5883l.Hmc5883l(self._random),
            ms5611.ADDRESS: ms5611.Ms5611(self._random),
        }
        self._addressed: I2cDevice = next(iter(self._devices.values()))
        self._rcc = Rcc()
        self.flash_controller = FlashController(flash, self._stall, self._random, faults, counters)
        self._bus = Bus(self._rcc, self.flash_controller, {at: Registers() for at in _STORED_ONLY.values()})
        self._flash = (ctypes.c_uint8 * FLASH_SIZE).from_buffer(flash)
        types = dict(Outside._fields_)
        self._outside = Outside(
            types["read"](self._bus.read),
            types["write"](self._write),
            types["program"](self.flash_controller.program),
            types["i2c_begin"](self._begin),
            types["i2c_read"](self._read_device),
            types["i2c_write"](self._write_device),
        )
        self._native = self._library.chip_new(self._flash, program_size, self._outside)
        if not self._native:
            raise CpuFaultError("Unicorn cannot emulate a Cortex-M3 here")
        finalize(self, self._library.chip_delete, self._native)
        self._pins = self._native.contents
        self._ram = (ctypes.c_uint8 * RAM_SIZE).from_address(self._library.chip_ram(self._native))
        self._pins.battery = _BATTERY

    # -- memory ----------------------------------------------------------------------------------------------

    def load(self, address: int, size: int) -> bytes:
        """Bytes of RAM or flash."""
        if 0 <= address - RAM_BASE <= RAM_SIZE - size:
            return ctypes.string_at(ctypes.addressof(self._ram) + address - RAM_BASE, size)
        if 0 <= address - FLASH_BASE <= FLASH_SIZE - size:
            return ctypes.string_at(ctypes.addressof(self._flash) + address - FLASH_BASE, size)
        raise ValueError(f"no memory of {size} bytes at {address:#x}")

    def store(self, address: int, data: bytes) -> None:
        """Overwrite bytes of RAM."""
        if not 0 <= address - RAM_BASE <= RAM_SIZE - len(data):
            raise ValueError(f"no RAM of {len(data)} bytes at {address:#x}")
        ctypes.memmove(ctypes.addressof(self._ram) + address - RAM_BASE, data, len(data))

    # -- pins ------------------------------------------------------------------------------------------------

    def baud(self, usart: int) -> int:
        """The speed of a USART, 1 or 2: the nearest standard speed within the tolerance of a receiver."""
        return int(self._library.chip_baud(self._native, usart - 1))

    def receive(self, usart: int, data: bytes) -> None:
        """Put bytes on a USART's RX wire, after those already there."""
        self._library.chip_receive(self._native, usart - 1, data, len(data))

    def take_sent(self, usart: int) -> bytes:
        """The bytes that have left a USART's TX pin since the last call."""
        sent = bytearray()
        buffer = (ctypes.c_uint8 * _MOST_SENT)()
        while count := self._library.chip_take_sent(self._native, usart - 1, buffer, _MOST_SENT):
            sent += bytes(buffer[:count])
        return bytes(sent)

    def set_receiver(self, channels_us: list[int]) -> None:
        """The radio's eight channels, in the order of the wire."""
        self._pins.receiver_us[:] = channels_us

    def set_battery(self, converted: int) -> None:
        """The converter's value of the battery's divider, 0 to 4095."""
        self._pins.battery = converted

    def motors_us(self) -> tuple[int, ...]:
        """The pulse length on each motor's pin, in the firmware's order, or 0 before the timers run."""
        return tuple(self._library.chip_timer_register(self._native, timer, at) for timer, at in _MOTOR_PINS)

    # -- power and time --------------------------------------------------------------------------------------

    @property
    def now_ns(self) -> int:
        """The chip's time, which also passes without power."""
        return int(self._library.chip_now_ns(self._native))

    def run(self, end_ns: int) -> None:
        """Execute until a time, a request for a reset, the boot loader, or `pause`. CpuFaultError."""
        if self._library.chip_run(self._native, end_ns):
            raise CpuFaultError(self._library.chip_error(self._native).decode())

    def advance(self, to_ns: int) -> None:
        """Let time pass while the core does not run."""
        self._library.chip_advance(self._native, to_ns)

    def pause(self) -> None:
        """End the current `run` after a few instructions."""
        self._pins.wants_pause = 1

    def power_on(self) -> None:
        """Begin with arbitrary RAM contents."""
        self._rcc.has_lost_power = True
        self._reset_outside()
        self._library.chip_power_on(self._native, self._random.randbytes(RAM_SIZE))

    def power_off(self) -> None:
        self._library.chip_power_off(self._native)
        self._reset_outside()

    def reset(self) -> None:
        """Reset as the firmware does: RAM keeps the contents."""
        self._reset_outside()
        self._library.chip_reset(self._native)

    @property
    def wants_reset(self) -> bool:
        return bool(self._pins.wants_reset)

    @property
    def is_in_boot_loader(self) -> bool:
        """True if the firmware has started the chip's own boot loader."""
        return bool(self._pins.is_in_boot_loader)

    def _reset_outside(self) -> None:
        self._bus.reset()
        self._set_clocks()

    def _set_clocks(self) -> None:
        pins, rcc = self._pins, self._rcc
        pins.core_hz, pins.apb1_hz, pins.apb2_hz = rcc.core_hz, rcc.apb1_hz, rcc.apb2_hz

    def _stall(self, duration_ns: int) -> None:
        """Let time pass while the core, which runs from the flash, is stalled."""
        self.advance(self.now_ns + duration_ns)

    def _write(self, offset: int, size: int, value: int) -> None:
        self._bus.write(offset, size, value)
        self._set_clocks()

    def _begin(self, address: int, is_read: bool) -> bool:
        device = self._devices.get(address)
        if device is None:
            return False
        self._addressed = device
        device.begin(is_read)
        return True

    def _read_device(self) -> int:
        return self._addressed.read()

    def _write_device(self, byte: int) -> None:
        self._addressed.write(byte)
