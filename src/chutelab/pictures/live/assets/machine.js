// `build`: what the keys of a scene mean as surfaces and releases, the same numbers as those of
// Python's `chutelab.machine`, to the last bit: the same operations in the same order.
import { upBelt } from "./belt.js";
import { draw } from "./releases.js";
import { clearOf, movedOut } from "./room.js";
import { Fault, met } from "./scene.js";
import { RADIANS, lengthOf, modulo, sinCos } from "./trig.js";

/** @typedef {import("./scene.js").Scene} Scene */
/** @typedef {import("./scene.js").Plate} Plate */
/** @typedef {import("./scene.js").Point} Point */
/** @typedef {import("./releases.js").Release} Release */

/**
 * @typedef {object} Segment
 * @property {number} x first end, m
 * @property {number} y
 * @property {number} tx unit vector towards the second end
 * @property {number} ty
 * @property {number} length m
 * @property {number} speed along it, m/s
 * @property {number} surface index of the surface it belongs to
 * @property {number} appears s
 * @property {number} vanishes s
 * @property {number[]} restitution by kind of particles
 * @property {number[]} friction
 * @property {[number, number, number, number]} ends x and y of both, m
 */

/**
 * @typedef {object} Arc
 * @property {number} x centre, m
 * @property {number} y
 * @property {number} radius m
 * @property {number} begin angle of the first end from the x axis, counterclockwise, rad
 * @property {number} extent how far it reaches from there, rad; 2π of a whole circle
 * @property {number} speed clockwise, m/s
 * @property {number} surface
 * @property {number} appears
 * @property {number} vanishes
 * @property {number[]} restitution
 * @property {number[]} friction
 */

/**
 * @typedef {object} Pulley
 * @property {number} radius
 * @property {number} speed
 * @property {number} incline rad
 * @property {number} surface
 * @property {number[]} restitution
 * @property {number[]} friction
 */

/**
 * @typedef {object} Machine
 * @property {string[]} surfaces names
 * @property {number} gravity
 * @property {number} landing index of the outgoing belt, -1 without one
 * @property {"landed" | "settled" | "time"} until
 * @property {number} endTime s
 * @property {number} dt s
 * @property {boolean} interact
 * @property {[number, number, number, number][]} exitBoxes left, right, bottom, top, m, of each
 * @property {Segment[]} segments
 * @property {Arc[]} arcs
 * @property {Pulley | null} pulley
 * @property {string[]} streams what tells them apart: names, or which of those without
 * @property {Release[]} releases
 * @property {number[]} radius of each particle, m
 * @property {number[]} mass kg
 * @property {number[]} inertia kg m²
 * @property {number[][]} pairRestitution of two kinds
 * @property {number[][]} pairFriction
 * @property {number[]} rolling by kind
 */

/**
 * One surface: polylines with a speed, bends (x, y, radius, begin, extent, speed), and when they
 * are there.
 * @typedef {object} Part
 * @property {string} name
 * @property {{points: Point[], speed: number}[]} lines
 * @property {[number, number, number, number, number, number][]} bends
 * @property {[number, number][]} gates
 */

/** m of plate below the pivot where there is no outgoing belt to stop short of. */
const REACH_WITHOUT_BELT = 2.0;

/** m of a further plate below its pivot. */
const REACH_HANGING = 0.5;

/** m, and radii, that the plate's lower end stays above the outgoing belt. */
const CLEARANCE = 0.05;
const CLEARANCE_RADII = 3.0;

/** m below the lowest surface, or outside the box of all without gravity, where a track ends. */
export const EXIT_MARGIN = 1.0;

/** @type {[number, number][]} */
const ALWAYS = [[-Infinity, Infinity]];

/**
 * Builds the machine of a scene.
 * @param {Scene} scene
 * @returns {Machine}
 * @throws {Fault} if the geometry contradicts itself
 */
export function build(scene) {
  const parts = surfaceParts(scene);
  const names = parts.map((part) => part.name);
  const every = scene.particles.map((_, kind) => kind);
  const values = names.map((name) => {
    const pairs = every.map((kind) => met(scene, kind, name));
    return {
      restitution: pairs.map(([bounce]) => bounce), friction: pairs.map(([, grip]) => grip),
    };
  });
  /** @type {Segment[]} */
  const segments = [];
  /** @type {Arc[]} */
  const arcs = [];
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
 * @param {Scene} scene
 * @returns {Part[]}
 * @throws {Fault} if the plate has no length
 */
export function surfaceParts(scene) {
  const hanging = scene.plates.filter(({ pivot }) => pivot !== undefined);
  return [...beltsOf(scene), ...hanging.map(hangingPlate), ...scene.conveyor.map(conveyorPart),
    ...scene.surface.map(surfacePart)];
}

/**
 * Returns mass and moment of inertia of each particle: with the cube and the fifth power of size.
 * @param {Scene} scene
 * @param {Release[]} releases
 * @param {number[]} radius
 */
function heft(scene, releases, radius) {
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

/**
 * @param {Point} start
 * @param {Point} end
 */
function segmentBetween([x, y], [x1, y1]) {
  const dx = x1 - x;
  const dy = y1 - y;
  const length = lengthOf(dx, dy);
  /** @type {[number, number, number, number]} */
  const ends = [x, y, x1, y1];
  return { x, y, tx: dx / length, ty: dy / length, length, ends };
}

/**
 * Lays the belts and the damping plate.
 * @param {Scene} scene
 * @returns {Part[]}
 */
function beltsOf(scene) {
  const { incoming: belt, outgoing: out } = scene;
  if (belt === null) return [];
  const top = belt.pulley_radius;
  const [cosine, sine] = upBelt(scene);
  const x = -top * sine;
  const y = top * cosine;
  /** @type {Point[]} */
  const ends = [[x - belt.length * cosine, y - belt.length * sine], [x, y]];
  const parts = [straightPart("incoming", ends, belt.speed)];
  const height = out === null ? null : top - out.drop;
  const plate = scene.plates.find(({ pivot }) => pivot === undefined);
  if (plate !== undefined) {
    const turn = sinCos(plate.angle_deg * RADIANS);
    const reach = reachBelow(scene, plate);
    if (reach + plate.above <= 0.0) throw new Fault("plate.above", plate.above, "no-length");
    const pivot = /** @type {Point} */ ([top + plate.distance, plate.pivot_height]);
    parts.push(straightPart("plate", plateEnds(pivot, turn, reach, plate.above), 0.0));
  }
  if (out !== null && height !== null) {
    parts.push(straightPart("outgoing", [[out.start, height], [out.start + out.length, height]],
      out.speed));
  }
  return parts;
}

/**
 * Returns how far the damping plate reaches below its pivot, m.
 * @param {Scene} scene
 * @param {Plate} plate
 */
export function reachBelow(scene, plate) {
  if (plate.below !== undefined) return plate.below;
  const { incoming: belt, outgoing: out } = scene;
  if (belt === null || out === null) return REACH_WITHOUT_BELT;
  const { radius } = scene.particles[scene.kinds[0]];
  const height = belt.pulley_radius - out.drop;
  const lowest = height + Math.max(CLEARANCE, CLEARANCE_RADII * radius);
  const [, cosine] = sinCos(plate.angle_deg * RADIANS);
  return Math.max((plate.pivot_height - lowest) / cosine, 0.0);
}

/**
 * @param {string} name
 * @param {Point[]} points
 * @param {number} speed
 * @returns {Part}
 */
function straightPart(name, points, speed) {
  return { name, lines: [{ points, speed }], bends: [], gates: ALWAYS };
}

/**
 * Returns the ends of a plate, the lower one first, so that its struck face is on the left.
 * @param {Point} pivot
 * @param {[number, number]} turn sine and cosine of its angle from upright
 * @param {number} below m
 * @param {number} above m
 * @returns {Point[]}
 */
function plateEnds([x, y], [sine, cosine], below, above) {
  return [-below, above].map((reach) => [x - reach * sine, y + reach * cosine]);
}

/**
 * @param {Plate} plate
 * @returns {Part}
 */
function hangingPlate(plate) {
  const turn = sinCos(plate.angle_deg * RADIANS);
  const pivot = /** @type {Point} */ (plate.pivot);
  const ends = plateEnds(pivot, turn, plate.below ?? REACH_HANGING, plate.above);
  return straightPart(String(plate.name), ends, 0.0);
}

/**
 * Lays a belt round two pulleys: forward on top, which is clockwise to the right, and back.
 * @param {import("./scene.js").Conveyor} belt
 * @returns {Part}
 */
function conveyorPart(belt) {
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

/**
 * Lays a free surface, with its copies and its gate.
 * @param {import("./scene.js").Surface} one
 * @returns {Part}
 */
function surfacePart(one) {
  /** @type {Point[]} */
  let shifts = [[0.0, 0.0]];
  for (const [count, dx, dy] of one.repeat) {
    const copies = Array.from({ length: count }, (_, n) => n);
    shifts = copies.flatMap((n) => shifts.map(([x, y]) => {
      return /** @type {Point} */ ([x + n * dx, y + n * dy]);
    }));
  }
  const { opens_at: opens, closes_at: closes, center, radius } = one;
  /** @type {[number, number][]} */
  const gates = opens !== undefined && closes !== undefined && opens < closes
    ? [[-Infinity, opens], [closes, Infinity]]
    : [[closes ?? -Infinity, opens ?? Infinity]];
  if (center === undefined) {
    const points = one.points ?? [];
    const lines = shifts.map(([a, b]) => {
      const moved = points.map(([x, y]) => /** @type {Point} */ ([x + a, y + b]));
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
 *
 * With gravity only the bottom is finite: what flies up comes back. Where particles do not meet the
 * box of each holds its own release, else those of all.
 * @param {Scene} scene
 * @param {Segment[]} segments
 * @param {Arc[]} arcs
 * @param {Release[]} releases
 * @returns {[number, number, number, number][]}
 */
function exitBoxes(scene, segments, arcs, releases) {
  const wheel = scene.incoming === null ? -Infinity : scene.incoming.pulley_radius;
  let [left, right, bottom, top] = [-wheel, wheel, -wheel, wheel];
  const hold = (/** @type {number} */ x, /** @type {number} */ y) => {
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
