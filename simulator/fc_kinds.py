# SPDX-License-Identifier: GPL-3.0-or-later
"""The simulated boards other than the Naze."""

from functools import partial

from simulator.inav import InavFirmware
from simulator.inav_mission import EEPROM_SIZE
from simulator.msp_board import MspBoard
from simulator.msp_firmware import BootFirmware
from simulator.msp_options import MspOptions
from simulator.multiwii import MultiWiiFirmware
from simulator.multiwii_mission import blank_eeprom
from simulator.options import Faults
from simulator.telemetry_only import BASEFLIGHT, BETAFLIGHT, TelemetryFirmware

_FIRMWARE: dict[str, BootFirmware] = {
    "inav": InavFirmware,
    "multiwii": MultiWiiFirmware,
    "betaflight": partial(TelemetryFirmware, BETAFLIGHT),
    "baseflight": partial(TelemetryFirmware, BASEFLIGHT),
}
KINDS = tuple(_FIRMWARE)


def new_eeprom(kind: str, options: MspOptions) -> bytearray:
    """The EEPROM of a factory-new board."""
    return blank_eeprom(options.capacity) if kind == "multiwii" else bytearray(EEPROM_SIZE)


def make_board(
    kind: str, options: MspOptions | None = None, faults: Faults | None = None, eeprom: memoryview | None = None
) -> MspBoard:
    """Create a board without power. `eeprom` outlives the board; None: a blank one."""
    options = options or MspOptions()
    if eeprom is None:
        eeprom = memoryview(new_eeprom(kind, options))
    return MspBoard(_FIRMWARE[kind], eeprom, options, faults)
