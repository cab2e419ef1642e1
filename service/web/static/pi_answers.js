// SPDX-License-Identifier: GPL-3.0-or-later
// Setup's questions. The changes are shown first; what is left empty stays as it is.
import { form as makeForm, make, say } from "./dom.js";
import { action, aftermath, askPi, pressed, stepList } from "./pi_request.js";

export function answersPanel(pi, refresh) {
  const field = (label, name, value, more = {}) => make("label", {}, label, " ", make("input", { name, value, autocomplete: "off", ...more }));
  const result = make("p", { class: "result", role: "status" }), plan = make("div");
  const show = make("button", {}, "Show the changes");
  const key = make("label", { class: "check" }, make("input", { type: "checkbox", name: "new_key" }), pi.has_key ? " Make a new key" : " Require a key for changes: make one");
  const form = makeForm({}, () => pressed(show, result, () => tryOut(given(form, pi))), make("div", { class: "row" }, make("label", {}, "Flight controller ", make("select", { name: "fc" }, ...ports(pi))), field("Name of this Pi", "name", pi.name, { maxlength: 63 })),
  make("div", { class: "row" }, field("Hotspot: name", "hotspot", "", { placeholder: pi.hotspot ?? "none", maxlength: 32 }),
    field("Password, 8 or more", "password", "", { type: "password", minlength: 8, maxlength: 63, autocomplete: "new-password" }), field("Country", "country", pi.country ?? "", { size: 3, maxlength: 2, placeholder: "DE" })),
  key, make("div", { class: "row" }, show, result));

  async function tryOut(answers) {
    const trial = await askPi({ action: "answer", is_trial: true, ...answers });
    const warnings = trial.warnings.map((text) => make("p", { class: "bad" }, text));
    if (!trial.steps.length) {
      plan.replaceChildren(...warnings);
      return "Everything is already set up like this.";
    }
    const network = trial.cuts_network ? [make("p", {}, "The Wi-Fi changes to the hotspot. Join it within 3 minutes: if no device does, the Pi returns to the current network.")] : [];
    const act = action("Make these changes", result, async () => {
      const made = await askPi({ action: "answer", ...answers });
      plan.replaceChildren(...(made.key ? [make("p", {}, "The key, for ground stations that may make changes: ", make("b", { class: "secret" }, made.key)), make("p", {}, "In Mission Planner: Setup, Advanced, MAVLink Signing, Add. Write it down now: it is not shown again.")] : []));
      if (!made.key && !made.cuts_network) await refresh();
      return aftermath(made);
    });
    plan.replaceChildren(stepList(trial.steps), ...warnings, ...network, act);
    say(result, "", "");
    return "";
  }
  return make("details", pi.is_set_up ? {} : { open: "" }, make("summary", {}, pi.is_set_up ? "Setup" : "First questions"), form, plan);
}

function ports({ ports: found, fc }) {
  const now = fc ?? "auto";
  return [...new Set([now, ...found])].map((port) => make("option", { selected: port === now ? "" : null }, port));
}

// Only what differs from the answers so far.
function given(form, { fc, name, country }) {
  const value = (field) => (field === "hotspot" || field === "password" ? form.elements[field].value : form.elements[field].value.trim());
  const differing = { fc: fc ?? "auto", name: name, country: country ?? "", hotspot: "", password: "" };
  const answers = Object.fromEntries(Object.entries(differing).filter(([field, before]) => value(field) && value(field) !== before).map(([field]) => [field, value(field)]));
  return form.elements.new_key.checked ? { ...answers, new_key: true } : answers;
}
