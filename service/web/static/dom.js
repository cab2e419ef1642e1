// SPDX-License-Identifier: GPL-3.0-or-later
// Making and updating elements. Data from outside becomes text, never markup.

export const byId = (id) => document.getElementById(id);

export function make(name, attributes = {}, ...children) {
  return fill(document.createElement(name), attributes, children);
}

export function draw(name, attributes = {}, ...children) {
  return fill(document.createElementNS("http://www.w3.org/2000/svg", name), attributes, children);
}

// Equal text is left alone: replacing it would clear the reader's selection.
export function setText(element, text) {
  if (element.textContent !== text) element.textContent = text;
}

export function setClass(element, name) {
  if (element.className !== name) element.className = name;
}

// The result of an action.
export function say(element, kind, text) {
  setClass(element, `result ${kind}`.trim());
  setText(element, text);
}

// A form that never leaves the page.
export const form = (attributes, submit, ...children) => make("form", { ...attributes, onsubmit: (event) => {
  event.preventDefault();
  submit();
} }, ...children);

// A place for the result of an action.
export const resultPlace = () => make("p", { class: "result", role: "status" });

// Does `work` with the button disabled. Its sentence (or sentence and kind), or its error, appears in `result`.
export async function pressed(button, result, work) {
  button.disabled = true;
  say(result, "", "Working …");
  try {
    const [text = "", kind = "good"] = [await work()].flat();
    say(result, kind, text);
  } catch (error) {
    say(result, "bad", error.message);
  }
  button.disabled = false;
}

// A button that does `work`.
export const action = (text, result, work, kind = "") => make("button", {
  type: "button", class: kind || null, onclick: ({ currentTarget }) => pressed(currentTarget, result, work),
}, text);

// Numbered entries that open in place, the newest first in `entries`. Those already there stay, with what is open in them.
export function showEntries(container, entries, { name, summary, contents }) {
  const there = new Map([...container.querySelectorAll(":scope > details")].map((each) => [Number(each.dataset.number), each]));
  const numbers = new Set(entries.map(({ number }) => number));
  for (const [number, element] of there) if (!numbers.has(number)) element.remove();
  if (!there.size) container.replaceChildren();
  for (const entry of [...entries].reverse()) {
    const element = there.get(entry.number) ?? newEntry(entry.number, name, contents);
    if (!there.has(entry.number)) container.prepend(element);
    const parts = summary(entry), shown = parts.map((part) => part.outerHTML ?? part).join("");
    if (element.dataset.shown !== shown) element.firstElementChild.replaceChildren(...parts);
    element.dataset.shown = shown;
  }
}

function newEntry(number, name, contents) {
  const place = make("div", { role: "group", "aria-label": `${name} ${number}` });
  return make("details", { "data-number": number, ontoggle: async ({ target }) => {
    if (!target.open || target !== place.parentElement) return;
    try {
      place.replaceChildren(...await contents(number));
    } catch (error) {
      place.replaceChildren(make("p", { class: "bad" }, error.message));
    }
  } }, make("summary"), place);
}

// setText for a parent of simple elements: only those with changed text are updated.
export function setList(parent, name, texts) {
  while (parent.children.length > texts.length) parent.lastElementChild.remove();
  texts.forEach((text, index) => {
    if (index >= parent.children.length) parent.append(make(name));
    setText(parent.children[index], text);
  });
}

function fill(element, attributes, children) {
  for (const [name, value] of Object.entries(attributes)) {
    if (name.startsWith("on")) element.addEventListener(name.slice(2), value);
    else if (value !== null) element.setAttribute(name, value);
  }
  element.append(...children);
  return element;
}
