# SPDX-License-Identifier: GPL-3.0-or-later
"""What can be done to an emulated board while it runs, and what it has counted."""

from dataclasses import dataclass


@dataclass(slots=True, kw_only=True)
class EmulatedFaults:
    """Switches that may be turned at any moment.

    The rates are probabilities a bit and a byte, in both directions. `armed` is the pilot's wish: throttle down and yaw
    to the side until the firmware does it; the firmware may refuse. Otherwise the sticks and switches are where these
    say, in microseconds. The power goes in the middle of that flash operation from now on (page erases and half-words
    programmed, from 1; 0: never), or so many of them fail. `hang` stops the core, not the time.
    """

    bit_error_rate: float = 0.0
    lost_byte_rate: float = 0.0
    hang: bool = False
    power_cut_at_flash_operation: int = 0
    flash_failures: int = 0
    armed: bool = False
    roll: int = 1500
    pitch: int = 1500
    throttle: int = 1000
    yaw: int = 1500
    aux1: int = 1000
    aux2: int = 1000
    aux3: int = 1000
    aux4: int = 1000


@dataclass(slots=True)
class EmulatedCounters:
    """What happened to the board since it was made.

    hazard_runs: three equal hazard bytes in a row on the RX pin, acted on or not.
    bootloader_entered, crashes: ways into a state that only the power switch ends.
    """

    hazard_runs: int = 0
    resets: int = 0
    bootloader_entered: bool = False
    crashes: int = 0
    flash_erases: int = 0
    flash_programs: int = 0
