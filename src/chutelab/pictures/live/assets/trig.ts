// Sine, cosine and their inverses of + - * / and square roots alone, as in `util/trig.py`: the
// same operations in the same order, so that both have the same bits. The polynomials are those of
// fdlibm (Sun Microsystems, 1993), which are free to use.

/** Radians of one degree. */
export const RADIANS = Math.PI / 180.0;

/** rad; beyond, π/2 in three parts of 33 bits is no longer subtracted exactly. */
const LARGEST_ANGLE = 1e6;

/** Adding and subtracting it rounds to a whole number. */
const ROUND = 1.5 * 2 ** 52;

const QUARTERS = 6.36619772367581382433e-1;
const PART1 = 1.57079632673412561417;
const PART2 = 6.0771005063039659766e-11;
const PART3 = 2.0222662487111664558e-21;
const REST = 8.47842766036889956997e-32;

const S1 = -1.66666666666666324348e-1;
const S2 = 8.33333333332248946124e-3;
const S3 = -1.98412698298579493134e-4;
const S4 = 2.75573137070700676789e-6;
const S5 = -2.50507602534068634195e-8;
const S6 = 1.58969099521155010221e-10;
const C1 = 4.16666666666666019037e-2;
const C2 = -1.38888888888741095749e-3;
const C3 = 2.48015872894767294178e-5;
const C4 = -2.75573143513906633035e-7;
const C5 = 2.08757232129817482790e-9;
const C6 = -1.13596475577881948265e-11;

/** Of the arc tangent, and angles with what their doubles lack: atan(1/2), π/4, π/2 and π. */
const A = [
  3.33333333333329318027e-1, -1.99999999998764832476e-1, 1.42857142725034663711e-1,
  -1.11111104054623557880e-1, 9.09088713343650656196e-2, -7.69187620504482999495e-2,
  6.66107313738753120669e-2, -5.83357013379057348645e-2, 4.97687799461593236017e-2,
  -3.65315727442169155270e-2, 1.62858201153657823623e-2,
];
const HALF = [4.63647609000806093515e-1, 2.26987774529616870924e-17];
const EIGHTH = [7.85398163397448278999e-1, 3.06161699786838301793e-17];
const QUARTER = [0.5 * Math.PI, 6.12323399573676603587e-17];
const STRAIGHT = [Math.PI, 1.2246467991473532e-16];

/** Returns sine and cosine of an angle (rad); NaN of angles beyond a million. */
export function sinCos(angle: number): [number, number] {
  if (!(Math.abs(angle) <= LARGEST_ANGLE)) return [NaN, NaN];
  const turns = (angle * QUARTERS + ROUND) - ROUND;
  // The rest, as the sum of x and a tail, without its first digits cancelling away.
  const first = angle - turns * PART1;
  const second = first - turns * PART2;
  const lost = (first - second) - turns * PART2;
  const third = second - turns * PART3;
  let tail = lost + ((second - third) - turns * PART3) - turns * REST;
  const x = third + tail;
  tail = (third - x) + tail;
  const z = x * x;
  const w = z * z;
  const v = z * x;
  let r = S2 + z * (S3 + z * S4) + z * w * (S5 + z * S6);
  const sine = x - ((z * (0.5 * tail - v * r) - tail) - v * S1);
  r = z * (C1 + z * (C2 + z * C3)) + w * w * (C4 + z * (C5 + z * C6));
  const half = 0.5 * z;
  const one = 1.0 - half;
  const cosine = one + (((1.0 - one) - half) + (z * r - x * tail));
  switch (turns & 3) {
    case 0: return [sine, cosine];
    case 1: return [cosine, -sine];
    case 2: return [-sine, -cosine];
    default: return [-cosine, sine];
  }
}

/**
 * Returns the angle of a vector from the x axis, rad, more than -π and at most π.
 * The sign of a zero does not matter, and the vector (0, 0) has the angle 0.
 */
export function atan2(y: number, x: number) {
  const up = Math.abs(y);
  const across = Math.abs(x);
  const steep = up > across;
  const back = x < 0.0;
  const low = steep ? across : up;
  const high = steep ? up : across;
  let at = 0.0;
  let [angle, rest] = [0.0, 0.0];
  if (low > 0.6875 * high) {
    at = 1.0;
    [angle, rest] = EIGHTH;
  } else if (low > 0.4375 * high) {
    at = 0.5;
    [angle, rest] = HALF;
  }
  const t = (low - at * high) / (high === 0.0 ? 1.0 : high + at * low);
  const [base, lack] = steep ? QUARTER : back ? STRAIGHT : [0.0, 0.0];
  const sign = steep !== back ? -1.0 : 1.0;
  const z = t * t;
  const w = z * z;
  const odd = z * (A[0] + w * (A[2] + w * (A[4] + w * (A[6] + w * (A[8] + w * A[10])))));
  const even = w * (A[1] + w * (A[3] + w * (A[5] + w * (A[7] + w * A[9]))));
  const part = sign * angle;
  const most = base + part;
  const loss = part - (most - base);
  const turned = most + (((loss + lack) + sign * rest) + sign * (t - t * (odd + even)));
  return y < 0.0 ? -turned : turned;
}

/** Returns the angle from 0 to π (rad) of a cosine; NaN of what is none. */
export function arcCos(cosine: number) {
  return atan2(Math.sqrt((1.0 - cosine) * (1.0 + cosine)), cosine);
}

/** Returns the length of a vector. */
export function lengthOf(x: number, y: number) {
  return Math.sqrt(x * x + y * y);
}

/**
 * Returns the rest of a division that has the sign of the divisor, as Python's `%`.
 * @param by positive
 */
export function modulo(value: number, by: number) {
  const rest = value % by;
  return rest < 0.0 ? rest + by : rest + 0.0;
}
