# SPDX-License-Identifier: GPL-3.0-or-later
"""An I2C interface as bus master: the events EV5 to EV8 in their order (section 26.3.3)."""

from collections.abc import Callable, Mapping
from typing import Protocol

from simulator.emulated_naze.clock import Alarm, Clock
from simulator.emulated_naze.nvic import Nvic

_PE, _START, _STOP, _ACK, _POS, _SWRST = 1, 1 << 8, 1 << 9, 1 << 10, 1 << 11, 1 << 15
_ERROR_INTERRUPT, _EVENT_INTERRUPT, _BUFFER_INTERRUPT = 1 << 8, 1 << 9, 1 << 10
_SB, _ADDR, _BTF, _RXNE, _TXE, _AF = 1, 2, 4, 1 << 6, 1 << 7, 1 << 10
_ERRORS = 0xDF00
_MASTER, _BUSY, _TRANSMITTER = 1, 2, 4
_FAST, _DUTY = 1 << 15, 1 << 14
_BITS_PER_BYTE = 9


class I2cDevice(Protocol):
    """A chip on the bus that always acknowledges."""

    def begin(self, is_read: bool) -> None:
        """Handle being addressed, for reading or writing."""

    def read(self) -> int:
        """Return its next byte."""

    def write(self, byte: int) -> None:
        """Receive a byte."""


class I2c:
    """`devices` by their seven-bit addresses; `bus_hz` is the interface's clock."""

    def __init__(
        self,
        clock: Clock,
        nvic: Nvic,
        irqs: tuple[int, int],
        bus_hz: Callable[[], int],
        devices: Mapping[int, I2cDevice],
    ) -> None:
        self._nvic = nvic
        self._event_irq, self._error_irq = irqs
        self._bus_hz = bus_hz
        self._devices = devices
        self._starting = Alarm(clock, self._started)
        self._stopping = Alarm(clock, self._stopped)
        self._addressing = Alarm(clock, self._addressed)
        self._sending = Alarm(clock, self._byte_sent)
        self._receiving = Alarm(clock, self._byte_received)
        self.reset()

    def reset(self) -> None:
        """Release the bus."""
        self._cr1 = self._cr2 = self._sr1 = self._sr2 = self._ccr = 0
        self._rest: dict[int, int] = {}
        self._data = 0
        # A byte behind the data register: one to send, or a received one that does not fit.
        self._shift: int | None = None
        self._address = 0
        self._device: I2cDevice | None = None
        self._will_acknowledge = self._acknowledged = True
        self._halt()
        self._interrupt()

    def _halt(self) -> None:
        for alarm in (self._starting, self._stopping, self._addressing, self._sending, self._receiving):
            alarm.cancel()

    # -- registers -------------------------------------------------------------------------------------------

    def read(self, offset: int) -> int:
        """Read a word, and clear the flags that reading clears."""
        match offset:
            case 0x00:  # CR1
                return self._cr1
            case 0x04:  # CR2
                return self._cr2
            case 0x10:  # DR
                return self._read_data()
            case 0x14:  # SR1
                return self._sr1
            case 0x18:  # SR2
                return self._read_sr2()
            case 0x1C:  # CCR
                return self._ccr
        return self._rest.get(offset, 0)

    def write(self, offset: int, value: int) -> None:
        match offset:
            case 0x00:  # CR1
                self._write_cr1(value)
            case 0x04:  # CR2
                self._cr2 = value
            case 0x10:  # DR
                self._write_data(value & 0xFF)
            case 0x14:  # SR1
                self._sr1 &= value | ~_ERRORS
            case 0x1C:  # CCR
                self._ccr = value
            case _:
                self._rest[offset] = value
        self._interrupt()

    def _write_cr1(self, value: int) -> None:
        if value & _SWRST:
            self.reset()
            self._cr1 = value
            return
        before, self._cr1 = self._cr1, value
        if not value & _PE:
            self._cr1 &= ~(_START | _STOP)
            return
        if value & _START and not before & _START:
            self._starting.set_in(self._bit_ns)
        # A stop waits for the end of the byte being received, which handles it.
        if value & _STOP and not before & _STOP and not self._receiving.is_set:
            self._stopping.set_in(self._bit_ns)

    @property
    def _bit_ns(self) -> int:
        """Section 26.6.8."""
        ticks = max(self._ccr & 0xFFF, 1)
        if not self._ccr & _FAST:
            ticks *= 2
        else:
            ticks *= 25 if self._ccr & _DUTY else 3
        return ticks * 1_000_000_000 // self._bus_hz()

    @property
    def _byte_ns(self) -> int:
        return _BITS_PER_BYTE * self._bit_ns

    def _interrupt(self) -> None:
        events = _SB | _ADDR | _BTF
        if self._cr2 & _BUFFER_INTERRUPT:
            events |= _RXNE | _TXE
        self._nvic.set_line(self._event_irq, bool(self._cr2 & _EVENT_INTERRUPT and self._sr1 & events))
        self._nvic.set_line(self._error_irq, bool(self._cr2 & _ERROR_INTERRUPT and self._sr1 & _ERRORS))

    # -- conditions and the address --------------------------------------------------------------------------

    def _started(self) -> None:
        self._cr1 &= ~_START
        self._sr1 = self._sr1 & _ERRORS | _SB
        self._sr2 = _MASTER | _BUSY
        self._shift = None
        self._acknowledged = True
        self._interrupt()

    def _stopped(self) -> None:
        self._cr1 &= ~_STOP
        self._sr1 &= _ERRORS | _RXNE
        self._sr2 = 0
        self._sending.cancel()
        self._interrupt()

    def _addressed(self) -> None:
        self._device = self._devices.get(self._address >> 1)
        if self._device is None:
            self._sr1 |= _AF
        else:
            is_read = bool(self._address & 1)
            self._device.begin(is_read)
            self._sr2 |= 0 if is_read else _TRANSMITTER
            self._sr1 |= _ADDR
        self._interrupt()

    def _read_sr2(self) -> int:
        if self._sr1 & _ADDR:
            self._sr1 &= ~_ADDR
            if self._sr2 & _TRANSMITTER:
                self._sr1 |= _TXE
            else:
                self._receive_next()
            self._interrupt()
        return self._sr2

    # -- data ------------------------------------------------------------------------------------------------

    def _write_data(self, byte: int) -> None:
        if self._sr1 & _SB:
            self._sr1 &= ~_SB
            self._address = byte
            self._addressing.set_in(self._byte_ns)
        elif self._sr2 & _TRANSMITTER:
            self._sr1 &= ~_BTF
            self._data = byte
            if self._sending.is_set:
                self._sr1 &= ~_TXE
            else:
                self._send()

    def _send(self) -> None:
        self._shift = self._data
        self._sr1 |= _TXE
        self._sending.set_in(self._byte_ns)

    def _byte_sent(self) -> None:
        assert self._device is not None
        assert self._shift is not None
        self._device.write(self._shift)
        if self._sr1 & _TXE:
            self._shift = None
            self._sr1 |= _BTF
        else:
            self._send()
        self._interrupt()

    def _receive_next(self) -> None:
        # With POS, ACK is for the byte after the one being received.
        self._will_acknowledge = bool(self._cr1 & _ACK)
        self._receiving.set_in(self._byte_ns)

    def _byte_received(self) -> None:
        assert self._device is not None
        byte = self._device.read()
        self._acknowledged = self._will_acknowledge if self._cr1 & _POS else bool(self._cr1 & _ACK)
        if self._sr1 & _RXNE:
            # The clock is stretched until there is room.
            self._shift = byte
            self._sr1 |= _BTF
        else:
            self._data = byte
            self._sr1 |= _RXNE
            self._go_on_receiving()
        if self._cr1 & _STOP:
            self._receiving.cancel()
            self._stopping.set_in(self._bit_ns)
        self._interrupt()

    def _read_data(self) -> int:
        byte = self._data
        self._sr1 &= ~(_RXNE | _BTF)
        if self._shift is not None and not self._sr2 & _TRANSMITTER:
            self._data, self._shift = self._shift, None
            self._sr1 |= _RXNE
            self._go_on_receiving()
        self._interrupt()
        return byte

    def _go_on_receiving(self) -> None:
        if self._acknowledged and self._sr2 & _BUSY and not self._cr1 & _STOP:
            self._receive_next()
