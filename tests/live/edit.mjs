// Asks the page's modules in node: a JSON list of questions on stdin, one of answers on stdout.
import { readFileSync } from "node:fs";

import { load } from "./run.mjs";

const [controls, edit, keys, machine, scene, share, words] = await Promise.all(
  ["controls.js", "edit.js", "keys.js", "machine.js", "scene.js", "share.js", "words.js"].map(load),
);
const { page, language, strings, questions } = JSON.parse(readFileSync(0, "utf8"));
const say = new words.Words(language, strings);

/** What is answered, or the words for why not. */
const tried = (ask) => {
  try {
    return ask();
  } catch (error) {
    if (!(error instanceof scene.Fault)) throw error;
    return { fault: say.fault(error), text: error.text, key: error.key };
  }
};

const built = (given) => machine.build(scene.resolve(given, page));

const EDIT = {
  set: keys.withValues,
  // A part by its name and points, m; its sizes are for a picture of so many m.
  part: (now, name, points, { unit = 1, material = "", start = 0 } = {}) => {
    const part = page.parts.find((one) => one.part === name);
    return edit.withPart(now, part, points, unit, material, start, page.tables[part.table]);
  },
  copies: (now, names, by) => edit.withCopies(now, edit.rowsNamed(now, names), by)[0],
  without: edit.without,
};

const ASK = {
  // A scene after some edits, as TOML, and what its address brings back.
  edited: ({ given, edits }) => tried(() => {
    const changed = edits.reduce((now, [name, ...rest]) => EDIT[name](now, ...rest), given);
    built(changed);
    const hash = share.toHash(given, changed);
    return {
      toml: keys.toToml(changed), changed, hash, back: share.fromHash(given, hash),
    };
  }),
  fields: ({ given, name, live }) => {
    const whole = { ...page, live }, resolved = scene.resolve(given, whole);
    const section = controls.sectionsOf(resolved, given).find((one) => one.name === name);
    return controls.fieldsOf(whole, given, resolved, section);
  },
  checked: ({ field, text }) => tried(() => ({ value: controls.checked(field, text, say) })),
  handles: async ({ given, live }) => {
    const { Handles } = await load("handles.js"), resolved = scene.resolve(given, page);
    const { list } = new Handles(resolved, machine.build(resolved), { ...page, live });
    return controls.openHandles(list, { ...page, live })
      .map(({ id, axes, drag, x, y }) => [id, axes.map(({ key }) => key), drag(x, y)]);
  },
  nearest: ({ given, places, reach }) => {
    const found = built(given);
    return places.map(([x, y]) => edit.surfaceAt(found, x, y, reach));
  },
  hash: ({ given, hash }) => tried(() => {
    const told = share.fromHash(given, hash);
    if (told) built(told);
    return told;
  }),
  csv: ({ rows, comma }) => share.toCsv(rows, comma),
  stem: ({ title }) => share.fileStem(title),
  parse: ({ texts }) => texts.map((text) => String(say.parse(text))),
};

const answers = [];
for (const { ask, ...rest } of questions) answers.push(await ASK[ask](rest));
process.stdout.write(JSON.stringify(answers));
