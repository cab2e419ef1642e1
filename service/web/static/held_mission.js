// SPDX-License-Identifier: GPL-3.0-or-later
// The mission on the flight controller: on the map with the craft, and as a list.
import { ask } from "./daemon.js";
import { byId, setText } from "./dom.js";
import { MapView } from "./map_view.js";
import { listTable } from "./mission_tables.js";

const STEP_DEG = 1e-5; // about 1 m

export class HeldMission {
  #map = new MapView(byId("map"));
  #shown; // identifies the mission that is shown
  #held = { count: null, items: [], path: [] };
  #trail = []; // of the craft since it was armed, or since the page was opened
  #decisions = []; // of a board that flies its mission, and where
  #wasArmed = null;

  // state: of /api/state.
  async show(state) {
    const isLost = state.lost_s !== null, mission = JSON.stringify([state.mission?.count, state.mission?.checksum, isLost]);
    if (mission !== this.#shown) {
      const now = await ask("/api/held");
      this.#shown = mission;
      const isOld = isLost && now.count === null && this.#held.count > 0; // the lost craft may still fly it
      if (!isOld) this.#held = now;
      const { count, checksum, items } = this.#held;
      const text = count ? `${count} records, checksum ${checksum}${isOld ? ", as last read" : ""}` : "No mission.";
      setText(byId("held-text"), count === null ? "The mission has not been read yet." : text);
      byId("held-list").replaceChildren(listTable(items));
    }
    const flown = state.mission?.item ?? null, { lat_deg, lon_deg } = state.last_heard; // where the craft was lost
    this.#follow(state.last_heard);
    this.#note(state.last_heard, state.mission);
    this.#map.show({ items: this.#held.items, path: this.#held.path, flown, position: { ...state.position, lat_deg, lon_deg }, attitude: state.attitude, trail: [...this.#trail], decisions: this.#decisions });
  }

  #note({ armed, lat_deg: lat, lon_deg: lon }, mission) {
    if (!armed || lat === null || !mission?.state) return;
    const text = mission.why ?? `item ${mission.item ?? "none"}, ${mission.state}`;
    if (text !== this.#decisions[this.#decisions.length - 1]?.text) this.#decisions.push({ lat, lon, text });
  }

  #follow({ armed, lat_deg: lat, lon_deg: lon }) {
    if (armed && !this.#wasArmed) [this.#trail, this.#decisions] = [[], []];
    this.#wasArmed = armed;
    const last = this.#trail[this.#trail.length - 1];
    if (!armed || lat === null || (last && Math.hypot(lat - last.lat, lon - last.lon) < STEP_DEG)) return;
    this.#trail.push({ lat, lon });
  }
}
