// SPDX-License-Identifier: GPL-3.0-or-later
// The bridge's settings, with the texts of their table. What is set in a file written by hand can only be changed there.
import { form, make } from "./dom.js";
import { aftermath, askPi, pressed } from "./pi_request.js";

const PAGE_FILE = "/etc/naze-bridge/page.toml";

export function settingsPanel({ keys, settings }, refresh) {
  const result = make("p", { class: "result", role: "status" });
  const rows = keys.map((key) => row(key, settings[key.name]));
  const save = make("button", {}, "Save the settings");
  const write = async () => {
    const changed = rows.filter(({ input, before }) => input.value.trim() !== before);
    if (!changed.length) return "Nothing was changed.";
    const values = Object.fromEntries(changed.map(({ name, input, isText }) => [name, asInFile(input.value.trim(), isText)]));
    const text = aftermath(await askPi({ action: "settings", values }));
    await refresh();
    return text;
  };
  const all = form({}, () => pressed(save, result, write), ...rows.map(({ element }) => element), make("div", { class: "row" }, save, result));
  return make("details", {}, make("summary", {}, "Settings of the bridge"), make("p", {}, "Empty: the default. The bridge applies changes at once, or restarts."), all);
}

function row({ name, meaning, default: preset, example }, given) {
  const elsewhere = given && !given.where.startsWith(PAGE_FILE);
  const isText = (preset || example).startsWith('"');
  const before = given ? (isText && given.text.startsWith('"') ? JSON.parse(given.text) : given.text) : "";
  const input = ["true", "false"].includes(preset) ? choice(name, before, preset) : make("input", { name, value: before, autocomplete: "off", placeholder: preset.replace(/^"(.*)"$/, "$1") });
  input.disabled = Boolean(elsewhere);
  const where = elsewhere ? make("span", { class: "why" }, `Set in ${given.where}: change it there.`) : "";
  return { name, input, before, isText, element: make("p", { class: "setting" }, make("label", {}, make("b", {}, name), " ", input), make("span", { class: "why" }, meaning), where) };
}

function choice(name, before, preset) {
  const options = ["", "true", "false"].map((value) => make("option", { value, selected: value === before ? "" : null }, value || `default (${preset})`));
  return make("select", { name }, ...options);
}

const asInFile = (value, isText) => (value === "" ? null : isText ? JSON.stringify(value) : value);
