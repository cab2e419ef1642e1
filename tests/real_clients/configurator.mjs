// SPDX-License-Identifier: GPL-3.0-or-later
// INAV Configurator's own MSP code against a shared port: node configurator.mjs SOURCES HOST:PORT SETTING VALUE.
// Reads the mission, writes it back, reads it again, changes a setting and saves. Prints a JSON object.
import { register } from "node:module";
import { createConnection } from "node:net";
import { pathToFileURL } from "node:url";

register("./configurator_hooks.mjs", import.meta.url);
const [sources, address, setting, value] = process.argv.slice(2);
globalThis.$ = () => new Proxy({}, { get: () => () => undefined });
globalThis.window = globalThis;
console.log = console.info = (...words) => console.error(...words);

const load = async (name) => import(pathToFileURL(`${sources}/js/${name}.js`));
const { default: CONFIGURATOR } = await load("data_storage");
const { default: MSP } = await load("msp");
const { default: FC } = await load("fc");
const { default: codes } = await load("msp/MSPCodes");
const { default: mspHelper } = await load("msp/MSPHelper");

const [host, port] = address.split(":");
const socket = createConnection({ host, port: Number(port) });
await new Promise((resolve, reject) => socket.on("connect", resolve).on("error", reject));
CONFIGURATOR.connection = {
  getTimeout: () => 1000,
  send: (data, sent) => socket.write(Buffer.from(data), () => sent({ bytesSent: data.byteLength })),
};
FC.resetState();
MSP.setProcessData(mspHelper.processData);
MSP.init();
socket.on("data", (data) => MSP.read({ data }));

const called = (method, ...values) => new Promise((done) => method(...values, done));
// Some of its bytes are negative until it sends them.
const bytesOf = (each) => FC.MISSION_PLANNER.extractBuffer(each.getNumber()).map((byte) => byte & 255);
const waypoints = () => FC.MISSION_PLANNER.get().map(bytesOf);

for (const code of [codes.MSP_API_VERSION, codes.MSP_FC_VARIANT, codes.MSP_FC_VERSION, codes.MSP_BOARD_INFO, codes.MSPV2_INAV_STATUS]) {
  await MSP.promise(code);
}
await called(mspHelper.loadWaypoints);
const read = waypoints();
await called(mspHelper.saveWaypoints);
await MSP.promise(codes.MSP_WP_MISSION_SAVE, [0]);
await called(mspHelper.loadWaypoints);
const again = waypoints();
const before = (await mspHelper.getSetting(setting)).value;
await new Promise((done) => mspHelper.setSetting(setting, Number(value), done));
await MSP.promise(codes.MSP_EEPROM_WRITE);
const after = (await mspHelper.getSetting(setting)).value;
const { flightControllerIdentifier: identifier, flightControllerVersion: version } = FC.CONFIG;
process.stdout.write(JSON.stringify({ identifier, version, read, again, before, after }));
process.exit(0);
