// Laws that every run keeps, and the line that says which one a run broke. `results/laws.py` has
// them too, and measures more finely; here they cost a few ms a frame at most.

import { gapToArc, gapToSegment } from "./arrival.ts";
import { eased } from "./panels.ts";
import { modulo } from "./trig.ts";
import type { Lab } from "./lab.ts";
import type { Machine, Arc } from "./machine.ts";
import type { Recording, Ledger } from "./recording.ts";
import type { Words } from "./words.ts";

type Point = { x: number, y: number };
/** Surface, particle, when (s) and where (m); only the law if it is about all together */
type Broken = { law: string, name?: string, particle?: number, t?: number, x?: number, y?: number };

/** Share of the energies of a run that its books may miss: the engine's promise. */
const BOOKED = 1e-9;

/** Share of the radius by which a particle may be pressed into a surface: the engine's promise. */
const PRESSED = 0.05;

/** Share of the radius by which straight lines may miss the curve of a track. */
const CHORD_FINE = 0.25;

/** Pairs of a piece of track and a surface that are looked at in one go. */
const MOST_PAIRS = 300_000;

/** What comes and goes may be shut on a particle, which may then leave by either side. */
const stays = ({ appears, vanishes }: { appears: number, vanishes: number }) =>
  appears === -Infinity && vanishes === Infinity;

/** The parts of surfaces that are always there, each with the box about it, what tells how far a
 * place is from it, and whether a straight line goes through it. */
function barriersOf({ segments, arcs, pulley }: Machine) {
  const wheel = pulley && { x: 0, y: 0, begin: 0, extent: 2 * Math.PI, ...pulley };
  const bent = [...(wheel ? [wheel] : []), ...arcs.filter(stays)];
  return [
    ...segments.filter(stays).map((one) => {
      const { x, y, tx, ty, length, surface } = one;
      const side = (p: Point) => (p.y - y) * tx - (p.x - x) * ty;
      const along = (p: Point) => (p.x - x) * tx + (p.y - y) * ty;
      const ends = [[x, x + length * tx], [y, y + length * ty]];
      return {
        surface,
        low: ends.map((two) => Math.min(...two)), high: ends.map((two) => Math.max(...two)),
        gap: (p: Point) => gapToSegment(one, p.x, p.y),
        isPassed: (a: Point, b: Point) => {
          const [s, e] = [side(a), side(b)];
          if (s * e >= 0) return false;
          const way = along(a) + (s / (s - e)) * (along(b) - along(a));
          return way > 0 && way < length;
        },
      };
    }),
    ...bent.map((one) => {
      const { x, y, radius, begin, extent, surface } = one;
      const side = (p: Point) => Math.hypot(p.x - x, p.y - y) - radius;
      return {
        surface, low: [x - radius, y - radius], high: [x + radius, y + radius],
        gap: (p: Point) =>
          gapToArc(one as Arc, p.x, p.y),
        isPassed: (a: Point, b: Point) => {
          const [s, e] = [side(a), side(b)];
          if (s * e >= 0) return false;
          const [u, v] = [a.x + (s / (s - e)) * (b.x - a.x), a.y + (s / (s - e)) * (b.y - a.y)];
          return modulo(Math.atan2(v - y, u - x) - begin, 2 * Math.PI) < extent;
        },
      };
    }),
  ];
}

class Laws {
  barriers;
  seen;
  /** What is broken by one particle first. */
  passed: Broken | null = null;

  constructor(readonly recording: Recording) {
    this.barriers = barriersOf(recording.machine);
    /** Knots of each track that have been looked at. */
    this.seen = recording.tracks.map(() => 0);
  }

  /** The law that the run breaks, as far as it has been looked at; null if none. */
  get broken() {
    const { recording } = this, { machine } = recording;
    // What lies pressed into something is lifted out of it, which the losses pay.
    const lift = machine.mass.reduce((sum, mass, i) => sum + mass * machine.radius[i], 0);
    const law = brokenBooks(recording.ledger(recording.end), recording.gained,
      PRESSED * machine.gravity * lift);
    return law === "law-finite" ? { law } : this.passed ?? (law ? { law } : null);
  }

  /** Look at what has been added; what is left over, next time. */
  update() {
    const { recording, barriers, seen } = this, { tracks } = recording;
    // After a change a track may well lie where a surface is now.
    if (recording.renamed) {
      this.passed = null;
      return;
    }
    let left = MOST_PAIRS;
    for (let i = 0; i < tracks.length && left > 0 && !this.passed; i += 1) {
      const sure = tracks[i].count - tracks[i].tip;
      for (; seen[i] < sure - 1 && left > 0 && !this.passed; seen[i] += 1) {
        this.look(i, seen[i]);
        left -= barriers.length + 1;
      }
    }
  }

  /** Look at a track between two knots. */
  look(i: number, knot: number) {
    const { tracks, machine } = this.recording, r = machine.radius[i];
    const points = tracks[i].chords(knot, CHORD_FINE * r);
    const low = { x: Infinity, y: Infinity }, high = { x: -Infinity, y: -Infinity };
    for (const { x, y } of points) {
      [low.x, low.y] = [Math.min(low.x, x), Math.min(low.y, y)];
      [high.x, high.y] = [Math.max(high.x, x), Math.max(high.y, y)];
    }
    const near = this.barriers.filter((one) => one.low[0] - r < high.x && one.high[0] + r > low.x
      && one.low[1] - r < high.y && one.high[1] + r > low.y);
    for (const one of near) {
      for (let n = 0; n < points.length; n += 1) {
        const { t, x, y } = points[n];
        const passes = n > 0 && one.isPassed(points[n - 1], points[n]);
        if (!passes && one.gap(points[n]) >= (1 - PRESSED) * r) continue;
        const name = machine.surfaces[one.surface];
        this.passed = { law: passes ? "law-through" : "law-inside", name, particle: i, t, x, y };
        return;
      }
    }
  }
}

/** Which law the books of a run break; "" if none.
 * @param gained by which the engine's solves broke their law of energy, J
 * @param lifted what parting overlaps may take of the losses, J */
function brokenBooks(ledger: Ledger, gained: number, lifted: number) {
  const values = [...Object.values(ledger), gained];
  if (!values.every(isFinite)) return "law-finite";
  const size = values.reduce((sum, value) => sum + Math.abs(value), 0);
  if (gained > BOOKED * size) return "law-energy";
  const loss = Math.min(ledger.restitution_loss, ledger.friction_loss);
  if (loss < -BOOKED * size - lifted) return "law-losses";
  return Math.abs(ledger.residual) > BOOKED * size ? "law-ledger" : "";
}

/** The line below the picture that says which law is broken. */
function watchLaws(line: HTMLElement, lab: Lab, words: Words) {
  let laws: Laws | undefined;
  const look = eased(() => {
    const { recording } = lab;
    if (!recording || !isFinite(recording.begin)) return;
    if (laws?.recording !== recording) laws = new Laws(recording);
    laws.update();
    const { broken } = laws;
    line.hidden = !broken;
    line.textContent = broken ? lawSaid(broken, words) : "";
  });
  lab.on("run", look);
  lab.on("time", look);
}

function lawSaid({ law, name, particle, t = 0, x = 0, y = 0 }: Broken, words: Words) {
  const where = {
    name: words.name(name ?? ""), particle: particle ?? "", t: words.number(t),
    x: words.number(x), y: words.number(y),
  };
  return words.say("law-broken", { what: words.say(law, where) });
}

export { Laws, watchLaws };
