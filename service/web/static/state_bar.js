// SPDX-License-Identifier: GPL-3.0-or-later
// The bar that is always visible: armed, lost, stale; the running transfer; and changes, for screen readers.
import { byId, make, setText } from "./dom.js";

export const STALE_S = 3;
const LISTEN_MS = 3000;
let heard = null; // the port's byte count that changed last, and when
let spoken = null; // the badges that were announced last

// state: of /api/state, or the last one known (null: none) if silent_s is not null. isAnnounced: also to a screen reader,
// which a short gap in the Wi-Fi should not interrupt.
export function showStateBar(state, silent_s, isAnnounced = true) {
  const badges = badgesOf(state, silent_s);
  const bar = byId("badges");
  const texts = badges.map((badge) => `${badge.kind} ${badge.text}`).join("|");
  if (bar.dataset.shown !== texts) {
    bar.replaceChildren(...badges.flatMap(({ text, kind }) => [make("span", { class: `badge ${kind}` }, text), " "]));
    bar.dataset.shown = texts;
  }
  const names = badges.map((badge) => badge.name).join(", ");
  document.title = `${names} · naze-bridge`;
  setText(byId("headline"), headline(state));
  showTransfer(silent_s === null ? state.transfer : null);
  if (isAnnounced) announce(names);
}

function badgesOf(state, silent_s) {
  const { armed, armed_age_s } = state?.last_heard ?? { armed: null };
  const wasArmed = armed ? [badge("bad", "WAS ARMED")] : [];
  if (silent_s !== null) return [badge("bad", "NO REPLY FROM THE PI", silent_s), ...wasArmed];
  const { readiness, not_ready_why } = state.status;
  if (readiness === "calibrating") return [badge("soft", "CALIBRATING")];
  if (state.link.flight_controller === null) {
    const problem = state.link.state === "command line" ? "COMMAND LINE" : state.port.trouble ? "PORT PROBLEM" : "SEARCHING";
    const what = state.lost_s === null ? badge("bad", problem) : badge("bad", "LOST", state.lost_s);
    return [what, ...wasArmed];
  }
  const known = armed === null ? badge("soft", "ARMED STATE UNKNOWN") : armed ? badge("bad", "ARMED") : badge("good", "DISARMED");
  if (armed_age_s > STALE_S) return [known, badge("bad", "STALE", armed_age_s)];
  return readiness === "blocked" ? [known, badge("soft", `NOT READY: ${not_ready_why.join(", ")}`)] : [known];
}

const badge = (kind, name, age_s = null) => ({ kind, name, text: age_s === null ? name : `${name} ${age(age_s)}` });

export const age = (seconds) => (seconds < 120 ? `${Math.round(seconds)} s` : `${Math.round(seconds / 60)} min`);

function headline(state) {
  if (state === null) return "";
  if (state.port.trouble) return state.port.trouble;
  if (state.link.flight_controller === null) return `Looking for a flight controller on ${state.port.address}: ${evidence(state.traffic.fc)}`;
  return [state.last_heard.mode, state.battery.voltage_v && `${state.battery.voltage_v.toFixed(1)} V`, state.link.flight_controller].filter(Boolean).join(", ");
}

// The state of the wires until a frame arrives. Between two states the search listens at one or two speeds.
export function evidence({ bytes_received }) {
  const arrives = heard !== null && bytes_received > heard.bytes;
  if (heard === null || bytes_received !== heard.bytes || performance.now() - heard.at > LISTEN_MS) heard = { bytes: bytes_received, at: performance.now(), arrives };
  return heard.arrives ? "bytes arrive, but no frames. Is the speed right, and is MSP enabled on this UART?" : "silence. Check power, TX to RX, RX to TX, and GND.";
}

function showTransfer(transfer) {
  byId("transfer").hidden = transfer === null;
  if (transfer === null) return;
  const { step, done, total, source } = transfer;
  const what = step === "receiving" ? "Receiving items" : done < total ? "Writing records" : "Verifying records";
  setText(byId("transfer-text"), `${what}: ${done} of ${total}, ${source}`);
  Object.assign(byId("transfer-bar"), { max: Math.max(total, 1), value: done });
}

// Growing ages and the first state, which is on the page anyway, are not announced.
function announce(names) {
  if (spoken !== null && names !== spoken) setText(byId("spoken"), names.toLowerCase());
  spoken = names;
}
