// The values that a step lets change: a row under the picture, and numbers in a sentence.

import { roundUp } from "./chart.ts";
import { checked, fieldsOf, type Field } from "./controls.ts";
import { html, icon } from "./panels.ts";
import { Fault } from "./scene.ts";
import type { Lab } from "./lab.ts";
import type { Words } from "./words.ts";

/** Pixels to drag a number in a sentence by one step. */
const PULL = 4;

/** How far a pointer may stray that clicks, px. */
const STRAY = 4;

/** A round step that leads through a range in about a hundred. */
const stepOf = ({ low, high, name }: Field) =>
  (name === "count" ? Math.max(1, Math.round((high - low) / 100))
    : isFinite(high - low) && high - low < 1e5 ? roundUp((high - low) / 200) : 0.1);

const within = ({ low, high }: Field, value: number) =>
  Math.min(high, Math.max(low, Number(value.toPrecision(12))));

class Values {
  root;
  inputs: { key: string, input: any, slider: any }[] = [];
  scrubs: { key: string, button: any }[] = [];
  /** The key that was changed last, which a refusal is about, and what was typed. */
  last = "";

  constructor(readonly lab: Lab, readonly words: Words) {
    this.root = html("div", { class: "values", role: "group", "aria-label": words.say("values") });
    lab.on("scene", () => this.fill());
  }

  /** What can be changed now, by key. */
  get fields(): Map<string, Field> {
    const { data, given, scene } = this.lab;
    if (!given || !scene) return new Map();
    const all = { table: "scene", row: 0, name: "scene" };
    return new Map(fieldsOf(data, given, scene, all).map((field) => [field.key, field]));
  }

  change(key: string, value: number | string, done = true) {
    const { lab } = this, field = this.fields.get(key);
    if (!field) return;
    this.last = key;
    try {
      checked(field, value);
      lab.change({ [key]: value }, { done });
    } catch (error) {
      if (!(error instanceof Fault)) throw error;
      lab.refuse(error);
    }
  }

  /** Move a value by so many steps. */
  nudge(key: string, steps: number, done = true) {
    const field = this.fields.get(key);
    if (!field) return;
    const step = stepOf(field), now = typeof field.value === "number" ? field.value : 0;
    this.change(key, within(field, (Math.round(now / step) + steps) * step), done);
  }

  nameOf({ table, name, owner, part, of }: Field, several: boolean) {
    const { words } = this, which = of > 1 ? ` ${"xy"[part]}` : "";
    const said = `${words.key(table, name)}${which}`;
    return several && table !== "scene" ? `${words.name(owner)}: ${said}` : said;
  }

  /** Make the row anew for what a step lets change. */
  build() {
    const { words } = this, fields = [...this.fields.values()];
    this.scrubs = [];
    this.root.hidden = !fields.length;
    this.inputs = fields.map((field, n) => {
      const { key, low, high } = field, id = `value-${n}`;
      const input = html("input", { type: "text", id, inputmode: "decimal", autocomplete: "off",
        "aria-describedby": `${id}-why` });
      const take = () => this.take(key, input);
      input.addEventListener("change", take);
      input.addEventListener("keydown", (event: KeyboardEvent) => {
        if (event.key === "Enter") take();
        if (event.key === "Escape") this.forgive();
      });
      const slider = html("input", { type: "range", min: String(low), max: String(high),
        step: "any", tabindex: "-1", "aria-hidden": "true" });
      const step = stepOf(field);
      const slide = (done: boolean) =>
        this.change(key, within(field, Math.round(slider.valueAsNumber / step) * step), done);
      slider.addEventListener("input", () => slide(false));
      slider.addEventListener("change", () => slide(true));
      slider.hidden = !isFinite(high - low) || high - low > 1e5;
      return { key, input, slider };
    });
    this.root.replaceChildren(...this.inputs.map(({ key, input, slider }, n) => {
      const field = fields[n], name = this.nameOf(field, fields.length > 1);
      slider.setAttribute("aria-label", name);
      slider.removeAttribute("aria-hidden");
      slider.removeAttribute("tabindex");
      const button = (sign: number, drawing: string, word: string) => {
        const made = html("button", { type: "button", class: "ib step",
          "aria-label": `${name}: ${this.words.say(word)}` }, icon(drawing));
        made.addEventListener("click", () => this.nudge(key, sign * 5));
        return made;
      };
      return html("div", { class: "value" }, html("label", { for: input.id }, name),
        html("span", { class: "typed" }, button(-1, "minus", "less"),
          html("span", { class: "box" }, input,
            html("span", { class: "unit" }, words.unit(field.unit))),
          button(1, "plus", "more")),
        slider, html("p", { class: "why", id: `${input.id}-why`, role: "status" }));
    }));
    this.fill();
  }

  /** Take over what was typed. */
  take(key: string, input: any) {
    const { lab, words } = this, field = this.fields.get(key), text = input.value.trim();
    if (!field) return;
    const word = text.toLowerCase() === words.say("adhesion").toLowerCase();
    const value = word ? "adhesion" : words.parse(text);
    const shown = typeof field.value === "number" ? words.brief(field.value) : field.value;
    // What was only looked at keeps all its digits.
    if (value === shown && !lab.fault) return;
    input.setAttribute("aria-invalid", "true");
    this.change(key, value === shown ? field.value : value);
  }

  /** Forget what cannot be. */
  forgive() {
    if (!this.lab.fault) return;
    this.lab.fault = null;
    this.lab.tell("scene");
  }

  /** Show what counts, and beside what was changed last why it cannot be. */
  fill() {
    const { fields, words, lab: { fault } } = this;
    for (const { key, input, slider } of this.inputs) {
      const field = fields.get(key), why = input.closest(".value")?.querySelector(".why");
      if (!field) continue;
      const refused = fault && this.last === key && input.getAttribute("aria-invalid") === "true";
      if (why) why.textContent = fault && this.last === key ? words.fault(fault) : "";
      if (refused) continue;
      input.removeAttribute("aria-invalid");
      const said = typeof field.value === "number" ? words.plain(field.value)
        : words.say(field.value);
      if (document.activeElement !== input || input.value === "") input.value = said;
      else if (words.parse(input.value) !== field.value) input.value = said;
      if (typeof field.value !== "number") continue;
      slider.value = String(field.value);
      slider.setAttribute("aria-valuetext", `${said} ${words.unit(field.unit)}`);
    }
    for (const { key, button } of this.scrubs) this.name(key, button);
  }

  /** A number in a sentence: dragged sideways, typed after a click, moved by arrow keys. What
   * cannot be changed is only told. */
  scrub(key: string): Element {
    const field = this.fields.get(key), { words } = this;
    if (!field) return html("b", { class: "num" });
    const button = html("span", { class: "scrub num", role: "slider", tabindex: "0",
      "aria-label": this.nameOf(field, true) });
    for (const [name, value] of [["min", field.low], ["max", field.high]] as const) {
      if (isFinite(value)) button.setAttribute(`aria-value${name}`, String(value));
    }
    let from = 0, moved = 0, start = 0, held = false;
    button.addEventListener("pointerdown", (event: PointerEvent) => {
      event.preventDefault();
      button.focus();
      button.setPointerCapture(event.pointerId);
      [from, moved, held] = [event.clientX, 0, true];
      start = Number(this.fields.get(key)?.value);
    });
    button.addEventListener("pointermove", ({ clientX }: PointerEvent) => {
      if (!held) return;
      moved = Math.max(moved, Math.abs(clientX - from));
      const step = stepOf(field);
      if (moved < STRAY || !isFinite(start)) return;
      const steps = Math.round((clientX - from) / PULL);
      this.change(key, within(field, (Math.round(start / step) + steps) * step), false);
    });
    button.addEventListener("pointerup", () => {
      if (held && moved < STRAY) this.type(key, button);
      else this.lab.settle();
      held = false;
    });
    button.addEventListener("pointercancel", () => {
      held = false;
      this.lab.settle();
    });
    const steps: Record<string, number> = { ArrowRight: 1, ArrowUp: 1, ArrowLeft: -1, ArrowDown: -1,
      PageUp: 10, PageDown: -10, Home: -1e6, End: 1e6 };
    button.addEventListener("keydown", (event: KeyboardEvent) => {
      if (event.key in steps) this.nudge(key, steps[event.key]);
      else if (event.key === "Enter") this.type(key, button);
      else return;
      event.preventDefault();
      event.stopPropagation();
    });
    this.scrubs.push({ key, button });
    this.name(key, button);
    button.title = words.say("scrub");
    return button;
  }

  name(key: string, button: any) {
    const field = this.fields.get(key), { words } = this;
    if (!field) return;
    const said = typeof field.value === "number" ? words.plain(field.value)
      : words.say(field.value);
    const text = `${said} ${words.unit(field.unit)}`.trim();
    if (typeof field.value === "number") {
      button.setAttribute("aria-valuenow", String(field.value));
    }
    button.setAttribute("aria-valuetext", text);
    button.replaceChildren(text, icon("sideways"));
  }

  /** Have a number in a sentence typed. */
  type(key: string, button: any) {
    const field = this.fields.get(key), { words } = this;
    if (!field || button.hidden) return;
    const input = html("input", { type: "text", class: "scrub", inputmode: "decimal",
      "aria-label": this.nameOf(field, true) });
    input.value = typeof field.value === "number" ? words.plain(field.value) : "";
    let isOver = false;
    const end = (takes: boolean) => {
      // To take it away takes its focus, too.
      if (isOver) return;
      isOver = true;
      const value = words.parse(input.value), had = document.activeElement === input;
      input.remove();
      button.hidden = false;
      if (takes) this.change(key, value);
      if (had) button.focus();
    };
    input.addEventListener("keydown", (event: KeyboardEvent) => {
      event.stopPropagation();
      if (event.key === "Enter") end(true);
      if (event.key === "Escape") end(false);
    });
    input.addEventListener("blur", () => end(true));
    button.after(input);
    button.hidden = true;
    input.select();
    input.focus();
  }
}

export { Values };
