// SPDX-License-Identifier: GPL-3.0-or-later
// Doctor's findings, each with its remedy as a button where the helper can carry it out; and the state of the wires, live.
import { make, setText } from "./dom.js";
import { action, aftermath, askPi } from "./pi_request.js";
import { evidence } from "./state_bar.js";

const KINDS = { ok: "good", note: "soft", problem: "bad" };
const wires = make("p", { id: "wires" });

export function doctorPanel() {
  const result = make("p", { class: "result", role: "status" }), list = make("ul", { class: "findings" });
  const button = action("Check now", result, () => examine(list, result));
  return make("details", {}, make("summary", {}, "Check"), wires, make("div", { class: "row" }, button, result), list);
}

// state: of /api/state.
export function showWires(state) {
  const { flight_controller: board, state: line, speed_baud: speed } = state.link;
  setText(wires, `Wiring: ${state.port.trouble || (board === null ? evidence(state.traffic.fc) : `${board} answers${speed ? ` at ${speed} baud` : ""} (${line}).`)}`);
}

async function examine(list, result) {
  const { checks } = await askPi({ action: "doctor" });
  list.replaceChildren(...checks.map((found) => finding(found, list, result)));
  const count = checks.filter(({ grade }) => grade === "problem").length;
  return `${count || "No"} ${count === 1 ? "problem" : "problems"}.`;
}

function finding({ check, grade, found, remedy, fix }, list, result) {
  const parts = [make("b", { class: KINDS[grade] }, grade), ` ${check}: ${found}`];
  if (remedy) parts.push(make("span", { class: "why" }, remedy));
  if (fix) parts.push(fixButton(fix, list, result));
  return make("li", {}, ...parts);
}

function fixButton(fix, list, result) {
  return action(`Fix it: ${fix}`, result, async () => {
    const text = aftermath(await askPi({ action: "fix", fix }));
    await examine(list, result);
    return text;
  });
}
