# SPDX-License-Identifier: GPL-3.0-or-later
"""Each vehicle's verdict on a mission, by its own rules: `fleet push --dry-run` and `fleet verify`."""

from collections.abc import Collection
from dataclasses import dataclass

import zenoh

from fleet.payload import decode, part, text, whole
from fleet.pull import pull
from fleet.session import NO_COMMANDS, ask_each
from fleet.vehicle import BridgeId
from payloads.keys import CHECK
from payloads.mission_data import correction_texts, mission_findings

_TIMEOUT_S = 15.0


@dataclass(slots=True)
class Trial:
    """One vehicle's reply. `count`, `checksum`: of the records that the mission would become there.

    `held_count`, `held`: count and checksum of its present mission. `error`: why there is no verdict, or a rejection.
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
        """True if the vehicle holds the mission, by its checksum; None if it gave no verdict."""
        return None if self.checksum is None else self.error is None and self.checksum == self.held

    @property
    def is_accepted(self) -> bool | None:
        """True if the vehicle would accept the mission; None if it gave no verdict."""
        return None if self.checksum is None else self.error is None


def try_mission(
    session: zenoh.Session, prefix: str, names: Collection[str], bridges: Collection[BridgeId], mission: bytes
) -> list[Trial]:
    """Have each vehicle check the mission and send the checksum of its current one."""
    trials = {name: Trial(name) for name in names}
    for name, reply in ask_each(session, prefix, names, CHECK.suffix, _TIMEOUT_S, mission):
        if reply is not None:
            _take(trials[name], reply)
    for held in pull(session, prefix, names, bridges):
        if held.error is None:
            trials[held.vehicle].held_count, trials[held.vehicle].held = held.count, held.checksum
    return list(trials.values())


def _take(trial: Trial, reply: zenoh.Reply) -> None:
    answer = reply.ok or reply.err
    data = None if answer is None else decode(answer)
    if data is None:
        return
    result = part(data, "result")
    if reply.ok is None or not isinstance(result, dict):
        trial.error = text(data, "error") or "it gives no reason"
        return
    findings = mission_findings(part(result, "findings"))
    trial.corrections = tuple(correction_texts(findings))
    trial.count, trial.checksum = whole(result, "count"), text(result, "checksum")
    match text(result, "result"):
        case "ACCEPTED":
            trial.error = None
        case "CLEARED":
            trial.error = "no item of it can be stored"
        case _:
            trial.error = findings[-1].text() if findings else "it gives no reason"
