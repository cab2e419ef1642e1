// SPDX-License-Identifier: GPL-3.0-or-later
// The telemetry logs: listed and downloaded with the token. A connection to the Pi is short, so a log comes in pieces.
import { ask, fetchBytes } from "./daemon.js";
import { byId, form, make, say } from "./dom.js";
import { currentToken, tokenField } from "./token.js";

const result = make("p", { class: "result", role: "status" });
const list = make("ul", { class: "logs" });

byId("logs").append(form({ class: "row" }, showLogs, tokenField(), make("button", {}, "List logs"), result), list);

async function showLogs() {
  list.replaceChildren();
  say(result, "", "Reading …");
  try {
    const { logs } = await ask("/api/logs", currentToken());
    list.replaceChildren(...logs.map(entry));
    say(result, "", logs.length ? `${logs.length} logs, times in UTC` : "There are no logs yet.");
  } catch (error) {
    say(result, "bad", error.message);
  }
}

function entry({ name, size }) {
  const progress = make("span", { role: "status" });
  const button = make("button", { type: "button", "aria-label": `Download ${name}`, onclick: async () => {
    button.disabled = true;
    try {
      await download(name, size, (done) => say(progress, "", `${Math.floor((100 * done) / Math.max(size, 1))} %`));
      say(progress, "good", "Downloaded");
    } catch (error) {
      say(progress, "bad", error.message);
    }
    button.disabled = false;
  } }, "Download");
  return make("li", {}, make("span", { class: "log-name" }, name), " ", make("span", { class: "soft" }, sizeText(size)), " ", button, " ", progress);
}

async function download(name, size, tellProgress) {
  const pieces = [];
  let done = 0;
  while (done < size) {
    const piece = await fetchBytes(`/api/logs/${encodeURIComponent(name)}?start=${done}`, currentToken());
    if (!piece.size) break;
    pieces.push(piece);
    done += piece.size;
    tellProgress(Math.min(done, size));
  }
  const url = URL.createObjectURL(new Blob(pieces));
  make("a", { href: url, download: name }).click();
  setTimeout(() => URL.revokeObjectURL(url), 60000);
}

const sizeText = (bytes) => (bytes < 1e6 ? `${Math.ceil(bytes / 1000)} kB` : `${(bytes / 1e6).toFixed(1)} MB`);
