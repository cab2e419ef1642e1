// SPDX-License-Identifier: GPL-3.0-or-later
// Requests to the daemon. A missing reply is an error with one sentence, like every refusal.
// The token is asked for when a request needs it, and kept until this tab is closed.
import { byId, setText } from "./dom.js";

const TIMEOUT_MS = 8000, KEY = "token", WRONG_TOKEN = 401;

// The QR code of setup and of a card brings it along.
const scanned = decodeURIComponent(location.hash.match(/^#token=(.+)$/)?.[1] ?? "");
if (scanned) {
  sessionStorage.setItem(KEY, scanned);
  history.replaceState(null, "", location.pathname);
}

export const hasToken = () => sessionStorage.getItem(KEY) !== null;

export const ask = async (path) => (await request(path)).json();

export const post = async (path, body) => (await request(path, { method: "POST", body })).json();

// These three need the token.
export const askWithToken = async (path) => (await withToken(path)).json();

export const postWithToken = async (path, body = null) => (await withToken(path, { method: "POST", body })).json();

export const fetchBytes = async (path) => (await withToken(path)).blob();

async function withToken(path, options = {}) {
  for (;;) {
    if (!hasToken()) await enterToken();
    try {
      return await request(path, { ...options, headers: { Authorization: `Bearer ${sessionStorage.getItem(KEY)}` } });
    } catch (error) {
      if (error.status !== WRONG_TOKEN) throw error;
      sessionStorage.removeItem(KEY);
      await enterToken("This token is wrong.");
    }
  }
}

function enterToken(why = "") {
  const dialog = byId("token-dialog"), field = byId("token");
  setText(byId("token-why"), why);
  field.value = dialog.returnValue = "";
  if (!dialog.open) dialog.showModal();
  return new Promise((resolve, reject) => {
    dialog.addEventListener("close", () => {
      if (dialog.returnValue !== "ok") return reject(new Error("This needs the page's token."));
      sessionStorage.setItem(KEY, field.value.trim());
      resolve();
    }, { once: true });
  });
}

async function request(path, { headers = {}, body = null, ...options } = {}) {
  const type = body === null ? {} : { "Content-Type": typeof body === "string" ? "application/json" : "application/octet-stream" };
  let response;
  try {
    response = await fetch(path, { ...options, body, headers: { ...headers, ...type }, signal: AbortSignal.timeout(TIMEOUT_MS) });
  } catch {
    throw new Error("The Pi does not answer.");
  }
  if (!response.ok) throw Object.assign(new Error((await response.json()).error), { status: response.status });
  return response;
}
