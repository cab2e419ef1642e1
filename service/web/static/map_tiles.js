// SPDX-License-Identifier: GPL-3.0-or-later
// Map tiles under a map: those kept on the Pi, else the source's own if this browser has a network, else plain ground.
import { ask } from "./daemon.js";
import { make, setText } from "./dom.js";
import { columnOf, latOf, lonOf, rowOf, zoomFor } from "./mercator.js";

const TIMEOUT_MS = 15000, RETRY_MS = 60000;
let tiles = { on: false }; // of /api/state
let wasOn = null; // when this page was loaded: only then the browser may load pictures from the source

export function followTiles(state) {
  tiles = state.map;
  wasOn ??= tiles.on;
}

// What a layer's pictures depend on.
export const tilesVersion = () => [tiles.on, tiles.tiles];

export class TileLayer {
  element = make("div", { class: "map-tiles" });
  note = make("p", { class: "map-credit", role: "status" });
  #pictures = new Map(); // by zoom/x/y: { box, zoom, x, y, isShown, pending }
  #kept = new Map(); // by x/y: the zoom of the tile kept on the Pi
  #area = null;
  #requested = "";
  #failed = new Map(); // addresses, and when

  // The tiles in view: { zoom, x, y, columns, rows }; null if there are none.
  get area() {
    return this.#area;
  }

  // map: of drawMap.
  draw(map) {
    this.#area = tiles.on && map !== null ? areaOf(map) : null;
    this.element.hidden = this.#area === null;
    const places = this.#area === null ? [] : placesIn(this.#area), wanted = new Set(places.map(({ key }) => key));
    for (const [key, { box }] of this.#pictures) {
      if (wanted.has(key)) continue;
      box.remove();
      this.#pictures.delete(key);
    }
    if (this.#area === null) {
      this.#requested = "";
      setText(this.note, "");
      return;
    }
    this.element.style.height = `${map.height}px`;
    for (const place of places) this.#place(place, map.view);
    this.#lookUp();
  }

  #place({ key, zoom, column, row }, view) {
    if (!this.#pictures.has(key)) {
      const box = make("div", { class: "map-tile" });
      this.element.append(box);
      this.#pictures.set(key, { box, zoom, x: column & (2 ** zoom - 1), y: row, isShown: false, pending: 0 });
    }
    // Edges are rounded, not sizes: neighbours then meet.
    const [left, top] = view({ lat: latOf(row, zoom), lon: lonOf(column, zoom) }).map(Math.round);
    const [right, bottom] = view({ lat: latOf(row + 1, zoom), lon: lonOf(column + 1, zoom) }).map(Math.round);
    Object.assign(this.#pictures.get(key).box.style, { left: `${left}px`, top: `${top}px`, width: `${right - left}px`, height: `${bottom - top}px` });
  }

  // Asks the Pi which of the tiles it has: once for each view.
  async #lookUp() {
    const query = new URLSearchParams(this.#area).toString(), request = `${query} ${tilesVersion()} ${this.#period()}`;
    if (request === this.#requested) return;
    this.#requested = request;
    try {
      const { kept } = await ask(`/api/map/kept?${query}`);
      this.#kept = new Map(kept.map(([x, y, zoom]) => [`${x}/${y}`, zoom]));
    } catch {
      this.#kept = new Map();
    }
    if (request === this.#requested) for (const picture of this.#pictures.values()) this.#fill(picture);
  }

  // After a while failed tiles are tried again.
  #period() {
    const since = performance.now() - RETRY_MS;
    for (const [address, at] of this.#failed) if (at < since) this.#failed.delete(address);
    return this.#failed.size > 0;
  }

  #fill(picture) {
    const { box, zoom, x, y } = picture, kept = this.#kept.get(`${x}/${y}`);
    const own = `/api/map/tiles/${zoom}/${x}/${y}`;
    const source = tiles.source.replace("{z}", zoom).replace("{x}", x).replace("{y}", y);
    if (kept === zoom) this.#load(picture, own);
    else {
      if (kept !== undefined && !box.children.length) this.#load(picture, ...coarser(x, y, zoom, kept));
      if (wasOn) this.#load(picture, source);
    }
    this.#updateNote();
  }

  // part: of the picture that fills the box: { left, top, size }, in boxes.
  #load(picture, address, part = { left: 0, top: 0, size: 1 }) {
    if (this.#failed.has(address) || [...picture.box.children].some((each) => each.dataset.address === address)) return;
    const end = () => {
      clearTimeout(timer);
      picture.pending -= 1;
      this.#updateNote();
    };
    const fail = () => {
      this.#failed.set(address, performance.now());
      image.remove();
      end();
    };
    // OpenStreetMap's policy: requests must carry the page's origin.
    const image = make("img", { alt: "", "data-address": address, referrerpolicy: "strict-origin-when-cross-origin", draggable: "false", onload: () => {
      picture.isShown = true;
      image.classList.add("loaded");
      end();
    }, onerror: fail });
    Object.assign(image.style, { left: `${-100 * part.left}%`, top: `${-100 * part.top}%`, width: `${100 * part.size}%`, height: `${100 * part.size}%` });
    const timer = setTimeout(() => image.isConnected && !image.complete && fail(), TIMEOUT_MS);
    picture.pending += 1;
    picture.box.append(image);
    image.src = address;
  }

  // The credit, or once why there are no tiles.
  #updateNote() {
    const pictures = [...this.#pictures.values()];
    if (pictures.some(({ isShown }) => isShown)) {
      if (this.note.dataset.credit !== tiles.credit) this.note.replaceChildren(tiles.credit_page ? make("a", { href: tiles.credit_page, rel: "noreferrer", target: "_blank" }, tiles.credit) : tiles.credit);
      this.note.dataset.credit = tiles.credit;
      return;
    }
    delete this.note.dataset.credit;
    if (pictures.some(({ pending }) => pending)) return;
    const why = wasOn ? `this browser gets none from ${tiles.host}` : `after a reload this browser asks ${tiles.host}`;
    setText(this.note, `No map tiles here: the Pi keeps none of this area, and ${why}.`);
  }
}

// A tile within the coarser one that is kept.
function coarser(x, y, zoom, kept) {
  const size = 2 ** (zoom - kept), column = Math.floor(x / size), row = Math.floor(y / size);
  return [`/api/map/tiles/${kept}/${column}/${row}`, { left: x - column * size, top: y - row * size, size }];
}

function areaOf({ view, width, height }) {
  const northWest = view.placeAt(0, 0), southEast = view.placeAt(width, height);
  const zoom = zoomFor(view.pixelsPerMetre, (northWest.lat + southEast.lat) / 2, tiles.finest), side = 2 ** zoom;
  const left = Math.floor(columnOf(northWest.lon, zoom)), right = Math.floor(columnOf(southEast.lon, zoom));
  const y = Math.max(Math.floor(rowOf(northWest.lat, zoom)), 0), bottom = Math.min(Math.floor(rowOf(southEast.lat, zoom)), side - 1);
  return { zoom, x: ((left % side) + side) % side, y, columns: Math.min(right - left + 1, side), rows: bottom - y + 1 };
}

function placesIn({ zoom, x, y, columns, rows }) {
  const places = [];
  for (let row = y; row < y + rows; row += 1) {
    for (let column = x; column < x + columns; column += 1) places.push({ key: `${zoom}/${column}/${row}`, zoom, column, row });
  }
  return places;
}
