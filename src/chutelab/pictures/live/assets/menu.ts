// The menu of a page without steps: a new machine, the scene as it was, light and dark, print.

import { html, icon, menuOf } from "./panels.ts";
import type { Lab } from "./lab.ts";
import type { Stage } from "./stage.ts";
import type { Words } from "./words.ts";

/** The system's theme, or always one of both; with the media for the dark colours. */
const THEMES: Record<string, string> = {
  system: "screen and (prefers-color-scheme: dark)", light: "not all", dark: "screen",
};

/** The theme kept in this browser, if it keeps anything. */
const kept = {
  get theme() {
    try {
      return localStorage.getItem("chutelab-theme") ?? "";
    } catch {
      return "";
    }
  },
  set theme(name: string) {
    try {
      localStorage.setItem("chutelab-theme", name);
    } catch {
      // A frame without an origin keeps nothing.
    }
  },
};

class Menu {
  /** The rule of page.css for the dark. */
  dark;

  constructor(readonly lab: Lab, readonly stage: Stage, readonly words: Words, isFree: boolean) {
    const reset = document.getElementById("reset") as HTMLElement;
    const themes = Object.keys(THEMES).map((name) => this.button(`theme-${name}`, "", () => this.paint(name)));
    const rows = [
      ...(isFree ? [this.button("new-machine", "add", () => this.empty())] : []), reset,
      this.button("print-page", "print", () => globalThis.print()),
    ];
    reset.append(html("span", {}, words.say("reset")));
    for (const row of rows) row.className = "row-button";
    const root = menuOf("menu", "menu", words.say("menu"), ...rows,
      html("p", {}, words.say("theme")), html("div", { class: "seg" }, ...themes),
      html("p", { class: "note" }, document.querySelector("footer")?.textContent ?? ""));
    for (const row of rows) row.addEventListener("click", () => { root.open = false; });
    document.querySelector("header .name")?.prepend(root);
    this.dark = [...document.styleSheets[0].cssRules].find((rule): rule is CSSMediaRule =>
      rule instanceof CSSMediaRule && rule.conditionText.includes("prefers-color-scheme"));
    const { theme } = kept;
    // It is the system's theme; setting it again would style and paint everything once more.
    if (theme in THEMES && theme !== "system") this.paint(theme);
    else this.press("system");
  }

  button(id: string, drawing: string, act: () => void) {
    return html("button", { id, click: act }, ...(drawing ? [icon(drawing)] : []),
      html("span", {}, this.words.say(id)));
  }

  /** Start an empty machine, which can be undone. */
  empty() {
    this.lab.replace({ title: this.words.say("new-machine"), stream: [] });
    this.stage.fit();
    document.getElementById("picture")?.focus();
  }

  paint(theme: string) {
    if (this.dark) this.dark.media.mediaText = THEMES[theme];
    document.documentElement.style.colorScheme = theme === "system" ? "" : theme;
    this.press(theme);
    if (theme !== kept.theme) kept.theme = theme;
    this.stage.recolour();
  }

  /** Show which theme is on. */
  press(theme: string) {
    for (const name of Object.keys(THEMES)) {
      document.getElementById(`theme-${name}`)?.setAttribute("aria-pressed", String(name === theme));
    }
  }
}

export { Menu };
