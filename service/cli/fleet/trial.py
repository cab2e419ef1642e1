# SPDX-License-Identifier: GPL-3.0-or-later
"""Each vehicle's verdict on a mission, by its own rules: `fleet push --dry-run` and `fleet verify`."""

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any

import zenoh

from service.cli.fleet.payload import decode, part, text, whole
from service.cli.fleet.session import NO_COMMANDS, ask_each
from service.zenoh_link.keys import CHECK, MISSION_CURRENT

_TIMEOUT_S = 15.0


@dataclass(slots=True)
class Trial:
    """One vehicle's reply. `checksum`: of the records that the mission would become; `held`: of those it holds.

    `error`: why there is no verdict, or why it would reject the mission.
    """

    vehicle: str
    error: str | None = NO_COMMANDS
    count: int | None = None
    checksum: str | None = None
    held: str | None = None
    findings: tuple[Any, ...] = ()

    @property
    def is_held(self) -> bool | None:
        """True if the vehicle holds the mission, by its checksum; None if it gave no verdict."""
        return None if self.checksum is None else self.error is None and self.checksum == self.held

    @property
    def is_taken(self) -> bool | None:
        """True if the vehicle would accept the mission; None if it gave no verdict."""
        return None if self.checksum is None else self.error is None


def try_mission(session: zenoh.Session, prefix: str, names: Iterable[str], mission: bytes) -> list[Trial]:
    """Have each vehicle check the mission, and get the checksum of its own."""
    trials = {name: Trial(name) for name in names}
    for name, reply in ask_each(session, prefix, trials, CHECK.suffix, _TIMEOUT_S, mission):
        _take(trials[name], reply)
    for name, reply in ask_each(session, prefix, trials, MISSION_CURRENT.suffix, _TIMEOUT_S):
        if reply.ok is not None and (data := decode(reply.ok)) is not None:
            trials[name].held = text(data, "checksum")
    return list(trials.values())


def _take(trial: Trial, reply: zenoh.Reply) -> None:
    answer = reply.ok or reply.err
    data = None if answer is None else decode(answer)
    if data is None:
        trial.error = NO_COMMANDS
        return
    result = part(data, "result")
    if reply.ok is None or not isinstance(result, dict):
        trial.error = text(data, "error") or "it gives no reason"
        return
    findings = part(result, "findings")
    trial.findings = tuple(findings) if isinstance(findings, list) else ()
    trial.count, trial.checksum = whole(result, "count"), text(result, "checksum")
    trial.error = None if text(result, "result") != "REJECTED" else f"rejected: {_why(trial.findings)}"


def _why(findings: tuple[Any, ...]) -> str:
    last = findings[-1] if findings and isinstance(findings[-1], dict) else {}
    return text(last, "why") or "without a reason"
