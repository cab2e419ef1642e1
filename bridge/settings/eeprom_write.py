# SPDX-License-Identifier: GPL-3.0-or-later
"""EEPROM_WRITE, which saves the settings of every board that has no command of its own for it."""

from bridge.line.conversation import Conversation, ask, ask_status
from bridge.settings.fc_settings import NO_ANSWER, NOT_SAVED, SettingRefusal
from protocols.msp.frame import Direction, request

_EEPROM_WRITE = 250
_ACK_SIZE = 2
#: Their timeouts together exceed the flash time of an STM32H743.
_ASKS_AFTER_SAVE = 12


def write_eeprom() -> Conversation[SettingRefusal | None]:
    """Sent once: some boards answer before they write, some after it, and a write takes up to 2.2 s."""
    reply = yield from ask(request(_EEPROM_WRITE), _EEPROM_WRITE, _ACK_SIZE, tries=1, exclusive=True)
    status = yield from ask_status(tries=_ASKS_AFTER_SAVE)
    if reply is None or status is None:
        return NO_ANSWER
    return NOT_SAVED if reply.direction is Direction.ERROR else None
