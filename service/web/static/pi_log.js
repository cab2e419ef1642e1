// SPDX-License-Identifier: GPL-3.0-or-later
// The daemon's own log, the latest lines, while its panel is open.
import { ask } from "./daemon.js";
import { make } from "./dom.js";
import { currentToken } from "./token.js";

const PAUSE_MS = 2000, MOST_LINES = 300;

export function logPanel() {
  const lines = make("ol");
  const box = make("div", { class: "scrolls log", tabindex: 0, role: "region", "aria-label": "Log of the bridge" }, lines);
  let next = 0;
  const panel = make("details", { ontoggle: () => panel.open && follow() }, make("summary", {}, "Log"), make("p", {}, "The latest events first; times in UTC."), box);

  async function follow() {
    while (panel.open && panel.isConnected) {
      try {
        const { count, lines: latest } = await ask(`/api/log?after=${next}`, currentToken());
        if (count < next) lines.replaceChildren(); // restarted: it counts from 0
        next = count < next ? 0 : count;
        for (const line of latest) lines.prepend(make("li", { class: ["error", "warning"].includes(line.level) ? "bad" : "" }, `${line.at} ${line.level} ${line.text}`));
        while (lines.children.length > MOST_LINES) lines.lastElementChild.remove();
      } catch {
        // The bar at the top shows that the Pi does not answer.
      }
      await new Promise((resolve) => setTimeout(resolve, PAUSE_MS));
    }
  }
  return panel;
}
