// SPDX-License-Identifier: GPL-3.0-or-later
// Node's loader for INAV Configurator's modules, which its bundler loads without suffixes. Its windows and all packages
// are replaced: only the code that speaks MSP is run.
const PAGES = new Set(["gui", "localization", "vtx", "store"]);

function nameOf(specifier) {
  return specifier.split("/").pop().replace(/\.js$/, "");
}

export async function resolve(specifier, context, next) {
  const isOurs = specifier.startsWith("node:") || specifier.startsWith("file:");
  const isRelative = specifier.startsWith(".") || specifier.startsWith("/");
  if (isOurs) return next(specifier, context);
  if (!isRelative || PAGES.has(nameOf(specifier))) {
    return { url: `replaced:${nameOf(specifier)}`, shortCircuit: true };
  }
  return next(specifier.endsWith(".js") || specifier.endsWith(".mjs") ? specifier : `${specifier}.js`, context);
}

const NAMES = ["GUI", "getLength", "LineString", "fromLonLat"];
const REPLACEMENT = `
const anything = new Proxy(function () {}, {
  get: (_, name) => (name === Symbol.toPrimitive ? () => 0 : anything),
  apply: () => true,
  construct: () => anything,
});
export default anything;
${NAMES.map((name) => `export const ${name} = anything;`).join("\n")}
`;

const STORE = "export default { get: (name, otherwise) => otherwise, set() {}, delete() {} };";

export async function load(url, context, next) {
  if (url === "replaced:store") return { format: "module", source: STORE, shortCircuit: true };
  if (url.startsWith("replaced:")) return { format: "module", source: REPLACEMENT, shortCircuit: true };
  return next(url, { ...context, format: "module" });
}
