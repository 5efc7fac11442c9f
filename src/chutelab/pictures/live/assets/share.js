// A scene in an address, and as files.

/** @typedef {import("./scene.js").Given} Given */

/** The tables in which a scene differs from the page's, as a text for an address; "" if in none.
 * @param {Given} first @param {Given} given */
function toHash(first, given) {
  /** @type {Record<string, unknown>} */
  const changed = {};
  for (const table of new Set([...Object.keys(first), ...Object.keys(given)])) {
    const [before, now] = [JSON.stringify(first[table]), JSON.stringify(given[table])];
    if (before !== now) changed[table] = given[table] ?? null;
  }
  if (!Object.keys(changed).length) return "";
  const bytes = new TextEncoder().encode(JSON.stringify(changed));
  const text = Array.from(bytes, (byte) => String.fromCharCode(byte)).join("");
  return `#${btoa(text).replace(/\+/g, "-").replace(/\//g, "_").replace(/=+$/, "")}`;
}

/** The scene that an address tells, or null if it tells none.
 * @param {Given} first @param {string} hash @returns {Given | null} */
function fromHash(first, hash) {
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

/** @param {string} name @param {BlobPart} content @param {string} type */
function download(name, content, type) {
  const link = document.createElement("a");
  link.href = URL.createObjectURL(new Blob([content], { type }));
  link.download = name;
  link.click();
  setTimeout(() => URL.revokeObjectURL(link.href), 1000);
}

export { download, fromHash, toHash };
