// The paper's equations (2) to (16) in closed form, as Python's `theory/transfer.py` has them, to
// the last bit: any plate angle, finite particles, friction and spin at the plate, and belts that
// rise, on which particles are carried by adhesion.
import { arcCos, atan2, lengthOf, sinCos } from "./trig.ts";

/** Why there is no number; `claim` is what a simulation would show, as in Python's `Reason`. */
export interface Reason {
  claim: "outside" | "early" | "no-impact" | "second" | "misses";
  text: string; // id of a text in the catalogue
  words: Record<string, number | string>; // names and numbers for that text
}

/** Parameters of a transfer, SI units */
interface Parameters {
  speed: number; // of the incoming belt
  pulleyRadius: number;
  distance: number; // from the pulley's leading edge to the plate's pivot
  angle?: number; // of the plate, rad
  pivotHeight?: number; // above the pulley's axis; its radius if not given
  restitution?: number;
  drop?: number; // of the centre from impact to landing
  beltSpeed?: number; // of the outgoing belt; `speed` if not given
  particleRadius?: number;
  mass?: number;
  gravity?: number;
  spin?: boolean;
  inertia?: number; // I/(m r²)
  incline?: number; // rad
  plateFriction?: number;
  interval?: number; // s per particle
  asPrinted?: boolean; // use Eq. (9) as printed: upright plate, no friction
  unboundedPlate?: boolean; // false: crossing the plate's line beyond its ends is no hit
}

/** Quantities by the stage that gives them, in the order of events. */
const STAGES = {
  separation: ["phi1", "v1", "omega1"],
  impact: ["t2", "x2", "y2", "v2", "v2x", "v2y", "phi2"],
  rebound: ["phi2r", "v2r", "omega2"],
  landing: ["t3", "x3", "y3", "v3", "v3x", "v3y", "d3", "dEk", "P", "belt_work", "slip_heat"],
};

export type Stage = keyof typeof STAGES;
/** By the paper's symbols; NaN where there is none */
type Numbers = Record<string, number>;
export type Transfer = { numbers: Numbers, reason: Reason | null };

export function because(
  claim: Reason["claim"], text: string, words: Record<string, number | string> = {},
): Reason {
  return { claim, text, words };
}

/** Returns a transfer without the numbers of a stage and all later ones, with the reason. */
export function cutFrom(found: Transfer, stage: Stage, reason: Reason | null): Transfer {
  const numbers = { ...found.numbers };
  let lost = false;
  for (const [name, symbols] of Object.entries(STAGES)) {
    lost ||= name === stage;
    if (lost) for (const symbol of symbols) numbers[symbol] = NaN;
  }
  return { numbers, reason };
}

export function unanswered(): Transfer {
  return cutFrom({ numbers: {}, reason: null }, "separation", null);
}

/**
 * Returns where a particle leaves the pulley: angle from the top with its cosine and sine, speed,
 * and the time after which a particle thrown upwards falls on the pulley again.
 */
function separationOf(speed: number, rideRadius: number, gravity: number, incline: number) {
  const unit = gravity * rideRadius;
  const square = speed * speed;
  const u = square / unit;
  if (incline === 0.0) {
    // Eq. (2), generalised to Rc
    const cos = Math.min(u, 1.0);
    const sin = Math.sqrt((1.0 - cos) * (1.0 + cos));
    return { phi1: atan2(sin, cos), cos, sin, again: Infinity };
  }
  const [rise, level] = sinCos(incline);
  const lifts = u >= level;
  const up = gravity * (speed * rise + Math.sqrt(Math.max(level * (unit - square * level), 0.0)));
  const hops = lifts && incline > 0.0 && square * level < unit;
  const again = hops ? 2.0 * (square - unit * level) / up : Infinity;
  const phi1 = lifts ? -incline : arcCos(u);
  const [sin, cos] = sinCos(phi1);
  return { phi1, cos, sin, again };
}

/**
 * Carries a particle from the incoming belt over the plate to the outgoing belt.
 * Plate and outgoing belt are unbounded here; `prediction.ts` takes the finite machine into
 * account.
 */
export function transfer({
  speed, pulleyRadius, distance, angle = 0.0, pivotHeight = pulleyRadius, restitution = 0.5,
  drop = 0.5, beltSpeed = speed, particleRadius = 0.0, mass = 0.008, gravity = 9.81, spin = false,
  inertia = 0.5, incline = 0.0, plateFriction = 0.0, interval, asPrinted = false,
  unboundedPlate = true,
}: Parameters): Transfer {
  const found = unanswered();
  const { numbers } = found;
  const fail = (when: boolean, reason: Reason) => {
    if (when) found.reason ??= reason;
  };
  const require = (key: string, holds: boolean) => {
    fail(!holds, because("outside", "parameter", { key }));
  };
  const keep = (values: Numbers) => {
    if (found.reason === null) Object.assign(numbers, values);
  };
  const turning = (rim: number) => (spin ? rim / particleRadius : 0.0) + 0.0;
  const quarter = 0.5 * Math.PI;

  // Ride the belt and the pulley.
  require("speed", speed > 0.0 && speed < Infinity);
  require("pulleyRadius", pulleyRadius > 0.0 && pulleyRadius < Infinity);
  require("particleRadius", particleRadius >= 0.0 && particleRadius < Infinity);
  require("spin", !spin || particleRadius > 0.0);
  require("gravity", gravity >= 0.0 && gravity < Infinity);
  require("inertia", inertia > 0.0 && inertia <= 1.0);
  require("incline", Math.abs(incline) < quarter);
  const rideRadius = pulleyRadius + particleRadius;
  const left = separationOf(speed, rideRadius, gravity, incline);
  let rim = 0.0;
  keep({ phi1: left.phi1, v1: speed, omega1: turning(rim) });

  // Fly to the plate: the gap between disk and plate's line is a quadratic in time.
  require("angle", Math.abs(angle) < quarter);
  require("distance", Number.isFinite(distance + pivotHeight));
  const [sin, cos] = sinCos(angle);
  const toPivot = (pulleyRadius + distance) * cos + pivotHeight * sin - particleRadius;
  // On the pulley the gap is smallest where the radius to the centre is normal to the plate.
  const closest = Math.min(Math.max(quarter - angle, -incline), left.phi1);
  const behind = toPivot < rideRadius * sinCos(closest + angle)[0] && found.reason === null;
  if (behind && unboundedPlate) for (const name of STAGES.separation) numbers[name] = NaN;
  fail(behind, unboundedPlate
    ? because("early", "ride-meets-line", { surface: "plate" })
    : because("no-impact", "ride-passes-line"));
  const gap = toPivot - rideRadius * (left.sin * cos + left.cos * sin);
  const closing = speed * (left.cos * cos - left.sin * sin);
  const discriminant = closing * closing - 2.0 * gravity * sin * gap;
  const normal = Math.sqrt(discriminant);
  const t2 = 2.0 * gap / (closing + normal); // Eq. (5)
  // Thrown up steeply, it hits a plate that leans away only on its way down.
  const parts = closing <= 0.0 && sin >= 0.0;
  const comesDown = Number.isFinite(left.again) && !(!parts && t2 <= left.again);
  fail(comesDown, because("early", "comes-down-again", { surface: "pulley" }));
  fail(parts, because("no-impact", "flies-off"));
  fail(discriminant <= 0.0, because("no-impact", "turns-away"));
  const x2 = speed * t2 * left.cos; // Eq. (3)
  const y2 = 0.5 * gravity * (t2 * t2) + speed * t2 * left.sin; // Eq. (4)
  const v2x = speed * left.cos;
  const v2y = speed * left.sin + gravity * t2;
  const tangential = v2x * sin + v2y * cos;
  const v2 = lengthOf(v2x, v2y); // Eq. (6)
  keep({ t2, x2, y2, v2x, v2y, v2, phi2: atan2(normal, tangential) }); // Eq. (7)

  // Leave the plate. Coulomb: the impulse that ends slip, or the most that friction allows.
  require("restitution", restitution >= 0.0 && restitution <= 1.0);
  require("plateFriction", plateFriction >= 0.0);
  require("asPrinted", !asPrinted || (plateFriction === 0.0 && angle === 0.0));
  const limit = plateFriction * (1.0 + restitution) * normal;
  const share = spin ? inertia / (1.0 + inertia) : 1.0;
  const impulse = Math.min(Math.max((tangential - rim) * share, -limit), limit);
  let away = restitution * normal;
  let down = tangential - impulse;
  rim += spin ? impulse / inertia : 0.0;
  const phi2r = atan2(away, down); // Eq. (8)
  const v2r = asPrinted ? lengthOf(normal, restitution * tangential) : lengthOf(away, down);
  if (asPrinted) [away, down] = sinCos(phi2r).map((part) => v2r * part);
  keep({ phi2r, v2r, omega2: turning(rim) }); // Eq. (9)

  // Fall on the outgoing belt, and be carried along by it.
  require("drop", drop >= 0.0 && drop < Infinity);
  require("beltSpeed", Number.isFinite(beltSpeed));
  require("mass", mass > 0.0 && mass < Infinity);
  require("interval", interval === undefined || interval > 0.0);
  const v3x = away * cos - down * sin;
  const sinking = away * sin + down * cos;
  const v3y = Math.sqrt(sinking * sinking + 2.0 * gravity * drop);
  // Eq. (12), in the form without cancellation for either sign of b
  let t3 = sinking >= 0.0 ? 2.0 * drop / (sinking + v3y) : (v3y - sinking) / gravity;
  if (drop === 0.0 && sinking >= 0.0) t3 = 0.0;
  fail(!Number.isFinite(t3), because("misses", "never-comes-down"));
  if (unboundedPlate) {
    const pressing = -gravity * sin;
    const again = pressing > 0.0 && 2.0 * away < pressing * t3;
    fail(again, because("second", "meets-line-again", { surface: "plate" }));
  }
  const dEk = 0.5 * mass * (v3x * v3x + beltSpeed * beltSpeed); // Eq. (14)
  const slip = beltSpeed + v3x - rim;
  const carried = spin ? mass / ((1.0 + inertia) / inertia) : mass;
  const lostHeight = left.sin * left.sin / (1.0 + left.cos); // 1 - cos φ1
  keep({
    t3,
    x3: v3x * t3, // Eq. (10)
    y3: drop, // Eq. (11), solved for t3
    v3x,
    v3y,
    v3: lengthOf(v3x, v3y), // Eq. (13)
    d3: rideRadius * lostHeight + y2 + drop, // Eq. (16)
    dEk,
    P: dEk / (interval ?? NaN), // Eq. (15)
    belt_work: carried * beltSpeed * slip,
    slip_heat: 0.5 * carried * (slip * slip),
  });
  return found;
}

/** Most rounds of Newton's method; fewer than 20 are needed. */
const MOST_ROUNDS = 100;

/**
 * Returns where a body leaves the pulley of a level belt with finite friction, as Python's
 * `theory/slide.py` does; the spin, which takes a quadrature, is left out. With u = v² / (g Rc) and
 * φ the angle from the top, the normal force is m g w, w = cos φ - u. While it sticks, u = u0 +
 * 2/(1 + k) (1 - cos φ) for a body that rolls, k = I/(m r²), else u = u0. Once friction is exceeded
 * it slips, w' = 2 µ w - 3 sin φ, and it leaves where w = 0.
 * @param parameters SI units
 * @returns rad, m/s
 */
export function separationWithSlip({
  speed, pulleyRadius, gravity, friction, particleRadius = 0.0, spin = false, inertia = 0.5,
}: {
  speed: number, pulleyRadius: number, gravity: number, friction: number, particleRadius?: number,
  spin?: boolean, inertia?: number,
}): { phi1: number, v1: number } {
  const unit = gravity * (pulleyRadius + particleRadius);
  const start = (speed * speed) / unit;
  if (start >= 1.0) return { phi1: 0.0, v1: speed };
  const fall = spin ? (3.0 + inertia) / (1.0 + inertia) : 1.0;
  const need = spin ? (1.0 + inertia) / inertia : 1.0;
  const grip = (spin ? (3.0 + inertia) / inertia : 1.0) * friction;
  const most = spin ? ((1.0 + inertia) * start + 2.0) / (3.0 + inertia) : start;
  const short = (spin ? (1.0 + inertia) / (3.0 + inertia) : 1.0) * (1.0 - start);
  // The onset of slip is a quadratic in tan(φ/2); this form of its root has no cancellation.
  const base = 1.0 + Math.hypot(1.0, grip * Math.sqrt(short * (1.0 + most)));
  const tangent = (grip * short) / base, onset = 2.0 * Math.atan(tangent);
  const pressed = (fall * 2.0 * short) / (base * (1.0 + tangent * tangent));
  const swell = (1.0 - (6.0 * need - 4.0) * friction * friction) * pressed - 3.0 * Math.cos(onset);
  const normal = (x: number) => {
    const half = Math.sin(0.5 * x), middle = onset + 0.5 * x;
    const change = 12.0 * friction * Math.cos(middle) * half - 6.0 * Math.sin(middle) * half
      + swell * Math.expm1(2.0 * friction * x);
    return pressed + change / (1.0 + 4.0 * friction * friction);
  };
  // Without slip it would leave at cos φ = `most`. w is concave: Newton from the right.
  const last = Math.sqrt(short / (1.0 + most));
  let x = Math.min(2.0 * Math.atan((last - tangent) / (1.0 + last * tangent)), 1.0 / friction);
  for (let round = 0; round < MOST_ROUNDS; round += 1) {
    const w = normal(x), slope = 2.0 * friction * w - 3.0 * Math.sin(onset + x);
    const lower = Math.max(x - w / (slope < 0.0 ? slope : -Infinity), 0.0);
    if (!(lower < x)) break;
    x = lower;
  }
  return { phi1: onset + x, v1: Math.sqrt(unit * Math.cos(onset + x)) };
}
