// Quantities of a run by their names in the registry, like Python's `results/quantities.py`.

import { quantile } from "./crowd.ts";
import type { Event } from "./core.ts";
import type { Recording } from "./recording.ts";
import type { Scene } from "./scene.ts";
import type { RunHistory, Stages } from "./stages.ts";

type Run = { recording: Recording, history: RunHistory, scene: Scene };

/** Kind of an impact, as in the core. */
const IMPACT = 3;

/** Kinds of events that end a track, as in the core. */
const ENDS: Record<string, number> = { settled: 7, exit: 8 };

const DEGREES = 180 / Math.PI;

const STATISTICS: Record<string, (sorted: number[]) => number> = {
  mean: (values) => values.reduce((sum, value) => sum + value, 0) / values.length,
  spread: (values) => {
    const mean = STATISTICS.mean(values);
    return Math.sqrt(STATISTICS.mean(values.map((value) => (value - mean) ** 2)));
  },
  min: (values) => values[0], max: (values) => values[values.length - 1],
  ...Object.fromEntries([2, 25, 50, 75, 98].map((share) => [`q${String(share).padStart(2, "0")}`,
    (values: number[]) => quantile(values, share / 100)])),
};

/** A number of an event by its name in quantities; NaN without an event. */
function told(event: Event | undefined, part: string): number {
  if (!event) return NaN;
  if (part === "t" || part === "x" || part === "y") return event[part];
  return event[part.endsWith("_after") ? "after" : "before"]["xy".indexOf(part[1])];
}

/** The paper's symbols of one particle: lengths from the separation, x3 back from the plate,
 * heights down.
 * @param pulley m @param angle of the plate, rad @param beltSpeed of the outgoing belt, m/s
 * @param rate particles per s */
function symbolsOf({ left, hit, down }: Stages, { radius, mass, pulley, angle, beltSpeed, rate }: {
  radius: number, mass: number, pulley: number, angle: number, beltSpeed: number, rate: number,
}): Record<string, number> {
  const speed = (v: number[] | undefined) => (v ? Math.hypot(v[0], v[1]) : NaN);
  const [x1, x2, x3] = [left, hit, down].map((event) => told(event, "x"));
  const [y1, y2, y3] = [left, hit, down].map((event) => told(event, "y"));
  const [t1, t2, t3] = [left, hit, down].map((event) => told(event, "t"));
  const [ux, uy] = hit?.before ?? [NaN, NaN], [wx, wy] = hit?.after ?? [NaN, NaN];
  const [vx, vy] = down?.before ?? [NaN, NaN];
  const [sin, cos] = [Math.sin(angle), Math.cos(angle)];
  const away = -(wx * cos + wy * sin), energy = 0.5 * mass * (vx * vx + beltSpeed * beltSpeed);
  return {
    phi1_deg: Math.atan2(x1, y1) * DEGREES, v1: speed(left?.after), t2: t2 - t1, x2: x2 - x1,
    y2: y1 - y2, v2: speed(hit?.before), v2r: speed(hit?.after),
    phi2_deg: Math.atan2(ux * cos + uy * sin, ux * sin - uy * cos) * DEGREES,
    phi2r_deg: Math.atan2(Math.abs(away) <= 1e-14 * speed(hit?.after) ? 0 : away,
      wx * sin - wy * cos) * DEGREES,
    t3: t3 - t2, x3: x2 - x3, y3: y2 - y3, v3x: -vx, v3y: -vy, v3: speed(down?.before),
    d3: pulley + radius - y3, dEk: energy, P: energy * rate,
  };
}

/** A quantity of each particle; NaN without one. */
function each(name: string, { recording, history, scene }: Run): number[] {
  const { machine, tracks } = recording, { stages } = history;
  const [head, part, more] = name.split(".");
  const events = { separation: "left", impact: "hit", landing: "down" } as const;
  if (head === "impact" && more) {
    const surface = machine.surfaces.indexOf(part);
    return tracks.map((_, i) => told(recording.events.find(({ disk, kind, surface: its }) =>
      disk === i && kind === IMPACT && its === surface), more));
  }
  if (head in events) {
    return stages.map((its) => told(its[events[head as keyof typeof events]], part));
  }
  if (head === "arrival") {
    return history.arrivals.found.map((one) => (one as any)?.[part] ?? NaN);
  }
  if (head === "flight") {
    return stages.map(({ left, hit, down }) => told(hit && (!down || hit.t < down.t)
      ? hit : down, "t") - told(left, "t"));
  }
  if (head === "ended" || head === "track") {
    return tracks.map((track) => {
      if (!track.count) return NaN;
      return part === "t" ? track.end - (head === "track" ? track.begin : 0)
        : (track.state(track.end) as any)[part];
    });
  }
  const { plates, outgoing, streams } = scene;
  const plate = plates.find(({ pivot }) => pivot === undefined);
  return stages.map(({ left, hit, down }, i) => symbolsOf(
    // An impact is relative to the separation, a landing to the impact.
    { left, hit: left && hit, down: left && hit && down }, {
      radius: machine.radius[i], mass: machine.mass[i], pulley: machine.pulley?.radius ?? NaN,
      angle: (plate?.angle_deg ?? NaN) / DEGREES, beltSpeed: outgoing?.speed ?? NaN,
      rate: streams[0].rate,
    })[name] ?? NaN);
}

/** A quantity of a run that is over, in its unit; NaN if it did not happen. */
function measure(name: string, run: Run): number {
  const { recording, scene: { streams } } = run, { books, machine, tracks } = recording;
  const parts = name.split("."), [head, second, surface, entry] = parts;
  const last = parts[parts.length - 1], rest = parts.slice(0, -1).join(".");
  const paid = (row: number, which: string) =>
    books?.[row]?.[["belt_work", "restitution_loss", "friction_loss"].indexOf(which)] ?? NaN;
  const count = (values: number[]) => values.filter((value) => isFinite(value)).length;
  if (head === "particles[0]") return each(parts.slice(1).join("."), run)[0];
  if (name === "contacts") return recording.contacts;
  if (name === "misses") return tracks.length - count(each("arrival.t", run));
  if (head === "ended" && second in ENDS) {
    return recording.events.filter(({ kind }) => kind === ENDS[second]).length;
  }
  if (name === "ended.unreleased") return tracks.filter((track) => !track.count).length;
  if (head === "ledger") {
    if (second === "by_surface") {
      const row = [...machine.surfaces, "particles"].indexOf(surface);
      const its = recording.hung(recording.end, row);
      return entry === "damper_loss" ? its[entry]
        : paid(row, entry) + (entry === "restitution_loss" ? its[entry] : 0);
    }
    if (second === "power") {
      return (paid(machine.landing, "belt_work") / tracks.length) * streams[0].rate;
    }
    const ledger = recording.ledger(recording.end) as any;
    if (surface !== "start") return ledger[second] ?? NaN;
    return tracks.reduce((sum, track, i) =>
      sum + ((recording.ledgerOf(i, track.begin) as any)?.[second] ?? 0),
    (recording.hung(0) as any)[second]);
  }
  if (name === "belt_work") return paid(machine.landing, name);
  if (name === "slip_heat") return paid(machine.landing, "friction_loss");
  if (last === "count") return count(each(`${rest}.t`, run));
  if (last in STATISTICS) {
    const values = each(rest, run).filter((value) => isFinite(value)).sort((a, b) => a - b);
    return values.length ? STATISTICS[last](values) : NaN;
  }
  return each(name, run)[0];
}

export { each, measure, symbolsOf };
