// `predict`: the closed form's answer for a scene, or the reason why it has none.
//
// `transfer` takes plate and belt as unbounded, and has no obstacles. The run shows what the
// particle touches, and in which order. Like Python's `theory/prediction.py`, which searches for
// obstacles, except for belts with a coefficient of friction, and for gates, which are obstacles
// only while they exist.
import type { Event } from "./core.ts";
import type { Segment } from "./machine.ts";
import type { Recording } from "./recording.ts";
import { clinging, met, moversOf, slices, triggersOf, type Incoming, type Plate, type Scene } from "./scene.ts";
import {
  because, cutFrom, transfer, unanswered, type Reason, type Stage, type Transfer,
} from "./transfer.ts";
import { RADIANS, sinCos } from "./trig.ts";

/** The first stage that is not reached, and why */
type Trouble = [Stage, Reason] | null;

/** m; a release this close to the riding height differs from it by rounding only. */
const RIDES = 1e-12;

/** Kinds of events, as in the enum Kind of the core. */
const RELEASE = 0, IMPACT = 3, EXIT = 8;

/**
 * Predicts particle 0 of a scene in closed form.
 * @param recording a run of the scene, as far as it has come
 * @returns NaN from the stage on that is not reached as the equations assume
 */
export function predict(scene: Scene, recording: Recording): Transfer {
  const { incoming: belt } = scene;
  const plate = scene.plates.find(({ pivot }) => pivot === undefined);
  if (belt === null || plate === undefined) {
    const missing = belt === null ? "no-incoming" : scene.plates.length ? "hung-plate" : "no-plate";
    return cutFrom(unanswered(), "separation", because("outside", missing));
  }
  const outside = recording.pushes.length ? "pushed" : outsideOf(scene, belt);
  if (outside) return cutFrom(unanswered(), "separation", because("outside", outside));
  const found = unboundedTransfer(scene, belt, plate);
  if (Number.isNaN(found.numbers.phi1)) return found;
  const trouble = troubleOf(scene, belt, recording, found);
  return trouble === null ? found : cutFrom(found, ...trouble);
}

/** Returns the stage at which the particle touches something outside the equations, or misses plate
 * or belt. */
function troubleOf(
  scene: Scene, belt: Incoming, { events, machine }: Recording, { numbers, reason }: Transfer,
): Trouble {
  const { phi1, x2, y2, v2r, t3, x3 } = numbers, { outgoing: out } = scene;
  const [rise, level] = sinCos(belt.incline_deg * RADIANS);
  const nameOf = ({ surface, x, y }: Event) => {
    const name = machine.surfaces[surface];
    return name === "incoming" && x * level + y * rise > 0.0 ? "pulley" : name;
  };
  const meets = (
    stage: Stage, claim: Reason["claim"], event: Event, text: string,
    words: Record<string, number> = {},
  ): Trouble => {
    const surface = nameOf(event);
    const isGate = scene.surface.some(({ name, opens_at: opens, closes_at: closes }) =>
      name === surface && (opens !== undefined || closes !== undefined));
    const isOneSided = scene.surface.some(({ name, passes }) => name === surface && passes);
    return [stage, isGate ? because("outside", "gate", { surface })
      : isOneSided ? because("outside", "one-sided", { surface })
      : because(claim, text, { surface, ...words })];
  };
  const [left, hit, next] = events.filter(({ disk, kind }) =>
    disk === 0 && kind !== RELEASE && kind !== EXIT);
  // An obstacle on the ride ends the equations at once.
  if (hit && hit.t === left.t) return meets("separation", "early", hit, "in-the-way");

  const [sin, cos] = sinCos(phi1), rideRadius = belt.pulley_radius + machine.radius[0];
  // The centre on the plate's line, and its distance from the plate's lower end; NaN if it is not
  // met.
  const [x, y] = [rideRadius * sin + x2, rideRadius * cos - y2];
  const plate = machine.surfaces.indexOf("plate");
  const face = machine.segments.find(({ surface }) => surface === plate) as Segment;
  const foot = (x - face.x) * face.tx + (y - face.y) * face.ty;
  const isOnFace = 0.0 <= foot && foot <= face.length, first = hit && nameOf(hit);
  if (first === "pulley") return meets("impact", "early", hit, "comes-down-again");
  if (isOnFace && first && first !== "plate") return meets("impact", "early", hit, "touched-first");
  // Another obstacle does not matter if the flight misses the plate anyway.
  if (!isOnFace && first === "plate") return meets("impact", "early", hit, "plate-end");
  if (Number.isNaN(foot)) return ["impact", reason ?? because("no-impact", "turns-away")];
  if (foot < 0.0) return ["impact", because("no-impact", "below-plate", { length: -foot })];
  if (!isOnFace) {
    return ["impact", because("no-impact", "above-plate", { length: foot - face.length })];
  }

  if (out === null) return Number.isFinite(v2r) ? ["landing", because("outside", "no-outgoing")] : null;
  if (reason !== null && reason.claim !== "misses") return null;
  if (y - machine.radius[0] < belt.pulley_radius - out.drop) {
    return ["landing", because("misses", "below-belt")];
  }
  // Events other than impacts belong to a contact that has lasted since the first one.
  const time = next?.kind === IMPACT ? next.t - hit.t : 0.0;
  if (next && nameOf(next) !== "outgoing" && !(time >= t3)) {
    return meets("landing", "second", next, "after-rebound", { time });
  }
  const down = x - x3;
  return Number.isFinite(t3) && !(out.start <= down && down <= out.start + out.length)
    ? ["landing", because("misses", "off-belt-end", { x: down })] : null;
}

/** Returns the results of the equations without other obstacles. */
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

/** Returns why the scene is another problem than the paper's, "" if it is not. */
function outsideOf(scene: Scene, belt: Incoming) {
  const [stream] = scene.streams;
  const own = scene.particles[scene.kinds[0]];
  if (belt.friction !== "adhesion") return "belt-friction";
  if (own.spin && own.rolling_friction > 0.0) return "rolling-friction";
  if (own.restitution_speed !== undefined) return "falling-restitution";
  if (scene.pair.some(clinging)) return "clings";
  if (scene.air_density > 0.0) return "air";
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
  if (stream.omega !== 0.0) return "spins";
  if (scene.joints.some(({ particle, other }) => !particle || other === 0)) return "hangs";
  if (moversOf(scene).length) return "moves";
  if (triggersOf(scene).length) return "waits";
  return scene.crowded ? "interact" : "";
}
