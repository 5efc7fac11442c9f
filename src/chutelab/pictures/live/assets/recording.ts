// The recording of a run: places of particles at any time, and the energy ledger. Between the
// engine's knots a track is the cubic Hermite curve, as in Python's recordings.

import type { Breach } from "./breaches.ts";
import { KNOT_ROW, LOAD_ROW, TOTAL_ROW, type Machine, type Event } from "./core.ts";
import { actAt, waiting } from "./machine.ts";
import { SWING_ROW, Swings, posed, type Hung } from "./motion.ts";

export type State = { x: number, y: number, vx: number, vy: number, spin: number, ended: boolean };
export type Ledger = { start: number, kinetic: number, potential: number, belt_work: number,
  push_work: number, restitution_loss: number, friction_loss: number, residual: number,
  spring: number, damper_loss: number, changed: number };

/** The part of the energy below which what is missing in a balance is rounding. */
const ROUNDING = 1e-12;

const NOTHING: Ledger = {
  start: 0, kinetic: 0, potential: 0, belt_work: 0, push_work: 0, restitution_loss: 0,
  friction_loss: 0, residual: 0, spring: 0, damper_loss: 0, changed: 0,
};
const ENTRIES = Object.keys(NOTHING) as (keyof Ledger)[];

const T = 0, X = 1, Y = 2, VX = 3, VY = 4, SPIN = 5, BELT = 6, RESTITUTION = 7, FRICTION = 8,
  ANGLE = 10;

/** Kinds of events, as in the enum Kind of the core. */
const RELEASE = 0, SEPARATION = 1;

/** Most straight parts in which a piece of a track is drawn. */
const MOST_CHORDS = 500;

/** Knots of one particle, `KNOT_ROW` doubles each. */
class Track {
  /** @param tells whether its knots have angles, so that boxes and polygons have theirs to the last
   * bit */
  constructor(readonly tells = false) {}

  rows = new Float64Array(8 * KNOT_ROW);

  count = 0;

  /** Index of the last search. */
  near = 0;

  /** Number of preliminary knots at the end, which only show how far it has come. */
  tip = 0;

  /** Whether it is still under way at the end of the run so far. */
  live = false;

  /** Remove the preliminary knots. */
  dropTips() {
    this.count -= this.tip;
    this.tip = 0;
    // Setting a length takes long, even if it does not change.
    if (this.turns.length > this.count) this.turns.length = this.count;
  }

  /** @param from beginning of the knot's row in `knots` @param shift s */
  add(knots: ArrayLike<number>, from: number, shift: number, entries: number[] | null) {
    if ((this.count + 1) * KNOT_ROW > this.rows.length) {
      const rows = new Float64Array(2 * this.rows.length);
      rows.set(this.rows);
      this.rows = rows;
    }
    const { rows } = this, begin = this.count * KNOT_ROW;
    for (let n = 0; n < KNOT_ROW; n += 1) rows[begin + n] = knots[from + n];
    rows[begin] += shift;
    if (entries) for (let n = 0; n < 3; n += 1) rows[begin + BELT + n] += entries[n];
    this.count += 1;
  }

  at(knot: number, column: number) {
    return this.rows[knot * KNOT_ROW + column];
  }

  get begin() {
    return this.count ? this.rows[0] : Infinity;
  }

  get end() {
    return this.count ? this.at(this.count - 1, T) : -Infinity;
  }

  /** The last knot that is not after t. */
  knotBefore(t: number) {
    let low = 0;
    let high = this.count - 1;
    const { near } = this;
    if (near < high && this.at(near, T) <= t) {
      if (this.at(near + 1, T) > t) return near;
      low = near;
    }
    while (high - low > 1) {
      const middle = (low + high) >> 1;
      if (this.at(middle, T) <= t) low = middle;
      else high = middle;
    }
    this.near = low;
    return low;
  }

  /** Remove everything after t, and keep the state then.
   * @param entries of the ledger then, J */
  cut(t: number, entries: number[]) {
    const state = this.state(t);
    if (!state) {
      this.count = 0;
      this.tip = 0;
    }
    if (!state || this.end <= t) return;
    const { x, y, vx, vy, spin } = state, angle = this.angle(t);
    this.count = this.knotBefore(t) + 1;
    this.turns.length = Math.min(this.turns.length, this.count);
    this.near = 0;
    this.tip = 0;
    this.add([t, x, y, vx, vy, spin, ...entries, 0, angle], 0, 0, null);
  }

  /** Position, velocity and spin; null before the release, and after the end of the track. */
  state(t: number): State | null {
    if (!this.count || t < this.rows[0]) return null;
    const last = this.count - 1;
    if (t >= this.end) return this.stateOf(last, t > this.end && !this.live);
    const i = this.knotBefore(t);
    const h = this.at(i + 1, T) - this.at(i, T);
    const s = (t - this.at(i, T)) / h;
    const spin = this.at(i, SPIN) * (1 - s) + this.at(i + 1, SPIN) * s;
    return {
      x: this.placeOn(i, X, VX, h, s), y: this.placeOn(i, Y, VY, h, s),
      vx: this.paceOn(i, X, VX, h, s), vy: this.paceOn(i, Y, VY, h, s), spin, ended: false,
    };
  }

  /** Place and velocity just before a time at which it is under way: before an impact at that time.
   */
  before(t: number) {
    let i = this.knotBefore(t);
    while (i > 0 && this.at(i, T) >= t) i -= 1;
    i = Math.min(i, this.count - 2);
    const h = this.at(i + 1, T) - this.at(i, T), s = h > 0 ? (t - this.at(i, T)) / h : 1;
    if (s >= 1) {
      const [x, y, vx, vy] = [X, Y, VX, VY].map((column) => this.at(i + 1, column));
      return { x, y, vx, vy };
    }
    const [x, y] = [this.placeOn(i, X, VX, h, s), this.placeOn(i, Y, VY, h, s)];
    return { x, y, vx: this.paceOn(i, X, VX, h, s), vy: this.paceOn(i, Y, VY, h, s) };
  }

  stateOf(i: number, ended: boolean): State {
    return {
      x: this.at(i, X), y: this.at(i, Y), vx: this.at(i, VX), vy: this.at(i, VY),
      spin: this.at(i, SPIN), ended,
    };
  }

  /** A coordinate at the share s of the time h between two knots. */
  placeOn(i: number, place: number, pace: number, h: number, s: number) {
    const a = this.at(i, place), va = this.at(i, pace), vb = this.at(i + 1, pace);
    const dx = this.at(i + 1, place) - a;
    return a + s * (h * va + s * (3 * dx - h * (2 * va + vb) + s * (h * (va + vb) - 2 * dx)));
  }

  /** Its velocity there. */
  paceOn(i: number, place: number, pace: number, h: number, s: number) {
    const va = this.at(i, pace), vb = this.at(i + 1, pace);
    const slope = h > 0 ? (this.at(i + 1, place) - this.at(i, place)) / h : vb;
    return va + s * (2 * (3 * slope - 2 * va - vb) + 3 * s * (va + vb - 2 * slope));
  }

  /** Points from a knot to the next, both included: straight lines between them miss the track by
   * `fine` (m). Over a time h a chord misses a curve by at most h²/8 times its largest
   * acceleration, which a cubic has at one of its ends. */
  chords(i: number, fine: number) {
    const t = this.at(i, T), h = this.at(i + 1, T) - t;
    const bends = [[X, VX], [Y, VY]].map(([place, pace]) => {
      const way = 6 * (this.at(i + 1, place) - this.at(i, place));
      const first = h * this.at(i, pace), last = h * this.at(i + 1, pace);
      return [way - 4 * first - 2 * last, way - 2 * first - 4 * last];
    });
    const bent = Math.max(Math.hypot(bends[0][0], bends[1][0]),
      Math.hypot(bends[0][1], bends[1][1]));
    const parts = h > 0 ? Math.min(Math.ceil(Math.sqrt(bent / 8 / fine)), MOST_CHORDS) : 1;
    const points = [{ t, x: this.at(i, X), y: this.at(i, Y) }];
    for (let n = 1; n < parts; n += 1) {
      const s = n / parts, x = this.placeOn(i, X, VX, h, s), y = this.placeOn(i, Y, VY, h, s);
      points.push({ t: t + (h * n) / parts, x, y });
    }
    points.push({ t: t + h, x: this.at(i + 1, X), y: this.at(i + 1, Y) });
    return points;
  }

  /** Counterclockwise angle from its shape as written, rad. */
  angle(t: number) {
    if (!this.count || t <= this.begin) return this.count && this.tells ? this.at(0, ANGLE) : 0;
    const i = t >= this.end ? this.count - 1 : this.knotBefore(t);
    if (this.tells) return this.told(t, i);
    for (let n = this.turns.length; n < this.count; n += 1) {
      const h = n ? this.at(n, T) - this.at(n - 1, T) : 0;
      const mean = n ? 0.5 * (this.at(n, SPIN) + this.at(n - 1, SPIN)) : 0;
      this.turns.push(n ? this.turns[n - 1] + h * mean : 0);
    }
    const h = Math.min(t, this.end) - this.at(i, T);
    const spin = (this.state(Math.min(t, this.end)) as State).spin;
    return this.turns[i] + 0.5 * h * (this.at(i, SPIN) + spin);
  }

  /** The integral of its spin from a knot on, corrected evenly to the next knot's angle. */
  told(t: number, i: number) {
    const from = this.at(i, ANGLE), spin = this.at(i, SPIN);
    if (i === this.count - 1) return from;
    const h = this.at(i + 1, T) - this.at(i, T), s = (t - this.at(i, T)) / h;
    const even = this.at(i + 1, ANGLE) - from - 0.5 * h * (spin + this.at(i + 1, SPIN));
    return from + s * (h * (spin + 0.5 * s * (this.at(i + 1, SPIN) - spin)) + even);
  }

  /** Angle at each knot, as far as it was needed. */
  turns: number[] = [];

  /** Belt work, restitution loss and friction loss so far, J, linear between knots. */
  entries(t: number) {
    const i = t >= this.end ? this.count - 1 : this.knotBefore(t);
    const h = i + 1 < this.count ? this.at(i + 1, T) - this.at(i, T) : 0;
    const s = h > 0 ? Math.min(1, (t - this.at(i, T)) / h) : 0;
    return [BELT, RESTITUTION, FRICTION].map((column) => {
      const from = this.at(i, column);
      return h > 0 ? from + s * (this.at(i + 1, column) - from) : from;
    });
  }
}

/** Names of particles that do not depend on other streams: stream, and number in it. */
function namesOf({ releases, streams }: Machine) {
  const count = streams.map(() => 0);
  return releases.map(({ stream }) => {
    count[stream] += 1;
    return `${count[stream]} ${streams[stream]}`;
  });
}

const trackOf = ({ outlines, releases }: Machine, i: number) =>
  new Track(outlines[releases[i].kind].length > 0);

/** Entries of a ledger, with their columns of the totals, and signs in the balance. */
const PROCESSES =
  [["friction_loss", 5, -1], ["belt_work", 3, 1], ["restitution_loss", 4, -1]] as const;

/** The tracks and events of a run, which may still be running. */
class Recording {
  tracks;
  events: Event[] = [];
  state = "running";
  /** It is complete up to this time, s. */
  now = 0;
  /** For a run that continues after a change: the engine's numbers of particles, and entries to be
   * added. */
  renamed: { index: number, entries: number[], goesOn: boolean }[] | null = null;
  shift = 0;
  /** From the last change on: what is to be added to the sum of all particles' ledgers. */
  sinceChange: Partial<Ledger> = {};
  /** Belt work, restitution and friction loss by surface, and between particles, J, after the run;
   * none if the scene was changed during it. */
  books: number[][] | null = null;
  /** Energy by which the engine's solver broke its law, J. */
  gained = 0;
  /** Greatest fall of all losses below their maxima before, both together, J. */
  regained = 0;
  /** The most that all have had at a step beyond what the ledger explains, J. */
  risen = 0;
  /** Greatest acceleration of a particle by a push, m/s². */
  hastened = 0;
  unsolved = 0;
  /** Impacts and steps so far. */
  contacts = 0;
  steps = 0;
  /** States of hinges, by surfaces. */
  swings: Map<number, Swings> = new Map();
  /** Loads on surfaces, `LOAD_ROW` numbers each, bin by bin. */
  loads = new Float64Array();
  /** Times, s, and the work of all pushes and of all surfaces up to then, J. */
  pushes: [number, number, number][] = [];
  /** Of a crowd: totals of all particles at the steps, `TOTAL_ROW` numbers each; those before a
   * change only if it left all particles as they were. */
  totals: Float64Array[] = [];
  /** The laws that it breaks, once it is finished and judged. */
  breaches: Breach[] = [];

  constructor(public machine: Machine) {
    waiting(machine);
    this.tracks = machine.releases.map((_, i) => trackOf(machine, i));
    for (const { surface } of machine.movers) this.swings.set(surface, new Swings());
  }

  /** The machine as it is at a time, s. */
  posed(t: number) {
    return posed(this.machine, t, this.swings);
  }

  add({
    knots, tips, events, swings, now, state, books = null, gained = 0, regained = 0, risen = 0,
    hastened = 0, unsolved = 0, contacts = 0, steps = 0, loads, triggered = [], pushed = 0,
    given = 0, totals,
  }: {
    knots: Float64Array, tips: Float64Array, events: Event[], swings: number[], now: number,
    state: string,
    books?: number[][] | null, gained?: number, regained?: number, risen?: number,
    hastened?: number, unsolved?: number, contacts?: number, steps?: number,
    loads?: { from: number, rows: Float64Array },
    triggered?: number[], pushed?: number, given?: number, totals?: Float64Array,
  }) {
    this.gained = gained;
    this.regained = regained;
    this.risen = risen;
    this.hastened = hastened;
    this.unsolved = unsolved;
    this.contacts = contacts;
    this.steps = steps;
    this.books = this.renamed ? null : books;
    const its = (disk: number) =>
      this.renamed ? this.renamed[disk] : { index: disk, entries: null, goesOn: false };
    for (const track of this.tracks) track.live = false;
    for (const rows of [knots, tips]) {
      for (let begin = 0; begin < rows.length; begin += KNOT_ROW) {
        const { index, entries } = its(rows[begin + 9]);
        const track = this.tracks[index];
        const isTip = rows === tips;
        if (!(isTip && track.live)) track.dropTips();
        track.live = isTip;
        if (isTip && rows[begin] + this.shift < track.end) continue;
        track.add(rows, begin, this.shift, entries);
        if (isTip) track.tip += 1;
      }
    }
    for (const event of events) {
      const { index, goesOn } = its(event.disk);
      // A particle that continues after a change is not released again.
      if (goesOn && event.kind === RELEASE && event.t === 0) continue;
      const other = event.other >= 0 ? its(event.other).index : event.other;
      this.events.push({ ...event, t: event.t + this.shift, disk: index, other });
    }
    for (let n = 0; n < swings.length; n += SWING_ROW) {
      this.swings.get(swings[n + SWING_ROW - 1])?.rows.push(swings.slice(n, n + SWING_ROW - 1));
    }
    if (loads?.rows.length) this.bear(loads.from, loads.rows);
    if (triggered.length) actAt(this.machine, triggered);
    const [, before, gave] = this.pushes.at(-1) ?? [0, 0, 0];
    if (pushed !== before) this.pushes.push([this.now, before, gave], [now, pushed, given]);
    if (totals?.length) {
      for (let k = 0; k < totals.length; k += TOTAL_ROW) totals[k] += this.shift;
      this.totals.push(totals);
    }
    this.measure();
    this.state = state;
    this.now = state === "running" ? now + this.shift : Math.max(this.end, now + this.shift);
  }

  /** Take in loads, in bins from one on. */
  bear(from: number, rows: Float64Array) {
    const at = from * this.machine.surfaces.length * LOAD_ROW;
    const loads = new Float64Array(at + rows.length);
    loads.set(this.loads.subarray(0, at));
    loads.set(rows, at);
    this.loads = loads;
  }

  /** End of the last track, and beginning of the first, s. */
  get end() {
    return this.span[1];
  }

  get begin() {
    return this.span[0];
  }

  measure() {
    let begin = Infinity, end = -Infinity;
    for (const track of this.tracks) {
      if (track.begin < begin) begin = track.begin;
      if (track.end > end) end = track.end;
    }
    this.span = [begin, end];
  }

  span = [Infinity, -Infinity];

  /** Remove everything after t, and return the machine for continuing from there, with its time
   * beginning then: with particles under way, and those to be released. */
  goOn(t: number, machine: Machine): Machine {
    const renamed: { index: number, entries: number[], goesOn: boolean }[] = [];
    const releases: Machine["releases"] = [];
    const spins: number[] = [], angles: number[] = [];
    // Number of each in the run so far: added and removed streams shift later ones.
    const earlier = new Map(namesOf(this.machine).map((name, index) => [name, index]));
    const was = namesOf(machine).map((name) => earlier.get(name) ?? -1);
    // A balance that is open at a change would stay open.
    const booked = was.map((index) => {
      const ledger = index < 0 ? null : this.ledgerOf(index, t);
      return ledger
        ? [ledger.belt_work, ledger.restitution_loss, ledger.friction_loss] : [0, 0, 0];
    });
    const closing = this.closing(t, this.sumOf(t));
    this.tracks = was.map((index, i) => this.tracks[index] ?? trackOf(machine, i));
    this.events = this.renumbered(t, was, machine.surfaces);
    machine.releases.forEach((release, index) => {
      const track = this.tracks[index], entries = booked[index];
      const ended = track.count > 0 && !track.live && track.end < t;
      track.cut(t, entries);
      const state = track.state(t);
      if (ended) return;
      renamed.push({ index, entries, goesOn: state !== null });
      spins.push(state ? state.spin : 0);
      angles.push(track.angle(t));
      if (state) {
        const { x, y, vx, vy } = state;
        // A particle that still rides the belt keeps riding.
        const carried = release.carried && x < 0 && !this.hasLeft(index, t);
        releases.push({ ...release, x, y, vx, vy, t: 0, carried });
        track.tip = 1;
      } else releases.push({ ...release, t: Math.max(0, release.t - t) });
    });
    this.measure();
    this.machine = machine;
    this.renamed = renamed;
    this.closeAtChange(t, closing);
    this.shift = t;
    this.loads = new Float64Array();
    this.books = null;
    this.now = t;
    this.state = "running";
    const some = (values: number[]) => renamed.map(({ index }) => values[index]);
    const gate = (piece: any) => ({
      ...piece, appears: piece.appears - t, vanishes: piece.vanishes - t,
    });
    return {
      ...machine, releases, spins, angles, goesOn: renamed.map((its) => its.goesOn),
      radius: some(machine.radius), mass: some(machine.mass), inertia: some(machine.inertia),
      segments: machine.segments.map(gate), arcs: machine.arcs.map(gate),
      endTime: Math.max(0, machine.endTime - t),
    };
  }

  /** Events up to t with a changed machine's numbers of particles and surfaces, without removed
   * ones.
   * @param was earlier number of each particle */
  renumbered(t: number, was: number[], surfaces: string[]) {
    const now: Map<number, number> = new Map(was.map((index, n) => [index, n]));
    const names = this.machine.surfaces;
    return this.events.flatMap((event) => {
      const disk = now.get(event.disk);
      const other = event.other < 0 ? event.other : now.get(event.other);
      if (event.t > t || disk === undefined || other === undefined) return [];
      const surface = event.surface < names.length
        ? surfaces.indexOf(names[event.surface]) : surfaces.length;
      return [{ ...event, disk, other, surface }];
    });
  }

  hasLeft(index: number, t: number) {
    return this.events.some((event) =>
      event.disk === index && event.kind === SEPARATION && event.t <= t);
  }

  /** The energy ledger of one particle. While it slips, the rest of the balance is slip heat; else,
   * while it is driven, belt work; else the loss of lasting contacts; in flight it is the residual.
   * In a crowd particles give energy to each other, and the balance is that of all. */
  ledgerOf(index: number, t: number): Ledger | null {
    const track = this.tracks[index];
    const state = track.state(t);
    if (!state) return null;
    const { machine } = this;
    const mass = machine.mass[index], inertia = machine.inertia[index];
    const kinetic = ({ vx, vy, spin }: State) =>
      0.5 * mass * (vx * vx + vy * vy) + 0.5 * inertia * spin * spin;
    const [across, up] = machine.up;
    const potential = ({ x, y }: State) => mass * machine.gravity * (across * x + up * y);
    const energy = (one: State) => kinetic(one) + potential(one);
    const first = track.stateOf(0, false);
    const start = energy(first);
    const gain = energy(state) - start;
    const i = t >= track.end ? track.count - 1 : track.knotBefore(t);
    const j = Math.min(i + 1, track.count - 1);
    let [belt, restitution, friction] = track.entries(t);
    const residualAt = (k: number) => energy(track.stateOf(k, false)) - start
      - (track.at(k, BELT) - track.at(k, RESTITUTION) - track.at(k, FRICTION));
    const h = track.at(j, T) - track.at(i, T), s = h > 0 ? (t - track.at(i, T)) / h : 0;
    let residual = residualAt(i) + Math.min(s, 1) * (residualAt(j) - residualAt(i));
    // The rest of linear interpolation belongs to the process that goes on.
    const missing = gain - (belt - restitution - friction) - residual;
    const changes = (column: number) => track.at(i, column) !== track.at(j, column);
    if (machine.movers.length && changes(BELT)) belt += missing;
    else if (changes(FRICTION)) friction -= missing;
    else if (changes(BELT)) belt += missing;
    else if (changes(RESTITUTION)) restitution -= missing;
    else residual += missing;
    return {
      start, kinetic: kinetic(state), potential: potential(state), belt_work: belt, push_work: 0,
      restitution_loss: restitution, friction_loss: friction, residual, spring: 0, damper_loss: 0,
      changed: 0,
    };
  }

  /** Work of all pushes up to a time, J: during a push, the work not done by surfaces.
   * @param work of both, J */
  pushedAt(t: number, work: number) {
    const { pushes } = this, n = pushes.findLastIndex(([then]) => then <= t);
    if (n < 0) return 0;
    const [from, given, gave] = pushes[n], [to, more, gives] = pushes[n + 1] ?? pushes[n];
    return more === given ? given : work - gave - ((gives - gave) * (t - from)) / (to - from);
  }

  /** Rows of the totals at the beginning and at the end of a step, and how much of it has passed;
   * none without totals. */
  stepAt(t: number): [Float64Array, Float64Array, number] | null {
    const n = this.totals.findLastIndex((all) => all[0] <= t), rows = this.totals[n];
    if (!rows) return null;
    let low = 0, high = rows.length / TOTAL_ROW;
    while (high - low > 1) {
      const middle = (low + high) >> 1;
      if (rows[middle * TOTAL_ROW] <= t) low = middle;
      else high = middle;
    }
    const row = (all: Float64Array, k: number) => all.subarray(k * TOTAL_ROW, (k + 1) * TOTAL_ROW);
    const a = row(rows, low);
    const b = (low + 1) * TOTAL_ROW < rows.length ? row(rows, low + 1)
      : row(this.totals[n + 1] ?? a, 0);
    return [a, b, b[0] > a[0] ? Math.min((t - a[0]) / (b[0] - a[0]), 1) : 0];
  }

  /** The ledger with joints, which pass energy from one particle to another: linear from step to
   * step of the engine. */
  joinedLedger(t: number): Ledger | null {
    const step = this.machine.joints.length ? this.stepAt(t) : null;
    if (!step) return null;
    const [a, b, s] = step;
    const between = a.map((value, k) => value + s * (b[k] - value));
    // What is released in the step is not in the totals at its beginning. What is released at that
    // very instant is, if they were noted after it: the energies released by both ends tell.
    const all = this.tracks.flatMap(({ begin }, index) => {
      const its = begin >= a[0] && begin < b[0] ? this.ledgerOf(index, begin) : null;
      return its ? [{ begin, its }] : [];
    });
    const later = all.filter(({ begin }) => begin > a[0]);
    const missed = (list: typeof all) =>
      Math.abs(b[7] - a[7] - list.reduce((sum, { its }) => sum + its.start, 0));
    for (const { begin, its } of missed(all) < missed(later) ? all : later) {
      const counted = Number(t >= begin) - s;
      between[1] += counted * its.kinetic;
      between[2] += counted * its.potential;
      between[7] += counted * its.start;
    }
    const [, kinetic, potential, work, restitution_loss, friction_loss, , released, kept, spring,
      damper_loss, gave] = between;
    const push_work = this.pushedAt(t, work - gave), start = released + kept;
    const belt_work = work - gave - push_work;
    return {
      start, kinetic, potential, belt_work, push_work, spring, restitution_loss, friction_loss,
      damper_loss, residual: kinetic + potential + spring - start - belt_work - push_work
        + restitution_loss + friction_loss + damper_loss, changed: 0,
    };
  }

  /** Energies and losses of hinges, of all or of one surface; none for a run that was changed
   * during it. */
  hung(t: number, surface?: number): Hung {
    const total: Hung = {
      kinetic: 0, potential: 0, spring: 0, restitution_loss: 0, damper_loss: 0, push_work: 0,
    };
    for (const mover of this.machine.movers) {
      const swings = this.swings.get(mover.surface) as Swings;
      if (!mover.inertia || !swings.rows.length || this.renamed) continue;
      if (surface !== undefined && mover.surface !== surface) continue;
      const its = swings.energies(t, mover, this.machine);
      for (const name of Object.keys(total) as (keyof Hung)[]) total[name] += its[name];
    }
    return total;
  }

  /** The sum of the ledgers of all released particles. */
  sumOf(t: number): Ledger {
    const total = { ...NOTHING };
    for (let index = 0; index < this.tracks.length; index += 1) {
      const its = this.ledgerOf(index, t);
      if (its) for (const name of ENTRIES) total[name] += its[name];
    }
    return total;
  }

  /** What is to be added to the sum of all particles' ledgers. Particles give energy to each other
   * within a step: the residual is that of the totals, and the rest of the balance belongs to the
   * process that goes on among all; without totals, it is due to a change. */
  closing(t: number, sum: Ledger): Partial<Ledger> {
    const since = t >= this.shift ? this.sinceChange : {}, step = this.stepAt(t);
    if (!step && !this.renamed) return since;
    let [process, sign, straight]: [keyof Ledger, number, number] = ["changed", 1, 0];
    if (step) {
      const [a, b, s] = step;
      const [from, to] = [a, b].map(([, kinetic, potential, work, restitution, friction, , released,
        kept, spring, damper]) => kinetic + potential + spring - released - kept - work
        + restitution + friction + damper);
      straight = from + s * (to - from);
      const going = PROCESSES.find(([, column]) => a[column] !== b[column]);
      [process, sign] = going ? [going[0], going[2]] : ["residual", 0];
    }
    const missing = sum.residual + (since.residual ?? 0) - straight;
    return {
      ...since, [process]: (since[process] ?? 0) + sign * missing,
      residual: straight - sum.residual,
    };
  }

  /** Set what the ledger has from a change on: what the change gives, as removed particles gave to
   * others, is an entry of its own.
   * @param closing what closed the balance before the change */
  closeAtChange(t: number, closing: Partial<Ledger>) {
    const sum = this.sumOf(t), given = sum.residual + (closing.residual ?? 0);
    this.sinceChange = {
      ...closing, changed: (closing.changed ?? 0) + given, residual: -sum.residual,
    };
    const size = sum.start + Math.abs(sum.belt_work) + sum.restitution_loss + sum.friction_loss;
    if (Math.abs(given) > ROUNDING * size) this.totals = [];
    else this.totals = this.totals.filter((all) => all[0] <= t);
  }

  /** The ledger of all released particles, from their tracks. */
  tracksLedger(t: number): Ledger {
    const total = this.sumOf(t), closing = this.closing(t, total);
    // In a track the work of pushes is part of that of drives.
    total.push_work = this.pushedAt(t, total.belt_work);
    total.belt_work -= total.push_work;
    for (const name of ENTRIES) total[name] += closing[name] ?? 0;
    return total;
  }

  /** The ledger of all released particles, and of hinges. */
  ledger(t: number): Ledger {
    const total = this.joinedLedger(t) ?? this.tracksLedger(t);
    // The work of drives includes that of hinges on particles. The energy of hinges that does not
    // come from motors came from contacts.
    const [begun, hung] = [0, t].map((then) => this.hung(then));
    const kept = ({ kinetic, potential, spring }: Hung) => kinetic + potential + spring;
    total.start += kept(begun);
    total.belt_work += kept(hung) - kept(begun) + hung.restitution_loss + hung.damper_loss
      - hung.push_work;
    for (const name of Object.keys(hung) as (keyof Hung)[]) total[name] += hung[name];
    return total;
  }

  /** Points of a track, including its knots: straight lines between them miss it by `fine` (m). */
  points(index: number, fine: number) {
    const track = this.tracks[index];
    if (!track?.count) return [];
    const { count } = track;
    const points = Array.from({ length: count - 1 }, (_, i) => track.chords(i, fine).slice(1));
    return [{ t: track.begin, x: track.at(0, X), y: track.at(0, Y) }, ...points.flat()];
  }
}

export { Recording, ROUNDING, Track };
