// What JavaScript says of scenes: `node bits.mjs ASSETS < {lab, scenes, transfers} > {scenes, transfers}`.
//
// Of each scene {toml, machine, prediction} or {toml, fault}; of parameters what `transfer` returns.
// JSON has no Infinity and no NaN: they come as text.
import { readFileSync } from "node:fs";
import { join } from "node:path";
import { pathToFileURL } from "node:url";

const load = (name) => import(pathToFileURL(join(process.argv[2], name)).href);
const { build } = await load("machine.js");
const { Fault, resolve } = await load("scene.js");
const { toToml } = await load("keys.js");
const { predict } = await load("prediction.js");
const { transfer } = await load("transfer.js");

const { lab, scenes = [], transfers = [] } = JSON.parse(readFileSync(0, "utf8"));
const told = scenes.map((given) => {
  const toml = toToml(given);
  try {
    const scene = resolve(given, lab);
    return { machine: build(scene), prediction: predict(scene), toml };
  } catch (fault) {
    if (!(fault instanceof Fault)) throw fault;
    return { fault: { key: fault.key, text: fault.text, words: fault.words }, toml };
  }
});
const bare = (_, value) => {
  return typeof value === "number" && !Number.isFinite(value) ? String(value) : value;
};
process.stdout.write(JSON.stringify({ scenes: told, transfers: transfers.map(transfer) }, bare));
