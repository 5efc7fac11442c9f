// A lesson on paper: its picture, then one step after the other with answers and notes, or room to
// write.

import { grown, html } from "./panels.ts";
import { tableOf } from "./runs.ts";
import type { Ask, Lesson } from "./lesson.ts";

/** Lines to write on for an answer in words. */
const LINES = 3;

/** The answer, or lines for it. */
const written = (said: unknown, lines: number) => (typeof said === "string" && said.trim()
  ? [html("p", { class: "written" }, said)]
  : Array.from({ length: lines }, () => html("div", { class: "line" })));

function asked({ words, kept }: Lesson, ask: Ask, id: string) {
  const said = kept.said[id];
  const question = html("p", { class: "q" }, ...grown(ask.text));
  if (ask.choices.length) {
    return [question, html("ul", { class: "boxes" }, ...ask.choices.map((one, k) =>
      html("li", { class: said === k ? "picked" : "" }, `${said === k ? "☒" : "☐"} `, ...grown(one))))];
  }
  if (ask.mark && Array.isArray(said)) {
    return [question, ...written(words.say("expected-flag", { x: words.fixed(said[0], 2) }), 1)];
  }
  const how = ask.mark ? "paper-mark" : ask.sketch ? "paper-sketch" : "";
  if (how) return [question, html("p", { class: "how" }, words.say(how))];
  return [question, ...written(said, LINES)];
}

/** The exercise with the student's own numbers; none without a name. */
function numbers({ task, words }: Lesson) {
  if (!task) return [html("p", {}, words.say("student-note"))];
  return [
    html("p", {}, task.rows.map(([symbol, value]) => `${symbol} = ${value}`).join("; ")),
    html("p", {}, task.story),
    ...task.standings.flatMap(({ answer }, n) => {
      const { title, text, needed } = task.asked(n);
      return [html("div", { class: "together" }, html("p", { class: "q" }, title), html("p", {}, text),
        html("p", { class: "how" }, needed), ...written(answer === null ? "" : words.plain(answer), 2))];
    }),
  ];
}

/** Width of a page between its margins, px. */
const WIDE = 680;

/** The sheet, which contains the picture during printing. */
function paper(lesson: Lesson): HTMLElement {
  const { words, kept, student, stage, lesson: { title, question, steps } } = lesson;
  const picture = html("div", { class: "picture" }), { width, height } = stage.view;
  // As large as on the screen, so that nothing in it moves; then scaled as a whole.
  const size = { width: `${width}px`, height: `${height}px`, zoom: `${WIDE / width}` };
  Object.assign(picture.style, size);
  picture.append(stage.home);
  return html("div", { class: "paper" },
    html("p", { class: "who" }, html("span", {}, `${words.say("exercise-name")}: ${student}`),
      html("span", {}, `${words.say("paper-date")}:`)),
    html("h1", {}, title), html("p", { class: "q" }, question),
    picture,
    ...steps.map((step, n) => {
      const { kind, text, asks, columns, then } = step;
      const table = columns.length ? [html("table", {}, html("tbody", {},
        ...tableOf(step, kept.runs[n] ?? [], words).map((row, k) => html("tr", {}, ...row.map((cell, m) =>
          html(k && m ? "td" : "th", {},
            ...(typeof cell === "number" ? [words.number(cell)] : grown(cell))))))))] : [];
      return html("section", {},
        html("h2", {}, `${n + 1}. ${words.say(`step-${kind}`)}`), ...grown(text),
        ...asks.map((ask, k) => html("div", { class: "together" }, ...asked(lesson, ask, `${n}.${k}`))),
        ...table, ...(kind === "try" && !asks.length ? written("", LINES) : []),
        ...(kind === "numbers" ? numbers(lesson) : []),
        ...(kept.done.includes(n) ? grown(then) : []));
    }));
}

/** Print the lesson as a sheet. */
export function printed(lesson: Lesson) {
  const place = document.createComment("stage"), { home } = lesson.stage;
  let sheet: HTMLElement | undefined;
  addEventListener("beforeprint", () => {
    home.before(place);
    sheet = paper(lesson);
    document.body.append(sheet);
  });
  addEventListener("afterprint", () => {
    place.replaceWith(home);
    sheet?.remove();
  });
}
