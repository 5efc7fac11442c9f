// The page on a phone: tools in a bar at the bottom, and under the picture one thing at a time.

import { html, icon } from "./panels.ts";
import type { Bench } from "./bench.ts";
import type { Palette } from "./palette.ts";
import type { Words } from "./words.ts";

/** Media without room for cards beside the picture, as in page.css. */
const NARROW = "(max-width: 719px)";

/** Content of each drawer, which is elsewhere on a wider page. */
const DRAWERS: Record<string, string> = {
  tape: ".tools, .watch", eye: "#show .choices",
  more: "#restart, #back, #forward, #tool-hand, #fit, #tool-zoom-in, #tool-zoom-out, #sound, #film, #full, #language, #keys, #presets",
};

class Phone {
  is = matchMedia(NARROW);
  tabs;
  dock;
  drawers: Record<string, any> = {};
  /** Elements in drawers on a phone, and their placeholders. */
  lent: { node: any, mark: Comment, drawer: any }[] = [];
  buttons: Record<string, any> = {};
  /** The drawer that is open, and the card that is shown. */
  open = "";
  tab = "";

  constructor(readonly bench: Bench, readonly palette: Palette | null, readonly words: Words) {
    const panels = document.getElementById("panels") as HTMLElement;
    this.tabs = html("nav", { class: "tabs", "aria-label": words.say("values") });
    this.dock = html("nav", { class: "dock", "aria-label": words.say("tools") });
    const button = (id: string, drawing: string, act: () => void) => {
      this.buttons[id] = html("button", { id: `dock-${id}`, click: act }, icon(drawing),
        html("span", {}, words.say(`dock-${id}`)));
      this.dock.append(this.buttons[id]);
    };
    if (bench.free) {
      button("select", "select", () => {
        this.show("");
        palette?.open(false);
        bench.set(null);
      });
      button("add", "add", () => {
        const opens = palette?.panel.hidden ?? false;
        this.show("");
        palette?.open(opens);
        this.mark();
      });
    }
    for (const id of Object.keys(DRAWERS)) button(id, id, () => this.show(this.open === id ? "" : id));
    for (const [id, which] of Object.entries(DRAWERS)) {
      const drawer = this.drawers[id] = html("section", { class: "drawer", "aria-label": words.say(`dock-${id}`) });
      for (const node of document.querySelectorAll(which)) {
        const mark = document.createComment("");
        node.before(mark);
        this.lent.push({ node, mark, drawer });
      }
    }
    const share = document.getElementById("share");
    if (share) {
      const mark = document.createComment("");
      share.before(mark);
      this.lent.push({ node: share, mark, drawer: document.getElementById("edits") });
    }
    panels.before(this.tabs, ...Object.values(this.drawers));
    document.body.append(this.dock);
    // A chosen part should be visible in the picture.
    this.drawers.tape.addEventListener("click", ({ target }: MouseEvent) => {
      if ((target as Element).closest(".ib")) this.show("");
    });
    this.is.addEventListener("change", () => this.arrange());
    new MutationObserver(() => {
      if (this.is.matches) this.refresh();
    }).observe(panels.parentElement as Element,
      { subtree: true, attributeFilter: ["hidden", "class"] });
    bench.listeners.push(() => this.mark());
    bench.inspector.listeners.push(() => {
      if (this.is.matches && bench.inspector.parts.length) this.choose("chosen");
    });
    this.arrange();
  }

  /** Put everything where it belongs at this width. */
  arrange() {
    for (const { node, mark, drawer } of this.lent) {
      if (this.is.matches) drawer.append(node);
      else mark.after(node);
    }
    // Scrolling elements can be scrolled by keys, too.
    const panels = document.getElementById("panels") as HTMLElement;
    if (this.is.matches) panels.tabIndex = 0;
    else panels.removeAttribute("tabindex");
    this.show("");
  }

  /** Open a drawer, or close it. */
  show(drawer: string) {
    this.open = drawer;
    if (drawer) this.palette?.open(false);
    for (const [id, one] of Object.entries(this.drawers)) one.hidden = id !== drawer;
    this.mark();
    this.refresh();
  }

  mark() {
    const { bench, palette, open, buttons } = this;
    const adds = palette !== null && !palette.panel.hidden;
    for (const [id, button] of Object.entries(buttons)) {
      const calm = !open && !adds && !bench.mode && !bench.moving;
      const on = id === "select" ? calm : id === "add" ? adds : id === open;
      button.setAttribute("aria-pressed", String(on));
    }
  }

  /** The cards that can be shown: that of the chosen part first. */
  get cards(): any[] {
    return [...document.querySelectorAll("#chosen, #panels > .card:not(#share)")]
      .filter((one) => !one.matches("[hidden], .unwanted"));
  }

  choose(tab: string) {
    this.tab = tab;
    this.show("");
  }

  refresh() {
    const { cards } = this, names = cards.map(({ id }) => id);
    const on = names.includes(this.tab) ? this.tab : names[0];
    const titles = cards.map((one) => one.querySelector("h2, summary").textContent);
    const told = JSON.stringify([names, titles]);
    if (told !== this.told) {
      this.told = told;
      this.tabs.replaceChildren(...names.map((name, n) => html("button",
        { "data-of": name, click: () => this.choose(name) }, titles[n])));
    }
    for (const tab of this.tabs.children) {
      tab.setAttribute("aria-pressed", String(tab.dataset.of === on));
    }
    for (const card of cards) {
      const off = this.is.matches && card.id !== on;
      const isNew = card.matches(".off") && !off;
      if (card.matches(".off") !== off) card.classList.toggle("off", off);
      if (!card.matches("details")) continue;
      if (this.is.matches) card.open = true;
      // It may have changed while it was hidden.
      if (isNew) card.dispatchEvent(new Event("toggle"));
    }
  }

  told = "";
}

export { Phone };
