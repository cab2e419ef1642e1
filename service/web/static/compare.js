// SPDX-License-Identifier: GPL-3.0-or-later
// Two stored missions compared, as they were sent; the result appears below the form.
import { ask } from "./daemon.js";
import { byId, make } from "./dom.js";
import { pairKey, pairTable } from "./tables.js";

byId("compare-form").addEventListener("submit", async (event) => {
  event.preventDefault();
  const [first, second] = ["first", "second"].map((id) => byId(id).value.trim());
  byId("compared").replaceChildren(...(await compare(first, second)));
  byId("compared").focus({ preventScroll: true });
});

async function compare(first, second) {
  try {
    const { rows } = await ask(`/api/missions/${encodeURIComponent(first)}/difference/${encodeURIComponent(second)}`);
    const isEqual = rows.every((row) => row.kind === "same");
    return [make("h3", {}, `Mission ${first} and mission ${second}, as sent`), isEqual ? "No difference." : pairKey(rows),
      ...pairTable(rows, [`Mission ${first}`, `Mission ${second}`])];
  } catch (error) {
    return [make("p", { class: "bad" }, error.message)];
  }
}
