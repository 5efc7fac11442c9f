// Which numbers of a scene can be changed on this page, what holds them now, and how far they go.

import { valueAt } from "./keys.ts";
import { pathOf } from "./checks.ts";
import { Fault, met, type Scene, type Given } from "./scene.ts";
import type { Handle } from "./handles.ts";

/** `[live]` of the scene */
type Live = { predict?: boolean, controls?: string[] | null, panels?: string[] | null,
  ranges?: Record<string, [number, number]>,
  presets?: { name: string, set: Record<string, unknown> }[] };
type Page = { tables: Record<string, Record<string, any>>, live?: Live, lesson?: object };
/** A part of the scene; "scene" of the main numbers of all */
type Section = { table: string, row: number, name: string };
/** A number that can be typed; it is the n-th `part` `of` so many */
export type Field = { key: string, table: string, owner: string, name: string, part: number,
  of: number, unit: string, low: number, high: number, value: number | string };

/** A key of the only plate can be written in two ways: this is one of them. */
const plainKey = (key: string) => key.replace(/^(\w+)\[0\]/, "$1");

/** Whether a key is another one, or a part of it. */
const isPartOf = (key: string, whole: string) =>
  plainKey(key) === plainKey(whole) || plainKey(key).startsWith(`${plainKey(whole)}[`);

/** @param key of a number, or of a point whole */
function mayChange({ live }: Page, key: string) {
  const controls = live?.controls;
  return !controls || controls.some((one) => isPartOf(key, one) || isPartOf(one, key));
}

/** Whether things may be drawn and deleted: where not only some keys can be changed. */
const mayDraw = ({ live, lesson }: Page) =>
  !lesson && !live?.controls && (!live?.panels || live.panels.includes("edit"));

/** Whether the scene names what can be changed: few enough to be shown together. */
const showsFew = ({ live }: Page) => Boolean(live?.controls);

/** The handles of what can be changed. */
function openHandles(handles: Handle[], page: Page) {
  return handles.flatMap((handle) => {
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

/** Table and name of a key: `["surface", "from"]` of `surface[2].from[0]`. */
function homeOf(key: string) {
  const [table, name] = key.replace(/\[\d+\]/g, "").split(".");
  return name === undefined ? ["scene", table] : [table, name];
}

/** Unit and range of a key. */
function boundsOf(page: Page, key: string) {
  const [table, name] = homeOf(key);
  const rule = page.tables[table]?.[name] ?? {};
  const own = Object.entries(page.live?.ranges ?? {}).find(([one]) => isPartOf(key, one));
  const [low, high] = own?.[1] ?? [rule.low ?? -Infinity, rule.high ?? Infinity];
  return { unit: (rule.unit ?? "") as string, low, high };
}

function sectionsOf(scene: Scene): Section[] {
  const found: Section[] = [{ table: "scene", row: 0, name: "scene" }];
  const add = (table: string, rows: any[]) => rows.forEach((one, row) =>
    found.push({ table, row, name: one.name ?? (row ? `${table}${row + 1}` : table) }));
  add("incoming", scene.incoming ? [{}] : []);
  add("plate", scene.plates.map(({ pivot, name }) => (pivot ? { name } : {})));
  add("outgoing", scene.outgoing ? [{}] : []);
  for (const table of ["conveyor", "surface"] as const) add(table, scene[table]);
  add("stream", scene.streams);
  add("particle", scene.particles);
  add("view", scene.view ? [{}] : []);
  return found;
}

/** The resolved table of a section. */
function rowOf(scene: Scene, { table, row }: Section): any {
  if (table === "scene") return scene;
  const rows = { plate: scene.plates, stream: scene.streams, particle: scene.particles }[table]
    ?? (scene as any)[table];
  return Array.isArray(rows) ? rows[row] : rows;
}

/** What is first to be changed in any scene, by table. */
const MAIN: Record<string, string[]> = {
  scene: ["gravity"], incoming: ["speed", "pulley_radius"],
  plate: ["angle_deg", "distance", "restitution", "friction"],
  outgoing: ["speed", "drop", "friction"], stream: ["count", "rate", "restitution", "friction"],
  particle: ["radius", "mass"],
};

/** Keys that say nothing as the others are. */
function idle(table: string, row: any) {
  if (table === "surface") {
    return [...(row.points ? ["center", "radius", "from_deg", "to_deg"] : []),
      ...(row.given.from ? ["points"] : [])];
  }
  if (table === "stream") {
    return [...(row.count === 1 ? ["rate", "width", "bed_height", "speed_spread", "seed"] : []),
      ...(row.interact ? [] : ["restitution", "friction"])];
  }
  const weighed = table === "particle" && (row.given.density ?? row.given.material) !== undefined;
  return weighed ? ["mass"] : [];
}

function numberAt(scene: Scene, section: Section, key: string) {
  const which = ["restitution", "friction"].indexOf(key), row = rowOf(scene, section);
  if (which < 0 || ["stream", "material", "pair"].includes(section.table)) return row[key];
  // It may be the material's.
  const value = met(scene, 0, section.name)[which];
  return value === Infinity ? "adhesion" : value;
}

/** The numbers of a section, in the order of their rules. */
function fieldsOf(page: Page, given: Given, scene: Scene, section: Section): Field[] {
  if (section.table === "scene") {
    const isMain = ({ table, row }: Section) => MAIN[table] && row === 0;
    const all = showsFew(page);
    return sectionsOf(scene).filter((one) => all || isMain(one))
      .flatMap((one) => ownFields(page, given, scene, one)
        .filter(({ name }) => all || MAIN[one.table].includes(name)));
  }
  return ownFields(page, given, scene, section);
}

function ownFields(page: Page, given: Given, scene: Scene, section: Section): Field[] {
  const { table } = section, silent = idle(table, rowOf(scene, section));
  const fields: Field[] = [];
  for (const [name, rule] of Object.entries(page.tables[table] ?? {})) {
    if (silent.includes(name) || (rule.unit === undefined && rule.low === undefined)) continue;
    const path = table === "scene" ? name
      : given[table] === undefined ? `${table}.${name}` : pathOf(given, table, section.row, name);
    const add = (key: string, value: any, part = 0, of = 1) => {
      if (Array.isArray(value)) {
        value.forEach((entry, n) => add(`${key}[${n}]`, entry, n, value.length));
      } else if ((typeof value === "number" || value === "adhesion") && mayChange(page, key)) {
        const owner = section.name;
        fields.push({ key, table, owner, name, part, of, value, ...boundsOf(page, key) });
      }
    };
    const written = valueAt(given, path);
    add(path, Array.isArray(written) ? written : numberAt(scene, section, name));
  }
  return fields;
}

/** Refuse what is out of a field's range, or no number at all. */
function checked({ key, low, high, name }: Field, value: number | string) {
  if (value === "adhesion" && name === "friction") return value;
  if (typeof value !== "number" || !isFinite(value)) throw new Fault(key, value, "number");
  if (value < low || value > high) throw new Fault(key, value, "range", { low, high });
  if (["count", "seed"].includes(name) && !Number.isInteger(value)) {
    throw new Fault(key, value, "whole");
  }
  return value;
}

export { checked, fieldsOf, mayDraw, openHandles, sectionsOf, showsFew };
