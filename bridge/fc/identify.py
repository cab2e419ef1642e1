# SPDX-License-Identifier: GPL-3.0-or-later
"""Identify an MSP board: the first profile that recognises it wins."""

from collections.abc import Sequence

from bridge.fc.interview import Interview, NoAnswer
from bridge.fc.profile import FlightController, Profile
from bridge.line.conversation import Conversation


def identify_msp(profiles: Sequence[Profile]) -> Conversation[FlightController | None]:
    """Interview the board; None if a question stayed unanswered or no profile recognised it."""
    board = Interview()
    try:
        for profile in profiles:
            if profile.recognise is not None:
                controller = yield from profile.recognise(board)
                if controller is not None:
                    return controller
    except NoAnswer:
        pass
    return None
