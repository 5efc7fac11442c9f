// A scene as in its file, and with all defaults: `resolve`. The same rules as in Python's
// `chutelab.scene`, as far as a page can edit. `keys.ts` changes keys.
import { JOINTS, conflictsOf, listOf, misfitsOf, straysOf } from "./checks.ts";
import type { Form } from "./forms.ts";
import type { Tree } from "./formula.ts";

export type Point = [number, number];
/** Keys as a scene file has them */
export type Given = Record<string, any>;

/** What a key may hold */
export interface Rule {
  default?: any; // absent if a key has none
  required?: boolean;
  unit?: string;
  low?: number;
  high?: number;
  form: Form;
  parts?: Record<string, Rule>; // of a table in it
}

/** What Python writes into the page, see `describe.py` */
export interface Lab {
  tables: Record<string, Record<string, Rule>>; // rules by table and key
  rules: Record<string, [string[], Tree, string, string?][]>; // contradictions by table
  presets: Record<string, Record<string, number>>; // materials by name
}

interface Particle {
  name?: string;
  shape: "disk" | "sphere" | "box" | "polygon";
  radius: number; // the mean if they differ; with corners that of the furthest corner
  size?: Point; // of a box, m
  points?: Point[]; // of a polygon
  outline: Point[]; // corners about the centroid, counterclockwise, m; none if round
  span?: Point; // the least and the largest radius if they differ
  mass: number;
  density?: number;
  material?: string;
  spin: boolean;
  rolling_friction: number;
  restitution_speed?: number; // restitution decreases above it; without it never
  given: Given; // the keys that were written
}

interface Stream {
  name: string;
  particle?: string;
  count: number;
  rate: number; // particles per second
  width?: number;
  start: number;
  bed_height: number;
  speed_spread: number;
  seed: number | string;
  at?: Point;
  to?: Point;
  fill?: [Point, Point];
  velocity?: Point;
  omega: number;
  angle_deg: number;
  interact: boolean;
  restitution: number;
  friction: number;
  given: Given;
}

/** Motion of a plate or a surface: at most one of `hinge` and the three before it */
export interface Moves {
  turn: number; // degrees/s
  shake?: { by: Point, frequency: number, phase_deg: number };
  travel?: { to: Point, at: number, in: number };
  hinge?: Point | "pivot";
  mass?: number;
  inertia?: number;
  spring: number;
  damper: number;
  stops_deg?: Point;
  motor?: { speed_deg: number, torque: number };
  starts_when?: When;
}

/** Condition of a trigger */
type When = { touched: string };

export interface Plate extends Moves {
  name?: string;
  pivot?: Point;
  distance: number;
  angle_deg: number;
  pivot_height: number;
  above: number;
  below?: number;
  restitution: number;
  friction: number;
  given: Given;
}

export interface Surface extends Moves {
  name: string;
  pivot?: Point;
  points?: Point[]; // of a straight one
  center?: Point; // of an arc
  radius: number;
  from_deg: number;
  to_deg: number;
  restitution: number;
  friction: number;
  material: "steel" | "rubber";
  speed: number;
  opens_at?: number;
  closes_at?: number;
  opens_when?: When;
  closes_when?: When;
  passes?: string;
  repeat: [number, number, number][];
  given: Given;
}

export interface Conveyor {
  name: string;
  from: Point;
  to: Point;
  pulley_radius: number;
  speed: number;
  restitution: number;
  friction: number;
  given: Given;
}

export interface Incoming {
  speed: number;
  pulley_radius: number;
  length: number;
  incline_deg: number;
  friction: "adhesion" | number;
  restitution: number;
  given: Given;
}

interface Outgoing {
  speed: number;
  drop: number;
  drop_from: "impact" | "top";
  start: number;
  length: number;
  restitution: number;
  friction: number;
  given: Given;
}

/** A joint of a particle with a point or another particle, as in `machine/parts.py` */
export interface Joint {
  kind: typeof JOINTS[number];
  from?: Point;
  over?: Point; // for a string between two: the pulley that it runs over
  particle: number;
  other?: number;
  length?: number;
  stiffness?: number; // of a spring, N/m
  damper?: number;
  given: Given;
}

/** All defaults filled in; names as in the file, except for three lists */
export interface Scene {
  title: string;
  gravity: number;
  gravity_deg: number;
  air_density: number;
  particles: Particle[];
  materials: Map<string, Record<string, number>>; // numbers by name, presets too
  pair: { between: [string, string], restitution?: number, friction?: number, cohesion: number,
    bond_number: number, meet: boolean, given: Given }[];
  incoming: Incoming | null;
  plates: Plate[];
  outgoing: Outgoing | null;
  conveyor: Conveyor[];
  surface: Surface[];
  joints: Joint[];
  streams: Stream[];
  run: { until: "landed" | "settled" | number, max_time: number, dt: number,
    is_told: boolean, // whether dt is
    engine: string, loads?: number };
  kinds: number[]; // which of the particles each stream consists of
  count: number; // of all particles
  crowded: boolean; // whether particles meet
  most: number; // most particles of a page
  sensor: { name: string, from: Point, to: Point }[]; // sensors
  view: { from: Point, to: Point } | null; // corners of what is shown
}

/** A fault of a scene. */
export class Fault extends Error {
  /**
   * @param key full path, such as `plate.angle_deg` or `surface[1].radius`
   * @param value the value found; undefined if the key is missing
   * @param text id of a text in the catalogue
   * @param words numbers and names for that text
   */
  constructor(
    readonly key: string, readonly value: unknown, readonly text: string,
    readonly words: Record<string, number | string> = {},
  ) {
    super(`${key}: ${text} ${JSON.stringify(words)}`);
  }
}

/**
 * Fills in all defaults.
 * @throws {Fault} if a value is out of its range, or keys contradict each other
 */
export function resolve(given: Given, lab: Lab): Scene {
  for (const wrong of misfitsOf(given, lab)) throw new Fault(...wrong);
  const filled = (table: string, row: Given) => {
    const fill = (rules: Record<string, Rule>, own: Given, into: Given) => {
      for (const [key, rule] of Object.entries(rules)) {
        const value = own[key] ?? rule.default;
        if (value !== undefined) into[key] = rule.parts ? fill(rule.parts, value, {}) : value;
      }
      return into;
    };
    return fill(lab.tables[table], row, { given: row }) as any;
  };
  const rows = (table: string) => {
    return listOf(given[table]).map((row) => filled(table, row));
  };
  // A map, as a name may be one that every object has.
  const materials = new Map(Object.entries(lab.presets));
  for (const { name, ...own } of listOf(given.material)) {
    for (const key of ["restitution", "friction"]) {
      own[`${key}_steel`] ??= own[key];
      own[`${key}_rubber`] ??= own[key];
    }
    materials.set(name, own as Record<string, number>);
  }
  const particles = given.particle === undefined ? [filled("particle", {})] : rows("particle");
  const streams = given.stream === undefined ? [filled("stream", {})] : rows("stream");
  const names = particles.map((kind) => kind.name);
  const kinds: number[] = streams.map((stream) => {
    return particles.length === 1 || stream.particle === undefined
      ? 0 : names.indexOf(stream.particle);
  });
  for (const wrong of straysOf(given, names, [...materials.keys()])) throw new Fault(...wrong);
  particles.forEach((kind) => fillMass(kind, materials));
  streams.forEach((stream, n) => fillRate(stream, n, particles[kinds[n]]));
  const incoming = given.incoming === undefined ? null : filled("incoming", given.incoming);
  const outgoing = given.outgoing === undefined ? null : filled("outgoing", given.outgoing);
  if (outgoing !== null && incoming !== null) outgoing.speed ??= incoming.speed;
  const plates = rows("plate");
  for (const plate of plates) {
    if (plate.pivot === undefined && incoming !== null) {
      plate.pivot_height ??= incoming.pulley_radius;
    }
  }
  const surface = rows("surface");
  for (const one of surface) {
    if (one.from !== undefined) one.points = [one.from, one.to];
  }
  const run = filled("run", given.run ?? {});
  run.is_told = given.run?.dt !== undefined;
  run.until ??= outgoing === null ? "settled" : "landed";
  const count = streams.reduce((sum, stream) => sum + stream.count, 0);
  const scene: Scene = {
    title: given.title ?? lab.tables.scene.title.default,
    gravity: given.gravity ?? lab.tables.scene.gravity.default,
    gravity_deg: given.gravity_deg ?? lab.tables.scene.gravity_deg.default,
    air_density: given.air_density ?? lab.tables.scene.air_density.default,
    particles, materials, pair: rows("pair"), incoming, plates, outgoing,
    conveyor: rows("conveyor"), surface,
    joints: JOINTS.flatMap((kind) => rows(kind).map((row) => ({ ...row, kind }))),
    streams, run, kinds, sensor: rows("sensor"), view: given.view ?? null,
    count, crowded: count > 1 && streams.some((stream) => stream.interact),
    most: lab.tables.stream.count.high ?? Infinity,
  };
  for (const wrong of conflictsOf(scene, given, lab)) throw new Fault(...wrong);
  return scene;
}

/** Returns the rule of a key by its path without numbers, such as `surface.shake.by`. */
export function ruleOf(tables: Lab["tables"], path: string): Rule | undefined {
  const [table, name, part] = path.split(".");
  const rule = tables[table]?.[name];
  return part === undefined ? rule : rule?.parts?.[part];
}

const namedOf = ({ plates, surface }: Scene): [string, Plate | Surface][] => [
  ...plates.map((one): [string, Plate] => [(one.pivot && one.name) || "plate", one]),
  ...surface.map((one): [string, Surface] => [one.name, one]),
];

/** Returns moving rows, and the names of their surfaces. */
export function moversOf(scene: Scene): [string, (Plate | Surface)][] {
  return namedOf(scene).filter(([, { turn, shake, travel, hinge }]) =>
    turn || shake || travel || hinge);
}

/** Returns triggers: a surface, its action, and the surface to be touched. */
export function triggersOf(scene: Scene): [string, "opens" | "closes" | "starts", string][] {
  return namedOf(scene).flatMap(([name, one]) =>
    (["opens", "closes", "starts"] as const).flatMap((doing) => {
      const when: When | undefined = (one as any)[`${doing}_when`];
      return when ? [[name, doing, when.touched] as [string, typeof doing, string]] : [];
    }));
}

/** Returns whether a pair is that of a kind of particles and another kind or surface, by name. */
const isOf = ({ between: [a, b] }: Scene["pair"][number], one?: string, other?: string) =>
  (a === one && b === other) || (b === one && a === other);

/** Returns the key of the cohesion of a pair, if it has one. */
export const clinging = ({ cohesion, bond_number: bonds }: Scene["pair"][number]) =>
  cohesion > 0 ? "cohesion" : bonds > 0 ? "bond_number" : null;

/** Returns the force (N) that it takes to pull a kind off another, or off a surface. */
export function cohesionOf(
  { particles, pair, gravity }: Scene, kind: number, other: number | string,
) {
  const name = typeof other === "string" ? other : particles[other].name;
  const one = pair.find((row) => isOf(row, particles[kind].name, name));
  if (!one?.bond_number) return one?.cohesion ?? 0;
  const masses = particles.filter((its) => one.between.includes(its.name!)).map(({ mass }) => mass);
  return one.bond_number * (Math.min(...masses) * gravity);
}

/** Returns whether two kinds pass through each other. */
export function passes({ particles, pair }: Scene, a: number, b: number) {
  return pair.some((one) => !one.meet && isOf(one, particles[a].name, particles[b].name));
}

/** Returns the corners of a box or polygon about its centroid, counterclockwise, m. */
function outlineOf({ size, points }: Particle): Point[] {
  if (size) {
    const [x, y] = [0.5 * size[0], 0.5 * size[1]];
    return [[-x, -y], [x, -y], [x, y], [-x, y]];
  }
  if (!points) return [];
  const crosses = crossesOf(points), twice = plainSum(crosses);
  const [x, y] = [0, 1].map((n) => plainSum(crosses.map((cross, k) =>
    (points[k][n] + points[(k + 1) % points.length][n]) * cross)) / (3.0 * twice));
  const moved = points.map((point): Point => [point[0] - x, point[1] - y]);
  return twice > 0 ? moved : moved.reverse();
}

/** Returns the cross product of each corner and the next. */
const crossesOf = (points: Point[]) => points.map(([x, y], n) => {
  const [u, v] = points[(n + 1) % points.length];
  return x * v - y * u;
});

const plainSum = (numbers: number[]) => numbers.reduce((sum, one) => sum + one);

/** Returns the moment of inertia over the mass of a polygon about its centroid, the origin, m². */
export function polygonMoment(points: Point[]) {
  const crosses = crossesOf(points), moments = points.map(([x, y], n) => {
    const [u, v] = points[(n + 1) % points.length];
    return crosses[n] * (x * x + x * u + u * u + y * y + y * v + v * v);
  });
  return plainSum(moments) / (6.0 * plainSum(crosses));
}

/** Fills in the mean radius of particles, and the mass at that radius. */
function fillMass(kind: any, materials: Map<string, Record<string, number>>) {
  kind.outline = outlineOf(kind);
  if (kind.outline.length) {
    kind.radius = Math.max(...kind.outline.map(([x, y]: Point) => Math.sqrt(x * x + y * y)));
    return;
  }
  let density = kind.density;
  if (density === undefined && kind.material !== undefined && !("mass" in kind.given)) {
    density = materials.get(kind.material)?.density;
  }
  if (Array.isArray(kind.radius)) {
    kind.span = kind.radius;
    kind.radius = 0.5 * (kind.span[0] + kind.span[1]);
  }
  if (density !== undefined) {
    const size = kind.radius;
    kind.mass = density * (4.0 / 3.0 * Math.PI) * (size * size * size);
  }
}

/** Fills in a stream's name, and its rate in particles per second. */
function fillRate(stream: any, number: number, kind: Particle) {
  stream.name ??= number ? `stream${number + 1}` : "stream";
  if (typeof stream.rate !== "string") return;
  const found = /^ *(\d+\.?\d*(?:[eE][+-]?\d+)?) *t\/h *$/.exec(stream.rate);
  let mass = kind.mass;
  if (kind.span !== undefined) {
    const [low, high] = kind.span;
    const cube = kind.radius * kind.radius * kind.radius;
    mass = kind.mass * 0.25 * (low + high) * (low * low + high * high) / cube;
  }
  stream.rate = Number(found?.[1]) / 3.6 / mass / slices(stream, kind);
}

/** Returns the width of a stream's material in slices of one particle's thickness. */
export function slices({ width }: Stream, kind: Particle) {
  return width === undefined ? 1.0 : width / (2.0 * kind.radius);
}

/**
 * Returns restitution and friction of a kind of particles and another kind, or a surface. Values
 * come first from the pair, then from the surface (or a stream of the kind), then from the
 * material, then from the default. For two different kinds without a value it is the geometric mean
 * of the values of each with itself.
 * @param other a kind, or the name of a surface
 * @returns friction is Infinity with adhesion
 */
export function met(scene: Scene, kind: number, other: number | string): [number, number] {
  const particle = scene.particles[kind];
  let partner: string | undefined;
  let values: [number, any];
  if (typeof other === "string") {
    partner = other;
    const { steel, home, belt } = surfaceTable(scene, other);
    values = ownValues(scene, particle, [home], steel ? "_steel" : "_rubber", belt);
  } else if (other === kind) {
    partner = particle.name;
    const own = scene.streams.filter((_, n) => scene.kinds[n] === kind);
    const homes = own.length ? own : [{ restitution: 0.5, friction: 0.3, given: {} }];
    values = ownValues(scene, particle, homes, "", false);
  } else {
    partner = scene.particles[other].name;
    const [a, b] = [met(scene, kind, kind), met(scene, other, other)];
    values = [Math.sqrt(a[0] * b[0]), Math.sqrt(a[1] * b[1])];
  }
  let [restitution, friction] = values;
  for (const pair of scene.pair.slice().reverse()) {
    if (isOf(pair, particle.name, partner)) {
      restitution = pair.restitution ?? restitution;
      friction = pair.friction ?? friction;
    }
  }
  return [restitution, friction === "adhesion" ? Infinity : friction];
}

/**
 * @param homes tables that may have them
 * @param column of the material
 * @param grips whether friction belongs to the belt only
 */
function ownValues(
  scene: Scene, particle: Particle, homes: { restitution: number, friction: any, given: Given }[],
  column: string, grips: boolean,
): [number, any] {
  const material = particle.material === undefined ? null
    : scene.materials.get(particle.material) ?? null;
  const value = (key: "restitution" | "friction") => {
    const said = homes.find((home) => key in home.given);
    const own = said === undefined && !(grips && key === "friction");
    return own && material !== null ? material[key + column] : (said ?? homes[0])[key];
  };
  return [value("restitution"), value("friction")];
}

/** Returns the table of a surface, by its name, and its material. */
function surfaceTable(
  scene: Scene, name: string,
): { home: any, steel: boolean, belt: boolean } {
  if (name === "incoming") return { home: scene.incoming, steel: false, belt: true };
  if (name === "outgoing") return { home: scene.outgoing, steel: false, belt: false };
  const plate = scene.plates.find((one) => (one.pivot ? one.name : "plate") === name);
  if (plate !== undefined) return { home: plate, steel: true, belt: false };
  const conveyor = scene.conveyor.find((one) => one.name === name);
  if (conveyor !== undefined) return { home: conveyor, steel: false, belt: false };
  const surface = scene.surface.find((one) => one.name === name);
  return { home: surface, steel: surface?.material === "steel", belt: false };
}
