// A lesson in the page, one step at a time: questions, keys that may be changed, notes, and
// replies. A pupil's work is kept in this browser under the name, or by the page around this one.

import { Questions, isInWords, machineOf } from "./exercise.ts";
import { plainName, type Exercise } from "./draw.ts";
import { grown, html, icon, iconButton } from "./panels.ts";
import { printed } from "./paper.ts";
import { Curtain, Flag, Sketch, type Place } from "./predict.ts";
import { Runs, type Noted, type Wanted } from "./runs.ts";
import { LONGEST_NAME, LONGEST_WORDS, Task } from "./task.ts";
import { nearestOn } from "./tools.ts";
import { Values } from "./values.ts";
import { indexed, withValues } from "./keys.ts";
import type { Engine } from "./engine.ts";
import type { Lab } from "./lab.ts";
import type { Stage } from "./stage.ts";
import type { Words } from "./words.ts";

/** Texts are HTML made by Python from Markdown; `right` counts from 1 */
export type Ask = { text: string, mark: string | null, choices: string[], replies: string[],
  right: number | null, sketch: boolean };
type Step = Wanted & { kind: "predict" | "try" | "note" | "explain" | "numbers", text: string,
  controls: string[], asks: Ask[], then: string };
export type LessonData = { name: string, title: string, question: string, steps: Step[] };
/** A pupil's progress: present step, finished steps, answers to questions, noted runs. */
type Kept = { at: number, done: number[], said: Record<string, any>,
  runs: Record<string, Noted[]> };

/** Panels that can be opened beside a step in which the run may be seen. */
const PANELS = ["energy", "numbers", "landing", "flow", "curves", "share"];

/** Most characters of the data that a platform keeps. */
const MOST_KEPT = 4000;

/** A mark within this distance is right, m. */
const NEAR = 0.05;

/** Hands of a class for each choice, which a teacher counts on the projector, with bars for their
 * shares. Nothing of it is kept. */
function votesOf(choices: string[], words: Words): HTMLElement[] {
  const counts = choices.map(() => 0);
  const rows = choices.map((choice, n) => {
    const text = grown(choice).map((one) => one.textContent).join("");
    const step = (by: number, sign: string, name: string) => html("button", {
      "aria-label": `${text}: ${words.say(name)}`,
      click: () => {
        counts[n] = Math.max(0, counts[n] + by);
        tell();
      },
    }, sign);
    return html("div", { class: "vote" }, step(-1, "−", "less"), html("output", {}, "0"),
      step(1, "+", "greater"), html("span", { class: "bar" }, html("i")));
  });
  const tell = () => rows.forEach((row, n) => {
    const all = counts.reduce((sum, count) => sum + count, 0);
    row.querySelector("output").textContent = String(counts[n]);
    row.querySelector("i").style.width = `${(100 * counts[n]) / Math.max(1, all)}%`;
  });
  return rows;
}

/** The browser's storage between two visits, if it has any. */
function store(which: "localStorage" | "sessionStorage"): Storage | null {
  try {
    return globalThis[which];
  } catch {
    // A frame without an origin has no storage.
    return null;
  }
}

/** @param text JSON */
function parsed(text: string | null | undefined): any {
  try {
    return JSON.parse(text ?? "null");
  } catch {
    return null;
  }
}

class Lesson {
  lesson: LessonData;
  values;
  curtain;
  sheet;
  list;
  nav;
  page;
  back;
  next;
  skip;
  where;
  who;
  slot;
  cards: HTMLElement[];
  kept: Kept = { at: 0, done: [], said: {}, runs: {} };
  student = "";
  task: Task | undefined;
  /** Whether a page around this one gave the name, and keeps the work. */
  isHosted = false;
  /** Elements that the step has put into the picture. */
  tools: { remove: () => void }[] = [];
  flag: Flag | null = null;
  runs: Runs | null = null;
  /** Whether the run of this step was seen to its end. */
  seen = false;

  /** @param newEngine with a thread of its own */
  constructor(
    readonly stage: Stage, readonly lab: Lab, readonly words: Words,
    readonly newEngine: () => Engine,
  ) {
    this.lesson = lab.data.lesson;
    this.curtain = new Curtain(stage, lab);
    this.values = new Values(lab, words);
    document.documentElement.classList.add("lesson");
    const panels = document.getElementById("panels") as HTMLElement;
    this.cards = [...panels.children] as HTMLElement[];
    panels.remove();
    this.list = html("ol", { class: "steps" });
    const title = document.querySelector("header h1") as HTMLElement;
    title.textContent = this.lesson.title;
    this.nav = html("nav", { "aria-label": words.say("steps") }, this.list);
    title.parentElement?.after(this.nav);
    new ResizeObserver(() => this.fitSteps()).observe(this.nav);
    this.page = html("div", { class: "page" });
    const button = (id: string, click: () => void, kind = "") =>
      html("button", { id, class: kind, click }, words.say(id));
    this.back = button("step-back", () => this.go(this.kept.at - 1));
    this.skip = button("skip", () => {
      this.commit();
      this.go(this.kept.at + 1);
    }, "quiet");
    this.next = button("step-next", () => {
      if (this.curtain.hides && this.step.kind === "predict") this.commit();
      this.go(this.kept.at + 1);
    }, "main");
    this.where = html("span", { class: "where note" });
    this.sheet = html("section", { class: "sheet", "aria-label": words.say("lesson") }, this.page,
      html("div", { class: "turnbar" }, this.back, this.where, this.next));
    document.querySelector("main")?.prepend(this.sheet);
    this.slot = html("span", { class: "slot" });
    document.querySelector(".transport")?.append(this.slot);
    document.querySelector(".transport")?.before(this.values.root);
    this.who = iconButton("somebody-else", "who", words.say("somebody-else"), () => this.leave());
    const print = () => globalThis.print();
    document.getElementById("views")?.append(
      iconButton("print", "print", words.say("print"), print), this.who);
    printed(this);
    lab.mayPlay = () => this.mayPlay();
    for (const news of ["scene", "run", "time"] as const) lab.on(news, () => this.look());
    document.getElementById("full")?.addEventListener("click", () => this.look());
    stage.drawers.push(() => this.runs?.drawPaths());
    const again = store("sessionStorage")?.getItem(this.place("now"));
    if (again) this.begin(again);
    else this.welcome();
    this.listen();
    addEventListener("focus", () => this.catchUp());
  }

  /** Show names of all steps if there is room, else only of the present one. */
  fitSteps() {
    const { list, nav } = this;
    list.classList.remove("many");
    list.classList.toggle("many", list.offsetWidth > nav.offsetWidth);
  }

  /** Kept data as last read or written. */
  known: string | null | undefined;

  /** Go on from the pupil's progress in another tab. */
  catchUp() {
    if (this.student && !this.isHosted && this.stored !== this.known) this.begin(this.student);
  }

  place(what: string) {
    return `chutelab/${this.lesson.name}/${what}`;
  }

  get step() {
    return this.lesson.steps[this.kept.at];
  }

  /** Get the name from a page around this one, which keeps the work. */
  listen() {
    if (parent === window) return;
    addEventListener("message", ({ source, data }) => {
      if (source !== parent || data?.chutelab !== "begin") return;
      const { student, suspend_data: suspended = "" } = data;
      if (typeof student !== "string" || typeof suspended !== "string" || !student.trim()) return;
      this.isHosted = true;
      this.begin(student, suspended);
    });
    parent.postMessage({ chutelab: "ready", lesson: this.lesson.name }, "*");
  }

  /** The first page: the subject, and the pupil's name. */
  welcome() {
    const { words, lesson } = this;
    this.clear();
    this.student = "";
    this.task = undefined;
    this.kept = { at: 0, done: [], said: {}, runs: {} };
    this.setMachine({}, []);
    this.curtain.set(true);
    const click = () => this.begin(name.value);
    const name = html("input", { type: "text", id: "student", maxlength: LONGEST_NAME,
      autocomplete: "off", spellcheck: "false", "aria-describedby": "student-note",
      keydown: ({ key }: KeyboardEvent) => key === "Enter" && click() });
    const go = html("button", { id: "begin", class: "main", click }, words.say("lesson-begin"));
    this.page.replaceChildren(
      html("h2", { tabindex: "-1" }, lesson.title), html("p", { class: "ask" }, lesson.question),
      html("label", { for: "student" }, html("b", {}, words.say("exercise-name"))),
      html("div", { class: "row" }, name, go),
      html("p", { class: "note", id: "student-note" }, words.say("student-note")));
    this.list.replaceChildren();
    this.sheet.classList.add("start");
    (document.getElementById("guess") as HTMLElement).hidden = true;
    this.who.hidden = true;
    this.name();
    document.title = lesson.title;
  }

  /** The pupil's name, on the button for somebody else. */
  name() {
    this.who.title = [this.student, this.words.say("somebody-else")].filter(Boolean).join(": ");
    this.who.setAttribute("aria-label", this.who.title);
  }

  /** The next pupil comes to this computer. */
  leave() {
    store("sessionStorage")?.removeItem(this.place("now"));
    this.welcome();
    document.getElementById("student")?.focus();
  }

  /** Go on from a pupil's progress; without a name nothing is kept.
   * @param suspended earlier `suspend_data` */
  begin(student: string, suspended?: string) {
    this.student = student.trim().slice(0, LONGEST_NAME);
    const text = this.isHosted ? suspended
      : this.student ? this.stored : null;
    this.known = text;
    const found = parsed(text), kept = found?.steps ?? {};
    const { steps } = this.lesson, last = steps.length - 1;
    const table = (value: any) => (value && typeof value === "object" ? value : {});
    const done = Array.isArray(kept.done) ? kept.done.filter((n: any) => steps[n]) : [];
    this.kept = { at: 0, done, said: table(kept.said), runs: {} };
    for (const [n, rows] of Object.entries(table(kept.runs))) {
      if (Array.isArray(rows)) this.kept.runs[n] = rows.map(table);
    }
    const at = Number.isInteger(kept.at) ? Math.min(Math.max(0, kept.at), last) : 0;
    this.task = undefined;
    const { exercise }: { exercise?: Exercise } = this.lab.data;
    if (exercise && this.student) {
      this.task = new Task(exercise, this.student, () => this.names());
      this.task.goOn(found);
    }
    if (this.student && !this.isHosted) {
      store("sessionStorage")?.setItem(this.place("now"), this.student);
    }
    this.sheet.classList.remove("start");
    this.who.hidden = this.isHosted;
    this.name();
    this.go(Math.min(at, this.reach));
  }

  /** Other names that were here. */
  names(): string[] {
    const kept = this.isHosted ? null : store("localStorage"), place = this.place("");
    return Object.keys(kept ?? {}).filter((key) => key.startsWith(place))
      .map((key) => parsed(kept?.getItem(key))?.student)
      .filter((name) => typeof name === "string");
  }

  /** The last step that can be opened: none after a missing prediction. */
  get reach() {
    const { steps } = this.lesson;
    const open = steps.findIndex(({ kind }, n) => kind === "predict" && !this.kept.done.includes(n));
    return open < 0 ? steps.length - 1 : open;
  }

  /** Remove what a step has put into the page. */
  clear() {
    for (const tool of this.tools.splice(0)) tool.remove();
    this.flag = this.runs = null;
    this.slot.replaceChildren();
    this.page.replaceChildren();
    for (const one of this.cards) one.remove();
  }

  /** The machine of a step, of which only some keys can be changed. */
  setMachine(set: Record<string, unknown>, controls: string[]) {
    const { lab } = this, key = JSON.stringify(set);
    lab.data.live = { ...lab.data.live, predict: true,
      controls: controls.map((one) => indexed(lab.first, one)) };
    // A step about the same machine keeps its present state.
    if (key !== this.machine || !controls.length) {
      lab.use(Object.keys(set).length ? withValues(lab.first, set) : lab.first);
    }
    this.machine = key;
    lab.past = [];
    lab.future = [];
    lab.pause();
    lab.restart();
    this.values.build();
    lab.tell("scene");
    this.stage.rebuild();
  }

  machine = "";

  /** Open a step. */
  go(n: number) {
    const { kept, words, lesson: { steps, title } } = this;
    if (!steps[n] || n > this.reach) return;
    // The run of the step before must not count as seen in this one.
    this.lab.t = this.lab.start;
    this.clear();
    kept.at = n;
    const step = steps[n];
    this.seen = false;
    const hides = step.kind === "predict" && !kept.done.includes(n);
    const own = step.kind === "numbers" ? this.task : undefined;
    this.curtain.set(false);
    this.setMachine(own ? machineOf(own.numbers) : step.set, step.controls);
    this.curtain.set(hides || own?.mayRun === false);
    this.stage.fit();
    this.page.dataset.kind = step.kind;
    const name = words.say(`step-${step.kind}`);
    const head = html("h2", { tabindex: "-1" }, name);
    const shown = this.cards.filter(({ id }) => PANELS.includes(id)
      && ["try", "explain"].includes(step.kind)) as HTMLDetailsElement[];
    for (const one of shown) one.open = false;
    this.page.replaceChildren(head, ...this.textOf(step), ...this.expected(n), ...this.asked(n),
      ...(hides ? [this.skip] : []), ...this.table(n), ...this.ready(step), html("div", { class: "then" }), ...shown,
      ...this.exercise());
    this.list.replaceChildren(...steps.map(({ kind }, k) => {
      const done = kept.done.includes(k);
      const button = html("button", { click: () => this.go(k) }, html("b", {}, done && k !== n
        ? icon("tick") : String(k + 1)), html("span", {}, words.say(`step-${kind}`)));
      button.disabled = k > this.reach;
      if (k === n) button.setAttribute("aria-current", "step");
      if (done) button.append(html("span", { class: "hidden" }, `, ${words.say("step-done")}`));
      return html("li", { class: done ? "done" : "" }, button);
    }));
    this.fitSteps();
    this.back.disabled = n === 0;
    this.where.textContent = words.say("step-of", { n: n + 1, many: steps.length });
    document.title = `${n + 1}. ${name} – ${title}`;
    this.page.scrollTop = 0;
    if (document.documentElement.scrollTop) document.documentElement.scrollTop = 0;
    this.look();
    this.keep();
    head.focus({ preventScroll: true });
  }

  /** A step's text, with its numbers to drag. */
  textOf({ text }: Step): Node[] {
    const nodes = grown(text);
    for (const node of nodes) {
      if (!(node instanceof Element)) continue;
      // It scrolls by itself if it is too wide, also with the keyboard.
      if (node.matches("table")) node.setAttribute("tabindex", "0");
      for (const place of node.querySelectorAll("[data-key]")) {
        place.replaceWith(this.values.scrub(place.getAttribute("data-key") ?? ""));
      }
    }
    return nodes;
  }

  /** The predictions before a step, and in a step with an explanation the replies to them. */
  expected(n: number): Node[] {
    const { words, kept, lesson: { steps } } = this, { kind } = steps[n];
    if (!["try", "note", "explain"].includes(kind)) return [];
    const explains = kind === "explain";
    const since = explains ? steps.slice(0, n).findLastIndex((one) => one.kind === "explain") + 1
      : Math.max(0, steps.slice(0, n).findLastIndex((one) => one.kind === "predict"));
    const said = steps.slice(since, n).flatMap((step, k) => (step.kind !== "predict" ? []
      : step.asks.map((ask, m) => ({ ask, id: `${since + k}.${m}` }))))
      .filter(({ id }) => kept.said[id] !== undefined);
    const told = said.map(({ ask, id }) => {
      const value = kept.said[id], off = kept.said[`${id}.off`];
      if (explains) this.draw(ask, value);
      const what = ask.choices.length ? grown(ask.choices[value] ?? "")
        : [ask.mark ? words.say("expected-flag", { x: words.fixed(value[0], 2) })
          : ask.sketch ? words.say("expected-sketch") : String(value)];
      if (!explains) return html("span", {}, ...what);
      const isRight = ask.choices.length ? value + 1 === ask.right : off < NEAR;
      const reply = ask.choices.length ? grown(ask.replies[value] ?? "")
        : off === undefined ? [] : [words.say(ask.mark ? "mark-off" : "sketch-off",
          { distance: words.number(100 * off, 2) })];
      const isJudged = ask.right !== null || isRight;
      return html("div", { class: `reply ${isJudged ? "" : "plain"} ${isRight ? "right" : ""}` },
        html("div", { class: "note" }, ...grown(ask.text)), icon(isRight ? "tick" : "turn"),
        html("b", {}, isJudged ? words.say(isRight ? "right" : "not-yet") : ""),
        html("div", {}, words.say("you-expected"), " ", ...what), html("div", {}, ...reply));
    });
    if (explains || !told.length) return told;
    return [html("p", { class: "said" }, words.say("you-expected"), " ",
      ...told.flatMap((one, k) => (k ? ["; ", one] : [one])))];
  }

  /** Show marks and sketches in the picture, beside the run. */
  draw({ mark, sketch }: Ask, value: any) {
    const { stage, lab, words } = this, none = () => {};
    if (!Array.isArray(value) || (!mark && !sketch)) return;
    const tool = mark ? new Flag(stage, lab, words, mark.split(".")[0], none)
      : new Sketch(stage, words, value as Place[], none);
    tool.isOpen = false;
    if (tool instanceof Flag) Object.assign(tool, { at: value, isSet: true });
    else tool.draw();
    this.tools.push(tool);
  }

  /** The button that ends the writing of words, before the explanation is shown. */
  ready({ kind, asks, then }: Step): Node[] {
    if (kind !== "explain" || !asks.length || !then) return [];
    const click = () => {
      if (!this.isAnswered) {
        this.page.querySelector(".ask textarea, .choice input")?.focus();
        return;
      }
      this.kept.done.push(this.kept.at);
      this.look();
      this.keep();
    };
    return [html("button", { id: "written", click }, this.words.say("written"))];
  }

  /** How many questions of the lesson are answered in words. */
  get fields() {
    return this.lesson.steps.flatMap(({ asks }) => asks.filter(({ choices, mark, sketch }) =>
      !choices.length && !mark && !sketch)).length;
  }

  /** The questions of a step. */
  asked(n: number): Node[] {
    return this.lesson.steps[n].asks.map((ask, k) => {
      const id = `${n}.${k}`, name = `ask-${n}-${k}`, { words, kept } = this;
      const isOpen = this.step.kind !== "predict" || !kept.done.includes(n);
      const reply = html("div", { class: "reply", role: "status", "data-ask": String(k) });
      const say = (value: unknown) => {
        kept.said[id] = value;
        this.look();
        this.keep();
      };
      const question = [html("span", { class: "q" }, ...grown(ask.text))];
      if (ask.choices.length) {
        const votes = this.step.kind === "predict" ? votesOf(ask.choices, words) : [];
        return html("fieldset", { class: "choice" }, html("legend", {}, ...question),
          ...ask.choices.flatMap((text, value) => {
            const input = html("input", { type: "radio", name, change: () => say(value) });
            input.checked = kept.said[id] === value;
            input.disabled = !isOpen;
            return [html("label", {}, input, html("span", {}, ...grown(text))),
              ...votes.slice(value, value + 1)];
          }), reply);
      }
      if (ask.mark) {
        this.flag = new Flag(this.stage, this.lab, words, ask.mark.split(".")[0], () =>
          say((this.flag as Flag).at.map((value) => Number(value.toFixed(4)))));
        const at = kept.said[id];
        if (Array.isArray(at) && at.length === 2) Object.assign(this.flag, { at, isSet: true });
        this.flag.isOpen = isOpen;
        this.tools.push(this.flag);
        return html("div", { class: "ask" }, ...question,
          html("p", { class: "said" }, words.say("flag-how")), reply);
      }
      if (ask.sketch) {
        const points = (Array.isArray(kept.said[id]) ? kept.said[id] : []) as Place[];
        const sketch = new Sketch(this.stage, words, [...points], () =>
          say(sketch.points.length > 1 ? sketch.points : undefined));
        sketch.isOpen = isOpen;
        sketch.draw();
        this.tools.push(sketch);
        const clear = html("button", { class: "quiet", click: () => sketch.clear() },
          words.say("sketch-clear"));
        clear.hidden = !isOpen;
        return html("div", { class: "ask" }, ...question,
          html("p", { class: "said" }, words.say("sketch-how"), " ",
            html("span", { class: "note", id: "sketch-keys" }, words.say("sketch-keys"))), clear, reply);
      }
      const field = html("textarea", { id: name, rows: 4,
        maxlength: Math.floor(LONGEST_WORDS / this.fields),
        input: () => say(field.value.trim() ? field.value : undefined) });
      field.value = typeof kept.said[id] === "string" ? kept.said[id] : "";
      return html("div", { class: "ask" }, html("label", { for: name }, ...question), field, reply);
    });
  }

  /** The table of a step's runs, and the button that fills it. */
  table(n: number): Node[] {
    const { steps } = this.lesson, { kept } = this;
    if (!steps[n].columns.length) return [];
    this.runs = new Runs(this.lab, this.stage, this.words, steps[n], kept.runs[n] ??= [], () => {
      this.look();
      this.keep();
    }, this.newEngine, () => [...this.values.fields.values()].map(({ value, unit }) =>
      (typeof value === "number" ? `${this.words.plain(value)} ${this.words.unit(unit)}`.trim()
        : this.words.say(value))).join("; "));
    this.tools.push(this.runs);
    if (this.runs.isByHand) return [this.runs.root];
    this.slot.append(this.runs.button);
    return [this.runs.wait, this.runs.root];
  }

  /** The exercise with the student's own numbers, if there is a name. */
  exercise(): Node[] {
    const { task, lab, words, step } = this;
    if (step.kind !== "numbers" || !lab.data.exercise) return [];
    if (!task) {
      return [html("p", {}, words.say("student-note")),
        html("button", { class: "main", click: () => this.leave() }, words.say("student-first"))];
    }
    return [new Questions(lab, words, task, this.newEngine, () => {
      if (this.curtain.hides && task.mayRun) this.curtain.set(false);
      this.look();
      this.keep();
    }).root];
  }

  /** Whether the run may be seen; on the projector it is the class that answers. */
  get isReady() {
    return this.isAnswered || document.documentElement.matches(".projector");
  }

  /** Whether all questions of a step are answered. */
  get isAnswered() {
    const { at, said } = this.kept;
    return this.step.asks.every((_, k) => said[`${at}.${k}`] !== undefined);
  }

  mayPlay() {
    if (!this.curtain.hides) return true;
    const isAsked = this.sheet.classList.contains("start") || this.step.kind === "numbers";
    if (isAsked || !this.isReady) {
      this.sheet.classList.add("wanted");
      (this.page.querySelector("#student, .choice:not(:has(:checked)) input, textarea, .question[open] input")
        ?? this.flag?.grip)?.focus();
      return false;
    }
    this.commit();
    return true;
  }

  /** The prediction is final, and the run can be seen. */
  commit() {
    const { at, done } = this.kept;
    if (!done.includes(at)) done.push(at);
    this.curtain.set(false);
    if (this.flag) this.flag.isOpen = false;
    for (const tool of this.tools) if (tool instanceof Sketch) {
      tool.isOpen = false;
      tool.draw();
    }
    for (const input of this.page.querySelectorAll(".choice input, textarea")) input.disabled = true;
    this.look();
    this.keep();
  }

  /** Something has changed: update finished steps, replies, and navigation. */
  look() {
    const { kept, lab, words, sheet } = this, { at } = kept, { kind } = this.step;
    if (sheet.classList.contains("start")) return;
    const isSeen = lab.isOver && lab.t > lab.start && lab.recording?.state === "done";
    this.seen ||= isSeen && !this.curtain.hides;
    this.runs?.refresh();
    const waits = this.curtain.hides, { asks, then } = this.step;
    const written = document.getElementById("written");
    const isDone = kept.done.includes(at) || { predict: false, try: this.seen,
      note: this.runs?.isDone ?? this.seen, explain: this.isAnswered && !written,
      numbers: this.task?.progress.status === "completed" || !lab.data.exercise }[kind];
    if (isDone && !kept.done.includes(at)) {
      kept.done.push(at);
      this.keep();
    }
    if (written) {
      written.setAttribute("aria-disabled", String(!this.isAnswered));
      written.hidden = isDone;
    }
    this.list.children[at]?.classList.toggle("done", isDone);
    this.next.hidden = at === this.lesson.steps.length - 1;
    this.next.disabled = waits && !this.isReady;
    this.skip.hidden = !this.next.disabled || !asks.length;
    if (this.seen && !waits) this.compare();
    this.tellReplies();
    const place = this.page.querySelector(".then");
    const tells = then && (kind === "predict" ? this.seen && !waits : isDone);
    if (place && tells && !place.hasChildNodes()) place.append(...grown(then));
    const early = this.runs?.asked && this.runs.reason;
    const wish = early || (waits && kind === "numbers" ? "numbers-first" : kind !== "predict" || (!waits && this.seen) ? ""
      : waits ? this.isReady ? "predict-play" : "predict-first" : "predict-watch");
    const hint = document.getElementById("guess") as HTMLElement;
    const said = wish ? words.say(wish) : "";
    hint.hidden = !said;
    if (hint.textContent !== said) hint.textContent = said;
  }

  /** Measure how far off a flag or a sketch was, once the run has been seen. */
  compare() {
    const { kept: { at, said }, flag, lab: { recording } } = this;
    this.step.asks.forEach(({ mark, sketch }, k) => {
      const id = `${at}.${k}`, points = said[id];
      if (this.step.kind !== "predict" || points === undefined || `${id}.off` in said) return;
      if (mark && flag && isFinite(flag.off)) said[`${id}.off`] = flag.off;
      if (!sketch || !points.length || !recording?.tracks[0].count) return;
      said[`${id}.off`] = points.reduce((sum: number, [x, y]: Place) =>
        sum + nearestOn(recording.tracks[0], x, y).far, 0) / points.length;
    });
  }

  /** Show the reply to each answer as soon as it may be shown: for a prediction in the explanation.
   */
  tellReplies() {
    const { kept: { at, said }, words, step } = this;
    for (const place of this.page.querySelectorAll(".reply[data-ask]")) {
      const k = Number(place.getAttribute("data-ask")), ask = step.asks[k];
      const value = said[`${at}.${k}`], off = said[`${at}.${k}.off`];
      let parts: (Node | string)[] = [];
      const isRight = ask.choices.length ? value + 1 === ask.right : off < NEAR;
      if (step.kind !== "predict" && value !== undefined && ask.right !== null) {
        parts = grown(ask.replies[value] ?? "");
      } else if (off !== undefined && !this.curtain.hides) {
        parts = [words.say(ask.mark ? "mark-off" : "sketch-off",
          { distance: words.number(100 * off, 2) })];
      }
      const state = parts.length ? `${value} ${isRight}` : "", isJudged = ask.right || isRight;
      if (place.dataset.state === state) continue;
      place.dataset.state = state;
      place.classList.toggle("right", isRight);
      place.classList.toggle("plain", !isJudged);
      place.replaceChildren(...(parts.length ? [icon(isRight ? "tick" : "turn"),
        html("b", {}, isJudged ? words.say(isRight ? "right" : "not-yet") : ""),
        html("div", {}, ...parts)] : []));
    }
  }

  told = "";

  /** Keep the work, and report it to the platform that keeps the score. */
  keep() {
    const { task, kept, student, isHosted, lesson } = this;
    const words = lesson.steps.flatMap((step, n) => (isInWords(step)
      ? step.asks.flatMap((_, k) => (typeof kept.said[`${n}.${k}`] === "string"
        ? kept.said[`${n}.${k}`] : [])) : []));
    if (task && words.length) task.explained = words.join("\n\n").slice(0, LONGEST_WORDS);
    const result: any = task?.result ?? { chutelab_steps: 1, lesson: lesson.name, student };
    // The words are among the answers.
    const rest = { ...result, ...(words.length ? { words: undefined } : {}) };
    const many = lesson.steps.length;
    let suspended = JSON.stringify({ ...rest, steps: kept });
    if (isHosted) {
      // A platform keeps 4096 characters: words rather than drawings, drawings rather than runs.
      for (const name of ["sketch", "runs"]) if (suspended.length > MOST_KEPT) {
        const said = Object.fromEntries(Object.entries(kept.said).map(([id, value]) =>
          [id, Array.isArray(value?.[0]) ? [] : value]));
        const runs = name === "runs" ? {} : kept.runs;
        suspended = JSON.stringify({ ...rest, steps: { ...kept, said, runs } });
      }
      // Unchanged data are not reported.
      if (suspended === this.told) return;
      this.told = suspended;
      const progress = task?.progress ?? { lesson: lesson.name, student, done: kept.done.length,
        total: lesson.steps.length, score: Math.round((100 * kept.done.length) / many),
        status: kept.done.length === many ? "completed" : "incomplete" };
      parent.postMessage({ chutelab: "progress", ...progress, suspend_data: suspended, result }, "*");
      return;
    }
    if (!student) return;
    try {
      store("localStorage")?.setItem(this.place(plainName(student)), suspended);
    } catch {
      // The storage is full; typed answers stay until the page is left.
    }
    this.known = this.stored;
  }

  /** The pupil's data in this browser. */
  get stored() {
    return store("localStorage")?.getItem(this.place(plainName(this.student)));
  }
}

export { Lesson };
