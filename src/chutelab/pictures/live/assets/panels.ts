// What every panel beside the picture is made of: elements, a card, and when it is drawn again.

import type { Lab, News } from "./lab.ts";

/** Of the time that passes, panels take at most one part in so many. */
const SHARE = 12;

function html(
  name: string, attributes: Record<string, string> = {}, ...children: (string | Node)[]
): any {
  const element = document.createElement(name);
  for (const [key, value] of Object.entries(attributes)) element.setAttribute(key, value);
  element.append(...children);
  return element;
}

/** A panel with a title, which can be folded. */
function card(id: string, title: string, ...children: (string | Node)[]) {
  const body = html("div", { class: "body" }, ...children);
  return html("details", { class: "card", id, open: "" }, html("summary", {}, title), body);
}

/** What takes longer, ms, is done alone in its frame. */
const HEAVY = 1.5, FRAME = 17;

/** When something heavy may be done next, ms. */
let alone = 0;

/** Do something whenever it is asked for, but if it takes long, later: the last call always
 * counts. */
function eased(act: () => void) {
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
    free = end + SHARE * took;
    if (took > HEAVY) alone = end + FRAME;
  };
  return ask;
}

/** Draw a panel again at these news, as long as it is open and there is a run to show. */
function follow(lab: Lab, panel: HTMLDetailsElement, news: News[], act: () => void) {
  const again = eased(() => {
    if (panel.open && lab.recording && isFinite(lab.recording.begin)) act();
  });
  for (const one of news) lab.on(one, again);
  panel.addEventListener("toggle", again);
}

export { card, eased, follow, html };
