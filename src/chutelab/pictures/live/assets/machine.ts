// `build`: a scene as a machine, the same numbers as those of Python's `chutelab.machine`, to the
// last bit: the core lays the surfaces and draws the releases.
import { lay, memory, type Mover } from "./plan.ts";
import { draw, type Release } from "./releases.ts";
import {
  Fault, cohesionOf, met, passes, polygonMoment, triggersOf, type Joint, type Point, type Scene,
} from "./scene.ts";
import { RADIANS, sinCos } from "./trig.ts";

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
  one_sided: number; // 1: solid on the left only (arc: outside); -1: on the other side; 0: on both
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
  one_sided: number;
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

/** Action of a surface when another one is touched for the first time */
export interface Trigger {
  surface: number;
  doing: "opens" | "closes" | "starts";
  by: number; // the surface that is touched
}

/** A joint with its numbers, m, N/m and N s/m; `other` is -1 if it has a fixed end */
export type Tied = Pick<Joint, "kind" | "particle" | "from"> & { other: number, length: number,
  stiffness: number, damper: number };

export interface Machine {
  surfaces: string[]; // names
  gravity: number;
  tilt: number; // rad; angle of gravity from straight down
  up: [number, number]; // against gravity
  ground: number; // m; height from which others count, see `groundOf`
  air: number; // kg/m³, density of still air; 0 without
  landing: number; // index of the outgoing belt, -1 without one
  until: "landed" | "settled" | "time";
  endTime: number; // s
  chosen: number; // s; the usual step if the core chooses its steps, else 0
  dt: number; // s; the longest
  interact: boolean;
  loads: number; // s; width of the bins of loads, 0 without loads
  segments: Segment[];
  arcs: Arc[];
  movers: Mover[];
  triggers: Trigger[];
  joints: Tied[];
  pulley: Pulley | null;
  streams: string[]; // their names, or numbers of those without
  releases: Release[];
  radius: number[]; // of each particle, m
  mass: number[]; // kg
  inertia: number[]; // kg m²
  outlines: Point[][]; // by kind: corners of boxes and polygons, m; empty if round
  pairRestitution: number[][]; // of two kinds
  pairFriction: number[][];
  cohesion: number[][]; // N; cohesion of each kind with each kind, and with each surface
  rolling: number[]; // by kind
  falls: number[]; // s/m; inverse of the speed up to which restitution is constant
}

/** m/s² */
const EARTH = 9.81;

/** Number of particles from which on a crowd whose scene has no `run.dt` takes longer steps ... */
const MANY = 100;

/** ... up to this, s on Earth. */
const MOST_STEP = 2e-3;

/** Whether a surface moves by a drive, not only on a hinge. */
export const isDriven = ({ movers }: Machine) =>
  movers.some(({ inertia, motor }) => !inertia || motor.some(Boolean));

/** Whether a drive, or a belt, does work. */
export const isPaid = (machine: Machine) =>
  isDriven(machine) || [...machine.segments, ...machine.arcs].some(({ speed }) => speed !== 0);

/**
 * Builds the machine of a scene.
 * @throws {Fault} if the geometry contradicts itself
 */
export function build(scene: Scene): Machine {
  const names = surfaceNames(scene);
  const every = scene.particles.map((_, kind) => kind);
  const values = names.map((name) => {
    const pairs = every.map((kind) => met(scene, kind, name));
    return {
      restitution: pairs.map(([bounce]) => bounce), friction: pairs.map(([, grip]) => grip),
    };
  });
  const laid = lay(scene, names);
  for (const mover of laid.movers) weigh(mover, names[mover.surface]);
  const segments: Segment[] = laid.segments.map(({ start, end, tangent, ...own }) => ({
    ...own, x: start[0], y: start[1], tx: tangent[0], ty: tangent[1], ends: [...start, ...end],
    ...values[own.surface],
  }));
  const arcs: Arc[] = laid.arcs.map(({ center, ...own }) => ({
    ...own, x: center[0], y: center[1], ...values[own.surface],
  }));
  const { releases, radius } = draw(scene, names);
  const { incoming: belt, run, particles } = scene;
  let last = -Infinity, unnamed = 0;
  for (const release of releases) last = Math.max(last, release.t);
  const bound = last + run.max_time;
  const tilt = scene.gravity_deg * RADIANS, [sin, cos] = sinCos(tilt);
  const up: [number, number] = [-sin, cos];
  const pairs = every.map((a) => every.map((b) => met(scene, a, b)));
  // Boxes all run at once, even if they do not interact.
  const outlines = particles.map(({ outline }) => outline);
  const isAngular = outlines.some(({ length }) => length > 0);
  const isAlone = !scene.crowded && isAngular;
  const pace = scene.gravity > 0 ? Math.sqrt(scene.gravity / EARTH) : 1;
  const isHung = scene.joints.length > 0 || laid.movers.some(({ inertia }) => inertia > 0);
  const isChosen = scene.crowded && scene.count >= MANY && !isHung && !run.is_told;
  return waiting({
    surfaces: names,
    gravity: scene.gravity,
    tilt,
    up,
    ground: groundOf(releases, isAngular ? [0] : radius, up),
    air: scene.air_density,
    landing: names.indexOf("outgoing"),
    until: typeof run.until === "string" ? run.until : "time",
    endTime: typeof run.until === "string" ? bound : Math.min(bound, run.until),
    chosen: isChosen ? run.dt / pace : 0, dt: isChosen ? MOST_STEP / pace : run.dt,
    interact: scene.crowded || isAlone,
    loads: run.loads ?? 0,
    segments,
    arcs,
    movers: laid.movers,
    joints: joined(scene, releases),
    triggers: triggersOf(scene).map(([name, doing, by]) =>
      ({ surface: names.indexOf(name), doing, by: names.indexOf(by) })),
    pulley: belt === null ? null : {
      radius: belt.pulley_radius, speed: belt.speed, incline: belt.incline_deg * RADIANS,
      surface: 0, ...values[0],
    },
    streams: scene.streams.map(({ name }) => name ?? `#${(unnamed += 1)}`),
    releases,
    radius,
    ...heft(scene, releases, radius),
    outlines,
    pairRestitution: pairs.map((row, a) => row.map(([restitution], b) =>
      (isAlone || passes(scene, a, b) ? PASSES : restitution))),
    pairFriction: pairs.map((row) => row.map(([, friction]) => friction)),
    cohesion: every.map((kind) => [...every, ...names].map((other) =>
      cohesionOf(scene, kind, other))),
    rolling: particles.map((kind) => kind.rolling_friction),
    falls: particles.map(({ restitution_speed: v }) => v === undefined ? 0.0 : 1.0 / v),
  });
}

/** Returns the height, m, at which the smallest particle lies at the lowest place that is still in
 * the scene, or is released, if that is lower or there are no surfaces. Boxes have no ends on sides
 * to which gravity does not pull. */
function groundOf(releases: Release[], radius: number[], up: [number, number]) {
  const { EXIT_MARGIN: margin } = memory().layout.constants;
  const least = radius.reduce((one, other) => Math.min(one, other));
  return releases.reduce((ground, { x, y, exitBox }) => Math.min(ground, up[0] * x + up[1] * y,
    exitBox.some(isFinite) ? up.reduce((height, share, n) => {
      const end = share > 0 ? exitBox[n] + margin : exitBox[n + 2] - margin;
      return isFinite(end) ? height + share * end : height;
    }, least) : Infinity), Infinity);
}

/** Restitution that marks two kinds that pass through each other. */
export const PASSES = -1.0;

/** Sets the times of triggers, s; Infinity for those that have not acted. */
export function actAt({ triggers, segments, arcs, movers }: Machine, times: number[]) {
  triggers.forEach(({ surface, doing }, n) => {
    const own = <T extends { surface: number }>(all: T[]) =>
      all.filter((one) => one.surface === surface);
    if (doing === "starts") for (const mover of own(movers)) mover.begins = times[n];
    else {
      const clock = doing === "opens" ? "vanishes" : "appears";
      for (const piece of [...own<Segment | Arc>(segments), ...own(arcs)]) piece[clock] = times[n];
    }
  });
}

/** Returns a machine in which nothing has been touched yet. */
export function waiting(machine: Machine): Machine {
  actAt(machine, machine.triggers.map(() => Infinity));
  return machine;
}

/** rad/s; the shortest time of a hinge is at least its inverse, as steps have to be shorter. */
const SWIFTEST = 1e5;

/** @throws {Fault} if a hinged surface has an impossible inertia, or is too stiff */
function weigh({ inertia, mass, moment: [x, y], spring, damper }: Mover, name: string) {
  if (!inertia) return;
  const least = mass > 0 ? (x * x + y * y) / mass : 0;
  const stiff = Math.max(spring / SWIFTEST ** 2, damper / SWIFTEST);
  const key = `${name}.inertia`;
  if (inertia < (1 - 1e-9) * least) throw new Fault(key, inertia, "least-inertia", { least });
  if (inertia < stiff) throw new Fault(key, inertia, "stiff", { least: stiff });
}

/** Share of its length by which a string may be too short, by rounding. */
const TAUT = 1e-9;

/** m; least length of a string or rod. */
const NEAR = 1e-9;

/**
 * Returns the joints, each as long as it is at the release unless its length is given.
 * @throws {Fault} if a string is shorter than that, or it or a rod has no length
 */
function joined({ joints }: Scene, releases: Release[]): Machine["joints"] {
  return joints.map((joint) => {
    const { kind, particle, over, from = over, other = -1, length, given, ...spring } = joint;
    const own = releases[particle], far = releases[other];
    const away = (x: number, y: number) => Math.sqrt(x * x + y * y);
    const distance = away(own.x - (from ? from[0] : far.x), own.y - (from ? from[1] : far.y))
      + (over ? away(far.x - over[0], far.y - over[1]) : 0);
    const long = length ?? distance;
    const n = joints.filter((one) => one.kind === kind).findIndex((one) => one.given === given);
    if (kind === "string" && distance > (1 + TAUT) * long) {
      throw new Fault(`string[${n}].length`, length, "too-short", { least: distance });
    }
    if (long < NEAR && (kind === "string" || kind === "rod")) {
      const [key, place] = joint.from ? ["from", joint.from] : ["other", other];
      throw new Fault(`${kind}[${n}].${key}`, place, "one-place");
    }
    const { stiffness = 0, damper = 0 } = spring;
    return { kind, particle, from, other, length: long, stiffness, damper };
  });
}

/** The corners of a particle at a place and angle, m; none if it is round. */
export function cornersOf(
  { outlines, releases }: Machine, i: number, { x, y }: { x: number, y: number }, angle: number,
): Point[] {
  const [c, s] = [Math.cos(angle), Math.sin(angle)];
  return (outlines[releases[i]?.kind ?? 0] ?? []).map(([u, v]) =>
    [x + c * u - s * v, y + s * u + c * v]);
}

/** Whether a place is inside convex corners, counterclockwise. */
export const isInside = (corners: Point[], [x, y]: Point) => corners.every(([a, b], n) => {
  const [u, v] = corners[(n + 1) % corners.length];
  return (u - a) * (y - b) - (v - b) * (x - a) >= 0;
});

/** Returns the names of all surfaces, in the order of the ledger. */
function surfaceNames({ incoming, plates, outgoing, conveyor, surface }: Scene) {
  const hanging = plates.filter(({ pivot }) => pivot !== undefined);
  return [
    ...(incoming ? ["incoming"] : []), ...(hanging.length < plates.length ? ["plate"] : []),
    ...(outgoing ? ["outgoing"] : []), ...[...hanging, ...conveyor, ...surface].map(({ name }) =>
      String(name)),
  ];
}

/** Returns mass and moment of inertia of each particle, proportional to the cube and fifth power of
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
    const turning = !one.outline.length ? moment * one.mass * (one.radius * one.radius)
      : one.spin ? one.mass * polygonMoment(one.outline) : 0.0;
    inertia.push(turning * (cube * square));
  }
  return { mass, inertia };
}
