// SPDX-License-Identifier: GPL-3.0-or-later
// The stored missions: the latest upload, and all of them; each opens in place.
import { ask, postWithToken } from "./daemon.js";
import { byId, make, showEntries } from "./dom.js";
import { missionDetail, outcomeClass, when } from "./mission_tables.js";
import { writeForm } from "./write_form.js";

export async function showMissions(newest) {
  const { missions } = await ask("/api/missions");
  if (newest === null) {
    for (const id of ["missions", "upload"]) byId(id).replaceChildren(make("p", {}, "No mission has been received yet."));
    return;
  }
  byId("upload").replaceChildren(...missionDetail(await ask(`/api/missions/${newest.number}`)));
  showEntries(byId("missions"), missions, { name: "Mission", summary, contents });
}

const summary = ({ number, received_at: receivedAt, source, outcome, detail, item_count: items, finding_count: notes }) => [
  make("b", {}, String(number)), " ", make("span", { class: outcomeClass(outcome) }, outcome), ` ${when(receivedAt)}`,
  make("span", { class: "why" }, `${items} items, ${notes} notes, from ${source}. ${detail}`)];

const contents = async (number) => [
  writeForm(`Write mission ${number} again`, () => postWithToken(`/api/missions/${number}/restore`)),
  ...missionDetail(await ask(`/api/missions/${number}`))];
