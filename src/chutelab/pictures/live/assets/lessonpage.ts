// The page of a lesson.

import { Lesson } from "./lesson.ts";
import { start } from "./page.ts";

start(({ lab, stage, words, newEngine }) => ({
  lesson: new Lesson(stage, lab, words, newEngine),
}));
