// SPDX-License-Identifier: GPL-3.0-or-later
// The current values of /api/state, as words.
import { post } from "./daemon.js";
import { byId, form, make, say, setClass, setList, setText } from "./dom.js";
import { STALE_S, age } from "./state_bar.js";
import { currentToken, tokenField } from "./token.js";

const known = (value, unit = "", digits = 0) => (value === null || value === undefined ? "–" : `${value.toFixed(digits)}${unit}`);
let before = null; // the byte counts of the previous state, and the time of its request

export function showOverview(state) {
  setText(byId("version"), state.version);
  const { armed, armed_age_s, mode } = state.last_heard;
  const rates = ratesOf(state.traffic);
  const isOld = armed_age_s > STALE_S;
  byId("vehicle-age").hidden = !isOld;
  if (isOld) setText(byId("vehicle-age"), `Last heard ${age(armed_age_s)} ago.`);
  setClass(byId("vehicle"), isOld ? "old" : "");
  pairs("vehicle", [
    ["State", armed === null ? "unknown" : armed ? "ARMED" : "disarmed", armed ? "bad" : ""],
    ["Mode", mode ?? "–"],
    ["Battery", battery(state.battery), ""],
    ["Satellites", `${known(state.gps.satellites)} (fix ${state.gps.fix ?? "–"})`],
    ["Height", known(state.position.height_m, " m", 1)],
    ["Speed", known(state.gps.ground_speed_m_s, " m/s", 1)],
    ["Heading", known(state.attitude.heading_deg, "°")],
    ["Home", known(state.position.home_distance_m, " m away")],
    ["Radio", known(state.rc.rssi_percent, " %")],
    ["Sensors", state.status.sensors?.join(", ") || "–"],
    ["Sensor errors", known(state.status.i2c_errors), state.status.i2c_errors ? "bad" : ""],
  ]);
  pairs("link", [
    ["Firmware", state.link.flight_controller ?? "not found yet"],
    ["Protocol", state.link.state],
    ["Port", state.link.speed_baud ? `${state.port.address.replace(/,\d+$/, "")}, ${state.link.speed_baud} baud` : state.port.address],
    ["Line", rates.get("fc") ?? "–"],
    ["Round trip", known(state.link.round_trip_ms, " ms", 1)],
    ["Unanswered", known(state.link.requests_lost)],
    ["Damaged", known(state.link.bad_checksums)],
    ["Mission", mission(state.mission)],
    ["Settings", state.settings === null ? "not read yet" : state.settings.changed ?? `seal ${state.settings.seal}`, state.settings?.changed ? "bad" : ""],
  ]);
  const refused = state.refused.map((text) => `refused: ${text}`);
  const links = [...rates].filter(([name]) => name !== "fc").map(([name, rate]) => `${name}: ${rate}`);
  byId("signing").hidden = !state.refused.some((text) => /behind our clock|a day ahead/.test(text));
  list("ground", [...state.link.ground_stations, ...refused], "None connected.");
  list("links", links, "Nothing sent yet.");
  list("recording", state.recording, "Off.");
}

const result = make("p", { class: "result", role: "status" });
byId("signing").append(form({ class: "row" }, resetSigning, tokenField(), make("button", {}, "Forget wrong clocks"), result));

async function resetSigning() {
  try {
    say(result, "good", (await post("/api/signing/reset", currentToken())).text);
  } catch (error) {
    say(result, "bad", error.message);
  }
}

function mission(held) {
  if (held === null) return "not read yet";
  if (!held.count) return "none";
  return `${held.count} records, ${held.checksum}${held.item === null ? "" : `, ${held.state} at item ${held.item}`}`;
}

function battery({ voltage_v: volts, current_a: amperes, drawn_mah: drawn, remaining_percent: percent }) {
  const more = [percent === null ? "" : `about ${percent} %`, amperes === null ? "" : `${amperes.toFixed(1)} A`, drawn === null ? "" : `${drawn} mAh drawn`];
  return [known(volts, " V", 1), ...more.filter(Boolean)].join(", ");
}

// Bytes per second in and out, by link, since the previous state.
function ratesOf(traffic) {
  const last = before;
  before = { traffic, at: performance.now() };
  if (last === null) return new Map();
  const seconds = (before.at - last.at) / 1000;
  const rate = (name, way) => Math.max(traffic[name][way] - (last.traffic[name]?.[way] ?? 0), 0) / seconds;
  return new Map(Object.keys(traffic).map((name) => [name, `${size(rate(name, "bytes_received"))} in, ${size(rate(name, "bytes_sent"))} out`]));
}

const size = (bytes) => (bytes < 1000 ? `${Math.round(bytes)} B/s` : `${(bytes / 1000).toFixed(1)} kB/s`);

function pairs(id, rows) {
  const all = byId(id);
  if (!all.children.length) all.append(...rows.flatMap(([name]) => [make("dt", {}, name), make("dd")]));
  rows.forEach(([, value, kind], index) => {
    const shown = all.children[2 * index + 1];
    setText(shown, value);
    setClass(shown, kind ?? "");
  });
}

const list = (id, texts, otherwise) => setList(byId(id), "li", texts.length ? texts : [otherwise]);
