// SPDX-License-Identifier: GPL-3.0-or-later
// The form that writes a mission or settings: token, button, and next to it the result of this press, never of another write.
import { form as makeForm, make, say, setText } from "./dom.js";
import { currentToken, tokenField } from "./token.js";

const forms = new Set();
let armed = null;

// start: posts the request with a token and resolves to {id}.
export function writeForm(label, start) {
  const button = make("button", { class: "write" }, label);
  const result = make("p", { class: "result", role: "status" }), hint = make("p", { class: "why" });
  const bar = make("progress", { hidden: "", "aria-label": "Records written" });
  const form = { id: null, begunAt: 0, button, hint, result, bar, element: null };
  form.element = makeForm({ class: "row" }, () => press(form, start), tokenField(), button, hint, bar, result);
  forms.add(form);
  block(form);
  return form.element;
}

async function press(form, start) {
  form.id = null;
  say(form.result, "", "Sending …");
  form.button.disabled = true;
  try {
    form.id = (await start(currentToken())).id;
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
  else say(form.result, "bad", "The page no longer has the result of this write: see the stored missions and settings.");
  block(form);
}

function block(form) {
  form.button.disabled = armed === true;
  setText(form.hint, armed === true ? "Armed: disarm to write." : "");
}
