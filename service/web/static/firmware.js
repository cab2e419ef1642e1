// SPDX-License-Identifier: GPL-3.0-or-later
// A firmware image: chosen, then flashed by the Pi. The form stays, so that an interrupted flash is resumed with one press.
import { post } from "./daemon.js";
import { byId, make } from "./dom.js";
import { writeForm } from "./write_form.js";

const chooser = byId("image"), place = byId("firmware");

chooser.addEventListener("click", () => { chooser.value = ""; }); // the same file again, after another build
chooser.addEventListener("change", () => chooser.files.length && offer(chooser.files[0]));

function offer(file) {
  const battery = make("input", { type: "checkbox" });
  place.replaceChildren(
    make("p", {}, "Propellers off. Settings and missions are kept, and the present flash is backed up on the Pi."),
    make("label", {}, battery, " A battery stays connected"),
    writeForm(`Flash ${file.name}`, (token) => post(`/api/firmware?name=${encodeURIComponent(file.name)}&battery=${battery.checked ? 1 : 0}`, token, file)));
}
