// All that is said, from the catalogue of one language; numbers as that language writes them.

/** @typedef {{unit: string, value: number}} Quantity */

class Words {
  /** @param {string} language @param {Record<string, string>} catalogue */
  constructor(language, catalogue) {
    this.language = language;
    this.catalogue = catalogue;
    const sample = new Intl.NumberFormat(language).format(0.5);
    this.comma = sample.includes(",");
  }

  /** @param {string} id @param {Record<string, string | number>} [values] for {names} in it */
  say(id, values = {}) {
    const text = this.catalogue[id] ?? id;
    return text.replace(/\{(\w+)\}/g, (whole, name) => String(values[name] ?? whole));
  }

  /** A surface or stream by its name: ours are translated, a scene's own stand as they are.
   * @param {string} name */
  name(name) {
    return this.catalogue[`name-${name}`] ?? name;
  }

  /** A key of the scene, such as `plate.angle_deg`. @param {string} table @param {string} key */
  key(table, key) {
    const { catalogue } = this;
    return catalogue[`key-${table}.${key}`] ?? catalogue[`key-${key}`] ?? key;
  }

  /** Why a scene cannot be. @param {import("./scene.js").Fault} fault */
  fault({ key, text, words: found }) {
    const [path, name] = key.replace(/(?<=\..*)\[\d+\]/g, "").split(".");
    const [table, row] = path.split(/\[|\]/);
    const part = `${this.name(table)}${row ? ` ${Number(row) + 1}` : ""}`;
    const where = name ? `${part}, ${this.key(table, name)}`
      : this.catalogue[`key-${table}`] ?? (table ? part : "");
    /** @type {Record<string, string>} */
    const values = {};
    for (const [id, value] of Object.entries(found)) {
      values[id] = typeof value === "number" ? this.bound(value) : value;
    }
    const why = this.say(`fault-${text}`, values);
    return where ? `${where}: ${why}` : why;
  }

  /** The end of a range. @param {number} value */
  bound(value) {
    return this.local(String(Number(value.toPrecision(6))));
  }

  /** A value with as many digits as are read. @param {number} value */
  brief(value) {
    return Number.isInteger(value) ? value : Number(value.toPrecision(6));
  }

  /** A value to be typed over. @param {number} value */
  plain(value) {
    return this.local(String(this.brief(value)));
  }

  /** A unit as it is written behind a number. @param {string} unit */
  unit(unit) {
    return unit === "degrees" ? "°" : unit;
  }

  /** A number with so many significant digits, 0 as 0.
   * @param {number} value @param {number} [digits] */
  number(value, digits = 4) {
    if (!isFinite(value)) return "–";
    if (value === 0) return "0";
    const size = Math.abs(value);
    const text = size >= 1e5 || size < 1e-4 ? value.toExponential(digits - 1)
      : value.toFixed(Math.max(0, digits - 1 - Math.floor(Math.log10(size))));
    return this.local(text);
  }

  /** With so many digits behind the point. @param {number} value @param {number} places */
  fixed(value, places) {
    return this.local((Math.abs(value) < 0.5 * 10 ** -places ? 0 : value).toFixed(places));
  }

  /** An energy in mJ or J. @param {number} value J */
  energy(value) {
    const size = Math.abs(value);
    if (size < 5e-13) return "0 mJ";
    return size < 1 ? `${this.number(1e3 * value)} mJ` : `${this.number(value)} J`;
  }

  /** @param {string} text */
  local(text) {
    const signed = text.replace("-", "−");
    return this.comma ? signed.replace(".", ",") : signed;
  }

  /** A value as it is shown beside a handle. @param {Quantity} quantity */
  value({ value, unit }) {
    const places = /** @type {Record<string, number>} */ ({ degrees: 1, "m/s": 2 })[unit] ?? 3;
    return `${this.fixed(value, places)}${unit === "degrees" ? "°" : unit ? ` ${unit}` : ""}`;
  }

  /** A number that somebody typed, with point or comma; NaN if it is none. @param {string} text */
  parse(text) {
    const plain = text.trim().replace("−", "-").replace(",", ".");
    return /^[-+.\de]+$/i.test(plain) ? Number(plain) : NaN;
  }
}

export { Words };
