// Where the particles are: cubic Hermite curves through the knots that the engine left.

const data = JSON.parse(document.getElementById("data").textContent);

function doubles(text) {
  const binary = atob(text);
  const bytes = new Uint8Array(binary.length);
  for (let i = 0; i < binary.length; i += 1) bytes[i] = binary.charCodeAt(i);
  return new Float64Array(bytes.buffer);
}

const COLUMNS = [
  "t", "x", "y", "vx", "vy", "omega", "belt_work", "restitution_loss", "friction_loss",
];
const zeros = new Float64Array(data.knots);
const knots = {};
for (const name of COLUMNS) {
  knots[name] = name in data.columns ? doubles(data.columns[name]) : zeros;
}

// Each variant's knots and surfaces follow those of the one before.
const FIELDS = 7;
const segmentRows = doubles(data.segments);
let knotBase = 0;
let segmentBase = 0;
const variants = data.variants.map((variant, index) => {
  if (!variant.offsets) return { index, ...variant, offsets: null, count: 0 };
  const offsets = variant.offsets.map((offset) => offset + knotBase);
  knotBase = offsets[offsets.length - 1];
  const segments = variant.owner.map((owner, i) => {
    const row = segmentRows.subarray(segmentBase + FIELDS * i, segmentBase + FIELDS * (i + 1));
    const [x0, y0, x1, y1, speed, restitution, friction] = row;
    return { name: variant.surfaces[owner], x0, y0, x1, y1, speed, restitution, friction };
  });
  segmentBase += FIELDS * variant.owner.length;
  const [radius, mass, inertia, gravity] = variant.body;
  return {
    index, ...variant, offsets, segments, radius, mass, inertia, gravity,
    count: offsets.length - 1,
  };
});

/** The interval of a particle's track at time t; null before its release. */
function cell(variant, particle, t) {
  const first = variant.offsets[particle];
  const last = variant.offsets[particle + 1] - 1;
  if (last < first || t < knots.t[first]) return null;
  if (t > knots.t[last]) return { left: last - 1, h: 0, share: 1, over: true, first };
  let low = first;
  let high = last;
  while (high - low > 1) {
    const middle = (low + high) >> 1;
    if (knots.t[middle] <= t) low = middle;
    else high = middle;
  }
  const h = knots.t[low + 1] - knots.t[low];
  return { left: low, h, share: h > 0 ? (t - knots.t[low]) / h : 1, over: false, first };
}

/** One coordinate and its velocity on the curve of a cell. */
function hermite({ left, h, share: s }, position, velocity) {
  const [pa, pb, va, vb] = [position[left], position[left + 1], velocity[left], velocity[left + 1]];
  if (s >= 1) return [pb, vb];
  const dx = pb - pa;
  const where =
    pa + s * (h * va + s * (3 * dx - h * (2 * va + vb) + s * (h * (va + vb) - 2 * dx)));
  const slope = dx / h;
  const pace = va + s * (2 * (3 * slope - 2 * va - vb) + 3 * s * (va + vb - 2 * slope));
  return [where, pace];
}

/** Position and velocity of a particle; after its end, where it ended. */
function stateAt(variant, particle, t) {
  const here = cell(variant, particle, t);
  if (!here) return null;
  const [x, vx] = hermite(here, knots.x, knots.vx);
  const [y, vy] = hermite(here, knots.y, knots.vy);
  const omega = knots.omega[here.left] * (1 - here.share) + knots.omega[here.left + 1] * here.share;
  return { x, y, vx, vy, omega, ended: here.over };
}

/** Points along a track from one time to another, knots among them. */
function trackPoints(variant, particle, from, to, pieces = 160) {
  const first = variant.offsets[particle];
  const last = variant.offsets[particle + 1] - 1;
  if (last < first) return [];
  const begin = Math.max(from, knots.t[first]);
  const end = Math.min(to, knots.t[last]);
  if (end < begin) return [];
  const step = (variant.span[1] - variant.span[0]) / pieces || 1;
  const points = [];
  const add = (t) => points.push(stateAt(variant, particle, t));
  add(begin);
  for (let i = first; i < last; i += 1) {
    const [a, b] = [Math.max(knots.t[i], begin), Math.min(knots.t[i + 1], end)];
    if (!(b > a)) continue;
    const parts = Math.max(1, Math.ceil((b - a) / step));
    for (let k = 1; k <= parts; k += 1) add(k < parts ? a + ((b - a) * k) / parts : b);
  }
  return points;
}

/** Points along the analytic parabola. */
function arcPoints([begin, end, x, y, vx, vy, gravity], pieces = 80) {
  return Array.from({ length: pieces + 1 }, (_, i) => {
    const t = ((end - begin) * i) / pieces;
    return { x: x + vx * t, y: y + t * (vy - 0.5 * gravity * t) };
  });
}
