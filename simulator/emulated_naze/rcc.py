# SPDX-License-Identifier: GPL-3.0-or-later
"""Reset and clock control: the clocks of the core and the peripherals (section 7)."""

from simulator.emulated_naze.bus import Registers

_CR, _CFGR, _CSR = 0x00, 0x04, 0x24
_HSI_ON, _HSE_ON, _PLL_ON = 1, 1 << 16, 1 << 24
_HSI_HZ = 8_000_000
#: The crystal of the Naze32 up to revision 4.
_HSE_HZ = 8_000_000
_PLL_FROM_HSE, _PLL_HALVES_HSE = 1 << 16, 1 << 17
_HSI, _HSE, _PLL = 0, 1, 2
_POWER_ON_RESET, _SOFTWARE_RESET, _CLEAR_FLAGS = 1 << 27, 1 << 28, 1 << 24


class Rcc(Registers):
    """Oscillators are ready at once. Peripheral clock gates are ignored."""

    def __init__(self) -> None:
        super().__init__()
        self.has_lost_power = True

    def reset(self) -> None:
        self.words = {_CR: 0x83, _CSR: _POWER_ON_RESET if self.has_lost_power else _SOFTWARE_RESET}
        self.has_lost_power = False
        self._set_clocks()

    def read(self, offset: int) -> int:
        """Read a word. Each ready bit follows its enable bit."""
        value = super().read(offset)
        if offset == _CR:
            value |= (value & (_HSI_ON | _HSE_ON | _PLL_ON)) << 1
        elif offset == _CFGR:
            value = value & ~0b1100 | (value & 0b11) << 2
        return value

    def write(self, offset: int, value: int) -> None:
        if offset == _CSR and value & _CLEAR_FLAGS:
            value = 0
        super().write(offset, value)
        self._set_clocks()

    def _set_clocks(self) -> None:
        config = self.words.get(_CFGR, 0)
        pll = _HSI_HZ // 2
        if config & _PLL_FROM_HSE:
            pll = _HSE_HZ // 2 if config & _PLL_HALVES_HSE else _HSE_HZ
        pll *= min((config >> 18 & 15) + 2, 16)
        system = {_HSI: _HSI_HZ, _HSE: _HSE_HZ, _PLL: pll}.get(config & 0b11, _HSI_HZ)
        #: The core's clock, and those of the two peripheral buses.
        self.core_hz = system >> _ahb_shift(config >> 4 & 15)
        self.apb1_hz = self.core_hz >> _apb_shift(config >> 8 & 7)
        self.apb2_hz = self.core_hz >> _apb_shift(config >> 11 & 7)


def _ahb_shift(bits: int) -> int:
    """HPRE: divide by 2, 4, 8, 16, 64, 128, 256 or 512."""
    return 0 if bits < 8 else (1, 2, 3, 4, 6, 7, 8, 9)[bits - 8]


def _apb_shift(bits: int) -> int:
    """PPRE: divide by 2, 4, 8 or 16."""
    return 0 if bits < 4 else bits - 3
