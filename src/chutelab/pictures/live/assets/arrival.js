// Which particles have come to the outgoing belt, when, where and how fast: what Python's
// `results/arrival.py` says, by the same operations in the same order.
//
// A particle arrives when it first touches the belt, or touches what lies on it: what touches the
// belt, what touches that, and so on. What has bounced off lies on nothing. Where particles do not
// meet each other, to arrive is to touch the belt itself.

import { modulo } from "./trig.js";

/**
 * @typedef {import("./recording.js").Recording} Recording
 * @typedef {import("./core.js").Event} Event
 * @typedef {{t: number, x: number, y: number, vx: number, vy: number}} Arrival  velocity before
 * @typedef {{i: number, x: number, y: number}} Place  of particle i
 */

const COLLISION = 5;

/** Gap, as a share of the smaller radius, up to which two touch. */
const TOUCH = 0.01;

/** Instants at which it is looked who lies on the belt without a blow that was recorded. */
const RESTS = 100;

/** Of the time between two such instants, until the one is known at which a contact began. */
const BISECTIONS = 24;

class Arrivals {
  /** @param {Recording} recording as far as it has come */
  constructor(recording) {
    this.recording = recording;
    const { machine } = recording;
    const own = (/** @type {{surface: number}} */ { surface }) => surface === machine.landing;
    this.flat = machine.segments.filter(own);
    this.bent = machine.arcs.filter(own);
    /** Of each particle; none of those that have not arrived.
     * @type {(Arrival | undefined)[]} */
    this.found = recording.tracks.map(() => undefined);
    /** Contacts that are not judged yet, and how many events have been read. @type {Event[]} */
    this.due = [];
    this.seen = 0;
    /** s up to which it is known what has arrived. */
    this.since = NaN;
    this.read();
    const first = this.since, last = this.reach, step = (last - first) / (RESTS - 1);
    for (let n = 0; n < RESTS && step >= 0; n += 1) {
      this.look(n < RESTS - 1 ? n * step + first : last);
    }
  }

  /** s up to which all is recorded. */
  get reach() {
    return this.recording.state === "running" ? this.recording.now : this.recording.end;
  }

  /** Take in what a run that goes on has added. */
  update() {
    this.read();
    if (this.reach > this.since) this.look(this.reach);
  }

  /** Those that have arrived, in the order of time. */
  get list() {
    return /** @type {Arrival[]} */ (this.found.filter(Boolean)).sort((a, b) => a.t - b.t);
  }

  /** Read new events; where particles do not meet, the first touch of each is its arrival. */
  read() {
    const { events, machine } = this.recording;
    const more = events.slice(this.seen);
    this.seen = events.length;
    // All that happens on it: what passes on to it from a tangential chute gives no blow.
    const direct = more.filter(({ surface }) => surface === machine.landing);
    if (!machine.interact) {
      for (const event of direct) this.found[event.disk] ??= arrivalOf(event);
      return;
    }
    if (isNaN(this.since)) {
      // Nothing comes before the first that touches the belt itself, which is told however soft.
      const begin = direct.reduce((least, { t }) => Math.min(least, t), Infinity);
      if (isFinite(begin)) this.since = begin;
    }
    this.due = [...this.due, ...direct, ...more.filter(({ kind }) => kind === COLLISION)]
      .filter(({ t }) => t >= this.since);
    // Of one instant, what touches the belt comes first.
    const late = (/** @type {Event} */ { kind }) => Number(kind === COLLISION);
    this.due.sort((a, b) => a.t - b.t || late(a) - late(b) || a.disk - b.disk);
  }

  /** Judge all contacts up to a time, and who lies on the belt then. @param {number} t s */
  look(t) {
    const { found } = this;
    let n = 0;
    for (; n < this.due.length && this.due[n].t <= t; n += 1) {
      const event = this.due[n], { disk: i, other: j } = event;
      if (j < 0) found[i] ??= arrivalOf(event);
      else if (!found[i] !== !found[j]) {
        const [next, old] = found[i] ? [j, i] : [i, j];
        // Whatever lies there has come before.
        const there = this.places(event.t).filter((one) => found[one.i]);
        if (this.carries(old, event.t, there)) {
          found[next] = next === i ? arrivalOf(event) : this.state(next, event.t);
        }
      }
    }
    this.due.splice(0, n);
    // What came to lie there so softly that no blow was recorded.
    const places = this.places(t), lies = this.lying(t, places);
    places.forEach(({ i }, k) => {
      if (lies[k] && !found[i]) found[i] = this.began(i, this.since, t);
    });
    this.since = t;
  }

  /** Where all are that are under way. @param {number} t s @returns {Place[]} */
  places(t) {
    /** @type {Place[]} */
    const places = [];
    this.recording.tracks.forEach((track, i) => {
      const state = track.begin <= t && t <= track.end ? track.state(t) : null;
      if (state) places.push({ i, x: state.x, y: state.y });
    });
    return places;
  }

  /** Whether a particle touches the belt itself. @param {Place} place @param {number} t s */
  touches({ i, x, y }, t) {
    const reach = this.recording.machine.radius[i] * (1 + TOUCH);
    const isThere = (/** @type {{appears: number, vanishes: number}} */ piece) =>
      piece.appears <= t && t < piece.vanishes;
    return this.flat.some((piece) => isThere(piece) && gapToSegment(piece, x, y) <= reach)
      || this.bent.some((piece) => isThere(piece) && gapToArc(piece, x, y) <= reach);
  }

  /** Whether two particles touch. @param {Place} a @param {Place} b */
  meet(a, b) {
    const { radius } = this.recording.machine, r = radius[a.i], s = radius[b.i];
    return Math.hypot(a.x - b.x, a.y - b.y) <= r + s + TOUCH * Math.min(r, s);
  }

  /** Which of some lie on the belt, or on what lies on it. @param {number} t s
   * @param {Place[]} places @returns {boolean[]} */
  lying(t, places) {
    const { radius } = this.recording.machine;
    const lies = places.map((place) => this.touches(place, t));
    const largest = places.reduce((most, { i }) => Math.max(most, radius[i]), 0);
    const order = places.map((_, k) => k).sort((a, b) => places[a].x - places[b].x);
    const rank = places.map(() => 0);
    order.forEach((k, n) => { rank[k] = n; });
    const todo = order.filter((k) => lies[k]);
    for (let k = todo.pop(); k !== undefined; k = todo.pop()) {
      for (const way of [-1, 1]) {
        for (let n = rank[k] + way; n >= 0 && n < order.length; n += way) {
          const other = order[n];
          if (Math.abs(places[other].x - places[k].x) > 2 * largest * (1 + TOUCH)) break;
          if (lies[other] || !this.meet(places[k], places[other])) continue;
          lies[other] = true;
          todo.push(other);
        }
      }
    }
    return lies;
  }

  /** Whether a particle, one of some, lies on the belt, or on what of them lies on it.
   * @param {number} i @param {number} t s @param {Place[]} places */
  carries(i, t, places) {
    const seen = new Set([i]), todo = places.filter((place) => place.i === i);
    for (let place = todo.pop(); place; place = todo.pop()) {
      if (this.touches(place, t)) return true;
      for (const other of places) {
        if (seen.has(other.i) || !this.meet(place, other)) continue;
        seen.add(other.i);
        todo.push(other);
      }
    }
    return false;
  }

  /** How a particle that lies there at one time, but not at an earlier one, came there.
   * @param {number} i @param {number} before s @param {number} after s */
  began(i, before, after) {
    for (let n = 0; n < BISECTIONS; n += 1) {
      const middle = 0.5 * (before + after);
      if (this.carries(i, middle, this.places(middle))) after = middle;
      else before = middle;
    }
    return this.state(i, after);
  }

  /** Place and velocity just before a time. @param {number} i @param {number} t s
   * @returns {Arrival} */
  state(i, t) {
    return { t, ...this.recording.tracks[i].before(t) };
  }
}

/** @param {Event} event @returns {Arrival} */
const arrivalOf = ({ t, x, y, before }) => ({ t, x, y, vx: before[0], vy: before[1] });

/** Distance of a point from a straight piece, m.
 * @param {import("./machine.js").Segment} piece @param {number} px @param {number} py */
function gapToSegment({ x, y, tx, ty, length }, px, py) {
  const [u, v] = [px - x, py - y], along = Math.min(Math.max(u * tx + v * ty, 0), length);
  return Math.hypot(u - along * tx, v - along * ty);
}

/** Distance of a point from an arc, m.
 * @param {import("./machine.js").Arc} arc @param {number} px @param {number} py */
function gapToArc({ x, y, radius, begin, extent }, px, py) {
  const [u, v] = [px - x, py - y];
  if (modulo(Math.atan2(v, u) - begin, 2 * Math.PI) <= extent) {
    return Math.abs(Math.hypot(u, v) - radius);
  }
  return Math.min(...[begin, begin + extent].map((angle) =>
    Math.hypot(u - radius * Math.cos(angle), v - radius * Math.sin(angle))));
}

export { Arrivals, gapToArc, gapToSegment };
