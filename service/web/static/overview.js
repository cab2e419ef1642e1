// SPDX-License-Identifier: GPL-3.0-or-later
// How everything is now: what /api/state tells, as words.
import { byId, make } from "./dom.js";

const known = (value, unit = "", digits = 0) => (value === null || value === undefined ? "–" : `${value.toFixed(digits)}${unit}`);
let before = null; // the last count of bytes, and when it came

export function showOverview(state) {
  byId("version").textContent = state.version;
  const armed = state.status.armed;
  const rates = ratesOf(state.traffic);
  byId("headline").textContent = headline(state, armed);
  byId("headline").className = state.link.flight_controller === null ? "bad" : "good";
  const stale = state.status.age_s > 1.5;
  byId("vehicle").classList.toggle("stale", stale);
  pairs("vehicle", [
    ...(stale ? [["Last heard", `${Math.round(state.status.age_s)} s ago`, "bad"]] : []),
    ["State", armed === null ? "unknown" : armed ? "ARMED" : "disarmed", armed ? "bad" : ""],
    ["Mode", state.status.mode ?? "–"],
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
    ["Who", state.link.flight_controller ?? "nobody yet"],
    ["Protocol", state.link.state],
    ["Port", state.port.address + (state.link.speed_baud ? `, ${state.link.speed_baud} baud` : "")],
    ["Line", rates.get("fc") ?? "–"],
    ["Round trip", known(state.link.round_trip_ms, " ms", 1)],
    ["Unanswered", known(state.link.requests_lost)],
    ["Damaged", known(state.link.bad_checksums)],
    ["Mission", state.mission === null ? "not read yet" : state.mission.count ? `${state.mission.count} records, ${state.mission.checksum}` : "none"],
  ]);
  const refused = state.refused.map((text) => `refused: ${text}`);
  const links = [...rates].filter(([name]) => name !== "fc").map(([name, rate]) => `${name}: ${rate}`);
  list("ground", [...state.link.ground_stations, ...refused], "Nobody is connected.");
  list("links", links, "Nothing was sent yet.");
  list("recording", state.recording, "Nothing is recorded.");
}

function headline(state, armed) {
  if (state.port.trouble) return state.port.trouble;
  if (state.link.flight_controller === null) return `Looking for a flight controller on ${state.port.address}`;
  return `${state.link.flight_controller}, ${armed === null ? state.link.state : armed ? "ARMED" : "disarmed"}`;
}

function battery({ voltage_v: volts, current_a: amperes, drawn_mah: drawn, remaining_percent: percent }) {
  const more = [percent === null ? "" : `about ${percent} %`, amperes === null ? "" : `${amperes.toFixed(1)} A`, drawn === null ? "" : `${drawn} mAh drawn`];
  return [known(volts, " V", 1), ...more.filter(Boolean)].join(", ");
}

// Bytes a second in and out, by link, between the last look and this one.
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
  byId(id).replaceChildren(...rows.flatMap(([name, value, kind]) => [make("dt", {}, name), make("dd", { class: kind || null }, value)]));
}

function list(id, texts, otherwise) {
  byId(id).replaceChildren(...(texts.length ? texts : [otherwise]).map((text) => make("li", {}, text)));
}
