// All texts, from the catalogue of one language, and numbers as that language writes them.

import type { Fault } from "./scene.ts";

/** Returns a whole number in superscript. */
const raised = (power: number) => String(power).replace(/./g, (sign) =>
  (sign === "-" ? "⁻" : "⁰¹²³⁴⁵⁶⁷⁸⁹"[Number(sign)]));

type Quantity = { unit: string, value: number };

class Words {
  comma;

  constructor(readonly language: string, readonly catalogue: Record<string, string>) {
    const sample = new Intl.NumberFormat(language).format(0.5);
    this.comma = sample.includes(",");
  }

  /** @param values values for {names} in the text */
  say(id: string, values: Record<string, string | number> = {}) {
    const text = this.catalogue[id] ?? id;
    return text.replace(/\{(\w+)\}/g, (whole, name) => String(values[name] ?? whole));
  }

  /** Returns the title of a scene: shipped scenes have one in each language. */
  title(title: string) {
    return this.catalogue[`title-${title}`] ?? title;
  }

  /** Returns the name of a surface or stream: known names are translated, others unchanged. */
  name(name: string) {
    const [, stem, number] = /^([a-z]+) ?(\d+)$/.exec(name)
      ?? /^(material|pair|string|rod|spring|pin) (.*)$/.exec(name) ?? [];
    const part = this.catalogue[`part-${stem}`] ?? this.catalogue[`name-${stem}`];
    return this.catalogue[`name-${name}`] ?? (part ? `${part} ${number}` : name);
  }

  /** Returns the name of a scene's key, such as `plate.angle_deg`. */
  key(table: string, key: string) {
    const { catalogue } = this;
    return catalogue[`key-${table}.${key}`] ?? catalogue[`key-${key}`] ?? key;
  }

  /** Returns why a scene is invalid. */
  fault({ key, text, words: found }: Fault) {
    const [path, ...rest] = key.replace(/(?<=\..*)\[\d+\]/g, "").split("."), name = rest.join(".");
    const [table, row] = path.split(/\[|\]/);
    const part = `${this.name(table)}${row ? ` ${Number(row) + 1}` : ""}`;
    const where = name ? `${part}, ${this.key(table, name)}`
      : this.catalogue[`key-${table}`] ?? (table ? part : "");
    const values: Record<string, string> = {};
    for (const [id, value] of Object.entries(found)) {
      values[id] = typeof value === "number" ? this.bound(value) : value;
    }
    const why = this.say(`fault-${text}`, values);
    return where ? `${where}: ${why}` : why;
  }

  /** Returns why a value is invalid, for the text below its field. */
  why(fault: Fault, key: string) {
    const text = fault.key === key ? this.fault({ ...fault, key: "" } as Fault) : this.fault(fault);
    return `${text.charAt(0).toUpperCase()}${text.slice(1)}.`;
  }

  /** Returns the name of a value that is a word, such as a material. */
  choice(word: string) {
    return this.catalogue[`choice-${word}`] ?? word;
  }

  /** Returns an end of a range as text. */
  bound(value: number) {
    return this.local(String(Number(value.toPrecision(6))));
  }

  /** Returns a value rounded to six digits; integers unchanged. */
  brief(value: number) {
    return Number.isInteger(value) ? value : Number(value.toPrecision(6));
  }

  /** Returns a value as text for a field. */
  plain(value: number) {
    return this.local(String(this.brief(value)));
  }

  /** Returns a unit as it is written after a number. */
  unit(unit: string) {
    return unit === "degrees" ? "°" : unit.replace(/m2$/, "m²");
  }

  /** Returns a number with this many significant digits; 0 as "0". */
  number(value: number, digits: number = 4) {
    if (!isFinite(value)) return "–";
    if (value === 0) return "0";
    const size = Math.abs(value);
    if (size >= 1e5 || size < 1e-4) {
      const [mantissa, power] = value.toExponential(digits - 1).split("e");
      return `${this.local(mantissa)}·10${raised(Number(power))}`;
    }
    const text = value.toFixed(Math.max(0, digits - 1 - Math.floor(Math.log10(size))));
    return this.local(text);
  }

  /** Returns a number with this many decimals. */
  fixed(value: number, places: number) {
    return this.local((Math.abs(value) < 0.5 * 10 ** -places ? 0 : value).toFixed(places));
  }

  /** Returns an energy in mJ or J, a small part of the whole with two digits.
   * @param value J @param whole J */
  energy(value: number, whole: number = 0) {
    const size = Math.abs(value), digits = size < 1e-4 * whole ? 2 : 4;
    if (size < 5e-13) return "0 mJ";
    return size < 1 ? `${this.number(1e3 * value, digits)} mJ` : `${this.number(value, digits)} J`;
  }

  local(text: string) {
    const signed = text.replace("-", "−");
    return this.comma ? signed.replace(".", ",") : signed;
  }

  /** Returns a value as it is shown beside a handle. */
  value({ value, unit }: Quantity) {
    const places = ({ degrees: 1, "m/s": 2 } as Record<string, number>)[unit] ?? 3;
    return `${this.fixed(value, places)}${unit === "degrees" ? "°" : unit ? ` ${unit}` : ""}`;
  }

  /** Returns the first two shown values of a handle, with their names or bare. */
  values(
    axes: { key: string, value: number, unit: string, part?: number, step: number }[], bare = false,
  ) {
    const seen = axes.filter(({ step }) => step).slice(0, 2);
    const places = seen.every(({ part }) => part !== undefined);
    return seen.map((axis, n) => {
      const [table, ...rest] = axis.key.replace(/\[\d+\]/g, "").split("."), name = rest.join(".");
      const what = places ? `${axis.unit === "m/s" ? "v" : ""}${"xy"[n]}` : this.key(table, name);
      return bare ? this.value(axis) : `${what} = ${this.value(axis)}`;
    }).join(bare ? ", " : "\n");
  }

  /** Returns the number in a typed text, with point or comma; NaN for other texts. */
  parse(text: string) {
    const plain = text.trim().replace("−", "-").replace(",", ".");
    return /^[-+.\de]+$/i.test(plain) ? Number(plain) : NaN;
  }
}

export { Words };
