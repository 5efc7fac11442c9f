// Numbers that can be typed: of one part of the scene, or the main ones of all.

import { checked, fieldsOf, sectionsOf, showsFew, type Field } from "./controls.ts";
import { canGo, without } from "./edit.ts";
import { card, html } from "./panels.ts";
import { Fault } from "./scene.ts";
import type { Lab } from "./lab.ts";
import type { Words } from "./words.ts";

class Inspector {
  /** The name of the part that is shown. */
  part = "scene";
  listeners: (() => void)[] = [];
  choice;
  remove;
  list;
  inputs: Map<string, { input: any, field: Field }> = new Map();

  constructor(home: Element, readonly lab: Lab, readonly words: Words) {
    this.choice = html("select", { "aria-label": words.say("part") });
    this.choice.addEventListener("change", () => this.choose(this.choice.value));
    this.remove = html("button", { type: "button" }, words.say("delete"));
    this.remove.addEventListener("click", () => this.takeAway());
    this.list = html("div", { class: "fields" });
    home.append(card("edit", words.say("values"),
      html("div", { class: "row" }, this.choice, this.remove), this.list));
    lab.on("scene", () => this.refresh());
    this.refresh();
  }

  /** Show a part of the scene; all of it where there is none of that name. */
  choose(name: string) {
    this.part = name;
    this.refresh();
    this.listeners.forEach((listener) => listener());
  }

  /** Whether what is shown can be deleted. */
  get canDelete() {
    return this.lab.given !== undefined && canGo(this.lab.given, this.part);
  }

  takeAway() {
    const { lab, part } = this;
    if (!lab.given || !this.canDelete) return;
    lab.replace(without(lab.given, part));
    if (lab.fault) return;
    this.choose("scene");
    document.getElementById("play")?.focus();
  }

  refresh() {
    const { lab, words, choice } = this;
    if (!lab.given || !lab.scene) return;
    const all = sectionsOf(lab.scene), sections = showsFew(lab.data) ? all.slice(0, 1) : all;
    choice.hidden = sections.length < 2;
    const section = sections.find(({ name }) => name === this.part) ?? sections[0];
    this.part = section.name;
    const names = sections.map(({ name }) => name);
    if (JSON.stringify(names) !== this.names) {
      this.names = JSON.stringify(names);
      choice.replaceChildren(...names.map((name) => new Option(words.name(name), name)));
    }
    choice.value = this.part;
    this.remove.hidden = !this.canDelete || !this.mayDelete;
    const fields = fieldsOf(lab.data, lab.given, lab.scene, section);
    const keys = fields.map(({ key }) => key);
    if (keys.join() !== [...this.inputs.keys()].join()) this.rebuild(fields);
    for (const field of fields) this.fill(field);
  }

  /** Set where nothing may be taken away. */
  mayDelete = true;

  names: string | undefined;

  rebuild(fields: Field[]) {
    const { words } = this, several = this.part === "scene";
    this.inputs.clear();
    this.list.replaceChildren(...fields.map((field) => {
      const { key, table, owner, name, part, of, unit, low, high } = field;
      const input = html("input", { type: "text", inputmode: "decimal", autocomplete: "off" });
      const ends = Math.abs(low) < 1e5 && Math.abs(high) < 1e5
        ? words.say("from-to", { low: words.bound(low), high: words.bound(high) }) : "";
      input.title = ends;
      input.addEventListener("change", () => this.take(key));
      input.addEventListener("keydown", (event: KeyboardEvent) => {
        if (event.key === "Enter") this.take(key);
        if (event.key !== "Escape" || !this.lab.fault) return;
        this.lab.fault = null;
        this.lab.tell("scene");
      });
      this.inputs.set(key, { input, field });
      const whose = several && table !== "scene" ? `${words.name(owner)}: ` : "";
      const which = of > 1 ? ` ${(name === "radius" ? "≥≤" : "xy")[part]}` : "";
      return html("label", {}, html("span", {}, `${whose}${words.key(table, name)}${which}`), input,
        html("span", { class: "unit" }, words.unit(unit)));
    }));
  }

  /** Show the value that counts, unless another is being typed. */
  fill(field: Field) {
    const its = this.inputs.get(field.key);
    if (!its) return;
    its.field = field;
    const refused = its.input.getAttribute("aria-invalid") === "true";
    if (refused && this.lab.fault) return;
    its.input.removeAttribute("aria-invalid");
    its.input.value = typeof field.value === "number" ? this.words.plain(field.value)
      : this.words.say(field.value);
  }

  /** Take over what was typed. */
  take(key: string) {
    const { lab, words } = this, its = this.inputs.get(key);
    if (!its) return;
    const { input, field } = its, text = input.value.trim();
    const word = text.toLowerCase() === words.say("adhesion").toLowerCase();
    const value = word ? "adhesion" : words.parse(text);
    const shown = typeof field.value === "number" ? words.brief(field.value) : field.value;
    // What was only looked at keeps all its digits.
    if (value === shown && !lab.fault) return;
    // What was typed stands until it is known to be possible.
    input.setAttribute("aria-invalid", "true");
    try {
      checked(field, value);
      if (value === shown) lab.replace(lab.given as any);
      else lab.change({ [key]: value });
    } catch (error) {
      if (!(error instanceof Fault)) throw error;
      lab.refuse(error);
    }
  }
}

export { Inspector };
