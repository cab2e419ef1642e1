// SPDX-License-Identifier: GPL-3.0-or-later
// The serial line over the last minutes: the round trip as a line, losses as red bars.
import { ask } from "./daemon.js";
import { byId, draw } from "./dom.js";

const WIDTH = 300, HEIGHT = 84, BASE = 64, TOP = 14, SAMPLES = 150, PAUSE_MS = 5000, LEAST_MS = 10, MOST_BAR_PX = 40;
let due = 0;

export async function showLinkPlot() {
  if (performance.now() < due) return;
  due = performance.now() + PAUSE_MS;
  byId("link-plot").replaceChildren(plot((await ask("/api/link")).samples));
}

function plot(samples) {
  const trips = samples.map((sample) => sample.round_trip_ms).filter((trip) => trip !== null);
  const top = Math.max(...trips, LEAST_MS), bad = (sample) => sample.lost + sample.damaged;
  const x = (index) => Math.round((WIDTH * (SAMPLES - samples.length + index)) / (SAMPLES - 1) * 10) / 10;
  const y = (trip) => Math.round((BASE - ((BASE - TOP) * trip) / top) * 10) / 10;
  const losses = samples.reduce((sum, sample) => sum + bad(sample), 0);
  const words = `${trips.length ? `round trip up to ${Math.max(...trips)} ms` : "no round trips"}; ${losses} lost or damaged`;
  const svg = draw("svg", { viewBox: `0 0 ${WIDTH} ${HEIGHT}`, role: "img", class: "chart", "aria-label": `Serial line, last 5 minutes: ${words}` });
  svg.append(draw("path", { class: "grid", d: `M0 ${TOP}H${WIDTH}M0 ${BASE}H${WIDTH}` }));
  samples.forEach((sample, index) => {
    if (bad(sample)) svg.append(draw("path", { class: "loss", d: `M${x(index)} ${BASE}v${-Math.min(4 + 4 * bad(sample), MOST_BAR_PX)}` }, draw("title", {}, `${bad(sample)} lost or damaged`)));
  });
  let path = "", isDrawing = false;
  samples.forEach(({ round_trip_ms: trip }, index) => {
    if (trip !== null) path += `${isDrawing ? "L" : "M"}${x(index)} ${y(trip)}`;
    isDrawing = trip !== null;
  });
  svg.append(draw("path", { class: "trip", d: path }), draw("text", { x: 2, y: TOP - 3 }, `${Math.round(top)} ms`), draw("text", { x: 2, y: HEIGHT - 5 }, "−5 min"),
    draw("text", { class: "middle", x: WIDTH / 2, y: HEIGHT - 5 }, `${losses} lost or damaged`), draw("text", { class: "y-label", x: WIDTH - 2, y: HEIGHT - 5 }, "now"));
  return svg;
}
