// Forms of values: the part of JSON Schema that scene files need.

/** A JSON Schema */
export interface Form {
  type?: "number" | "integer" | "boolean" | "string" | "array";
  anyOf?: Form[];
  enum?: unknown[];
  const?: unknown;
  minimum?: number;
  maximum?: number;
  exclusiveMinimum?: number;
  exclusiveMaximum?: number;
  not?: Form; // a range that is left out
  maxLength?: number;
  pattern?: string;
  minItems?: number;
  maxItems?: number;
  prefixItems?: Form[];
  items?: Form;
}

/** A lone surrogate. */
const LONE_HALF = /\p{Surrogate}/u;

/** Tells whether a value has a form. */
export function fits(value: any, form: Form): boolean {
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

/** Tells whether a value is a whole number; beyond 2**53 it is text, with all its digits. */
function fitsWhole(value: any, form: Form) {
  const { maximum = Infinity } = form;
  if (typeof value === "string" && maximum > Number.MAX_SAFE_INTEGER) {
    return /^\d{1,19}$/.test(value) && BigInt(value) < 1n << 63n;
  }
  return Number.isSafeInteger(value) && isInRange(value, form);
}

function isInRange(
  value: number, { minimum, maximum, exclusiveMinimum, exclusiveMaximum, not }: Form,
) {
  if (not && isInRange(value, not)) return false;
  return !(value < (minimum ?? -Infinity) || value > (maximum ?? Infinity)
    || value <= (exclusiveMinimum ?? -Infinity) || value >= (exclusiveMaximum ?? Infinity));
}

function fitsText(value: string, { maxLength, pattern }: Form) {
  // Count characters like Python, not surrogates.
  const short = maxLength === undefined || [...value].length <= maxLength;
  return short && !LONE_HALF.test(value) && (!pattern || new RegExp(pattern, "u").test(value));
}

function fitsList(value: any[], { minItems = 0, maxItems = Infinity, prefixItems, items }: Form) {
  if (value.length < minItems || value.length > maxItems) return false;
  return value.every((entry, n) => fits(entry, prefixItems?.[n] ?? items ?? {}));
}
