// SPDX-License-Identifier: GPL-3.0-or-later
// The token: typed once into any of its fields, kept until the page is closed.
import { make } from "./dom.js";

// The QR code of setup and of a card brings it along.
let token = decodeURIComponent(location.hash.match(/^#token=(.+)$/)?.[1] ?? "");
if (token) history.replaceState(null, "", location.pathname);

export const currentToken = () => token;

export function tokenField() {
  const input = make("input", { type: "password", class: "token", autocomplete: "off", required: "", oninput: () => {
    token = input.value.trim();
    for (const other of document.querySelectorAll("input.token")) if (other !== input) other.value = input.value;
  } });
  input.value = token;
  return make("label", {}, "Token ", input);
}
