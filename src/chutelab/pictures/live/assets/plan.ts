// A scene as one row of numbers for the core, and the surfaces that it builds from that: like
// Python's `machine/builder.py`.

import { Memory, type Layout } from "./core.ts";
import { Fault, met, moversOf, type Point, type Scene } from "./scene.ts";
import { useCore } from "./trig.ts";

type Segment = { start: Point, end: Point, tangent: Point, length: number, speed: number,
  appears: number, vanishes: number, surface: number, one_sided: number };
/** The motion of a surface, as `Mover` of layout.h */
export type Mover = { surface: number, pivot: Point, by: Point, frequency: number, phase: number,
  way: Point, from: number, lasts: number, turn: number, inertia: number, mass: number,
  moment: Point, spring: number, rest: number, damper: number, stops: Point, motor: Point,
  begins: number };
type Arc = { center: Point, radius: number, begin: number, extent: number, speed: number,
  appears: number, vanishes: number, surface: number, one_sided: number };

/** Numbers for values in words; `drop_from` and `passes` as in layout.h. */
const WORDS: Record<string, number> = {
  adhesion: Infinity, impact: 0.0, top: 1.0, up: 1, down: -1, right: 2, left: -2, out: 3, in: -3,
};

/** The core of this thread. */
let core: Memory;

/** The core of this thread, with the surfaces built. */
export const memory = () => core;

/** Start the core of this thread, which builds machines, and computes sines. */
export async function startPlan(module: WebAssembly.Module, layout: Layout) {
  core = new Memory(await WebAssembly.instantiate(module, {}), layout);
  useCore(core);
}

/** Returns the keys of a struct of layout.h as numbers, NaN for missing ones. */
function numbersOf(struct: string, table: any) {
  return Object.entries(core.layout.structs[struct].fields).flatMap(([key, [, , many]]) => {
    const given: (number | string | boolean)[] = [table[key] ?? []].flat(2);
    const numbers = given.map((value) => {
      return typeof value === "string" ? WORDS[value] : Number(value);
    });
    return [...numbers, ...Array<number>(many - numbers.length).fill(NaN)];
  });
}

/** Returns the lower 32 bits of a seed, and the others. */
const wordsOf = (seed: bigint) => [Number(seed & 0xffffffffn), Number(seed >> 32n)];

/** Returns all numbers of a scene.
 * @param names of the surfaces */
function rowOf(scene: Scene, names: string[]): number[] {
  const { incoming, outgoing, surface } = scene;
  const [kind] = scene.kinds, all = (struct: string, tables: object[]) =>
    tables.flatMap((table) => numbersOf(struct, table));
  return [
    ...numbersOf("SceneKeys", scene),
    ...all("ParticleKeys", scene.particles.map((one) => ({
      ...one, moment: !one.spin ? 0.0 : one.shape === "sphere" ? 0.4 : 0.5,
      corners: one.outline.length,
    }))),
    ...all("StreamKeys", scene.streams.map((one, n) => ({
      ...one, kind: scene.kinds[n], seed: wordsOf(BigInt(one.seed)),
      at_once: one.fill !== undefined || (one.to !== undefined && !("rate" in one.given)),
    }))),
    ...all("IncomingKeys", incoming ? [{
      ...incoming, friction: met(scene, kind, "incoming")[1],
      adheres: incoming.friction === "adhesion",
    }] : []),
    ...all("PlateKeys", scene.plates),
    ...all("OutgoingKeys", outgoing ? [outgoing] : []),
    ...all("ConveyorKeys", scene.conveyor),
    // What waits for another surface to be touched is not there at first.
    ...all("SurfaceKeys", surface.map((one) => ({
      ...one, corners: one.points?.length ?? 0,
      closes_at: one.closes_when ? Infinity : one.closes_at,
    }))),
    ...all("JointKeys", scene.joints.map(({ kind: tie, ...one }) => ({
      ...one, from: one.from ?? one.over, kind: core.layout.enums.Tie[tie.toUpperCase()],
    }))),
    ...all("MoverKeys", moversOf(scene).map(([name, { hinge, shake, travel, motor, ...one }]) => ({
      ...one, phase_deg: 0, ...shake, to: travel?.to, at: travel?.at, in: travel?.in, ...motor,
      surface: names.indexOf(name), pivot: hinge && hinge !== "pivot" ? hinge : one.pivot,
      hangs: hinge !== undefined,
    }))),
    ...surface.flatMap(({ points }) => (points ?? []).flat()),
  ];
}

/**
 * Has the core build the surfaces of a scene.
 * @throws {Fault} if the plate has no length
 */
export function lay(scene: Scene, names: string[]): {
  segments: Segment[], arcs: Arc[], movers: Mover[],
} {
  const row = rowOf(scene, names), moving = moversOf(scene).length;
  core.forget();
  core.setAll("Plan", {
    members: 1, width: row.length, particles: scene.particles.length,
    streams: scene.streams.length, incoming: Number(scene.incoming !== null),
    plates: scene.plates.length, outgoing: Number(scene.outgoing !== null),
    conveyors: scene.conveyor.length, surfaces: scene.surface.length,
    joints: scene.joints.length, moving,
  });
  core.work("lay_out_plan");
  core.doubles.set(row, core.get("rows", "Plan") >> 3);
  core.work("build");
  const [{ contradiction }] = core.rows("nominal", "Nominal", 1, "Plan");
  if (contradiction === core.layout.enums.Contradiction.NO_LENGTH) {
    const plate = scene.plates.find(({ pivot }) => pivot === undefined);
    throw new Fault("plate.above", plate?.above, "no-length");
  }
  return {
    segments: core.rows("segments", "Segment", core.get("segment_count", "Plan"), "Plan"),
    arcs: core.rows("arcs", "Arc", core.get("arc_count", "Plan"), "Plan"),
    movers: core.rows("movers", "Mover", moving, "Plan"),
  };
}
