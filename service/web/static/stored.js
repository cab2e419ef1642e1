// SPDX-License-Identifier: GPL-3.0-or-later
// What the Pi has stored: missions, and backups of the flight controller's settings. Each opens in place.
import { ask, postWithToken } from "./daemon.js";
import { byId, make, showEntries } from "./dom.js";
import { missionDetail, outcomeClass, when } from "./mission_tables.js";
import { writeForm } from "./write_form.js";

export async function showMissions(newest) {
  const { missions } = await ask("/api/missions");
  if (newest === null) {
    for (const id of ["missions", "upload"]) byId(id).replaceChildren(make("p", {}, "No mission has been received yet."));
    return;
  }
  byId("upload").replaceChildren(...missionDetail(await ask(`/api/missions/${newest.number}`)));
  showEntries(byId("missions"), missions, { name: "Mission", summary: missionSummary, contents: missionContents });
}

const missionSummary = ({ number, received_at: receivedAt, source, outcome, detail, item_count: items, finding_count: notes }) => [
  make("b", {}, String(number)), " ", make("span", { class: outcomeClass(outcome) }, outcome), ` ${when(receivedAt)}`,
  make("span", { class: "why" }, `${items} items, ${notes} notes, from ${source}. ${detail}`)];

const missionContents = async (number) => [
  writeForm(`Write mission ${number} again`, () => postWithToken(`/api/missions/${number}/restore`)),
  ...missionDetail(await ask(`/api/missions/${number}`))];

export async function showSettings() {
  const { backups } = await ask("/api/settings");
  if (!backups.length) return byId("settings").replaceChildren(make("p", {}, "No settings have been read yet."));
  showEntries(byId("settings"), backups, { name: "Settings", summary: settingsSummary, contents: async (number) => detail(await ask(`/api/settings/${number}`)) });
}

const settingsSummary = ({ number, taken_at: takenAt, occasion, changed_count: changed, setting_count: count, kind }) => [
  make("b", {}, String(number)), ` ${when(takenAt)}`,
  make("span", { class: "why" }, `${changed === null ? `first, ${count} settings` : `${changed} of ${count} changed`}, ${occasion}, ${kind}`)];

function detail({ number, before, changes, plan }) {
  const changed = before === null ? make("p", {}, "This is the first backup of this board.")
    : values(`Changed since backup ${before}`, changes.map(({ name, left, right }) => [name, left, right]), ["Before", "After"]);
  const file = make("p", {}, make("a", { class: "button", href: `/api/settings/${number}/file` }, "Save as a .param file"));
  return [changed, file, ...restore(number, plan)];
}

function restore(number, plan) {
  if (plan.refused) return [make("p", {}, plan.refused)];
  const out = plan.left_out.map(({ name, why }) => make("li", {}, `${name}: ${why}`));
  const leftOut = out.length ? [make("p", {}, "These cannot be restored:"), make("ul", {}, ...out)] : [];
  const notice = plan.notice ? [make("p", { class: "bad" }, plan.notice)] : [];
  if (!plan.changes.length) return [make("p", {}, "The flight controller already has these settings."), ...leftOut];
  const rows = plan.changes.map(({ name, was, becomes }) => [name, was, becomes]);
  const label = `Restore and save ${rows.length} ${rows.length === 1 ? "setting" : "settings"}`;
  return [values("Restoring would change", rows, ["Now", "Restored"]), ...leftOut, ...notice,
    writeForm(label, () => postWithToken(`/api/settings/${number}/restore`))];
}

function values(title, rows, columns) {
  if (!rows.length) return make("p", {}, "Nothing changed.");
  const head = make("tr", {}, ...["Name", ...columns].map((each) => make("th", { scope: "col" }, each)));
  const body = rows.map(([name, ...each]) => make("tr", {}, make("td", {}, name), ...each.map((value) => make("td", { class: "number" }, shown(value)))));
  return make("table", {}, make("caption", {}, title), make("thead", {}, head), make("tbody", {}, ...body));
}

// Values have single precision: 0.1 must not be shown as 0.10000000149.
const shown = (value) => (value === null ? "-" : typeof value === "number" ? String(Number.isInteger(value) ? value : Number(value.toPrecision(7))) : value);
