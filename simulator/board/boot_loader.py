# SPDX-License-Identifier: GPL-3.0-or-later
"""The boot loader in an STM32F103's ROM, on USART1 at 115200 baud: AN3155's commands, served as the ROM does.

It polls: a byte that arrives during a flash operation waits in the data register, and the following are lost. It
has no timeout, and a first byte other than 0x7F makes it measure a wrong speed, so it is deaf until the next reset.
"""

from collections import deque
from collections.abc import Callable, Generator
from functools import reduce
from math import inf
from operator import xor
from typing import Protocol

from protocols.firmware_image import FLASH_BASE, FLASH_SIZE
from protocols.stm32_boot_loader import ACK, ERASE, GET_ID, GO, INIT, MEDIUM_DENSITY, NACK, PAGE_SIZE, READ, WRITE

BAUD = 115200
#: With a parity bit.
_BYTE_S = 11 / BAUD
_GET, _GET_VERSION = 0x00, 0x01
_VERSION = 0x22
_COMMANDS = (_GET, _GET_VERSION, GET_ID, READ, GO, WRITE, ERASE)
_ALL_PAGES = 0xFF


class ChipFlash(Protocol):
    """The chip's flash. Times in seconds. PowerCutError if the power fails."""

    def read(self, at: int, size: int) -> bytes:
        """Bytes at an offset."""

    def erase(self, page: int, now: float) -> float:
        """Erase a page. The time that it takes."""

    def program(self, at: int, data: bytes, now: float) -> float:
        """Program bytes. The time that it takes."""


class BootLoader:
    """Runs from a reset until `on_go` is called with the time of the program's start. The ACK has then been sent."""

    def __init__(self, flash: ChipFlash, on_go: Callable[[float], None]) -> None:
        self._flash = flash
        self._on_go = on_go
        self._rx: deque[tuple[float, int]] = deque()
        self._tx: deque[tuple[float, int]] = deque()
        self._register: int | None = None
        self._now = self._rx_free_at = self._tx_free_at = -inf
        self._program = self._serve()
        next(self._program)

    def receive(self, data: bytes, now: float) -> None:
        for byte in data:
            self._rx_free_at = max(now, self._rx_free_at) + _BYTE_S
            self._rx.append((self._rx_free_at, byte))

    def run_until(self, now: float) -> None:
        while True:
            arrival = self._rx[0][0] if self._rx else inf
            if self._register is not None and self._now <= min(now, arrival):
                byte, self._register = self._register, None
                self._program.send(byte)
            elif arrival <= now:
                at, byte = self._rx.popleft()
                if at >= self._now:
                    self._now = at
                    self._program.send(byte)
                elif self._register is None:
                    self._register = byte
            else:
                return

    def sent(self, now: float) -> bytes:
        """The bytes sent until `now` since the last call."""
        out = bytearray()
        while self._tx and self._tx[0][0] <= now:
            out.append(self._tx.popleft()[1])
        return bytes(out)

    def next_event(self) -> float:
        arrival = self._rx[0][0] if self._rx else inf
        if self._register is not None:
            arrival = min(arrival, self._now)
        return min(arrival, self._tx[-1][0] if self._tx else inf)

    def _send(self, *data: int) -> None:
        for byte in data:
            self._tx_free_at = max(self._tx_free_at, self._now) + _BYTE_S
            self._tx.append((self._tx_free_at, byte))
            # The transmitter has one more byte in its data register.
            self._now = max(self._now, self._tx_free_at - 2 * _BYTE_S)

    def _serve(self) -> Generator[None, int, None]:
        if (yield) != INIT:
            while True:
                yield
        self._send(ACK)
        while True:
            command, check = (yield), (yield)
            if command ^ check != 0xFF or command not in _COMMANDS:
                self._send(NACK)
                continue
            self._send(ACK)
            if command == _GET:
                self._send(len(_COMMANDS), _VERSION, *_COMMANDS, ACK)
            elif command == _GET_VERSION:
                self._send(_VERSION, 0, 0, ACK)
            elif command == GET_ID:
                self._send(1, *MEDIUM_DENSITY.to_bytes(2, "big"), ACK)
            elif command == READ:
                yield from self._read()
            elif command == WRITE:
                yield from self._write()
            elif command == ERASE:
                yield from self._erase()
            elif (yield from self._address()) == 0:
                self._on_go(self._tx_free_at)

    def _take(self, count: int) -> Generator[None, int, bytes | None]:
        """Bytes and their checksum, or None if that is wrong, which is refused."""
        data = bytearray()
        for _ in range(count):
            data.append((yield))
        if reduce(xor, data) != (yield):
            self._send(NACK)
            return None
        return bytes(data)

    def _address(self) -> Generator[None, int, int | None]:
        """An offset in the flash."""
        data = yield from self._take(4)
        if data is None:
            return None
        at = int.from_bytes(data, "big") - FLASH_BASE
        if not 0 <= at < FLASH_SIZE:
            self._send(NACK)
            return None
        self._send(ACK)
        return at

    def _read(self) -> Generator[None, int, None]:
        at = yield from self._address()
        if at is None:
            return
        size, check = (yield), (yield)
        if size ^ check != 0xFF:
            self._send(NACK)
            return
        self._send(ACK, *self._flash.read(at, size + 1))

    def _write(self) -> Generator[None, int, None]:
        at = yield from self._address()
        if at is None:
            return
        size = yield
        data = bytearray()
        for _ in range(size + 1):
            data.append((yield))
        if reduce(xor, data, size) != (yield) or len(data) % 2:
            self._send(NACK)
            return
        self._now += self._flash.program(at, bytes(data), self._now)
        self._send(ACK if self._flash.read(at, len(data)) == data else NACK)

    def _erase(self) -> Generator[None, int, None]:
        size = yield
        if size == _ALL_PAGES:
            pages = [*range(FLASH_SIZE // PAGE_SIZE)]
            is_right = (yield) == 0
        else:
            listed = bytearray()
            for _ in range(size + 1):
                listed.append((yield))
            is_right = reduce(xor, listed, size) == (yield)
            pages = [page for page in listed if page < FLASH_SIZE // PAGE_SIZE]
        if not is_right:
            self._send(NACK)
            return
        for page in pages:
            self._now += self._flash.erase(page, self._now)
        self._send(ACK)
