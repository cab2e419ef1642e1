// SPDX-License-Identifier: GPL-3.0-or-later
// The Pi itself: opened with the token, because the answers come from its root helper.
import { byId, form, make, say } from "./dom.js";
import { answersPanel } from "./pi_answers.js";
import { doctorPanel } from "./pi_doctor.js";
import { logPanel } from "./pi_log.js";
import { action, aftermath, askPi, pressed } from "./pi_request.js";
import { settingsPanel } from "./pi_settings.js";
import { updatePanel } from "./pi_update.js";
import { tokenField } from "./token.js";

const result = make("p", { class: "result", role: "status" });
const button = make("button", {}, "Open");
const panels = make("div", { class: "panels" });

byId("pi").append(form({ class: "row" }, open, tokenField(), button, result), panels);

async function open() {
  await pressed(button, result, async () => {
    const pi = await askPi({ action: "overview" });
    panels.replaceChildren(summary(pi), answersPanel(pi, open), doctorPanel(), settingsPanel(pi, open), logPanel(), updatePanel(pi), last(pi));
    return "";
  });
}

function summary(pi) {
  const hotspot = pi.hotspot === null ? "no hotspot" : `hotspot ${pi.hotspot} ${pi.hotspot_is_open ? "open" : "closed"}`;
  const key = pi.has_key ? "a key is required for changes" : "no key: anyone on the network can change missions";
  const update = pi.update ? [make("p", {}, `Last update: ${pi.update}`)] : [];
  return make("div", {}, make("p", {}, [pi.model ?? "Not a known Raspberry Pi", pi.name, hotspot, key].filter(Boolean).join(", ")), ...update);
}

// The buttons that interrupt something.
function last({ hotspot, hotspot_is_open: isOpen }) {
  const said = make("p", { class: "result", role: "status" });
  const act = (text, fix, note) => action(text, said, async () => aftermath(await askPi({ action: "fix", fix })) + note);
  const note = isOpen ? " This phone must join the Pi's other network." : " Join the hotspot within 3 minutes, or the Pi returns to this network.";
  const hotspots = hotspot === null ? [] : [act(isOpen ? "Close the hotspot" : "Open the hotspot", isOpen ? "close the hotspot" : "open the hotspot", note)];
  return make("div", { class: "row" }, ...hotspots, act("Restart the bridge", "restart the bridge", " The page returns in a few seconds."), said);
}

