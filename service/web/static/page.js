// SPDX-License-Identifier: GPL-3.0-or-later
// Asks for the state once a second while the page is visible, and for the rest when the state shows a change.
import { showConnect } from "./connect.js";
import { ask } from "./daemon.js";
import { byId, setText } from "./dom.js";
import "./firmware.js";
import { FlownTrack } from "./flown_track.js";
import "./logs.js";
import { followTiles } from "./map_tiles.js";
import { MapView } from "./map_view.js";
import { followFile } from "./mission_file.js";
import { showMissions } from "./missions.js";
import { showOverview } from "./overview.js";
import "./pi.js";
import { showWires } from "./pi_doctor.js";
import { showProfile } from "./profile.js";
import { showSettings } from "./settings.js";
import { showStateBar } from "./state_bar.js";
import { listTable, markFlown } from "./tables.js";
import { followWrites } from "./write_form.js";

const INTERVAL_MS = 800, TRANSFER_INTERVAL_MS = 250;
const STALE_MS = 1500, WATCH_MS = 100;
const map = new MapView(byId("map"));
const shown = { mission: undefined, newest: undefined, backup: undefined };
const track = new FlownTrack();
let held = { count: null, items: [] };
let last = null, lastAt = performance.now();

async function look() {
  const askedAt = performance.now();
  try {
    const state = await ask("/api/state");
    if (last && last.version !== state.version) return location.reload(); // upgraded: these scripts are the old ones
    last = state;
    lastAt = performance.now();
    document.body.classList.remove("stale");
    showStateBar(state, null);
    showOverview(state);
    showWires(state);
    followTiles(state);
    followWrites(state, askedAt);
    followFile(state);
    await showHeld(state);
    await showNewest(state);
    await showBackups(state);
    await showConnect();
    showTrouble(state.store_trouble);
  } catch (error) {
    if (last === null || isStale()) showSilence(error.message);
    else showTrouble(error.message);
  }
  document.body.dataset.looks = Number(document.body.dataset.looks ?? 0) + 1;
  setTimeout(onceVisible, last?.transfer ? TRANSFER_INTERVAL_MS : INTERVAL_MS);
}

const isStale = () => performance.now() - lastAt > STALE_MS;

// A request without a reply fails only after seconds: by then a green DISARMED would be a guess.
function watch() {
  if (last !== null && isStale()) showSilence();
}

function showSilence(reason = null) {
  const silent_s = (performance.now() - lastAt) / 1000;
  document.body.classList.add("stale");
  showStateBar(last, silent_s, reason !== null);
  showTrouble(`${reason ?? "The Pi does not answer."} The values below may be old.`);
}

function onceVisible() {
  if (!document.hidden) look();
  else document.addEventListener("visibilitychange", onceVisible, { once: true });
}

async function showHeld(state) {
  const isLost = state.lost_s !== null, mission = JSON.stringify([state.mission?.count, state.mission?.checksum, isLost]);
  if (mission !== shown.mission) {
    const now = await ask("/api/held");
    shown.mission = mission;
    const isOld = isLost && now.count === null && held.count > 0; // the lost craft may still fly it
    if (!isOld) held = now;
    const text = held.count ? `${held.count} records, checksum ${held.checksum}${isOld ? ", as last read" : ""}` : "No mission.";
    setText(byId("held-text"), held.count === null ? "The mission has not been read yet." : text);
    byId("held-list").replaceChildren(listTable(held.items));
    showProfile(byId("profile"), held.items);
  }
  const flown = state.mission?.item ?? null, trail = await track.follow(state);
  markFlown(byId("held-list"), flown);
  const { lat_deg, lon_deg } = state.last_heard; // the map also shows where the craft was lost
  map.show({ items: held.items, flown, position: { ...state.position, lat_deg, lon_deg }, attitude: state.attitude, trail });
}

async function showNewest(state) {
  const newest = JSON.stringify(state.newest_mission);
  if (newest === shown.newest || state.store_trouble) return;
  await showMissions(state.newest_mission);
  shown.newest = newest;
}

async function showBackups(state) {
  if (state.newest_backup === shown.backup || state.store_trouble) return;
  await showSettings();
  shown.backup = state.newest_backup;
}

function showTrouble(text) {
  byId("trouble").hidden = !text;
  setText(byId("trouble"), text);
}

setInterval(watch, WATCH_MS);
look();
