// The page's modules, from the folder that a script is told, and whole runs of machines.
import { readFileSync } from "node:fs";
import { pathToFileURL } from "node:url";

const modules = pathToFileURL(`${process.argv[2]}/`);
export const load = (name) => import(new URL(name, modules));

const { startCore } = await load("core.js");
const { startPlan } = await load("plan.js");
const { Recording } = await load("recording.js");
const { build } = await load("machine.js");
const { resolve } = await load("scene.js");

const home = new URL("../../src/chutelab/core/", import.meta.url);
const layout = JSON.parse(readFileSync(new URL("layout.json", home), "utf8"));
const module = await WebAssembly.compile(readFileSync(new URL("page.wasm", home)));
export const core = await startCore(module, layout);
await startPlan(module, layout);

/** The machine of a scene, by its keys. */
export const machineOf = (given, lab) => build(resolve(given, lab));

/** The recording of a run, up to so many events, or whole. */
export function recordingOf(machine, many = Infinity) {
  const recording = new Recording(machine);
  core.begin(machine);
  for (let state = "running"; state === "running" && recording.events.length < many;) {
    state = core.proceed(50);
    const books = state === "running" ? null : core.books();
    recording.add({
      ...core.take(), tips: new Float64Array(), now: core.get("t"), state, books,
      contacts: core.get("impact_count"), steps: core.get("step_count"),
    });
  }
  return recording;
}
