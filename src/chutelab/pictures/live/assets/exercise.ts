// The exercise of a lesson: questions with numbers that come from a name, hints, replies, and the
// file that is handed in.

import { valueOfTree } from "./formula.ts";
import { withValues } from "./keys.ts";
import { build } from "./machine.ts";
import { html } from "./panels.ts";
import { resolve, type Given } from "./scene.ts";
import { download, fileStem } from "./share.ts";
import { LONGEST_WORDS, Task } from "./task.ts";
import type { Event } from "./core.ts";
import type { DrawnNumbers } from "./draw.ts";
import type { Engine } from "./engine.ts";
import type { Verdict } from "./judging.ts";
import type { Lab } from "./lab.ts";
import type { Words } from "./words.ts";

/** Signs of verdicts; the words always say the same. */
const MARKS: Record<Verdict, string> = {
  blank: "○", right: "✓", mistake: "↻", off: "↻", unread: "?",
};

/** Whether a step asks to explain in words. */
const isInWords = ({ kind, asks }: { kind: string, asks: { choices: string[] }[] }) =>
  kind === "explain" && asks.some(({ choices }) => !choices.length);

/** Events used by formulas, by their kind in the core. */
const READ_OFF: Record<number, string> = {
  1: "separation", 3: "impact", 4: "landing",
};

/** The keys of an exercise's machine with a student's numbers; none without a machine. */
function machineOf(numbers: DrawnNumbers): Record<string, unknown> {
  return Object.fromEntries(Object.entries(numbers.exercise.machine)
    .map(([key, tree]) => [key, numbers.of(tree)]));
}

/** Values of a run by the names of quantities: first events, and energies (J) by surface. */
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

/** The right answers of the machine, by question from 0 on; none without a machine.
 * @param page its data
 * @param engine not used elsewhere */
function measured(
  scene: Given, page: any, numbers: DrawnNumbers, engine: Engine,
): Promise<Map<number, number>> {
  const machine = build(resolve(withValues(scene, machineOf(numbers)), page));
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

class Questions {
  root;
  rows;
  exercise;

  /** @param newEngine with a thread of its own @param changed called when an answer was given */
  constructor(
    readonly lab: Lab, readonly words: Words, readonly task: Task,
    readonly newEngine: () => Engine, readonly changed: () => void,
  ) {
    const { exercise } = task;
    this.exercise = exercise;
    this.measure();
    this.rows = exercise.questions.map((_, n) => this.question(task, n));
    this.root = html("div", { id: "exercise" },
      html("h3", {}, task.worded("numbers-of", { student: task.student })),
      html("table", { class: "given" }, html("tbody", {}, ...task.rows.map((
        [symbol, value, meaning],
      ) =>
        html("tr", {}, html("th", { scope: "row" }, html("b", {}, symbol), ` ${meaning}`),
          html("td", {}, value))))),
      html("p", {}, task.story),
      ...(Object.keys(exercise.machine).length ? []
        : [html("p", { class: "note" }, words.say("exercise-picture"))]),
      ...(exercise.whole ? [] : [html("p", { class: "note" }, task.worded("untranslated"))]),
      ...this.rows.map(({ section }) => section), ...this.explanation(),
      html("div", { class: "row" },
        this.button("result", words.say("exercise-result"), () => this.save(), "main")),
      html("p", { class: "note" }, words.say("exercise-result-note")));
    const next = task.standings.findIndex(({ verdict }) => verdict !== "right");
    if (next >= 0) this.rows[next].section.open = true;
    this.refresh();
  }

  button(id: string, text: string, act: () => void, kind: string = "") {
    return html("button", { class: kind, ...(id ? { id } : {}), click: act }, text);
  }

  /** Get the right answers from the machine with a student's numbers. */
  async measure() {
    if (!this.exercise.questions.some((question) => question.measured)) return;
    const engine = this.newEngine(), { first, data } = this.lab;
    this.task.measured = await measured(first, data, this.task.numbers, engine);
    engine.worker.terminate();
  }

  question(task: Task, n: number) {
    const { words } = this, { unit, hints } = this.exercise.questions[n], id = `question-${n + 1}`;
    const { title, text, needed } = task.asked(n), standing = task.standings[n];
    const mark = html("span", { class: "mark", "aria-hidden": "true" });
    const state = html("p", { class: "note state" });
    const reply = html("p", { class: "reply", role: "status", id: `${id}-reply` });
    const told = html("div", { class: "told", "aria-live": "polite" });
    const input = html("input", {
      type: "text", id: `${id}-answer`, inputmode: "text", autocomplete: "off", autocapitalize: "off",
      spellcheck: "false", "aria-label": title, "aria-describedby": `${id}-needed ${id}-reply`,
    });
    if (standing.answer !== null) input.value = words.plain(standing.answer).replace("−", "-");
    const check = () => {
      const { verdict, heading, text: said, unread } = task.check(n, input.value);
      const sentence = unread ? words.say(`typed-${unread.why}`, { text: unread.text })
        : verdict === "blank" ? words.say("exercise-blank") : said;
      reply.replaceChildren(html("b", {}, `${MARKS[verdict]} ${heading}. `), sentence);
      reply.setAttribute("data-verdict", verdict);
      reply.className = `reply ${verdict}`;
      this.tell();
      reply.scrollIntoView({ block: "nearest" });
    };
    const showHint = (hint: number) => {
      const { title: which, text: said, last } = task.hintAt(n, hint);
      told.append(html("p", {}, html("b", {}, which), html("br"), said));
      if (last) told.append(html("p", { class: "note" }, task.worded("hint-last")));
    };
    const showWorking = () => {
      const { title: which, lines } = task.reveal(n);
      told.append(html("p", { class: "lines" }, html("b", {}, which),
        ...lines.flatMap((line) => [html("br"), line])));
    };
    const hint = this.button("", words.say("exercise-hint"), () => {
      task.hint(n);
      showHint(standing.hints);
      this.tell();
    }, "hint");
    const working = this.button("", words.say("exercise-working"), () => {
      showWorking();
      this.tell();
    }, "working");
    for (let one = 1; one <= standing.hints; one += 1) showHint(one);
    if (standing.revealed) showWorking();
    input.addEventListener("keydown", (event: KeyboardEvent) => {
      if (event.key === "Enter") check();
    });
    const section = html("details", { class: "question", "data-question": String(n + 1) },
      html("summary", {}, mark, " ", title), html("p", {}, text),
      html("p", { class: "note", id: `${id}-needed` }, needed),
      html("div", { class: "row" }, input, html("span", {}, unit),
        this.button("", words.say("exercise-check"), check, "check"), hint, working),
      reply, told, state);
    const update = () => {
      const { verdict, hints: read, revealed } = standing;
      mark.textContent = MARKS[verdict];
      mark.className = `mark ${verdict}`;
      state.textContent = task.state(n);
      hint.disabled = read === hints.length;
      // After all hints, or a right answer, the working may be seen.
      working.hidden = !((read === hints.length && standing.tries > 0) || verdict === "right" || revealed);
      working.disabled = revealed;
    };
    return { section, update };
  }

  /** The explanation in the student's own words. */
  explanation() {
    const { exercise, task, lab } = this;
    // A step with an explanation has asked for it.
    if (!exercise.explain || lab.data.lesson.steps.some(isInWords)) return [];
    const field = html("textarea", { id: "explain", maxlength: String(LONGEST_WORDS), rows: "4" });
    field.value = task.explained;
    field.addEventListener("input", () => {
      task.explained = field.value;
      this.tell();
    });
    return [html("label", { for: "explain" },
      html("b", {}, this.words.say("exercise-explain")), html("br"), exercise.explain), field];
  }

  /** Something has changed: show it, and save it. */
  tell() {
    this.refresh();
    this.changed();
  }

  refresh() {
    for (const { update } of this.rows) update();
  }

  save() {
    const { task } = this;
    download(`${this.exercise.name}-${fileStem(task.student)}.chutelab.json`,
      `${JSON.stringify(task.result, null, 2)}\n`, "application/json");
  }
}

export { Questions, isInWords, machineOf };
