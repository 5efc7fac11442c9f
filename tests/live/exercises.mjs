// Exercises as the page has them: a JSON question on stdin, the answers on stdout.
import { readFileSync } from "node:fs";

import { load } from "./run.mjs";

const { drawnFor, plainName } = await load("draw.js");
const { fixedText, generalText, scientific } = await load("decimal.js");
const { readTyped } = await load("judging.js");
const { sha256 } = await load("sha256.js");
const { Task } = await load("task.js");

/** What a student sees who gives these answers, and then asks for everything else. */
function played({ exercise, student, answers, others = [] }) {
  const task = new Task(exercise, student, () => others);
  const questions = exercise.questions.map((question, n) => n);
  const asked = questions.map((n) => task.asked(n));
  const replies = answers.map(([n, value]) => task.judged(n - 1, value));
  const right = questions.map((n) => task.case(n).right);
  const typed = questions.map((n) => task.check(n, String(right[n])));
  const hints = questions.map((n) => exercise.questions[n].hints.map(() => task.hint(n)));
  const workings = questions.map((n) => task.reveal(n));
  const again = new Task(exercise, student, () => others);
  again.goOn(JSON.parse(JSON.stringify(task.result)));
  return {
    drawn: task.numbers.drawn, rows: task.rows, story: task.story, asked, replies, right, typed,
    hints, workings, states: questions.map((n) => task.state(n)), progress: task.progress,
    result: task.result, resumed: again.result, statesAgain: questions.map((n) => again.state(n)),
  };
}

const question = JSON.parse(readFileSync(0, "utf8"));
process.stdout.write(JSON.stringify({
  played: (question.played ?? []).map(({ exercise, ...one }) =>
    played({ exercise: question.exercises[exercise], ...one })),
  drawn: (question.drawn ?? []).map(([exercise, student]) =>
    drawnFor(question.exercises[exercise], student).drawn),
  plain: (question.names ?? []).map(plainName),
  digests: (question.texts ?? []).map(sha256),
  fixed: (question.fixed ?? []).map(([value, places]) => fixedText(value, places)),
  general: (question.general ?? []).map((value) => generalText(value, 4)),
  scientific: (question.scientific ?? []).map(([value, count]) => scientific(value, count)),
  typed: (question.typed ?? []).map(([text, unit]) => readTyped(text, unit)),
}));
