# SPDX-License-Identifier: GPL-3.0-or-later
"""The interface of the mission extension, which the model and the compiled core implement."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Protocol

from simulator.board.flash import NorFlash
from simulator.board.options import Faults, SimOptions


@dataclass(slots=True)
class Board:
    """The extension's access to the rest of the firmware. Times are seconds."""

    options: SimOptions
    faults: Faults
    wp_radius_cm: int
    armed: bool = False
    config_write_due: float | None = None

    @property
    def write_pending(self) -> bool:
        """True if a write of the configuration is scheduled."""
        return self.config_write_due is not None or self.faults.busy

    def set_wp_radius(self, radius_cm: int, now: float) -> None:
        """Set gps_wp_radius. It is stored a little later."""
        self.wp_radius_cm = radius_cm
        self.schedule_write(now)

    def schedule_write(self, now: float) -> None:
        """Schedule a write of the configuration."""
        self.config_write_due = now + self.options.config_write_delay_ms / 1000


class Missions(Protocol):
    """The extension from one boot to the next (docs/msp-mission.md)."""

    def answer(self, command: int, payload: bytes, now: float) -> bytes | None:
        """The reply's payload, or None if it is not one of the extension's commands. PowerCutError."""

    def drop_stale(self, now: float) -> None:
        """Drop an open transfer if the craft is armed, or at the timeout."""

    @property
    def stored(self) -> bytes:
        """The stored list's records."""

    def store(self, records: bytes) -> None:
        """Store records that the firmware received by other means (nm_store). FlashError, PowerCutError."""

    def spend_write(self) -> bool:
        """Take a flash write from the budget. Returns False if there is none."""

    @property
    def writes(self) -> int:
        """The number of lists ever made valid in this flash."""


#: Boots an extension, which loads the list from flash.
BootMissions = Callable[[NorFlash, Board], Missions]
