// The values that can be changed in a step: a row under the picture, and numbers in sentences.

import { roundUp } from "./chart.ts";
import { boundsOf, checked, fieldsOf, type Field } from "./controls.ts";
import { Fields } from "./inspector.ts";
import { valueAt } from "./keys.ts";
import { html, icon } from "./panels.ts";
import { Fault } from "./scene.ts";
import type { Lab } from "./lab.ts";
import type { Words } from "./words.ts";

/** Distance for one step when a number in a sentence is dragged, px. */
const PULL = 4;

/** Most movement of the pointer during a click, px. */
const STRAY = 4;

/** Returns a round step: about two hundred of them make the range. */
const stepOf = ({ low, high, name }: Field) =>
  (name === "count" ? Math.max(1, Math.round((high - low) / 100))
    : isFinite(high - low) && high - low < 1e5 ? roundUp((high - low) / 200) : 0.1);

const within = ({ low, high }: Field, value: number) =>
  Math.min(high, Math.max(low, Number(value.toPrecision(12))));

class Values {
  row;
  root;
  scrubs: { key: string, button: any }[] = [];

  constructor(readonly lab: Lab, readonly words: Words) {
    this.row = new Fields(lab, words, true, true);
    this.root = html("div", { class: "values", role: "group", "aria-label": words.say("values") },
      this.row.home);
    lab.on("scene", () => this.fill());
  }

  /** What can be changed, by key: numbers, words, and both coordinates of points. */
  get fields(): Map<string, Field> {
    const { data, given, scene } = this.lab;
    if (!given || !scene) return new Map();
    const all = fieldsOf(data, given, scene, { table: "scene", row: 0, name: "scene" });
    const points = (data.live?.controls ?? []).flatMap((control: string) => {
      const place = valueAt(given, control), [table] = control.split(/[.[]/);
      if (!/\.points\[\d+\]$/.test(control) || !Array.isArray(place)) return [];
      const owner = valueAt(given, control.replace(/\.points.*/, "")).name;
      return place.map((value, part) => ({
        key: `${control}[${part}]`, table, owner, name: "end", part, of: 2, value,
        form: { type: "number" }, free: false, ...boundsOf(data, control), unit: "m",
      }));
    });
    const plain = all.filter(({ value }) => ["number", "string"].includes(typeof value));
    return new Map([...plain, ...points].map((field) => [field.key, field]));
  }

  /** Apply a number or a typed text. */
  change(key: string, value: number | string, done = true) {
    const { lab, words } = this, field = this.fields.get(key);
    if (!field) return;
    lab.asked = "";
    try {
      lab.change({ [key]: typeof value === "number" ? value : checked(field, value, words) }, { done });
    } catch (error) {
      if (!(error instanceof Fault)) throw error;
      // The field in the row shows the reason.
      lab.asked = key;
      this.row.asking = this.row.entries.get(key)?.input;
      lab.refuse(error);
    }
  }

  /** Move a value by a number of steps. */
  nudge(key: string, steps: number, done = true) {
    const field = this.fields.get(key);
    if (!field) return;
    const step = stepOf(field), now = typeof field.value === "number" ? field.value : 0;
    this.change(key, within(field, (Math.round(now / step) + steps) * step), done);
  }

  nameOf({ table, name, owner, part, of }: Field) {
    const { words } = this, said = `${words.key(table, name)}${of > 1 ? ` ${"xy"[part]}` : ""}`;
    return table === "scene" ? said : `${words.name(owner)}: ${said}`;
  }

  /** Begin anew for the sentences of another step. */
  build() {
    this.scrubs = [];
    this.fill();
  }

  /** Show the present values. */
  fill() {
    const fields = [...this.fields.values()];
    this.root.hidden = !fields.length;
    this.row.show(fields, () => true);
    for (const { key, button } of this.scrubs) this.name(key, button);
  }

  /** Returns a number in a sentence: it can be dragged sideways, typed after a click, or moved with
   * arrow keys. One that cannot be changed is plain text. */
  scrub(key: string): Element {
    const field = this.fields.get(key), { words } = this;
    if (!field) return html("b", { class: "num" });
    const button = html("span", { class: "scrub num", role: "slider", tabindex: "0",
      "aria-label": this.nameOf(field) });
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

  /** Replace a number in a sentence by a field to type in. */
  type(key: string, button: any) {
    const field = this.fields.get(key), { words } = this;
    if (!field || button.hidden) return;
    const input = html("input", { type: "text", class: "scrub", inputmode: "decimal",
      "aria-label": this.nameOf(field) });
    input.value = typeof field.value === "number" ? words.plain(field.value) : "";
    let isOver = false;
    const end = (takes: boolean) => {
      // Removing the field also blurs it, which calls this again.
      if (isOver) return;
      isOver = true;
      const { value } = input, had = document.activeElement === input;
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
