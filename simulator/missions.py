# SPDX-License-Identifier: GPL-3.0-or-later
"""The seam between the firmware and its mission extension: two things fit it, the model and the compiled core."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Protocol

from simulator.flash import NorFlash
from simulator.options import Faults, SimOptions


@dataclass(slots=True)
class Board:
    """What the extension sees and changes of the rest of the firmware. Times are seconds."""

    options: SimOptions
    faults: Faults
    wp_radius_cm: int
    armed: bool = False
    config_write_due: float | None = None

    @property
    def write_pending(self) -> bool:
        """Whether a write of the configuration is scheduled."""
        return self.config_write_due is not None or self.faults.busy

    def set_wp_radius(self, radius_cm: int, now: float) -> None:
        """Take over another gps_wp_radius, which is stored a little later."""
        self.wp_radius_cm = radius_cm
        self.config_write_due = now + self.options.config_write_delay_ms / 1000


class Missions(Protocol):
    """The extension from one boot to the next (docs/msp-mission.md)."""

    def answer(self, command: int, payload: bytes, now: float) -> bytes | None:
        """Return the reply's payload; None if the command is none of the extension's. PowerCutError."""

    def drop_stale(self, now: float) -> None:
        """Drop an open transfer if the craft is armed, or if nothing was heard of it for too long."""

    @property
    def stored(self) -> bytes:
        """The stored list's records."""

    def store(self, records: bytes) -> None:
        """Make records the stored list that the firmware got some other way (nm_store). FlashError, PowerCutError."""

    @property
    def writes(self) -> int:
        """How many lists were ever made valid in this flash."""


#: Boots an extension, which finds its list in the flash.
BootMissions = Callable[[NorFlash, Board], Missions]
