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
