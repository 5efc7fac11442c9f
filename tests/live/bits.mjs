// Builds scenes in node: `node bits.mjs ASSETS < {lab, scenes} > [{machine, toml} or {fault}]`.
//
// JSON has no Infinity and no NaN: they come as text.
import { readFileSync } from "node:fs";
import { join } from "node:path";
import { pathToFileURL } from "node:url";

const load = (name) => import(pathToFileURL(join(process.argv[2], name)).href);
const { build } = await load("machine.js");
const { Fault, resolve } = await load("scene.js");
const { toToml } = await load("keys.js");

const { lab, scenes } = JSON.parse(readFileSync(0, "utf8"));
const found = scenes.map((given) => {
  const toml = toToml(given);
  try {
    return { machine: build(resolve(given, lab)), toml };
  } catch (fault) {
    if (!(fault instanceof Fault)) throw fault;
    return { fault: { key: fault.key, text: fault.text, words: fault.words }, toml };
  }
});
const bare = (_, value) => {
  return typeof value === "number" && !Number.isFinite(value) ? String(value) : value;
};
process.stdout.write(JSON.stringify(found, bare));
