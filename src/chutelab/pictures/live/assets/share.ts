// Stores a scene in an address and in files.

import { KNOT_ROW } from "./core.ts";
import type { Recording } from "./recording.ts";
import type { Given } from "./scene.ts";

type Rows = (string | number)[][];

/** Returns the tables in which a scene differs from the page's, as a text for an address; "" if
 * there are none. */
function toHash(first: Given, given: Given) {
  const changed: Record<string, unknown> = {};
  for (const table of new Set([...Object.keys(first), ...Object.keys(given)])) {
    const [before, now] = [JSON.stringify(first[table]), JSON.stringify(given[table])];
    if (before !== now) changed[table] = given[table] ?? null;
  }
  if (!Object.keys(changed).length) return "";
  const bytes = new TextEncoder().encode(JSON.stringify(changed));
  const text = Array.from(bytes, (byte) => String.fromCharCode(byte)).join("");
  return `#${btoa(text).replace(/\+/g, "-").replace(/\//g, "_").replace(/=+$/, "")}`;
}

/** Returns the scene stored in an address, or null if there is none. It is not checked here;
 * `resolve` does that. */
function fromHash(first: Given, hash: string): Given | null {
  if (hash.length < 2) return null;
  try {
    const text = atob(hash.slice(1).replace(/-/g, "+").replace(/_/g, "/"));
    const bytes = Uint8Array.from(text, (letter) => letter.charCodeAt(0));
    const changed = JSON.parse(new TextDecoder().decode(bytes));
    if (typeof changed !== "object" || changed === null) return null;
    const given = { ...first, ...changed };
    for (const table of Object.keys(given)) if (given[table] === null) delete given[table];
    return given;
  } catch {
    return null;
  }
}

function download(name: string, content: BlobPart, type: string) {
  const link = document.createElement("a");
  link.href = URL.createObjectURL(new Blob([content], { type }));
  link.download = name;
  link.click();
  setTimeout(() => URL.revokeObjectURL(link.href), 1000);
}

/** Returns all knots: position and velocity of each particle at the times at which its motion
 * changes. */
function knotRows(recording: Recording): Rows {
  const rows: Rows = [["particle", "t [s]", "x [m]", "y [m]", "vx [m/s]", "vy [m/s]", "omega [rad/s]"]];
  recording.tracks.forEach((track, index) => {
    for (let n = 0; n < track.count; n += 1) {
      rows.push([index, ...track.rows.subarray(n * KNOT_ROW, n * KNOT_ROW + 6)]);
    }
  });
  return rows;
}

/** Returns rows as text for a spreadsheet, separated by semicolons if numbers have a decimal comma.
 */
function toCsv(rows: Rows, comma: boolean) {
  const cell = (value: string | number) => {
    if (typeof value === "number") {
      return isFinite(value) ? String(value).replace(".", comma ? "," : ".") : "";
    }
    // A text must not become a formula or break the row.
    const tame = /^[=+@\-\t]/.test(value) ? `'${value}` : value;
    return /[",;\n]/.test(tame) ? `"${tame.replace(/"/g, '""')}"` : tame;
  };
  return rows.map((row) => row.map(cell).join(comma ? ";" : ",")).join("\r\n").concat("\r\n");
}

/** Returns the name of a scene's file, without suffix. */
const fileStem = (title: string) =>
  title.normalize("NFKD").replace(/[^\w]+/g, "-").replace(/^-+|-+$/g, "").slice(0, 60) || "scene";

export { download, fileStem, fromHash, knotRows, toCsv, toHash };
