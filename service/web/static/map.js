// SPDX-License-Identifier: GPL-3.0-or-later
// The mission and the craft on a map without a map server: metres around the middle, north up.
import { draw } from "./dom.js";

const METRES_PER_DEGREE = 111320;
const LOITERS = [17, 18, 19], ROIS = [80, 195, 201];
const MARGIN = 40, LEAST_SPAN_M = 40, FARTHEST_M = 50000;

const isPlaced = (item) => Boolean(item.lat_e7 && item.lon_e7);
const placeOf = (item) => ({ lat: item.lat_e7 / 1e7, lon: item.lon_e7 / 1e7 });

// items, path: of /api/held; flown: the seq of the one that is flown, or null. position, attitude: of /api/state.
// trail: the track that was flown, [{lat, lon}]; decisions: what the board decided on it, [{lat, lon, text}].
// camera: zoom (1: everything fits) and dx, dy in pixels.
// Returns { svg, view, width, height }, or null without any position. view(place): its [x, y] in the picture.
export function drawMap({ items, path, flown, position, attitude, trail, decisions = [] }, width, camera) {
  const placed = items.filter(isPlaced);
  const craft = position.lat_deg === null ? null : { lat: position.lat_deg, lon: position.lon_deg };
  const home = craftHome(position) ?? (items.length && isPlaced(items[0]) ? placeOf(items[0]) : null);
  const middle = home ?? craft ?? (placed.length ? placeOf(placed[0]) : null);
  if (middle === null) return null;
  const height = Math.round(Math.max(Math.min(width * 0.72, innerHeight * 0.6, 640), 260));
  const near = (place) => place !== null && distance(middle, place) < FARTHEST_M;
  const view = projection([...placed.map(placeOf), home, craft].filter(near), middle, width, height, camera);
  const svg = draw("svg", { viewBox: `0 0 ${width} ${height}`, role: "img", "aria-label": inWords(items, flown, home, craft) });
  svg.append(...tracks(path, view));
  if (trail.length > 1) svg.append(draw("polyline", { class: "trail", points: line(trail, view) }));
  for (const each of decisions) svg.append(decisionMark(view(each), each.text));
  if (home) svg.append(homeMark(view(home)));
  for (const item of placed.filter((each) => each.seq > 0)) svg.append(itemMark(item, view(placeOf(item)), item.seq === flown));
  if (craft) svg.append(craftMark(view(craft), attitude.heading_deg, position.height_m));
  svg.append(...scaleBar(view.pixelsPerMetre, width, height), ...northArrow(width));
  return { svg, view, width, height };
}

function craftHome(position) {
  return position.home_lat_deg === null ? null : { lat: position.home_lat_deg, lon: position.home_lon_deg };
}

function metres(middle, place) {
  const shrink = Math.cos((middle.lat * Math.PI) / 180);
  const turn = ((place.lon - middle.lon + 540) % 360) - 180; // across the date line
  return { east: turn * METRES_PER_DEGREE * shrink, north: (place.lat - middle.lat) * METRES_PER_DEGREE };
}

function placeAt(middle, east, north) {
  const shrink = Math.cos((middle.lat * Math.PI) / 180);
  return { lat: middle.lat + north / METRES_PER_DEGREE, lon: middle.lon + east / (METRES_PER_DEGREE * shrink) };
}

function distance(from, to) {
  const { east, north } = metres(from, to);
  return Math.hypot(east, north);
}

function projection(places, middle, width, height, camera) {
  const points = places.map((place) => metres(middle, place));
  const range = (values) => [Math.min(...values), Math.max(...values)];
  const [west, east] = range(points.map((point) => point.east));
  const [south, north] = range(points.map((point) => point.north));
  const scale = camera.zoom * Math.min(
    (width - 2 * MARGIN) / Math.max(east - west, LEAST_SPAN_M),
    (height - 2 * MARGIN) / Math.max(north - south, LEAST_SPAN_M),
  );
  const left = width / 2 + camera.dx - ((west + east) / 2) * scale, top = height / 2 + camera.dy + ((south + north) / 2) * scale;
  const view = (place) => {
    const point = metres(middle, place);
    return [round(left + point.east * scale), round(top - point.north * scale)];
  };
  view.placeAt = (x, y) => placeAt(middle, (x - left) / scale, (top - y) / scale);
  view.pixelsPerMetre = scale;
  return view;
}

const round = (value) => Math.round(value * 10) / 10;
const line = (places, view) => places.map((place) => view(place).join(",")).join(" ");

function tracks(path, view) {
  const ends = ({ start, end }) => line([start, end].map(([lat, lon]) => ({ lat: lat / 1e7, lon: lon / 1e7 })), view);
  return path.map((leg) => draw("polyline", { class: leg.is_return ? "track back" : "track", points: ends(leg) }));
}

function itemMark(item, [x, y], isFlown) {
  const title = `${item.seq} ${item.name}, ${item.alt_m} m${isFlown ? ", flown now" : ""}`;
  const group = draw("g", { class: isFlown ? "touched flown" : "touched" }, draw("title", {}, title));
  if (ROIS.includes(item.command)) group.append(draw("path", { class: "roi", d: `M${x} ${y - 13}l13 13-13 13-13-13z` }));
  else group.append(draw("circle", { class: "point", cx: x, cy: y, r: 10 }));
  if (LOITERS.includes(item.command)) group.append(draw("circle", { class: "loiter", cx: x, cy: y, r: 15 }));
  group.append(draw("text", { class: "number", x, y: y + 4 }, String(item.seq)));
  return group;
}

function decisionMark([x, y], text) {
  return draw("g", { class: "touched" }, draw("title", {}, text), draw("circle", { class: "decision", cx: x, cy: y, r: 4 }));
}

function homeMark([x, y]) {
  return draw(
    "g", { class: "touched" }, draw("title", {}, "Home"),
    draw("rect", { class: "home", x: x - 10, y: y - 10, width: 20, height: 20, rx: 4 }),
    draw("text", { class: "home-text", x, y: y + 4.5 }, "H"),
  );
}

function craftMark([x, y], heading, height_m) {
  const shape = heading === null
    ? draw("circle", { class: "craft", cx: x, cy: y, r: 7 })
    : draw("path", { class: "craft", d: "M0 -14l8 22-8-5-8 5z", transform: `translate(${x} ${y}) rotate(${round(heading)})` });
  const title = height_m === null || height_m === undefined ? "Craft" : `Craft, ${height_m.toFixed(1)} m above home`;
  return draw("g", { class: "touched craft-mark" }, draw("title", {}, title), shape);
}

function scaleBar(pixelsPerMetre, width, height) {
  const most = (width * 0.3) / pixelsPerMetre;
  const power = 10 ** Math.floor(Math.log10(most));
  const length = [5, 2, 1].map((times) => times * power).find((candidate) => candidate <= most);
  const x = 12, y = height - 14, end = round(x + length * pixelsPerMetre);
  const text = length >= 1000 ? `${length / 1000} km` : `${length} m`;
  return [draw("path", { class: "scale", d: `M${x} ${y - 6}v6H${end}v-6` }), draw("text", { x: x + 4, y: y - 5 }, text)];
}

function northArrow(width) {
  const x = width - 20;
  return [draw("path", { class: "north", d: `M${x} 10l6 18-6-4-6 4z` }), draw("text", { x: x - 4.5, y: 42 }, "N")];
}

function inWords(items, flown, home, craft) {
  const parts = [`Map with ${items.filter((item) => item.seq > 0 && isPlaced(item)).length} positions of the mission`];
  if (flown !== null) parts.push(`item ${flown} is flown now`);
  if (home && craft) parts.push(`the craft is ${Math.round(distance(home, craft))} m from home`);
  return parts.join("; ");
}
