# SPDX-License-Identifier: GPL-3.0-or-later
"""The boot loader in the ROM of an STM32F103, on USART1 with even parity (ST's application notes AN3155 and AN2606).

A dialogue is a generator: it yields each Exchange with the board, and is sent the received bytes. The boot loader lacks
a timeout: after an incomplete command it waits for the rest of it, which `synchronise` takes into account.

>>> def chip() -> Dialogue[int]:
...     yield from synchronise(1.0)
...     return (yield from read_chip_id())
"""

from collections.abc import Callable, Generator
from dataclasses import dataclass
from functools import reduce
from operator import xor
from typing import TypeVar

from protocols.firmware_image import FLASH_BASE

#: The unit of erasing, and the most bytes of a read or a write.
PAGE_SIZE = 1024
BLOCK_SIZE = 256
#: An STM32F103 with 64 or 128 KB of flash.
MEDIUM_DENSITY = 0x410

INIT, ACK, NACK = 0x7F, 0x79, 0x1F
GET_ID, READ, GO, WRITE, ERASE = 0x02, 0x11, 0x21, 0x31, 0x43

#: A block takes 24 ms on the wire and 9 ms in the flash, a page 40 ms.
_REPLY_S = 1.0
_INIT_S = 0.3
#: A filler byte is answered only if it completes a command: the longest has a count, 256 bytes and a checksum.
_FILLER = b"\0"
_FILLER_S = 0.05
_FILLERS = 260

T = TypeVar("T")


class BootLoaderError(Exception):
    """The boot loader does not answer, or refuses a command, in one sentence."""


@dataclass(frozen=True, slots=True)
class Exchange:
    """Send `data`, after dropping unread input. Wait until the reply `is_complete` or `timeout_s` has passed."""

    data: bytes
    timeout_s: float
    is_complete: Callable[[bytes], bool]


Dialogue = Generator[Exchange, bytes, T]


def synchronise(within_s: float, is_waiting: Callable[[], None] = lambda: None) -> Dialogue[None]:
    """Reach the point where the next command can be sent. BootLoaderError if there is no boot loader within this time.

    INIT sets the speed after a reset. A boot loader that is in use takes it as a part of a command, whose rest the
    fillers complete with a wrong checksum. Before them INIT is sent only once: as a page number and the checksum, two
    would erase the last page. Fillers alone could only erase page 0. `is_waiting` is called without a prompt answer.
    """
    yield _bytes(bytes((INIT,)), 1, _INIT_S)
    if (yield from end_command()):
        return
    is_waiting()
    for _ in range(int(within_s / _INIT_S)):
        if ACK in (yield _bytes(bytes((INIT,)), 1, _INIT_S)) and (yield from end_command()):
            return
    raise BootLoaderError("no boot loader answers")


def end_command() -> Dialogue[bool]:
    """Send fillers until a NACK: then no command is half sent. False if there is none."""
    for _ in range(_FILLERS):
        if NACK in (yield _bytes(_FILLER, 1, _FILLER_S)):
            return True
    return False


def read_chip_id() -> Dialogue[int]:
    reply = yield from _command(GET_ID, 4)
    return int.from_bytes(reply[1:3], "big")


def read_memory(address: int, size: int) -> Dialogue[bytes]:
    """Up to BLOCK_SIZE bytes, without a checksum."""
    yield from _command(READ)
    yield from _step(_checked(address.to_bytes(4, "big")), READ)
    reply = yield from _step(_complemented(size - 1), READ, size)
    return reply


def write_memory(address: int, data: bytes) -> Dialogue[None]:
    """Up to BLOCK_SIZE bytes into erased flash; an even number."""
    yield from _command(WRITE)
    yield from _step(_checked(address.to_bytes(4, "big")), WRITE)
    yield from _step(_checked(bytes((len(data) - 1,)) + data), WRITE)


def erase_page(page: int) -> Dialogue[None]:
    yield from _command(ERASE)
    yield from _step(_checked(bytes((0, page))), ERASE)


def start_program() -> Dialogue[None]:
    """Start the program in the flash, without a reset."""
    yield from _command(GO)
    yield from _step(_checked(FLASH_BASE.to_bytes(4, "big")), GO)


def _command(code: int, size: int = 0) -> Dialogue[bytes]:
    return _step(_complemented(code), code, size)


def _step(data: bytes, command: int, size: int = 0) -> Dialogue[bytes]:
    """One part of a command: its acknowledgement is followed by `size` bytes, which are returned. BootLoaderError."""
    reply = yield _bytes(data, 1 + size, _REPLY_S)
    if reply[:1] == bytes((NACK,)):
        raise BootLoaderError(f"the boot loader refuses {_NAMES[command]}")
    if reply[:1] != bytes((ACK,)) or len(reply) != 1 + size:
        raise BootLoaderError(f"the boot loader does not answer {_NAMES[command]}")
    return reply[1:]


def _bytes(data: bytes, size: int, timeout_s: float) -> Exchange:
    return Exchange(data, timeout_s, lambda reply: len(reply) >= size or reply[:1] == bytes((NACK,)))


def _complemented(byte: int) -> bytes:
    return bytes((byte, byte ^ 0xFF))


def _checked(data: bytes) -> bytes:
    return data + bytes((reduce(xor, data),))


_NAMES = {
    GET_ID: "the request for the chip's type",
    READ: "a read",
    GO: "the start",
    WRITE: "a write",
    ERASE: "an erase",
}
