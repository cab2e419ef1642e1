// SPDX-License-Identifier: GPL-3.0-or-later
// Requests to the daemon. A missing reply is an error with one sentence, like every refusal.
// The token is asked for when a request needs it, and kept until this tab is closed.
import { byId, setText } from "./dom.js";

const TIMEOUT_MS = 8000, PI_PAUSE_MS = 300, PI_TIMEOUT_MS = 150000, KEY = "token", WRONG_TOKEN = 401;

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

// A request about the Pi itself. It is begun, and the reply fetched when there is one: it may take longer than a connection.
export async function askPi(request) {
  const { id } = await postWithToken("/api/pi", JSON.stringify(request));
  const deadline = performance.now() + PI_TIMEOUT_MS;
  while (performance.now() < deadline) {
    await new Promise((resolve) => setTimeout(resolve, PI_PAUSE_MS));
    const job = await askWithToken("/api/pi").catch(() => null); // a gap in the Wi-Fi
    if (job === null || (job.id === id && !job.done)) continue;
    if (job.id !== id) throw new Error("The bridge was restarted before it replied. Open this again to see the result.");
    if (job.error) throw new Error(job.error);
    return job.reply;
  }
  throw new Error("The Pi did not reply in time.");
}

// A sentence about the effect of the changes that were made.
export function aftermath({ steps, needs_reboot: needsReboot, cuts_network: cutsNetwork }) {
  if (!steps.length) return "Nothing had to be changed.";
  const done = `Done: ${steps.map(({ purpose }) => purpose).join("; ")}.`;
  const reboot = needsReboot ? " Switch the Pi off and on for this to take effect." : "";
  return done + reboot + (cutsNetwork ? " The Wi-Fi changes in a few seconds." : "");
}
