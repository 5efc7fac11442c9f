// Faults of a scene: values that do not have the form of their key, keys that contradict each
// other, unknown names. The rules are those of Python's `chutelab.scene`.
import { fits, type Form } from "./forms.ts";
import { valueOfTree } from "./formula.ts";
import { RADIANS } from "./trig.ts";
import {
  clinging, moversOf, triggersOf, type Given, type Lab, type Point, type Scene, type Rule,
} from "./scene.ts";

/** The content of a `Fault`: key, value, id of a text, and its words. */
type Wrong = [string, unknown, string, Record<string, number | string>?];

/** Tables of joints, in Python's order. */
export const JOINTS = ["string", "rod", "spring", "pin"] as const;

export const isJoint = (table: string) => (JOINTS as readonly string[]).includes(table);

/** Tables that are always lists, and those that may be one. */
const LISTS = ["material", "pair", "conveyor", "surface", "sensor", ...JOINTS];
const EITHER = ["particle", "plate", "stream"];

/** Names that free surfaces may not have. */
const RESERVED = ["incoming", "plate", "outgoing", "particles"];

/** Keys of triggers, which wait until another surface is touched. */
export const WAITS = ["opens_when", "closes_when", "starts_when"];

/** Least width and height of a view, m. */
const LEAST_VIEW = 1e-6;

/** Tables that are for other programs. */
const FOREIGN = ["expect", "live"];

/** Returns a table that may occur once or several times as a list. */
export function listOf(rows: any): Given[] {
  return rows === undefined ? [] : Array.isArray(rows) ? rows : [rows];
}

/** Returns the full path of a key of a table that may occur once or several times. */
export function pathOf(given: Given, table: string, row: number, key: string) {
  return Array.isArray(given[table]) ? `${table}[${row}].${key}` : `${table}.${key}`;
}

function isTable(value: any) {
  return typeof value === "object" && value !== null && !Array.isArray(value);
}

/** Yields values that do not have the form of their key, and keys that are missing or unknown. */
export function* misfitsOf(given: Given, lab: Lab): Generator<Wrong> {
  for (const [table, value] of Object.entries(given)) {
    if (FOREIGN.includes(table) || Object.hasOwn(lab.tables.scene, table)) continue;
    if (!Object.hasOwn(lab.tables, table) || table === "scene") yield [table, value, "unknown-key"];
    const list = LISTS.includes(table) || (EITHER.includes(table) && Array.isArray(value));
    const sound = list ? Array.isArray(value) && value.every(isTable) : isTable(value);
    if (!sound) yield [table, value, "form"];
    if (EITHER.includes(table) && list && table !== "plate" && !value.length) {
      yield [table, value, "form"];
    }
  }
  yield* misfitsOfTable(given, lab.tables.scene, (key) => key, Object.keys(given));
  for (const [table, rules] of Object.entries(lab.tables)) {
    if (table === "scene" || FOREIGN.includes(table)) continue;
    for (const [n, row] of listOf(given[table]).entries()) {
      yield* misfitsOfTable(row, rules, (key) => pathOf(given, table, n, key));
    }
  }
}

function* misfitsOfTable(
  row: Given, rules: Record<string, Rule>, path: (key: string) => string,
  known: string[] = Object.keys(rules),
): Generator<Wrong> {
  const unknown = Object.keys(row).find((key) => !known.includes(key));
  if (unknown !== undefined) yield [path(unknown), row[unknown], "unknown-key"];
  for (const [key, { form, low, high, required, parts }] of Object.entries(rules)) {
    const value = row[key];
    if (value === undefined) {
      if (required) yield [path(key), value, "missing"];
    } else if (parts && isTable(value)) {
      yield* misfitsOfTable(value, parts, (name) => `${path(key)}.${name}`);
    } else if (parts) yield [path(key), value, "form"];
    else if (!fits(value, form)) {
      const number = typeof value === "number" && low !== undefined && high !== undefined;
      const least = leastOf(form);
      if (number && least !== undefined) {
        yield [path(key), value, "range-or-none", { low: least, high }];
      } else if (number) yield [path(key), value, "range", { low, high }];
      else yield [path(key), value, "form"];
    }
  }
}

/** Returns the least number above 0 that a form allows, if it allows 0. */
function leastOf({ anyOf, not }: Form): number | undefined {
  return not ? not.exclusiveMaximum : anyOf?.map(leastOf).find((least) => least !== undefined);
}

/**
 * Yields names that are given twice, missing, or unknown.
 * @param kinds names of the kinds of particles
 * @param materials names
 */
export function* straysOf(
  given: Given, kinds: (string | undefined)[], materials: string[],
): Generator<Wrong> {
  const surfaces = ["incoming", "plate", "outgoing"].filter((table) => given[table] !== undefined);
  const taken = new Set();
  for (const table of ["plate", "conveyor", "surface", "particle", "stream", "material", "sensor"]) {
    const free = ["plate", "conveyor", "surface"].includes(table);
    const own = free ? taken : new Set(table === "particle" ? taken : []);
    const rows = listOf(given[table]);
    for (const [n, { name }] of rows.entries()) {
      const path = pathOf(given, table, n, "name");
      if (name === undefined) {
        if (table === "particle" && rows.length > 1) yield [path, name, "missing"];
        continue;
      }
      if (own.has(name)) yield [path, name, "same-name"];
      if (RESERVED.includes(name)) yield [path, name, "reserved-name"];
      own.add(name);
      if (free) surfaces.push(name);
    }
  }
  for (const [n, { particle }] of listOf(given.stream).entries()) {
    if (particle !== undefined && !kinds.includes(particle)) {
      yield [pathOf(given, "stream", n, "particle"), particle, "no-such-kind"];
    }
  }
  for (const [n, { material }] of listOf(given.particle).entries()) {
    if (material !== undefined && !materials.includes(material)) {
      yield [pathOf(given, "particle", n, "material"), material, "no-such-material"];
    }
  }
  for (const [n, { between, meet }] of listOf(given.pair).entries()) {
    const key = `pair[${n}].between`;
    if (!between.some((name: string) => kinds.includes(name))) {
      yield [key, between, "no-such-kind"];
    } else if (meet === false && !between.every((name: string) => kinds.includes(name))) {
      yield [`pair[${n}].meet`, meet, "meet-surface"];
    }
    for (const [place, name] of between.entries()) {
      if (![...kinds, ...surfaces].includes(name)) yield [`${key}[${place}]`, name, "no-such-name"];
    }
  }
  for (const table of ["plate", "surface"]) {
    for (const [n, row] of listOf(given[table]).entries()) {
      for (const key of WAITS) {
        const touched = row[key]?.touched;
        if (touched !== undefined && !surfaces.includes(touched)) {
          yield [pathOf(given, table, n, `${key}.touched`), touched, "no-such-name"];
        }
      }
    }
  }
}

/** Yields contradictions. */
export function* conflictsOf(scene: Scene, given: Given, lab: Lab): Generator<Wrong> {
  yield* beltConflicts(scene);
  yield* kindConflicts(scene, given);
  yield* contradictions(scene, given, lab);
  yield* pieceConflicts(scene);
  yield* motionConflicts(scene, given);
  yield* corneredConflicts(scene, given);
  for (const n of scene.streams.keys()) yield* streamConflicts(scene, given, n);
  const { most } = scene;
  if (scene.count > most) {
    const counts = scene.streams.map(({ count }) => count), n = counts.indexOf(Math.max(...counts));
    yield [pathOf(given, "stream", n, "count"), counts[n], "too-many", { high: most }];
  }
  const { view } = scene;
  if (view?.to.some((end, n) => end - view.from[n] < LEAST_VIEW)) {
    yield ["view.to", view.to, "view-corners"];
  }
}

/** m; least length of a surface. */
const LEAST_LENGTH = 1e-9;

/** kg; less than any atom. */
const LEAST_MASS = 1e-27;

/** Most straight and bent pieces of all surfaces with their copies. */
const MOST_PIECES = 10_000;

function tooNear(a: Point | undefined, b: Point | undefined) {
  return a !== undefined && b !== undefined && Math.hypot(b[0] - a[0], b[1] - a[1]) < LEAST_LENGTH;
}

function* beltConflicts(scene: Scene): Generator<Wrong> {
  const { incoming, outgoing } = scene;
  const damps = scene.plates.some((plate) => plate.pivot === undefined);
  if (incoming === null && (damps || outgoing !== null)) {
    yield ["incoming", undefined, "needs-incoming"];
  }
  if (incoming !== null && scene.gravity_deg !== 0.0) {
    yield ["gravity_deg", scene.gravity_deg, "upright"];
  }
  if (outgoing?.drop_from === "impact") yield ["outgoing.drop_from", "impact", "drop-from-impact"];
}

/** Yields surfaces with points too near to each other, and the one with which there are too many
 * pieces. */
function* pieceConflicts(
  { incoming, outgoing, plates, conveyor, surface }: Scene,
): Generator<Wrong> {
  let count = Number(incoming !== null) + Number(outgoing !== null) + plates.length;
  count += 4 * conveyor.length;
  for (const [n, one] of surface.entries()) {
    if (one.points?.some((point, place) => tooNear(point, one.points?.[place + 1]))) {
      yield [`surface[${n}].points`, one.points, "same-points"];
    }
    const { points, repeat, opens_at: opens, closes_at: closes, passes } = one;
    const across = passes === "left" || passes === "right" ? 1 : 0;
    const steps = (points ?? []).slice(1).map((point, place) =>
      point[across] - (points ?? [])[place][across]);
    if (passes && Math.min(...steps) <= 0 && Math.max(...steps) >= 0) {
      yield [`surface[${n}].passes`, passes, "passes-back"];
    }
    const twice = opens !== undefined && closes !== undefined && opens < closes;
    count += repeat.reduce((many, [copies]) => many * copies,
      Math.max(1, (points?.length ?? 0) - 1) * (twice ? 2 : 1));
    if (count > MOST_PIECES) {
      const key = repeat.length ? "repeat" : "points";
      yield [`surface[${n}].${key}`, one[key], "too-many", { high: MOST_PIECES }];
      return;
    }
  }
}

/** Whether there are several particles that do not meet. */
const isApart = ({ count, crowded }: Scene) => count > 1 && !crowded;

/** Yields faults of hinges, joints and triggers, and features that the requested engine cannot run.
 */
function* motionConflicts(scene: Scene, given: Given): Generator<Wrong> {
  const { streams, run } = scene, movers = moversOf(scene), waits = triggersOf(scene).length > 0;
  const clings = scene.pair.findIndex(clinging);
  const isOneSided = scene.surface.some(({ passes }) => passes);
  if (run.engine === "exact" && (movers.length || scene.crowded || waits || isOneSided
    || scene.joints.length || scene.particles.some(({ outline }) => outline.length))) {
    yield ["run.engine", run.engine, "not-exact"];
  }
  if ((waits || movers.some(([, { hinge }]) => hinge)) && isApart(scene)) {
    yield [pathOf(given, "stream", 0, "interact"), streams[0].interact, "hinge-meet"];
  }
  if (scene.joints.length && isApart(scene)) {
    yield [pathOf(given, "stream", 0, "interact"), streams[0].interact, "joint-meet"];
  }
  if (clings >= 0 && movers.some(([, { hinge }]) => hinge)) {
    const pair = scene.pair[clings], key = clinging(pair)!;
    yield [`pair[${clings}].${key}`, pair[key], "hinge-clings"];
  }
  for (const [, { stops_deg: stops, given: row }] of movers) {
    const table = scene.surface.some((one) => one.given === row) ? "surface" : "plate";
    const n = listOf(given[table]).indexOf(row);
    if (stops && !(stops[0] <= 0 && stops[1] >= 0 && stops[0] < stops[1])) {
      yield [pathOf(given, table, n, "stops_deg"), stops, "stops"];
    }
  }
}

/** Yields features that the contact engine lacks for boxes and polygons. */
function* corneredConflicts(scene: Scene, given: Given): Generator<Wrong> {
  const { particles, pair } = scene, text = "cornered";
  if (!particles.some(({ outline }) => outline.length)) return;
  for (const [n, { outline, rolling_friction: rolls, points }] of particles.entries()) {
    if (outline.length && rolls) yield [pathOf(given, "particle", n, "rolling_friction"), rolls, text];
    if (points && !isConvex(points)) yield [pathOf(given, "particle", n, "points"), points, "convex"];
  }
  for (const [n, { width, particle }] of scene.streams.entries()) {
    const own = particles[scene.kinds[n]];
    if (own.outline.length && width !== undefined) {
      yield [pathOf(given, "stream", n, "width"), particle, "other-shape"];
    }
  }
  const clings = pair.findIndex(clinging);
  if (clings >= 0) yield [`pair[${clings}].${clinging(pair[clings])}`, undefined, text];
}

/** Whether points are the corners of a convex polygon, in their order. */
function isConvex(points: Point[]) {
  const turns = points.map(([x, y], n) => {
    const [[u, v], [p, q]] = [1, 2].map((k) => points[(n + k) % points.length]);
    return (u - x) * (q - v) - (v - y) * (p - u);
  });
  return turns.every((turn) => turn > 0) || turns.every((turn) => turn < 0);
}

function* kindConflicts(scene: Scene, given: Given): Generator<Wrong> {
  for (const [n, kind] of scene.particles.entries()) {
    const path = (key: string) => pathOf(given, "particle", n, key);
    if (!(kind.mass >= LEAST_MASS)) yield [path("mass"), kind.mass, "range", { low: LEAST_MASS, high: 1e6 }];
    if (kind.span !== undefined && kind.span[0] >= kind.span[1]) {
      yield [path("radius"), kind.span, "not-ascending"];
    }
  }
}

/** Yields faults within a row of a table, by the rules that Python has, too. */
function* contradictions(scene: Scene, given: Given, { rules }: Lab): Generator<Wrong> {
  const tables: Record<string, any[]> = {
    run: [scene.run], plate: scene.plates, particle: scene.particles, stream: scene.streams,
    surface: scene.surface, conveyor: scene.conveyor, sensor: scene.sensor, pair: scene.pair,
    ...Object.fromEntries(JOINTS.map((table) =>
      [table, scene.joints.filter(({ kind }) => kind === table)])),
  };
  for (const [table, rows] of Object.entries(tables)) {
    for (const [n, row] of rows.entries()) {
      const has = (one: any) => (key: string) => one[key] !== undefined;
      const known: Record<string, unknown> = {
        abs: Math.abs, radians: (angle: number) => angle * RADIANS, near: tooNear, run: scene.run,
        number: Number.isFinite, given: has(row.given), has: has(given), sound: () => true,
        before: (key: string) => rows.slice(0, n).some((one) => has(one.given)(key)),
        value: (key: string) => row[key], gravity: scene.gravity, count: scene.count,
        kind: scene.particles[table === "stream" ? scene.kinds[n] : 0],
      };
      for (const [keys, when, text, other] of rules[table] ?? []) {
        const wrong = keys.find((key) => valueOfTree(when, (name) =>
          (name === "key" ? key : known[name] ?? row[name.replace(/_$/, "")] ?? NaN)));
        if (wrong === undefined) continue;
        const words = other === undefined ? undefined : { other };
        yield [pathOf(given, table, n, wrong), row.given[wrong] ?? row[wrong], text, words];
      }
    }
  }
}

/** @param n of the stream */
function* streamConflicts(scene: Scene, given: Given, n: number): Generator<Wrong> {
  const stream = scene.streams[n];
  const path = (key: string) => pathOf(given, "stream", n, key);
  if (!Number.isFinite(stream.rate)) yield [path("rate"), stream.given.rate, "form"];
  const size = 2.0 * scene.particles[scene.kinds[n]].radius;
  if (stream.width !== undefined && stream.width < size) {
    yield [path("width"), stream.width, "range", { low: size, high: 1e6 }];
  }
}
