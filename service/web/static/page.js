// SPDX-License-Identifier: GPL-3.0-or-later
// The tasks, and the loop: asks for the state once a second while the page is visible, and for the rest when it changes.
import "./check.js";
import { ask } from "./daemon.js";
import { byId, setText } from "./dom.js";
import { showConnect, showValues } from "./fly.js";
import { HeldMission } from "./held_mission.js";
import { followTiles } from "./map_tiles.js";
import { followFile } from "./mission_file.js";
import { openPi } from "./pi.js";
import { showStateBar } from "./state_bar.js";
import { showMissions, showSettings } from "./stored.js";
import { followWrites } from "./write_form.js";

const INTERVAL_MS = 800, TRANSFER_INTERVAL_MS = 250;
const STALE_MS = 1500, WATCH_MS = 100;
const held = new HeldMission();
const shown = { mission: undefined, backup: undefined };
let last = null, lastAt = performance.now();

function showTask() {
  const links = [...document.querySelectorAll("nav a")];
  const task = (links.find((link) => link.hash === location.hash) ?? links[0]).hash.slice(1);
  document.body.dataset.task = task;
  for (const link of links) {
    if (link.hash === `#${task}`) link.setAttribute("aria-current", "page");
    else link.removeAttribute("aria-current");
  }
  showParts();
  scrollTo(0, 0);
  if (task === "pi") openPi();
}

// Before a board was ever heard, the first task is to connect it; a checked file takes the place of the held mission.
function showParts() {
  const { task } = document.body.dataset, isNew = last !== null && last.link.flight_controller === null && last.lost_s === null;
  const hasFile = byId("checked").hasChildNodes();
  for (const part of document.querySelectorAll("main > section")) part.hidden = !part.dataset.task.split(" ").includes(task);
  if (task === "fly") for (const [id, isShown] of [["no-board", isNew], ["held", !isNew], ["values", !isNew]]) byId(id).hidden = !isShown;
  if (task === "mission") for (const [id, isShown] of [["checked", hasFile], ["held", !hasFile], ["held-mission", !hasFile]]) byId(id).hidden = !isShown;
}

async function look() {
  const askedAt = performance.now();
  try {
    const state = await ask("/api/state");
    if (last && last.version !== state.version) return location.reload(); // upgraded: these scripts are the old ones
    last = state;
    lastAt = performance.now();
    document.body.classList.remove("stale");
    showParts();
    showStateBar(state, null);
    showValues(state);
    followTiles(state);
    followWrites(state, askedAt);
    followFile(state);
    await held.show(state);
    await showStored(state);
    await showConnect();
    showTrouble(state.store_trouble || state.clock_trouble);
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

async function showStored({ newest_mission: mission, newest_backup: backup, store_trouble: trouble }) {
  if (trouble) return;
  if (shown.mission !== JSON.stringify(mission)) await showMissions(mission);
  if (shown.backup !== backup) await showSettings();
  Object.assign(shown, { mission: JSON.stringify(mission), backup });
}

function showTrouble(text) {
  byId("trouble").hidden = !text;
  setText(byId("trouble"), text);
}

addEventListener("hashchange", showTask);
document.addEventListener("filechecked", () => {
  if (location.hash === "#mission") showTask();
  else location.hash = "#mission";
});
for (const block of document.querySelectorAll(".on-a-desk")) block.open = matchMedia("(min-width: 48rem)").matches;
setInterval(watch, WATCH_MS);
showTask();
look();
