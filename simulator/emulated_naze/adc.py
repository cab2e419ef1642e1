# SPDX-License-Identifier: GPL-3.0-or-later
"""The analog-digital converter in continuous mode with DMA: how the firmware measures its battery (section 11)."""

from collections.abc import Callable

from simulator.emulated_naze.bus import Registers
from simulator.emulated_naze.clock import Alarm, Clock
from simulator.emulated_naze.dma import DmaChannel

_SR, _CR2, _SQR1, _DR = 0x00, 0x08, 0x2C, 0x4C
_ON, _CONTINUOUS, _CALIBRATE, _RESET_CALIBRATION, _DMA, _START = 1, 2, 4, 8, 1 << 8, 1 << 22
_END_OF_CONVERSION = 2
#: Far slower than the real converter, to save CPU time: the firmware reads only the latest value.
_SCAN_NS = 1_000_000


class Adc(Registers):
    """`sample` measures a channel: 0 to 4095. Calibrations take no time."""

    def __init__(self, clock: Clock, dma: DmaChannel, sample: Callable[[], int]) -> None:
        super().__init__()
        self._dma = dma
        self._sample = sample
        self._scan_end = Alarm(clock, self._scan)

    def reset(self) -> None:
        super().reset()
        self._scan_end.cancel()

    def write(self, offset: int, value: int) -> None:
        if offset == _CR2:
            if value & _ON and value & _START and not self._scan_end.is_set:
                self._scan_end.set_in(_SCAN_NS)
            value &= ~(_CALIBRATE | _RESET_CALIBRATION | _START)
        super().write(offset, value)

    def _scan(self) -> None:
        control = self.words.get(_CR2, 0)
        for _ in range((self.words.get(_SQR1, 0) >> 20 & 15) + 1):
            self.words[_DR] = self._sample()
            if control & _DMA:
                self._dma.put(self.words[_DR])
        self.words[_SR] = self.words.get(_SR, 0) | _END_OF_CONVERSION
        if control & _CONTINUOUS and control & _ON:
            self._scan_end.set_in(_SCAN_NS)
