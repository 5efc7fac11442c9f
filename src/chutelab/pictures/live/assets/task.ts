// One lesson's exercise for one student, and the student's progress, as Python's `Task`.

import { Case, drawnFor, plainName, worded, type Exercise, type DrawnNumbers } from "./draw.ts";
import { judge, readTyped, withUnit, type Reply, type Verdict } from "./judging.ts";

/** Progress with one question: verdict on the last answer, last number checked, number of answers
 * and of hints read, whether the working was shown */
type Standing = { verdict: Verdict, answer: number | null, tries: number, hints: number,
  revealed: boolean };
/** The result that is handed in */
type Result = { chutelab_result: 1, lesson: string, student: string, answers: Record<string,
  number>, tries: Record<string, number>, hints: Record<string, number>, revealed: number[],
  words: Record<string, string>, language: string };

/** Most characters of a name, and of an explanation. */
const LONGEST_NAME = 200, LONGEST_WORDS = 1500;

class Task {
  numbers;
  /** Numbers drawn for other names, kept as they are needed. */
  theirs: Map<string, DrawnNumbers> = new Map();
  explained = "";
  /** Right answers measured with a machine, by question, from 0. */
  measured: Map<number, number> = new Map();
  standings: Standing[];

  /** @param names returns the names of others who have used this page */
  constructor(
    readonly exercise: Exercise, readonly student: string,
    readonly names: () => Iterable<string> = () => [],
  ) {
    this.numbers = drawnFor(exercise, student);
    this.standings = exercise.questions.map(() =>
      ({ verdict: "blank", answer: null, tries: 0, hints: 0, revealed: false }));
  }

  worded(id: string, values?: Record<string, string | number>) {
    return worded(this.exercise, id, values);
  }

  /** Symbol, value with unit, and meaning of each number. */
  get rows() {
    return this.exercise.parameters.map(([name, symbol, unit, meaning]) =>
      [symbol, withUnit(this.exercise, this.numbers.get(name), unit), meaning]);
  }

  get story() {
    return this.numbers.text(this.exercise.story);
  }

  /** Returns a question (from 0) with its numbers. The right answer is computed when needed, not
   * stored. */
  case(n: number) {
    return new Case(this.exercise.questions[n], this.numbers, this.measured.get(n));
  }

  /** Returns the texts of a question, with the unit of its answer. */
  asked(n: number) {
    const { title, text, unit } = this.exercise.questions[n];
    const values = { unit: unit || this.worded("pure-number"), digits: 3, percent: 1 };
    return {
      title: this.worded("question-title", { number: n + 1, title }),
      text: this.numbers.text(text),
      needed: this.worded("answer-in", values),
    };
  }

  /** Returns the reply to a typed answer. */
  check(
    n: number, typed: string,
  ): Reply & { heading: string, unread?: { why: string, text: string }} {
    const standing = this.standings[n];
    const value = readTyped(typed, this.exercise.questions[n].unit);
    let reply: Reply = { verdict: "blank", text: "", mistake: "" };
    if (value === null) return { ...reply, heading: this.heading(n, reply) };
    if (typeof value === "object") {
      reply = { verdict: "unread", text: "", mistake: "" };
    } else {
      reply = this.judged(n, value);
      standing.answer = value;
    }
    standing.tries += 1;
    standing.verdict = reply.verdict;
    return {
      ...reply, heading: this.heading(n, reply),
      unread: typeof value === "object" ? value : undefined,
    };
  }

  judged(n: number, value: number) {
    return judge(this.case(n), value, this.others(n));
  }

  /** Returns the right answers without a name and for the other names. */
  * others(n: number): Iterable<[string, number]> {
    const { exercise } = this, seen = new Set([plainName(this.student)]);
    for (const name of [exercise.unnamed, ...this.names()]) {
      if (seen.has(plainName(name))) continue;
      seen.add(plainName(name));
      const numbers = this.theirs.get(name) ?? drawnFor(exercise, name);
      this.theirs.set(name, numbers);
      yield [name, new Case(exercise.questions[n], numbers).right];
    }
  }

  heading(n: number, { verdict, mistake }: Reply) {
    return mistake ? this.worded("heading-mistake", { number: n + 1, mistake })
      : this.worded("heading", { number: n + 1, verdict: this.worded(`verdict-${verdict}`) });
  }

  /** Returns the next hint, or the last one again if there are no more. */
  hint(n: number) {
    const standing = this.standings[n];
    standing.hints = Math.min(standing.hints + 1, this.exercise.questions[n].hints.length);
    return this.hintAt(n, standing.hints);
  }

  /** @param hint number from 1 */
  hintAt(n: number, hint: number) {
    const { hints } = this.exercise.questions[n];
    return {
      title: this.worded("hint-title", { hint, hints: hints.length, number: n + 1 }),
      text: this.numbers.text(hints[hint - 1]),
      last: hint === hints.length,
    };
  }

  /** Returns the working with the answer, and notes that it was shown. */
  reveal(n: number) {
    const { working, unit, source } = this.exercise.questions[n];
    this.standings[n].revealed = true;
    return {
      title: this.worded("working-title", { number: n + 1 }),
      lines: [...working.map((line) => this.numbers.text(line)),
        this.worded("answer", { answer: withUnit(this.exercise, this.case(n).right, unit) }),
        this.worded("source", { source })],
    };
  }

  /** Returns the progress with a question in words. */
  state(n: number) {
    const { verdict, tries, hints, revealed } = this.standings[n];
    const count = (id: string, number: number) => {
      if (!number) return [];
      return [number === 1 ? this.worded(`${id}-one`) : this.worded(id, { count: number })];
    };
    const remarks = [...count("tries", tries), ...count("hints", hints),
      ...(revealed ? [this.worded("working-shown")] : [])].join(", ");
    const said = this.worded(`verdict-${verdict}`);
    return remarks ? `${said} (${remarks})` : said;
  }

  /** Whether the student's machine may run: it shows the answers to questions measured with it. */
  get mayRun() {
    return this.exercise.questions.every(({ measured }, n) =>
      !measured || this.standings[n].answer !== null || this.standings[n].revealed);
  }

  /** Progress as it is reported to a learning platform. */
  get progress() {
    const { standings } = this, total = standings.length;
    const done = standings.filter(({ verdict }) => verdict === "right").length;
    const isOver = standings.every(({ verdict, revealed }) => verdict === "right" || revealed);
    return {
      lesson: this.exercise.name, student: this.student, done, total,
      score: Math.round((100 * done) / total), status: isOver ? "completed" : "incomplete",
      verdicts: Object.fromEntries(standings.map(({ verdict }, n) => [String(n + 1), verdict])),
    };
  }

  get result(): Result {
    const { exercise: { name, language, explain }, standings } = this;
    const kept = (of: (one: Standing) => number | null) => Object.fromEntries(
      standings.flatMap((one, n) => (of(one) === null ? [] : [[String(n + 1), of(one)]])));
    return {
      chutelab_result: 1, lesson: name, student: this.student,
      answers: kept(({ answer }) => answer) as Record<string, number>,
      tries: kept(({ tries }) => tries || null) as Record<string, number>,
      hints: kept(({ hints }) => hints || null) as Record<string, number>,
      revealed: standings.flatMap(({ revealed }, n) => (revealed ? [n + 1] : [])),
      words: explain ? { explain: this.explained } : {},
      language,
    };
  }

  /** Restore a stored result. One of another lesson is ignored, and so are parts that do not
   * fit. */
  goOn(kept: any) {
    if (kept?.chutelab_result !== 1 || kept.lesson !== this.exercise.name) return;
    const whole = (value: unknown) =>
      (Number.isSafeInteger(value) ? Math.max(0, Number(value)) : 0);
    this.standings.forEach((standing, n) => {
      const id = String(n + 1), answer = kept.answers?.[id];
      standing.tries = whole(kept.tries?.[id]);
      standing.hints = Math.min(whole(kept.hints?.[id]), this.exercise.questions[n].hints.length);
      standing.revealed = Array.isArray(kept.revealed) && kept.revealed.includes(n + 1);
      if (Number.isFinite(answer)) {
        standing.answer = answer;
        standing.verdict = this.judged(n, answer).verdict;
      } else if (standing.tries) standing.verdict = "unread";
    });
    const said = kept.words?.explain;
    if (typeof said === "string") this.explained = said.slice(0, LONGEST_WORDS);
  }
}

export { LONGEST_NAME, LONGEST_WORDS, Task };
