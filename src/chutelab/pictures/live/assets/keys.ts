// Keys of a scene by their full path, such as `surface.hood.speed`: read, changed, written as TOML.

import type { Given } from "./scene.ts";

/** Returns the keys and indices of a full path, such as `stream.at[0]` or `surface.hood.speed`. */
function partsOf(given: Given, key: string): (string | number)[] {
  const parts: (string | number)[] = [];
  for (const segment of key.split(".")) {
    const [head, ...indices] = segment.split("[");
    parts.push(head, ...indices.map((index) => Number.parseInt(index, 10)));
  }
  const rows = given[parts[0]];
  if (Array.isArray(rows) && typeof parts[1] === "string") {
    const row = rows.findIndex((one) => one.name === parts[1]);
    if (row >= 0) parts[1] = row;
    else if (rows.length === 1) parts.splice(1, 0, 0);
  } else if (rows !== undefined && !Array.isArray(rows) && parts[1] === 0) {
    parts.splice(1, 1);
  }
  // The page stores every line as points.
  const { points } = (rows as any)?.[parts[1]] ?? {};
  if (parts[0] === "surface" && points && (parts[2] === "from" || parts[2] === "to")) {
    parts.splice(2, 1, "points", parts[2] === "from" ? 0 : points.length - 1);
  }
  return parts;
}

/** Returns a full path with the number of a row in place of its name. */
export const indexed = (given: Given, key: string) => partsOf(given, key)
  .map((part, n) => (typeof part === "number" ? `[${part}]` : n ? `.${part}` : part)).join("");

/** Returns the value at a full path; undefined if there is none. */
export function valueAt(given: Given, key: string): any {
  let found: any = given;
  for (const part of partsOf(given, key)) found = found?.[part];
  return found;
}

/** Returns keys with other values by full path; undefined removes a key. */
export function withValues(given: Given, values: Record<string, any>): Given {
  const changed = structuredClone(given);
  for (const [key, value] of Object.entries(values)) {
    const parts = partsOf(changed, key);
    const last = parts[parts.length - 1];
    let place: any = changed;
    for (const part of parts.slice(0, -1)) place = place[part] ??= {};
    if (value !== undefined) place[last] = value;
    else if (Array.isArray(place)) place.splice(Number(last), 1);
    else delete place[last];
  }
  return changed;
}

function tomlValue(value: any): string {
  if (Array.isArray(value)) return `[${value.map(tomlValue).join(", ")}]`;
  if (typeof value === "string") {
    // JSON does not escape one control character that TOML does not allow.
    return JSON.stringify(value).replaceAll("\x7f", "\\u007f");
  }
  if (typeof value === "number") return Object.is(value, -0) ? "-0.0" : String(value);
  if (typeof value !== "object") return String(value);
  const entries = Object.entries(value).map(([key, entry]) => tomlLine(key, entry));
  return `{ ${entries.join(", ")} }`;
}

function tomlLine(key: string, value: any): string {
  // A seed beyond 2**53 is text here, as numbers of JavaScript do not have its digits.
  const whole = key === "seed" && typeof value === "string";
  const name = /^[\w-]+$/.test(key) ? key : tomlValue(key);
  return `${name} = ${whole ? value : tomlValue(value)}`;
}

/** Returns the text of a scene file, without expectations, which belong to another scene. */
export function toToml(given: Given) {
  const lines = [];
  const isTable = (value: any) => {
    return typeof value === "object" && !Array.isArray(value);
  };
  const tables = [];
  for (const [key, value] of Object.entries(given)) {
    if (key === "expect" || value === undefined) continue;
    if (isTable(value)) tables.push(`\n[${key}]`, ...tableLines(value));
    else if (Array.isArray(value) && value.length && value.every(isTable)) {
      for (const row of value) tables.push(`\n[[${key}]]`, ...tableLines(row));
    } else lines.push(tomlLine(key, value));
  }
  return `${[...lines, ...tables].join("\n")}\n`;
}

function tableLines(row: Given) {
  return Object.entries(row)
    .filter(([, value]) => value !== undefined)
    .map(([key, value]) => tomlLine(key, value));
}
