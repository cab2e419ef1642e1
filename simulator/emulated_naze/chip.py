# SPDX-License-Identifier: GPL-3.0-or-later
"""The STM32F103CB of a Naze32 with the chips around it: memory map and wiring. Knows no real time."""

import random
import struct

from simulator.emulated_naze import bus, hmc5883l, mpu6050, ms5611, system_control
from simulator.emulated_naze.adc import Adc
from simulator.emulated_naze.bus import Bus, Registers
from simulator.emulated_naze.clock import Clock
from simulator.emulated_naze.cpu import Cpu
from simulator.emulated_naze.dma import Dma
from simulator.emulated_naze.flash_controller import FlashController
from simulator.emulated_naze.gpio import Gpio
from simulator.emulated_naze.i2c import I2c
from simulator.emulated_naze.image import FLASH_BASE, FLASH_SIZE
from simulator.emulated_naze.nvic import Irq, Nvic
from simulator.emulated_naze.pace import Pace
from simulator.emulated_naze.ppm import PpmReceiver
from simulator.emulated_naze.rcc import Rcc
from simulator.emulated_naze.switches import EmulatedCounters, EmulatedFaults
from simulator.emulated_naze.system_control import SystemControl
from simulator.emulated_naze.systick import SysTick
from simulator.emulated_naze.timer import Timer
from simulator.emulated_naze.usart import Usart

_RAM, _RAM_SIZE = 0x2000_0000, 0x5000
#: The system memory with ST's boot loader; the firmware needs only its entry.
_BOOT_LOADER, _BOOT_LOADER_SIZE = 0x1FFF_F000, 0x1000
#: Stack pointer and entry, which is an endless loop.
_BOOT_LOADER_CODE = struct.pack("<II24xH", _RAM + 0x200, _BOOT_LOADER + 0x21, 0xE7FE)
#: Unicorn maps memory in pages of this size.
_MAP_PAGE = 4096
#: The firmware takes the board for revision 5, which has another crystal, if pin PC15 is high.
_PORT_C_LEVELS = 0x7FFF
#: The battery's divider: 12.4 V.
_BATTERY = 1550
_REMEMBERED_ONLY = {
    "AFIO": 0x4001_0000,
    "EXTI": 0x4001_0400,
    "PWR": 0x4000_7000,
    "BKP": 0x4000_6C00,
    "SPI2": 0x4000_3800,
    "I2C1": 0x4000_5400,
    "ADC2": 0x4001_2800,
}


class Chip:
    """`flash` is the flash's contents; its first `program_size` bytes are the program.

    Flash that the firmware writes must not share a page (of `_MAP_PAGE`) with the program: those pages are read-only.
    """

    def __init__(
        self, flash: memoryview, program_size: int, faults: EmulatedFaults, counters: EmulatedCounters, seed: int
    ) -> None:
        self.flash = flash
        self._random = random.Random(seed)
        self.clock = Clock()
        self._pace = Pace(self.clock)
        self.nvic = nvic = Nvic()
        self.rcc = rcc = Rcc()
        systick = SysTick(self.clock, nvic, lambda: rcc.core_hz, self._pace.look_at_time)
        self.system = SystemControl(nvic, systick, self._request_reset)
        self.cpu = Cpu(self.clock, nvic, lambda: rcc.core_hz, self._vectors)
        self._bus = Bus(self._pace)
        self.dma = Dma(self.cpu, nvic)
        self.flash_controller = FlashController(flash, self._stall, self._random, faults, counters)
        self.usart1 = Usart(self.clock, nvic, Irq.USART1, lambda: rcc.apb2_hz, self.dma.channel(5), self.dma.channel(4))
        self.usart2 = Usart(self.clock, nvic, Irq.USART2, lambda: rcc.apb1_hz)
        self.i2c2 = I2c(
            self.clock,
            nvic,
            (Irq.I2C2_EVENT, Irq.I2C2_ERROR),
            lambda: rcc.apb1_hz,
            {
                mpu6050.ADDRESS: mpu6050.Mpu6050(self._random),
                hmc5883l.ADDRESS: hmc5883l.Hmc5883l(self._random),
                ms5611.ADDRESS: ms5611.Ms5611(self._random),
            },
        )
        # A timer's clock is twice that of its bus if the bus clock is divided.
        self.timer2 = Timer(self.clock, nvic, lambda: rcc.core_hz, Irq.TIM2)
        self.receiver = PpmReceiver(self.clock, self.timer2)
        self.wants_reset = False
        self._attach()
        self._map(program_size)

    def _attach(self) -> None:
        clock, nvic, rcc = self.clock, self.nvic, self.rcc
        blocks: dict[int, bus.Peripheral] = {
            0x4000_0000: self.timer2,
            0x4000_4400: self.usart2,
            0x4000_5800: self.i2c2,
            0x4001_0800: Gpio(),
            0x4001_0C00: Gpio(),
            0x4001_1000: Gpio(_PORT_C_LEVELS),
            0x4001_2400: Adc(clock, self.dma.channel(1), lambda: _BATTERY),
            0x4001_3800: self.usart1,
            0x4002_0000: self.dma,
            0x4002_1000: rcc,
            0x4002_2000: self.flash_controller,
        }
        for address in (0x4000_0400, 0x4000_0800, 0x4001_2C00):
            blocks[address] = Timer(clock, nvic, lambda: rcc.core_hz)
        for address in _REMEMBERED_ONLY.values():
            blocks[address] = Registers()
        for address, block in blocks.items():
            self._bus.attach(address, block)

    def _map(self, program_size: int) -> None:
        """Lay out the memory: the program's pages can be executed, the rest of the flash can be written."""
        cpu = self.cpu
        split = -(-program_size // _MAP_PAGE) * _MAP_PAGE
        cpu.map_memory(FLASH_BASE, split, bytes(self.flash[:split]))
        cpu.map_registers(
            FLASH_BASE + split,
            FLASH_SIZE - split,
            lambda offset, size: int.from_bytes(self.flash[split + offset : split + offset + size], "little"),
            lambda offset, size, value: self.flash_controller.program(split + offset, size, value),
        )
        cpu.map_memory(_RAM, _RAM_SIZE, is_ram=True)
        cpu.map_memory(_BOOT_LOADER, _BOOT_LOADER_SIZE, _BOOT_LOADER_CODE)
        cpu.map_registers(bus.BASE, bus.SIZE, self._bus.read, self._bus.write)
        cpu.map_registers(system_control.BASE, system_control.SIZE, self.system.read, self.system.write)

    # -- life ------------------------------------------------------------------------------------------------

    def power_on(self) -> None:
        """Begin with arbitrary RAM contents."""
        self.cpu.store(_RAM, self._random.randbytes(_RAM_SIZE))
        self.rcc.has_lost_power = True
        self.receiver.power_on()
        self.reset()

    def power_off(self) -> None:
        self._bus.reset()
        self.system.reset()
        self.usart1.power_off()
        self.usart2.power_off()
        self.receiver.power_off()

    def reset(self) -> None:
        """Reset as the firmware does: RAM keeps its contents."""
        self.wants_reset = False
        self._bus.reset()
        self.system.reset()
        self.cpu.reset()

    @property
    def is_in_boot_loader(self) -> bool:
        """True if the firmware has started the chip's own boot loader."""
        return self.cpu.pc - _BOOT_LOADER in range(_BOOT_LOADER_SIZE)

    def _vectors(self) -> int:
        return self.system.vector_table or FLASH_BASE

    def _stall(self, duration_ns: int) -> None:
        """Let time pass while the core, which runs from the flash, is stalled."""
        self._pace.spend(duration_ns)
        self.cpu.pause()

    def _request_reset(self) -> None:
        self.wants_reset = True
        self.cpu.pause()
