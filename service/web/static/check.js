// SPDX-License-Identifier: GPL-3.0-or-later
// Doctor's findings, each with its remedy as a button where the Pi can carry it out; the logs.
import { aftermath, askPi, askWithToken, fetchBytes, hasToken } from "./daemon.js";
import { action, byId, make, resultPlace, say } from "./dom.js";

const PAUSE_MS = 2000, MOST_LINES = 300;
const GRADES = { problem: ["bad", "Problem"], note: ["soft", "Note"], ok: ["good", "Fine"] };

const result = resultPlace(), findings = make("div", { id: "findings" });
byId("doctor").append(make("div", { class: "row" }, action("Check everything", result, examine, "primary"), result), findings);

// Problems first; what is fine is folded away.
async function examine() {
  const { checks } = await askPi({ action: "doctor" });
  const of = (wanted) => checks.filter(({ grade }) => grade === wanted).map(finding);
  const [problems, notes, fine] = Object.keys(GRADES).map(of);
  const rest = make("details", {}, make("summary", {}, `${fine.length} fine`), make("ul", { class: "findings" }, ...fine));
  findings.replaceChildren(make("ul", { class: "findings" }, ...problems, ...notes), rest);
  return problems.length ? [`${problems.length} ${problems.length === 1 ? "problem" : "problems"}.`, "bad"] : "No problems.";
}

function finding({ check, grade, found, remedy, fix }) {
  const [kind, word] = GRADES[grade];
  const parts = [make("b", { class: kind }, word), ` ${check}: ${found}`];
  if (remedy) parts.push(make("span", { class: "why" }, remedy));
  if (fix) {
    parts.push(action(`Fix it: ${fix}`, result, async () => {
      const text = aftermath(await askPi({ action: "fix", fix }));
      await examine();
      return text;
    }));
  }
  return make("li", {}, ...parts);
}

// Fills a block whenever it is opened.
const whenOpened = (id, fill) => byId(id).addEventListener("toggle", ({ target }) => { if (target.open) fill(); });

const log = byId("log"), lines = make("ol", { class: "log" }), logTrouble = resultPlace();
log.append(logTrouble, make("div", { class: "log-box", tabindex: 0, role: "region", "aria-label": "Log of the bridge" }, lines));
whenOpened("log-block", followLog);
let next = 0;

// The latest events first, while they are looked at.
async function followLog() {
  say(logTrouble, "", "");
  while (byId("log-block").open) {
    try {
      const { count, lines: latest } = await askWithToken(`/api/log?after=${next}`);
      if (count < next) lines.replaceChildren(); // restarted: it counts from 0
      next = count < next ? 0 : count;
      for (const { at_s: at, level, text } of latest) {
        const isBad = level === "error" || level === "warning";
        lines.prepend(make("li", { class: level }, make("time", {}, new Date(at * 1000).toTimeString().slice(0, 8)), make("span", {}, isBad ? make("b", { class: level === "error" ? "bad" : "" }, `${level[0].toUpperCase()}${level.slice(1)}: `) : "", text)));
      }
      while (lines.children.length > MOST_LINES) lines.lastElementChild.remove();
    } catch (error) {
      if (!hasToken() || error.status) return say(logTrouble, "bad", error.message);
      // Otherwise the bar at the top shows that the Pi does not answer.
    }
    await new Promise((resolve) => setTimeout(resolve, PAUSE_MS));
  }
}

// The telemetry logs. A connection to the Pi is short, so a log comes in pieces.
const logsResult = resultPlace(), logs = make("ul", { class: "logs" });
byId("logs").append(logsResult, logs);
whenOpened("logs-block", async () => {
  say(logsResult, "", "Reading …");
  try {
    const found = (await askWithToken("/api/logs")).logs;
    logs.replaceChildren(...found.map(telemetryLog));
    say(logsResult, "", found.length ? `${found.length} logs, times in UTC` : "There are no logs yet.");
  } catch (error) {
    say(logsResult, "bad", error.message);
  }
});

function telemetryLog({ name, size }) {
  const progress = resultPlace();
  const button = action("Download", progress, async () => {
    await download(name, size, (done) => say(progress, "", `${Math.floor((100 * done) / Math.max(size, 1))} %`));
    return "Downloaded";
  });
  button.setAttribute("aria-label", `Download ${name}`);
  return make("li", {}, name, " ", make("span", { class: "soft" }, size < 1e6 ? `${Math.ceil(size / 1000)} kB` : `${(size / 1e6).toFixed(1)} MB`), " ", button, " ", progress);
}

async function download(name, size, tellProgress) {
  const pieces = [];
  let done = 0;
  while (done < size) {
    const piece = await fetchBytes(`/api/logs/${encodeURIComponent(name)}?start=${done}`);
    if (!piece.size) break;
    pieces.push(piece);
    done += piece.size;
    tellProgress(Math.min(done, size));
  }
  const url = URL.createObjectURL(new Blob(pieces));
  make("a", { href: url, download: name }).click();
  setTimeout(() => URL.revokeObjectURL(url), 60000);
}
