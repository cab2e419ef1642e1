# SPDX-License-Identifier: GPL-3.0-or-later
"""The settings of boards that have no command to list them: PIDs, modes, rates and MISC."""

from bridge.fc.profile import FlightController
from bridge.settings.msp_parts import MspPartSettings
from protocols.msp.settings import SETTINGS, SettingsRequest


def part_settings(board: FlightController) -> MspPartSettings:
    """All parts that the board's firmware has."""
    return some_parts(board, *SETTINGS[board.firmware])


def some_parts(board: FlightController, *parts: SettingsRequest) -> MspPartSettings:
    return MspPartSettings(parts, board.firmware, board.boxes, accepts_any_byte=board.profile.accepts_any_byte)
