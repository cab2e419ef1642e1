# SPDX-License-Identifier: GPL-3.0-or-later
"""A model of harakiri_guard.c: the MSP requests that a patched Harakiri refuses before it evaluates them."""

from collections.abc import Mapping

from simulator.board.msp_sensors import MspCommand

_SIZES: Mapping[int, int] = {
    MspCommand.WP: 1,
    MspCommand.SET_RAW_RC: 16,
    MspCommand.SET_RAW_GPS: 14,
    MspCommand.SET_PID: 30,
    MspCommand.SET_RC_TUNING: 7,
}
_GROUNDED = (MspCommand.ACC_CALIBRATION, MspCommand.MAG_CALIBRATION, MspCommand.RESET_CONF, MspCommand.EEPROM_WRITE)


def accepts(command: int, size: int, *, box_size: int, armed: bool) -> bool:
    """GuardAccepts. box_size: of SET_BOX, bytes."""
    if armed and command >= MspCommand.SET_RAW_RC and command != MspCommand.DEBUG:
        return False
    if command in _GROUNDED:
        return size == 0
    if command == MspCommand.SET_MISC:
        return size != 0
    return size == (box_size if command == MspCommand.SET_BOX else _SIZES.get(command, size))
