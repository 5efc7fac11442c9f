// Keys of the whole page, and the list of them.

import { html } from "./panels.ts";
import type { Bench } from "./bench.ts";
import type { Lab } from "./lab.ts";
import type { Marks } from "./marks.ts";
import type { Palette } from "./palette.ts";
import type { Words } from "./words.ts";

/** Functions of keys, in words of the catalogue: `help-` and these. */
const KEYS: [string, string][] = [
  ["play", "help-space"], ["step", "← →"], ["mark", ", ."], ["ends", "Home End"], ["tab", "Tab"],
  ["handle", "← → ↑ ↓"], ["fine", "help-shift"], ["undo", "help-ctrl-z"], ["redo", "help-ctrl-shift-z"],
  ["taken", "help-delete"], ["copy", "help-ctrl-c"], ["duplicate", "help-ctrl-d"],
  ["all", "help-ctrl-a"], ["letter", "E … R"], ["draw", "help-arrows"],
  ["hold", "help-arrows"], ["view", "H"],
  ["alt", "Alt"], ["escape", "help-esc"], ["zoom", "+ −"], ["help", "?"],
];

/** Elements with their own use of keys. */
const BUSY = "button, input, select, textarea, summary, a, dialog, [role=slider]";

function listenToKeys(
  bench: Bench, palette: Palette | null, marks: Marks, lab: Lab, words: Words,
) {
  const click = (id: string) => document.getElementById(id)?.click();
  const dialog: HTMLDialogElement = html("dialog", { id: "help", "aria-label": words.say("help") },
    html("h2", {}, words.say("help")),
    html("dl", {}, ...KEYS.flatMap(([id, key]) => [
      html("dt", {}, words.say(key)), html("dd", {}, words.say(`help-${id}`)),
    ])), html("button", { click: () => dialog.close() }, words.say("close")));
  document.body.append(dialog);
  const help = () => {
    dialog.showModal();
    // The button at the end of the list has the focus.
    dialog.scrollTop = 0;
  };
  document.getElementById("keys")?.addEventListener("click", help);
  const always: Record<string, () => void> = {
    "ctrl+z": () => lab.undo(), "ctrl+shift+z": () => lab.redo(), "ctrl+y": () => lab.redo(),
    Escape: () => {
      if (lab.fault) lab.dismiss();
      if (lab.hand) lab.drop();
      else if (bench.mode || bench.moving) bench.set(null);
      else bench.inspector.choose();
    },
  };
  const calm: Record<string, () => void> = {
    " ": () => click("play"), Home: () => click("restart"), End: () => lab.seek(lab.end),
    ArrowLeft: () => click("back"), ArrowRight: () => click("forward"),
    "+": () => click("tool-zoom-in"), "-": () => click("tool-zoom-out"),
    "?": help, ",": () => marks.jump(-1), ".": () => marks.jump(1),
  };
  // Letters act while the picture has the focus.
  const drawn: Record<string, () => void> = {
    v: () => bench.set(null), "ctrl+c": () => bench.copy(), "ctrl+v": () => bench.paste(),
    "ctrl+d": () => bench.duplicate(), "ctrl+a": () => bench.all(),
  };
  const onHandles = [" ", "+", "-", "?", ",", "."];
  addEventListener("keydown", (event) => {
    if (event.defaultPrevented || dialog.open) return;
    const target = event.target as Element;
    const typing = target.matches("input:not([type=range]), textarea");
    const ctrl = event.ctrlKey || event.metaKey;
    const name = ctrl ? `ctrl+${event.shiftKey ? "shift+" : ""}${event.key.toLowerCase()}` : event.key;
    let act = typing && name !== "Escape" ? undefined : always[name];
    const handle = target.matches("[role=slider]"), picture = target.id === "picture";
    const time = target.closest(".scrub") && [",", "."].includes(name);
    if (!ctrl && (handle ? onHandles.includes(name) : time || !target.closest(BUSY))) {
      act ??= calm[name];
    }
    if (!typing && target.closest("#stage")) {
      act ??= drawn[name];
      const part = ctrl || event.altKey ? undefined : palette?.partOf(name);
      if (part) act = () => bench.draw(part);
    }
    if (["Delete", "Backspace"].includes(name) && (handle || picture || !target.closest(BUSY))) {
      if (bench.inspector.mayDelete) act = () => bench.inspector.takeAway();
    }
    if (!act) return;
    event.preventDefault();
    act();
  });
}

export { listenToKeys };
