// The random numbers of NumPy's `default_rng`, to the last bit: PCG64 (M. O'Neill), seeded by what
// NumPy calls a SeedSequence. Both are of whole numbers of 128 and 32 bits.

const POOL = 4;
const MULTIPLIER = 0x2360ed051fc65da44385df649fccf645n;
const MASK_64 = (1n << 64n) - 1n;

/** Returns the 32-bit words of a whole number, the lowest first. */
function wordsOf(number: bigint) {
  const words = [];
  do {
    words.push(Number(number & 0xffffffffn));
    number >>= 32n;
  } while (number > 0n);
  return words;
}

/** Returns a function that hashes one word after the other. */
function hasher(start: number, factor: number): (word: number) => number {
  let constant = start;
  return (word) => {
    const mixed = word ^ constant;
    constant = Math.imul(constant, factor);
    const value = Math.imul(mixed, constant);
    return (value ^ (value >>> 16)) >>> 0;
  };
}

function mix(a: number, b: number) {
  const value = (Math.imul(a, 0xca01f9dd) - Math.imul(b, 0x4973f715)) | 0;
  return (value ^ (value >>> 16)) >>> 0;
}

/**
 * Returns 256 bits that a seed gives, as four numbers of 64 bits.
 * @param entropy 32-bit words
 */
function seeded(entropy: number[]) {
  const hash = hasher(0x43b0d7e5, 0x931e8875);
  const pool = Array.from({ length: POOL }, (_, n) => hash(entropy[n] ?? 0));
  for (let from = 0; from < POOL; from++) {
    for (let to = 0; to < POOL; to++) {
      if (from !== to) pool[to] = mix(pool[to], hash(pool[from]));
    }
  }
  for (const word of entropy.slice(POOL)) {
    for (let to = 0; to < POOL; to++) pool[to] = mix(pool[to], hash(word));
  }
  const spread = hasher(0x8b51f9dd, 0x58f38ded);
  const words = Array.from({ length: 2 * POOL }, (_, n) => BigInt(spread(pool[n % POOL])));
  return [0, 2, 4, 6].map((n) => words[n] | (words[n + 1] << 32n));
}

export interface Generator {
  random: () => number; // a number from 0 to 1, without 1
  uniform: (low: number, high: number) => number; // one from low to high
}

/**
 * Returns the generator that `numpy.random.default_rng` makes of a seed, or of a list of them.
 * @param seeds whole numbers from 0; beyond 2**53 as text
 */
export function generator(...seeds: (number | string | bigint)[]): Generator {
  const [high, low, stream, more] = seeded(seeds.flatMap((seed) => wordsOf(BigInt(seed))));
  const odd = BigInt.asUintN(128, (((stream << 64n) | more) << 1n) | 1n);
  let state = 0n;
  const step = () => {
    state = BigInt.asUintN(128, state * MULTIPLIER + odd);
  };
  step();
  state += (high << 64n) | low;
  step();

  const random = () => {
    step();
    const folded = (state >> 64n) ^ (state & MASK_64);
    const turn = state >> 122n;
    const turned = ((folded >> turn) | (folded << (64n - turn))) & MASK_64;
    return Number(turned >> 11n) * 2 ** -53;
  };
  return { random, uniform: (begin, end) => begin + (end - begin) * random() };
}
