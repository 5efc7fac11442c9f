// What a value has to look like: as much of JSON Schema as scene files need.

/**
 * @typedef {object} Form a JSON Schema
 * @property {"number" | "integer" | "boolean" | "string" | "array"} [type]
 * @property {Form[]} [anyOf]
 * @property {unknown[]} [enum]
 * @property {unknown} [const]
 * @property {number} [minimum]
 * @property {number} [maximum]
 * @property {number} [exclusiveMinimum]
 * @property {number} [exclusiveMaximum]
 * @property {Form} [not] a range that is left out
 * @property {number} [maxLength]
 * @property {string} [pattern]
 * @property {number} [minItems]
 * @property {number} [maxItems]
 * @property {Form[]} [prefixItems]
 * @property {Form} [items]
 */

/** Half of a character that takes two, without the other. */
const LONE_HALF = /\p{Surrogate}/u;

/**
 * Tells whether a value has a form.
 * @param {any} value
 * @param {Form} form
 * @returns {boolean}
 */
export function fits(value, form) {
  if (form.anyOf) return form.anyOf.some((one) => fits(value, one));
  if (form.enum) return form.enum.includes(value);
  if (form.const !== undefined) return value === form.const;
  switch (form.type) {
    case "integer": return fitsWhole(value, form);
    case "number": return Number.isFinite(value) && isInRange(value, form);
    case "string": return typeof value === "string" && fitsText(value, form);
    case "array": return Array.isArray(value) && fitsList(value, form);
    default: return typeof value === form.type;
  }
}

/**
 * Tells whether a value is a whole number; beyond 2**53 it is text, with all its digits.
 * @param {any} value
 * @param {Form} form
 */
function fitsWhole(value, form) {
  const { maximum = Infinity } = form;
  if (typeof value === "string" && maximum > Number.MAX_SAFE_INTEGER) {
    return /^\d{1,19}$/.test(value) && BigInt(value) < 1n << 63n;
  }
  return Number.isSafeInteger(value) && isInRange(value, form);
}

/**
 * @param {number} value
 * @param {Form} form
 */
function isInRange(value, { minimum, maximum, exclusiveMinimum, exclusiveMaximum, not }) {
  if (not && isInRange(value, not)) return false;
  return !(value < (minimum ?? -Infinity) || value > (maximum ?? Infinity)
    || value <= (exclusiveMinimum ?? -Infinity) || value >= (exclusiveMaximum ?? Infinity));
}

/**
 * @param {string} value
 * @param {Form} form
 */
function fitsText(value, { maxLength, pattern }) {
  // Counted as Python does, by characters and not by their halves.
  const short = maxLength === undefined || [...value].length <= maxLength;
  return short && !LONE_HALF.test(value) && (!pattern || new RegExp(pattern, "u").test(value));
}

/**
 * @param {any[]} value
 * @param {Form} form
 */
function fitsList(value, { minItems = 0, maxItems = Infinity, prefixItems, items }) {
  if (value.length < minItems || value.length > maxItems) return false;
  return value.every((entry, n) => fits(entry, prefixItems?.[n] ?? items ?? {}));
}
