// Where, when and how fast each particle starts: drawn as Python's `machine/releases.py` does.
import { onBelt, upBelt } from "./belt.ts";
import { generator, type Generator } from "./random.ts";
import { Fault, type Scene, type Point } from "./scene.ts";
import { lengthOf } from "./trig.ts";

export interface Release {
  t: number; // s
  x: number; // m
  y: number;
  vx: number; // m/s
  vy: number;
  carried: boolean; // rides the incoming belt by adhesion
  stream: number;
  kind: number;
}

/** Which places are free */
type Clear = (places: Point[], radius: number) => boolean[];

/** Draws of a height that may overlap an earlier particle before it has to wait for its place. */
const TRIES = 1000;

/** Distance of neighbours in a packed box, in radii of the largest. */
const PITCH = 2.04;

/** How far a place in it is moved at random each way, in the same unit. */
const JITTER = 0.01;

/** Places of a box that are looked at together; what is above the particles never is. */
const HANDFUL = 1000;

/** Places of a box that are looked at, at most, and `TRIES` more for each particle. */
const LOOKS = 1_000_000;

/**
 * Returns where the lowest layer of a stream is released, m.
 * @param n of the stream
 */
function releasePoint(scene: Scene, n: number): Point {
  const { at } = scene.streams[n];
  const belt = scene.incoming;
  if (belt === null || (at !== undefined && !onBelt(scene, n))) {
    return at as Point;
  }
  const riding = belt.pulley_radius + scene.particles[scene.kinds[n]].radius;
  const [cosine, sine] = upBelt(scene);
  const along = at === undefined ? -belt.length : at[0] * cosine + at[1] * sine;
  return [along * cosine - riding * sine, along * sine + riding * cosine];
}

/**
 * Returns with what velocity a stream is released, m/s.
 * @param n of the stream
 */
function releaseVelocity(scene: Scene, n: number): Point {
  const { velocity, fill } = scene.streams[n];
  if (velocity !== undefined) return velocity;
  if (fill !== undefined || scene.incoming === null) return [0.0, 0.0];
  const [cosine, sine] = upBelt(scene);
  const { speed } = scene.incoming;
  return [speed * cosine, sine === 0.0 ? 0.0 : speed * sine];
}

/**
 * Draws the releases of all streams, one after the other, and the radii of the particles.
 * @throws {Fault} if a box has not room for all
 */
export function draw(scene: Scene, clear: Clear): { releases: Release[], radius: number[] } {
  const releases: Release[] = [];
  const radius: number[] = [];
  scene.streams.forEach((stream, n) => {
    const drawn = stream.fill === undefined
      ? drawStream(scene, n) : pour(scene, n, releases, radius, clear);
    // One by one: a call takes some hundred thousand arguments at most.
    for (const release of drawn.releases) releases.push(release);
    for (const r of drawn.radius) radius.push(r);
  });
  return { releases, radius };
}

function diceOf(scene: Scene, n: number) {
  const { seed } = scene.streams[n];
  return n ? generator(seed, n) : generator(seed);
}

/** Draws radii from the range of a stream's kind, m; the first has the mean. */
function drawRadii(scene: Scene, n: number, dice: Generator | null): number[] {
  const { radius, span } = scene.particles[scene.kinds[n]];
  const { count } = scene.streams[n];
  if (span === undefined || dice === null) return new Array(count).fill(radius);
  const radii = Array.from({ length: count }, () => dice.uniform(span[0], span[1]));
  radii[0] = radius;
  return radii;
}

/** Draws the releases of one stream, at a point or along a line. */
function drawStream(scene: Scene, n: number) {
  const stream = scene.streams[n];
  const { count, to } = stream;
  const kind = scene.kinds[n];
  const particle = scene.particles[kind];
  const every = Array.from({ length: count }, (_, i) => i);
  const atOnce = to !== undefined && !("rate" in stream.given);
  const t = every.map((i) => (atOnce ? 0.0 : i / stream.rate) + stream.start);
  const [vx, vy] = releaseVelocity(scene, n);
  const velocity = every.map(() => ({ vx, vy }));
  const crowded = count > 1 && scene.crowded;
  // The first one has no spread.
  const spread = stream.bed_height > 0.0 || stream.speed_spread > 0.0;
  const draws = count > 1 && (crowded || spread || to !== undefined || particle.span !== undefined);
  const dice = draws ? diceOf(scene, n) : null;
  const height = every.map(() => 0.0);
  if (dice !== null) {
    every.forEach((i) => { height[i] = stream.bed_height * dice.random(); });
    height[0] = 0.0;
    const faster = every.map(() => stream.speed_spread * dice.uniform(-1.0, 1.0));
    faster[0] = 0.0;
    const speed = lengthOf(vx, vy);
    const [x, y] = speed > 0.0 ? [vx / speed, vy / speed] : [1.0, 0.0];
    velocity.forEach((one, i) => {
      one.vx += faster[i] * x;
      one.vy += faster[i] * y;
    });
  }
  const radius = drawRadii(scene, n, dice);
  const common = { carried: false, stream: n, kind };
  if (to !== undefined) {
    const [x, y] = stream.at as Point;
    const step = 1.0 / (count - 1);
    const share = every.map((i) => {
      if (i === 0 || dice === null) return 0.0;
      return atOnce ? (i === count - 1 ? 1.0 : i * step) : dice.random();
    });
    const releases = every.map((i) => ({
      t: t[i], x: x + share[i] * (to[0] - x), y: y + share[i] * (to[1] - y), ...velocity[i],
      ...common,
    }));
    return { releases, radius };
  }
  const rides = onBelt(scene, n);
  const adheres = rides && scene.incoming?.friction === "adhesion";
  const [cosine, sine] = rides ? upBelt(scene) : [1.0, 0.0];
  if (crowded && dice !== null) {
    const fall = adheres ? 0.0 : 0.5 * scene.gravity;
    const lowest = rides ? 0.0 : -Infinity;
    // Seen from the belt, if it rises.
    const along = velocity.map(({ vx: u, vy: v }) => {
      return [u * cosine + v * sine, v * cosine - u * sine] as Point;
    });
    spreadApart(stream.bed_height, t, height, along, radius, fall, lowest, dice);
  }
  if (rides) every.forEach((i) => { height[i] += radius[i] - particle.radius; });
  const [x, low] = releasePoint(scene, n);
  const releases = every.map((i) => ({
    t: t[i], x: x - sine * height[i], y: low + cosine * height[i], ...velocity[i],
    ...common, carried: adheres,
  }));
  return { releases, radius };
}

/**
 * Redraws heights, in place, so that no particle starts inside one released before it.
 * Earlier particles are taken to have moved on at their release velocity, and to have fallen by
 * `fall` (m/s²) times their age squared, but not below `lowest` (m above the lowest layer).
 * @param bed height that is drawn from, m
 */
function spreadApart(
  bed: number, t: number[], height: number[], velocity: Point[], radius: number[], fall: number,
  lowest: number, dice: Generator,
) {
  let largest = 0.0;
  for (const r of radius) largest = Math.max(largest, r);
  const diameter = 2.0 * largest;
  // Who may still be in the way: whoever has moved on by a diameter, or has fallen below the bed
  // by one, stays away for good.
  let close: number[] = [];
  for (let i = 1; bed > 0.0 && i < t.length; i++) {
    close.push(i - 1);
    const near: { dx: number, dy: number, reach: number }[] = [];
    close = close.filter((j) => {
      const age = t[i] - t[j];
      const dx = velocity[j][0] * age;
      const dy = Math.max(height[j] + velocity[j][1] * age - fall * (age * age), lowest);
      const sinks = velocity[j][1] <= 2.0 * fall * age;
      const stays = Math.abs(dx) < diameter && !(sinks && dy <= -diameter);
      if (stays) near.push({ dx, dy, reach: radius[j] + radius[i] });
      return stays;
    });
    for (let tries = TRIES; tries > 0; tries--) {
      const free = near.every(({ dx, dy, reach }) => {
        const up = dy - height[i];
        return dx * dx + up * up >= reach * reach;
      });
      if (free) break;
      height[i] = bed * dice.random();
    }
  }
}

/**
 * Yields the places of a packed box from below: rows, every other one shifted by half a pitch.
 * @param largest radius
 */
function* packedPlaces(
  [[left, bottom], [right, top]]: [Point, Point], largest: number,
): IterableIterator<Point> {
  const pitch = PITCH * largest;
  const room = largest * (1.0 + JITTER);
  const rise = pitch * Math.sqrt(0.75);
  const rows = Math.max(0, Math.floor((top - bottom - 2.0 * room) / rise) + 1);
  const across = Math.max(0, Math.floor((right - left - 2.0 * room) / pitch) + 1);
  for (let row = 0; row < rows; row++) {
    for (let column = 0; column < across; column++) {
      const x = left + room + (column * pitch + 0.5 * pitch * (row % 2));
      if (x <= right - room) yield [x, bottom + room + row * rise];
    }
  }
}

/**
 * Returns what tells whether a disk of a radius may be at a place, away from those of the streams
 * before it: in a grid of cells it looks at its own and those around.
 * @param their radii
 */
function freeOf(
  before: Release[], their: number[], radius: number,
): (x: number, y: number) => boolean {
  let largest = 0.0;
  for (const r of their) largest = Math.max(largest, r);
  const size = radius + largest;
  const cell = (x: number) => Math.floor(x / size);
  const grid: Map<string, number[]> = new Map();
  before.forEach(({ x, y }, j) => {
    const key = `${cell(x)} ${cell(y)}`;
    const known = grid.get(key);
    if (known) known.push(j);
    else grid.set(key, [j]);
  });
  const around = [-1, 0, 1];
  return (x, y) => around.every((right) => around.every((up) => {
    const near = grid.get(`${cell(x) + right} ${cell(y) + up}`) ?? [];
    return near.every((j) => {
      return lengthOf(x - before[j].x, y - before[j].y) >= radius + their[j];
    });
  }));
}

/**
 * Packs a stream's box, as far up as it takes.
 * @param before of the streams before it
 * @param their radii
 */
function pour(scene: Scene, n: number, before: Release[], their: number[], clear: Clear) {
  const stream = scene.streams[n];
  const kind = scene.kinds[n];
  const particle = scene.particles[kind];
  const box = stream.fill as [Point, Point];
  const dice = diceOf(scene, n);
  const radius = drawRadii(scene, n, dice);
  const largest = particle.span === undefined ? particle.radius : particle.span[1];
  const source = packedPlaces(box, largest);
  const isFree = freeOf(before, their, largest);
  const found: Point[] = [];
  let left = LOOKS + TRIES * stream.count;
  for (let more = true; more && found.length < stream.count;) {
    const places: Point[] = [];
    while (more && places.length < HANDFUL) {
      const { value, done } = source.next();
      left -= 1;
      more = !done && left >= 0;
      if (done || !more) break;
      const x = value[0] + JITTER * largest * dice.uniform(-1.0, 1.0);
      places.push([x, value[1] + JITTER * largest * dice.uniform(-1.0, 1.0)]);
    }
    const free = clear(places, largest);
    found.push(...places.filter(([x, y], i) => {
      return free[i] && isFree(x, y);
    }));
  }
  if (found.length < stream.count) {
    const key = scene.streams.length > 1 ? `stream[${n}].fill` : "stream.fill";
    throw new Fault(key, box, "box-full", { count: found.length, radius: largest });
  }
  const [vx, vy] = releaseVelocity(scene, n);
  const releases = found.slice(0, stream.count).map(([x, y]) => ({
    t: stream.start, x, y, vx, vy, carried: false, stream: n, kind,
  }));
  return { releases, radius };
}
