// `predict`: the closed form's answer for a scene, or the reason why it has none.
//
// The finite machine is laid over the numbers of `transfer`: what is touched before the plate,
// whether the plate is there, what is touched between rebound and landing, whether the belt is
// there. As Python's `theory/prediction.py`, but for belts with a coefficient of friction.
import { reachBelow, surfaceParts, type Part } from "./machine.ts";
import {
  cornerTime, firstInFlight, firstOnPulley, horizonOf, overlapped, placeAt, ringTimes, type Flight,
  type Line,
} from "./obstacles.ts";
import { met, slices, type Incoming, type Plate, type Point, type Scene } from "./scene.ts";
import {
  because, cutFrom, transfer, unanswered, type Reason, type Stage, type Transfer,
} from "./transfer.ts";
import { RADIANS, sinCos } from "./trig.ts";

/** The first stage that is not reached, and why */
type Trouble = [Stage, Reason] | null;

/** m; a release this close to the riding height differs from it by rounding only. */
const RIDES = 1e-12;

function product(a: Point, b: Point) {
  return a[0] * b[0] + a[1] * b[1];
}

/**
 * Predicts particle 0 of a scene in closed form.
 * @param scene one that can be built
 * @returns NaN from the stage on that is not reached as the equations assume
 */
export function predict(scene: Scene): Transfer {
  const { incoming: belt, outgoing: out } = scene;
  const plate = scene.plates.find(({ pivot }) => pivot === undefined);
  if (belt === null || plate === undefined) {
    const missing = belt === null ? "no-incoming" : "no-plate";
    return cutFrom(unanswered(), "separation", because("outside", missing));
  }
  const outside = outsideOf(scene, belt);
  if (outside) return cutFrom(unanswered(), "separation", because("outside", outside));
  const found = unboundedTransfer(scene, belt, plate);
  if (Number.isNaN(found.numbers.phi1)) return found;
  const course = new Course(scene, belt, plate, found);
  let trouble = course.onTheRide() ?? course.beforeThePlate();
  if (trouble === null && out === null && Number.isFinite(found.numbers.v2r)) {
    trouble = ["landing", because("outside", "no-outgoing")];
  }
  if (trouble === null && (found.reason === null || found.reason.claim === "misses")) {
    trouble = course.afterTheRebound();
  }
  return trouble === null ? found : cutFrom(found, ...trouble);
}

/** Returns what the equations say if nothing else were in the way. */
function unboundedTransfer(scene: Scene, belt: Incoming, plate: Plate) {
  const kind = scene.kinds[0];
  const own = scene.particles[kind];
  const { outgoing: out } = scene;
  const [restitution, plateFriction] = met(scene, kind, "plate");
  const found = (drop: number, beltSpeed: number) => transfer({
    speed: belt.speed, pulleyRadius: belt.pulley_radius, distance: plate.distance,
    angle: plate.angle_deg * RADIANS, pivotHeight: plate.pivot_height, restitution, drop, beltSpeed,
    particleRadius: own.radius, mass: own.mass, gravity: scene.gravity, spin: own.spin,
    inertia: own.shape === "sphere" ? 0.4 : 0.5, incline: belt.incline_deg * RADIANS,
    plateFriction, unboundedPlate: false,
    interval: 1.0 / (scene.streams[0].rate * slices(scene.streams[0], own)),
  });
  if (out === null) return found(0.0, 0.0);
  const { phi1, y2 } = found(0.0, out.speed).numbers;
  // Eq. (16) solved for d2; a belt above the impact is found later
  const sunk = (belt.pulley_radius + own.radius) * (1.0 - sinCos(phi1)[1]) + y2;
  return found(Math.max(out.drop - sunk, 0.0), out.speed);
}

/** Returns what makes the scene another problem than the paper's, "" if nothing does. */
function outsideOf(scene: Scene, belt: Incoming) {
  const [stream] = scene.streams;
  const own = scene.particles[scene.kinds[0]];
  if (belt.friction !== "adhesion") return "belt-friction";
  if (own.spin && own.rolling_friction > 0.0) return "rolling-friction";
  if (stream.fill !== undefined || stream.to !== undefined) return "no-point";
  const [sin, cos] = sinCos(belt.incline_deg * RADIANS);
  if (stream.at !== undefined) {
    const [x, y] = stream.at;
    const above = y * cos - x * sin - belt.pulley_radius - own.radius;
    const along = x * cos + y * sin;
    if (Math.abs(above) > RIDES || !(-belt.length <= along && along <= 0.0)) return "off-belt";
  }
  if (stream.velocity !== undefined) {
    const [vx, vy] = stream.velocity;
    if (vx !== belt.speed * cos || vy !== belt.speed * sin) return "other-velocity";
  }
  return scene.crowded ? "interact" : "";
}

/** Particle 0 on its way; places and lengths are world coordinates, m. */
class Course {
  radius;
  rideRadius;
  incline;
  sine;
  up: Point;
  normal: Point;
  pivot: Point;
  low;
  high;
  separation: Flight;
  impact: Point;
  rebounded: Flight;
  beltLine;
  lines;
  bends;
  gates;

  constructor(
    readonly scene: Scene, readonly belt: Incoming, plate: Plate, readonly found: Transfer,
  ) {
    const { phi1, v1, x2, y2, v2r, phi2r } = found.numbers;
    this.radius = scene.particles[scene.kinds[0]].radius;
    this.rideRadius = belt.pulley_radius + this.radius;
    this.incline = belt.incline_deg * RADIANS;
    const [sin, cos] = sinCos(plate.angle_deg * RADIANS);
    this.sine = sin;
    // Up along the plate, and out of its struck face.
    this.up = [-sin, cos];
    this.normal = [-cos, -sin];
    this.pivot = [belt.pulley_radius + plate.distance, plate.pivot_height];
    this.low = -reachBelow(scene, plate);
    this.high = plate.above;

    const [sine, cosine] = sinCos(phi1);
    const { gravity } = scene;
    const [x, y] = [this.rideRadius * sine, this.rideRadius * cosine];
    this.separation = { x, y, vx: v1 * cosine, vy: v1 * -sine, gravity };
    // The centre on the plate's line; NaN if it never gets there.
    this.impact = [x + x2, y - y2];
    const [out, on] = sinCos(phi2r);
    const [away, down] = [v2r * out, v2r * on];
    this.rebounded = {
      x: this.impact[0], y: this.impact[1], gravity,
      vx: away * this.normal[0] - down * this.up[0], vy: away * this.normal[1] - down * this.up[1],
    };
    const [incoming, ...parts] = surfaceParts(scene);
    const linesOf = ({ name, lines }: Part) => {
      return lines.flatMap(({ points }) => points.slice(1).map((end, n) => {
        return { name, start: points[n], end };
      }));
    };
    this.beltLine = linesOf(incoming);
    // The plate, the outgoing belt if there is one, and all others.
    this.lines = parts.flatMap(linesOf);
    this.bends = parts.flatMap(({ name, bends }) => bends.map(([cx, cy, r, begin, extent]) => {
      return { name, center: [cx, cy] as Point, radius: r, begin, extent };
    }));
    this.gates = new Set(scene.surface
      .filter((one) => one.opens_at !== undefined || one.closes_at !== undefined)
      .map((one) => one.name));
  }

  /** Returns the reason for which the equations end at a surface. */
  meets(claim: Reason["claim"], surface: string, text: string, words: Record<string, number> = {}) {
    if (this.gates.has(surface)) return because("outside", "gate", { surface });
    return because(claim, text, { surface, ...words });
  }

  onTheRide(): Trouble {
    const { lines, bends, radius, rideRadius } = this;
    const { at } = this.scene.streams[0];
    const [sin, cos] = sinCos(this.incline);
    const way = at === undefined ? this.belt.length : -product(at, [cos, sin]);
    const start: Point = [rideRadius * -sin - way * cos, rideRadius * cos - way * sin];
    const obstacles = { lines, bends };
    const straight = { x: start[0], y: start[1], vx: cos, vy: sin, gravity: 0.0 };
    const { phi1 } = this.found.numbers;
    const name = overlapped(obstacles, start, radius)
      || firstInFlight(straight, obstacles, radius, way).name
      || firstOnPulley(rideRadius, -this.incline, phi1, obstacles, radius).name;
    return name ? ["separation", this.meets("early", name, "in-the-way")] : null;
  }

  beforeThePlate(): Trouble {
    const { low, high, lines, bends, radius, separation, rideRadius } = this;
    const { phi1, v1, t2 } = this.found.numbers;
    const foot = product([this.impact[0] - this.pivot[0], this.impact[1] - this.pivot[1]], this.up);
    const hit = low <= foot && foot <= high;
    const plate = { lines: lines.slice(0, 1), bends: [] };
    const horizon = hit ? t2 : horizonOf(separation, plate, radius);
    // Thrown up slowly, it may come down on the pulley again. Faster, it would only seem to at
    // once, by rounding: it starts on the circle.
    const slow = v1 * v1 * sinCos(phi1)[1] < separation.gravity * rideRadius;
    const [again = Infinity] = phi1 < 0.0 && slow
      ? ringTimes(separation, [0.0, 0.0], rideRadius, 0.0, horizon) : [];
    const hops = again < horizon;
    const others = { lines: hit ? lines.slice(1) : lines, bends };
    const { name } = firstInFlight(separation, others, radius, Math.min(horizon, again));
    // What is in the way of a flight that misses the plate anyway does not matter.
    const stopped = hit || hops || firstInFlight(separation, plate, radius, horizon).name;
    if (stopped && name) {
      const text = name === "plate" ? "plate-end" : "touched-first";
      return ["impact", this.meets("early", name, text)];
    }
    if (hops) return ["impact", because("early", "comes-down-again", { surface: "pulley" })];
    if (hit) return null;
    if (Number.isNaN(foot)) {
      const { reason } = this.found;
      return ["impact", reason ?? because("no-impact", "turns-away")];
    }
    return ["impact", foot > high
      ? because("no-impact", "above-plate", { length: foot - high })
      : because("no-impact", "below-plate", { length: low - foot })];
  }

  afterTheRebound(): Trouble {
    const { radius, lines, bends, rebounded, rideRadius, impact } = this;
    const { t3, x3 } = this.found.numbers;
    const { outgoing: out } = this.scene;
    const top = this.belt.pulley_radius;
    if (out === null) return null;
    if (impact[1] - radius < top - out.drop) {
      return ["landing", because("misses", "below-belt")];
    }
    const lands = Number.isFinite(t3);
    const pulley: Line = { name: "pulley", start: [-top, -top], end: [top, top] };
    const around = { lines: [pulley, ...lines], bends };
    const horizon = lands ? t3 : horizonOf(rebounded, around, radius);
    const solid = { lines: [...this.beltLine, ...lines.slice(2)], bends };
    let { time, name } = firstInFlight(rebounded, solid, radius, horizon);
    const plate = this.plateAgain(horizon);
    if (plate < time) [time, name] = [plate, "plate"];
    const wheel = cornerTime(rebounded, [0.0, 0.0], rideRadius, horizon);
    if (wheel < time) [time, name] = [wheel, "pulley"];
    // The outgoing belt is not among them: no part of it is met above its level.
    if (name) return ["landing", this.meets("second", name, "after-rebound", { time })];
    const x = impact[0] - x3;
    if (lands && !(out.start <= x && x <= out.start + out.length)) {
      return ["landing", because("misses", "off-belt-end", { x })];
    }
    return null;
  }

  /** Returns when the plate is touched again, Infinity if not before `horizon`. */
  plateAgain(horizon: number) {
    const { rebounded, low, high } = this;
    const pressing = -rebounded.gravity * this.sine;
    if (pressing <= 0.0) return Infinity;
    let face = Infinity;
    const away = product([rebounded.vx, rebounded.vy], this.normal);
    if (2.0 * away < pressing * horizon) {
      const again = 2.0 * away / pressing;
      const [x, y] = placeAt(rebounded, again);
      const foot = product([x - this.pivot[0], y - this.pivot[1]], this.up);
      if (low <= foot && foot <= high) face = again;
    }
    const [{ start, end }] = this.lines;
    return Math.min(face, ...[start, end].map((point) => {
      return cornerTime(rebounded, point, this.radius, horizon);
    }));
  }
}
