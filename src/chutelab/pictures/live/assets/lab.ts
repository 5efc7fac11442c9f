// The scene being changed: its values, its run, its clock. Nothing here draws.

import { runOf } from "./breaches.ts";
import { roundUp } from "./chart.ts";
import { retied } from "./edit.ts";
import { indexed, withValues } from "./keys.ts";
import { PASSES, build, type Machine } from "./machine.ts";
import { weightOf } from "./motion.ts";
import { Recording } from "./recording.ts";
import { Fault, resolve, type Scene, type Given } from "./scene.ts";
import type { Engine } from "./engine.ts";
import type { Given as Pull, Push } from "./worker.ts";

/** A particle, or a hinged surface and the place on it, m from the hinge before it has turned */
export type Held = { disk: number } | { surface: number, grip: [number, number] };

export type News = "scene" | "run" | "time" | "play";

/** s of a crowd's run that are computed before it is shown. */
const AHEAD = 0.5;

/** Most changes that can be undone. */
const MOST_UNDO = 200;

/** Slow motion and fast, in times of real time. */
const RATES = [0.02, 0.05, 0.1, 0.25, 0.5, 1, 2, 4];

/** A particle far away, to build a machine without particles, which no file may be. */
const NOWHERE = { at: [9e5, 9e5], velocity: [0, 0] };

/** 1/s², 1/s; acceleration of a held thing per metre of distance from the hand, and deceleration
 * per m/s: it comes there as fast as possible without swinging. */
const STIFF = 355, SLOWS = 2 * Math.sqrt(STIFF);

/** m²; a surface held nearer to its hinge is turned as if held at this distance squared. */
const NEAR_HINGE = 1e-6;

/** Whether a scene has no particles. */
const isBare = ({ stream }: Given) => Array.isArray(stream) && !stream.length;

/** Keys that engines ignore. */
const UNSEEN = ["title", "sensor", "view"];

/** Whether two scenes differ only in keys that engines ignore. */
function isSameRun(one: Given, other: Given) {
  const told = (given: Given, without: string[]) => JSON.stringify(
    Object.entries(given).filter(([key]) => !without.includes(key)));
  return told(one, []) !== told(other, []) && told(one, UNSEEN) === told(other, UNSEEN);
}

class Lab {
  listeners: Map<News, Set<() => void>> = new Map();
  past: Given[] = [];
  future: Given[] = [];
  first;
  t = 0;
  playing = false;
  rate = 1;
  /** Width of bins of loads, s, if the scene has none; 0: no loads. */
  loads = 0;
  fault: Fault | null = null;
  /** The key whose field shows the fault; "" if the page shows it. */
  asked = "";
  /** State for undo once a dragged part is released. */
  before: Given | undefined = undefined;
  given?: Given;
  scene?: Scene;
  machine?: Machine;
  recording?: Recording;
  /** The thing held by hand, and the hand's place, m. */
  hand: (Held & { to: [number, number] }) | null = null;
  /** Pushes by hand in this run; and the machine in which particles do not meet. */
  pushes: Push[] = [];
  loose: Machine | null = null;
  /** Whether the engine waits for the hand. */
  waits = false;

  /** @param data of the page */
  constructor(readonly data: any, readonly engine: Engine) {
    const first = this.first = data.scene as Given, { live } = data;
    const controls = live?.controls?.map((key: string) => indexed(first, key));
    const ranges = Object.fromEntries(Object.entries(live?.ranges ?? {})
      .map(([key, ends]) => [indexed(first, key), ends]));
    data.live = { ...live, controls, ranges };
    engine.onFailure = () => this.refuse(new Fault("", undefined, "no-engine"));
    this.use(this.first);
  }

  on(news: News, listener: () => void) {
    if (!this.listeners.has(news)) this.listeners.set(news, new Set());
    this.listeners.get(news)?.add(listener);
  }

  tell(news: News) {
    this.listeners.get(news)?.forEach((listener) => listener());
  }

  /** Take over a scene that can be built, and run it; another one only sets `fault`. */
  use(given: Given): boolean {
    try {
      const scene = resolve(isBare(given) ? { ...given, stream: NOWHERE } : given, this.data);
      const machine = build(scene);
      machine.loads ||= this.loads;
      if (isBare(given)) {
        scene.streams = [];
        for (const key of ["releases", "radius", "mass", "inertia", "streams"] as const) {
          machine[key] = [];
        }
      }
      // In a lesson a run belongs to one machine from its beginning, so that it can be noted.
      // Surfaces move by the time of the run, which a change does not restart.
      const goesOn = !this.data.lesson && this.machine?.interact && machine.interact && this.t > 0
        && ![machine, this.machine].some(({ movers, triggers }) =>
          movers.length || triggers.length);
      const before = this.given;
      this.loose = null;
      this.given = given;
      this.scene = scene;
      this.fault = null;
      if (before && this.recording && isSameRun(before, given)) this.tellSoon();
      else {
        this.machine = machine;
        this.run(goesOn ? this.t : 0);
      }
    } catch (error) {
      if (!(error instanceof Fault)) throw error;
      this.fault = error;
    }
    const isTaken = !this.fault;
    if (this.engine.broken) this.fault = new Fault("", undefined, "no-engine");
    this.tell("scene");
    return isTaken;
  }

  /** Report why something is not possible; nothing changes. */
  refuse(fault: Fault) {
    this.fault = fault;
    this.tell("scene");
  }

  /** Take away why something was not possible. */
  dismiss() {
    this.asked = "";
    if (!this.engine.broken) this.fault = null;
    this.tell("scene");
  }

  /** Run from a time on, with the particles present then: a crowd goes on while it is changed.
   * Others start again, since their runs take no time, as do scenes with joints, which are tied at
   * the release.
   * @param since s */
  run(since: number) {
    const machine = this.machine = this.loose ?? this.machine as Machine;
    const from = machine.joints.length ? 0 : since;
    this.pushes = [];
    this.hand = this.loose = null;
    let job = machine;
    if (from > 0 && this.recording) job = this.recording.goOn(from, machine);
    else this.recording = new Recording(machine);
    const { recording } = this;
    if (!machine.releases.length) {
      this.engine.stop();
      recording.state = "done";
      this.tellSoon();
      return;
    }
    this.engine.run(job, AHEAD + (from > 0 ? 0 : this.t), (chunk) => {
      recording.add(chunk);
      this.tellSoon();
      // After a change a track may lie where a surface is now. A dragged part is judged where it is
      // released.
      if (recording.state === "done" && !recording.renamed && !this.before) this.judge(recording);
    });
  }

  /** Catch something in the run shown, and go on by hand from there: like Python's
   * `chutelab.start`, with all particles together, step by step. */
  grab(held: Held, to: [number, number]) {
    const { machine, t } = this, pushes = this.pushes.filter(({ due }) => due <= t);
    if (!machine) return;
    if (!machine.interact) this.loose = machine;
    const own = machine.interact ? machine : { ...machine, interact: true,
      pairRestitution: machine.pairRestitution.map((row) => row.map(() => PASSES)) };
    const recording = new Recording(own);
    this.hand = { ...held, to };
    this.waits = false;
    this.engine.run(own, t, (chunk) => {
      recording.add(chunk);
      const isThere = recording.now >= t || recording.state !== "running";
      if (this.recording !== recording && !isThere) return;
      if (this.recording !== recording) {
        [this.recording, this.machine, this.pushes] = [recording, own, pushes];
        this.tell("scene");
      }
      this.waits = true;
      this.tellSoon();
      if (recording.state === "done") this.judge(recording);
    }, pushes);
  }

  /** Release the held thing. */
  drop() {
    this.hand = null;
    this.allow(0);
  }

  /** Pull the held thing to the hand for so many seconds. */
  draw(seconds: number) {
    const { recording, machine, hand } = this;
    if (!this.waits || !recording || !machine || !hand) return;
    const { now } = recording, given = this.pullOn(hand, recording, machine);
    this.t = now;
    this.tell("time");
    if (!given || recording.state !== "running") {
      this.drop();
      return;
    }
    const due = Math.max(now, this.pushes.at(-1)?.due ?? 0) + seconds;
    const push = { ...given, at: now, due };
    this.pushes.push(push);
    this.waits = false;
    this.engine.push(push);
  }

  /** The hand's force on the held thing, m (k (to - x) - c v), plus its weight; for a hinged
   * surface the torque, with its effective mass at the place held. */
  pullOn(hand: Held & { to: [number, number] }, recording: Recording, machine: Machine):
    Pull | null {
    const { to } = hand, { now } = recording, { up, gravity, mass } = machine;
    const pull = (n: number, x: number, v: number) => STIFF * (to[n] - x) - SLOWS * v;
    if ("disk" in hand) {
      const { disk } = hand, state = recording.tracks[disk].state(now);
      if (!state || state.ended) return null;
      const { x, y, vx, vy } = state;
      return { disk, force: [mass[disk] * (pull(0, x, vx) + gravity * up[0]),
        mass[disk] * (pull(1, y, vy) + gravity * up[1])] };
    }
    const { surface, grip: [x, y] } = hand, rows = recording.swings.get(surface)?.rows;
    const mover = machine.movers.find((one) => one.surface === surface), last = rows?.at(-1);
    if (!mover || !last) return null;
    const [, angle, rate] = last, [c, s] = [Math.cos(angle), Math.sin(angle)];
    const [u, v] = [c * x - s * y, s * x + c * y], { pivot, inertia } = mover;
    const heavy = inertia / Math.max(x * x + y * y, NEAR_HINGE);
    return { surface, torque: heavy * (u * pull(1, pivot[1] + v, rate * u)
      - v * pull(0, pivot[0] + u, -rate * v)) - weightOf(mover, angle, machine) };
  }

  /** Find the laws that a finished run breaks. */
  judge(recording: Recording) {
    this.engine.judge(runOf(recording), (breaches) => {
      recording.breaches = breaches;
      this.tellSoon();
    });
  }

  /** Report the run: at once if it is finished, else once per frame, since a crowd sends more
   * often. */
  tellSoon() {
    if (this.recording?.state === "done") this.tell("run");
    else this.tellOnce();
  }

  tellOnce() {
    if (this.waiting) return;
    this.waiting = true;
    requestAnimationFrame(() => {
      this.waiting = false;
      this.tell("run");
    });
  }

  waiting = false;

  /** Change values of the scene, by key. While something is dragged they are not yet a step of
   * undo. */
  change(values: Record<string, unknown>, { done = true }: { done?: boolean } = {}) {
    const given = this.given as Given, changed = withValues(given, values);
    const counts = Object.keys(values).some((key) => /^stream.*count$/.test(key));
    this.replace(counts ? retied(given, changed) : changed, { done });
  }

  replace(given: Given, { done = true }: { done?: boolean } = {}) {
    const { before } = this;
    this.before ??= this.given;
    if (!this.use(given)) this.before = before;
    if (done) this.settle();
  }

  /** The dragged part is released: make the drag one step of undo. */
  settle() {
    if (this.before && this.before !== this.given) {
      this.past = [...this.past, this.before].slice(-MOST_UNDO);
      this.future = [];
      const { recording } = this;
      if (recording?.state === "done" && !recording.renamed) this.judge(recording);
    }
    this.before = undefined;
    this.tell("scene");
  }

  undo() {
    this.travel(this.past, this.future);
  }

  redo() {
    this.travel(this.future, this.past);
  }

  travel(from: Given[], to: Given[]) {
    const given = from.pop();
    if (!given) return;
    to.push(this.given as Given);
    this.use(given);
  }

  /** Go back to the original scene, which can be undone. */
  reset() {
    if (this.given !== this.first) this.replace(this.first);
    this.restart();
  }

  /** Start again from the beginning, with the present machine. */
  restart() {
    this.t = this.start;
    if (this.recording?.renamed || this.pushes.length) this.run(0);
    this.tell("time");
  }

  /** Beginning of the time bar, s: 0, or earlier if the recording begins earlier. */
  get start() {
    return Math.min(0, this.recording?.begin ?? 0);
  }

  /** Latest time that can be shown, s: the end of the run, or as far as it has come. */
  get end() {
    const { recording } = this;
    if (!recording) return 0;
    return recording.state === "running" && recording.machine.interact
      ? recording.now : Math.max(recording.end, 0);
  }

  /** End of the time bar, s: the end of the run if known, else a round time beyond what is
   * computed. */
  get horizon() {
    const { recording, end } = this;
    if (recording?.state !== "running" || !recording.machine.interact) return end;
    const { until, endTime } = recording.machine;
    const last = endTime + recording.shift;
    return until === "time" ? last : Math.min(last, roundUp(Math.max(2, 1.2 * end)));
  }

  get isOver() {
    return this.recording?.state !== "running" && this.t >= this.end;
  }

  /** Whether play may begin. */
  mayPlay = () => true;

  play() {
    if (!this.mayPlay()) return;
    if (this.isOver) this.restart();
    this.playing = true;
    this.tell("play");
  }

  pause() {
    this.playing = false;
    this.tell("play");
  }

  /** @param t s */
  seek(t: number) {
    this.t = Math.max(this.start, Math.min(t, this.end));
    this.allow(0);
    this.tell("time");
  }

  /** Compute the run so far that so many seconds can be shown.
   * @param seconds of real time */
  allow(seconds: number) {
    const since = this.t - (this.recording?.shift ?? 0);
    this.engine.allow(since + (seconds + AHEAD) * Math.max(1, this.rate));
  }

  /** Advance by a frame of so many seconds of real time. */
  tick(seconds: number) {
    if (!this.playing) return;
    if (this.hand) {
      this.draw(seconds * this.rate);
      return;
    }
    this.allow(seconds);
    this.t = Math.min(this.t + seconds * this.rate, this.end);
    this.tell("time");
    if (this.isOver) this.pause();
  }
}

export { Lab, RATES, isBare };
