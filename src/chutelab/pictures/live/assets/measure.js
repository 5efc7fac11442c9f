// What a machine does with a student's numbers: run once, in a thread of its own, and read off.

import { valueOfTree } from "./formula.js";
import { withValues } from "./keys.js";
import { build } from "./machine.js";
import { resolve } from "./scene.js";

/**
 * @typedef {import("./core.js").Event} Event
 * @typedef {import("./draw.js").DrawnNumbers} DrawnNumbers
 * @typedef {import("./draw.js").Exercise} Exercise
 * @typedef {import("./engine.js").Engine} Engine
 * @typedef {import("./scene.js").Given} Given
 */

/** Events that formulas read off, by their kind in the core. */
const READ_OFF = /** @type {Record<number, string>} */ ({
  1: "separation", 3: "impact", 4: "landing",
});

/** The page's scene with the numbers of an exercise's machine.
 * @param {Given} scene @param {DrawnNumbers} numbers @returns {Given} */
function machineOf(scene, numbers) {
  const values = Object.entries(numbers.exercise.machine)
    .map(([key, tree]) => [key, numbers.of(tree)]);
  return withValues(scene, Object.fromEntries(values));
}

/** What a run tells, by name: the first events of each kind, and energies (J) by surface.
 * @param {Event[]} events @param {number[][]} books @param {string[]} surfaces */
function toldByRun(events, books, surfaces) {
  /** @type {Record<string, object>} */
  const told = {};
  surfaces.forEach((name, row) => {
    const [belt_work, restitution_loss, friction_loss] = books[row];
    told[name] = { belt_work, restitution_loss, friction_loss };
  });
  for (const { kind, t, x, y, before, after } of events) {
    const velocity = (/** @type {ArrayLike<number>} */ v) => ({ vx: v[0], vy: v[1] });
    if (kind in READ_OFF) {
      told[READ_OFF[kind]] ??= { t, x, y, before: velocity(before), after: velocity(after) };
    }
  }
  return told;
}

/** The right answers as the machine gives them, by question from 0 on; none where no machine does.
 * @param {Given} scene @param {any} page its data @param {DrawnNumbers} numbers
 * @param {Engine} engine that nobody else uses @returns {Promise<Map<number, number>>} */
function measured(scene, page, numbers, engine) {
  const machine = build(resolve(machineOf(scene, numbers), page));
  /** @type {Event[]} */
  const events = [];
  return new Promise((done) => {
    engine.run(machine, Infinity, ({ events: more, state, books }) => {
      events.push(...more);
      if (state === "running") return;
      /** @type {Map<number, number>} */
      const found = new Map();
      const told = books ? toldByRun(events, books, machine.surfaces) : {};
      numbers.exercise.questions.forEach((question, n) => {
        if (!question.measured || state !== "done") return;
        found.set(n, valueOfTree(question.measured, (name) => told[name] ?? numbers.get(name)));
      });
      done(found);
    });
  });
}

export { machineOf, measured };
