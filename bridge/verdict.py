"""What a checked mission list comes to."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from enum import Enum, auto

from bridge.finding import Finding
from protocols.mission_item import MissionItem, MissionResult
from protocols.wp_record import WpRecord


class Result(Enum):
    """What becomes of a list."""

    ACCEPTED = auto()
    CLEARED = auto()
    REJECTED = auto()


@dataclass(frozen=True, slots=True)
class Verdict:
    """A checked list.

    `records` is what the flight controller is to hold, `items` the same as it reads back, both empty unless ACCEPTED.
    `roi_commands` maps stored seq to the MAV_CMD with which a region of interest was sent. `findings` come in the order
    of the list; that of a rejection is the last.
    """

    result: Result
    ack: MissionResult
    records: tuple[WpRecord, ...] = ()
    items: tuple[MissionItem, ...] = ()
    findings: tuple[Finding, ...] = ()
    roi_commands: Mapping[int, int] = field(default_factory=dict)
