// The engine's thread: it runs machines, so that the picture never waits for them.
//
// In:  {type: "load", module, layout}: the compiled core.
//      {type: "run", id, machine, until, pushes}: ends the run before and begins a new one, with
//      these pushes made again.
//      {type: "until", id, until}: the run may go on to a later time, s.
//      {type: "push", id, push}: pushes something.
//      {type: "judge", id, run}: asks for breaches of laws.
// Out: {type: "chunk", id, state, now, …}: new results of the run. `state` is "running", "done",
//      "stalled" or "failed". `triggered` are the times of what waits for a touch, s; `totals` the
//      sums over all particles at each step, for machines with joints; `pushed` the work of all
//      pushes and `given` that of all surfaces, J; `gained` the energy by which solves have broken
//      their law so far, J; `regained` the greatest fall of losses, J; `risen` the most energy
//      that the ledger could not explain at a step, J; `hastened` the greatest acceleration by a
//      push, m/s²; `unsolved` the largest overlap that a solve left, in radii. `books` and
//      `reasons` come at the end.
//      {type: "laws", id, breaches}: the answer to "judge".
//      {type: "broken"}: the core could not be loaded.

import { judge } from "./breaches.ts";
import { startCore, type Core, type Event, type Layout } from "./core.ts";

/** Time between two looks at the messages, and until the first look in a run, ms. */
const TURN = 10, FIRST = 2;

/** Most steps of the core between two looks at the clock. */
const MOST_STEPS = 256;

let core: Core;

let job: { id: number, until: number, steps: number, turn: number } | null = null;

/** A force on a particle, N, or a torque on what hangs on a hinge, N m. */
export type Given = { disk: number, force: [number, number] } | { surface: number, torque: number };
/** Acts from `at` to `due`, s */
export type Push = Given & { at: number, due: number };
type State = "running" | "done" | "stalled" | "failed";

/** Results that have not been sent yet. */
let written = { knots: [] as Float64Array[], events: [] as Event[], swings: [] as number[],
  totals: [] as Float64Array[] };

let scheduled = false;
const channel = new MessageChannel();
channel.port1.onmessage = () => {
  scheduled = false;
  work();
};

function schedule() {
  if (scheduled || !job) return;
  scheduled = true;
  channel.port2.postMessage(null);
}

/** Returns whether the run has reached the time up to which it may go. Disks without contacts
 * between them are run one after another, each to its end. */
const isAhead = (task: { until: number }) => core.machine?.interact && core.get("t") >= task.until;

function work() {
  if (!job || isAhead(job)) return;
  const began = performance.now();
  let state: State = "running";
  try {
    while (state === "running" && !isAhead(job)) {
      const before = performance.now();
      state = go(job.steps);
      const now = performance.now();
      const quick = now - before < 1;
      job.steps = quick ? Math.min(2 * job.steps, MOST_STEPS) : Math.max(1, job.steps >> 1);
      if (now - began > job.turn) break;
    }
  } catch {
    state = "failed";
  }
  tell(state);
}

function go(steps: number): State {
  const state = core.proceed(steps), { knots, events, swings, totals } = core.take();
  written.knots.push(knots);
  written.events.push(...events);
  written.swings.push(...swings);
  written.totals.push(totals);
  return state;
}

/** Run to the first step that ends at a time, s, or later. */
function goTo(t: number): State {
  let state: State = "running";
  core.set("pause", t);
  while (state === "running" && core.get("t") < t) state = go(MOST_STEPS);
  core.set("pause", 0);
  return state;
}

/** Push something, as Python's `chutelab.start` does. A rounding error of `due` must not cost a
 * step. */
function push(one: Push): State {
  const give = (share: number) => ("surface" in one
    ? core.exports.turn_hinge(one.surface, share * one.torque)
    : core.exports.push_disk(one.disk, ...one.force.map((force) => share * force)));
  give(1);
  const state = goTo(one.due * (1 - 1e-12));
  give(0);
  return state;
}

/** Send the results. */
function tell(state: State) {
  if (!job) return;
  const over = state !== "running", { events, swings } = written;
  const [knots, totals] = [joined(written.knots), joined(written.totals)];
  written = { knots: [], events: [], swings: [], totals: [] };
  const tips = over || !core.machine?.interact ? new Float64Array() : core.tips();
  postMessage({
    type: "chunk", id: job.id, knots, tips, events, swings, totals, now: core.get("t"), state,
    triggered: core.triggered(), pushed: core.get("push_work"),
    given: core.books().slice(0, -1).reduce((sum, [work]) => sum + work, 0),
    books: over ? core.books() : null, reasons: over ? core.reasons() : null,
    gained: core.get("gained"), regained: core.get("regained"), risen: core.get("risen"),
    hastened: core.get("hastened"), unsolved: core.get("unsolved_most"),
    contacts: core.get("impact_count"), steps: core.get("step_count"), loads: core.takeLoads(over),
  }, { transfer: [knots.buffer, tips.buffer] });
  job.turn = TURN;
  if (over) job = null;
  else schedule();
}

function joined(parts: Float64Array[]) {
  if (parts.length === 1) return parts[0];
  const all = new Float64Array(parts.reduce((size, part) => size + part.length, 0));
  let at = 0;
  for (const part of parts) {
    all.set(part, at);
    at += part.length;
  }
  return all;
}

let ready: Promise<void>;

async function load({ module, layout }: { module: WebAssembly.Module, layout: Layout }) {
  core = await startCore(module, layout);
}

addEventListener("message", async ({ data }) => {
  if (data.type === "load") {
    ready = load(data);
    ready.catch(() => postMessage({ type: "broken" }));
    return;
  }
  try {
    await ready;
  } catch {
    return;
  }
  if (data.type === "judge") {
    postMessage({ type: "laws", id: data.id, breaches: judge(core, data.run) });
  } else if (data.type === "run") {
    core.begin(data.machine);
    job = { id: data.id, until: data.until, steps: 1, turn: FIRST };
    for (const one of data.pushes as Push[]) {
      if (goTo(one.at) === "running") push(one);
    }
    work();
  } else if (data.type === "push" && job && data.id === job.id) {
    const state = push(data.push);
    job.until = core.get("t");
    tell(state);
  } else if (data.type === "until" && job && data.id === job.id) {
    job.until = data.until;
    schedule();
  }
});
