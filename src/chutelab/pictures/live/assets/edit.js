// New surfaces and particles, and taking them away: each a scene made of another.

/** @typedef {import("./scene.js").Given} Given */

/** @param {any} rows a table, several, or none @returns {any[]} */
const listed = (rows) => (rows === undefined ? [] : Array.isArray(rows) ? rows : [rows]);

/** @param {any[]} rows */
const either = (rows) => (rows.length === 1 ? rows[0] : rows);

/** A name that nothing has yet. @param {Given} given @param {string} stem */
function freeName(given, stem) {
  const taken = new Set(["surface", "plate", "conveyor", "stream"].flatMap((table) =>
    listed(given[table]).map(({ name }) => name)));
  let n = 1;
  while (taken.has(`${stem}${n}`)) n += 1;
  return `${stem}${n}`;
}

/** @param {Given} given @param {[number, number]} from @param {[number, number]} to
 * @returns {Given} */
const withLine = (given, from, to) => ({
  ...given, surface: [...listed(given.surface), { name: freeName(given, "line"), from, to }],
});

/** The arc through three points, or the line where they are on one.
 * @param {Given} given @param {[number, number]} a @param {[number, number]} b on its way
 * @param {[number, number]} c @returns {Given} */
function withArc(given, a, b, c) {
  const [ux, uy, vx, vy] = [b[0] - a[0], b[1] - a[1], c[0] - a[0], c[1] - a[1]];
  const twice = 2 * (ux * vy - uy * vx), u = ux * ux + uy * uy, v = vx * vx + vy * vy;
  if (Math.abs(twice) < 1e-3 * Math.max(u, v)) return withLine(given, a, c);
  const x = (vy * u - uy * v) / twice, y = (ux * v - vx * u) / twice;
  const round = (/** @type {number} */ value) => Math.round(value * 1e4) / 1e4;
  const angle = (/** @type {[number, number]} */ [px, py]) =>
    (Math.atan2(py - a[1] - y, px - a[0] - x) * 180) / Math.PI;
  const turn = (/** @type {number} */ from, /** @type {number} */ to) => (to - from + 720) % 360;
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

/** A particle that is let go at rest. @param {Given} given @param {[number, number]} at
 * @param {number} start s @returns {Given} */
const withParticle = (given, at, start) => ({
  ...given,
  stream: [...(given.stream === undefined ? [{}] : listed(given.stream)),
    { name: freeName(given, "drop"), at, velocity: [0, 0], count: 1, start }],
});

/** What has a name of its own, or the damping plate or the outgoing belt, taken away.
 * @param {Given} given @param {string} name @returns {Given} */
function without(given, name) {
  const rest = { ...given };
  for (const table of ["surface", "conveyor", "plate", "stream"]) {
    if (given[table] === undefined) continue;
    const kept = listed(given[table]).filter((row) =>
      row.name !== name && !(table === "plate" && name === "plate" && !row.pivot));
    if (kept.length) rest[table] = table === "surface" || table === "conveyor" ? kept : either(kept);
    else if (table !== "stream") delete rest[table];
  }
  if (name === "outgoing") delete rest.outgoing;
  return rest;
}

/** Whether `without` takes something away. @param {string} name */
const canGo = (/** @type {Given} */ given, name) => without(given, name) !== given
  && JSON.stringify(without(given, name)) !== JSON.stringify(given);

export { canGo, listed, withArc, withLine, withParticle, without };
