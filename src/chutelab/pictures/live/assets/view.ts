// Converts between the world (m, y up) and the picture (px, y down).

import type { Machine, Segment } from "./machine.ts";
import { memory } from "./plan.ts";

type Point = [number, number];
type Box = { left: number, bottom: number, right: number, top: number };

class View {
  width = 1;

  height = 1;

  /** Pixels per metre. */
  scale = 100;

  /** The world's point in the middle of the picture, m. */
  x = 0;

  y = 0;

  resize(width: number, height: number) {
    this.width = width;
    this.height = height;
  }

  /** The part of the picture that no card covers, px. */
  free = { left: 0, top: 0, right: 1, bottom: 1 };

  /** The world's point in the middle of the free part, m. */
  get middle(): [number, number] {
    const { left, right, top, bottom } = this.free;
    return [this.worldX(0.5 * (left + right)), this.worldY(0.5 * (top + bottom))];
  }

  /** Show all of a box in the free part, with a margin. @param margin px */
  fit({ left, bottom, right, top }: Box, margin: number = 30) {
    const { free } = this;
    const across = Math.max(1, free.right - free.left - 2 * margin);
    const up = Math.max(1, free.bottom - free.top - 2 * margin);
    this.scale = Math.min(across / Math.max(right - left, 1e-6), up / Math.max(top - bottom, 1e-6));
    this.x = 0.5 * (left + right) + (0.5 * (this.width - free.left - free.right)) / this.scale;
    this.y = 0.5 * (bottom + top) - (0.5 * (this.height - free.top - free.bottom)) / this.scale;
  }

  /** @param py with `px` the point that stays, px */
  zoom(factor: number, px: number, py: number) {
    const [x, y] = [this.worldX(px), this.worldY(py)];
    this.scale *= factor;
    this.x += x - this.worldX(px);
    this.y += y - this.worldY(py);
  }

  px(x: number) {
    return 0.5 * this.width + (x - this.x) * this.scale;
  }

  py(y: number) {
    return 0.5 * this.height - (y - this.y) * this.scale;
  }

  worldX(px: number) {
    return this.x + (px - 0.5 * this.width) / this.scale;
  }

  worldY(py: number) {
    return this.y - (py - 0.5 * this.height) / this.scale;
  }

  /** Step to which dragged points are rounded: the power of ten up to 1.5 pixels, m. */
  get snap() {
    return 10 ** Math.floor(Math.log10(1.5 / this.scale));
  }

  /** Distance between lines of the grid: a round number of m. */
  get mesh() {
    const rough = MESH / this.scale, ten = 10 ** Math.floor(Math.log10(rough));
    return ten * ([1, 2, 5].find((n) => n * ten >= rough) ?? 10);
  }

  /** Size of new parts: a round number of m, at most the picture's height. */
  get unit() {
    const high = (this.free.bottom - this.free.top) / this.scale;
    const ten = 10 ** Math.floor(Math.log10(high));
    return ten * ([5, 2].find((n) => n * ten <= high) ?? 1);
  }

  /** Returns the point that is meant by one of the picture, px: a near end of a part, else at a
   * round angle seen from `from`, on a line of the grid, or rounded to about a pixel.
   * @param ends m
   * @returns the point, m, and whether it is one of the first three */
  near([px, py]: Point, ends: Point[], from?: Point): { at: Point, caught: boolean } {
    const far = ([x, y]: Point) => Math.hypot(this.px(x) - px, this.py(y) - py);
    const end = ends.reduce((best: Point | null, one) =>
      (far(one) < (best ? far(best) : CATCH) ? one : best), null);
    if (end) return { at: end, caught: true };
    const round = (value: number, step: number) =>
      Number((Math.round(value / step) * step).toPrecision(12));
    const [x, y] = [this.worldX(px), this.worldY(py)];
    if (from) {
      const [dx, dy] = [x - from[0], y - from[1]], long = Math.hypot(dx, dy);
      const turn = Math.atan2(dy, dx), to = round(turn, TURN);
      if (long * this.scale > CATCH && Math.abs(turn - to) < NEAR_TURN) {
        const way = round(long, this.snap);
        return { at: [Number((from[0] + way * Math.cos(to)).toFixed(9)),
          Number((from[1] + way * Math.sin(to)).toFixed(9))], caught: true };
      }
    }
    let caught = false;
    const line = (value: number) => {
      const to = round(value, 0.5 * this.mesh), isNear = Math.abs(to - value) * this.scale < LINE;
      caught ||= isNear;
      return isNear ? to : round(value, this.snap);
    };
    return { at: [line(x), line(y)], caught };
  }
}

/** Distances within which points snap to an end and to a line of the grid, px. */
const CATCH = 11, LINE = 5;

/** Step of round angles, and how near one has to be, rad. */
const TURN = Math.PI / 12, NEAR_TURN = Math.PI / 72;

/** Least distance between lines of the grid, px. */
const MESH = 70;

/** How much of belts and walls is shown beyond everything else, m; in a crowd, walls above the
 * highest particle at most by this share of the height. */
const BEYOND = 0.35, ABOVE = 0.2;

/** The view of an empty scene. */
const EMPTY: Box = { left: -0.6, bottom: -0.6, right: 0.6, top: 0.4 };

/** How much of the fall of particles that leave the scene is shown, as a share of the machine's
 * size. */
const FALL = 0.35;

/** Returns the first view of a machine: its tracks and everything near them. Of long belts and
 * walls, and of the fall of particles that leave the scene, only a part is shown.
 * @param ride whether the whole ride on the incoming belt is shown, however long
 * @param swept points passed by moving parts, m */
function boxOf(
  machine: Machine, points: { x: number, y: number }[], ride: boolean = false,
  swept: Point[] = [],
): Box {
  const box = { left: Infinity, bottom: Infinity, right: -Infinity, top: -Infinity };
  const widen = (x: number, y: number, r = 0) => {
    box.left = Math.min(box.left, x - r);
    box.right = Math.max(box.right, x + r);
    box.bottom = Math.min(box.bottom, y - r);
    box.top = Math.max(box.top, y + r);
  };
  for (const arc of machine.arcs) {
    for (let n = 0; n <= 32; n += 1) {
      const angle = arc.begin + (arc.extent * n) / 32;
      widen(arc.x + arc.radius * Math.cos(angle), arc.y + arc.radius * Math.sin(angle));
    }
  }
  if (machine.pulley) widen(0, 0, machine.pulley.radius);
  for (const { from } of machine.joints) if (from) widen(...from);
  let [west, east, south, north] = [Infinity, -Infinity, Infinity, -Infinity];
  const { EXIT_MARGIN: margin } = memory().layout.constants;
  for (const { exitBox: [left, bottom, right, top] } of machine.releases) {
    west = Math.min(west, left + margin);
    east = Math.max(east, right - margin);
    south = Math.min(south, bottom + margin);
    north = Math.max(north, top - margin);
  }
  // Without surfaces there is no scene to leave.
  const all = !machine.segments.length && !machine.arcs.length;
  const inside = ({ x, y }: { x: number, y: number }) =>
    all || (x >= west && x <= east && y >= south && y <= north);
  // Show little more of the ride on the incoming belt than of the motion after it.
  const onward = machine.pulley ? points.filter((one) => one.x >= 0 && inside(one)) : [];
  const span = onward.reduce((most, { x, y }) => Math.max(most, x, Math.abs(y)), 0);
  const from = onward.length && !ride ? -1.25 * span : -Infinity;
  points.filter(inside).forEach(({ x, y }) => widen(Math.max(x, from), y));
  if (!points.length) machine.releases.forEach(({ x, y }, i) => widen(x, y, machine.radius[i]));
  const ends = ({ x, y, tx, ty, length }: Segment) =>
    [[x, y], [x + tx * length, y + ty * length]];
  // Walls may reach far above all particles.
  const highest = [...points, ...machine.releases]
    .reduce((top, { y }) => Math.max(top, y), -Infinity);
  const still = machine.segments.filter(({ speed }) => !speed);
  const lowest = Math.min(...still.flatMap(ends).map(([, y]) => y));
  // Of walls round a crowd, show little above the particles.
  const above = machine.interact ? Math.min(BEYOND, ABOVE * Math.max(0, highest - lowest)) : BEYOND;
  const ceiling = isFinite(highest) ? highest + above : Infinity;
  for (const [x, y] of still.flatMap(ends)) widen(x, Math.min(y, ceiling));
  const [left, right] = [box.left - BEYOND, box.right + BEYOND];
  for (const [x, y] of machine.segments.filter(({ speed }) => speed).flatMap(ends)) {
    widen(isFinite(left) ? Math.min(Math.max(x, left), right) : x, y);
  }
  // Where the beginning of the incoming belt is shown, its pulley is.
  const { radius = 0, surface = -1 } = machine.pulley ?? {};
  const belt = machine.segments.find((one) => radius && one.surface === surface);
  if (belt && belt.x >= box.left) {
    widen(belt.x + radius * belt.ty, belt.y - radius * belt.tx, radius);
  }
  for (const place of swept) widen(...place);
  if (!isFinite(box.left)) return EMPTY;
  // Below a surface that vanishes, or swings away, show where particles fall.
  const opens = machine.segments.some(({ vanishes }) => isFinite(vanishes))
    || (!machine.pulley && machine.movers.some(({ inertia }) => inertia));
  if (opens) {
    widen(box.left, box.bottom - FALL * (box.top - box.bottom));
  }
  const held = { ...box }, room = FALL * Math.max(box.right - box.left, box.top - box.bottom);
  for (const point of points.filter((one) => !inside(one))) {
    widen(Math.min(Math.max(point.x, held.left - room), held.right + room),
      Math.min(Math.max(point.y, held.bottom - room), held.top + room));
  }
  return box;
}

export { View, boxOf };
