"""The seam between missions and the flight controllers that store them.

A dialect is one kind of flight controller: how a list is put there, proven and read back.
`bridge.harakiri` and `bridge.harakiri_mavlink` are two.
"""

from collections.abc import Callable
from dataclasses import dataclass
from enum import Enum
from typing import Protocol

from bridge.mission_check import RuleProfile
from bridge.procedure import Procedure
from protocols.wp_record import ListIdentity, WpRecord


class StoreState(Enum):
    """Whether the flight controller would take a list now."""

    READY = "ready"
    ARMED = "armed"
    BUSY = "busy"  # a configuration write is scheduled or running


@dataclass(frozen=True, slots=True)
class StoreReport:
    """What the flight controller says of its mission store. `stored` None: not known without reading the list."""

    state: StoreState
    profile: RuleProfile
    stored: ListIdentity | None


class PushFailure(Enum):
    """Why a list did not get there. The flight controller's old list is whole in every case but UNCERTAIN."""

    ARMED = "the flight controller is armed: disarm first"
    BUSY = "the flight controller is busy writing its configuration: try again"
    NO_SPACE = "the list does not fit the flight controller"
    REFUSED = "the flight controller refused a record"
    UNSAFE = "an item's bytes would set off a trap of the firmware: move a waypoint a little"
    FLASH = "the flight controller could not write its flash; its old mission is kept"
    NO_ANSWER = "the flight controller does not answer; its old mission is kept"
    UNCERTAIN = "the flight controller fell silent while writing: read the mission back"


@dataclass(frozen=True, slots=True)
class PushResult:
    """`failure` is None when the list was proven there. `unchanged`: it was there already.

    `held`: what is there, if the flight controller could not take the records exactly.
    """

    failure: PushFailure | None
    unchanged: bool = False
    held: tuple[WpRecord, ...] | None = None


#: Called with the number of records that the flight controller has.
PushProgress = Callable[[int], None]


class MissionDialect(Protocol):
    """What the bridge asks of a flight controller that stores missions."""

    @property
    def wp_radius_cm(self) -> int:
        """The least hit radius as last heard, cm."""

    def report(self) -> Procedure[StoreReport | None]:
        """Ask the flight controller; None if it does not answer."""

    def push(self, records: tuple[WpRecord, ...], progress: PushProgress) -> Procedure[PushResult]:
        """Put the list there and prove it. The empty list clears."""

    def pull(self) -> Procedure[tuple[WpRecord, ...] | None]:
        """Read the list that is there, checked against its checksum; None if that fails."""

    def set_wp_radius(self, wp_radius_cm: int) -> Procedure[int | None]:
        """Set gps_wp_radius, 0..2000 cm; the value in force, None if there was no answer."""
