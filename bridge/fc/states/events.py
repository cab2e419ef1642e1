# SPDX-License-Identifier: GPL-3.0-or-later
"""The events that end a state of the line."""

from collections.abc import Sequence
from dataclasses import dataclass, field

from bridge.fc.autosense import Found
from bridge.fc.profile import FlightController
from bridge.line.msp_link import MspLink
from bridge.line.pending_replies import PendingReplies


@dataclass(frozen=True, slots=True)
class PortOpened:
    """The port is open."""


@dataclass(frozen=True, slots=True)
class PortClosed:
    """The port is gone. `why` is None if the bridge closed it itself."""

    why: str | None


@dataclass(frozen=True, slots=True)
class MspFound:
    """The board answers MSP. `pending`: replies that it may still owe to the search."""

    found: Found
    pending: PendingReplies


@dataclass(frozen=True, slots=True)
class MavlinkFound:
    """MAVLink was heard."""

    found: Found


@dataclass(frozen=True, slots=True)
class FrskyFound:
    """FrSky telemetry was heard."""

    found: Found


@dataclass(frozen=True, slots=True)
class CliFound:
    """The board echoes what it is asked: it is in its command line."""

    found: Found


@dataclass(frozen=True, slots=True)
class Identified:
    """The board on an MSP link is known."""

    controller: FlightController
    found: Found
    link: MspLink


@dataclass(frozen=True, slots=True)
class Lost:
    """The line fell silent, or carries something else. `first`: speeds to try before all others."""

    why: str
    first: Sequence[int] = ()
    pending: PendingReplies = field(default_factory=PendingReplies)


Event = PortOpened | PortClosed | MspFound | MavlinkFound | FrskyFound | CliFound | Identified | Lost
