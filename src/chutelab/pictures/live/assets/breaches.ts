// Has the core judge a run by the laws of every run, and reports those it broke, like Python's
// results/laws.py.

import { KNOT_ROW, type Core, type Machine } from "./core.ts";
import type { Lab } from "./lab.ts";
import type { Swings } from "./motion.ts";
import type { Recording } from "./recording.ts";
import type { Words } from "./words.ts";

/** A whole run for the core's laws: all knots, and the first of each particle. */
export type Run = { machine: Machine, knots: Float64Array, offsets: number[], books: number[],
  swings: Map<number, Swings>, gained: number, regained: number, risen: number,
  hastened: number, unsolved: number,
  contacts: number, steps: number, unreal: number };

/** A broken law: the first particle, time (s), place (m) and surface; -1 for particle or surface if
 * it concerns all together. */
export type Breach = { law: number, particle: number, surface: number, t: number, x: number,
  y: number };

/** The data that the laws need from a recording of a finished run. */
function runOf(recording: Recording): Run {
  const { machine, tracks, events, books, swings, gained, regained, risen } = recording;
  const { hastened, unsolved, contacts, steps } = recording;
  const offsets = [0];
  for (const { count } of tracks) offsets.push(offsets[offsets.length - 1] + count);
  const knots = new Float64Array(offsets[tracks.length] * KNOT_ROW);
  tracks.forEach(({ rows, count }, i) => {
    knots.set(rows.subarray(0, count * KNOT_ROW), offsets[i] * KNOT_ROW);
  });
  const unreal = events.flatMap(({ t, x, y, before, after, normal, tangent }) =>
    [t, x, y, ...before, ...after, normal, tangent]).filter((value) => !isFinite(value)).length;
  return {
    machine, knots, offsets, books: (books ?? []).flat(), swings, gained, regained, risen,
    hastened, unsolved, contacts, steps, unreal,
  };
}

/** The laws that a run breaks, in the order of reports. The core's memory is restored. */
function judge(core: Core, { machine, knots, offsets, books, swings, ...run }: Run): Breach[] {
  const { gravity, tilt, interact, dt, pulley, radius, mass, inertia, joints, outlines } = machine;
  const { enums } = core.layout, end = core.get("end", "Room");
  const pieces = barriersOf(machine), count = radius.length, { movers } = machine;
  const states = movers.flatMap(({ surface }) => (swings.get(surface)?.rows ?? [])
    .map(([t, angle, rate]) => ({ t, angle, rate, surface })));
  core.reset("Laws");
  core.setAll("Laws", {
    particle_count: count, piece_count: pieces.length, knot_count: offsets[count], row: KNOT_ROW,
    book_rows: books.length / 3, surface_count: machine.surfaces.length + 1,
    engine: enums.Engine.ENGINE_CONTACT,
    interact: Number(interact || states.length + joints.length > 0),
    mover_count: movers.length, swing_count: states.length, pulley: Number(!!pulley),
    outline_count: outlines.flat().length, kind_count: machine.pairRestitution.length,
    tilt, dt, joined: Number(joints.length > 0), cohesion: Math.max(0, ...machine.cohesion.flat()),
    largest: radius.reduce((most, own) => Math.max(most, own), 0), ...run,
  });
  core.work("lay_out_laws");
  core.doubles.set(knots, core.get("knots", "Laws") >> 3);
  core.doubles.set(books, core.get("books", "Laws") >> 3);
  core.ints.set(offsets, core.get("offsets", "Laws") >> 2);
  core.doubles.set(outlines.flat(2), core.get("outlines", "Laws") >> 3);
  if (outlines.flat().length) {
    core.doubles.set(knots.filter((_, n) => n % KNOT_ROW === KNOT_ROW - 1), core.get("angles", "Laws") >> 3);
  }
  core.ints.set(machine.pairRestitution.flat().map((e) => Number(e < 0)), core.get("passing", "Laws") >> 2);
  const groups = groupsOf(machine);
  radius.forEach((_, i) => {
    const { kind } = machine.releases[i], outline = outlines.slice(0, kind).flat().length;
    const body = { radius: innerOf(machine, i), mass: mass[i], inertia: inertia[i], gravity,
      corners: outlines[kind].length, outline, kind, group: groups[i] };
    core.fill("bodies", "Body", i, body, "Laws");
  });
  states.forEach((row, n) => core.fill("swings", "Swing", n, row, "Laws"));
  movers.forEach((mover, k) => {
    const of = states.map(({ surface }) => surface);
    const [first, last] = [of.indexOf(mover.surface), of.lastIndexOf(mover.surface)]
      .map((n) => Math.max(0, n));
    core.fill("movers", "Mover", k, { ...mover, first, last }, "Laws");
  });
  pieces.forEach((row, k) => core.fill("barriers", "Barrier", k, row, "Laws"));
  core.work("judge");
  core.set("end", end, "Room");
  return core.rows("breaches", "Breach", core.get("breach_count", "Laws"), "Laws") as Breach[];
}

/** The radius of a particle, m, or of the circle inside its corners. */
const innerOf = ({ outlines, releases, radius }: Machine, i: number) =>
  outlines[releases[i].kind].reduce((least, [x, y], n, all) => {
    const [u, v] = all[(n + 1) % all.length];
    return Math.min(least, (x * (v - y) - y * (u - x)) / Math.hypot(u - x, v - y));
  }, radius[i]);

/** Numbers, from 1 on, of groups of particles that nothing holds apart, else 0: those that rods and
 * pins join, and those that the incoming belt carries by adhesion. */
function groupsOf({ joints, releases }: Machine) {
  const group = releases.map(({ carried }) => (carried ? releases.length + 1 : 0));
  for (const { kind, particle, other } of joints) {
    if (!["rod", "pin"].includes(kind) || other < 0) continue;
    const ends = [group[particle], group[other]], own = Math.max(...ends) || particle + 1;
    group.forEach((one, i) => { if (one && ends.includes(one)) group[i] = own; });
    group[particle] = group[other] = own;
  }
  return group;
}

/** All pieces of surfaces as the core's laws take them: straight ones, bent ones, the pulley. */
function barriersOf({ segments, arcs, pulley, movers }: Machine) {
  const wheel = { x: 0, y: 0, begin: 0, extent: Infinity, appears: -Infinity, vanishes: Infinity,
    one_sided: 0 };
  const straight = segments.map(
    ({ x, y, tx, ty, length, speed, surface, appears, vanishes, one_sided }) =>
      ({ x, y, tx, ty, length, speed, surface, appears, vanishes, one_sided }));
  const bent = [...arcs, ...(pulley ? [{ ...wheel, ...pulley }] : [])].map(
    ({ x, y, radius, begin, extent, speed, surface, appears, vanishes, one_sided }) =>
      ({ x, y, radius, begin, extent, speed, surface, appears, vanishes, one_sided }));
  return [...straight, ...bent].map((row) =>
    ({ ...row, mover: movers.findIndex(({ surface }) => surface === row.surface) + 1 }));
}

/** Texts of the laws, in the order of the core's enum Law. */
const SAID = ["law-finite", "law-through", "law-inside", "law-apart", "law-energy", "law-losses",
  "law-ledger", "law-solved"];

/** The line below the picture about a broken law. */
function watchLaws(line: HTMLElement, lab: Lab, words: Words) {
  lab.on("run", () => {
    const { recording } = lab, first = recording?.breaches[0];
    line.hidden = !first;
    line.textContent = recording && first ? lawSaid(first, recording, words) : "";
  });
}

function lawSaid(broken: Breach, { machine }: Recording, words: Words) {
  const { law, surface, particle, t, x, y } = broken;
  const where = {
    name: words.name(machine.surfaces[surface] ?? ""), particle, t: words.number(t),
    x: words.number(x), y: words.number(y),
  };
  // Unexplained energy of a single particle does not come from the solver.
  const said = SAID[law] === "law-energy" && particle >= 0 ? "law-ledger" : SAID[law];
  return words.say("law-broken", { what: words.say(said, where) });
}

export { SAID, judge, runOf, watchLaws };
