// Parts added, copied and removed: each function makes a scene from another.

import { gapToArc, gapToSegment } from "./arrival.ts";
import { JOINTS, WAITS, isJoint, listOf } from "./checks.ts";
import { valueAt, withValues } from "./keys.ts";
import type { Machine } from "./machine.ts";
import type { Given, Scene } from "./scene.ts";

type Point = [number, number];

/** A row of the palette, see `PARTS` in describe.py. */
export type Part = { part: string, letter: string, table: string, places: string[],
  main: string[], needs: string[], row: Given };

/** Tables whose rows have names. */
const NAMED = ["surface", "conveyor", "plate", "stream", "sensor"];

/** Tables of things without a place, chosen by table and name or number. */
const PLAIN = ["material", "pair"];

/** Keys that are places, or lists of them. */
const PLACES = ["from", "to", "points", "center", "pivot", "at", "fill", "hinge"];

/** Radius of a ball in a picture one metre high, m. */
const BALL = 0.02;

const either = (rows: any[]) => (rows.length === 1 ? rows[0] : rows);

/** Named rows of a table; one for the stream that a scene has by default. */
const rowsOf = (given: Given, table: string): Given[] =>
  (table === "stream" && given.stream === undefined ? [{}] : listOf(given[table]));

/** An unused name. */
function freeName(given: Given, stem: string) {
  const taken = new Set([...NAMED, "particle", "material"].flatMap((table) =>
    listOf(given[table]).map(({ name }) => name)));
  let n = 1;
  while (taken.has(`${stem}${n}`)) n += 1;
  return `${stem}${n}`;
}

/** Append a row to its table. */
const withRow = (given: Given, table: string, row: Given): Given => (table === "incoming"
  ? { ...given, incoming: row } : { ...given, [table]: [...rowsOf(given, table), row] });

const roundOff = (value: number, digits: number) => Number(value.toFixed(digits));

/** The keys of the arc from one point to another through a third, or of the line if they are on
 * one. */
function arcOf(a: Point, c: Point, b: Point): Given {
  const [ux, uy, vx, vy] = [b[0] - a[0], b[1] - a[1], c[0] - a[0], c[1] - a[1]];
  const twice = 2 * (ux * vy - uy * vx), u = ux * ux + uy * uy, v = vx * vx + vy * vy;
  if (Math.abs(twice) < 1e-3 * Math.max(u, v)) return { points: [a, c] };
  const x = (vy * u - uy * v) / twice, y = (ux * v - vx * u) / twice;
  const angle = ([px, py]: Point) => (Math.atan2(py - a[1] - y, px - a[0] - x) * 180) / Math.PI;
  const turn = (from: number, to: number) => (to - from + 720) % 360;
  const [begin, middle, end] = [angle(a), angle(b), angle(c)];
  const forward = turn(begin, middle) <= turn(begin, end);
  const extent = forward ? turn(begin, end) : turn(begin, end) - 360;
  return {
    center: [roundOff(a[0] + x, 4), roundOff(a[1] + y, 4)], radius: roundOff(Math.hypot(x, y), 4),
    from_deg: roundOff(begin, 1), to_deg: roundOff(begin + extent, 1),
  };
}

/** Keys of a part that belong to the kind of its particles. */
const KIND = ["shape", "size", "mass", "spin", "material"];

/** A kind of balls or boxes of a material, made if necessary; without a material the first kind.
 * @param radius m, of new balls
 * @param box keys of new boxes; none for balls
 * @returns the scene, and the name of the kind if there are several */
function withKind(
  given: Given, material: string, radius: number, box: Given,
): [Given, string | undefined] {
  const empty = Array.isArray(given.stream) && !given.stream.length && !given.particle;
  let kinds = empty ? [] : listOf(given.particle ?? {});
  const alike = kinds.filter(({ size, points }) => (box.size ? size : !size && !points));
  if (!material && alike.length) return [given, kinds.length > 1 ? alike[0].name : undefined];
  const wanted = material || (box.material ?? "steel");
  const known = alike.find((one) => one.material === wanted);
  if (known) return [given, kinds.length > 1 ? known.name : undefined];
  // If there are several, each has a name.
  kinds = kinds.map((one) => ({ name: freeName(given, "kind"), ...one }));
  const name = kinds.some((one) => one.name === wanted) ? freeName(given, wanted) : wanted;
  const size = alike.length ? alike[0].radius ?? 0.0063 : radius;
  const made = box.size ? box : { shape: "sphere", radius: size, spin: true };
  return [{ ...given, particle: [...kinds, { ...made, name, material: wanted }] }, name];
}

/** For each particle the name of its stream and its number there, which do not change. */
const calledOf = (given: Given) => rowsOf(given, "stream").flatMap(({ name, count = 1 }, n) =>
  Array.from({ length: count }, (_, k) => `${k} ${name ?? (n ? `stream${n + 1}` : "stream")}`));

/** A scene whose joints hold the same particles as before its streams were changed, without joints
 * of removed ones. */
function retied(before: Given, after: Given): Given {
  if (!JOINTS.some((table) => after[table])) return after;
  const was = calledOf(before), now = new Map(calledOf(after).map((name, i) => [name, i]));
  return JOINTS.reduce((scene, table) => {
    const rows = listOf(scene[table]).flatMap((row) => {
      const held = Object.fromEntries(["particle", "other"].filter((key) => key in row)
        .map((key) => [key, now.get(was[row[key]])]));
      const first = now.get(was[row.particle ?? 0]);
      if (first === undefined || Object.values(held).includes(undefined)) return [];
      return [{ ...row, ...(first || held.particle ? { particle: first } : {}), ...held }];
    });
    const { [table]: _, ...rest } = scene;
    return rows.length ? { ...rest, [table]: rows } : rest;
  }, after);
}

/** The particles that are released at a place, the nearest first.
 * @param reach m, from the centres of smaller particles */
function particlesAt({ releases, radius }: Machine, [px, py]: Point, reach: number): number[] {
  const far = releases.map(({ x, y }) => Math.hypot(x - px, y - py));
  return [...far.keys()].filter((i) => far[i] <= Math.max(radius[i], reach))
    .sort((a, b) => far[a] - far[b]);
}

/** A scene with one more joint; if there is no particle at its place, a ball is made.
 * @param points the end (of a pin its place), m, and that of the particle
 * @param ball of the palette
 * @param reach m, from the centre of a particle */
function withJoint(
  given: Given, part: Part, points: Point[], unit: number, material: string,
  machine: Machine | undefined, ball: Part, reach: number,
): Given {
  const there = (at: Point) => (machine ? particlesAt(machine, at, reach) : []);
  const count = machine?.releases.length ?? 0, pin = part.table === "pin", [first, last] = points;
  const ends = there(first), [other] = ends;
  const own = pin ? other : there(last).find((i) => i !== other);
  const at: Point = pin ? [roundOff(first[0] + 0.8 * BALL * unit, 6), first[1]] : last;
  const made = own !== undefined ? given
    : withPart(given, ball, [at], unit, material, 0, {});
  const row: Given = { particle: own ?? count };
  if (pin) Object.assign(row, { from: first }, ends.length > 1 && { other: ends[1] });
  else Object.assign(row, other === undefined ? { from: first } : { other });
  // So that its weight stretches it by a share of the view.
  const mass = machine?.mass[own ?? 0] ?? 0.26 * unit ** 3;
  if (part.table === "spring") row.stiffness = Number((60 * mass / unit).toPrecision(1));
  const streams = rowsOf(made, "stream");
  const meet = streams.some(({ interact }) => interact) || count < 2;
  return withRow(meet ? made : { ...made, stream: streams.map((one) =>
    ({ ...one, interact: true })) }, part.table, row);
}

/** A scene with a line that disappears when a surface is touched; a surface is made if there is
 * none.
 * @param points its ends, and one of that surface, m */
function withTrigger(
  given: Given, part: Part, [from, to, [x, y]]: Point[], unit: number,
  machine: Machine | undefined, reach: number,
): Given {
  const there = machine ? surfaceAt(machine, x, y, reach) : "";
  const name = there || freeName(given, "bell");
  const ends = [-0.06, 0.06].map((share) => [roundOff(x + share * unit, 6), y]);
  const bell = { name, points: ends };
  const made = there ? given : withRow(given, "surface", bell);
  return withRow(made, "surface", { name: freeName(made, part.part), points: [from, to],
    ...part.row, opens_when: { touched: name } });
}

/** A scene with one more part.
 * @param points set, m
 * @param unit m for one metre of the part's own sizes
 * @param material of particles, "" for that of the first
 * @param start s, when a stream begins
 * @param rules of the part's table */
function withPart(
  given: Given, part: Part, points: Point[], unit: number, material: string, start: number,
  rules: Record<string, { unit?: string }>,
): Given {
  const row: Given = part.table === "incoming" ? {} : { name: freeName(given, part.part) };
  part.places.forEach((key, n) => {
    if (key === "points") row.points = [...(row.points ?? []), points[n]];
    else if (key !== "arc" && !key.includes(".")) row[key] = points[n];
  });
  if (part.places[0] === "arc") Object.assign(row, arcOf(points[0], points[1], points[2]));
  for (const [key, value] of Object.entries(part.row)) {
    row[key] = key === "repeat"
      ? value.map(([n, x, y]: number[]) => [n, roundOff(x * unit, 6), roundOff(y * unit, 6)])
      : rules[key]?.unit === "m" && typeof value === "number" ? roundOff(value * unit, 6)
        : structuredClone(value);
  }
  // A vertical line has a left and a right side.
  if (row.passes) {
    const [dx, dy] = [0, 1].map((n) => Math.abs(points[1][n] - points[0][n]));
    if (dx < dy) row.passes = "right";
  }
  if (row.travel) row.travel.to = points[part.places.indexOf("travel.to")];
  if (part.table !== "stream") return withRow(given, part.table, row);
  const box: Given = {};
  for (const key of KIND) {
    if (key in row) box[key] = row[key];
    delete row[key];
  }
  if (box.size) box.size = box.size.map((one: number) => roundOff(one * unit, 6));
  if (box.mass) box.mass = Number((box.mass * unit ** 3).toPrecision(2));
  const [kinds, kind] = withKind(given, material, BALL * unit, box);
  if (kind) row.particle = kind;
  if (start) row.start = start;
  return withRow(kinds, "stream", row);
}

/** A scene with one more material, like a known one, or one more pair, of the first things that can
 * meet.
 * @param known keys of a material
 * @param surfaces names */
function withRowOf(
  table: "material" | "pair", given: Given, known: Given, surfaces: string[],
): Given {
  const kinds = listOf(given.particle ?? {})
    .map((one) => ({ name: freeName(given, "kind"), ...one }));
  const row = table === "material" ? { name: freeName(given, table), ...known }
    : { between: [kinds[0].name, surfaces[0] ?? kinds[0].name], restitution: 0.5, friction: 0.3 };
  const named = table === "pair" ? { ...given, particle: either(kinds) } : given;
  return { ...named, [table]: [...listOf(given[table]), row] };
}

/** Rows of things by name, for copies. Joints have the names of their particles. */
function rowsNamed(given: Given, names: string[]): [string, Given][] {
  const own = NAMED.flatMap((table) => listOf(given[table])
    .filter(({ name }) => names.includes(name)).map((row): [string, Given] => [table, row]));
  if (!JOINTS.some((table) => given[table])) return own;
  const called = calledOf(given);
  return [...own, ...JOINTS.flatMap((table) => listOf(given[table])
    .filter((_, n) => names.includes(`${table} ${n + 1}`)).map((row): [string, Given] =>
      [table, { ...row, particle: called[row.particle ?? 0],
        ...("other" in row && { other: called[row.other] }) }]))];
}

/** A scene with copies of rows, moved on.
 * @returns it, and the names of the copies */
function withCopies(given: Given, rows: [string, Given][], [dx, dy]: Point): [Given, string[]] {
  const moved = (value: any): any => (typeof value[0] === "number"
    ? [roundOff(value[0] + dx, 9), roundOff(value[1] + dy, 9)] : value.map(moved));
  const names: string[] = [], made: Given[] = [], copies = new Map<string, string>();
  const all = rows.reduce((scene, [table, row]) => {
    if (isJoint(table)) {
      const called = calledOf(scene), copy = structuredClone(row);
      for (const key of ["particle", "other"].filter((one) => one in row)) {
        const [, n, stream] = /^(\d+) (.*)$/.exec(row[key]) as string[];
        copy[key] = called.indexOf(`${n} ${copies.get(stream) ?? stream}`);
        if (copy[key] < 0) return scene;
      }
      for (const key of ["from", "over"]) if (copy[key]) copy[key] = moved(copy[key]);
      names.push(`${table} ${listOf(scene[table]).length + 1}`);
      return withRow(scene, table, copy);
    }
    const name = freeName(scene, row.name.replace(/\d+$/, ""));
    const copy: Given = { ...structuredClone(row), name };
    for (const key of PLACES) if (Array.isArray(copy[key])) copy[key] = moved(copy[key]);
    if (copy.travel) copy.travel.to = moved(copy.travel.to);
    names.push(name);
    copies.set(row.name, name);
    made.push(copy);
    return withRow(scene, table, copy);
  }, given);
  // If a part is copied with the surface of its trigger, the copy waits for the copied surface.
  for (const copy of made) {
    for (const when of WAITS) {
      const touched = copies.get(copy[when]?.touched);
      if (touched) copy[when].touched = touched;
    }
  }
  return [all, names];
}

/** The surface or the sensor nearest to a place within reach; "" if none is.
 * @param reach m */
function surfaceAt(
  { surfaces, segments, arcs, pulley }: Machine, x: number, y: number, reach: number,
  sensors: Scene["sensor"] = [],
) {
  const gauges = sensors.map(({ name, from: [u, v], to }): [string, number] => {
    const length = Math.hypot(to[0] - u, to[1] - v);
    const [tx, ty] = [(to[0] - u) / length, (to[1] - v) / length];
    return [name, gapToSegment({ x: u, y: v, tx, ty, length }, x, y)];
  });
  const all: [string, number][] = [
    ...segments.map((one): [string, number] => [surfaces[one.surface], gapToSegment(one, x, y)]),
    ...gauges,
    ...arcs.map((one): [string, number] => [surfaces[one.surface], gapToArc(one, x, y)]),
    ...(pulley ? [[surfaces[pulley.surface],
      Math.max(0, Math.hypot(x, y) - pulley.radius)] as [string, number]] : []),
  ];
  return all.reduce((best, one) => (one[1] < best[1] ? one : best), ["", reach])[0];
}

/** A scene with a new name of a thing, wherever it is used.
 * @param key its full path */
function withName(given: Given, key: string, name: string): Given {
  const old = valueAt(given, key), renamed = withValues(given, { [key]: name });
  for (const pair of listOf(renamed.pair)) {
    pair.between = pair.between.map((one: string) => (one === old ? name : one));
  }
  for (const row of [...listOf(renamed.plate), ...listOf(renamed.surface)]) {
    for (const when of WAITS) if (row[when]?.touched === old) row[when].touched = name;
  }
  if (key.startsWith("material")) {
    const kinds = listOf(renamed.particle).filter(({ material }) => material === old);
    for (const kind of kinds) kind.material = name;
  }
  if (key.startsWith("particle")) {
    const streams = listOf(renamed.stream).filter(({ particle }) => particle === old);
    for (const stream of streams) stream.particle = name;
  }
  return renamed;
}

/** The ends of lines and arcs of a machine, m, except those of some parts. */
function endsOf({ surfaces, segments, arcs }: Machine, not: string[]): Point[] {
  const isOther = ({ surface }: { surface: number }) => !not.includes(surfaces[surface]);
  const lines = segments.filter(isOther).flatMap(({ ends: [x, y, u, v] }) =>
    [[x, y], [u, v]] as Point[]);
  const bends = arcs.filter((arc) => isOther(arc) && arc.extent < 2 * Math.PI).flatMap((arc) =>
    [arc.begin, arc.begin + arc.extent].map((angle) => [
      arc.x + arc.radius * Math.cos(angle), arc.y + arc.radius * Math.sin(angle)] as Point));
  return [...lines, ...bends].map((point) => point.map((value) =>
    Number(value.toPrecision(12))) as Point);
}

/** The names of what waits for a touch of one of some parts, and is none of them. */
function waitingFor(given: Given, names: string[]): string[] {
  return ["plate", "surface"].flatMap((table) => rowsOf(given, table)
    .filter((row) => WAITS.some((key) => names.includes(row[key]?.touched)))
    .map(({ name }) => name ?? table)).filter((name) => !names.includes(name));
}

/** A scene without some parts, by name; without particles there is no stream. */
function without(given: Given, ...names: string[]): Given {
  const rest = { ...given };
  for (const table of NAMED) {
    if (given[table] === undefined && table !== "stream") continue;
    const kept = rowsOf(given, table).filter(({ name, pivot }, n) => !names.includes(
      name ?? (table === "plate" && !pivot ? "plate" : n ? `${table}${n + 1}` : table)));
    if (kept.length === rowsOf(given, table).length) continue;
    const many = table === "surface" || table === "conveyor" || !kept.length;
    if (kept.length || table === "stream") rest[table] = many ? kept : either(kept);
    else delete rest[table];
  }
  for (const table of ["incoming", "outgoing"]) if (names.includes(table)) delete rest[table];
  for (const table of [...PLAIN, ...JOINTS]) {
    // Pairs are removed with either of the two.
    const rows = listOf(given[table]).filter(({ name, between = [] }, n) =>
      ![`${table} ${name ?? n + 1}`, ...between].some((one) => names.includes(one)));
    if (rows.length) rest[table] = rows;
    else delete rest[table];
  }
  // Remove triggers of removed parts.
  const isGone = ({ touched }: Given = {}) => touched && names.includes(touched);
  const freed = (row: Given) => Object.fromEntries(Object.entries(row)
    .filter(([key, value]) => !WAITS.includes(key) || !isGone(value)));
  for (const table of ["plate", "surface"]) {
    if (!listOf(rest[table]).some((row) => WAITS.some((key) => isGone(row[key])))) continue;
    rest[table] = Array.isArray(rest[table]) ? rest[table].map(freed) : freed(rest[table]);
  }
  return retied(given, rest);
}

/** The motion of a row of a plate or surface. */
const motionOf = ({ turn, shake, travel, hinge }: Given) => (hinge ? "hinge" : travel ? "travels"
  : shake ? "shakes" : turn ? "turns" : "still");

/** Keys of motions. */
const MOVES = ["turn", "shake", "travel", "hinge", "mass", "inertia", "spring", "rest_deg",
  "damper", "stops_deg", "motor", "starts_when"];

/** A scene in which a part has another motion, with default numbers.
 * @param path of its row
 * @param pivot m
 * @param unit m that look large in the picture */
function withMotion(
  given: Given, path: string, motion: string, [x, y]: Point, unit: number,
): Given {
  const begun: Record<string, Given> = {
    turns: { turn: 90 }, shakes: { shake: { by: [0, 0.003], frequency: 15 } },
    travels: { travel: { to: [roundOff(x, 4), roundOff(y + 0.3 * unit, 4)], at: 0.5, in: 1 } },
    hinge: { hinge: "pivot", mass: 0.2 },
  };
  const { pivot, ...rest } = valueAt(given, path);
  const row: Given = path.startsWith("plate") && pivot ? { ...rest, pivot } : rest;
  for (const key of MOVES) delete row[key];
  return withValues(given, { [path]: { ...row, ...begun[motion] } });
}

/** Whether `without` removes something. */
const canGo = (given: Given, name: string) =>
  JSON.stringify(without(given, name)) !== JSON.stringify(given);

export {
  canGo, endsOf, motionOf, particlesAt, retied, rowsNamed, surfaceAt, waitingFor, withCopies,
  withJoint, withMotion, withName, withPart, withRowOf, withTrigger, without,
};
