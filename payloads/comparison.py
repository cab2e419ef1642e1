# SPDX-License-Identifier: GPL-3.0-or-later
"""A mission list as sent and as stored, side by side."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from payloads.mission_data import MAX_ITEMS, Json, correction_texts, mission_findings, mission_items
from protocols.mavlink.dialect import command_name
from protocols.mission_item import MissionItem
from reports.finding import DROPPED, REJECTED, Finding, value_label, without_defaults

_VALUES = ("command", "frame", "p1", "p2", "p3", "p4", "lat_e7", "lon_e7", "alt_m")


@dataclass(frozen=True, slots=True)
class ItemRow:
    """An item on both sides, or on one. `kind`: same, changed, dropped, rejected or added.

    `changes`: why each value changed, by its name.
    """

    kind: str
    left: MissionItem | None
    right: MissionItem | None
    changes: Mapping[str, str]

    def to_json(self) -> Json:
        left, right = (None if item is None else shown(item) for item in (self.left, self.right))
        return {"kind": self.kind, "left": left, "right": right, "changes": self.changes}


def stored_mission(mission: Json) -> Json:
    """A mission of the store (DaemonApi.show_mission) with rows that compare items as sent and as stored."""
    received = mission["received"]
    findings = mission_findings(received["findings"])
    sent, stored = mission_items(received["items"]), mission_items(received["stored_items"])
    return {
        "number": mission["number"],
        "received_at": received["received_at"],
        "source": received["source"],
        "verdict": received["verdict"],
        "ack": received["ack"],
        "outcome": mission["outcome"],
        "detail": mission["detail"],
        "checksum": received["checksum"],
        "findings": correction_texts(findings)[:MAX_ITEMS],
        "rows": [row.to_json() for row in sent_and_stored(sent[:MAX_ITEMS], stored, findings, received["sent_seqs"])],
        "rows_left_out": max(len(sent) - MAX_ITEMS, 0),
        "items": [shown(item) for item in (stored or sent)[:MAX_ITEMS]],
    }


def checked_mission(items: Sequence[MissionItem], verdict: Json) -> Json:
    """The verdict on a list, with rows like those of `stored_mission`. verdict: of DaemonApi.check."""
    findings = mission_findings(verdict["findings"])
    stored = mission_items(verdict["items"])
    return {
        "verdict": verdict["result"],
        "flight": verdict["flight"],
        "path": verdict["path"],
        "assumed": verdict["assumed"],
        "findings": correction_texts(findings),
        "rows": [row.to_json() for row in sent_and_stored(items, stored, findings, verdict["sent_seqs"])],
        "rows_left_out": 0,
        "items": [shown(item) for item in (stored or items)],
    }


def sent_and_stored(
    sent: Sequence[MissionItem],
    stored: Sequence[MissionItem],
    findings: Sequence[Finding],
    sent_seqs: Sequence[int | None] = (),
) -> list[ItemRow]:
    """One row per item sent, and one per inserted item. `stored`: empty for a list that was rejected or cleared.

    `sent_seqs`: as reports.verdict.SentSeqs.
    A row that differs only in filled-in defaults is "same". Its `changes` still hold their reasons.
    """
    dropped = {finding.seq: finding.why for finding in findings if finding.becomes == DROPPED}
    rejected = {finding.seq: finding.why for finding in findings if finding.becomes == REJECTED}
    changes_made = [finding for finding in findings if finding.was != finding.becomes]
    reasons = {(finding.seq, finding.field): finding.why for finding in changes_made}
    changed = {finding.seq for finding in without_defaults(changes_made)}
    numbers = sent_seqs or [seq for seq in range(len(sent)) if seq not in dropped]
    held_of: dict[int, MissionItem] = {}
    inserted_before: dict[int | None, MissionItem] = {}
    for held, number, following in zip(stored, numbers, [*numbers[1:], None], strict=False):
        if number is None:
            inserted_before[following] = held
        else:
            held_of[number] = held
    rows = []
    for seq, item in enumerate(sent):  # findings use the place in the list, not the item's seq
        if inserted := inserted_before.get(seq):
            rows.append(ItemRow("added", None, inserted, {}))
        if seq in dropped:
            rows.append(ItemRow("dropped", item, None, {"command": dropped[seq]}))
        elif seq in rejected:
            rows.append(ItemRow("rejected", item, None, {"command": rejected[seq]}))
        elif seq in held_of:
            changes = {name: why for name in _VALUES if (why := reasons.get((seq, name)))}
            rows.append(ItemRow("changed" if seq in changed else "same", item, held_of[seq], changes))
        else:
            rows.append(ItemRow("same", item, None, {}))
    return rows


def shown(item: MissionItem) -> Json:
    """An item for the page: numbers, None for values not given, the command's name and those of p1..p4."""
    params = [value_label(item.command, name) for name in ("p1", "p2", "p3", "p4")]
    values = {name: _given(getattr(item, name)) for name in _VALUES}
    return {"seq": item.seq, "name": command_name(item.command), "params": params, **values}


def _given(value: float | None) -> float | None:
    return None if value is None or value != value else value
