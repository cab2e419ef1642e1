// SPDX-License-Identifier: GPL-3.0-or-later
// The stored missions: the latest upload, and a list; each mission opens below its own row.
import { byId, make, setClass, setText } from "./dom.js";
import { ask, post } from "./daemon.js";
import { missionDetail, outcomeClass, when } from "./mission_detail.js";
import { writeForm } from "./write_form.js";

const list = byId("missions");
const body = make("tbody");
const rows = new Map(); // by mission number; existing rows stay, with their open details and selections

export async function showMissions(newest) {
  const { missions } = await ask("/api/missions");
  const upload = newest === null ? null : await ask(`/api/missions/${newest.number}`);
  if (upload === null) {
    for (const id of ["missions", "upload"]) byId(id).replaceChildren("No mission has been received yet.");
    return;
  }
  byId("upload").replaceChildren(...missionDetail(upload));
  if (body.parentElement === null) list.replaceChildren(table());
  const numbers = new Set(missions.map((mission) => mission.number));
  for (const [number, row] of rows) {
    if (numbers.has(number)) continue;
    rows.delete(number);
    row.close();
    row.element.remove();
  }
  for (const mission of [...missions].reverse()) { // oldest first: new ones go on top
    if (!rows.has(mission.number)) {
      rows.set(mission.number, makeRow(mission.number));
      body.prepend(rows.get(mission.number).element);
    }
    rows.get(mission.number).update(mission);
  }
}

function table() {
  const head = make("tr", {}, ...["No.", "Received", "Outcome", "Details"].map((title) => make("th", { scope: "col" }, title)));
  return make("table", { class: "missions" }, make("thead", {}, head), body);
}

function makeRow(number) {
  const received = make("span"), source = make("span", { class: "why" }), outcome = make("span"), detail = make("span", { class: "why" });
  const button = make("button", { type: "button", "aria-expanded": "false", "aria-label": `Show mission ${number}`, onclick: () => (open ? close() : show()) }, "Show");
  const element = make("tr", {}, make("td", { class: "number" }, String(number)), make("td", {}, received, source),
    make("td", {}, outcome, detail), make("td", {}, button));
  let open = null;

  async function show() {
    const cell = make("td", { colspan: 4, tabindex: -1, "aria-label": `Mission ${number}` });
    open = make("tr", { class: "detail" }, cell);
    mark("Hide", "true");
    element.after(open);
    try {
      const mission = await ask(`/api/missions/${number}`);
      cell.append(make("h3", {}, `Mission ${number}`), writeForm(`Write mission ${number} to the flight controller`, (token) => post(`/api/missions/${number}/restore`, token)), ...missionDetail(mission));
    } catch (error) {
      cell.append(make("p", { class: "bad" }, error.message));
    }
    cell.focus({ preventScroll: true });
  }

  function close() {
    open?.remove();
    open = null;
    mark("Show", "false");
  }

  function mark(text, isExpanded) {
    button.textContent = text;
    button.setAttribute("aria-label", `${text} mission ${number}`);
    button.setAttribute("aria-expanded", isExpanded);
  }

  function update(mission) {
    setText(received, when(mission.received_at));
    setText(source, mission.source);
    setText(outcome, mission.outcome);
    setClass(outcome, outcomeClass(mission.outcome));
    setText(detail, `${mission.item_count} items, ${mission.finding_count} notes. ${mission.detail}`);
  }

  return { element, update, close };
}
