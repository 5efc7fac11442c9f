// `build`: what the keys of a scene mean as surfaces and releases, the same numbers as those of
// Python's `chutelab.machine`, to the last bit: the same operations in the same order.
import { upBelt } from "./belt.ts";
import { draw, type Release } from "./releases.ts";
import { clearOf, movedOut } from "./room.ts";
import {
  Fault, met, type Scene, type Plate, type Point, type Conveyor, type Surface,
} from "./scene.ts";
import { RADIANS, lengthOf, modulo, sinCos } from "./trig.ts";

export interface Segment {
  x: number; // first end, m
  y: number;
  tx: number; // unit vector towards the second end
  ty: number;
  length: number; // m
  speed: number; // along it, m/s
  surface: number; // index of the surface it belongs to
  appears: number; // s
  vanishes: number; // s
  restitution: number[]; // by kind of particles
  friction: number[];
  ends: [number, number, number, number]; // x and y of both, m
}

export interface Arc {
  x: number; // centre, m
  y: number;
  radius: number; // m
  begin: number; // angle of the first end from the x axis, counterclockwise, rad
  extent: number; // how far it reaches from there, rad; 2π of a whole circle
  speed: number; // clockwise, m/s
  surface: number;
  appears: number;
  vanishes: number;
  restitution: number[];
  friction: number[];
}

interface Pulley {
  radius: number;
  speed: number;
  incline: number; // rad
  surface: number;
  restitution: number[];
  friction: number[];
}

export interface Machine {
  surfaces: string[]; // names
  gravity: number;
  landing: number; // index of the outgoing belt, -1 without one
  until: "landed" | "settled" | "time";
  endTime: number; // s
  dt: number; // s
  interact: boolean;
  exitBoxes: [number, number, number, number][]; // left, right, bottom, top, m, of each
  segments: Segment[];
  arcs: Arc[];
  pulley: Pulley | null;
  streams: string[]; // what tells them apart: names, or which of those without
  releases: Release[];
  radius: number[]; // of each particle, m
  mass: number[]; // kg
  inertia: number[]; // kg m²
  pairRestitution: number[][]; // of two kinds
  pairFriction: number[][];
  rolling: number[]; // by kind
}

/** One surface: polylines with a speed, bends (x, y, radius, begin, extent, speed), and when
 * they are there. */
interface Part {
  name: string;
  lines: { points: Point[], speed: number }[];
  bends: [number, number, number, number, number, number][];
  gates: [number, number][];
}

/** m of plate below the pivot where there is no outgoing belt to stop short of. */
const REACH_WITHOUT_BELT = 2.0;

/** m of a further plate below its pivot. */
const REACH_HANGING = 0.5;

/** m, and radii, that the plate's lower end stays above the outgoing belt. */
const CLEARANCE = 0.05;
const CLEARANCE_RADII = 3.0;

/** m below the lowest surface, or outside the box of all without gravity, where a track ends. */
export const EXIT_MARGIN = 1.0;

const ALWAYS: [number, number][] = [[-Infinity, Infinity]];

/**
 * Builds the machine of a scene.
 * @throws {Fault} if the geometry contradicts itself
 */
export function build(scene: Scene): Machine {
  const parts = surfaceParts(scene);
  const names = parts.map((part) => part.name);
  const every = scene.particles.map((_, kind) => kind);
  const values = names.map((name) => {
    const pairs = every.map((kind) => met(scene, kind, name));
    return {
      restitution: pairs.map(([bounce]) => bounce), friction: pairs.map(([, grip]) => grip),
    };
  });
  const segments: Segment[] = [];
  const arcs: Arc[] = [];
  parts.forEach((part, surface) => {
    for (const [appears, vanishes] of part.gates) {
      const common = { surface, appears, vanishes, ...values[surface] };
      for (const { points, speed } of part.lines) {
        points.slice(1).forEach((end, n) => {
          segments.push({ ...segmentBetween(points[n], end), speed, ...common });
        });
      }
      for (const [x, y, radius, begin, extent, speed] of part.bends) {
        arcs.push({ x, y, radius, begin, extent, speed, ...common });
      }
    }
  });
  const room = { segments, arcs, names };
  const drawn = draw(scene, (places, radius) => clearOf(scene, room, places, radius));
  const releases = movedOut(scene, room, drawn.releases, drawn.radius);
  const { incoming: belt, run, particles } = scene;
  let last = -Infinity, unnamed = 0;
  for (const release of releases) last = Math.max(last, release.t);
  const bound = last + run.max_time;
  const pairs = every.map((a) => every.map((b) => met(scene, a, b)));
  const radius = drawn.radius;
  return {
    surfaces: names,
    gravity: scene.gravity,
    landing: names.indexOf("outgoing"),
    until: typeof run.until === "string" ? run.until : "time",
    endTime: typeof run.until === "string" ? bound : Math.min(bound, run.until),
    dt: run.dt,
    interact: scene.crowded,
    exitBoxes: exitBoxes(scene, segments, arcs, releases),
    segments,
    arcs,
    pulley: belt === null ? null : {
      radius: belt.pulley_radius, speed: belt.speed, incline: belt.incline_deg * RADIANS,
      surface: 0, ...values[0],
    },
    streams: scene.streams.map(({ name }) => name ?? `#${(unnamed += 1)}`),
    releases,
    radius,
    ...heft(scene, releases, radius),
    pairRestitution: pairs.map((row) => row.map(([restitution]) => restitution)),
    pairFriction: pairs.map((row) => row.map(([, friction]) => friction)),
    rolling: particles.map((kind) => kind.rolling_friction),
  };
}

/**
 * Returns all surfaces, in the order of the ledger.
 * @throws {Fault} if the plate has no length
 */
function surfaceParts(scene: Scene): Part[] {
  const hanging = scene.plates.filter(({ pivot }) => pivot !== undefined);
  return [...beltsOf(scene), ...hanging.map(hangingPlate), ...scene.conveyor.map(conveyorPart),
    ...scene.surface.map(surfacePart)];
}

/** Returns mass and moment of inertia of each particle: with the cube and the fifth power of
 * size. */
function heft(scene: Scene, releases: Release[], radius: number[]) {
  const mass = [];
  const inertia = [];
  for (const [i, { kind }] of releases.entries()) {
    const one = scene.particles[kind];
    const moment = !one.spin ? 0.0 : one.shape === "sphere" ? 0.4 : 0.5;
    const size = radius[i] / one.radius;
    const square = size * size;
    const cube = square * size;
    mass.push(one.mass * cube);
    inertia.push(moment * one.mass * (one.radius * one.radius) * (cube * square));
  }
  return { mass, inertia };
}

function segmentBetween([x, y]: Point, [x1, y1]: Point) {
  const dx = x1 - x;
  const dy = y1 - y;
  const length = lengthOf(dx, dy);
  const ends: [number, number, number, number] = [x, y, x1, y1];
  return { x, y, tx: dx / length, ty: dy / length, length, ends };
}

/** Lays the belts and the damping plate. */
function beltsOf(scene: Scene): Part[] {
  const { incoming: belt, outgoing: out } = scene;
  if (belt === null) return [];
  const top = belt.pulley_radius;
  const [cosine, sine] = upBelt(scene);
  const x = -top * sine;
  const y = top * cosine;
  const ends: Point[] = [[x - belt.length * cosine, y - belt.length * sine], [x, y]];
  const parts = [straightPart("incoming", ends, belt.speed)];
  const height = out === null ? null : top - out.drop;
  const plate = scene.plates.find(({ pivot }) => pivot === undefined);
  if (plate !== undefined) {
    const turn = sinCos(plate.angle_deg * RADIANS);
    const reach = reachBelow(scene, plate);
    if (reach + plate.above <= 0.0) throw new Fault("plate.above", plate.above, "no-length");
    const pivot: Point = [top + plate.distance, plate.pivot_height];
    parts.push(straightPart("plate", plateEnds(pivot, turn, reach, plate.above), 0.0));
  }
  if (out !== null && height !== null) {
    parts.push(straightPart("outgoing", [[out.start, height], [out.start + out.length, height]],
      out.speed));
  }
  return parts;
}

/** Returns how far the damping plate reaches below its pivot, m. */
function reachBelow(scene: Scene, plate: Plate) {
  if (plate.below !== undefined) return plate.below;
  const { incoming: belt, outgoing: out } = scene;
  if (belt === null || out === null) return REACH_WITHOUT_BELT;
  const { radius } = scene.particles[scene.kinds[0]];
  const height = belt.pulley_radius - out.drop;
  const lowest = height + Math.max(CLEARANCE, CLEARANCE_RADII * radius);
  const [, cosine] = sinCos(plate.angle_deg * RADIANS);
  return Math.max((plate.pivot_height - lowest) / cosine, 0.0);
}

function straightPart(name: string, points: Point[], speed: number): Part {
  return { name, lines: [{ points, speed }], bends: [], gates: ALWAYS };
}

/**
 * Returns the ends of a plate, the lower one first, so that its struck face is on the left.
 * @param turn sine and cosine of its angle from upright
 * @param below m
 * @param above m
 */
function plateEnds(
  [x, y]: Point, [sine, cosine]: [number, number], below: number, above: number,
): Point[] {
  return [-below, above].map((reach) => [x - reach * sine, y + reach * cosine]);
}

function hangingPlate(plate: Plate): Part {
  const turn = sinCos(plate.angle_deg * RADIANS);
  const pivot = plate.pivot as Point;
  const ends = plateEnds(pivot, turn, plate.below ?? REACH_HANGING, plate.above);
  return straightPart(String(plate.name), ends, 0.0);
}

/** Lays a belt round two pulleys: forward on top, which is clockwise to the right, and back. */
function conveyorPart(belt: Conveyor): Part {
  const [x0, y0] = belt.from;
  const [x1, y1] = belt.to;
  const r = belt.pulley_radius;
  const way = lengthOf(x1 - x0, y1 - y0);
  const dx = (x1 - x0) / way;
  const dy = (y1 - y0) / way;
  const clockwise = dx >= 0.0 ? 1.0 : -1.0;
  const nx = -clockwise * dy * r;
  const ny = clockwise * dx * r;
  const speed = clockwise * belt.speed;
  return {
    name: belt.name,
    lines: [
      { points: [[x0 + nx, y0 + ny], [x1 + nx, y1 + ny]], speed: belt.speed },
      { points: [[x1 - nx, y1 - ny], [x0 - nx, y0 - ny]], speed: belt.speed },
    ],
    bends: [belt.from, belt.to].map(([x, y]) => [x, y, r, 0.0, 2.0 * Math.PI, speed]),
    gates: ALWAYS,
  };
}

/** Lays a free surface, with its copies and its gate. */
function surfacePart(one: Surface): Part {
  let shifts: Point[] = [[0.0, 0.0]];
  for (const [count, dx, dy] of one.repeat) {
    const copies = Array.from({ length: count }, (_, n) => n);
    shifts = copies.flatMap((n) => shifts.map(([x, y]) => {
      return [x + n * dx, y + n * dy] as Point;
    }));
  }
  const { opens_at: opens, closes_at: closes, center, radius } = one;
  const gates: [number, number][] = opens !== undefined && closes !== undefined && opens < closes
    ? [[-Infinity, opens], [closes, Infinity]]
    : [[closes ?? -Infinity, opens ?? Infinity]];
  if (center === undefined) {
    const points = one.points ?? [];
    const lines = shifts.map(([a, b]) => {
      const moved = points.map(([x, y]) => [x + a, y + b] as Point);
      return { points: moved, speed: one.speed };
    });
    return { name: one.name, lines, bends: [], gates };
  }
  const first = one.from_deg * RADIANS;
  const last = one.to_deg * RADIANS;
  const speed = one.to_deg < one.from_deg ? one.speed : -one.speed;
  return {
    name: one.name,
    lines: [],
    bends: shifts.map(([a, b]) => [center[0] + a, center[1] + b, radius, Math.min(first, last),
      Math.abs(last - first), speed]),
    gates,
  };
}

/**
 * Returns left, right, bottom and top beyond which each particle has left the scene.
 * With gravity only the bottom is finite: what flies up comes back. Where particles do not meet the
 * box of each holds its own release, else those of all.
 */
function exitBoxes(
  scene: Scene, segments: Segment[], arcs: Arc[], releases: Release[],
): [number, number, number, number][] {
  const wheel = scene.incoming === null ? -Infinity : scene.incoming.pulley_radius;
  let [left, right, bottom, top] = [-wheel, wheel, -wheel, wheel];
  const hold = (x: number, y: number) => {
    left = Math.min(left, x);
    right = Math.max(right, x);
    bottom = Math.min(bottom, y);
    top = Math.max(top, y);
  };
  for (const { x, y, tx, ty, length } of segments) {
    hold(x, y);
    hold(x + length * tx, y + length * ty);
  }
  for (const { x, y, radius, begin, extent } of arcs) {
    const angles = [begin, begin + extent];
    for (let n = 0; n < 4; n++) {
      const reach = modulo(0.5 * Math.PI * n - begin, 2.0 * Math.PI);
      if (reach <= extent) angles.push(begin + reach);
    }
    for (const angle of angles) {
      const [sine, cosine] = sinCos(angle);
      hold(x + radius * cosine, y + radius * sine);
    }
  }
  if (scene.crowded) releases.forEach(({ x, y }) => hold(x, y));
  return releases.map(({ x, y }) => scene.gravity
    ? [-Infinity, Infinity, Math.min(bottom, y) - EXIT_MARGIN, Infinity]
    : [Math.min(left, x) - EXIT_MARGIN, Math.max(right, x) + EXIT_MARGIN,
      Math.min(bottom, y) - EXIT_MARGIN, Math.max(top, y) + EXIT_MARGIN]);
}
