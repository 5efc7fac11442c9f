// Numbers in digits as Python writes them: exact halves are rounded to the even digit.

/** Whether a number, rounded to so many digits behind the point, is exactly halfway between two.
 * @param size >= 0 */
function isHalfway(size: number, places: number) {
  // Then it is an odd number of halves of the last digit, which few binary numbers are.
  return places >= 0 ? (size * 2 ** (places + 1)) % 2 === 1
    : size % 10 ** -places === 0.5 * 10 ** -places;
}

/** Digits that JavaScript rounded up where they are halfway. */
const toEven = (digits: string) =>
  digits.replace(/\d$/, (last) => (Number(last) % 2 ? String(Number(last) - 1) : last));

/** Python's `f"{value:.{places}f}"`. */
function fixedText(value: number, places: number) {
  const text = value.toFixed(places);
  return isHalfway(Math.abs(value), places) ? toEven(text) : text;
}

/** Digits and power of ten of Python's `f"{value:.{count - 1}e}"`, without sign and point.
 * @param count of digits */
function scientific(value: number, count: number) {
  const size = Math.abs(value), [mantissa, power] = size.toExponential(count - 1).split("e");
  const digits = mantissa.replace(".", "");
  const places = count - 1 - Number(power);
  return { digits: isHalfway(size, places) ? toEven(digits) : digits, power: Number(power) };
}

/** Python's `f"{value:.{count}g}"`, but powers without zeros in front.
 * @param count of digits */
function generalText(value: number, count: number) {
  const { digits, power } = scientific(value, count);
  const sign = value < 0 || Object.is(value, -0) ? "-" : "";
  const pointed = (whole: string, rest: string) =>
    `${sign}${whole}.${rest}`.replace(/\.?0*$/, "");
  if (power < -4 || power >= count) return `${pointed(digits[0], digits.slice(1))}e${power}`;
  return power < 0 ? pointed("0", "0".repeat(-1 - power) + digits)
    : pointed(digits.slice(0, power + 1), digits.slice(power + 1));
}

export { fixedText, generalText, scientific };
