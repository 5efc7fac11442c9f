// The engine's own thread: runs machines, so that the picture never waits for them.
//
// In:  {type: "load", module, layout}, the core compiled; {type: "run", id, machine, until}
//      begins a run and ends the one before, with `pushes` done in it already; {type: "until", id,
//      until} lets it go on to a later time (s); {type: "push", id, push} pushes something.
// Out: {type: "chunk", id, knots, tips, events, swings, totals, triggered, now, state, books,
//      reasons, gained, unsolved, pushed, given}, where state is "running", "done", "stalled" or
//      "failed"; books and reasons come at the end; triggered are the times of what waited for a
//      touch, s; gained is the energy by which solves broke their law so far, J, and unsolved the
//      most overlap that one left, radii; pushed is the work of all pushes, J, and given that of
//      all surfaces; totals are what all particles of a machine with joints have at each step.
//      {type: "laws", id, breaches}, in answer to {type: "judge", id, run}.
//      {type: "broken"}, where the core cannot be loaded.

import { judge } from "./breaches.ts";
import { startCore, type Core, type Event, type Layout } from "./core.ts";

/** ms between two looks at the messages, and up to the first of a run. */
const TURN = 10, FIRST = 2;

/** Most steps of the core between two looks at the clock. */
const MOST_STEPS = 256;

let core: Core;

let job: { id: number, until: number, steps: number, turn: number } | null = null;

/** A force on a particle, N, or a torque on what hangs on a hinge, N m. */
export type Given = { disk: number, force: [number, number] } | { surface: number, torque: number };
/** From a time on to another, s */
export type Push = Given & { at: number, due: number };
type State = "running" | "done" | "stalled" | "failed";

/** What has been written, and not been told yet. */
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

/** Whether the run has reached the time it may go to. Without contacts between them disks run one
 * after the other, each to its end. */
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

/** Run on to a step that ends no earlier than a time, s. */
function goTo(t: number): State {
  let state: State = "running";
  core.set("pause", t);
  while (state === "running" && core.get("t") < t) state = go(MOST_STEPS);
  core.set("pause", 0);
  return state;
}

/** Push something, as Python's `chutelab.start` does: rounding of a sum of times is no step. */
function push(one: Push): State {
  const give = (share: number) => ("surface" in one
    ? core.exports.turn_hinge(one.surface, share * one.torque)
    : core.exports.push_disk(one.disk, ...one.force.map((force) => share * force)));
  give(1);
  const state = goTo(one.due * (1 - 1e-12));
  give(0);
  return state;
}

/** Hand on what has been written. */
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
    gained: core.get("gained"), unsolved: core.get("unsolved_most"),
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
