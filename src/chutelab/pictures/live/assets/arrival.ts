// Arrivals of particles on the outgoing belt: when, where and how fast; the same operations in the
// same order as Python's `results/arrival.py`.
//
// A particle arrives when it first touches the belt, or touches what lies on it: particles that
// touch the belt, those that touch these, and so on. A particle that has bounced off does not lie
// on the belt. If particles do not meet each other, to arrive is to touch the belt itself.

import { modulo } from "./trig.ts";
import type { Event } from "./core.ts";
import type { Segment, Arc } from "./machine.ts";
import type { Recording } from "./recording.ts";

/** Velocity before */
export type Arrival = { t: number, x: number, y: number, vx: number, vy: number };
/** Of particle i */
type Place = { i: number, x: number, y: number };

const COLLISION = 5;

/** Gap, as a share of the smaller radius, up to which two touch. */
const TOUCH = 0.01;

/** Times at which particles that lie on the belt without a recorded impact are searched. */
const RESTS = 100;

/** Share of the time between two such times to which the beginning of a contact is found. */
const BISECTIONS = 24;

class Arrivals {
  flat;
  bent;
  /** By particle; missing for those that have not arrived. */
  found: (Arrival | undefined)[];
  /** Contacts that have not been judged, and the number of events read. */
  due: Event[] = [];
  seen = 0;
  /** Arrivals are known up to this time, s. */
  since = NaN;

  /** @param recording as far as it has come */
  constructor(readonly recording: Recording) {
    const { machine } = recording;
    this.flat = machine.segments.filter(this.own);
    this.bent = machine.arcs.filter(this.own);
    this.found = recording.tracks.map(() => undefined);
    this.read();
    const first = this.since, last = this.reach, step = (last - first) / (RESTS - 1);
    for (let n = 0; n < RESTS && step >= 0; n += 1) {
      this.look(n < RESTS - 1 ? n * step + first : last);
    }
  }

  /** Whether something belongs to the outgoing belt; there may be none. */
  own = ({ surface }: { surface: number }) =>
    surface >= 0 && surface === this.recording.machine.landing;

  /** Everything is recorded up to this time, s. */
  get reach() {
    return this.recording.state === "running" ? this.recording.now : this.recording.end;
  }

  /** Take in what a running run has added. */
  update() {
    this.read();
    if (this.reach > this.since) this.look(this.reach);
  }

  /** Those that have arrived, in the order of time. */
  get list() {
    return (this.found.filter(Boolean) as Arrival[]).sort((a, b) => a.t - b.t);
  }

  /** Read new events; where particles do not meet, the first touch of each is its arrival. */
  read() {
    const { events, machine } = this.recording;
    const more = events.slice(this.seen);
    this.seen = events.length;
    // All events on it count: a particle that slides onto it from a tangential chute has no impact.
    const direct = more.filter(this.own);
    if (!machine.interact) {
      for (const event of direct) this.found[event.disk] ??= arrivalOf(event);
      return;
    }
    if (isNaN(this.since)) {
      // Nothing arrives before the first touch of the belt itself, which is always recorded.
      const begin = direct.reduce((least, { t }) => Math.min(least, t), Infinity);
      if (isFinite(begin)) this.since = begin;
    }
    this.due = [...this.due, ...direct, ...more.filter(({ kind }) => kind === COLLISION)]
      .filter(({ t }) => t >= this.since);
    // At one time, particles that touch the belt come first.
    const late = ({ kind }: Event) => Number(kind === COLLISION);
    this.due.sort((a, b) => a.t - b.t || late(a) - late(b) || a.disk - b.disk);
  }

  /** Judge all contacts up to a time, and what lies on the belt then. @param t s */
  look(t: number) {
    const { found } = this;
    let n = 0;
    for (; n < this.due.length && this.due[n].t <= t; n += 1) {
      const event = this.due[n], { disk: i, other: j } = event;
      if (j < 0) found[i] ??= arrivalOf(event);
      else if (!found[i] !== !found[j]) {
        const [next, old] = found[i] ? [j, i] : [i, j];
        // Particles that lie there have arrived before.
        const there = this.places(event.t).filter((one) => found[one.i]);
        if (this.carries(old, event.t, there)) {
          found[next] = next === i ? arrivalOf(event) : this.state(next, event.t);
        }
      }
    }
    this.due.splice(0, n);
    // Particles that came to lie there so softly that no impact was recorded.
    const places = this.places(t), lies = this.lying(t, places);
    places.forEach(({ i }, k) => {
      if (lies[k] && !found[i]) found[i] = this.began(i, this.since, t);
    });
    this.since = t;
  }

  /** Places of all particles under way. @param t s */
  places(t: number): Place[] {
    const places: Place[] = [];
    this.recording.tracks.forEach((track, i) => {
      const state = track.begin <= t && t <= track.end ? track.state(t) : null;
      if (state) places.push({ i, x: state.x, y: state.y });
    });
    return places;
  }

  /** Whether a particle touches the belt itself. @param t s */
  touches({ i, x, y }: Place, t: number) {
    const reach = this.recording.machine.radius[i] * (1 + TOUCH);
    const isThere = (piece: { appears: number, vanishes: number }) =>
      piece.appears <= t && t < piece.vanishes;
    return this.flat.some((piece) => isThere(piece) && gapToSegment(piece, x, y) <= reach)
      || this.bent.some((piece) => isThere(piece) && gapToArc(piece, x, y) <= reach);
  }

  /** Whether two particles touch. */
  meet(a: Place, b: Place) {
    const { radius } = this.recording.machine, r = radius[a.i], s = radius[b.i];
    return Math.hypot(a.x - b.x, a.y - b.y) <= r + s + TOUCH * Math.min(r, s);
  }

  /** The particles, of some, that lie on the belt, or on what lies on it. @param t s */
  lying(t: number, places: Place[]): boolean[] {
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

  /** Whether a particle, one of some, lies on the belt, or on those of them that do.
   * @param t s */
  carries(i: number, t: number, places: Place[]) {
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

  /** The arrival of a particle that lies there at one time, but not at an earlier one.
   * @param before s
   * @param after s */
  began(i: number, before: number, after: number) {
    for (let n = 0; n < BISECTIONS; n += 1) {
      const middle = 0.5 * (before + after);
      if (this.carries(i, middle, this.places(middle))) after = middle;
      else before = middle;
    }
    return this.state(i, after);
  }

  /** Place and velocity just before a time. @param t s */
  state(i: number, t: number): Arrival {
    return { t, ...this.recording.tracks[i].before(t) };
  }
}

const arrivalOf = (
  { t, x, y, before }: Event,
): Arrival => ({ t, x, y, vx: before[0], vy: before[1] });

/** Distance of a point from a straight piece, m. */
function gapToSegment(
  { x, y, tx, ty, length }: Pick<Segment, "x" | "y" | "tx" | "ty" | "length">, px: number,
  py: number,
) {
  const [u, v] = [px - x, py - y], along = Math.min(Math.max(u * tx + v * ty, 0), length);
  return Math.hypot(u - along * tx, v - along * ty);
}

/** Distance of a point from an arc, m. */
function gapToArc({ x, y, radius, begin, extent }: Arc, px: number, py: number) {
  const [u, v] = [px - x, py - y];
  if (modulo(Math.atan2(v, u) - begin, 2 * Math.PI) <= extent) {
    return Math.abs(Math.hypot(u, v) - radius);
  }
  return Math.min(...[begin, begin + extent].map((angle) =>
    Math.hypot(u - radius * Math.cos(angle), v - radius * Math.sin(angle))));
}

export { Arrivals, gapToArc, gapToSegment };
