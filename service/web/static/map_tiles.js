// SPDX-License-Identifier: GPL-3.0-or-later
// Map tiles under a map, fetched and cached by this browser if its user has switched them on; else plain ground.
import { byId, make, setText } from "./dom.js";

const RETRY_MS = 60000, FINEST = 19, OSM = "openstreetmap.org";
const TILE_PX = 256, EQUATOR_M = 40075016.686, MOST_LAT = 85.051128; // there the square ends
const choice = byId("tiles-on");
let source = null; // of /api/state: { tiles, credit }

choice.checked = localStorage.getItem("tiles") === "on";
choice.addEventListener("change", () => localStorage.setItem("tiles", choice.checked ? "on" : "off"));

export function followTiles(state) {
  source = state.map;
  setText(byId("tiles-about"), `from ${host()}, which then sees the places that you view`);
}

const host = () => new URL(source.tiles).host;
const period = () => Math.floor(performance.now() / RETRY_MS);

// What a layer's pictures depend on: the choice, and the time, because failed tiles are tried again.
export const tilesVersion = () => choice.checked && period();

export class TileLayer {
  element = make("div", { class: "map-tiles" });
  note = make("p", { class: "map-credit", role: "status" });
  #images = new Map(); // by zoom/x/y

  // map: of drawMap. Returns true if tiles are drawn.
  draw(map) {
    const places = choice.checked && map !== null ? placesIn(map) : [], wanted = new Set(places.map(({ key }) => key));
    for (const [key, image] of this.#images) if (!wanted.has(key) || image.dataset.failed < period()) this.#drop(key, image);
    this.element.hidden = places.length === 0;
    if (places.length) this.element.style.height = `${map.height}px`;
    for (const place of places) this.#place(place, map.view);
    this.#updateNote();
    return places.length > 0;
  }

  #drop(key, image) {
    image.remove();
    this.#images.delete(key);
  }

  #place({ key, zoom, column, row }, view) {
    if (!this.#images.has(key)) this.#load(key, source.tiles.replace("{z}", zoom).replace("{x}", ((column % 2 ** zoom) + 2 ** zoom) % 2 ** zoom).replace("{y}", row));
    // Edges are rounded, not sizes: neighbours then meet.
    const [left, top] = view({ lat: latOf(row, zoom), lon: lonOf(column, zoom) }).map(Math.round);
    const [right, bottom] = view({ lat: latOf(row + 1, zoom), lon: lonOf(column + 1, zoom) }).map(Math.round);
    Object.assign(this.#images.get(key).style, { left: `${left}px`, top: `${top}px`, width: `${right - left}px`, height: `${bottom - top}px` });
  }

  #load(key, address) {
    // OpenStreetMap's policy: requests must carry the page's origin.
    const image = make("img", { alt: "", referrerpolicy: "strict-origin-when-cross-origin", draggable: "false", onload: () => {
      image.className = "loaded";
      this.#updateNote();
    }, onerror: () => {
      image.dataset.failed = period();
      this.#updateNote();
    } });
    this.#images.set(key, image);
    this.element.append(image);
    image.src = address;
  }

  // The credit, or why there are no tiles.
  #updateNote() {
    const images = [...this.#images.values()];
    if (images.some((image) => image.className)) this.note.replaceChildren(credit());
    else setText(this.note, images.some((image) => image.dataset.failed) ? `No map tiles: this browser gets none from ${host()}.` : "");
  }
}

function credit() {
  const isOsm = `.${host()}`.endsWith(`.${OSM}`);
  if (source.credit || !isOsm) return source.credit ?? host();
  return make("a", { href: `https://www.${OSM}/copyright`, rel: "noreferrer", target: "_blank" }, "© OpenStreetMap contributors");
}

function placesIn({ view, width, height }) {
  const northWest = view.placeAt(0, 0), southEast = view.placeAt(width, height);
  const zoom = zoomFor(view.pixelsPerMetre, (northWest.lat + southEast.lat) / 2), side = 2 ** zoom;
  const left = Math.floor(columnOf(northWest.lon, zoom)), right = Math.min(Math.floor(columnOf(southEast.lon, zoom)), left + side - 1);
  const top = Math.max(Math.floor(rowOf(northWest.lat, zoom)), 0), bottom = Math.min(Math.floor(rowOf(southEast.lat, zoom)), side - 1);
  const places = [];
  for (let row = top; row <= bottom; row += 1) {
    for (let column = left; column <= right; column += 1) places.push({ key: `${zoom}/${column}/${row}`, zoom, column, row });
  }
  return places;
}

// In tiles, with fractions, from the north-west corner of the world, whose side has 2^zoom tiles (Web Mercator).
const columnOf = (lon, zoom) => ((lon + 180) / 360) * 2 ** zoom;
const rowOf = (lat, zoom) => (0.5 - Math.asinh(Math.tan((clamp(lat) * Math.PI) / 180)) / (2 * Math.PI)) * 2 ** zoom;
const lonOf = (column, zoom) => (column / 2 ** zoom) * 360 - 180;
const latOf = (row, zoom) => (Math.atan(Math.sinh((0.5 - row / 2 ** zoom) * 2 * Math.PI)) * 180) / Math.PI;

// The zoom whose tiles are drawn nearest to their own size.
function zoomFor(pixelsPerMetre, lat) {
  const tile_m = TILE_PX / pixelsPerMetre, around_m = EQUATOR_M * Math.cos((clamp(lat) * Math.PI) / 180);
  return Math.min(Math.max(Math.round(Math.log2(around_m / tile_m)), 0), FINEST);
}

const clamp = (lat) => Math.min(Math.max(lat, -MOST_LAT), MOST_LAT);
