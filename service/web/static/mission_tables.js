// SPDX-License-Identifier: GPL-3.0-or-later
// Missions as tables: one list, or as sent and as stored with the outcome and the notes.
import { make } from "./dom.js";

const PARAMS = ["p1", "p2", "p3", "p4"], NAMES = { alt_m: "Alt", frame: "frame", lat_e7: "Lat", lon_e7: "Long" };
const KINDS = {
  changed: "changed", dropped: "dropped: not stored", rejected: "the list was rejected because of this item",
  added: "added",
};

export function listTable(items) {
  const rows = items.map((item) => make("tr", {}, number(item), make("td", {}, ...values(item, {}))));
  return table(["No.", "Command"], rows);
}

// rows: of /api/missions/N; titles: of the left and the right column. Equal rows are shown on request.
function pairTable(rows, titles) {
  const whole = table(["No.", ...titles], rows.map((row) => pairRow(row, titles)));
  whole.className = "pairs";
  const equal = rows.filter((row) => row.kind === "same").length;
  if (!equal) return [whole];
  const isShort = equal === rows.length;
  const show = (all) => {
    whole.classList.toggle("only-changes", !all);
    whole.hidden = isShort && !all;
    button.textContent = all ? "Show only changes" : `Show all ${rows.length} items`;
    button.setAttribute("aria-expanded", String(all));
  };
  const button = make("button", { type: "button", class: "show-all", onclick: () => show(button.getAttribute("aria-expanded") !== "true") });
  show(false);
  return [whole, make("p", {}, button)];
}

function pairKey(rows) {
  const kinds = Object.keys(KINDS).filter((kind) => rows.some((row) => row.kind === kind));
  return make("p", {}, ...kinds.flatMap((kind) => [make("span", { class: `key ${kind}` }, KINDS[kind]), " "]));
}

function pairRow(row, titles) {
  const reasons = Object.entries(row.changes).filter(([, why]) => why)
    .map(([name, why]) => make("span", { class: "why" }, name === "command" ? why : `${label(row.left, name)}: ${why}`));
  const left = make("td", { "data-title": titles[0] }, ...(row.left ? values(row.left, row.changes) : ["–"]));
  const right = make("td", { "data-title": titles[1] }, ...(row.right ? values(row.right, row.changes) : [KINDS[row.kind] && row.left ? KINDS[row.kind] : "–"]), ...reasons);
  return make("tr", { class: row.kind }, number(row.left ?? row.right, row.right), left, right);
}

function number(item, becomes = item) {
  const text = becomes && becomes.seq !== item.seq ? `${item.seq} → ${becomes.seq}` : String(item.seq);
  return make("td", { class: "number" }, text);
}

function values(item, changes) {
  const shown = [...PARAMS, ...Object.keys(NAMES)].filter((name) => name in changes || (name !== "frame" && item[name]));
  const command = make("span", { class: `value${"command" in changes ? " is-changed" : ""}` }, make("b", {}, item.name));
  return [command, ...shown.flatMap((name) => [" ", make(
    "span", { class: `value${name in changes ? " is-changed" : ""}` }, `${label(item, name)} ${text(name, item[name])}`)])];
}

// The name in Mission Planner.
const label = (item, name) => NAMES[name] ?? item.params[PARAMS.indexOf(name)];

function text(name, value) {
  if (value === null) return "not given";
  if (name === "lat_e7" || name === "lon_e7") return (value / 1e7).toFixed(7);
  if (typeof value === "string") return value;
  return `${Math.round(value * 1000) / 1000}${name === "alt_m" ? " m" : ""}`;
}

function table(titles, rows) {
  const head = make("tr", {}, ...titles.map((title) => make("th", { scope: "col" }, title)));
  return make("table", {}, make("thead", {}, head), make("tbody", {}, ...rows));
}

export const outcomeClass = (outcome) => (outcome === "VERIFIED" ? "good" : outcome === "PENDING" ? "soft" : "bad");
export const when = (seconds) => new Date(seconds * 1000).toLocaleString();

// mission: of /api/missions/N.
export function missionDetail(mission) {
  const head = make("p", {}, make("b", { class: outcomeClass(mission.outcome) }, mission.outcome),
    ` Mission ${mission.number}, ${when(mission.received_at)}, from ${mission.source}. ${mission.detail}`);
  return [head, ...comparison(mission)];
}

// list: findings and rows, of a stored mission or of a checked file; filled-in defaults are not findings.
export function comparison(list) {
  const { findings, rows, rows_left_out: leftOut } = list;
  const notes = findings.length ? make("details", {}, make("summary", {}, `${findings.length} ${findings.length === 1 ? "note" : "notes"}`),
    make("ul", {}, ...findings.map((text) => make("li", {}, text)))) : make("p", {}, "No item was changed or dropped.");
  const more = leftOut ? [make("p", {}, `${leftOut} more items are not shown.`)] : [];
  return [notes, pairKey(rows), ...pairTable(rows, ["As sent", "As stored"]), ...more];
}
