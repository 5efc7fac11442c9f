// Has the core judge a run by the laws that every run must keep: what results/laws.py is in Python.

import { KNOT_ROW, type Core, type Machine } from "./core.ts";
import type { Recording } from "./recording.ts";

/** A whole run as the core's laws take it: all knots, and the first of each particle. */
export type Run = { machine: Machine, knots: Float64Array, offsets: number[], books: number[],
  gained: number, contacts: number, steps: number, unreal: number };

/** A law that is broken: by which particle first, when (s) and where (m), and beside what; -1 of
 * particle or surface if it is about all together. */
export type Breach = { law: number, particle: number, surface: number, t: number, x: number,
  y: number };

/** What the laws ask of a recording of a run that is over. */
function runOf({ machine, tracks, events, books, gained, contacts, steps }: Recording): Run {
  const offsets = [0];
  for (const { count } of tracks) offsets.push(offsets[offsets.length - 1] + count);
  const knots = new Float64Array(offsets[tracks.length] * KNOT_ROW);
  tracks.forEach(({ rows, count }, i) => {
    knots.set(rows.subarray(0, count * KNOT_ROW), offsets[i] * KNOT_ROW);
  });
  const unreal = events.flatMap(({ t, x, y, before, after, normal, tangent }) =>
    [t, x, y, ...before, ...after, normal, tangent]).filter((value) => !isFinite(value)).length;
  return { machine, knots, offsets, books: (books ?? []).flat(), gained, contacts, steps, unreal };
}

/** The laws that a run breaks, in the order in which they are told. What the core has in memory
 * stays as it is. */
function judge(core: Core, { machine, knots, offsets, books, ...run }: Run): Breach[] {
  const { gravity, interact, dt, pulley, radius, mass, inertia } = machine;
  const { enums } = core.layout, end = core.get("end", "Room");
  const pieces = barriersOf(machine), count = radius.length;
  core.reset("Laws");
  core.setAll("Laws", {
    particle_count: count, piece_count: pieces.length, knot_count: offsets[count], row: KNOT_ROW,
    book_rows: books.length / 3, surface_count: machine.surfaces.length + 1,
    engine: enums.Engine.ENGINE_CONTACT, interact: Number(interact), pulley: Number(!!pulley),
    dt, largest: radius.reduce((most, own) => Math.max(most, own), 0), ...run,
  });
  core.work("lay_out_laws");
  core.doubles.set(knots, core.get("knots", "Laws") >> 3);
  core.doubles.set(books, core.get("books", "Laws") >> 3);
  core.ints.set(offsets, core.get("offsets", "Laws") >> 2);
  radius.forEach((own, i) => {
    const body = { radius: own, mass: mass[i], inertia: inertia[i], gravity };
    core.fill("bodies", "Body", i, body, "Laws");
  });
  pieces.forEach((row, k) => core.fill("barriers", "Barrier", k, row, "Laws"));
  core.work("judge");
  core.set("end", end, "Room");
  return core.rows("breaches", "Breach", core.get("breach_count", "Laws"), "Laws") as Breach[];
}

/** All pieces of surfaces as the core's laws take them: straight ones, bent ones, the pulley. */
function barriersOf({ segments, arcs, pulley }: Machine) {
  const wheel = { x: 0, y: 0, begin: 0, extent: Infinity, appears: -Infinity, vanishes: Infinity };
  const straight = segments.map(
    ({ x, y, tx, ty, length, speed, surface, appears, vanishes }) =>
      ({ x, y, tx, ty, length, speed, surface, appears, vanishes }));
  const bent = [...arcs, ...(pulley ? [{ ...wheel, ...pulley }] : [])].map(
    ({ x, y, radius, begin, extent, speed, surface, appears, vanishes }) =>
      ({ x, y, radius, begin, extent, speed, surface, appears, vanishes }));
  return [...straight, ...bent];
}

export { judge, runOf };
