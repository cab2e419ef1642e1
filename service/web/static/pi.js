// SPDX-License-Identifier: GPL-3.0-or-later
// The Pi itself: setup's questions, the bridge's settings, updates, and going back. Its root helper answers.
import { aftermath, askPi, hasToken, postWithToken } from "./daemon.js";
import { action, byId, form, make, pressed, resultPlace, say } from "./dom.js";

const PIECE = 256 * 1024, MOST_BYTES = 128 * 1024 * 1024;
const LATER = "The bridge restarts during the installation, which takes some minutes. Then reload the page to see the result.";

const result = resultPlace(), panels = make("div", { class: "side-by-side" }), unlock = action("Unlock with the token", result, open, "primary");
byId("pi").append(make("div", { class: "row", id: "unlock" }, unlock, result), panels);

export function openPi() {
  if (hasToken() && !panels.hasChildNodes() && !unlock.disabled) pressed(unlock, result, open);
}

async function open() {
  const pi = await askPi({ action: "overview" });
  unlock.hidden = true;
  panels.replaceChildren(make("div", {}, summary(pi), setup(pi)), make("div", {}, settings(pi), updates(pi), last(pi)));
  return "";
}

const fold = (title, isOpen, ...contents) => make("details", isOpen ? { open: "" } : {}, make("summary", {}, title), ...contents);

function summary(pi) {
  const hotspot = pi.hotspot === null ? "no hotspot" : `hotspot ${pi.hotspot} ${pi.hotspot_is_open ? "open" : "closed"}`;
  const key = pi.has_key ? "a key is required for changes" : "no key: anyone on the network can change missions";
  const update = pi.update ? [make("p", {}, `Last update: ${pi.update}`)] : [];
  return make("div", {}, make("p", {}, [pi.model ?? "Not a known Raspberry Pi", pi.name, hotspot, key].filter(Boolean).join(", ")), ...update);
}

// Setup's questions. The changes are shown first; what is left empty stays as it is.
function setup(pi) {
  const field = (label, name, value, more = {}) => make("label", {}, label, make("input", { name, value, autocomplete: "off", ...more }));
  const said = resultPlace(), plan = make("div"), show = make("button", { class: "primary" }, "Show the changes");
  const ports = [...new Set([pi.fc ?? "auto", ...pi.ports])];
  const key = make("label", { class: "check" }, make("input", { type: "checkbox", name: "new_key" }), pi.has_key ? " Make a new key" : " Require a key for changes: make one");
  const fields = make("div", { class: "fields" },
    make("label", {}, "Flight controller", make("select", { name: "fc" }, ...ports.map((port) => make("option", { value: port }, port === "auto" ? "Find it" : port)))),
    field("Name of this Pi", "name", pi.name, { maxlength: 63, pattern: "[A-Za-z0-9](?:[A-Za-z0-9\\-]{0,61}[A-Za-z0-9])?", title: "Letters, digits and hyphens" }),
    field("Hotspot", "hotspot", "", { placeholder: pi.hotspot ?? "none", maxlength: 32 }),
    field("Its password", "password", "", { type: "password", minlength: 8, maxlength: 63, placeholder: "8 or more", autocomplete: "new-password" }),
    field("Country", "country", pi.country ?? "", { maxlength: 2, pattern: "[A-Za-z]{2}", placeholder: "DE", title: "Two letters, such as DE" }), key);
  const questions = form({}, () => pressed(show, said, () => tryOut(given(questions, pi))), fields, make("div", { class: "row" }, show, said));

  async function tryOut(answers) {
    const trial = await askPi({ action: "answer", is_trial: true, ...answers });
    const warnings = trial.warnings.map((text) => make("p", { class: "bad" }, text));
    if (!trial.steps.length) {
      plan.replaceChildren(...warnings);
      return "Everything is already set up like this.";
    }
    const network = trial.cuts_network ? [make("p", {}, "The Wi-Fi changes to the hotspot. Join it within 3 minutes: if no device does, the Pi returns to the current network.")] : [];
    const act = action("Make these changes", said, async () => {
      const made = await askPi({ action: "answer", ...answers });
      plan.replaceChildren(...(made.key ? [make("p", {}, "The key, for ground stations that may make changes: ", make("b", { class: "secret" }, made.key)), make("p", {}, "In Mission Planner: Setup, Advanced, MAVLink Signing, Add. Write it down now: it is not shown again.")] : []));
      if (!made.key && !made.cuts_network) await open();
      return aftermath(made);
    }, "primary");
    plan.replaceChildren(stepList(trial.steps), ...warnings, ...network, act);
    say(said, "", "");
    return "";
  }
  return fold(pi.is_set_up ? "Setup" : "First questions", true, questions, plan);
}

function stepList(steps) {
  return make("ul", {}, ...steps.map(({ purpose, changes }) => make("li", {}, purpose, make("span", { class: "why" }, changes.join("; ")))));
}

// Only what differs from the answers so far.
function given(questions, { fc, name, country }) {
  const value = (field) => (field === "hotspot" || field === "password" ? questions.elements[field].value : questions.elements[field].value.trim());
  const differing = { fc: fc ?? "auto", name: name, country: country ?? "", hotspot: "", password: "" };
  const answers = Object.fromEntries(Object.entries(differing).filter(([field, before]) => value(field) && value(field) !== before).map(([field]) => [field, value(field)]));
  return questions.elements.new_key.checked ? { ...answers, new_key: true } : answers;
}

// The bridge's settings with a choice of values. Those set by hand on the Pi can only be changed there.
function settings(pi) {
  const said = resultPlace(), rows = pi.settings.map(setting), save = make("button", {}, "Save");
  const write = async () => {
    const changed = rows.filter(({ input, before }) => input.value.trim() !== before);
    if (!changed.length) return "Nothing was changed.";
    const values = Object.fromEntries(changed.map(({ name, input, read }) => [name, input.value.trim() === "" ? null : read(input.value)]));
    const text = aftermath(await askPi({ action: "settings", values }));
    await open();
    return text;
  };
  return fold("Settings of the bridge", false, make("p", { class: "soft" }, "An empty field means the default."),
    form({}, () => pressed(save, said, write), make("div", { class: "fields" }, ...rows.map(({ element }) => element)), make("div", { class: "row" }, save, said)));
}

function setting({ name, label, unit, meaning, default: preset, choices, value, elsewhere }) {
  const before = value === null ? "" : String(value), isNumber = !Array.isArray(choices);
  const input = isNumber ? make("input", { name, type: "number", min: choices.least, max: choices.most, value: before, placeholder: preset })
    : make("select", { name }, ...["", ...choices.map(String)].map((each) => make("option", { value: each, selected: each === before ? "" : null }, each ? word(each) : `Default (${word(preset)})`)));
  const read = isNumber ? Number : (text) => choices.find((each) => String(each) === text);
  input.disabled = elsewhere !== null;
  const note = elsewhere ? "Set by hand on the Pi: change it there." : meaning;
  return { name, input, before, read, element: make("label", {}, label, make("span", { class: "with-unit" }, input, unit), make("span", { class: "why" }, note)) };
}

const word = (value) => ({ true: "Yes", false: "No" })[String(value)] ?? String(value);

// An update from a file. A connection to the Pi is short, so the package is sent in pieces.
function updates({ version, previous, can_update: canUpdate }) {
  const said = resultPlace(), bar = make("progress", { hidden: "", "aria-label": "Package sent" });
  if (!canUpdate) return fold("Update", false, make("p", {}, `This is version ${version}. It was built without a key for checking updates: install a package with apt in a terminal.`));
  const file = make("input", { type: "file", accept: ".deb" }), send = make("button", {}, "Install");
  const update = form({}, () => pressed(send, said, () => install(file.files[0], bar, said)), make("label", {}, "Package (.deb) ", file), make("div", { class: "row" }, send, bar, said));
  const back = previous ? [action(`Back to version ${previous}`, said, () => askPi({ action: "downgrade" }).then(() => LATER))] : [];
  return fold("Update", false, make("p", {}, `This is version ${version}. A newer package from the releases is installed if its signature is valid. If the new version does not run, this one is reinstalled.`), update, ...back);
}

async function install(file, bar, said) {
  if (!file) throw new Error("Choose a package first.");
  if (file.size > MOST_BYTES) throw new Error(`${file.name} is larger than ${MOST_BYTES >> 20} MB, so it is not the package of naze-bridge.`);
  Object.assign(bar, { hidden: false, max: file.size, value: 0 });
  try {
    for (let start = 0; start < file.size; start += PIECE) {
      await postWithToken(`/api/pi/package?start=${start}`, file.slice(start, start + PIECE));
      bar.value = start + PIECE;
    }
    say(said, "", "Checking the package …");
    const { version } = await askPi({ action: "install" });
    return `Installing version ${version}. ${LATER}`;
  } finally {
    bar.hidden = true;
  }
}

// The buttons that interrupt something.
function last({ hotspot, hotspot_is_open: isOpen }) {
  const said = resultPlace();
  const act = (text, fix, note) => action(text, said, async () => aftermath(await askPi({ action: "fix", fix })) + note);
  const note = isOpen ? " This phone must join the Pi's other network." : " Join the hotspot within 3 minutes, or the Pi returns to this network.";
  const hotspots = hotspot === null ? [] : [act(isOpen ? "Close the hotspot" : "Open the hotspot", isOpen ? "close the hotspot" : "open the hotspot", note)];
  return fold("Hotspot, restart", false, make("div", { class: "row" }, ...hotspots, act("Restart the bridge", "restart the bridge", " The page returns in a few seconds."), said));
}
