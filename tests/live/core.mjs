// Runs machines in node by the page's own host of the core: a JSON list on stdin, one on stdout of
// {state, knots (rows of ten numbers), events, books}.
import { readFileSync } from "node:fs";

import { core } from "./run.mjs";

// JSON has no infinity.
const revive = (_, value) => (["Infinity", "-Infinity"].includes(value) ? Number(value) : value);
const answers = JSON.parse(readFileSync(0, "utf8"), revive).map((machine) => {
  core.begin(machine);
  const knots = [], events = [];
  let state = "running";
  while (state === "running") {
    state = core.proceed(50);
    const taken = core.take();
    knots.push(...taken.knots);
    events.push(...taken.events);
  }
  return { state, knots, events, books: core.books() };
});
process.stdout.write(JSON.stringify(answers));
