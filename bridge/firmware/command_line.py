# SPDX-License-Identifier: GPL-3.0-or-later
"""Harakiri's command line as the way to its boot loader: it prints the settings, then `flash` restarts the board there.

`flash` does the same as three letters R (serial.c), which work only in AUTOSENSE, 4 s after the last valid packet. Only
for a disarmed Harakiri.
"""

from contextlib import suppress

from protocols.msp.command_line import PROMPT
from protocols.plain_text import plain_text
from protocols.stm32_boot_loader import Dialogue, Exchange

_OPEN = b"\r\r\r"
#: A calibration stops the main loop for longer; then the command line does not open, and nothing is lost.
_OPEN_S = 5.0
_DUMP_S = 5.0
#: systemReset() waits for a second.
_RESTART_S = 2.0


class CommandLineError(Exception):
    """The command line cannot be used; one sentence."""


def read_dump() -> Dialogue[str]:
    """Open the command line; return the output of `dump`. CommandLineError: it is closed again."""
    if not (yield Exchange(_OPEN, _OPEN_S, _is_prompt)).endswith(PROMPT):
        raise CommandLineError("its command line does not open: switch it off and on, then try again")
    printed = yield Exchange(b"dump\r", _DUMP_S, _is_prompt)
    if not printed.endswith(PROMPT):
        yield Exchange(b"\rexit\r", _RESTART_S, _never)
        raise CommandLineError("its command line does not print the settings: it was restarted, try again")
    lines = printed.removesuffix(PROMPT).splitlines()
    return "\n".join(plain_text(line).rstrip() for line in lines[1:]).strip() + "\n"


def settings_in(dump: str) -> dict[str, float]:
    """The settings of `set` in a dump, by name; they are rounded to three decimals."""
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
