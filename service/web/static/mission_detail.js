// SPDX-License-Identifier: GPL-3.0-or-later
// One mission in full: its outcome, its notes, and its items as sent and as stored.
import { make } from "./dom.js";
import { pairKey, pairTable } from "./tables.js";

export const outcomeClass = (outcome) => (outcome === "VERIFIED" ? "good" : outcome === "PENDING" ? "soft" : "bad");
export const when = (seconds) => new Date(seconds * 1000).toLocaleString();

// mission: of /api/missions/N.
export function missionDetail(mission) {
  const head = make("p", {}, make("b", { class: outcomeClass(mission.outcome) }, mission.outcome),
    ` Mission ${mission.number}, ${when(mission.received_at)}, from ${mission.source}. ${mission.detail}`);
  return [head, ...comparison(mission)];
}

// list: findings and rows, of a stored mission or of a checked file; defaults that were filled in are no findings.
export function comparison(list) {
  const { findings, rows, rows_left_out: leftOut } = list;
  const notes = findings.length ? make("details", {}, make("summary", {}, `${findings.length} ${findings.length === 1 ? "note" : "notes"}`),
    make("ul", {}, ...findings.map((text) => make("li", {}, text)))) : make("p", {}, "No item was changed or dropped.");
  const more = leftOut ? [make("p", {}, `${leftOut} more items are not shown.`)] : [];
  return [notes, pairKey(rows), ...pairTable(rows, ["As sent", "As stored"]), ...more];
}
