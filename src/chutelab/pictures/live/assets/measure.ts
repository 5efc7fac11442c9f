// What a machine does with a student's numbers: run once, in a thread of its own, and read off.

import { valueOfTree } from "./formula.ts";
import { withValues } from "./keys.ts";
import { build } from "./machine.ts";
import { resolve, type Given } from "./scene.ts";
import type { Event } from "./core.ts";
import type { DrawnNumbers } from "./draw.ts";
import type { Engine } from "./engine.ts";

/** Events that formulas read off, by their kind in the core. */
const READ_OFF: Record<number, string> = {
  1: "separation", 3: "impact", 4: "landing",
};

/** The page's scene with the numbers of an exercise's machine. */
function machineOf(scene: Given, numbers: DrawnNumbers): Given {
  const values = Object.entries(numbers.exercise.machine)
    .map(([key, tree]) => [key, numbers.of(tree)]);
  return withValues(scene, Object.fromEntries(values));
}

/** What a run tells, by the names of quantities: first events, and energies (J) by surface. */
function toldByRun(events: Event[], books: number[][], surfaces: string[]) {
  const by_surface = Object.fromEntries(surfaces.map((name, row) => {
    const [belt_work, restitution_loss, friction_loss] = books[row];
    return [name, { belt_work, restitution_loss, friction_loss }];
  }));
  const told: Record<string, object> = { ledger: { by_surface } };
  for (const { kind, t, x, y, before: [vx, vy], after: [vx_after, vy_after] } of events) {
    if (kind in READ_OFF) told[READ_OFF[kind]] ??= { t, x, y, vx, vy, vx_after, vy_after };
  }
  return told;
}

/** The right answers as the machine gives them, by question from 0 on; none where no machine does.
 * @param page its data @param engine that nothing else uses */
function measured(
  scene: Given, page: any, numbers: DrawnNumbers, engine: Engine,
): Promise<Map<number, number>> {
  const machine = build(resolve(machineOf(scene, numbers), page));
  const events: Event[] = [];
  return new Promise((done) => {
    engine.run(machine, Infinity, ({ events: more, state, books }) => {
      events.push(...more);
      if (state === "running") return;
      const found: Map<number, number> = new Map();
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
