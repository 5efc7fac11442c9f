// Base of every panel beside the picture: elements, a card, and redrawing.

import { filled, svg } from "./scenery.ts";
import type { Lab, News } from "./lab.ts";

/** Panels take at most one part in so many of the time. */
const SHARE = 12;

const html = (
  name: string, attributes: Record<string, unknown> = {}, ...children: (string | Node)[]
): any => filled(document.createElement(name),
  { ...(name === "button" ? { type: "button" } : {}), ...attributes }, children);

/** The nodes of a text made by Python from Markdown, in which raw markup is text. */
function grown(markup: string): Node[] {
  const { body } = new DOMParser().parseFromString(markup, "text/html");
  return [...body.childNodes].map((node) => document.importNode(node, true));
}

/** A drawing of the page's sprite, see page.html. */
function icon(name: string) {
  return svg("svg", { class: "i", "aria-hidden": "true" }, svg("use", { href: `#i-${name}` }));
}

/** A button with a drawing, and a name for its tooltip and for screen readers. */
function iconButton(
  id: string, drawing: string, name: string, click: () => void,
): HTMLButtonElement {
  return html("button", { class: "ib", id, title: name, "aria-label": name, click }, icon(drawing));
}

/** A button of the header that opens its content, until one clicks elsewhere. */
function menuOf(id: string, drawing: string, name: string, ...children: (string | Node)[]) {
  const head = html("summary", { class: "ib", title: name, "aria-label": name }, icon(drawing));
  const root = html("details", { class: "menu", id }, head,
    html("div", { class: "float choices" }, ...children));
  addEventListener("pointerdown", ({ target }) => {
    if (!root.contains(target as Node)) root.open = false;
  });
  root.addEventListener("keydown", (event: KeyboardEvent) => {
    if (event.key !== "Escape" || !root.open) return;
    event.preventDefault();
    root.open = false;
    head.focus();
  });
  return root;
}

/** A panel with a title, which can be folded. */
function card(id: string, title: string, ...children: (string | Node)[]) {
  const head = DRAWINGS[id] ? [icon(DRAWINGS[id])] : [];
  const body = html("div", { class: "body" }, ...children);
  const summary = html("summary", {}, ...head, title, icon("down"));
  return html("details", { class: "card", id, open: "" }, summary, body);
}

/** Move a slider; its track is filled up to there. */
function slide(input: HTMLInputElement, value: number) {
  const { min, max } = input, text = String(value);
  if (input.value !== text) input.value = text;
  const share = (Number(input.value) - Number(min)) / (Number(max) - Number(min));
  style(input, "--at", `${(100 * share).toFixed(1)}%`);
}

/** Set a property of style, unless it has that value, which saves the browser work. */
function style(element: HTMLElement, name: string, value: string) {
  if (element.style.getPropertyValue(name) !== value) element.style.setProperty(name, value);
}

/** Work that takes longer, ms, is done alone in its frame. */
const HEAVY = 1.5, FRAME = 17;

/** Time at which the next heavy work may be done, ms. */
let alone = 0;

/** Interval at which a panel is drawn while the picture plays, or something is dragged, ms: layout
 * and painting by the browser take longer than the change. */
const CALM = 80;

/** Do something on request, but later if it takes long; the last call always counts.
 * @param calm least time until it is done again, ms */
function eased(act: () => void, calm = () => 0) {
  let free = 0, took = 0, waits = false;
  const ask = () => {
    if (waits) return;
    const begin = performance.now();
    const wait = Math.max(free, took > HEAVY ? alone : 0) - begin;
    if (wait > 0) {
      waits = true;
      setTimeout(() => {
        waits = false;
        ask();
      }, wait);
      return;
    }
    act();
    const end = performance.now();
    took = end - begin;
    free = end + Math.max(SHARE * took, calm());
    if (took > HEAVY) alone = end + FRAME;
  };
  return ask;
}

/** Draw a panel again at these events, while it is visible and there is a run to show. */
function follow(lab: Lab, panel: HTMLDetailsElement, news: News[], act: () => void) {
  const again = eased(() => {
    const isSeen = panel.open && !panel.matches(".off");
    if (isSeen && lab.recording && isFinite(lab.recording.begin)) act();
  }, () => (lab.playing || lab.before ? CALM : 0));
  for (const one of news) lab.on(one, again);
  panel.addEventListener("toggle", again);
}

/** Text before the title of a panel. */
const DRAWINGS: Record<string, string> = {
  edit: "slow", energy: "sum", numbers: "digits", landing: "bars", curves: "graph", share: "share",
  flow: "flow", loads: "land", sensors: "sensor",
};

export { CALM, card, eased, follow, grown, html, icon, iconButton, menuOf, slide, style };
