// Runs scenes in node by the page's own host of the core: {lab, scenes} on stdin, on stdout a list
// of {state, knots (rows of ten numbers), events, swings (rows of seven), triggered, books, toml}.
import { readFileSync } from "node:fs";

import { core, load, machineOf } from "./run.mjs";

const { toToml } = await load("keys.js");

const { lab, scenes } = JSON.parse(readFileSync(0, "utf8"));
const answers = scenes.map((given) => {
  core.begin(machineOf(given, lab));
  const knots = [], events = [], swings = [];
  let state = "running";
  while (state === "running") {
    state = core.proceed(50);
    const taken = core.take();
    knots.push(...taken.knots);
    events.push(...taken.events);
    swings.push(...taken.swings);
  }
  const loads = [...core.takeLoads(true).rows];
  // JSON has no Infinity.
  const triggered = core.triggered().map(String);
  const books = core.books();
  return { state, knots, events, swings, triggered, loads, books, toml: toToml(given) };
});
process.stdout.write(JSON.stringify(answers));
