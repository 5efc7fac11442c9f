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

/** A particle that is let go at rest, of the first kind; with what is there already.
 * @param {Given} given @param {[number, number]} at @param {number} start s @returns {Given} */
function withParticle(given, at, start) {
  const kinds = listed(given.particle), kind = kinds.length > 1 ? { particle: kinds[0].name } : {};
  return {
    ...given,
    stream: [...(given.stream === undefined ? [{}] : listed(given.stream)),
      { name: freeName(given, "drop"), ...kind, at, velocity: [0, 0], count: 1, start }],
  };
}

/** The surface nearest to a place within reach; "" if none is.
 * @param {import("./machine.js").Machine} machine @param {number} x @param {number} y
 * @param {number} reach m */
function surfaceAt({ surfaces, segments, arcs, pulley }, x, y, reach) {
  let least = reach, found = "";
  const take = (/** @type {number} */ far, /** @type {number} */ surface) => {
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

/** What has a name of its own, or the damping plate or the outgoing belt, taken away.
 * @param {Given} given @param {string} name @returns {Given} */
function without(given, name) {
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

/** Whether `without` takes something away. @param {string} name */
const canGo = (/** @type {Given} */ given, name) =>
  JSON.stringify(without(given, name)) !== JSON.stringify(given);

export { canGo, surfaceAt, withArc, withLine, withParticle, without };
