// The start of a page: unpacks the rest of its data and its script, while the threads start. The
// script runs in the page as text whose hash the page's policy allows.

import { bytesOf, compiled, unpacked } from "./core.ts";

const textOf = (id: string) => document.getElementById(id)?.textContent ?? "";

/** @returns the page's data, the core, and a maker of threads, of which the first has started */
async function boot() {
  const data = JSON.parse(textOf("lab"));
  const source = new Blob([data.worker], { type: "text/javascript" });
  const newThread = () => new Worker(URL.createObjectURL(source)), thread = newThread();
  const core = compiled(bytesOf(data.wasm).buffer).catch(() => null);
  const { script, ...more } = await unpacked(bytesOf(data.packed).buffer).json();
  Object.assign(globalThis, {
    booted: { data: Object.assign(data, more), core, newThread, thread },
  });
  const element = document.createElement("script");
  element.type = "module";
  element.textContent = script;
  document.body.append(element);
}

boot();
