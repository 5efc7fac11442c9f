// What JavaScript says of scenes and transfers: `node bits.mjs MODULES < QUESTION`.
//
// Of each scene {toml, machine, prediction (where it runs)} or {toml, fault}, of parameters what
// `transfer` returns; of an edit [keys, values by path] the keys after it, as TOML, and what they
// have there.
//
// JSON has no Infinity and no NaN: they come as text.
import { readFileSync } from "node:fs";

import { load, recordingOf } from "./run.mjs";

const { build } = await load("machine.js");
const { Fault, resolve } = await load("scene.js");
const { toToml, valueAt, withValues } = await load("keys.js");
const { predict } = await load("prediction.js");
const { transfer } = await load("transfer.js");

const { lab, scenes = [], runs, transfers = [], edits = [] } = JSON.parse(readFileSync(0, "utf8"));
const told = scenes.map((given) => {
  const toml = toToml(given);
  try {
    const scene = resolve(given, lab);
    const machine = build(scene);
    return { machine, prediction: runs ? predict(scene, recordingOf(machine, 4)) : null, toml };
  } catch (fault) {
    if (!(fault instanceof Fault)) throw fault;
    return { fault: { key: fault.key, text: fault.text, words: fault.words }, toml };
  }
});
const bare = (_, value) => {
  return typeof value === "number" && !Number.isFinite(value) ? String(value) : value;
};
const edited = edits.map(([given, values]) => {
  // What JSON cannot say takes a key away.
  const changes = Object.entries(values).map(([key, value]) => [key, value ?? undefined]);
  const after = withValues(given, Object.fromEntries(changes));
  const there = Object.keys(values).map((key) => valueAt(after, key) ?? null);
  return { toml: toToml(after), there, kept: toToml(given) };
});
const answers = { scenes: told, transfers: transfers.map(transfer), edits: edited };
process.stdout.write(JSON.stringify(answers, bare));
