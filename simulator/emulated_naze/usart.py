# SPDX-License-Identifier: GPL-3.0-or-later
"""A USART: two wires at the speed of its baud rate register, served by the core or by DMA (section 27)."""

from collections import deque
from collections.abc import Callable

from simulator.emulated_naze.clock import Alarm, Clock
from simulator.emulated_naze.dma import DmaChannel
from simulator.emulated_naze.nvic import Nvic

_OVERRUN, _RECEIVED, _TRANSMITTED, _EMPTY = 1 << 3, 1 << 5, 1 << 6, 1 << 7
_RECEIVER, _TRANSMITTER, _RECEIVED_INTERRUPT, _EMPTY_INTERRUPT, _ENABLE = 1 << 2, 1 << 3, 1 << 5, 1 << 7, 1 << 13
_DMA_RECEIVES, _DMA_TRANSMITS = 1 << 6, 1 << 7
_BITS_PER_BYTE = 10
_STANDARD_BAUDS = (1200, 2400, 4800, 9600, 19200, 38400, 57600, 115200, 230400)
#: The tolerance of a receiver; a divider rarely gives an exact speed.
_TOLERANCE = 0.03


class Usart:
    """`bus_hz`: the clock of its bus. `receive_dma` and `transmit_dma`: its channels, if used."""

    def __init__(
        self,
        clock: Clock,
        nvic: Nvic,
        irq: int,
        bus_hz: Callable[[], int],
        receive_dma: DmaChannel | None = None,
        transmit_dma: DmaChannel | None = None,
    ) -> None:
        self._nvic = nvic
        self._irq = irq
        self._bus_hz = bus_hz
        self._receive_dma = receive_dma
        self._transmit_dma = transmit_dma
        #: The speed of the wires: the nearest standard speed within the tolerance.
        self.baud = 115200
        #: The bytes that have left the TX pin and were not collected yet.
        self.sent = bytearray()
        self._arriving: deque[int] = deque()
        if transmit_dma:
            transmit_dma.on_enable = self._load
        self._arrival = Alarm(clock, self._arrive)
        self._departure = Alarm(clock, self._depart)
        self.reset()

    def reset(self) -> None:
        """Disable it; bytes on the wire still arrive."""
        self._cr1 = self._cr3 = self._divider = 0
        self._status = _TRANSMITTED | _EMPTY
        self._data = 0
        # The byte being sent, and the next one.
        self._shift: int | None = None
        self._holding: int | None = None
        self._departure.cancel()

    def power_off(self) -> None:
        """Drop the bytes on the wires."""
        self.reset()
        self._arriving.clear()
        self._arrival.cancel()
        self.sent.clear()

    def receive(self, data: bytes) -> None:
        """Put bytes on the RX wire, behind those already there."""
        self._arriving += data
        if self._arriving and not self._arrival.is_set:
            self._arrival.set_in(self._byte_ns)

    # -- registers -------------------------------------------------------------------------------------------

    def read(self, offset: int) -> int:
        match offset:
            case 0x00:  # SR
                return self._status
            case 0x04:  # DR
                self._status &= ~(_RECEIVED | _OVERRUN)
                self._interrupt()
                return self._data
            case 0x08:  # BRR
                return self._divider
            case 0x0C:  # CR1
                return self._cr1
            case 0x14:  # CR3
                return self._cr3
        return 0

    def write(self, offset: int, value: int) -> None:
        match offset:
            case 0x00:  # SR
                self._status &= value | ~(_RECEIVED | _TRANSMITTED)
            case 0x04:  # DR
                self._send(value & 0xFF)
            case 0x08:  # BRR
                self._divider = value
                self._set_baud()
            case 0x0C:  # CR1
                self._cr1 = value
                self._load()
            case 0x14:  # CR3
                self._cr3 = value
                self._load()
        self._interrupt()

    def _set_baud(self) -> None:
        if self._divider:
            exact = self._bus_hz() / self._divider
            nearest = min(_STANDARD_BAUDS, key=lambda baud: abs(baud - exact))
            self.baud = nearest if abs(exact / nearest - 1) < _TOLERANCE else round(exact)

    @property
    def _byte_ns(self) -> int:
        return _BITS_PER_BYTE * 1_000_000_000 // self.baud

    def _interrupt(self) -> None:
        wanted = bool(self._cr1 & _RECEIVED_INTERRUPT and self._status & (_RECEIVED | _OVERRUN)) or bool(
            self._cr1 & _EMPTY_INTERRUPT and self._status & _EMPTY
        )
        self._nvic.set_line(self._irq, wanted and bool(self._cr1 & _ENABLE))

    # -- the RX wire -----------------------------------------------------------------------------------------

    def _arrive(self) -> None:
        byte = self._arriving.popleft()
        if self._arriving:
            self._arrival.set_in(self._byte_ns)
        if not (self._cr1 & _ENABLE and self._cr1 & _RECEIVER):
            return
        if self._cr3 & _DMA_RECEIVES and self._receive_dma and self._receive_dma.is_ready:
            self._receive_dma.put(byte)
            return
        if self._status & _RECEIVED:
            self._status |= _OVERRUN
        else:
            self._data = byte
            self._status |= _RECEIVED
        self._interrupt()

    # -- the TX wire -----------------------------------------------------------------------------------------

    def _send(self, byte: int) -> None:
        if self._shift is None:
            self._begin(byte)
        else:
            self._holding = byte
            self._status &= ~_EMPTY

    def _begin(self, byte: int) -> None:
        self._shift = byte
        self._status = self._status & ~_TRANSMITTED | _EMPTY
        self._departure.set_in(self._byte_ns)

    def _depart(self) -> None:
        assert self._shift is not None
        self.sent.append(self._shift)
        self._shift, byte = None, self._holding
        self._holding = None
        if byte is not None:
            self._begin(byte)
        self._load()
        if self._shift is None:
            self._status |= _TRANSMITTED
        self._interrupt()

    def _load(self) -> None:
        """Let the DMA fill the two registers; it is two bytes ahead of the wire."""
        dma = self._transmit_dma
        if dma and self._cr3 & _DMA_TRANSMITS and self._cr1 & _ENABLE and self._cr1 & _TRANSMITTER:
            while self._holding is None and dma.is_ready:
                self._send(dma.take())
