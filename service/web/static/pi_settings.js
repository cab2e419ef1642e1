// SPDX-License-Identifier: GPL-3.0-or-later
// The bridge's settings with a choice of values. What is set in a file written by hand can only be changed there.
import { form, make } from "./dom.js";
import { aftermath, askPi, pressed } from "./pi_request.js";

export function settingsPanel({ settings }, refresh) {
  const result = make("p", { class: "result", role: "status" });
  const rows = settings.map(row);
  const save = make("button", {}, "Save the settings");
  const write = async () => {
    const changed = rows.filter(({ input, before }) => input.value.trim() !== before);
    if (!changed.length) return "Nothing was changed.";
    const values = Object.fromEntries(changed.map(({ name, input, read }) => [name, input.value.trim() === "" ? null : read(input.value)]));
    const text = aftermath(await askPi({ action: "settings", values }));
    await refresh();
    return text;
  };
  const all = form({}, () => pressed(save, result, write), ...rows.map(({ element }) => element), make("div", { class: "row" }, save, result));
  return make("details", {}, make("summary", {}, "Settings of the bridge"), make("p", {}, "Empty: the default. The bridge applies changes at once, or restarts."), all);
}

function row({ name, meaning, default: preset, choices, value, elsewhere }) {
  const before = value === null ? "" : String(value);
  const isNumber = !Array.isArray(choices);
  const input = isNumber ? make("input", { name, type: "number", min: choices.least, max: choices.most, value: before, placeholder: preset }) : select(name, choices, before, preset);
  const read = isNumber ? Number : (text) => choices.find((each) => String(each) === text);
  input.disabled = elsewhere !== null;
  const where = elsewhere ? make("span", { class: "why" }, `Set in ${elsewhere}: change it there.`) : "";
  return { name, input, before, read, element: make("p", { class: "setting" }, make("label", {}, make("b", {}, name), " ", input), make("span", { class: "why" }, meaning), where) };
}

function select(name, choices, before, preset) {
  const options = ["", ...choices.map(String)].map((value) => make("option", { value, selected: value === before ? "" : null }, value || `default (${preset})`));
  return make("select", { name }, ...options);
}
