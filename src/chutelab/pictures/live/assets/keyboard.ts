// Keys of the whole page, and the list that tells them.

import { html } from "./panels.ts";
import type { Bench } from "./bench.ts";
import type { Lab } from "./lab.ts";
import type { Words } from "./words.ts";

/** What keys do, in words of the catalogue: `help-` and these. */
const KEYS: [string, string][] = [
  ["play", "help-space"], ["step", "← →"], ["ends", "Home End"], ["tab", "Tab"],
  ["handle", "← → ↑ ↓"], ["fine", "help-shift"], ["undo", "help-ctrl-z"], ["redo", "help-ctrl-shift-z"],
  ["taken", "help-delete"], ["escape", "Esc"], ["zoom", "+ −"], ["help", "?"],
];

/** Elements that have a use of their own for keys. */
const BUSY = "button, input, select, textarea, summary, a, dialog, [role=slider]";

function listenToKeys(bench: Bench, lab: Lab, words: Words) {
  const click = (id: string) => document.getElementById(id)?.click();
  const close = html("button", { type: "button" }, words.say("close"));
  const dialog = html("dialog", { id: "help", "aria-label": words.say("help") },
    html("h2", {}, words.say("help")),
    html("dl", {}, ...KEYS.flatMap(([id, key]) => [
      html("dt", {}, words.say(key)), html("dd", {}, words.say(`help-${id}`)),
    ])), close);
  close.addEventListener("click", () => dialog.close());
  document.body.append(dialog);
  document.getElementById("keys")?.addEventListener("click", () => dialog.showModal());
  const always: Record<string, () => void> = {
    "ctrl+z": () => lab.undo(), "ctrl+shift+z": () => lab.redo(), "ctrl+y": () => lab.redo(),
    Escape: () => bench.set("move"),
  };
  const calm: Record<string, () => void> = {
    " ": () => click("play"), Home: () => click("restart"), End: () => lab.seek(lab.end),
    ArrowLeft: () => click("back"), ArrowRight: () => click("forward"),
    "+": () => click("tool-zoom-in"), "-": () => click("tool-zoom-out"),
    "?": () => dialog.showModal(),
  };
  const onHandles = [" ", "+", "-", "?"];
  addEventListener("keydown", (event) => {
    if (event.defaultPrevented || dialog.open) return;
    const target = event.target as Element;
    const typing = target.matches("input:not([type=range]), textarea");
    const ctrl = event.ctrlKey || event.metaKey;
    const name = ctrl ? `ctrl+${event.shiftKey ? "shift+" : ""}${event.key.toLowerCase()}` : event.key;
    let act = typing && name !== "Escape" ? undefined : always[name];
    const handle = target.matches("[role=slider]");
    if (!ctrl && (handle ? onHandles.includes(name) : !target.closest(BUSY))) act ??= calm[name];
    if (["Delete", "Backspace"].includes(name) && (handle || !target.closest(BUSY))) {
      if (bench.inspector.mayDelete) act = () => bench.inspector.takeAway();
    }
    if (!act) return;
    event.preventDefault();
    act();
  });
}

export { listenToKeys };
