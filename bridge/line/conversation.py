# SPDX-License-Identifier: GPL-3.0-or-later
"""Conversations with the flight controller and the store, written top to bottom without any I/O.

A conversation is a generator. It yields one effect at a time and is sent the effect's answer;
`bridge.line.runner.Runner` carries the effects out. At the `yield`, LinkLost is raised when the line goes down, and its
subclasses Stopped when the bridge is stopping and OutOfTime when the conversation's time limit has passed.

>>> def is_disarmed(arm_mask: int) -> Conversation[bool]:
...     status = yield from ask_status()
...     return status is not None and not status.box_flags & arm_mask
>>> runner.start(is_disarmed(1), on_done, now)
"""

from collections.abc import Generator
from dataclasses import dataclass, replace
from typing import Any, TypeVar

from bridge.model.missions import ArrivedMission, Outcome
from protocols.mission_item import ListIdentity
from protocols.msp.commands import Msp
from protocols.msp.frame import MspFrame, frame_size, request
from protocols.msp.telemetry import STATUS_SIZE, StatusReport, decode_status


class LinkLost(Exception):
    """The flight controller cannot be reached."""


class Stopped(LinkLost):
    """The bridge is stopping. The line is still up, to leave the flight controller in a clean state."""


class OutOfTime(LinkLost):
    """The conversation's limit has passed. The line is still up, to leave the flight controller in a clean state."""


@dataclass(frozen=True, slots=True)
class TimeLimit:
    """Raise OutOfTime after `seconds`, plus the time of `size` bytes on the line. It replaces an earlier limit."""

    seconds: float
    size: int = 0


@dataclass(frozen=True, slots=True)
class Send:
    """Send a request frame. `reply_size`: the size of the whole reply frame, bytes, for the bound on pending replies.

    An `exclusive` request must be answered before the next is sent: the flight controller may be writing flash.
    `is_kept`: the reply goes into the link's LastReplies. `may_wait`: the reply may be read a few ms late.
    """

    frame: bytes
    command: int
    reply_size: int
    exclusive: bool = False
    is_kept: bool = False
    may_wait: bool = False


@dataclass(frozen=True, slots=True)
class Receive:
    """Send `request`, if any. Wait for the next reply to one of `commands`. Answer: the frame, or None on timeout."""

    commands: frozenset[int]
    request: Send | None = None


@dataclass(frozen=True, slots=True)
class Pause:
    """Wait. Answer: None."""

    seconds: float


@dataclass(frozen=True, slots=True)
class Save:
    """Store a received mission, see BeginSave."""

    mission: ArrivedMission


@dataclass(frozen=True, slots=True)
class BeginSave:
    """Start to store a received mission, and continue meanwhile. Answer: None."""

    save: Save


@dataclass(frozen=True, slots=True)
class EndSave:
    """Wait for the mission of the last BeginSave. Answer: the mission's number, or None if that failed or timed out."""


@dataclass(frozen=True, slots=True)
class Conclude:
    """Store the outcome of mission `number` with one sentence. Answer: True if stored."""

    number: int
    outcome: Outcome
    detail: str


@dataclass(frozen=True, slots=True)
class Recall:
    """Look up a list that was verified before. Answer: a RecalledMission, or None if there was none."""

    identity: ListIdentity


@dataclass(frozen=True, slots=True)
class NoteReader:
    """Store that a ground station has read the list back, and counts the items as read. `reader`: its Sender.identity.

    No conversation waits for it.
    """

    identity: ListIdentity
    reader: str


@dataclass(frozen=True, slots=True)
class FindPending:
    """Look up missions whose end an earlier run of the daemon did not see. Answer: PendingMissions, None if none."""


Effect = (
    TimeLimit | Send | Receive | Pause
    | BeginSave | EndSave | Conclude | Recall | FindPending
)  # fmt: skip
StoreEffect = Save | Conclude | Recall | NoteReader | FindPending

_MAX_ASKS = 5
_STATUS = request(Msp.STATUS)

T = TypeVar("T")
Conversation = Generator[Effect, Any, T]


def send(frame: bytes, command: int, reply_payload: int, *, exclusive: bool = False) -> Send:
    """Make a Send of a request whose reply has `reply_payload` payload bytes."""
    return Send(frame, command, frame_size(command, reply_payload), exclusive)


def ask(
    frame: bytes, command: int, reply_payload: int, *, tries: int = 3, exclusive: bool = False, is_kept: bool = False
) -> Conversation[MspFrame | None]:
    """Send a request and wait for the reply, with retries. Returns None if none was answered."""
    question = Send(frame, command, frame_size(command, reply_payload), exclusive, is_kept)
    for _ in range(tries):
        reply: MspFrame | None = yield Receive(frozenset((command,)), question)
        if reply is not None:
            return reply
    return None


def ask_surely(
    frame: bytes, command: int, reply_payload: int, *, stable: int | None = None
) -> Conversation[MspFrame | None]:
    """Ask until two replies in a row are equal. Returns None if they never are, or if a reply is missing.

    The 8-bit checksum misses some pairs of flipped bits: with one wrong bit in a thousand, one INFO reply in 500 and
    one BOXNAMES reply in 25 are damaged without notice. An error frame is a reply, too.
    stable: compare only this many bytes of the payload, because the others may change, or None if all.
    """
    before: MspFrame | None = None
    for _ in range(_MAX_ASKS):
        reply = yield from ask(frame, command, reply_payload, is_kept=True)
        if reply is None or (before is not None and _stable_part(reply, stable) == _stable_part(before, stable)):
            return reply
        before = reply
    return None


def ask_status(*, tries: int = 3) -> Conversation[StatusReport | None]:
    """STATUS as of now, which telemetry may not show yet, or None if it was not answered."""
    reply = yield from ask(_STATUS, Msp.STATUS, STATUS_SIZE, tries=tries)
    return None if reply is None else decode_status(reply.payload)


def ask_armed(arm_bit: int | None, *, tries: int = 3) -> Conversation[bool | None]:
    """True if the board says now that it is armed, or None if it does not answer. arm_bit: see FlightController."""
    status = yield from ask_status(tries=tries)
    return None if status is None or arm_bit is None else bool(status.box_flags >> arm_bit & 1)


def _stable_part(reply: MspFrame, size: int | None) -> MspFrame:
    return replace(reply, payload=reply.payload[:size])
