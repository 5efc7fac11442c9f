// The lesson's exercise beside the machine: a name gives the numbers; questions, hints, replies,
// and what is handed in. What is kept is kept in this browser, or by the page that this one is part
// of.

import { plainName, type Exercise } from "./draw.ts";
import { machineOf, measured } from "./measure.ts";
import { card, html } from "./panels.ts";
import { download, fileStem } from "./share.ts";
import { LONGEST_NAME, LONGEST_WORDS, Task } from "./task.ts";
import type { Engine } from "./engine.ts";
import type { Verdict } from "./judging.ts";
import type { Lab } from "./lab.ts";
import type { Stage } from "./stage.ts";
import type { Words } from "./words.ts";

/** Signs of verdicts; the words always say it too. */
const MARKS: Record<Verdict, string> = {
  blank: "○", right: "✓", mistake: "✗", off: "✗", unread: "?",
};

/** What this browser keeps between two visits, if it does. */
function kept() {
  try {
    return localStorage;
  } catch {
    // A frame without an origin has none.
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

class ExercisePanel {
  exercise;
  place;
  count;
  panel;
  body;
  rows?: { section: any, update: () => void }[];
  machine?: any;

  /** @param newEngine with a thread of its own */
  constructor(
    home: Element, stage: Stage, readonly lab: Lab, readonly words: Words,
    readonly newEngine: () => Engine,
  ) {
    const exercise: Exercise = lab.data.exercise;
    this.exercise = exercise;
    this.place = `chutelab/${exercise.name}/`;
    this.count = html("span", { class: "note" });
    const wait = html("p", { class: "note" }, words.say("exercise-after"));
    this.panel = card("exercise", words.say("exercise"), wait);
    this.panel.querySelector("summary").append(" ", this.count);
    this.body = this.panel.querySelector(".body");
    home.prepend(this.panel);
    const open = () => {
      if (!stage.blind && !this.task) this.enter();
    };
    stage.painters.push(open);
    addEventListener("beforeprint", () => {
      for (const { section } of this.rows ?? []) section.open = true;
    });
    const student = kept()?.getItem("chutelab/student") ?? "";
    if (student && kept()?.getItem(this.placeOf(student))) this.begin(student);
    else open();
    if (parent === window) return;
    addEventListener("message", ({ source, data }) => {
      if (source !== parent || data?.chutelab !== "begin") return;
      const { student: name, suspend_data: suspended = "" } = data;
      if (typeof name !== "string" || typeof suspended !== "string" || !name.trim()) return;
      this.isHosted = true;
      this.task = undefined;
      this.body.replaceChildren(wait);
      this.enter = () => this.begin(name, suspended);
      if (suspended) this.enter();
      else open();
    });
    parent.postMessage({ chutelab: "ready", lesson: exercise.name }, "*");
  }

  task: Task | undefined;

  /** Whether another page said who this is, and keeps what becomes of it. */
  isHosted = false;

  /** Whether the name is asked for. */
  asks = false;

  /** What is done as soon as it was predicted where things go. */
  enter: () => void = () => this.askName();

  placeOf(student: string) {
    return this.place + plainName(student);
  }

  button(id: string, text: string, act: () => void, kind: string = "") {
    const made = html("button", { type: "button", class: kind }, text);
    if (id) made.id = id;
    made.addEventListener("click", act);
    return made;
  }

  askName() {
    if (this.asks) return;
    this.asks = true;
    const { words } = this;
    const name = html("input", {
      type: "text", id: "student", maxlength: String(LONGEST_NAME), autocomplete: "name",
      "aria-describedby": "student-note",
    });
    name.value = kept()?.getItem("chutelab/student") ?? "";
    const begin = () => {
      if (name.value.trim()) this.begin(name.value.trim()).focus();
      else name.focus();
    };
    name.addEventListener("keydown", (event: KeyboardEvent) => {
      if (event.key === "Enter") begin();
    });
    this.body.replaceChildren(
      html("p", {}, this.exercise.title),
      html("label", { for: "student" }, words.say("exercise-name")),
      html("div", { class: "row" }, name,
        this.button("begin", words.say("exercise-begin"), begin, "main")),
      html("p", { class: "note", id: "student-note" }, words.say("exercise-name-note")));
  }

  /** Hand out a student's numbers, and go on from where that got.
   * @param suspended what `suspend_data` was
   * @returns the first thing to read */
  begin(student: string, suspended?: string): HTMLElement {
    const name = student.trim().slice(0, LONGEST_NAME), { exercise, words } = this;
    const task = new Task(exercise, name, () => this.names());
    this.task = task;
    this.asks = false;
    task.goOn(parsed(this.isHosted ? suspended : kept()?.getItem(this.placeOf(name))));
    this.measure(task);
    const head = html("h2", { tabindex: "-1" }, task.worded("numbers-of", { student: name }));
    this.rows = exercise.questions.map((_, n) => this.question(task, n));
    this.machine = this.button("machine", words.say("exercise-machine"), () => {
      this.lab.replace(machineOf(this.lab.first, task.numbers));
      this.lab.restart();
    });
    const again = this.button("rename", words.say("exercise-rename"), () => {
      this.task = undefined;
      this.askName();
      document.getElementById("student")?.focus();
    });
    this.body.replaceChildren(head,
      html("table", { class: "given" }, html("tbody", {}, ...task.rows.map((
        [symbol, value, meaning],
      ) =>
        html("tr", {}, html("th", { scope: "row" }, html("b", {}, symbol), ` ${meaning}`),
          html("td", {}, value))))),
      html("p", {}, task.story),
      ...(exercise.whole ? [] : [html("p", { class: "note" }, task.worded("untranslated"))]),
      ...this.rows.map(({ section }) => section), this.machine, ...this.explanation(task),
      html("div", { class: "row" },
        this.button("result", words.say("exercise-result"), () => this.save(), "main"),
        ...(this.isHosted ? [] : [again])),
      ...(this.isHosted ? [] : [html("p", { class: "note" }, words.say("exercise-result-note"))]));
    this.tell();
    const next = task.standings.findIndex(({ verdict }) => verdict !== "right");
    if (next >= 0) this.rows[next].section.open = true;
    return head;
  }

  /** Have the machine with a student's numbers say what is right. */
  async measure(task: Task) {
    if (!this.exercise.questions.some((question) => question.measured)) return;
    const engine = this.newEngine(), { first, data } = this.lab;
    task.measured = await measured(first, data, task.numbers, engine);
    engine.worker.terminate();
  }

  /** Other names that were here. */
  names(): string[] {
    const store = kept();
    if (!store || this.isHosted) return [];
    return Object.keys(store).filter((key) => key.startsWith(this.place))
      .map((key) => parsed(store.getItem(key))?.student)
      .filter((name) => typeof name === "string");
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
      // After all hints, or a right answer, the way may be seen.
      working.hidden = !(read === hints.length || verdict === "right" || revealed);
      working.disabled = revealed;
    };
    return { section, update };
  }

  /** What is explained in one's own words. */
  explanation(task: Task) {
    if (!this.exercise.explain) return [];
    const field = html("textarea", { id: "explain", maxlength: String(LONGEST_WORDS), rows: "4" });
    field.value = task.explained;
    field.addEventListener("input", () => {
      task.explained = field.value;
      this.tell();
    });
    return [html("label", { for: "explain" },
      html("b", {}, this.words.say("exercise-explain")), html("br"), this.exercise.explain), field];
  }

  /** Something has changed: show it, keep it, and tell the platform that keeps the score. */
  tell() {
    const { task, words } = this;
    if (!task) return;
    for (const { update } of this.rows ?? []) update();
    // It shows what its questions ask for.
    this.machine.hidden = !this.exercise.questions.some(({ measured: tree }) => tree)
      || this.exercise.questions.some(({ measured: tree }, n) =>
        tree && task.standings[n].answer === null && !task.standings[n].revealed);
    const { progress, result } = task, { done, total } = progress;
    this.count.textContent = words.say("exercise-count", { done, total });
    const suspended = JSON.stringify(result);
    if (this.isHosted) {
      const news = { chutelab: "progress", ...progress, suspend_data: suspended, result };
      parent.postMessage(news, "*");
      return;
    }
    try {
      kept()?.setItem("chutelab/student", task.student);
      kept()?.setItem(this.placeOf(task.student), suspended);
    } catch {
      // It is full: what is typed is handed in all the same.
    }
  }

  save() {
    const { task } = this;
    if (!task) return;
    download(`${this.exercise.name}-${fileStem(task.student)}.chutelab.json`,
      `${JSON.stringify(task.result, null, 2)}\n`, "application/json");
  }
}

export { ExercisePanel };
