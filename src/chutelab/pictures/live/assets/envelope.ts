// The envelope of the paths of a stream: the lines between which 96 % of them pass, and the middle
// one. The same as in Python's `results/stream.py`.

import { FEWEST, QUANTILES, quantile } from "./crowd.ts";
import type { Arrival } from "./arrival.ts";
import type { Recording, Track } from "./recording.ts";

type Point = [number, number];
/** Edge to the right, middle, edge to the left, m; NaN where there is none */
export type Envelope = { stream: number, lines: Point[][] };

/** Most paths for an envelope; from more, some are chosen evenly. */
const MOST_PATHS = 400;

/** Largest jump of a line from one place to the next, in distances between places. */
const JUMP = 5;

/** Beyond this share of the cuts, lines end where an edge turns back. */
const LATE = 2 / 3;

/** Share of the way, ahead and back, that defines the direction of a cut. */
const LOOK_AHEAD = 1 / 60;

/** Times at which paths are sampled, and number of cuts. */
const MOMENTS = 400, CUTS = 60;

/** Linear interpolation between points at x, constant beyond them.
 * @param xs ascending */
function between(x: number, xs: number[], ys: number[]) {
  let low = 0, high = xs.length - 1;
  if (x <= xs[0] || high < 1) return ys[0];
  if (x >= xs[high]) return ys[high];
  while (high - low > 1) {
    const middle = (low + high) >> 1;
    if (xs[middle] <= x) low = middle;
    else high = middle;
  }
  return ys[low] + ((ys[high] - ys[low]) / (xs[high] - xs[low])) * (x - xs[low]);
}

const median = (values: number[]) => quantile(values.sort((a, b) => a - b), 0.5);

/** Equally spaced values from 0 to a last one. */
const evenly = (last: number, many: number) => Array.from({ length: many }, (_, n) =>
  (n < many - 1 ? n * (last / (many - 1)) : last));

/** The envelopes of the streams of a run, as far as it has come. A path is that of a particle from
 * its release to its arrival on the outgoing belt, or to its end. A stream has none if its
 * particles are released at once, or if it has fewer than `FEWEST` paths, or they lead nowhere.
 * @param arrivals of each particle */
function envelopesOf(
  { machine, tracks }: Recording, arrivals: (Arrival | undefined)[],
): Envelope[] {
  const { releases } = machine, last = releases[releases.length - 1]?.stream ?? -1;
  const found: Envelope[] = [];
  for (let stream = 0; stream <= last; stream += 1) {
    const all = releases.map((_, i) => i).filter((i) => releases[i].stream === stream);
    if (all.every((i) => releases[i].t === releases[all[0]].t)) continue;
    const own = all.filter((i) => tracks[i].count);
    if (own.length < FEWEST) continue;
    const some = evenly(own.length - 1, Math.min(own.length, MOST_PATHS))
      .map((n) => own[Math.floor(n)]);
    const lines = envelope(some.map((i) => ({
      track: tracks[i], end: Math.min(tracks[i].end, arrivals[i]?.t ?? Infinity),
    })));
    if (lines) found.push({ stream, lines });
  }
  return found;
}

function envelope(own: { track: Track, end: number }[]): Point[][] | null {
  const lasts = median(own.map(({ track, end }) => end - track.begin));
  const since = evenly(lasts, MOMENTS);
  const paths = own.map(({ track, end }) => since.map((s) => {
    const t = track.begin + s, state = t <= end ? track.state(t) : null;
    return state ? [state.x, state.y] : null;
  }));
  const way = [0, 1].map((axis) => since.map((_, row) =>
    median(paths.flatMap((path) => path[row]?.[axis] ?? []))));
  const length = [0];
  for (let row = 1; row < MOMENTS; row += 1) {
    length.push(length[row - 1]
      + Math.hypot(way[0][row] - way[0][row - 1], way[1][row] - way[1][row - 1]));
  }
  const whole = length[MOMENTS - 1];
  if (!(whole > 0)) return null;
  const at = evenly(whole, CUTS);
  const on = (x: number) =>
    way.map((values) => between(x, length, values)) as Point;
  const lines: Point[][] = QUANTILES.map(() => []);
  for (let n = 0; n < CUTS; n += 1) {
    const [x, y] = on(at[n]), clock = between(at[n], length, since);
    const [before, after] = [on(at[n] - LOOK_AHEAD * whole), on(at[n] + LOOK_AHEAD * whole)];
    const size = Math.hypot(after[0] - before[0], after[1] - before[1]);
    const [tx, ty] = [(after[0] - before[0]) / size, (after[1] - before[1]) / size];
    const crossed = paths.flatMap((path) => crossing(path, since, clock, [x, y], [tx, ty]) ?? [])
      .sort((a, b) => a - b);
    const isPassed = 2 * crossed.length >= own.length;
    const offsets = QUANTILES.map((share) => (isPassed ? quantile(crossed, share) : NaN));
    offsets.forEach((off, q) => lines[q].push([x - off * ty, y + off * tx]));
    // Where half of the particles lie, the way turns round, and cuts go through the others.
    const ends = n && lines.some((line) => {
      const [dx, dy] = [line[n][0] - line[n - 1][0], line[n][1] - line[n - 1][1]];
      return Math.hypot(dx, dy) > JUMP * at[1] || (n > LATE * CUTS && dx * tx + dy * ty < 0);
    });
    if (ends) return lines.map((line) => line.slice(0, n));
  }
  return lines;
}

/** Distance to the left of a place at which a path crosses the cut there, m; null if it does not.
 * It crosses where it goes from behind the cut to ahead of it; of several times the one nearest to
 * the way's counts.
 * @param since s
 * @param clock s of the way
 * @param tangent across which the cut is */
function crossing(
  path: (number[] | null)[], since: number[], clock: number, [x, y]: Point, [tx, ty]: Point,
) {
  let least = Infinity, found = null;
  let before = null;
  for (let row = 0; row < path.length; row += 1) {
    const point = path[row];
    if (!point) break;
    const [u, v] = [point[0] - x, point[1] - y];
    const now = { along: u * tx + v * ty, left: v * tx - u * ty };
    if (before && before.along <= 0 && now.along > 0) {
      const late = Math.abs(since[row - 1] - clock);
      if (late < least) {
        const share = -before.along / (now.along - before.along);
        [least, found] = [late, before.left + share * (now.left - before.left)];
      }
    }
    before = now;
  }
  return found;
}

export { envelopesOf };
