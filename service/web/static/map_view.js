// SPDX-License-Identifier: GPL-3.0-or-later
// A map that is zoomed and panned: with its buttons, the arrow keys, two fingers, or the mouse.
import { make } from "./dom.js";
import { drawMap } from "./map.js";
import { TileLayer, tilesVersion } from "./map_tiles.js";

const STEP = 1.5, LEAST = 1, MOST = 64, PAN_PX = 60, FINGER_PX = 24;
const ARROWS = { ArrowLeft: [PAN_PX, 0], ArrowRight: [-PAN_PX, 0], ArrowUp: [0, PAN_PX], ArrowDown: [0, -PAN_PX] };

export class MapView {
  #tiles = new TileLayer();
  #canvas = make("div", { class: "map-canvas" });
  #tools;
  #note = make("p", { class: "map-note", role: "status" }); // touch screens lack tooltips
  #contents = null;
  #drawn = "";
  #camera = { zoom: 1, dx: 0, dy: 0 }; // zoom 1: everything fits; dx, dy: pixels
  #fingers = new Map();

  constructor(container) {
    const button = (label, name, press) => make("button", { type: "button", "aria-label": `${label === "Fit" ? "Fit: show everything" : name}: ${container.id}`, title: name, onclick: press }, label);
    this.#tools = make("div", { class: "map-tools" },
      button("+", "Zoom in", () => this.#zoom(STEP)), button("−", "Zoom out", () => this.#zoom(1 / STEP)), button("Fit", "Show everything", () => this.#move({ zoom: 1, dx: 0, dy: 0 })));
    container.append(this.#tiles.element, this.#canvas, this.#tools, this.#tiles.note, this.#note);
    this.#canvas.addEventListener("click", (event) => this.#showMark(event));
    container.addEventListener("keydown", (event) => this.#key(event));
    this.#canvas.addEventListener("pointerdown", (event) => this.#fingers.set(event.pointerId, [event.clientX, event.clientY]));
    this.#canvas.addEventListener("pointermove", (event) => this.#drag(event));
    for (const end of ["pointerup", "pointercancel", "pointerleave"]) this.#canvas.addEventListener(end, (event) => this.#fingers.delete(event.pointerId));
    new ResizeObserver(() => this.#draw()).observe(container);
  }

  // contents: as for drawMap.
  show(contents) {
    this.#contents = contents;
    this.#draw();
  }

  #draw() {
    if (this.#contents === null) return;
    const width = Math.max(this.#canvas.clientWidth, 200);
    const wanted = JSON.stringify([this.#contents, this.#camera, width, tilesVersion()]);
    if (wanted === this.#drawn) return;
    this.#drawn = wanted;
    const map = drawMap(this.#contents, width, this.#camera);
    this.#tools.hidden = map === null;
    this.#canvas.replaceChildren(map?.svg ?? make("p", { class: "soft" }, "Neither a mission nor a position is known yet."));
    this.#canvas.classList.toggle("on-tiles", this.#tiles.draw(map));
    // Until it is zoomed, one finger scrolls the page.
    this.#canvas.classList.toggle("zoomed", this.#camera.zoom > 1);
  }

  // The name and height of the mark under a finger.
  #showMark(event) {
    let nearest = "", least = FINGER_PX;
    for (const mark of this.#canvas.querySelectorAll("g.touched")) {
      const box = mark.getBoundingClientRect();
      const far = Math.hypot(event.clientX - box.left - box.width / 2, event.clientY - box.top - box.height / 2);
      if (far <= least) [nearest, least] = [mark.querySelector("title").textContent, far];
    }
    this.#note.textContent = nearest;
  }

  #move(camera) {
    this.#camera = camera.zoom <= LEAST ? { zoom: 1, dx: 0, dy: 0 } : camera;
    this.#draw();
  }

  #pan(dx, dy) {
    if (this.#camera.zoom > 1) this.#move({ ...this.#camera, dx: this.#camera.dx + dx, dy: this.#camera.dy + dy });
  }

  // x, y: the point that stays where it is, pixels from the middle.
  #zoom(factor, x = 0, y = 0) {
    const { zoom, dx, dy } = this.#camera;
    const next = Math.min(Math.max(zoom * factor, LEAST), MOST), ratio = next / zoom;
    this.#move({ zoom: next, dx: x - (x - dx) * ratio, dy: y - (y - dy) * ratio });
  }

  #zoomAt(factor, clientX, clientY) {
    const box = this.#canvas.getBoundingClientRect();
    this.#zoom(factor, clientX - box.left - box.width / 2, clientY - box.top - box.height / 2);
  }

  #key(event) {
    const arrow = ARROWS[event.key];
    if (!arrow || this.#camera.zoom <= 1) return;
    event.preventDefault();
    this.#pan(...arrow);
  }

  #drag(event) {
    const before = this.#fingers.get(event.pointerId);
    if (!before) return;
    const now = [event.clientX, event.clientY];
    const other = [...this.#fingers].find(([id]) => id !== event.pointerId)?.[1];
    this.#fingers.set(event.pointerId, now);
    if (!other) {
      this.#pan(now[0] - before[0], now[1] - before[1]);
      return;
    }
    const distance = (point) => Math.max(Math.hypot(point[0] - other[0], point[1] - other[1]), 1);
    this.#zoomAt(distance(now) / distance(before), (now[0] + other[0]) / 2, (now[1] + other[1]) / 2);
  }
}
