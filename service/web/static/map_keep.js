// SPDX-License-Identifier: GPL-3.0-or-later
// Switches the map's tiles on and off, and has the Pi keep those of the view for the field.
import { post } from "./daemon.js";
import { byId, make, say, setText } from "./dom.js";
import { action } from "./pi_request.js";
import { currentToken, tokenField } from "./token.js";

const about = make("p"), result = make("p", { class: "result", role: "status" });
const progress = make("div", { hidden: "" }), bar = make("progress", { id: "keep-bar", max: "1", value: "0" }), count = make("label", { for: "keep-bar" });
let tiles = null; // of /api/state
let map = null; // the MapView
let ended = null; // the result that is shown

const change = (path) => post(`/api/map${path}`, currentToken());
const toggle = action("", result, async () => {
  await change(`?on=${tiles.on ? 0 : 1}`);
  // Only a newly loaded page may, or may no longer, load pictures from the source. The token is kept.
  location.hash = `token=${encodeURIComponent(currentToken())}`;
  location.reload();
});
const keep = action("Keep this area for the field", result, async () => {
  if (map.tileArea === null) throw new Error("The map shows no place yet.");
  ended = null;
  await change(`/keep?${new URLSearchParams(map.tileArea)}`);
});
const stop = action("Stop", result, () => change("/stop").then(() => ""));
const forget = action("Delete the kept tiles", result, () => change("/forget").then(() => "Deleted."));

progress.append(count, " ", bar);
byId("map-tiles").append(about, make("div", { class: "row" }, tokenField(), toggle, keep, stop, forget), progress, result);

// state: of /api/state.
export function showTileTools(state, view) {
  [tiles, map] = [state.map, view];
  const { on, host, can_keep: canKeep, keeping } = tiles, isRunning = Boolean(keeping?.running);
  setText(toggle, on ? "Show plain ground" : "Show map tiles");
  keep.hidden = !on || !canKeep || isRunning;
  stop.hidden = !isRunning;
  forget.hidden = !tiles.tiles || isRunning;
  setText(about, sentences(on, host, canKeep).join(" "));
  progress.hidden = !isRunning;
  if (isRunning) {
    setText(count, `${keeping.done} of ${keeping.total} tiles, ${size(keeping.bytes)} kept in all`);
    Object.assign(bar, { max: keeping.total, value: keeping.done });
  } else if (keeping?.text && keeping.text !== ended) {
    ended = keeping.text;
    say(result, "", ended);
  }
}

function sentences(on, host, canKeep) {
  const kept = tiles.tiles ? [`${tiles.tiles} tiles, ${size(tiles.bytes)}, are kept on the Pi.`] : [];
  if (!on) return [`Off: the map is drawn on plain ground. When on, this browser fetches the tiles of the places that you view from ${host}.`, ...kept];
  const keepable = canKeep ? `The Pi can keep the tiles of this view for a field without a network.` : `The Pi keeps no tiles: ${host} does not allow that. Name another server in the setting web.map_tiles.`;
  return [`Tiles come from the Pi, else from ${host}.`, keepable, ...kept];
}

const size = (bytes) => `${(bytes / 1e6).toFixed(1)} MB`;
