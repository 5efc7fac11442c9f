// The numbers of a crowd: how many, how much, where they land, what belts pay, what surfaces take.

/**
 * @typedef {import("./recording.js").Recording} Recording
 * @typedef {import("./stages.js").RunHistory} RunHistory
 * @typedef {{released: number, landed: number, flow: number, mean: number, spread: number,
 *   quantiles: number[], work: number, power: number, losses: [string, number][]}} CrowdNumbers
 *   counts; kg/s that leave the pulley; m of the first contacts with the outgoing belt itself; J
 *   and W of all belts; J by surface. NaN and no losses where they are not known
 */

/** Particles from which on they are a crowd, as in Python's pictures. */
const FEWEST = 20;

/** Shares of the landings that lie before a place. */
const QUANTILES = [0.02, 0.5, 0.98];

/** The value below which a share of sorted values lies, straight between two of them.
 * @param {number[]} sorted @param {number} share */
function quantile(sorted, share) {
  const at = share * (sorted.length - 1), low = Math.floor(at);
  const high = Math.min(low + 1, sorted.length - 1);
  return sorted.length ? sorted[low] + (at - low) * (sorted[high] - sorted[low]) : NaN;
}

/** Mass per time of those that come at times, of the middle 80 %, kg/s; NaN of fewer than ten.
 * @param {{t: number, mass: number}[]} coming */
function flowOf(coming) {
  const order = [...coming].sort((a, b) => a.t - b.t), tenth = Math.floor(order.length / 10);
  const middle = order.slice(tenth, order.length - tenth);
  const passed = middle.length ? middle[middle.length - 1].t - middle[0].t : 0;
  if (order.length < 10 || !(passed > 0)) return NaN;
  // The first of them comes as the time begins.
  return middle.slice(1).reduce((sum, { mass }) => sum + mass, 0) / passed;
}

/** @param {Recording} recording @param {RunHistory} history @returns {CrowdNumbers} */
function crowdOf(recording, { stages, landings }) {
  const { machine, tracks, books, begin, end } = recording;
  const places = landings.map(({ x }) => x).sort((a, b) => a - b);
  const mean = places.reduce((sum, x) => sum + x, 0) / places.length;
  const squares = places.reduce((sum, x) => sum + (x - mean) ** 2, 0);
  const leaving = machine.pulley ? stages.flatMap(({ left }, i) =>
    (left ? [{ t: left.t, mass: machine.mass[i] }] : [])) : [];
  const work = recording.ledger(end).belt_work;
  const names = [...machine.surfaces, "particles"];
  const losses = (books ?? []).map(([, restitution, friction], row) =>
    /** @type {[string, number]} */ ([names[row], restitution + friction]));
  return {
    released: tracks.filter(({ count }) => count > 0).length, landed: places.length,
    flow: flowOf(leaving), mean, spread: Math.sqrt(squares / places.length),
    quantiles: QUANTILES.map((share) => quantile(places, share)),
    work, power: work / (end - begin),
    losses: losses.filter(([, loss]) => loss !== 0).sort((a, b) => b[1] - a[1]),
  };
}

export { FEWEST, crowdOf };
