// A student's numbers from the name, and values computed from them, like Python's
// `exercises/exercise.py`.

import { generalText } from "./decimal.ts";
import { DomainError, carried, known, valueOfTree, type Tree } from "./formula.ts";
import { sha256 } from "./sha256.ts";

/** Texts are templates; mistakes have name, formula and reply */
type Question = { title: string, text: string, unit: string, answer: Tree, measured: Tree | null,
  angle: boolean,
  mistakes: [string, Tree, string][], general: string[], hints: string[], working: string[],
  source: string };
/** Parameters have name, symbol, unit, meaning and the values to draw from */
export type Exercise = { name: string, number: number, title: string, language: string,
  whole: boolean, story: string, explain: string, unnamed: string, parameters: [string, string,
  string, string, number[]][], formulas: Record<string, Tree>, tell: string[], fits: Tree[],
  machine: Record<string, Tree>, questions: Question[], words: Record<string, string> };
/** A wrong number and its mistake */
type Trace = { called: string, says: string, number: number };

const STANDARD_GRAVITY = 9.81;

/** Relative difference within which an answer counts as right. */
const TOLERANCE = 0.01;

/** Smallest right answer in its unit; a smaller one has too few digits to judge. */
const LEAST_ANSWER = 1e-9;

const MOST_DRAWS = 1000;

/** Most powers of ten up or down: from micro to mega. */
const MOST_TENS = 6;

/** A template of the catalogue with its names filled in. */
function worded({ words }: Exercise, id: string, values: Record<string, string | number> = {}) {
  return words[id].replace(/\{(\w+)\}/g, (_, name) => String(values[name]));
}

/** A number as texts show it. */
const shownNumber = ({ words }: Exercise, value: number) =>
  generalText(value, 4).replace(".", words["decimal-mark"]);

/** The parameters of one draw and all that follows from them. */
class DrawnNumbers {
  found: Map<string, unknown>;

  constructor(
    readonly exercise: Exercise, readonly drawn: Record<string, number>,
    gravity: number = STANDARD_GRAVITY,
  ) {
    this.found = new Map(Object.entries({ ...drawn, g: gravity, transfer: carried(gravity) }));
  }

  /** The value of a name. */
  get(name: string): any {
    const { found, exercise: { formulas } } = this;
    if (!found.has(name)) {
      if (!Object.hasOwn(formulas, name)) return known(name);
      found.set(name, this.of(formulas[name]));
    }
    return found.get(name);
  }

  /** The value of a formula. */
  of(tree: Tree): any {
    return valueOfTree(tree, (name) => this.get(name));
  }

  /** A template with its numbers. */
  text(template: string) {
    return template.replace(/\{(\w+)\}/g, (_, name) => shownNumber(this.exercise, this.get(name)));
  }
}

/** General mistakes of any question, with the wrong answer if the right one is 1, by the key of its
 * name.
 * @param ofAngle whether the answer is in degrees, which have no kg or g */
function generalMistakes(exercise: Exercise, ofAngle: boolean): [string, string, number][] {
  const its = (id: string, values = {}) => worded(exercise, id, values);
  const found: [string, string, number][] = [
    ["mistake-sign", its("reply-sign"), -1],
    ["mistake-half-missing", its("reply-half-missing"), 2],
    ["mistake-half-too-many", its("reply-half-too-many"), 0.5],
  ];
  for (let tens = 1; tens <= MOST_TENS; tens += 1) {
    const times = String(10 ** tens).replace(/\B(?=(\d{3})+$)/g, " ");
    for (const [way, factor] of [["large", 10 ** tens], ["small", 10 ** -tens]] as const) {
      const says = its(ofAngle ? "reply-ten-angle" : "reply-ten", { power: "⁰¹²³⁴⁵⁶"[tens], times, way: its(way) });
      found.push(["mistake-ten", says, factor],
        ["mistake-ten", `${says} ${its("reply-ten-sign")}`, -factor]);
    }
  }
  return [...found, ["mistake-radians", its("reply-radians"), Math.PI / 180],
    ["mistake-radians", its("reply-degrees"), 180 / Math.PI]];
}

/** One question for one student. */
class Case {
  /** The question's own mistakes. */
  own: Trace[];

  /** @param right answer of a machine; by default the formula's */
  constructor(
    readonly question: Question, readonly numbers: DrawnNumbers,
    readonly right: number = numbers.of(question.answer),
  ) {
    this.own = question.mistakes.map(([called, tree, says]) =>
      ({ called, says: numbers.text(says), number: numbers.of(tree) }));
  }

  /** Its own mistakes, then the general ones that it does not replace. */
  get mistakes(): Trace[] {
    const { exercise } = this.numbers, { general, angle } = this.question;
    return [...this.own, ...generalMistakes(exercise, angle).flatMap(([id, says, factor]) =>
      (general.includes(id)
        ? [{ called: worded(exercise, id), says, number: this.right * factor }] : []))];
  }

  /** A mistake of its own, combined with a common one. */
  get pairs(): Trace[] {
    const { exercise } = this.numbers, { general, angle } = this.question;
    const of = angle ? "-angle" : "";
    const more = ([
      ["mistake-sign", "besides-sign", -1], ["mistake-ten", `besides-large${of}`, 1e3],
      ["mistake-ten", `besides-small${of}`, 1e-3],
    ] as [string, string, number][]).filter(([id]) => general.includes(id));
    return this.own.flatMap((first) => more.map(([id, besides, factor]) => ({
      called: worded(exercise, "pair", { first: first.called, second: worded(exercise, id) }),
      says: `${first.says} ${worded(exercise, besides)}`,
      number: factor * first.number,
    })));
  }

  /** Whether the right answer depends on g. */
  get feelsGravity() {
    const { question: { answer }, numbers: { exercise, drawn } } = this;
    // Both by the formula, as a machine's answer may differ in the last digits.
    const [here, elsewhere] = [1, 1.001].map((share) =>
      new DrawnNumbers(exercise, drawn, share * STANDARD_GRAVITY).of(answer));
    return Math.abs(elsewhere - here) > 1e-9 * Math.max(Math.abs(elsewhere), Math.abs(here));
  }

  /** Whether the right answer and all mistakes can be told apart. */
  get clear() {
    const wrong = this.mistakes.map(({ number }) => number), all = [this.right, ...wrong];
    if (!all.every(Number.isFinite) || Math.abs(this.right) < LEAST_ANSWER) return false;
    return !wrong.includes(0) && all.every((a, n) => all.slice(n + 1).every((b) =>
      Math.abs(a - b) > TOLERANCE * (Math.abs(a) + Math.abs(b))));
  }
}

/** A letter without its case, as Unicode folds it. */
function folded(letter: string) {
  if (letter === "ı") return letter;
  // In this script the capitals are the older letters.
  if (/\p{Script=Cherokee}/u.test(letter)) return letter.toUpperCase();
  return letter.toLowerCase().toUpperCase().toLowerCase();
}

/** A name normalised in case, spaces and Unicode forms; "Berg, Mia" is "mia berg". */
const plainName = (student: string) => Array.from(student.normalize("NFKC"), folded).join("")
  .replace(/^([^,]*[^,\s][^,]*),([^,]*[^,\s][^,]*)$/s, "$2 $1").split(/\s+/).filter(Boolean).join(" ");

/** The numbers of one draw. */
function drawnAt(exercise: Exercise, student: string, attempt: number) {
  const drawn: Record<string, number> = {};
  for (const [name, , , , values] of exercise.parameters) {
    const key = [exercise.name, plainName(student), name, attempt].join("\n");
    const [high, low] = sha256(key), { length } = values;
    // The first 64 bits, and their remainder.
    drawn[name] = values[((high % length) * (2 ** 32 % length) + (low % length)) % length];
  }
  return drawn;
}

/** Whether a draw fulfils the lesson's conditions, and all mistakes can be told apart. */
function fitsLesson(numbers: DrawnNumbers) {
  const { fits, questions } = numbers.exercise;
  try {
    return fits.every((condition) => numbers.of(condition))
      && questions.every((question) => new Case(question, numbers).clear);
  } catch (error) {
    if (error instanceof DomainError) return false;
    throw error;
  }
}

/** A student's numbers. */
function drawnFor(exercise: Exercise, student: string) {
  for (let attempt = 0; attempt < MOST_DRAWS; attempt += 1) {
    const numbers = new DrawnNumbers(exercise, drawnAt(exercise, student, attempt));
    if (!fitsLesson(numbers)) continue;
    const told = exercise.tell.map((name) => [name, numbers.get(name)]);
    return new DrawnNumbers(exercise, { ...numbers.drawn, ...Object.fromEntries(told) });
  }
  throw new Error(`${exercise.name}: no draw fits`);
}

export {
  Case, DrawnNumbers, STANDARD_GRAVITY, TOLERANCE, drawnFor, plainName, shownNumber, worded,
};
