// The core's sine, cosine and inverses: the same bits everywhere.

import type { Memory } from "./core.ts";

/** Radians of one degree. */
export const RADIANS = Math.PI / 180.0;

let functions: Record<"sine" | "cosine" | "angle_of" | "angle_of_cosine",
  (...numbers: number[]) => number>;

/** Take the functions of a core; nothing here works before that. */
export function useCore({ exports }: Memory) {
  functions = exports;
}

/** Returns sine and cosine of an angle (rad); NaN of angles beyond a million. */
export function sinCos(angle: number): [number, number] {
  return [functions.sine(angle), functions.cosine(angle)];
}

/**
 * Returns the angle of a vector from the x axis, rad, more than -π and at most π.
 * The sign of a zero does not matter, and the vector (0, 0) has the angle 0.
 */
export function atan2(y: number, x: number) {
  return functions.angle_of(y, x);
}

/** Returns the angle from 0 to π (rad) of a cosine; NaN of other numbers. */
export function arcCos(cosine: number) {
  return functions.angle_of_cosine(cosine);
}

/** Returns the length of a vector. */
export function lengthOf(x: number, y: number) {
  return Math.sqrt(x * x + y * y);
}

/** Returns the remainder with the sign of the divisor, as Python's `%`.
 * @param by positive
 */
export function modulo(value: number, by: number) {
  const rest = value % by;
  return rest < 0.0 ? rest + by : rest + 0.0;
}
