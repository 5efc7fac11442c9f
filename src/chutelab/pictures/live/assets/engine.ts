// The picture's side of the worker: requests runs, and passes on results of the latest.

import type { Breach, Run } from "./breaches.ts";
import type { Event } from "./core.ts";
import type { Machine } from "./machine.ts";
import type { Push } from "./worker.ts";

type Chunk = { type: "chunk", id: number, knots: Float64Array, tips: Float64Array,
  events: Event[], swings: number[], totals: Float64Array, triggered: number[], pushed: number,
  given: number, now: number,
  state: string, books: number[][] | null, reasons: number[] | null, gained: number,
  regained: number, risen: number, hastened: number, unsolved: number, contacts: number,
  steps: number,
  loads: { from: number, rows: Float64Array } };

class Engine {
  id = 0;
  until = 0;
  onChunk: (chunk: Chunk) => void = () => {};
  onLaws: (breaches: Breach[]) => void = () => {};

  /** @param module the core */
  constructor(readonly worker: Worker, module: WebAssembly.Module, layout: object) {
    worker.onmessage = ({ data }) => {
      if (data.type === "broken") this.fail();
      if (data.type === "chunk" && data.id === this.id) this.onChunk(data);
      if (data.type === "laws" && data.id === this.id) this.onLaws(data.breaches);
    };
    worker.onerror = () => this.fail();
    worker.postMessage({ type: "load", module, layout });
  }

  /** Whether the thread did not start, or broke down, so that no results come. */
  broken = false;

  onFailure = () => {};

  fail() {
    this.broken = true;
    this.onFailure();
  }

  /** Ignore further results of the latest run. */
  stop() {
    this.id += 1;
    this.onChunk = () => {};
  }

  /** Begin a run, and end the one before.
   * @param until s, end of a run whose particles meet
   * @param pushes so far */
  run(machine: Machine, until: number, onChunk: (chunk: Chunk) => void, pushes: Push[] = []) {
    this.id += 1;
    this.until = until;
    this.onChunk = onChunk;
    this.worker.postMessage({ type: "run", id: this.id, machine, until, pushes });
  }

  /** Have the latest run judged by the laws of every run. */
  judge(run: Run, onLaws: (breaches: Breach[]) => void) {
    this.onLaws = onLaws;
    this.worker.postMessage({ type: "judge", id: this.id, run });
  }

  /** Go on with the run by hand. */
  push(push: Push) {
    this.until = push.due;
    this.worker.postMessage({ type: "push", id: this.id, push });
  }

  /** Let the run go on to a later time. */
  allow(until: number) {
    if (until <= this.until) return;
    this.until = until;
    this.worker.postMessage({ type: "until", id: this.id, until });
  }
}

export { Engine };
