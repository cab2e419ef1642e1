# SPDX-License-Identifier: GPL-3.0-or-later
"""The options, faults and counters of a simulated Naze."""

from dataclasses import dataclass
from enum import Enum, IntEnum

from protocols.msp.mission_flight import FlightProgress
from simulator.board.flight import LEVEL_ACC


class TelemetryProtocol(IntEnum):
    """The CLI's `tele_prot`: the protocol of the UART while the craft is armed."""

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
    """A board and its firmware. The defaults are Harakiri's own, times as measured on the emulated board."""

    seed: int = 0
    baud: int = 115200
    looptime_ms: float = 3.0
    tree: Tree = Tree.TESTCODE3
    boot_ms: float = 7100.0
    #: Bytes before this are lost. Later bytes wait in the ring for the end of the boot.
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

    # Times for which the CPU is stalled.
    flash_erase_ms: float = 100.0
    record_program_ms: float = 0.45
    config_write_ms: float = 180.0
    #: From setting the radius to the write, which happens in the next main loop.
    config_write_delay_ms: float = 0.0
    # Gyro, then 3100 samples at 500 Hz; 525 averages of five at 42 Hz (sensors.c).
    acc_calibration_ms: float = 9400.0
    mag_calibration_ms: float = 61000.0


@dataclass(slots=True, kw_only=True)
class BoardFaults:
    """Switches of any board that may be changed at any time.

    The rates are probabilities per bit and per byte, in both directions. `hang`: the CPU stops. `armed` is the
    pilot's request, which the firmware may refuse. The power fails during the given flash operation from now on (page
    erases and 16-byte programs, or half-words on the emulated Naze, from 1; 0: never), or a number of operations fail.
    `boot_pads`: bridged on a Naze, so that it starts the chip's own boot loader.
    """

    bit_error_rate: float = 0.0
    lost_byte_rate: float = 0.0
    hang: bool = False
    armed: bool = False
    power_cut_at_flash_operation: int = 0
    flash_failures: int = 0
    boot_pads: bool = False


@dataclass(slots=True, kw_only=True)
class Faults(BoardFaults):
    """Switches of a simulated firmware. `acc`: see Craft.

    `boxes`: the pilot's switches except ARM, one bit for each of BOXNAMES. `busy`: a configuration write is scheduled.
    `extension` takes effect at the next boot. Without `msp` only MAVLink is answered.
    `arming_blockers`: INAV's arming flags (runtime_config.h). `stick_loads`: the number of times the pilot has loaded
    the saved missions with the sticks. `selected_mission`: the pilot's selection; 0: none. `flight`: the report of a
    Harakiri with mission flight.
    """

    boxes: int = 1
    acc: tuple[int, int, int] = LEVEL_ACC
    busy: bool = False
    extension: bool = True
    msp: bool = True
    arming_blockers: int = 0
    stick_loads: int = 0
    selected_mission: int = 0
    flight: FlightProgress | None = None


@dataclass(slots=True, kw_only=True)
class BoardCounters:
    """Event counts of any board since it was created.

    hazard_runs: three equal hazard bytes in a row on the RX pin, acted on or not.
    bootloader_entered, crashes: entries into states that only the reset line or a power cycle ends.
    """

    hazard_runs: int = 0
    resets: int = 0
    bootloader_entered: bool = False
    crashes: int = 0


@dataclass(slots=True, kw_only=True)
class Counters(BoardCounters):
    """Event counts of a simulated firmware.

    rx_overflows, tx_overflows: rings overrun while the firmware ran.
    max_outstanding_reply_bytes: of the 255 that the TX ring holds.
    cli_entered: into a state that only a reset ends.
    flash_writes: mission lists ever made valid in this flash, as of the last mission command.
    """

    rx_overflows: int = 0
    tx_overflows: int = 0
    max_outstanding_reply_bytes: int = 0
    cli_entered: bool = False
    flash_writes: int = 0
