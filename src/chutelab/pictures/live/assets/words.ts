// All that is said, from the catalogue of one language; numbers as that language writes them.

import type { Fault } from "./scene.ts";

/** A whole number as an exponent. */
const raised = (power: number) => String(power).replace(/./g, (sign) =>
  (sign === "-" ? "⁻" : "⁰¹²³⁴⁵⁶⁷⁸⁹"[Number(sign)]));

type Quantity = { unit: string, value: number };

class Words {
  comma;

  constructor(readonly language: string, readonly catalogue: Record<string, string>) {
    const sample = new Intl.NumberFormat(language).format(0.5);
    this.comma = sample.includes(",");
  }

  /** @param values for {names} in it */
  say(id: string, values: Record<string, string | number> = {}) {
    const text = this.catalogue[id] ?? id;
    return text.replace(/\{(\w+)\}/g, (whole, name) => String(values[name] ?? whole));
  }

  /** The title of a scene: those that are shipped have one in each language. */
  title(title: string) {
    return this.catalogue[`title-${title}`] ?? title;
  }

  /** A surface or stream by its name: ours are translated, a scene's own stand as they are. */
  name(name: string) {
    const [, stem, number] = /^([a-z]+)(\d+)$/.exec(name)
      ?? /^(material|pair|string|rod|spring|pin) (.*)$/.exec(name) ?? [];
    const part = this.catalogue[`part-${stem}`];
    return this.catalogue[`name-${name}`] ?? (part ? `${part} ${number}` : name);
  }

  /** A key of the scene, such as `plate.angle_deg`. */
  key(table: string, key: string) {
    const { catalogue } = this;
    return catalogue[`key-${table}.${key}`] ?? catalogue[`key-${key}`] ?? key;
  }

  /** Why a scene cannot be. */
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

  /** Why a value cannot be, below the field in which it was typed. */
  why(fault: Fault, key: string) {
    const text = fault.key === key ? this.fault({ ...fault, key: "" } as Fault) : this.fault(fault);
    return `${text.charAt(0).toUpperCase()}${text.slice(1)}.`;
  }

  /** A word of a scene's keys, such as that of a material. */
  choice(word: string) {
    return this.catalogue[`choice-${word}`] ?? word;
  }

  /** The end of a range. */
  bound(value: number) {
    return this.local(String(Number(value.toPrecision(6))));
  }

  /** A value with as many digits as are read. */
  brief(value: number) {
    return Number.isInteger(value) ? value : Number(value.toPrecision(6));
  }

  /** A value to be typed over. */
  plain(value: number) {
    return this.local(String(this.brief(value)));
  }

  /** A unit as it is written behind a number. */
  unit(unit: string) {
    return unit === "degrees" ? "°" : unit.replace(/m2$/, "m²");
  }

  /** A number with so many significant digits, 0 as 0. */
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

  /** With so many digits behind the point. */
  fixed(value: number, places: number) {
    return this.local((Math.abs(value) < 0.5 * 10 ** -places ? 0 : value).toFixed(places));
  }

  /** An energy in mJ or J. @param value J */
  energy(value: number) {
    const size = Math.abs(value);
    if (size < 5e-13) return "0 mJ";
    return size < 1 ? `${this.number(1e3 * value)} mJ` : `${this.number(value)} J`;
  }

  local(text: string) {
    const signed = text.replace("-", "−");
    return this.comma ? signed.replace(".", ",") : signed;
  }

  /** A value as it is shown beside a handle. */
  value({ value, unit }: Quantity) {
    const places = ({ degrees: 1, "m/s": 2 } as Record<string, number>)[unit] ?? 3;
    return `${this.fixed(value, places)}${unit === "degrees" ? "°" : unit ? ` ${unit}` : ""}`;
  }

  /** The values of a handle that are seen, the first two; with what they are, or bare. */
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

  /** A number that was typed, with point or comma; NaN of other text. */
  parse(text: string) {
    const plain = text.trim().replace("−", "-").replace(",", ".");
    return /^[-+.\de]+$/i.test(plain) ? Number(plain) : NaN;
  }
}

export { Words };
