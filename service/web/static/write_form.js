// SPDX-License-Identifier: GPL-3.0-or-later
// The button that writes a mission, settings or firmware; next to it the result of this press, never of another write.
import { postWithToken } from "./daemon.js";
import { byId, make, resultPlace, say, setText } from "./dom.js";

const forms = new Set();
let armed = null;

// start: posts the request and resolves to {id}.
export function writeForm(label, start) {
  const button = make("button", { type: "button", class: "write primary", onclick: () => press(form, start) }, label);
  const hint = make("p", { class: "why" }), bar = make("progress", { hidden: "", "aria-label": "Records written" });
  const form = { id: null, begunAt: 0, button, hint, result: resultPlace(), bar, element: null };
  form.element = make("div", { class: "row write-form" }, button, hint, bar, form.result);
  forms.add(form);
  block(form);
  return form.element;
}

async function press(form, start) {
  form.id = null;
  say(form.result, "", "Sending …");
  form.button.disabled = true;
  try {
    form.id = (await start()).id;
    form.begunAt = performance.now();
    say(form.result, "", "Writing …");
  } catch (error) {
    say(form.result, "bad", error.message);
    block(form);
  }
}

// state: of /api/state, requested at askedAt (performance.now()).
export function followWrites(state, askedAt) {
  armed = state.status.armed;
  for (const form of forms) {
    if (!form.element.isConnected && form.id === null) forms.delete(form);
    else if (form.id === null) block(form);
    else if (askedAt > form.begunAt) follow(form, state);
  }
}

function follow(form, { write, transfer }) {
  const isOurs = write?.id === form.id;
  if (isOurs && !write.done) {
    if (transfer) Object.assign(form.bar, { hidden: false, max: transfer.total, value: write.records });
    say(form.result, "", write.text || `${write.records} ${write.unit} written …`);
    return;
  }
  form.id = null;
  form.bar.hidden = true;
  if (isOurs) say(form.result, write.ok ? "good" : "bad", write.text);
  else say(form.result, "bad", "The result of this write is no longer available here: see the stored missions and settings.");
  block(form);
}

function block(form) {
  form.button.disabled = armed === true;
  setText(form.hint, armed === true ? "Armed: disarm to write." : "");
}

// A firmware image is chosen, then flashed by the Pi. The form stays: one press resumes an interrupted flash.
const chooser = byId("image");
chooser.addEventListener("click", () => { chooser.value = ""; }); // the same file again, after another build
chooser.addEventListener("change", () => {
  if (!chooser.files.length) return;
  const [file] = chooser.files, battery = make("input", { type: "checkbox" });
  byId("firmware").replaceChildren(
    make("p", {}, "Propellers off. Settings and missions are kept, and the present flash is backed up on the Pi."),
    make("label", { class: "check" }, battery, " A battery stays connected"),
    writeForm(`Flash ${file.name}`, () => postWithToken(`/api/firmware?name=${encodeURIComponent(file.name)}&battery=${battery.checked ? 1 : 0}`, file)));
});
