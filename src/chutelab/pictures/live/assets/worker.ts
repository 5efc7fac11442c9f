// The engine's own thread: runs machines, so that the picture never waits for them.
//
// In:  {type: "load", module, layout}, the core compiled; {type: "run", id, machine, until}
//      begins a run and ends the one before; {type: "until", id, until} lets it go on to a later
//      time (s).
// Out: {type: "chunk", id, knots, tips, events, swings, triggered, now, state, books, reasons,
//      gained, unsolved}, where state is "running", "done", "stalled" or "failed"; books and
//      reasons come at the end; triggered are the times of what waited for a touch, s; gained is
//      the energy by which solves broke their law so far, J, and unsolved the most overlap that
//      one left, radii.
//      {type: "laws", id, breaches}, in answer to {type: "judge", id, run}.
//      {type: "broken"}, where the core cannot be loaded.

import { judge } from "./breaches.ts";
import { startCore, type Core, type Layout } from "./core.ts";

/** ms between two looks at the messages. */
const TURN = 10;

/** Most steps of the core between two looks at the clock. */
const MOST_STEPS = 256;

let core: Core;

let job: { id: number, until: number, steps: number } | null = null;

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
  const knots = [];
  const events = [], swings: number[] = [];
  let state: "running" | "done" | "stalled" | "failed" = "running";
  try {
    while (state === "running" && !isAhead(job)) {
      const before = performance.now();
      state = core.proceed(job.steps);
      const taken = core.take();
      knots.push(taken.knots);
      events.push(...taken.events);
      swings.push(...taken.swings);
      const now = performance.now();
      const quick = now - before < 1;
      job.steps = quick ? Math.min(2 * job.steps, MOST_STEPS) : Math.max(1, job.steps >> 1);
      if (now - began > TURN) break;
    }
  } catch {
    state = "failed";
  }
  const over = state !== "running";
  const all = joined(knots);
  const tips = over || !core.machine?.interact ? new Float64Array() : core.tips();
  postMessage({
    type: "chunk", id: job.id, knots: all, tips, events, swings, now: core.get("t"), state,
    triggered: core.triggered(),
    books: over ? core.books() : null, reasons: over ? core.reasons() : null,
    gained: core.get("gained"), unsolved: core.get("unsolved_most"),
    contacts: core.get("impact_count"), steps: core.get("step_count"), loads: core.takeLoads(over),
  }, { transfer: [all.buffer, tips.buffer] });
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
    job = { id: data.id, until: data.until, steps: 1 };
    work();
  } else if (data.type === "until" && job && data.id === job.id) {
    job.until = data.until;
    schedule();
  }
});
