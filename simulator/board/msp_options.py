# SPDX-License-Identifier: GPL-3.0-or-later
"""The options of simulated MSP boards other than Harakiri's."""

from dataclasses import dataclass


@dataclass(frozen=True, slots=True, kw_only=True)
class MspOptions:
    """`baud` None: a socket. `version` is INAV's. `receiver`: True if MSP_RC has channels.

    `platform`: INAV's platform_type (mixer_profile.h), 0 a multirotor, 1 an aeroplane, 4 a rover.
    `pitot`: True if INAV measures airspeed. `unix_s`: INAV's time at its start, by GPS, s since 1970; 0: it has none.
    `serial_task_ms`: the interval of the MSP task, which serves one request: INAV's simulator 0.5, its boards 10.
    `ring_size`: of the receive ring, bytes: a UART's 256, INAV's simulator 2048.
    `capacity`: of MultiWii's EEPROM, waypoints. `seed`: of the random faults.
    """

    version: str = "9.1.0"
    baud: int | None = 115200
    receiver: bool = True
    platform: int = 0
    pitot: bool = False
    unix_s: float = 0.0
    serial_task_ms: float = 0.5
    ring_size: int = 256
    boot_ms: float = 1500.0
    eeprom_write_ms: float = 100.0
    capacity: int = 178
    seed: int = 0
