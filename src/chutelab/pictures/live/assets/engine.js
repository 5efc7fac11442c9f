// The picture's side of the worker: asks for runs, and hands on what comes back of the latest.

/**
 * @typedef {import("./machine.js").Machine} Machine
 * @typedef {import("./core.js").Event} Event
 * @typedef {{type: "chunk", id: number, knots: Float64Array, tips: Float64Array,
 *   events: Event[], now: number, state: string, books: number[][] | null,
 *   reasons: number[] | null, gained: number}} Chunk
 */

class Engine {
  /** @param {Worker} worker @param {ArrayBuffer} wasm @param {object} layout */
  constructor(worker, wasm, layout) {
    this.worker = worker;
    this.id = 0;
    this.until = 0;
    /** @type {(chunk: Chunk) => void} */
    this.onChunk = () => {};
    worker.onmessage = ({ data }) => {
      if (data.type === "broken") this.fail();
      if (data.type === "chunk" && data.id === this.id) this.onChunk(data);
    };
    worker.onerror = () => this.fail();
    worker.postMessage({ type: "load", wasm, layout });
  }

  /** Whether the thread did not start, or broke: no run comes back then. */
  broken = false;

  onFailure = () => {};

  fail() {
    this.broken = true;
    this.onFailure();
  }

  /** Begin a run, and end the one before.
   * @param {Machine} machine @param {number} until s, to which one whose particles meet runs on
   * @param {(chunk: Chunk) => void} onChunk */
  run(machine, until, onChunk) {
    this.id += 1;
    this.until = until;
    this.onChunk = onChunk;
    this.worker.postMessage({ type: "run", id: this.id, machine, until });
  }

  /** Let the run go on to a later time. @param {number} until */
  allow(until) {
    if (until <= this.until) return;
    this.until = until;
    this.worker.postMessage({ type: "until", id: this.id, until });
  }
}

export { Engine };
