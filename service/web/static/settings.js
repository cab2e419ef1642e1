// SPDX-License-Identifier: GPL-3.0-or-later
// The history of the flight controller's settings; each backup opens below its own row, with what restoring it changes.
import { byId, make } from "./dom.js";
import { ask, post } from "./daemon.js";
import { when } from "./mission_detail.js";
import { writeForm } from "./write_form.js";

const list = byId("settings");
let open = null; // the open backup: its number and its row

export async function showSettings() {
  const { backups } = await ask("/api/settings");
  if (backups.length === 0) return list.replaceChildren("No settings have been read yet.");
  const isKept = open !== null && backups.some(({ number }) => number === open.number);
  if (!isKept) open = null;
  const rows = backups.flatMap((backup) => [row(backup), ...(open?.number === backup.number ? [open.row] : [])]);
  list.replaceChildren(make("table", { class: "missions" }, head("No.", "Taken", "Changed", "Details"), make("tbody", {}, ...rows)));
}

function row({ number, taken_at: takenAt, occasion, changed_count: changed, setting_count: count, kind }) {
  const isOpen = open?.number === number, text = isOpen ? "Hide" : "Show";
  const button = make("button", { type: "button", "aria-expanded": String(isOpen), "aria-label": `${text} settings ${number}`,
    onclick: () => (open?.number === number ? hide() : show(number)) }, text);
  return make("tr", {}, make("td", { class: "number" }, String(number)), make("td", {}, when(takenAt), make("span", { class: "why" }, occasion)),
    make("td", {}, changed === null ? `first, ${count} settings` : `${changed} of ${count}`, make("span", { class: "why" }, kind)), make("td", {}, button));
}

async function hide() {
  open = null;
  await showSettings();
}

async function show(number) {
  const cell = make("td", { colspan: 4, tabindex: -1, "aria-label": `Settings ${number}` });
  open = { number, row: make("tr", { class: "detail" }, cell) };
  await showSettings();
  try {
    cell.append(...detail(await ask(`/api/settings/${number}`)));
  } catch (error) {
    cell.append(make("p", { class: "bad" }, error.message));
  }
  cell.focus({ preventScroll: true });
}

function detail({ number, before, changes, plan }) {
  const changed = before === null ? make("p", {}, "This is the first backup of this board.")
    : values(`Changed since backup ${before}`, changes.map(({ name, left, right }) => [name, left, right]), ["Before", "After"]);
  const file = make("p", {}, make("a", { href: `/api/settings/${number}/file` }, "Save as a .param file"));
  return [make("h3", {}, `Settings ${number}`), changed, file, make("h4", {}, "Restore"), ...restore(number, plan)];
}

function restore(number, plan) {
  if (plan.refused) return [make("p", {}, plan.refused)];
  const out = plan.left_out.map(({ name, why }) => make("li", {}, `${name}: ${why}`));
  const leftOut = out.length ? [make("p", {}, "These cannot be restored:"), make("ul", {}, ...out)] : [];
  const notice = plan.notice ? [make("p", { class: "bad" }, plan.notice)] : [];
  if (!plan.changes.length) return [make("p", {}, "The flight controller has these settings."), ...leftOut];
  const rows = plan.changes.map(({ name, was, becomes }) => [name, was, becomes]);
  const label = `Restore and save ${rows.length} ${rows.length === 1 ? "setting" : "settings"}`;
  return [values("Restoring would change", rows, ["Now", "Restored"]), ...leftOut, ...notice,
    writeForm(label, (token) => post(`/api/settings/${number}/restore`, token))];
}

function values(title, rows, columns) {
  if (!rows.length) return make("p", {}, "Nothing changed.");
  const body = rows.map(([name, ...each]) => make("tr", {}, make("td", {}, name), ...each.map((value) => make("td", { class: "number" }, shown(value)))));
  return make("table", {}, make("caption", {}, title), head("Name", ...columns), make("tbody", {}, ...body));
}

const head = (...titles) => make("thead", {}, make("tr", {}, ...titles.map((title) => make("th", { scope: "col" }, title))));

// Values have single precision: 0.1 must not be shown as 0.10000000149.
const shown = (value) => (value === null ? "-" : typeof value === "number" ? String(Number.isInteger(value) ? value : Number(value.toPrecision(7))) : value);
