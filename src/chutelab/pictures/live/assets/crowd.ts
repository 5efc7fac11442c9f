// The numbers of a crowd: counts, flow, arrivals, power of belts, losses at surfaces.

import type { Arrival } from "./arrival.ts";
import { isPaid } from "./machine.ts";
import type { Recording } from "./recording.ts";

/** Counts of particles that touched the outgoing belt or what lies on it, and the belt itself; flow
 * of arrivals in the slice, t/h; places of arrivals, m; work and power of all belts, J and W;
 * losses by surface, J. NaN and no losses if unknown */
export type CrowdNumbers = { released: number, arrived: number, landed: number, flow: number,
  mean: number, spread: number, quantiles: number[], work: number, power: number, losses: [string,
  number][] };

/** Least number of particles of a crowd, as in Python's pictures. */
const FEWEST = 20;

/** Least number of arrivals for a flow. */
const FLOW = 8;

/** Quantiles of arrivals, and of paths from right to left. */
const QUANTILES = [0.02, 0.5, 0.98];

/** A quantile of sorted values, interpolated linearly. */
function quantile(sorted: number[], share: number) {
  const at = share * (sorted.length - 1), low = Math.floor(at);
  const high = Math.min(low + 1, sorted.length - 1);
  return sorted.length ? sorted[low] + (at - low) * (sorted[high] - sorted[low]) : NaN;
}

/** Number of those, in the order of time, that are not after t (s). */
function countUntil(ordered: { t: number }[], t: number) {
  let low = 0, high = ordered.length;
  while (low < high) {
    const middle = (low + high) >> 1;
    if (ordered[middle].t <= t) low = middle + 1;
    else high = middle;
  }
  return low;
}

/** Mass flow of the middle half of arrivals, t/h; NaN for fewer than `FLOW`.
 * @param coming in the order of time */
function flowOf(coming: { t: number, mass: number }[]) {
  const [first, last] = [0.25, 0.75].map((share) => Math.floor(share * (coming.length - 1)));
  const passed = coming.length < FLOW ? NaN : coming[last].t - coming[first].t;
  if (!(passed > 0)) return NaN;
  // The first of them arrives at the beginning of the time span.
  const middle = coming.slice(first + 1, last + 1);
  return (3.6 * middle.reduce((sum, { mass }) => sum + mass, 0)) / passed;
}

/** @param landed how many have touched the belt itself */
function crowdOf(
  recording: Recording, { found }: { found: (Arrival | undefined)[] }, landed: number,
): CrowdNumbers {
  const { machine, tracks, books, begin, end } = recording;
  const come = found.flatMap((one, i) => (one ? [{ ...one, mass: machine.mass[i] }] : []))
    .sort((a, b) => a.t - b.t);
  const places = come.map(({ x }) => x).sort((a, b) => a - b);
  const mean = places.reduce((sum, x) => sum + x, 0) / places.length;
  const squares = places.reduce((sum, x) => sum + (x - mean) ** 2, 0);
  const { belt_work, start } = recording.ledger(end);
  // Without drives it is rounding.
  // Without drives there is none; a run that is computed in part may end within an impact, where a
  // hinge does not yet have what a ball has lost.
  const work = isPaid(machine) && Math.abs(belt_work) > 1e-12 * start ? belt_work : 0;
  const names = [...machine.surfaces, "particles"];
  const losses = (books ?? []).map(([, restitution, friction], row) =>
    [names[row], restitution + friction] as [string, number]);
  return {
    released: tracks.filter(({ count }) => count > 0).length, arrived: come.length, landed,
    flow: flowOf(come), mean, spread: Math.sqrt(squares / places.length),
    quantiles: QUANTILES.map((share) => quantile(places, share)),
    work, power: work / (end - begin),
    losses: losses.filter(([, loss]) => loss !== 0).sort((a, b) => b[1] - a[1]),
  };
}

export { FEWEST, QUANTILES, countUntil, crowdOf, quantile };
