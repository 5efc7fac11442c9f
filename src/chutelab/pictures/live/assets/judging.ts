// Replies to typed answers: like Python's `exercises/judging.py`, but answers are text, with a
// point or a comma, and perhaps with a unit.

import { fixedText, scientific } from "./decimal.ts";
import {
  STANDARD_GRAVITY, TOLERANCE, worded, shownNumber, type Case, type Exercise,
} from "./draw.ts";

export type Verdict = "blank" | "right" | "mistake" | "off" | "unread";
export type Reply = { verdict: Verdict, text: string, mistake: string };

/** Relative difference up to which rounding, or another g, is the likely reason. */
const CLOSE_BY = 0.05;

/** From this ratio on a factor is clearer than a percentage. */
const FAR_OFF = 10;

/** Most characters of the typed text that a reply quotes. */
const LONGEST_SHOWN = 40;

const TYPED_NUMBER = new RegExp([
  /^([-+]?\d+(?:[.,]\d*)?|[-+]?[.,]\d+)/, // with a point, or a comma
  /(?:e([-+]?\d+)|\s*[·×*x]\s*10\s*\^?\s*([-+]?\d+))?/, // 1e-3, 1·10^-3
  /\s*(.*)$/, // and what comes then
].map(({ source }) => source).join(""), "is");

const SUPERSCRIPTS = "⁰¹²³⁴⁵⁶⁷⁸⁹⁻";

/** Words for degrees that may be typed. */
const DEGREES_TYPED = ["°", "deg", "degree", "degrees", "grad"];

/** The typed number, null for nothing, or advice in words.
 * @param unit asked for */
function readTyped(typed: string, unit: string): number | null | { why: string, text: string } {
  const text = typed.trim();
  if (/^[.?…_\s-]*$/.test(text)) return null;
  const shown = text.slice(0, LONGEST_SHOWN);
  const plain = text.replace(/[−–]/g, "-")
    .replace(/[⁰¹²³⁴⁵⁶⁷⁸⁹⁻]/g, (sign) => "0123456789-"[SUPERSCRIPTS.indexOf(sign)]);
  const found = TYPED_NUMBER.exec(plain);
  if (!found) return { why: "text", text: shown };
  const [, digits, power = "", times = power, rest] = found;
  const said = rest.replace(/\s/g, "").toLowerCase();
  const asked = /^(degrees|grad)$/i.test(unit) ? DEGREES_TYPED : [unit.toLowerCase()];
  if (/^['.,\d]/.test(said)) return { why: "pieces", text: shown };
  if (/^[-+*/^=(:]/.test(said)) return { why: "sum", text: shown };
  if (said && !asked.includes(said)) return { why: "unit", text: shown };
  const value = Number(`${digits.replace(",", ".")}e${times || 0}`);
  return Number.isFinite(value) ? value : { why: "infinite", text: shown };
}

/** Whether an answer counts as a number. */
const isClose = (
  answer: number, number: number,
) => Math.abs(answer - number) <= TOLERANCE * Math.abs(number);

/** Whether an answer is a number, rounded to three digits or more. */
function isRounded(answer: number, number: number) {
  const { length } = scientific(answer, 16).digits.replace(/0+$/, "");
  const kept = Math.min(Math.max(length, 3), 4);
  const [mine, its] = [scientific(answer, kept), scientific(number, kept)];
  return mine.digits === its.digits && mine.power === its.power
    && Math.sign(answer) === Math.sign(number);
}

/** A number with its unit. */
const withUnit = (
  exercise: Exercise, value: number, unit: string,
) => `${shownNumber(exercise, value)} ${unit}`.trim();

/** Judge a finite answer: right, a known mistake, right for another student, two mistakes at once,
 * or off.
 * @param others names and right answers of others; used only if needed */
function judge(its: Case, answer: number, others: Iterable<[string, number]> = []): Reply {
  const { right, numbers: { exercise }, question: { unit } } = its;
  const mistaken = (mistake: string, text: string) =>
    ({ verdict: "mistake", text, mistake } as Reply);
  if (isClose(answer, right)) {
    const text = worded(exercise, "right", {
      answer: withUnit(exercise, answer, unit), percent: 100 * TOLERANCE,
    });
    return { verdict: "right", text, mistake: "" };
  }
  const known = its.mistakes.find(({ number }) => isClose(answer, number));
  if (known) return mistaken(known.called, known.says);
  for (const [name, number] of others) {
    if (isRounded(answer, number)) {
      return mistaken(worded(exercise, "mistake-others"), worded(exercise, "reply-others", { name }));
    }
  }
  // A close answer hardly has two mistakes, and if two pairs lead to it, neither is named.
  const pairs = its.pairs.filter(({ number }) => isClose(answer, number));
  if (pairs.length === 1 && Math.abs(answer / right - 1) > CLOSE_BY) {
    return mistaken(pairs[0].called, pairs[0].says);
  }
  return { verdict: "off", text: distanceSaid(its, answer), mistake: "" };
}

/** How far off an answer is, without giving the right one away. */
function distanceSaid(its: Case, answer: number) {
  const { exercise } = its.numbers, ratio = answer / its.right;
  const local = (text: string) => text.replace(".", worded(exercise, "decimal-mark"));
  if (ratio === 0) return worded(exercise, "off-zero");
  if (ratio < 0) return worded(exercise, "off-sign");
  const off = Math.abs(ratio - 1), times = Math.max(ratio, 1 / ratio);
  const way = worded(exercise, ratio > 1 ? "large" : "small"), percent = fixedText(100 * off, 0);
  if (off <= CLOSE_BY) {
    const gravity = local(String(STANDARD_GRAVITY));
    return worded(exercise, its.feelsGravity ? "off-close-gravity" : "off-close", { percent, way, gravity });
  }
  if (1 / FAR_OFF < ratio && ratio < FAR_OFF) {
    const size = off < 1 ? worded(exercise, "off-percent", { percent })
      : worded(exercise, "off-factor", { factor: local(fixedText(times, 1)) });
    return worded(exercise, "off-about", { size, way });
  }
  return worded(exercise, "off-more", { times: FAR_OFF <= times && times < FAR_OFF ** 2 ? 10 : 100, way });
}

export { judge, readTyped, withUnit };
