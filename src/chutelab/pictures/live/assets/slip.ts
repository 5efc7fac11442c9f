// Where a body leaves the pulley of a level belt that grips with finite friction, as Python's
// `theory/slide.py`; without its spin, which takes a quadrature.

/** Newton rounds; fewer than 20 are ever used. */
const MOST_ROUNDS = 100;

/**
 * With u = v² / (g Rc) and φ the angle from the top, the normal force is m g w, w = cos φ - u.
 * Held, u = u0 + 2/(1 + k) (1 - cos φ) for a body that rolls, k = I/(m r²), else u0, until friction
 * cannot bear the pull any more; then it slips, w' = 2 µ w - 3 sin φ, and leaves where w = 0.
 * @param parameters SI units
 * @returns rad, m/s
 */
export function separationWithSlip({
  speed, pulleyRadius, gravity, friction, particleRadius = 0.0, spin = false, inertia = 0.5,
}: {
  speed: number, pulleyRadius: number, gravity: number, friction: number, particleRadius?: number,
  spin?: boolean, inertia?: number,
}): { phi1: number, v1: number } {
  const unit = gravity * (pulleyRadius + particleRadius);
  const start = (speed * speed) / unit;
  if (start >= 1.0) return { phi1: 0.0, v1: speed };
  const fall = spin ? (3.0 + inertia) / (1.0 + inertia) : 1.0;
  const need = spin ? (1.0 + inertia) / inertia : 1.0;
  const grip = (spin ? (3.0 + inertia) / inertia : 1.0) * friction;
  const most = spin ? ((1.0 + inertia) * start + 2.0) / (3.0 + inertia) : start;
  const short = (spin ? (1.0 + inertia) / (3.0 + inertia) : 1.0) * (1.0 - start);
  // In tan(φ/2) the onset of slip is a quadratic; this form of its root does not cancel.
  const base = 1.0 + Math.hypot(1.0, grip * Math.sqrt(short * (1.0 + most)));
  const tangent = (grip * short) / base, onset = 2.0 * Math.atan(tangent);
  const pressed = (fall * 2.0 * short) / (base * (1.0 + tangent * tangent));
  const swell = (1.0 - (6.0 * need - 4.0) * friction * friction) * pressed - 3.0 * Math.cos(onset);
  const normal = (x: number) => {
    const half = Math.sin(0.5 * x), middle = onset + 0.5 * x;
    const change = 12.0 * friction * Math.cos(middle) * half - 6.0 * Math.sin(middle) * half
      + swell * Math.expm1(2.0 * friction * x);
    return pressed + change / (1.0 + 4.0 * friction * friction);
  };
  // With endless grip it would leave at cos φ = `most`. w is concave: Newton from the right.
  const last = Math.sqrt(short / (1.0 + most));
  let x = Math.min(2.0 * Math.atan((last - tangent) / (1.0 + last * tangent)), 1.0 / friction);
  for (let round = 0; round < MOST_ROUNDS; round += 1) {
    const w = normal(x), slope = 2.0 * friction * w - 3.0 * Math.sin(onset + x);
    const lower = Math.max(x - w / (slope < 0.0 ? slope : -Infinity), 0.0);
    if (!(lower < x)) break;
    x = lower;
  }
  return { phi1: onset + x, v1: Math.sqrt(unit * Math.cos(onset + x)) };
}
