// SPDX-License-Identifier: GPL-3.0-or-later
// Requests about the Pi itself. Each is begun, and its reply fetched when there is one: it may take longer than a connection.
import { askWithToken, postWithToken } from "./daemon.js";
import { make } from "./dom.js";

const PAUSE_MS = 300, TIMEOUT_MS = 150000;

export async function askPi(request) {
  const { id } = await postWithToken("/api/pi", JSON.stringify(request));
  const deadline = performance.now() + TIMEOUT_MS;
  while (performance.now() < deadline) {
    await new Promise((resolve) => setTimeout(resolve, PAUSE_MS));
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

export function stepList(steps) {
  return make("ul", {}, ...steps.map(({ purpose, changes }) => make("li", {}, purpose, make("span", { class: "why" }, changes.join("; ")))));
}
