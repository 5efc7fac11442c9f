// The numbers of a scene that can be changed on this page, with present values and ranges.

import { motionOf } from "./edit.ts";
import { valueAt } from "./keys.ts";
import { JOINTS, listOf, pathOf } from "./checks.ts";
import { Fault, met, ruleOf, type Scene, type Given, type Rule } from "./scene.ts";
import type { Form } from "./forms.ts";
import type { Handle } from "./handles.ts";
import type { Words } from "./words.ts";

/** `[live]` of the scene */
type Live = { predict?: boolean, controls?: string[] | null, panels?: string[] | null,
  ranges?: Record<string, [number, number]>,
  presets?: { name: string, set: Record<string, unknown> }[] };
type Page = { tables: Record<string, Record<string, any>>, live?: Live, lesson?: object };
/** A part of the scene; "scene" of the main numbers of all */
export type Section = { table: string, row: number, name: string };
/** A field to be typed or chosen; it is the n-th `part` `of` so many. An optional one is `free`,
 * and undefined if not given. */
export type Field = { key: string, table: string, owner: string, name: string, part: number,
  of: number, unit: string, low: number, high: number, value: any, form: Form, free: boolean,
  choices?: string[] };

/** A key of the only plate can be written in two ways; return one of them. */
const plainKey = (key: string) => key.replace(/^(\w+)\[0\]/, "$1");

/** Whether a key is another one, or a part of it. */
const isPartOf = (key: string, whole: string) =>
  plainKey(key) === plainKey(whole) || plainKey(key).startsWith(`${plainKey(whole)}[`);

/** @param key of a number, or of a point whole */
function mayChange({ live }: Page, key: string) {
  const controls = live?.controls;
  return !controls || controls.some((one) => isPartOf(key, one) || isPartOf(one, key));
}

/** Whether parts may be drawn and deleted: unless only some keys can be changed. */
const mayDraw = ({ live, lesson }: Page) =>
  !lesson && !live?.controls && (!live?.panels || live.panels.includes("edit"));

/** Whether the scene names the keys that can be changed, few enough to be shown together. */
const showsFew = ({ live }: Page) => Boolean(live?.controls);

/** The handles of keys that can be changed. */
function openHandles(handles: Handle[], page: Page) {
  return handles.flatMap((handle) => {
    const { axes, values } = handle;
    if (values) {
      const keys = Object.keys(values(axes.map(({ value }) => value)));
      return keys.every((key) => mayChange(page, key)) ? [handle] : [];
    }
    const open = handle.axes.map((_, n) => n).filter((n) => mayChange(page, handle.axes[n].key));
    if (open.length === handle.axes.length) return [handle];
    if (!open.some((n) => handle.axes[n].step)) return [];
    return [{
      ...handle, axes: open.map((n) => handle.axes[n]),
      drag: (x: number, y: number) => {
        const numbers = handle.drag(x, y);
        return open.map((n) => numbers[n]);
      },
    }];
  });
}

/** The path of a key's rule: `surface.from` for `surface[2].from[0]`. */
function homeOf(key: string) {
  const plain = key.replace(/\[\d+\]/g, "");
  return plain.includes(".") ? plain : `scene.${plain}`;
}

/** Unit and range of a key. */
function boundsOf(page: Page, key: string) {
  const rule = ruleOf(page.tables, homeOf(key));
  const own = Object.entries(page.live?.ranges ?? {}).find(([one]) => isPartOf(key, one));
  const [low, high] = own?.[1] ?? [rule?.low ?? -Infinity, rule?.high ?? Infinity];
  return { unit: rule?.unit ?? "", low, high };
}

/** Everything that can be chosen; things without a place in the picture have their table's name
 * before their own. */
function sectionsOf(scene: Scene, given: Given): Section[] {
  const found: Section[] = [{ table: "scene", row: 0, name: "scene" }];
  const add = (table: string, rows: any[]) => rows.forEach((one, row) =>
    found.push({ table, row, name: one.name ?? (row ? `${table}${row + 1}` : table) }));
  add("incoming", scene.incoming ? [{}] : []);
  add("plate", scene.plates.map(({ pivot, name }) => (pivot ? { name } : {})));
  add("outgoing", scene.outgoing ? [{}] : []);
  for (const table of ["conveyor", "surface", "sensor"] as const) add(table, scene[table]);
  for (const table of JOINTS) {
    listOf(given[table]).forEach((_, row) =>
      found.push({ table, row, name: `${table} ${row + 1}` }));
  }
  add("stream", scene.streams);
  add("particle", scene.particles);
  add("view", scene.view ? [{}] : []);
  listOf(given.material).forEach(({ name }, row) =>
    found.push({ table: "material", row, name: `material ${name}` }));
  scene.pair.forEach((_, row) => found.push({ table: "pair", row, name: `pair ${row + 1}` }));
  add("run", [{}]);
  return found;
}

/** The resolved table of a section. */
function rowOf(scene: Scene, { table, row, name }: Section): any {
  if (table === "scene") return scene;
  if (table === "material") return scene.materials.get(name.slice(table.length + 1));
  const joints = scene.joints.filter(({ kind }) => kind === table);
  if (joints.length) return joints[row];
  const rows = { plate: scene.plates, stream: scene.streams, particle: scene.particles }[table]
    ?? (scene as any)[table];
  return Array.isArray(rows) ? rows[row] : rows;
}

/** Tables of things that particles meet. */
const SURFACES = ["incoming", "plate", "outgoing", "conveyor", "surface"];

/** Keys shown first in any scene, by table. */
const MAIN: Record<string, string[]> = {
  scene: ["gravity"], incoming: ["speed", "pulley_radius"],
  plate: ["angle_deg", "distance", "restitution", "friction"],
  outgoing: ["speed", "drop", "friction"], stream: ["count", "rate", "restitution", "friction"],
  particle: ["radius", "mass"],
};

/** Keys of a hinge. */
const HINGED = ["hinge", "mass", "inertia", "spring", "rest_deg", "damper", "stops_deg", "motor"];

/** Keys of motions that have no effect with another motion. */
function still({ given }: any, table: string): string[] {
  const motion = motionOf(given), canStart = motion === "hinge" ? given.motor : motion !== "still";
  return [...(canStart ? [] : ["starts_when"]), ...(motion === "hinge" ? ["turn"] : HINGED), ...(given.shake ? [] : ["shake"]),
    ...(given.travel ? [] : ["travel"]), ...(motion === "still" ? ["turn"] : []),
    ...(table === "surface" && (["still", "shakes"].includes(motion) || Array.isArray(given.hinge))
      ? ["pivot"] : [])];
}

/** Keys without effect, given the values of the others. */
function idle({ incoming, particles, streams, kinds }: Scene, table: string, row: any): string[] {
  const moves = table === "surface" || table === "plate" ? still(row, table) : [];
  if (table === "surface") {
    return [...moves, ...row.center ? ["from", "to", "points"]
      : ["center", "radius", "from_deg", "to_deg", ...(row.given.from ? ["points"] : ["from", "to"])]];
  }
  if (table === "plate") {
    return [...moves, ...row.pivot ? ["distance", "pivot_height"] : ["name", "pivot"]];
  }
  if (table === "stream") {
    return [...(row.count === 1 ? ["rate", "width", "bed_height", "speed_spread", "seed"] : []),
      ...(particles[kinds[streams.indexOf(row)]].outline.length ? [] : ["angle_deg"]),
      ...(row.interact ? [] : ["restitution", "friction"]), ...(row.to ? ["bed_height"] : []),
      ...(row.fill ? ["at", "to", "rate", "bed_height", "speed_spread"] : []),
      ...(incoming || row.at ? [] : ["at", "to"]), ...(row.at || row.fill ? [] : ["to"])];
  }
  if (table === "pair") {
    const kinds = row.between.every((name: string) => particles.some((one) => one.name === name));
    return [...(kinds ? [] : ["meet"]), ...(row.meet ? [] : ["restitution", "friction", "cohesion", "bond_number"])];
  }
  if (table === "particle" && row.outline.length) {
    return ["shape", "radius", "density", "rolling_friction", row.size ? "points" : "size"];
  }
  const weighed = table === "particle" && (row.given.density ?? row.given.material) !== undefined;
  return [...(weighed ? ["mass"] : []), ...(table === "particle" ? ["size", "points"] : []), ...(table === "outgoing" ? ["drop_from"] : [])];
}

function valueOf(scene: Scene, section: Section, key: string) {
  const which = ["restitution", "friction"].indexOf(key), row = rowOf(scene, section);
  if (which < 0 || ["stream", "material", "pair"].includes(section.table)) {
    return key.split(".").reduce((found, part) => found?.[part], row);
  }
  // The value may come from the material.
  const value = met(scene, 0, section.name)[which];
  return value === Infinity ? "adhesion" : value;
}

/** The fields of a section, in the order of the rules; for the scene, its main numbers. */
function fieldsOf(page: Page, given: Given, scene: Scene, section: Section): Field[] {
  if (section.table === "scene") {
    const isMain = ({ table, row }: Section) => MAIN[table] && row === 0;
    const all = showsFew(page);
    return sectionsOf(scene, given).filter((one) => all || isMain(one))
      .flatMap((one) => ownFields(page, given, scene, one).filter(({ name, value }) =>
        (all || MAIN[one.table].includes(name)) && ["number", "string"].includes(typeof value)));
  }
  return ownFields(page, given, scene, section);
}

/** The alternative forms of a value. */
const formsOf = (form: Form): Form[] => form.anyOf?.flatMap(formsOf) ?? [form];

const isNested = (form: Form) => formsOf(form).some(({ prefixItems, items }) =>
  (prefixItems?.[0] ?? items)?.type === "array");

function ownFields(page: Page, given: Given, scene: Scene, section: Section): Field[] {
  const { table } = section, silent = idle(scene, table, rowOf(scene, section));
  const fields: Field[] = [];
  const take = (name: string, rule: Rule, path: string) => {
    const { form, required = false } = rule;
    const add = (key: string, value: any, part = 0, of = 1) => {
      if (!mayChange(page, key)) return;
      const choices = name === "between" ? scene.particles.flatMap((kind) => kind.name ?? [])
        .concat(sectionsOf(scene, {}).filter((one) => SURFACES.includes(one.table))
          .map((one) => one.name))
        : name === "particle" && table === "stream"
          ? scene.particles.map((kind) => String(kind.name))
        : name === "shape" ? ["disk", "sphere"]
        : name === "passes" ? rowOf(scene, section).center ? ["in", "out"]
          : ["up", "down", "left", "right"]
        : name === "material" && table === "particle" ? [...scene.materials.keys()]
          : form.type === "boolean" ? [] : form.enum as string[] | undefined;
      if (choices && form.type !== "boolean" && choices.length < 2) return;
      const bounds = boundsOf(page, key);
      fields.push({
        key, table, owner: section.name, name, part, of, value, form, choices, ...bounds,
        free: !required && (rule.default === undefined || name === "repeat") && of === 1,
      });
    };
    // Whether there is a motor; shaking and travelling are chosen among the motions.
    if (name === "motor") {
      fields.push({ key: path, table, owner: section.name, name, part: 0, of: 1, unit: "", low: NaN,
        high: NaN, value: Boolean(valueAt(given, path)), form: { type: "boolean" }, free: false,
        choices: [] });
    }
    if (name.endsWith("_when")) {
      const choices = sectionsOf(scene, {}).filter((one) => SURFACES.includes(one.table)
        && one.name !== section.name).map((one) => one.name);
      if (choices.length) fields.push({ key: `${path}.touched`, table, owner: section.name, name,
        part: 0, of: 1, unit: "", low: NaN, high: NaN, value: valueAt(given, path)?.touched, form: {
          type: "string" }, free: true, choices });
      return;
    }
    if (rule.parts) {
      if (!valueAt(given, path)) return;
      for (const [part, own] of Object.entries(rule.parts)) {
        take(`${name}.${part}`, own, `${path}.${part}`);
      }
      return;
    }
    const written = valueAt(given, path);
    const value = written ?? valueOf(scene, section, name);
    if (Array.isArray(value) && value.length && !isNested(form)) {
      value.forEach((entry, n) => add(`${path}[${n}]`, entry, n, value.length));
    } else add(path, typeof written === "string" || Array.isArray(written) ? written
      : valueOf(scene, section, name));
  };
  const pathTo = (name: string) => (table === "scene" ? name
    : given[table] === undefined ? `${table}.${name}` : pathOf(given, table, section.row, name));
  for (const [name, rule] of Object.entries(page.tables[table] ?? {})) {
    if (silent.includes(name) || table === "view" && !rule.unit) continue;
    take(name, rule, pathTo(name));
  }
  if (page.tables[table]?.turn && mayDraw(page)) {
    fields.push({ key: pathTo("motion"), table, owner: section.name, name: "motion", part: 0, of: 1,
      unit: "", low: NaN, high: NaN, value: motionOf(rowOf(scene, section).given),
      form: { type: "string" }, free: false, choices: MOTIONS });
  }
  return fields;
}

/** The typed or chosen value as in the scene; nothing removes the key.
 * @throws {Fault} if it is out of the field's range, or not allowed there */
function checked(field: Field, text: string, words: Words): any {
  const { key, low, high, form, free } = field;
  // The unit shown beside the field may be typed with the number.
  const unit = words.unit(field.unit), typed = text.trim();
  const plain = unit && /\d/.test(typed) && typed.endsWith(unit)
    ? typed.slice(0, -unit.length).trim() : typed;
  if (plain === "" && free) return undefined;
  if (field.choices?.includes(plain)) return plain;
  const forms = formsOf(form), takes = (type: string) => forms.some((one) => one.type === type);
  const isWord = (word: unknown) =>
    forms.some((one) => one.const === word || one.enum?.includes(word));
  if (isWord(plain)) return plain;
  const sticks = plain.toLowerCase() === words.say("adhesion").toLowerCase();
  if (sticks && isWord("adhesion")) return "adhesion";
  const list = (row: string) => row.trim().split(/\s+/).map((entry) => words.parse(entry));
  if (isNested(form)) return plain.split(";").map(list);
  if (takes("array") && /\s/.test(plain)) return list(plain);
  if (!takes("number") && !takes("integer")) {
    if (field.of > 1) return numberIn(field, words.parse(plain));
    if (takes("string")) return plain;
    throw new Fault(key, plain, "form");
  }
  const value = words.parse(plain);
  if (Number.isNaN(value) && takes("string")) return plain;
  return numberIn({ ...field, low, high }, value);
}

/** A number that is in the range of its field. */
function numberIn({ key, low, high, form }: Field, value: number) {
  if (!isFinite(value)) throw new Fault(key, value, "number");
  if (value < low || value > high) throw new Fault(key, value, "range", { low, high });
  const whole = formsOf(form).every(({ type }) => type === "integer");
  if (whole && !Number.isInteger(value)) throw new Fault(key, value, "whole");
  return value;
}

/** How a plate or a surface can move. */
const MOTIONS = ["still", "turns", "shakes", "travels", "hinge"];

export { MAIN, boundsOf, checked, fieldsOf, mayDraw, openHandles, sectionsOf, showsFew };
