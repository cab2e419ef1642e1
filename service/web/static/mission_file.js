// SPDX-License-Identifier: GPL-3.0-or-later
// A chosen mission file: checked by the Pi, drawn, its changes listed first, then written.
import { post, postWithToken } from "./daemon.js";
import { byId, make } from "./dom.js";
import { MapView } from "./map_view.js";
import { comparison } from "./mission_tables.js";
import { writeForm } from "./write_form.js";

const result = byId("checked"), chooser = byId("file");
let preview = null; // { map, items, path } of the file that is shown
let latest = 0; // the check of an earlier file is ignored once a later one was chosen

chooser.addEventListener("change", () => chooser.files.length && check(chooser.files[0]));
chooser.addEventListener("click", () => { chooser.value = ""; }); // the same file again, after an edit

// The craft moves on the preview's map, too.
export function followFile({ position, attitude }) {
  if (preview !== null) preview.map.show({ items: preview.items, path: preview.path, flown: null, position, attitude, trail: [] });
}

async function check(file) {
  const turn = ++latest;
  preview = null;
  show(make("p", { role: "status" }, `Checking ${file.name} …`));
  const contents = await checked(file);
  if (turn !== latest) return;
  show(...contents);
  result.focus({ preventScroll: true });
}

// The result takes the place of the held mission, until it is closed.
function show(...contents) {
  result.replaceChildren(...contents);
  document.dispatchEvent(new Event("filechecked"));
}

function close() {
  latest += 1;
  preview = null;
  show();
}

async function checked(file) {
  const closing = make("button", { type: "button", onclick: close }, "Close");
  try {
    const body = await file.arrayBuffer();
    const query = `name=${encodeURIComponent(file.name)}`;
    const list = await post(`/api/check?${query}`, body);
    const container = make("div", { id: "file-map", class: "map" });
    preview = { map: new MapView(container), items: list.items, path: list.path };
    const isRejected = list.verdict === "REJECTED";
    const verdict = make("p", { class: isRejected ? "bad" : "good" }, verdictText(file.name, list));
    const write = isRejected ? [] : [writeForm("Write this mission", () => postWithToken(`/api/write?${query}`, body))];
    const buttons = make("div", { class: "row" }, ...write, closing);
    return [verdict, buttons, make("div", { class: "side-by-side" }, container, make("div", {}, ...comparison(list)))];
  } catch (error) {
    return [make("p", { class: "bad" }, error.message), closing];
  }
}

function verdictText(name, { verdict, rows, flight, assumed }) {
  const count = (kind) => rows.filter((row) => row.kind === kind).length;
  if (verdict === "REJECTED") return `${name} would be rejected: see the marked item.`;
  const changes = [["changed", count("changed")], ["dropped", count("dropped")]].filter(([, number]) => number).map(([kind, number]) => `${number} ${kind}`);
  return `${name}: ${rows.length} items, ${changes.join(", ") || "no changes"}. The flight: ${flight || "none"}.${assumed && ` Assumed: ${assumed}.`}`;
}
