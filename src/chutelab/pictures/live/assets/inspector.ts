// Fields: main numbers of the scene in a panel, and the chosen part in a card beside it.

import { roundUp } from "./chart.ts";
import { MAIN, checked, fieldsOf, sectionsOf, showsFew, type Field, type Section } from "./controls.ts";
import {
  canGo, rowsNamed, waitingFor, withMotion, withName, withRowOf, without, type Part,
} from "./edit.ts";
import { listOf } from "./checks.ts";
import { card, html, icon, iconButton, slide } from "./panels.ts";
import { Fault, type Given } from "./scene.ts";
import type { Lab } from "./lab.ts";
import type { Words } from "./words.ts";

/** Places of a slider, and a range that is narrow enough for one. */
const PLACES = 100, NARROW = 400;

/** Keys shown first for a plate on a hinge. */
const HUNG = ["spring", "damper", "angle_deg"];

/** Keys that are replaced by another one. */
const INSTEAD: Record<string, string[]> = {
  opens_when: ["opens_at", "closes_when"], closes_when: ["closes_at", "opens_when"],
  opens_at: ["opens_when"], closes_at: ["closes_when"],
  from: ["other", "over"], other: ["from"], over: ["from"], cohesion: ["bond_number"], bond_number: ["cohesion"],
  meet: ["restitution", "friction", "cohesion", "bond_number"],
};

/** Fields that are not under "More". */
const FIRST = 3;

type Entry = { row: any, input: any, why: any, slider: any, field: Field };

/** Fields of a scene, with the reason for a value that cannot be below its own. */
class Fields {
  home = html("div", { class: "fields" });
  entries: Map<string, Entry> = new Map();
  built = "";
  /** The "More" section; it stays open for the next thing. */
  more = html("details", {});

  /** @param sliders whether numbers have one
   * @param owned whether owners of fields are named */
  constructor(
    readonly lab: Lab, readonly words: Words, readonly sliders: boolean,
    readonly owned: boolean = !sliders,
  ) {}

  /** @param isFirst whether a field is not under "More" */
  show(fields: Field[], isFirst: (field: Field) => boolean) {
    const built = JSON.stringify(fields.map(({ key, choices }) => [key, choices]));
    if (built !== this.built) this.build(fields, isFirst);
    this.built = built;
    for (const field of fields) this.fill(field);
  }

  build(fields: Field[], isFirst: (field: Field) => boolean) {
    const { words, home } = this;
    this.entries.clear();
    const rows = fields.map((field) => this.row(field));
    const first = rows.filter((_, n) => isFirst(fields[n]));
    const rest = rows.filter((_, n) => !isFirst(fields[n]));
    home.replaceChildren(...first);
    if (!rest.length) return;
    const names = fields.filter((field) => !isFirst(field))
      .map(({ table, name }) => words.key(table, name));
    const named = [...new Set(names)].slice(0, 2).join(", ");
    const more = html("details", { class: "more" },
      html("summary", {}, html("span", {}, words.say("more-keys", { keys: named })), icon("down")),
      ...rest);
    more.open = this.more.open;
    this.more = more;
    home.append(more);
  }

  row(field: Field): any {
    const { key, table, owner, name, part, of, unit, low, high, choices, form } = field;
    const { words } = this, id = `field-${this.sliders ? "own-" : ""}${key}`;
    const flag = form.type === "boolean";
    const input = choices && !flag ? html("select", { id })
      : html("input", flag ? { type: "checkbox", id }
        : { type: "text", id, inputmode: "decimal", autocomplete: "off" });
    if (choices && !flag) {
      input.append(...(field.free ? [new Option("–", "")] : []),
        ...choices.map((one) => new Option(words.choice(one), one)));
    }
    if (Math.abs(low) < 1e5 && Math.abs(high) < 1e5) {
      input.title = words.say("from-to", { low: words.bound(low), high: words.bound(high) });
    }
    const typed = () => (flag ? input.checked : input.value);
    input.addEventListener("change", () => this.take(key, typed()));
    input.addEventListener("keydown", (event: KeyboardEvent) => {
      if (event.key === "Enter") this.take(key, typed());
      if (event.key === "Escape" && this.lab.asked === key) this.giveUp(key);
    });
    const whose = !this.owned || table === "scene" ? "" : `${words.name(owner)}: `;
    const which = of > 1 ? ` ${(["radius", "stops_deg"].includes(name) ? "≥≤" : choices ? "12" : "xy")[part]}` : "";
    const label = html("label", { for: id }, `${whose}${words.key(table, name)}${which}`);
    const why = html("div", { class: "why", id: `why-${id}` });
    why.hidden = true;
    const row = html("div", { class: "entry" }, label, html("span", { class: "value" }, input,
      ...(flag || choices ? [] : [html("span", { class: "unit" }, words.unit(unit))])));
    const isNumber = typeof field.value === "number" && !choices;
    if (this.sliders && isNumber) this.steppers(field, row);
    const slider = this.sliders && isNumber && (of === 1 || this.owned)
      ? this.slider(field, row) : null;
    row.append(why);
    this.entries.set(key, { row, input, why, slider, field });
    return row;
  }

  /** The range of a number, up to twice its value if the key has no range; and a step. */
  rangeOf({ low, high, value, table, name }: Field) {
    const wide = high - low > NARROW, top = wide ? 2 * (Math.abs(value) || 0.5) : high;
    const ten = 10 ** Math.floor(Math.log10(top)), end = Math.ceil(top / ten) * ten;
    const from = wide ? Math.max(low, value < 0 ? -end : 0) : low;
    const to = wide ? Math.min(end, high) : high;
    const whole = this.lab.data.tables[table]?.[name]?.form.type === "integer";
    return { from, to, whole, step: whole ? 1 : Number(((to - from) / PLACES).toPrecision(1)) };
  }

  /** Buttons for less and more beside a number, for fingers. */
  steppers(field: Field, row: any) {
    const { lab, words } = this, { key, table, name, low, high } = field;
    const button = (way: number, sign: string) => {
      const label = `${words.key(table, name)}: ${words.say(way < 0 ? "less" : "greater")}`;
      const click = () => {
        const its = this.entries.get(key)?.field ?? field, { step, whole } = this.rangeOf(its);
        const by = its.unit === "degrees" || whole ? 1 : roundUp(step);
        // From a value between two round ones go to the next of them.
        const at = way * Math.floor((way * its.value) / by + 1e-9), next = (at + way) * by;
        const value = Math.min(high, Math.max(low, Number(next.toPrecision(12))));
        lab.asked = "";
        if (value !== its.value) lab.change({ [key]: value });
      };
      return html("button", { class: "step", "aria-label": label, click }, sign);
    };
    row.querySelector(".value").before(button(-1, "−"));
    row.append(button(1, "+"));
  }

  /** A slider over the range of a number. */
  slider(field: Field, row: any) {
    const { key, name, table } = field;
    const slider = html("input", { type: "range", "aria-label": this.words.key(table, name) });
    this.span(slider, field);
    const move = (done: boolean) => {
      this.lab.asked = "";
      this.lab.change({ [key]: Number(slider.value) }, { done });
    };
    slider.addEventListener("input", () => move(false));
    slider.addEventListener("change", () => move(true));
    row.append(slider);
    return slider;
  }

  /** Set a slider to the range of a number. */
  span(slider: HTMLInputElement, field: Field) {
    const { from, to, step } = this.rangeOf(field);
    Object.assign(slider, { min: from, max: to, step });
  }

  /** Show the present value, and why a typed one is refused. */
  fill(field: Field) {
    const { lab, words } = this, its = this.entries.get(field.key);
    if (!its) return;
    its.field = field;
    const { input, why, row, slider } = its;
    const refused = lab.asked === field.key && lab.fault !== null && row.contains(this.asking);
    row.classList.toggle("refused", refused);
    why.hidden = !refused;
    if (slider && typeof field.value === "number") {
      const { min, max } = slider;
      if (field.value < Number(min) || field.value > Number(max)) this.span(slider, field);
      slide(slider, field.value);
    }
    if (refused) {
      input.setAttribute("aria-invalid", "true");
      input.setAttribute("aria-describedby", why.id);
      const was = this.text(field) || "–";
      const said = words.why(lab.fault as Fault, field.key);
      why.replaceChildren(icon("stop"),
        html("p", { role: "alert" }, `${said} ${words.say("still", { value: was })}`),
        html("button", { click: () => this.giveUp(field.key) }, words.say("back-to", { value: was })));
      return;
    }
    input.removeAttribute("aria-invalid");
    input.removeAttribute("aria-describedby");
    if (input.type === "checkbox") input.checked = field.value;
    else input.value = this.text(field);
  }

  /** A value as it is typed. */
  text({ value, choices }: Field): string {
    const { words } = this;
    if (value === undefined || value === null) return "";
    if (choices) return String(value);
    if (typeof value === "number") return words.plain(value);
    if (!Array.isArray(value)) return value === "adhesion" ? words.say(value) : value;
    const row = (entries: any[]) => entries.map((one) => words.plain(one)).join(" ");
    return Array.isArray(value[0]) ? value.map(row).join("; ") : row(value);
  }

  /** Called with the new name of the thing shown. */
  renamed: (name: string) => void = () => {};

  /** m that look large in the picture; set from outside. */
  unit = () => 1;

  /** The field in which something was typed. */
  asking: any = null;

  /** Take over what was typed. */
  take(key: string, typed: string | boolean) {
    const { lab, words } = this, its = this.entries.get(key);
    if (!its) return;
    const { field, input } = its;
    // A value that was not changed keeps all its digits.
    if (typeof typed === "string" && typed.trim() === this.text(field)) {
      if (lab.asked === key && lab.fault) this.giveUp(key);
      return;
    }
    lab.asked = key;
    this.asking = input;
    try {
      const value = typeof typed === "boolean" ? typed : checked(field, typed, words);
      const whole = value === undefined
        ? key.replace(/(\..*)\[\d+\]$|\.touched$/, "$1") : key;
      if (field.name === "name" && field.value && value) {
        lab.replace(withName(lab.given as Given, key, value));
        const own = field.table === "material" ? `material ${value}` : value;
        if (!lab.fault && field.table !== "particle") this.renamed(own);
      } else if (field.name === "motion") {
        const path = key.replace(/\.motion$/, ""), { machine } = lab;
        const own = machine?.surfaces.indexOf(field.owner);
        const { ends: [x, y] } = machine?.segments.find(({ surface }) => surface === own)
          ?? { ends: [0, 0] };
        lab.replace(withMotion(lab.given as Given, path, value, [x, y], this.unit()));
      } else if (field.name === "motor") {
        lab.change({ [key]: value ? { speed_deg: 90, torque: 1 } : undefined });
      } else {
        // Remove keys that contradict it.
        const row = key.slice(0, key.indexOf(".") + 1);
        const alone = value === undefined || value === true || field.table === "pin";
        const others = alone ? [] : INSTEAD[field.name] ?? [];
        lab.change({ ...Object.fromEntries(others.map((one) => [row + one, undefined])),
          [whole]: value });
      }
    } catch (error) {
      if (!(error instanceof Fault)) throw error;
      lab.refuse(error);
    }
  }

  /** Go back to the present value. */
  giveUp(key: string) {
    this.lab.dismiss();
    this.entries.get(key)?.input.focus();
  }
}

class Inspector {
  /** The names of the chosen parts. */
  parts: string[] = [];
  listeners: (() => void)[] = [];
  choice;
  main;
  own;
  panel;
  title;
  buttons: Record<string, any> = {};
  makers;

  constructor(home: Element, readonly lab: Lab, readonly words: Words) {
    this.choice = html("select", { "aria-label": words.say("part") });
    this.choice.addEventListener("change", () =>
      this.choose(...(this.choice.value === "scene" ? [] : [this.choice.value])));
    this.main = new Fields(lab, words, false);
    this.own = new Fields(lab, words, true);
    this.own.renamed = (name) => this.choose(name);
    this.makers = (["material", "pair"] as const).map((table) => html("button",
      { id: `make-${table}`, click: () => this.make(table) }, words.say(`make-${table}`)));
    home.append(card("edit", words.say("values"), html("div", { class: "row" }, this.choice),
      this.main.home, html("div", { class: "row makers" }, ...this.makers)));
    this.title = html("h2", {});
    const button = (id: string, drawing: string, act: () => void) =>
      (this.buttons[id] = iconButton(`part-${id}`, drawing, words.say(id), act));
    this.panel = html("section", { class: "float chosen-card", id: "chosen", "aria-label": words.say("chosen") },
      html("div", { class: "head" }, this.title, button("duplicate", "copy", () => this.duplicate()),
        button("delete", "bin", () => this.takeAway()),
        button("close", "close", () => this.choose())), this.own.home);
    this.panel.hidden = true;
    home.before(this.panel);
    document.querySelector(".notes")?.append(this.freed);
    lab.on("scene", () => {
      this.freed.hidden = true;
      this.refresh();
    });
    this.refresh();
  }

  /** Which triggers a deletion has taken along, until the scene changes again. */
  freed = html("p", { id: "freed", role: "status", hidden: true });

  /** The name of the part chosen last; "scene" if none is. */
  get part() {
    return this.parts.at(-1) ?? "scene";
  }

  /** Choose parts by name; none shows the whole scene. */
  choose(...names: string[]) {
    this.parts = names;
    this.refresh();
    this.listeners.forEach((listener) => listener());
  }

  /** Make a material or a pair, and choose it. */
  make(table: "material" | "pair") {
    const { lab } = this, { given, machine, scene, data } = lab;
    if (!given || !scene) return;
    const known = data.presets[scene.particles[0].material ?? ""] ?? data.presets.gravel;
    lab.asked = "";
    lab.replace(withRowOf(table, given, known, machine?.surfaces ?? []));
    if (lab.fault) return;
    const rows = listOf(lab.given?.[table]);
    this.choose(`${table} ${rows.at(-1)?.name ?? rows.length}`);
  }

  /** Makes copies; set from outside. */
  duplicate = () => {};

  /** Whether all chosen parts can be deleted. */
  get canDelete() {
    const { given } = this.lab;
    return given !== undefined && this.parts.length > 0
      && this.parts.every((name) => canGo(given, name));
  }

  takeAway() {
    const { lab, parts } = this;
    if (!lab.given || !this.canDelete) return;
    const freed = waitingFor(lab.given, parts);
    lab.asked = "";
    lab.replace(without(lab.given, ...parts));
    if (lab.fault) return;
    this.choose();
    if (freed.length) {
      this.freed.textContent = this.words.say("freed", {
        names: freed.map((name) => this.words.name(name)).join(", ") });
      this.freed.hidden = false;
    }
    document.getElementById("picture")?.focus();
  }

  /** The palette's part of a thing. */
  kindOf({ table, row }: Section): Part | undefined {
    const { given, data, scene } = this.lab, own = listOf(given?.[table])[row] ?? {};
    // A box is recognised by its particles.
    const { size } = table === "stream" && scene ? scene.particles[scene.kinds[row]] : {} as Given;
    const keys: Given = size ? { size, ...own } : own;
    const fits = data.parts.filter((part: Part) =>
      part.table === table && part.needs.every((key) => key in keys)) as Part[];
    return fits.sort((a, b) => b.needs.length - a.needs.length)[0];
  }

  refresh() {
    const { lab, words, choice } = this;
    if (!lab.given || !lab.scene) return;
    const { scene, given, data } = lab;
    const all = sectionsOf(scene, given), few = showsFew(data);
    const names = all.map(({ name }) => name);
    this.parts = this.parts.filter((name) => names.includes(name));
    choice.hidden = few || all.length < 2;
    if (JSON.stringify(names) !== this.names) {
      this.names = JSON.stringify(names);
      choice.replaceChildren(...names.map((name) => new Option(words.name(name), name)));
    }
    choice.value = this.part;
    this.main.show(fieldsOf(data, given, scene, all[0]), () => true);
    const section = all.find(({ name }) => name === this.part && name !== "scene");
    const kind = section && this.kindOf(section);
    const stream = section?.table === "stream" ? scene.kinds[section.row] : -1;
    // A stream is shown with its kind of particles.
    const grain = all.filter(({ table }) => table === "particle")[stream];
    const fields = !section || this.parts.length > 1 ? []
      : [section, ...(grain ? [grain] : [])].flatMap((one) => fieldsOf(data, given, scene, one));
    const hangs = section?.table === "plate" && scene.plates[section.row].hinge;
    const main = hangs ? HUNG : kind?.main ?? MAIN[section?.table ?? ""] ?? [];
    const order = main.filter((key) =>
      fields.some(({ table, name }) => key === name || key === `${table}.${name}`)).slice(0, FIRST);
    const place = ({ table, name }: Field) =>
      Math.max(order.indexOf(name), order.indexOf(`${table}.${name}`));
    const rank = (field: Field) => (place(field) >= 0 ? place(field) : field.name === "name" ? 99 : 9);
    fields.sort((a, b) => rank(a) - rank(b));
    this.own.show(fields, (field) => !order.length || place(field) >= 0);
    this.panel.hidden = !section || (!fields.length && !this.mayDelete);
    this.title.textContent = this.parts.length > 1 ? words.say("parts-chosen", { count: this.parts.length })
      : words.name(this.part);
    if (kind && this.parts.length === 1) this.title.prepend(icon(kind.part));
    for (const maker of this.makers) maker.hidden = !this.mayDelete;
    this.buttons.delete.hidden = !this.canDelete || !this.mayDelete;
    this.buttons.duplicate.hidden = !this.mayDelete || !rowsNamed(given, this.parts).length;
  }

  /** Whether parts may be deleted. */
  mayDelete = true;

  names: string | undefined;
}

export { Fields, Inspector };
