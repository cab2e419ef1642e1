// SPDX-License-Identifier: GPL-3.0-or-later
// The missions that came in: the last one, the list, one that is looked at, two compared, one restored.
import { byId, make } from "./dom.js";
import { ask, tell } from "./daemon.js";
import { pairKey, pairTable } from "./tables.js";

const SENT_STORED = ["As sent", "As stored"];
let token = ""; // kept no longer than the page

export async function showMissions(newest) {
  const { missions } = await ask("/api/missions");
  byId("missions").replaceChildren(missions.length ? missionTable(missions) : "No mission has come in yet.");
  byId("upload").replaceChildren(...(newest === null ? ["No mission has come in yet."] : asSentAndStored(await ask(`/api/missions/${newest.number}`))));
}

export function showRestore(restore, armed) {
  for (const button of document.querySelectorAll("button.restore")) {
    button.disabled = armed === true;
    button.title = armed === true ? "Armed: disarm to change the mission" : "";
  }
  if (restore === null) return;
  const text = restore.done ? restore.text : `${restore.records} records written …`;
  const line = byId("restore-state"), whole = `Restore of mission ${restore.mission}: ${text}`;
  if (line.textContent !== whole) line.textContent = whole;
  line.className = restore.done ? (restore.ok ? "good" : "bad") : "";
}

byId("compare-form").addEventListener("submit", (event) => {
  event.preventDefault();
  const [first, second] = [byId("first").value, byId("second").value].map((text) => encodeURIComponent(text.trim()));
  choose(async () => {
    const { rows } = await ask(`/api/missions/${first}/difference/${second}`);
    const equal = rows.every((row) => row.kind === "same");
    return [make("h3", {}, `Mission ${first} and mission ${second}, as sent`), equal ? "No difference." : pairKey(["changed", "added", "removed"]),
      pairTable(rows, [`Mission ${first}`, `Mission ${second}`])];
  });
});

async function choose(contents) {
  let children;
  try {
    children = await contents();
  } catch (error) {
    children = [make("p", { class: "bad" }, error.message)];
  }
  byId("chosen").replaceChildren(...children);
  byId("chosen").focus({ preventScroll: true });
  byId("chosen").scrollIntoView({ block: "nearest" });
}

function missionTable(missions) {
  const rows = missions.map((mission) => make("tr", {},
    make("td", { class: "number" }, String(mission.number)),
    make("td", {}, when(mission.received_at), make("span", { class: "why" }, mission.source)),
    make("td", {}, make("span", { class: mission.outcome === "VERIFIED" ? "good" : "bad" }, mission.outcome),
      make("span", { class: "why" }, `${mission.item_count} items, ${mission.finding_count} notes. ${mission.detail}`)),
    make("td", {}, make("button", { type: "button", "aria-label": `Show mission ${mission.number}`, onclick: () => choose(() => oneMission(mission.number)) }, "Show"))));
  const head = make("tr", {}, ...["No.", "Received", "Outcome", ""].map((title) => make("th", { scope: "col" }, title)));
  return make("table", {}, make("thead", {}, head), make("tbody", {}, ...rows));
}

async function oneMission(number) {
  const mission = await ask(`/api/missions/${number}`);
  return [make("h3", {}, `Mission ${number}`), restoreForm(number), ...asSentAndStored(mission)];
}

function asSentAndStored(mission) {
  const head = make("p", {}, make("b", { class: mission.outcome === "VERIFIED" ? "good" : "bad" }, mission.outcome),
    ` Mission ${mission.number}, ${when(mission.received_at)}, from ${mission.source}. ${mission.detail}`);
  const more = mission.rows_left_out ? [make("p", {}, `${mission.rows_left_out} more items are not shown.`)] : [];
  const notes = mission.findings.length ? [make("details", {}, make("summary", {}, `${mission.findings.length} notes`),
    make("ul", {}, ...mission.findings.map((text) => make("li", {}, text))))] : [make("p", {}, "Stored as it was sent.")];
  const isStored = mission.verdict === "ACCEPTED";
  return [head, ...notes, pairKey(isStored ? ["changed", "dropped"] : ["dropped"]), pairTable(mission.rows, SENT_STORED), ...more];
}

function restoreForm(number) {
  const input = make("input", { type: "password", autocomplete: "off", required: "", value: token });
  const button = make("button", { class: "restore" }, `Write mission ${number} to the flight controller`);
  return make("form", { class: "row", onsubmit: async (event) => {
    event.preventDefault();
    try {
      token = input.value.trim();
      await tell(`/api/missions/${number}/restore`, token);
    } catch (error) {
      byId("restore-state").className = "bad";
      byId("restore-state").textContent = error.message;
    }
  } }, make("label", {}, "Token (it stands in a file on the Pi) ", input), button);
}

function when(seconds) {
  return new Date(seconds * 1000).toLocaleString();
}
