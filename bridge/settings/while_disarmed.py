# SPDX-License-Identifier: GPL-3.0-or-later
"""A conversation that changes or saves settings is held only with a board that says it is disarmed."""

from typing import TypeVar

from bridge.line.conversation import Conversation, ask_status
from bridge.settings.fc_settings import ARMED, NO_ANSWER, SettingRefusal

T = TypeVar("T")


def while_disarmed(arm_bit: int | None, conversation: Conversation[T]) -> Conversation[T | SettingRefusal]:
    """Hold it if STATUS says disarmed now: telemetry may not show it yet. arm_bit: see FlightController."""
    status = yield from ask_status()
    if status is None or arm_bit is None:
        conversation.close()
        return NO_ANSWER
    if status.box_flags >> arm_bit & 1:
        conversation.close()
        return ARMED
    return (yield from conversation)
