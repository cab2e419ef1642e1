# SPDX-License-Identifier: GPL-3.0-or-later
"""A conversation that changes or saves settings is held only with a board that says it is disarmed."""

from typing import TypeVar

from bridge.line.conversation import Conversation, ask_armed
from bridge.settings.fc_settings import ARMED, NO_ANSWER, SettingRefusal

T = TypeVar("T")


def while_disarmed(arm_bit: int | None, conversation: Conversation[T]) -> Conversation[T | SettingRefusal]:
    """Hold it if STATUS says disarmed now: telemetry may not show it yet. arm_bit: see FlightController."""
    armed = yield from ask_armed(arm_bit)
    if armed is False:
        return (yield from conversation)
    conversation.close()
    return ARMED if armed else NO_ANSWER
