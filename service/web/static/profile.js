// SPDX-License-Identifier: GPL-3.0-or-later
// The mission from the side: altitude above the launch point over the distance flown.
import { draw, make } from "./dom.js";

const WIDTH = 640, HEIGHT = 160, LEFT = 44, RIGHT = 14, TOP = 16, BOTTOM = 24;
const STEPS_M = [1, 2, 5, 10, 20, 50, 100, 200, 500, 1000, 2000, 5000];

// path: the legs flown, of /api/held or /api/check.
export function showProfile(container, path) {
  const points = flightPoints(path);
  container.replaceChildren(points.length > 1 ? drawProfile(points, Math.min(Math.max(container.clientWidth, 240), WIDTH)) : make("p", {}, "The mission has no flight path."));
}

// [{at_m, alt_m, seq}] along the way, from home on.
function flightPoints(path) {
  const points = [{ at_m: 0, alt_m: 0, seq: null }];
  for (const { seq, length_m, end_m } of path) {
    const { at_m, alt_m } = points[points.length - 1];
    points.push({ at_m: at_m + length_m, alt_m: end_m ?? alt_m, seq });
  }
  return points;
}

function drawProfile(points, width) {
  const alts = points.map((point) => point.alt_m), high = Math.max(...alts, 1), low = Math.min(...alts, 0), far = points[points.length - 1].at_m || 1;
  const x = (at_m) => Math.round((LEFT + (at_m / far) * (width - LEFT - RIGHT)) * 10) / 10;
  const y = (alt_m) => Math.round((HEIGHT - BOTTOM - ((alt_m - low) / (high - low)) * (HEIGHT - TOP - BOTTOM)) * 10) / 10;
  const step = STEPS_M.find((candidate) => (high - low) / candidate <= 4) ?? high;
  const svg = draw("svg", { viewBox: `0 0 ${width} ${HEIGHT}`, role: "img", class: "chart",
    "aria-label": `Altitude profile: up to ${Math.round(high)} m over ${length(far)}` });
  for (let alt = Math.ceil(low / step) * step; alt <= high; alt += step) {
    svg.append(draw("path", { class: "grid", d: `M${LEFT} ${y(alt)}H${width - RIGHT}` }), draw("text", { class: "y-label", x: LEFT - 6, y: y(alt) + 4 }, `${alt} m`));
  }
  const path = points.map((point) => `${x(point.at_m)},${y(point.alt_m)}`).join(" ");
  svg.append(draw("polygon", { class: "area", points: `${x(0)},${y(low)} ${path} ${x(far)},${y(low)}` }), draw("polyline", { class: "track", points: path }));
  let taken = -Infinity; // numbers that would overlap are left out
  for (const point of points) {
    const title = draw("title", {}, `${point.seq === null ? "Home" : point.seq}: ${point.alt_m} m`);
    svg.append(draw("circle", { class: "point", cx: x(point.at_m), cy: y(point.alt_m), r: 3 }, title));
    if (point.seq === null || x(point.at_m) - taken < 16) continue;
    svg.append(draw("text", { class: "number", x: x(point.at_m), y: y(point.alt_m) - 6 }, String(point.seq)));
    taken = x(point.at_m);
  }
  svg.append(draw("text", { x: LEFT, y: HEIGHT - 6 }, "0 m"), draw("text", { class: "y-label", x: width - RIGHT, y: HEIGHT - 6 }, length(far)));
  return svg;
}

const length = (metres) => (metres >= 2000 ? `${(metres / 1000).toFixed(1)} km` : `${Math.round(metres)} m`);
