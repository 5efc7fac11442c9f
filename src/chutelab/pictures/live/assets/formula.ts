// Formulas of rules and exercises: trees made by Python's parser (`scene/formulas.py`), and
// functions of exercises.

import { fixedText } from "./decimal.ts";
import { separationWithSlip, transfer } from "./transfer.ts";

export type Tree = string | number | boolean | any[];
/** The value of a name; undefined if it has none */
type Scope = (name: string) => unknown;

/** A function has no value at its argument, such as the arccos of more than 1: Python's ValueError.
 */
class DomainError extends Error {}

function inDomain(value: number) {
  if (Number.isNaN(value)) throw new DomainError();
  return value;
}

const DEGREES_OF_RADIAN = 180 / Math.PI, RADIANS_OF_DEGREE = Math.PI / 180;

const KNOWN: Record<string, unknown> = {
  abs: Math.abs,
  acos: (x: number) => inDomain(Math.acos(x)),
  asin: (x: number) => inDomain(Math.asin(x)),
  atan: Math.atan,
  atan2: Math.atan2,
  cos: Math.cos,
  degrees: (x: number) => x * DEGREES_OF_RADIAN,
  dict: (named: object) => named,
  hypot: Math.hypot,
  inf: Infinity,
  log: (x: number, base = Math.E) => positive(x, base === Math.E
    ? Math.log(x) : Math.log(x) / Math.log(base)),
  log10: (x: number) => positive(x, Math.log10(x)),
  radians: (x: number) => x * RADIANS_OF_DEGREE,
  round: (x: number, places = 0) => Number(fixedText(x, places)),
  sin: Math.sin,
  sqrt: (x: number) => inDomain(Math.sqrt(x)),
};

const positive = (x: number, value: number) => inDomain(x > 0 ? value : NaN);

/** Functions in formulas, besides their own names. */
const known = (name: string) => (Object.hasOwn(KNOWN, name) ? KNOWN[name] : undefined);

const OPERATIONS: Record<string, (a: number, b: number) => number | boolean> = {
  "+": (a, b) => a + b,
  "-": (a, b) => a - b,
  "*": (a, b) => a * b,
  "/": (a, b) => a / b,
  "**": (a, b) => (b === 2 ? a * a : a ** b),
  "<": (a, b) => a < b,
  "<=": (a, b) => a <= b,
  ">": (a, b) => a > b,
  ">=": (a, b) => a >= b,
  "==": (a, b) => a === b,
};

/** The value of a formula. */
function valueOfTree(tree: Tree, scope: Scope): any {
  if (typeof tree === "string") {
    const value = scope(tree);
    if (value === undefined) throw new Error(`no ${tree} in formulas`);
    return value;
  }
  if (!Array.isArray(tree)) return tree;
  const [kind, first, ...others] = tree;
  const of = (part: Tree) => valueOfTree(part, scope);
  switch (kind) {
    case "text": return first;
    case "not": return !of(first);
    case "and": return tree.slice(1).every(of);
    case "or": return tree.slice(1).some(of);
    case "list": return tree.slice(1).map(of);
    case ".": return of(first)[others[0]];
    case "item": return of(first)[of(others[0])];
    case "lambda": return (...given: unknown[]) => valueOfTree(others[0],
      (name) => (first.includes(name) ? given[first.indexOf(name)] : scope(name)));
    case "call": return called(of(first), others[0].map(of), others[1], of);
    case "compare": {
      let left = of(first);
      for (let n = 0; n < others.length; n += 2) {
        const right = of(others[n + 1]);
        if (!OPERATIONS[others[n]](left, right)) return false;
        left = right;
      }
      return true;
    }
    default: return others.length ? OPERATIONS[kind](of(first), of(others[0])) : -of(first);
  }
}

function called(
  act: Function, given: unknown[], named: [string, Tree][] | [Tree][], of: (part: Tree) => any,
) {
  if (!named.length) return act(...given);
  const all = {};
  for (const [name, value] of named) {
    Object.assign(all, value === undefined ? of(name) : { [String(name)]: of(value) });
  }
  return act(...given, all);
}

/** The closed form for formulas: Python's names, and a list for several at once. */
const carried = (gravity: number) => (named: Record<string, any>) => {
  const { length: many = 0 } = Object.values(named).find(Array.isArray) ?? [];
  const one = (n: number) => {
    const given: Record<string, any> = { gravity };
    for (const [name, value] of Object.entries(named)) {
      const key = name.replace(/_(\w)/g, (_, letter) => letter.toUpperCase());
      given[key] = Array.isArray(value) ? value[n] : value;
    }
    return closedForm(given);
  };
  if (!many) return one(0);
  const found = Array.from({ length: many }, (_, n) => one(n));
  return Object.fromEntries(Object.keys(found[0]).map((key) =>
    [key, found.map((numbers) => numbers[key])]));
};

/** @param given parameters of a transfer */
function closedForm(
  { friction = Infinity, rebound = "corrected", ...given }: any,
): Record<string, number> {
  const { numbers } = transfer({ ...given, asPrinted: rebound === "as-printed" });
  if (friction === Infinity) return numbers;
  // If it slips before it leaves, formulas need nothing later.
  return separationWithSlip({ ...given, friction });
}

export { DomainError, carried, known, valueOfTree };
