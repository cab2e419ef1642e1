// SPDX-License-Identifier: GPL-3.0-or-later
// Asks for the state once a second while somebody looks, and for the rest when the state says that it has changed.
import { ask } from "./daemon.js";
import { byId } from "./dom.js";
import { drawMap } from "./map.js";
import { showMissions, showRestore } from "./missions.js";
import { showOverview } from "./overview.js";
import { listTable } from "./tables.js";

const INTERVAL_MS = 1000, TRAIL_LENGTH = 600;
let held = { count: null, items: [] };
let shown = { mission: undefined, newest: undefined };
const trail = [];

async function look() {
  try {
    const state = await ask("/api/state");
    showOverview(state);
    await showHeld(state);
    await showNewest(state);
    showRestore(state.restore, state.status.armed);
    tellTrouble(state.store_trouble);
    document.body.classList.remove("stale");
  } catch (error) {
    document.body.classList.add("stale");
    tellTrouble(`${error.message} What is shown may be old.`);
  }
  document.body.dataset.looks = Number(document.body.dataset.looks ?? 0) + 1;
  setTimeout(onceVisible, INTERVAL_MS);
}

function onceVisible() {
  if (!document.hidden) look();
  else document.addEventListener("visibilitychange", onceVisible, { once: true });
}

async function showHeld(state) {
  const mission = JSON.stringify(state.mission);
  if (mission !== shown.mission) {
    held = await ask("/api/held");
    shown.mission = mission;
    byId("held-text").textContent = held.count === null ? "The list has not been read." : held.count ? `${held.count} records, checksum ${held.checksum}` : "No mission.";
    byId("held-list").replaceChildren(listTable(held.items));
  }
  follow(state.position);
  const map = byId("map");
  const drawn = drawMap(held.items, state.position, state.attitude, trail, Math.max(map.clientWidth, 200));
  map.replaceChildren(drawn ?? "Neither a list nor a position is known yet.");
}

async function showNewest(state) {
  const newest = JSON.stringify(state.newest_mission);
  if (newest === shown.newest || state.store_trouble) return;
  await showMissions(state.newest_mission);
  shown.newest = newest;
}

function follow(position) {
  if (position.lat_deg === null) return;
  const last = trail[trail.length - 1];
  if (last && last.lat === position.lat_deg && last.lon === position.lon_deg) return;
  trail.push({ lat: position.lat_deg, lon: position.lon_deg });
  if (trail.length > TRAIL_LENGTH) trail.shift();
}

function tellTrouble(text) {
  const line = byId("trouble");
  line.hidden = !text;
  if (line.textContent !== text) line.textContent = text;
}

look();
