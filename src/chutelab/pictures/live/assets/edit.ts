// New surfaces and particles, and taking them away: each a scene made of another.

import type { Machine } from "./machine.ts";
import type { Given } from "./scene.ts";

/** @param rows a table, several, or none */
const listed = (
  rows: any,
): any[] => (rows === undefined ? [] : Array.isArray(rows) ? rows : [rows]);

const either = (rows: any[]) => (rows.length === 1 ? rows[0] : rows);

/** A name that nothing has yet. */
function freeName(given: Given, stem: string) {
  const taken = new Set(["surface", "plate", "conveyor", "stream"].flatMap((table) =>
    listed(given[table]).map(({ name }) => name)));
  let n = 1;
  while (taken.has(`${stem}${n}`)) n += 1;
  return `${stem}${n}`;
}

const withLine = (given: Given, from: [number, number], to: [number, number]): Given => ({
  ...given, surface: [...listed(given.surface), { name: freeName(given, "line"), from, to }],
});

/** The arc through three points, or the line where they are on one.
 * @param b on its way */
function withArc(
  given: Given, a: [number, number], b: [number, number], c: [number, number],
): Given {
  const [ux, uy, vx, vy] = [b[0] - a[0], b[1] - a[1], c[0] - a[0], c[1] - a[1]];
  const twice = 2 * (ux * vy - uy * vx), u = ux * ux + uy * uy, v = vx * vx + vy * vy;
  if (Math.abs(twice) < 1e-3 * Math.max(u, v)) return withLine(given, a, c);
  const x = (vy * u - uy * v) / twice, y = (ux * v - vx * u) / twice;
  const round = (value: number) => Math.round(value * 1e4) / 1e4;
  const angle = ([px, py]: [number, number]) =>
    (Math.atan2(py - a[1] - y, px - a[0] - x) * 180) / Math.PI;
  const turn = (from: number, to: number) => (to - from + 720) % 360;
  const [begin, middle, end] = [angle(a), angle(b), angle(c)];
  const forward = turn(begin, middle) <= turn(begin, end);
  const extent = forward ? turn(begin, end) : turn(begin, end) - 360;
  return {
    ...given,
    surface: [...listed(given.surface), {
      name: freeName(given, "arc"), center: [round(a[0] + x), round(a[1] + y)],
      radius: round(Math.hypot(x, y)), from_deg: Math.round(10 * begin) / 10,
      to_deg: Math.round(10 * (begin + extent)) / 10,
    }],
  };
}

/** A particle that is let go at rest, of the first kind; with what is there already.
 * @param start s */
function withParticle(given: Given, at: [number, number], start: number): Given {
  const kinds = listed(given.particle), kind = kinds.length > 1 ? { particle: kinds[0].name } : {};
  return {
    ...given,
    stream: [...(given.stream === undefined ? [{}] : listed(given.stream)),
      { name: freeName(given, "drop"), ...kind, at, velocity: [0, 0], count: 1, start }],
  };
}

/** The surface nearest to a place within reach; "" if none is.
 * @param reach m */
function surfaceAt(
  { surfaces, segments, arcs, pulley }: Machine, x: number, y: number, reach: number,
) {
  let least = reach, found = "";
  const take = (far: number, surface: number) => {
    if (far < least) [least, found] = [far, surfaces[surface]];
  };
  for (const one of segments) {
    const [u, v] = [x - one.x, y - one.y];
    const along = Math.min(one.length, Math.max(0, u * one.tx + v * one.ty));
    take(Math.hypot(u - along * one.tx, v - along * one.ty), one.surface);
  }
  const round = 2 * Math.PI;
  for (const one of arcs) {
    const [u, v] = [x - one.x, y - one.y], turn = Math.atan2(v, u) - one.begin;
    if (turn - round * Math.floor(turn / round) > one.extent) continue;
    take(Math.abs(Math.hypot(u, v) - one.radius), one.surface);
  }
  if (pulley) take(Math.max(0, Math.hypot(x, y) - pulley.radius), pulley.surface);
  return found;
}

/** What has a name of its own, or the damping plate or the outgoing belt, taken away. */
function without(given: Given, name: string): Given {
  const rest = { ...given };
  for (const table of ["surface", "conveyor", "plate", "stream"]) {
    if (given[table] === undefined) continue;
    const kept = listed(given[table]).filter((row) =>
      row.name !== name && !(table === "plate" && name === "plate" && !row.pivot));
    const many = table === "surface" || table === "conveyor";
    if (kept.length) rest[table] = many ? kept : either(kept);
    else if (table !== "stream") delete rest[table];
  }
  if (name === "outgoing") delete rest.outgoing;
  return rest;
}

/** Whether `without` takes something away. */
const canGo = (given: Given, name: string) =>
  JSON.stringify(without(given, name)) !== JSON.stringify(given);

export { canGo, surfaceAt, withArc, withLine, withParticle, without };
