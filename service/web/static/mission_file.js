// SPDX-License-Identifier: GPL-3.0-or-later
// A dropped or chosen mission file: checked by the Pi, drawn, its changes listed first, then written.
import { post } from "./daemon.js";
import { byId, make } from "./dom.js";
import { MapView } from "./map_view.js";
import { comparison } from "./mission_detail.js";
import { showProfile } from "./profile.js";
import { writeForm } from "./write_form.js";

const MOST_BYTES = 256 * 1024;
const result = byId("checked"), drop = byId("drop"), chooser = byId("file");
let preview = null; // { map, items } of the file that is shown
let latest = 0; // the check of an earlier file is ignored once a later one was chosen

chooser.addEventListener("change", () => chooser.files.length && check(chooser.files[0]));
chooser.addEventListener("click", () => { chooser.value = ""; }); // the same file again, after an edit
for (const name of ["dragenter", "dragover"]) document.addEventListener(name, (event) => over(event, true));
document.addEventListener("dragleave", (event) => { if (event.relatedTarget === null) over(event, false); });
document.addEventListener("drop", (event) => {
  over(event, false);
  if (event.dataTransfer.files.length) check(event.dataTransfer.files[0]);
});

function over(event, isOver) {
  if (![...event.dataTransfer.types].includes("Files")) return;
  event.preventDefault(); // otherwise the browser leaves the page and opens the file
  drop.classList.toggle("over", isOver);
}

// The craft moves on the preview's map, too.
export function followFile({ position, attitude }) {
  if (preview !== null) preview.map.show({ items: preview.items, flown: null, position, attitude, trail: [] });
}

async function check(file) {
  const turn = ++latest;
  preview = null;
  result.replaceChildren(make("p", { role: "status" }, `Checking ${file.name} …`));
  result.scrollIntoView({ block: "nearest" });
  const contents = await checked(file);
  if (turn !== latest) return;
  result.replaceChildren(...contents);
  result.focus({ preventScroll: true });
  if (preview !== null) showProfile(byId("file-profile"), preview.items);
}

async function checked(file) {
  try {
    if (file.size > MOST_BYTES) throw new Error(`${file.name} is larger than ${MOST_BYTES / 1024} KiB, so it is not a mission that fits a flight controller.`);
    const body = await file.arrayBuffer();
    const query = `name=${encodeURIComponent(file.name)}`;
    const list = await post(`/api/check?${query}`, "", body);
    const container = make("div", { id: "file-map", class: "map" });
    preview = { map: new MapView(container), items: list.items };
    const isRejected = list.verdict === "REJECTED";
    const verdict = make("p", { class: isRejected ? "bad" : "good" }, verdictText(file.name, list));
    const write = isRejected ? [] : [writeForm(`Write ${file.name} to the flight controller`, (token) => post(`/api/write?${query}`, token, body))];
    return [verdict, ...comparison(list), container, make("h3", {}, "Altitude profile"), make("div", { id: "file-profile" }), ...write];
  } catch (error) {
    return [make("p", { class: "bad" }, error.message)];
  }
}

function verdictText(name, { verdict, rows, flight }) {
  const count = (kind) => rows.filter((row) => row.kind === kind).length;
  if (verdict === "REJECTED") return `${name} would be rejected: see the marked item.`;
  const changes = [["changed", count("changed")], ["dropped", count("dropped")]].filter(([, number]) => number).map(([kind, number]) => `${number} ${kind}`);
  return `${name}: ${rows.length} items, ${changes.join(", ") || "no changes"}. The flight: ${flight || "none"}.`;
}
