// SPDX-License-Identifier: GPL-3.0-or-later
// The current values of /api/state, as words; the way to connect a board, and ground stations.
import { ask, postWithToken } from "./daemon.js";
import { action, byId, make, resultPlace, setClass, setList, setText } from "./dom.js";
import { STALE_S, age, evidence } from "./state_bar.js";
import { writeForm } from "./write_form.js";

const PAUSE_MS = 30000; // addresses change when a network comes up
const known = (value, unit = "", digits = 0) => (value === null || value === undefined ? "–" : `${value.toFixed(digits)}${unit}`);
let connectDue = 0, connectShown = "", declinationShown = "";

export function showValues(state) {
  setText(byId("version"), state.version);
  const { armed, armed_age_s, mode } = state.last_heard;
  const isOld = armed_age_s > STALE_S;
  byId("vehicle-age").hidden = !isOld;
  if (isOld) setText(byId("vehicle-age"), `Last heard ${age(armed_age_s)} ago.`);
  setClass(byId("values"), isOld ? "old" : "");
  const { voltage_v: volts, current_a: amperes, drawn_mah: drawn, remaining_percent: percent } = state.battery;
  pairs("instruments", [
    ["Battery", known(volts, " V", 1)],
    ["Height", known(state.position.height_m, " m", 1)],
    ["Speed", known(state.gps.ground_speed_m_s, " m/s", 1)],
    ["Home", known(state.position.home_distance_m, " m")],
    ["Satellites", known(state.gps.satellites)],
    ["Radio", known(state.rc.rssi_percent, " %")],
  ]);
  pairs("vehicle", [
    ["State", armed === null ? "unknown" : armed ? "ARMED" : "disarmed", armed ? "bad" : ""],
    ["Mode", mode ?? "–"],
    ["Battery left", percent === null ? "–" : `about ${percent} %`],
    ["Current", known(amperes, " A", 1)],
    ["Drawn", known(drawn, " mAh")],
    ["GPS fix", state.gps.fix ?? "–"],
    ["Heading", known(state.attitude.heading_deg, "°")],
    ["Sensors", state.status.sensors?.join(", ") || "–"],
    ["Sensor errors", known(state.status.i2c_errors), state.status.i2c_errors ? "bad" : ""],
  ]);
  pairs("link", [
    ["Firmware", state.link.flight_controller ?? "not found yet"],
    ["Protocol", state.link.state],
    ["Port", state.link.speed_baud ? `${state.port.address.replace(/,\d+$/, "")}, ${state.link.speed_baud} baud` : state.port.address],
    ["Round trip", known(state.link.round_trip_ms, " ms", 1)],
    ["Unanswered", known(state.link.requests_lost)],
    ["Damaged", known(state.link.bad_checksums)],
    ["Mission", mission(state.mission)],
    ["Settings", state.settings === null ? "not read yet" : state.settings.changed ?? `seal ${state.settings.seal}`, state.settings?.changed ? "bad" : ""],
  ]);
  const refused = state.refused.map((text) => `refused: ${text}`);
  byId("signing").hidden = !state.refused.some((text) => /behind our clock|a day ahead/.test(text));
  list("ground", [...state.link.ground_stations, ...refused], "None connected.");
  setText(byId("recording"), state.recording.join("; ") || "Recording is off.");
  if (state.link.flight_controller === null) showEvidence(state);
  showDeclination(state.declination);
}

// The result stays when the declination is right and its button gone.
function showDeclination(wrong) {
  const place = byId("declination"), [off, setting, needed] = wrong ?? [], label = `Set ${setting} to ${needed}`;
  if (wrong && label !== declinationShown) {
    declinationShown = label;
    place.replaceChildren(make("p", { class: "bad" }, `The declination is ${off}° off at this place.`), writeForm(label, () => postWithToken("/api/declination")));
  }
  for (const part of place.querySelectorAll("p:first-child, button")) part.hidden = !wrong;
}

// The way to a first flight controller, and how far it is.
function showEvidence({ port, traffic: { fc } }) {
  const steps = [[!port.trouble, "The serial port is open"], [fc.bytes_received > 0, "Bytes arrive"], [false, "A flight controller answers"]];
  const next = steps.findIndex(([isDone]) => !isDone);
  setList(byId("evidence"), "li", steps.map(([, text]) => text));
  [...byId("evidence").children].forEach((item, index) => setClass(item, index < next ? "good" : index === next ? "bad" : "soft"));
  setText(byId("evidence-hint"), `Now: ${port.trouble || evidence(fc)}`);
}

const result = resultPlace();
byId("signing").append(action("Forget wrong clocks", result, async () => (await postWithToken("/api/signing/reset")).text), result);

function mission(held) {
  if (held === null) return "not read yet";
  if (!held.count) return "none";
  return `${held.count} records, ${held.checksum}${held.item === null ? "" : `, ${held.state} at item ${held.item}`}`;
}

// rows: [name, value, class].
function pairs(id, rows) {
  const all = byId(id);
  rows.forEach(([name, value, kind = ""], index) => {
    if (index >= all.children.length) all.append(make("div", {}, make("dt"), make("dd")));
    const [title, shown] = all.children[index].children;
    setText(title, name);
    setText(shown, value);
    setClass(shown, kind);
  });
}

const list = (id, texts, otherwise) => setList(byId(id), "li", texts.length ? texts : [otherwise]);

// The connection data for a ground station, and the page's address for another phone.
export async function showConnect() {
  if (performance.now() < connectDue) return;
  connectDue = performance.now() + PAUSE_MS;
  const help = await ask("/api/connect"), text = JSON.stringify(help);
  if (text === connectShown) return;
  connectShown = text;
  const links = help.stations.map(({ connection, hosts, port }) => make("li", {}, make("b", {}, connection), `: host ${hosts.join(" or ")}, port ${port}`));
  const others = help.called.map((address) => make("li", {}, `The Pi itself connects to ${address}`));
  const page = help.pages.length ? `This page: ${help.pages.join(" or ")}` : "Only this machine can open this page: run setup to open it to the network.";
  byId("connect").replaceChildren(make("p", {}, "In Mission Planner choose the connection at the top right:"), make("ul", {}, ...links, ...others), make("p", {}, page));
}
