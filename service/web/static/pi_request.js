// SPDX-License-Identifier: GPL-3.0-or-later
// Requests about the Pi itself. Each is begun, and its reply fetched when there is one: it may take longer than a connection.
import { ask, post } from "./daemon.js";
import { make, say } from "./dom.js";
import { currentToken } from "./token.js";

const PAUSE_MS = 300, TIMEOUT_MS = 150000;

export async function askPi(request) {
  const { id } = await post("/api/pi", currentToken(), JSON.stringify(request));
  const deadline = performance.now() + TIMEOUT_MS;
  while (performance.now() < deadline) {
    await new Promise((resolve) => setTimeout(resolve, PAUSE_MS));
    const job = await ask("/api/pi", currentToken()).catch(() => null); // a gap in the Wi-Fi
    if (job === null || (job.id === id && !job.done)) continue;
    if (job.id !== id) throw new Error("The bridge was restarted before it replied. Open this again to see the result.");
    if (job.error) throw new Error(job.error);
    return job.reply;
  }
  throw new Error("The Pi did not reply in time.");
}

// Runs `work` with the button disabled; its sentence, or its error, appears in `result`.
export async function pressed(button, result, work) {
  button.disabled = true;
  say(result, "", "Working …");
  try {
    say(result, "good", (await work()) ?? "");
  } catch (error) {
    say(result, "bad", error.message);
  }
  button.disabled = false;
}

// Does `work` when it is pressed.
export function action(text, result, work) {
  const button = make("button", { type: "button", onclick: () => pressed(button, result, work) }, text);
  return button;
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
