// Place, time and velocity of each particle's start, drawn by the core, see Python's
// `machine/releases.py`.
import { memory } from "./plan.ts";
import { Fault, type Scene } from "./scene.ts";

export interface Release {
  t: number; // s
  x: number; // m
  y: number;
  vx: number; // m/s
  vy: number;
  exitBox: number[]; // left, bottom, right, top beyond which it has left the scene, m
  omega: number; // rad/s
  angle: number; // rad
  carried: boolean; // rides the incoming belt by adhesion
  stream: number;
  kind: number;
}

type Refusal = { distance: number, reach: number, why: number, stream: number, particle: number,
  surface: number };

/** Particles and places that a call tries: all of them. */
const LOOKS = 2 ** 31 - 1;

/**
 * Has the core draw the releases of a scene whose surfaces it has just laid, and the radii of the
 * particles.
 * @param names of the surfaces
 * @throws {Fault} if a box has no room for all, a particle would start inside a surface, or
 *   adhesion would carry one with corners
 */
export function draw(scene: Scene, names: string[]): { releases: Release[], radius: number[] } {
  const core = memory(), { Refused, Status } = core.layout.enums, { streams, kinds } = scene;
  core.set("looks", LOOKS, "Drawing");
  core.doubles.set(scene.particles.flatMap(({ outline }) => outline.flat()),
    core.get("corners", "Drawing") >> 3);
  while (core.exports.draw() === Status.PAUSED);
  const [refusal]: Refusal[] = core.rows("refusals", "Refusal", 1, "Drawing");
  if (refusal.why !== Refused.ACCEPTED) throw faultOf(scene, refusal, names);
  const { doubles, ints } = core, carried = core.get("carried", "Drawing") >> 2;
  const releases: Release[] = [], radius: number[] = [];
  // Rows of `Start` in layout.h, number by number: there may be a hundred thousand.
  let at = core.get("starts", "Drawing") >> 3;
  streams.forEach((one, stream) => {
    const common = { carried: ints[carried + stream] !== 0, stream, kind: kinds[stream] };
    if (common.carried && scene.particles[common.kind].outline.length) {
      throw new Fault("incoming.friction", "adhesion", "cornered-grip");
    }
    for (let i = 0; i < one.count; i += 1, at += core.layout.structs.Start.size >> 3) {
      releases.push({
        t: doubles[at], x: doubles[at + 1], y: doubles[at + 2], vx: doubles[at + 3],
        vy: doubles[at + 4], exitBox: [...doubles.subarray(at + 6, at + 10)],
        omega: doubles[at + 10], angle: doubles[at + 11], ...common,
      });
      radius.push(doubles[at + 5]);
    }
  });
  return { releases, radius };
}

/** Returns why the releases of a scene cannot be drawn. */
function faultOf(scene: Scene, refusal: Refusal, names: string[]) {
  const { why, stream, particle, surface, distance, reach } = refusal;
  const { at, fill, speed_spread: spread, velocity, omega } = scene.streams[stream];
  const { BOX_FULL, SPREAD_ADHERES, VELOCITY_ADHERES, SPIN_ADHERES } =
    memory().layout.enums.Refused;
  const table = scene.streams.length > 1 ? `stream[${stream}]` : "stream";
  if (why === SPREAD_ADHERES) return new Fault(`${table}.speed_spread`, spread, "adhesion-speed");
  if (why === VELOCITY_ADHERES) return new Fault(`${table}.velocity`, velocity, "adhesion-speed");
  if (why === SPIN_ADHERES) return new Fault(`${table}.omega`, omega, "adhesion-speed");
  if (why === BOX_FULL) {
    return new Fault(`${table}.fill`, fill, "box-full", { count: particle, radius: reach });
  }
  return new Fault(`${table}.at`, at, "release-inside", {
    surface: names[surface], particle, distance, reach,
  });
}
