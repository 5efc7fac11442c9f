// The page of a lesson.

import { Lesson } from "./lesson.ts";
import { start } from "./page.ts";
import { Tools } from "./tools.ts";

start(({ lab, stage, words, newEngine }) => {
  const tools = new Tools(lab, stage, words);
  return { tools, lesson: new Lesson(stage, lab, words, newEngine) };
});
