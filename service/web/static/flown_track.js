// SPDX-License-Identifier: GPL-3.0-or-later
// The track that the Pi has noted since the craft was armed: only its new places are fetched.
import { ask } from "./daemon.js";

export class FlownTrack {
  #version = null;
  #places = [];

  // state: of /api/state. Returns [{lat, lon}].
  async follow(state) {
    const { version, length } = state.track;
    if (version !== this.#version) [this.#version, this.#places] = [version, []];
    if (length > this.#places.length) {
      const more = await ask(`/api/track?first=${this.#places.length}`);
      if (more.version === version) this.#places.push(...more.places.map(([lat, lon]) => ({ lat, lon })));
    }
    return [...this.#places];
  }
}
