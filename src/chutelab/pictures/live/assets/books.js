// The energy ledger between the knots, as the recording has it.

const kineticAt = (variant, vx, vy, omega) =>
  0.5 * variant.mass * (vx * vx + vy * vy) + 0.5 * variant.inertia * omega * omega;

const potentialAt = (variant, y) => variant.mass * variant.gravity * y;

function booksOfKnot(variant, i, atRelease) {
  const energy =
    kineticAt(variant, knots.vx[i], knots.vy[i], knots.omega[i]) + potentialAt(variant, knots.y[i]);
  const [belt, restitution, friction] = [
    knots.belt_work[i], knots.restitution_loss[i], knots.friction_loss[i],
  ];
  const residual = energy - atRelease - (belt - restitution - friction);
  return { belt, restitution, friction, residual };
}

/** The ledger of one particle. While it slips, the belt's power on a face is constant and the
 * balance gives the slip heat; while it is carried, the balance gives the belt's work; in flight
 * what it leaves over is the residual. */
function booksOfParticle(variant, particle, t) {
  const here = cell(variant, particle, t);
  if (!here) return null;
  const start =
    kineticAt(variant, knots.vx[here.first], knots.vy[here.first], knots.omega[here.first]) +
    potentialAt(variant, knots.y[here.first]);
  const state = stateAt(variant, particle, t);
  const kinetic = kineticAt(variant, state.vx, state.vy, state.omega);
  const potential = potentialAt(variant, state.y);
  const gain = kinetic + potential - start;
  const a = booksOfKnot(variant, here.left, start);
  const b = booksOfKnot(variant, here.left + 1, start);
  const { share } = here;
  const between = (from, to) => (share >= 1 ? to : from + share * (to - from));
  const slips = a.friction !== b.friction;
  const driven = a.belt !== b.belt;
  const restitution = share < 1 ? a.restitution : b.restitution;
  let residual = between(a.residual, b.residual);
  const belt =
    driven && !slips ? gain + restitution + a.friction - residual : between(a.belt, b.belt);
  const friction = slips ? belt - restitution + residual - gain : a.friction;
  // What is shown counts from the lowest point of the run; the balance does not, so no digit is lost in it.
  const lifted = potentialAt(variant, variant.zero);
  if (!slips && !driven) residual = gain - (belt - restitution - friction);
  return {
    start: start - lifted,
    kinetic,
    potential: potential - lifted,
    belt_work: belt,
    restitution_loss: restitution,
    friction_loss: friction,
    residual,
  };
}

/** The ledger of all particles that are released. */
function booksAt(variant, t) {
  const total = Object.fromEntries(data.energies.map(({ name }) => [name, 0]));
  for (let particle = 0; particle < variant.count; particle += 1) {
    const books = booksOfParticle(variant, particle, t);
    if (books) for (const name of Object.keys(total)) total[name] += books[name];
  }
  return total;
}

const SIGNS = {
  start: 1, belt_work: 1, kinetic: -1, potential: -1, restitution_loss: -1, friction_loss: -1,
  residual: 1,
};

/** What was put in, and where it is: an entry of the other sign changes sides. */
function stacks(books) {
  const putIn = {};
  const isNow = {};
  for (const [name, sign] of Object.entries(SIGNS)) {
    const value = sign * books[name];
    putIn[name] = Math.max(value, 0);
    isNow[name] = Math.max(-value, 0);
  }
  return { putIn, isNow };
}

const sum = (values) => Object.values(values).reduce((a, b) => a + b, 0);

/** The longest bar of each run: at its end, or where the first particle strikes something. */
const longestBars = variants.map((variant) => {
  if (!variant.offsets || variant.fault) return 0;
  const times = [variant.span[1], ...variant.events.slice(0, 12).map(([t]) => t)];
  return Math.max(...times.map((t) => sum(stacks(booksAt(variant, t)).putIn)));
});

/** What the bars of most runs stay below: so they compare from one run to the next. */
const usualEnergy = (() => {
  const sizes = longestBars.filter((size) => size > 0).sort((a, b) => a - b);
  const at = (share) => (sizes.length ? sizes[Math.floor(share * (sizes.length - 1))] : 0);
  return Math.min(at(0.9), 2.5 * at(0.5));
})();
