// Runs machines in node by the page's own host of the core: a JSON list on stdin, one on stdout of
// {state, knots (rows of ten numbers), events, books}.
import { readFileSync } from "node:fs";

<<<<<<< HEAD
const { startCore } = await import(pathToFileURL(`${process.argv[2]}/core.js`));

const home = new URL("../../src/chutelab/core/", import.meta.url);
const layout = JSON.parse(readFileSync(new URL("layout.json", home), "utf8"));
const core = await startCore(await WebAssembly.compile(readFileSync(new URL("core.wasm", home))), layout);
=======
import { core } from "./run.mjs";
>>>>>>> tspage

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
