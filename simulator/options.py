# SPDX-License-Identifier: GPL-3.0-or-later
"""What a simulated Naze can be made to be, and what it has counted."""

from dataclasses import dataclass
from enum import Enum, IntEnum


class TelemetryProtocol(IntEnum):
    """The CLI's `tele_prot`: what the UART speaks while the craft is armed."""

    MSP = 0
    FRSKY_9600 = 1
    MAVLINK = 2
    MAVLINK_57600 = 3


class Tree(Enum):
    """Harakiri's published trees, by the size of their serial rings in bytes."""

    TESTCODE3 = 264
    WEBSTORE1 = 256


@dataclass(frozen=True, slots=True, kw_only=True)
class SimOptions:
    """A board and its firmware; the defaults are Harakiri's own, times as measured on the emulated board."""

    seed: int = 0
    baud: int = 115200
    looptime_ms: float = 3.0
    tree: Tree = Tree.TESTCODE3
    boot_ms: float = 7100.0
    #: What comes before this is lost; what comes later waits in the ring for the end of the boot.
    reception_ms: float = 470.0
    tele_prot: TelemetryProtocol = TelemetryProtocol.MSP

    # The mission extension (docs/msp-mission.md).
    chunk_records: int = 15
    chunk_window: int = 2
    read_records: int = 6
    capacity: int = 146
    inter_byte_timeout_ms: int = 50
    transfer_timeout_ms: int = 5000
    wp_radius_cm: int = 200

    # What the CPU does nothing else for.
    flash_erase_ms: float = 100.0
    record_program_ms: float = 0.45
    config_write_ms: float = 180.0
    #: From setting the radius to the write: it is done in the next main loop.
    config_write_delay_ms: float = 0.0
    # Gyro, then 3100 samples at 500 Hz; 525 averages of five at 42 Hz (sensors.c).
    acc_calibration_ms: float = 9400.0
    mag_calibration_ms: float = 61000.0


@dataclass(slots=True, kw_only=True)
class Faults:
    """Switches that may be turned at any moment.

    The rates are probabilities a bit and a byte, in both directions. `armed` is the pilot's wish: the firmware refuses
    it while a configuration write is scheduled. `boxes`: the other switches, one bit for each of BOXNAMES.
    `extension` counts from the next boot. Without `msp` only MAVLink is answered. The power goes in the middle of
    that flash operation (page erases and 16-byte programs, from 1; 0: never), or so many of them fail.
    `arming_blockers`: INAV's flags (runtime_config.h) of what keeps it from arming. `stick_loads`: how often the pilot
    has made INAV load its saved missions by the sticks. `selected_mission`: the one that he chose; 0: none.
    """

    bit_error_rate: float = 0.0
    lost_byte_rate: float = 0.0
    hang: bool = False
    armed: bool = False
    boxes: int = 1
    busy: bool = False
    extension: bool = True
    msp: bool = True
    power_cut_at_flash_operation: int = 0
    flash_failures: int = 0
    arming_blockers: int = 0
    stick_loads: int = 0
    selected_mission: int = 0


@dataclass(slots=True)
class Counters:
    """What happened to the board since it was made.

    hazard_runs: three equal hazard bytes in a row on the RX pin, acted on or not.
    rx_overflows, tx_overflows: how often a ring was lapped while the firmware ran.
    max_outstanding_reply_bytes: of the 255 that the TX ring holds.
    cli_entered, bootloader_entered, crashes: ways into a state that only a reset ends.
    flash_writes: mission lists that were ever made valid in this flash, as of the last mission command.
    """

    hazard_runs: int = 0
    rx_overflows: int = 0
    tx_overflows: int = 0
    max_outstanding_reply_bytes: int = 0
    cli_entered: bool = False
    bootloader_entered: bool = False
    crashes: int = 0
    resets: int = 0
    flash_writes: int = 0
