// Places of moving surfaces, like Python's `Mover` in `machine/parts.py`. The core has its own.

import type { Arc, Machine, Segment } from "./machine.ts";
import type { Mover } from "./plan.ts";
import type { Point } from "./scene.ts";

/** Pivot, m, and angle, rad */
export type Pose = { x: number, y: number, turn: number };
/** States of hinges from the core: t (s), angle (rad), rate (rad/s); losses at stops and in the
 * damper and work of pushes so far (J); surface. */
export const SWING_ROW = 7;

/** J: kinetic energy, potential energy above the hinge, spring energy; losses at stops and in the
 * damper and work of pushes so far */
export type Hung = { kinetic: number, potential: number, spring: number, restitution_loss: number,
  damper_loss: number, push_work: number };

/** The states of a hinge: cubics between them. */
class Swings {
  rows: number[][] = [];

  /** The states before and after a time, and the share of the interval that has passed. */
  around(t: number): [number[], number[], number] {
    const { rows } = this;
    // A motor may give a blow at the first instant; the run begins before it.
    if (t <= rows[0][0]) return [rows[0], rows[0], 1];
    let low = 0, high = rows.length - 1;
    while (high - low > 1) {
      const middle = (low + high) >> 1;
      if (rows[middle][0] <= t) low = middle;
      else high = middle;
    }
    const h = rows[high][0] - rows[low][0];
    return [rows[low], rows[high],
      h > 0 ? Math.min(1, Math.max(0, (t - rows[low][0]) / h)) : 1];
  }

  /** Energies and work at a time, like Python's `Hinge.energies`: linear between states, so that a
   * ledger that closes at both closes between them. */
  energies(
    t: number, { inertia, moment: [x, y], spring, rest }: Mover, { gravity, up }: Machine,
  ): Hung {
    const of = ([, angle, rate, restitution_loss, damper_loss, push_work]: number[]): Hung => {
      const [c, s] = [Math.cos(angle), Math.sin(angle)];
      return {
        kinetic: 0.5 * inertia * rate * rate,
        potential: gravity * (up[0] * (x * c - y * s) + up[1] * (x * s + y * c)),
        spring: 0.5 * spring * (angle - rest) ** 2, restitution_loss, damper_loss, push_work,
      };
    };
    const [before, after, s] = this.around(t), [a, b] = [of(before), of(after)];
    for (const name of Object.keys(a) as (keyof Hung)[]) a[name] += s * (b[name] - a[name]);
    return a;
  }

  /** Angle at a time, rad. */
  at(t: number) {
    if (!this.rows.length) return 0;
    const [[from, a, va], [to, b, vb], s] = this.around(t), h = to - from;
    const gone = b - a, [first, last] = [h * va, h * vb];
    return a + s * (first + s * ((3 * gone - 2 * first - last) + s * (first + last - 2 * gone)));
  }
}

/** The torque of a hinge's weight at an angle, N m. */
export function weightOf({ moment: [x, y] }: Mover, angle: number, { gravity, up }: Machine) {
  const [c, s] = [Math.cos(angle), Math.sin(angle)];
  return gravity * (up[0] * (x * s + y * c) - up[1] * (x * c - y * s));
}

/** The pose of a mover at a time, s. It travels with a constant acceleration up to the middle, and
 * with the opposite one from there on. */
function poseOf(mover: Mover, time: number, swings?: Swings): Pose {
  const { pivot, by, frequency, phase, way, from, lasts, turn, inertia, begins } = mover;
  const t = Math.max(time - begins, 0);
  const swing = Math.sin(2 * Math.PI * frequency * t + phase);
  const u = lasts ? Math.min(1, Math.max(0, (t - from) / lasts)) : 0;
  const share = u < 0.5 ? 2 * u * u : 1 - 2 * (1 - u) * (1 - u);
  const [x, y] = [0, 1].map((n) => pivot[n] + by[n] * swing + way[n] * share);
  return { x, y, turn: inertia ? swings?.at(time) ?? 0 : turn * t };
}

/** Position of a point, given as written, m, in a pose. */
function carried({ x, y, turn }: Pose, { pivot }: Mover, [px, py]: Point): Point {
  const [c, s, u, v] = [Math.cos(turn), Math.sin(turn), px - pivot[0], py - pivot[1]];
  return [x + c * u - s * v, y + s * u + c * v];
}

const onSegment = (one: Segment, mover: Mover, pose: Pose): Segment => {
  const [x, y, u, v] = one.ends, begin = carried(pose, mover, [x, y]);
  const [c, s] = [Math.cos(pose.turn), Math.sin(pose.turn)];
  return { ...one, x: begin[0], y: begin[1], tx: c * one.tx - s * one.ty,
    ty: s * one.tx + c * one.ty, ends: [...begin, ...carried(pose, mover, [u, v])] };
};

const onArc = (one: Arc, mover: Mover, pose: Pose): Arc => {
  const [x, y] = carried(pose, mover, [one.x, one.y]);
  return { ...one, x, y, begin: one.begin + pose.turn };
};

/** A machine at a time, s; the same object if nothing moves.
 * @param swings of hinges, by their surfaces */
function posed(machine: Machine, t: number, swings?: Map<number, Swings>): Machine {
  if (!machine.movers.length) return machine;
  const movers = new Map(machine.movers.map((one) =>
    [one.surface, [one, poseOf(one, t, swings?.get(one.surface))] as const]));
  const placed = <T extends { surface: number }>(
    all: T[], on: (one: T, mover: Mover, pose: Pose) => T,
  ) => all.map((one) => {
      const found = movers.get(one.surface);
      return found ? on(one, ...found) : one;
    });
  return { ...machine, segments: placed(machine.segments, onSegment),
    arcs: placed(machine.arcs, onArc) };
}

export { Swings, carried, poseOf, posed };
