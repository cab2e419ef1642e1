# SPDX-License-Identifier: GPL-3.0-or-later
"""The missions of many vehicles: read, and each vehicle's verdict on a file by its own rules."""

from collections import Counter
from collections.abc import Collection
from dataclasses import dataclass

import zenoh

from fleet.payload import part, text, whole
from fleet.roll_call import replies_of
from fleet.session import NO_COMMANDS, NOT_UNDERSTOOD, answer_of, ask_each
from fleet.vehicle import BridgeId
from payloads.keys import CHECK, MISSION_CURRENT, full
from payloads.mission_data import Json, correction_texts, mission_findings, mission_items
from protocols.mission_item import MissionItem

#: The bridge may have to read the mission first: some seconds at 9600 baud.
_TIMEOUT_S = 15.0


@dataclass(frozen=True, slots=True)
class Held:
    """One vehicle's mission. `error`: why it is not known, with the rest empty."""

    vehicle: str
    items: tuple[MissionItem, ...] = ()
    count: int = 0
    checksum: str = ""
    error: str | None = None


def pull(session: zenoh.Session, prefix: str, names: Collection[str], bridges: Collection[BridgeId]) -> list[Held]:
    """Read the missions. One result per vehicle, in the order of `names`. Replies of storages are ignored."""
    meant = [bridge for bridge in bridges if bridge.vehicle in names]
    used = Counter(bridge.vehicle for bridge in meant)
    # One query to all takes no longer than a query to the slowest.
    only = next(iter(names)) if len(names) == 1 else "*"
    replies = replies_of(session, full(prefix, only, MISSION_CURRENT.suffix), meant, _TIMEOUT_S)
    held = {bridge.vehicle: _held(bridge.vehicle, data) for bridge, data in replies.items()}
    for name in names:
        if used[name] > 1:
            held[name] = Held(name, error="several bridges use this name: give each its own (zenoh.vehicle)")
    silent = "no reply: its bridge hangs, or the router's access control denies the query"
    return [held.get(name) or Held(name, error=silent) for name in names]


def _held(name: str, data: Json | None) -> Held:
    if data is None:
        return Held(name, error=NOT_UNDERSTOOD)
    count, checksum, items = whole(data, "count"), text(data, "checksum"), part(data, "items")
    if count is None or checksum is None:
        return Held(name, error="its flight controller's mission is not known")
    try:
        return Held(name, tuple(mission_items(items)), count, checksum)
    except ValueError as error:
        return Held(name, error=f"{NOT_UNDERSTOOD}: {error}")


@dataclass(slots=True)
class Trial:
    """One vehicle's reply. `count`, `checksum`: of the records that the mission would become there.

    `held_count`, `held`: count and checksum of the present mission. `error`: why there is no verdict, or a rejection.
    """

    vehicle: str
    error: str | None = NO_COMMANDS
    count: int | None = None
    checksum: str | None = None
    held_count: int | None = None
    held: str | None = None
    #: The corrections, one line each.
    corrections: tuple[str, ...] = ()

    @property
    def is_held(self) -> bool | None:
        """True if the vehicle holds the mission, by the checksum, or None without a verdict."""
        return None if self.checksum is None else self.error is None and self.checksum == self.held

    @property
    def is_accepted(self) -> bool | None:
        """True if the vehicle would accept the mission, or None without a verdict."""
        return None if self.checksum is None else self.error is None


def try_mission(
    session: zenoh.Session, prefix: str, names: Collection[str], bridges: Collection[BridgeId], mission: bytes
) -> list[Trial]:
    """Have each vehicle check the mission and send the checksum of the current one."""
    trials = {name: Trial(name) for name in names}
    for name, reply in ask_each(session, prefix, names, CHECK.suffix, _TIMEOUT_S, mission):
        if reply is not None:
            _take(trials[name], reply)
    for held in pull(session, prefix, names, bridges):
        if held.error is None:
            trials[held.vehicle].held_count, trials[held.vehicle].held = held.count, held.checksum
    return list(trials.values())


def _take(trial: Trial, reply: zenoh.Reply) -> None:
    result, trial.error = answer_of(reply)
    if result is None:
        return
    findings = mission_findings(part(result, "findings"))
    assumed = text(result, "assumed")
    trial.corrections = (*correction_texts(findings), *((f"Assumed: {assumed}",) if assumed else ()))
    trial.count, trial.checksum = whole(result, "count"), text(result, "checksum")
    match text(result, "result"):
        case "ACCEPTED":
            pass
        case "CLEARED":
            trial.error = "none of its items can be stored"
        case _:
            trial.error = findings[-1].text() if findings else "reason not given"
