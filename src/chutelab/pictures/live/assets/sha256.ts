// SHA-256 (FIPS 180-4): the browser's own is not available in pages opened from a file.

/** The first 32 bits of the fractional parts of roots of the first primes.
 * @param count of primes
 * @param power of the root */
function rootsOfPrimes(count: number, power: number) {
  const found = [];
  for (let n = 2; found.length < count; n += 1) {
    let prime = true;
    for (let d = 2; d * d <= n; d += 1) prime &&= n % d !== 0;
    if (prime) found.push((n ** power % 1) * 2 ** 32 | 0);
  }
  return found;
}

const SHA_START = rootsOfPrimes(8, 1 / 2), SHA_CONSTANTS = rootsOfPrimes(64, 1 / 3);

const turned = (word: number, by: number) => (word >>> by) | (word << (32 - by));

/** The digest of a text in UTF-8, as eight words. */
function sha256(text: string) {
  const bytes = new TextEncoder().encode(text);
  const padded = new DataView(new ArrayBuffer((bytes.length + 72) & ~63));
  bytes.forEach((byte, n) => padded.setUint8(n, byte));
  padded.setUint8(bytes.length, 0x80);
  padded.setUint32(padded.byteLength - 4, 8 * bytes.length);
  const state = [...SHA_START];
  const words = new Int32Array(64);
  for (let at = 0; at < padded.byteLength; at += 64) {
    for (let n = 0; n < 64; n += 1) {
      if (n < 16) {
        words[n] = padded.getInt32(at + 4 * n);
        continue;
      }
      const [low, high] = [words[n - 15], words[n - 2]];
      words[n] = words[n - 16] + (turned(low, 7) ^ turned(low, 18) ^ (low >>> 3))
        + words[n - 7] + (turned(high, 17) ^ turned(high, 19) ^ (high >>> 10));
    }
    let [a, b, c, d, e, f, g, h] = state;
    for (let n = 0; n < 64; n += 1) {
      const first = h + (turned(e, 6) ^ turned(e, 11) ^ turned(e, 25)) + ((e & f) ^ (~e & g))
        + SHA_CONSTANTS[n] + words[n];
      const second = (turned(a, 2) ^ turned(a, 13) ^ turned(a, 22)) + ((a & b) ^ (a & c) ^ (b & c));
      [h, g, f, e, d, c, b, a] = [g, f, e, d + first | 0, c, b, a, first + second | 0];
    }
    [a, b, c, d, e, f, g, h].forEach((word, n) => { state[n] = state[n] + word | 0; });
  }
  return state.map((word) => word >>> 0);
}

export { sha256 };
