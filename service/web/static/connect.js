// SPDX-License-Identifier: GPL-3.0-or-later
// The connection data for a ground station, and the page's address for another phone.
import { ask } from "./daemon.js";
import { byId, make } from "./dom.js";

const PAUSE_MS = 30000; // addresses change when a network comes up
let due = 0, shown = "";

export async function showConnect() {
  if (performance.now() < due) return;
  due = performance.now() + PAUSE_MS;
  const help = await ask("/api/connect");
  const text = JSON.stringify(help);
  if (text === shown) return;
  shown = text;
  byId("connect").replaceChildren(...stations(help), ...page(help));
}

function stations({ stations: links, called }) {
  const lines = links.map(({ connection, hosts, port }) => make("li", {}, make("b", {}, connection), `: host ${hosts.join(" or ")}, port ${port}`));
  const others = called.map((address) => make("li", {}, `The Pi itself calls ${address}`));
  const none = lines.length + others.length ? [] : [make("li", {}, "No link is configured.")];
  return [make("p", {}, "In Mission Planner choose the connection at the top right:"), make("ul", {}, ...lines, ...others, ...none)];
}

function page({ pages }) {
  if (!pages.length) return [make("p", {}, "Only this machine can open this page. To open it to the network, set listen in the [web] table.")];
  return [make("p", {}, `This page: ${pages.join(" or ")}`), make("img", { src: `connect.svg?${encodeURIComponent(pages[0])}`, class: "qr", width: 164, height: 164, alt: `QR code of ${pages[0]}` })];
}
