// SPDX-License-Identifier: GPL-3.0-or-later
// An update from a file. A connection to the Pi is short, so the package is sent in pieces.
import { post } from "./daemon.js";
import { form, make, say } from "./dom.js";
import { action, askPi, pressed } from "./pi_request.js";
import { currentToken } from "./token.js";

const PIECE = 256 * 1024, MOST_BYTES = 128 * 1024 * 1024;
const LATER = "The bridge restarts during the installation, which takes some minutes. Then open this again to see the result.";

export function updatePanel({ version, previous, can_update: canUpdate }) {
  if (!canUpdate) return make("details", {}, make("summary", {}, "Update"), make("p", {}, `This is version ${version}. It was built without a key that updates could be checked by: install a package with apt in a terminal.`));
  const result = make("p", { class: "result", role: "status" });
  const bar = make("progress", { hidden: "", "aria-label": "Package sent" });
  const file = make("input", { type: "file", accept: ".deb" });
  const send = make("button", {}, "Install");
  const update = form({ class: "row" }, () => pressed(send, result, () => install(file.files[0], bar, result)),
    make("label", {}, "Package (.deb) ", file), send, bar, result);
  const back = action(`Back to version ${previous}`, result, () => askPi({ action: "downgrade" }).then(() => LATER));
  return make("details", {}, make("summary", {}, "Update"), make("p", {}, `This is version ${version}. A newer package from the releases is installed if its signature is right. If the new version does not run, this one is reinstalled.`), update, ...(previous ? [back] : []));
}

async function install(file, bar, result) {
  if (!file) throw new Error("Choose a package first.");
  if (file.size > MOST_BYTES) throw new Error(`${file.name} is larger than ${MOST_BYTES >> 20} MB, so it is not the package of naze-bridge.`);
  Object.assign(bar, { hidden: false, max: file.size, value: 0 });
  try {
    for (let start = 0; start < file.size; start += PIECE) {
      await post(`/api/pi/package?start=${start}`, currentToken(), file.slice(start, start + PIECE));
      bar.value = start + PIECE;
    }
    say(result, "", "Checking the package …");
    const { version } = await askPi({ action: "install" });
    return `Installing version ${version}. ${LATER}`;
  } finally {
    bar.hidden = true;
  }
}
