# SPDX-License-Identifier: GPL-3.0-or-later
"""Reads and rewrites a Naze32's flash through the boot loader, which a disarmed Harakiri enters by the command line.

Only pages that differ are erased and written, so repeating an interrupted flash resumes it. Page 0 is erased
first, and the first bytes, the stack pointer and the start address, are written last: half a program never runs.
"""

from collections.abc import Callable
from contextlib import suppress
from functools import partial
from typing import TypeVar

from protocols.firmware_image import FLASH_BASE, FLASH_SIZE
from protocols.msp.command_line import PROMPT
from protocols.plain_text import plain_text
from protocols.stm32_boot_loader import (
    BLOCK_SIZE,
    MEDIUM_DENSITY,
    PAGE_SIZE,
    BootLoaderError,
    Dialogue,
    Exchange,
    end_command,
    erase_page,
    read_chip_id,
    read_memory,
    synchronise,
    write_memory,
)

#: Called with the name of the step, the amount done, and the total.
Progress = Callable[[str, int, int], None]

_ATTEMPTS = 3
_PAGES = FLASH_SIZE // PAGE_SIZE
_BLANK = b"\xff"
#: The size of the stack pointer and the start address, bytes.
_START_SIZE = 8
#: Opens the command line.
_OPEN = b"\r\r\r"
#: A calibration stops the main loop for longer, then the command line does not open, which is harmless.
_OPEN_S = 5.0
_DUMP_S = 5.0
#: systemReset() waits for a second.
_RESTART_S = 2.0

T = TypeVar("T")


class FlashingError(Exception):
    """The flash cannot be read or written, in one sentence."""


def find_chip(within_s: float, is_waiting: Callable[[], None]) -> Dialogue[None]:
    """Reach the boot loader, and check that it is a Naze32's. BootLoaderError, FlashingError."""
    yield from synchronise(within_s, is_waiting)
    chip = yield from _repeated(read_chip_id)
    if chip != MEDIUM_DENSITY:
        raise FlashingError(f"the chip is not a Naze32's: its type is {chip:#x}, not {MEDIUM_DENSITY:#x}")


def read_flash(progress: Progress) -> Dialogue[bytes]:
    """The whole flash. FlashingError."""
    contents = bytearray()
    for page in range(_PAGES):
        contents += yield from _read_page(page)
        progress("reading", page + 1, _PAGES)
    return bytes(contents)


def rewrite_flash(present: bytes, wanted: bytes, progress: Progress) -> Dialogue[None]:
    """Turn the whole flash from `present` into `wanted`, and read the written pages back. FlashingError."""
    failed = [page for page in range(_PAGES) if _page(present, page) != _page(wanted, page)]
    for _ in range(_ATTEMPTS):
        if not failed:
            return
        pages = sorted({0, *failed})
        failed = []
        yield from _write_pages(pages, wanted, progress)
        for done, page in enumerate(pages, 1):
            if (yield from _read_page(page)) != _page(wanted, page):
                failed.append(page)
            progress("verifying", done, len(pages))
    if failed:
        at = FLASH_BASE + failed[0] * PAGE_SIZE
        raise FlashingError(f"the flash does not keep what is written at {at:#010x}")


def _write_pages(pages: list[int], wanted: bytes, progress: Progress) -> Dialogue[None]:
    """Erase and write. A step that fails is noticed when its page is read back."""
    for done, page in enumerate(pages, 1):
        yield from _attempt(erase_page(page))
        progress("erasing", done, len(pages))
    for done, page in enumerate(reversed(pages), 1):
        for at in range((page + 1) * PAGE_SIZE - BLOCK_SIZE, page * PAGE_SIZE - 1, -BLOCK_SIZE):
            if at == 0:
                yield from _write(wanted, _START_SIZE, BLOCK_SIZE - _START_SIZE)
                yield from _write(wanted, 0, _START_SIZE)
            else:
                yield from _write(wanted, at, BLOCK_SIZE)
        progress("writing", done, len(pages))


def _write(wanted: bytes, at: int, size: int) -> Dialogue[None]:
    block = wanted[at : at + size]
    if block.strip(_BLANK):
        yield from _attempt(write_memory(FLASH_BASE + at, block))


def _read_page(page: int) -> Dialogue[bytes]:
    contents = b""
    for at in range(page * PAGE_SIZE, (page + 1) * PAGE_SIZE, BLOCK_SIZE):
        contents += yield from _repeated(partial(read_memory, FLASH_BASE + at, BLOCK_SIZE))
    return contents


def _repeated(command: Callable[[], Dialogue[T]]) -> Dialogue[T]:
    for _ in range(_ATTEMPTS):
        if (result := (yield from _attempt(command()))) is not None:
            return result
    raise FlashingError("the boot loader keeps refusing: is the chip protected from being read?")


def _attempt(command: Dialogue[T]) -> Dialogue[T | None]:
    """Carry out a command. None if it failed, and the next can be sent. FlashingError."""
    try:
        return (yield from command)
    except BootLoaderError:
        if not (yield from end_command()):
            raise FlashingError("the boot loader no longer answers") from None
    return None


def _page(contents: bytes, page: int) -> bytes:
    return contents[page * PAGE_SIZE : (page + 1) * PAGE_SIZE]


class CommandLineError(Exception):
    """The command line cannot be used, in one sentence."""


def read_dump() -> Dialogue[str]:
    """Open the command line. Return the output of `dump`. CommandLineError: it is closed again."""
    if not (yield Exchange(_OPEN, _OPEN_S, _is_prompt)).endswith(PROMPT):
        raise CommandLineError("its command line does not open: switch it off and on, then try again")
    printed = yield Exchange(b"dump\r", _DUMP_S, _is_prompt)
    if not printed.endswith(PROMPT):
        yield Exchange(b"\rexit\r", _RESTART_S, _never)
        raise CommandLineError("its command line does not print the settings: it was restarted, try again")
    lines = printed.removesuffix(PROMPT).splitlines()
    return "\n".join(plain_text(line).rstrip() for line in lines[1:]).strip() + "\n"


def settings_in(dump: str) -> dict[str, float]:
    """The settings of `set` in a dump, by name. They are rounded to three decimals."""
    found = {}
    for line in dump.splitlines():
        name, is_setting, value = line.partition(" = ")
        with suppress(ValueError):
            if is_setting:
                found[name] = float(value)
    return found


def start_boot_loader() -> Dialogue[None]:
    """From the open command line."""
    yield Exchange(b"flash\r", _RESTART_S, _never)


def _is_prompt(reply: bytes) -> bool:
    return reply.endswith(PROMPT)


def _never(_: bytes) -> bool:
    return False
