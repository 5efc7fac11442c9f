// First contacts of one disk with finite surfaces, on the ride and in flight, as Python's
// `theory/obstacles.py` finds them: only whether, when and with what.
import { arcCos, atan2, lengthOf, modulo, sinCos } from "./trig.ts";
import type { Point } from "./scene.ts";

/** A straight surface */
export type Line = { name: string, start: Point, end: Point };
/** A round one */
interface Bend {
  name: string;
  center: Point;
  radius: number;
  begin: number;
  extent: number;
}
export type Obstacles = { lines: Line[], bends: Bend[] };

/** A parabola from t = 0: place (m), velocity (m/s), gravity downward (m/s²). */
export type Flight = { x: number, y: number, vx: number, vy: number, gravity: number };

/** The first of all; Infinity if there is none */
type Hit = { time: number, name: string };

/** Bisections: they exhaust a double's digits. */
const HALVINGS = 60;

/** Share of the numbers that a gap is worked out from by which it may be off, `ROUNDING` there. */
const NOUGHT = 2.0 ** -48;

const NO_HIT: Hit = { time: Infinity, name: "" };

function earlier(hit: Hit, time: number, name: string): Hit {
  return time < hit.time ? { time, name } : hit;
}

export function placeAt({ x, y, vx, vy, gravity }: Flight, t: number): Point {
  return [x + t * vx, y + t * vy - 0.5 * gravity * (t * t)];
}

function frameOf({ start, end }: Line) {
  const [dx, dy] = [end[0] - start[0], end[1] - start[1]];
  const length = lengthOf(dx, dy);
  return { tx: dx / length, ty: dy / length, length };
}

function endsOf(lines: Line[]) {
  return [...lines.map(({ name, start }) => ({ name, point: start })),
    ...lines.map(({ name, end }) => ({ name, point: end }))];
}

/** Returns the ends of bends; a whole circle has none. */
function tipsOf(bends: Bend[]) {
  const tip = ({ name, center, radius }: Bend, angle: number) => {
    const [sine, cosine] = sinCos(angle);
    const point: Point = [center[0] + radius * cosine, center[1] + radius * sine];
    return { name, point };
  };
  const open = bends.filter(({ extent }) => extent < 2.0 * Math.PI);
  return [...open.map((bend) => tip(bend, bend.begin)),
    ...open.map((bend) => tip(bend, bend.begin + bend.extent))];
}

/** Tells whether the direction from a bend's centre to a point is on the bend. */
function holds({ center, begin, extent }: Bend, [x, y]: Point) {
  return modulo(atan2(y - center[1], x - center[0]) - begin, 2.0 * Math.PI) <= extent;
}

/**
 * Returns the first surface that is closer to a point than a radius (m).
 * @returns its name
 */
export function overlapped(
  { lines, bends }: Obstacles, [x, y]: Point, radius: number,
): string | undefined {
  const line = lines.find((one) => {
    const { tx, ty, length } = frameOf(one);
    const [x0, y0] = one.start;
    const share = Math.min(Math.max((x - x0) * tx + (y - y0) * ty, 0.0), length);
    return lengthOf(x0 + share * tx - x, y0 + share * ty - y) < radius;
  });
  if (line !== undefined) return line.name;
  return bends.find((bend) => {
    if (holds(bend, [x, y])) {
      return Math.abs(lengthOf(x - bend.center[0], y - bend.center[1]) - bend.radius) < radius;
    }
    return tipsOf([bend]).some(({ point }) => lengthOf(point[0] - x, point[1] - y) < radius);
  })?.name;
}

/** Returns a time after which a disk has passed all obstacles. */
export function horizonOf(
  { x, y, vx, vy, gravity }: Flight, { lines, bends }: Obstacles, radius: number,
) {
  const corners = endsOf(lines).map(({ point }) => point);
  for (const { center: [cx, cy], radius: r } of bends) {
    corners.push([cx - r, cy - r], [cx + r, cy + r]);
  }
  if (gravity > 0.0) {
    const rise = y - (Math.min(...corners.map((point) => point[1])) - radius);
    const square = vy * vy + 2.0 * gravity * rise;
    return square <= 0.0 ? 0.0 : Math.max((vy + Math.sqrt(square)) / gravity, 0.0);
  }
  const far = Math.max(...corners.map(([px, py]) => lengthOf(px - x, py - y)));
  const pace = lengthOf(vx, vy);
  return pace > 0.0 ? (far + 2.0 * radius) / pace : 0.0;
}

/** @param polynomial highest power first */
function valueOf(polynomial: number[], t: number) {
  return polynomial.reduce((sum, factor) => sum * t + factor, 0.0);
}

function slopeOf(polynomial: number[]) {
  const degree = polynomial.length - 1;
  return polynomial.slice(0, -1).map((factor, n) => factor * (degree - n));
}

/**
 * Returns where a polynomial changes sign between two times, in order.
 * Between the changes of its derivative it rises or falls all the way.
 */
function changesOf(polynomial: number[], low: number, high: number): number[] {
  if (polynomial.length < 2) return [];
  const marks = [low, ...changesOf(slopeOf(polynomial), low, high), high];
  return marks.slice(1).flatMap((end, n) => {
    const [before, after] = [valueOf(polynomial, marks[n]), valueOf(polynomial, end)];
    if (before < 0.0 === after < 0.0) return [];
    const sign = before < 0.0 ? -1.0 : 1.0;
    return [fallOf(polynomial.map((factor) => sign * factor), marks[n], end)];
  });
}

/** Returns where a polynomial that is negative at `high` falls through 0. */
function fallOf(polynomial: number[], low: number, high: number) {
  let [first, last] = [low, high];
  for (let n = 0; n < HALVINGS; n++) {
    const middle = 0.5 * (first + last);
    if (valueOf(polynomial, middle) < 0.0) last = middle;
    else first = middle;
  }
  return last;
}

/** Returns when a disk comes to a circle of a size (m) from outside, or inside (-1.0), in order. */
export function ringTimes(
  { x, y, vx, vy, gravity }: Flight, center: Point, size: number, radius: number, horizon: number,
  side: number = 1.0,
): number[] {
  const fall = -0.5 * gravity;
  const [dx, dy] = [x - center[0], y - center[1]];
  const around = size + side * radius;
  const quartic = [
    fall * fall, 2.0 * vy * fall, vx * vx + vy * vy + 2.0 * dy * fall,
    2.0 * (dx * vx + dy * vy), dx * dx + dy * dy - around * around,
  ];
  const marks = [0.0, ...changesOf(slopeOf(quartic), 0.0, horizon), horizon];
  const reach = Math.abs(x) + Math.abs(y) + Math.abs(center[0]) + Math.abs(center[1])
    + size + radius;
  const sizes = quartic.map(Math.abs);
  const gap = quartic.map((part) => side * part);
  const values = marks.map((mark) => {
    const value = valueOf(gap, mark);
    return Math.abs(value) <= NOUGHT * (valueOf(sizes, mark) + around * reach) ? 0.0 : value;
  });
  return marks.slice(1).flatMap((end, n) => {
    // Where the gap is zero first, the fall begins there.
    if (values[n] === 0.0) return values[n + 1] < 0.0 ? [marks[n]] : [];
    if (values[n] < 0.0 || values[n + 1] > 0.0) return [];
    return [values[n + 1] < 0.0 ? fallOf(gap, marks[n], end) : end];
  });
}

/** Returns when the centre first is as close to a point as a radius; Infinity if never. */
export function cornerTime(flight: Flight, point: Point, radius: number, horizon: number) {
  if (radius <= 0.0 || horizon <= 0.0) return Infinity;
  return ringTimes(flight, point, 0.0, radius, horizon)[0] ?? Infinity;
}

/** Returns from which sides a disk can touch a bend: 1 outside, -1 inside. */
function sidesOf(bend: Bend, radius: number) {
  return bend.radius > radius ? [1.0, -1.0] : [1.0];
}

/** Returns when a disk first collides with the face of a line; Infinity if not up to `horizon`. */
function faceTime(flight: Flight, line: Line, radius: number, horizon: number) {
  const { tx, ty, length } = frameOf(line);
  const [nx, ny] = [-ty, tx];
  const [x0, y0] = line.start;
  const height = (flight.x - x0) * nx + (flight.y - y0) * ny;
  const speed = flight.vx * nx + flight.vy * ny;
  const bend = -0.5 * flight.gravity * ny;
  const off = NOUGHT
    * (Math.abs(flight.x) + Math.abs(flight.y) + Math.abs(x0) + Math.abs(y0) + radius);
  const times = [1.0, -1.0].map((side) => {
    // Where c + b t + a t² falls to 0, without cancellation; NaN if nowhere.
    const [gap, b, a] = [side * height - radius, side * speed, side * bend];
    const c = Math.abs(gap) <= off ? 0.0 : gap;
    const square = b * b - 4.0 * a * c;
    const root = Math.sqrt(Math.abs(square) <= 4.0 * Math.abs(a) * off ? 0.0 : square);
    const pressed = c === 0.0 && b === 0.0 && a < 0.0;
    const t = pressed ? 0.0 : b > 0.0 ? -(b + root) / (2.0 * a) : 2.0 * c / (root - b);
    if (!(t >= 0.0 && t <= horizon)) return Infinity;
    const [x, y] = placeAt(flight, t);
    const foot = (x - x0) * tx + (y - y0) * ty;
    return foot >= 0.0 && foot <= length ? t : Infinity;
  });
  return Math.min(...times);
}

/** Returns when and with what the disk first collides up to `horizon`. */
export function firstInFlight(
  flight: Flight, { lines, bends }: Obstacles, radius: number, horizon: number,
): Hit {
  let hit = NO_HIT;
  for (const line of lines) hit = earlier(hit, faceTime(flight, line, radius, horizon), line.name);
  for (const { name, point } of endsOf(lines)) {
    hit = earlier(hit, cornerTime(flight, point, radius, horizon), name);
  }
  if (horizon <= 0.0) return hit;
  for (const bend of bends) {
    for (const side of sidesOf(bend, radius)) {
      const times = ringTimes(flight, bend.center, bend.radius, radius, horizon, side);
      const time = times.find((t) => holds(bend, placeAt(flight, t)));
      hit = earlier(hit, time ?? Infinity, bend.name);
    }
  }
  for (const { name, point } of tipsOf(bends)) {
    hit = earlier(hit, cornerTime(flight, point, radius, horizon), name);
  }
  return hit;
}

/** Returns the angle of a cosine, which may be beyond 1 by rounding; NaN if it is by more. */
function spreadOf(cosine: number) {
  return arcCos(Math.abs(Math.abs(cosine) - 1.0) <= NOUGHT ? Math.sign(cosine) : cosine);
}

/**
 * Returns the first collision of a ride round the pulley; its `time` is an angle from `begin`.
 * @param rideRadius of the centre's path round the origin, m
 * @param begin angle from the top, rad
 */
export function firstOnPulley(
  rideRadius: number, begin: number, last: number, { lines, bends }: Obstacles, radius: number,
): Hit {
  let hit = NO_HIT;
  const meet = (angle: number, name: string) => {
    const far = modulo(angle - begin, 2.0 * Math.PI);
    const turned = far >= 2.0 * Math.PI - NOUGHT ? 0.0 : far;
    if (turned <= last - begin) hit = earlier(hit, turned, name);
  };
  const place = (angle: number) => {
    const [sine, cosine] = sinCos(angle);
    return [rideRadius * sine, rideRadius * cosine] as Point;
  };
  // From the top where the ride is so far away from a point; NaN if nowhere.
  const around = ([x, y]: Point, size: number) => {
    const far = lengthOf(x, y);
    const square = rideRadius * rideRadius + far * far - size * size;
    const spread = spreadOf(square / (2.0 * rideRadius * far));
    const lean = atan2(x, y);
    return [lean - spread, lean + spread];
  };
  for (const line of lines) {
    const { tx, ty, length } = frameOf(line);
    const [x0, y0] = line.start;
    const level = x0 * -ty + y0 * tx;
    for (const side of [radius, -radius]) {
      const lean = atan2(-ty, tx);
      const spread = spreadOf((level + side) / rideRadius);
      for (const angle of [lean - spread, lean + spread]) {
        const [x, y] = place(angle);
        const foot = (x - x0) * tx + (y - y0) * ty;
        if (foot >= 0.0 && foot <= length) meet(angle, line.name);
      }
    }
  }
  if (radius > 0.0) {
    for (const { name, point } of [...endsOf(lines), ...tipsOf(bends)]) {
      for (const angle of around(point, radius)) meet(angle, name);
    }
  }
  for (const bend of bends) {
    for (const side of sidesOf(bend, radius)) {
      for (const angle of around(bend.center, bend.radius + side * radius)) {
        if (holds(bend, place(angle))) meet(angle, bend.name);
      }
    }
  }
  return hit;
}
