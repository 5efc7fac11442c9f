// The menu of what the picture shows, and by what its particles are coloured.

import { html, icon } from "./panels.ts";
import type { Lab } from "./lab.ts";
import type { Stage } from "./stage.ts";
import type { Symbols } from "./symbols.ts";
import type { Words } from "./words.ts";

class Show {
  bar;
  strobe;

  constructor(lab: Lab, readonly stage: Stage, readonly words: Words, symbols: Symbols) {
    const name = words.say("show"), named = { class: "ib", title: name, "aria-label": name };
    const head = html("summary", named, icon("eye"));
    this.bar = html("div", { class: "float choices" });
    const menu = html("details", { class: "menu looks", id: "show" }, head, this.bar);
    document.getElementById("views")?.prepend(menu);
    addEventListener("pointerdown", ({ target }) => {
      if (!menu.contains(target as Node)) menu.open = false;
    });
    const show = stage.show as Record<string, boolean>;
    this.box("trails", show.trails, (on) => { show.trails = on; });
    this.strobe = this.box("strobe", show.strobe, (on) => { show.strobe = on; });
    this.box("velocity-arrows", show.velocity, (on) => { show.velocity = on; });
    this.box("force-arrows", show.forces, (on) => { show.forces = on; });
    this.box("symbols", symbols.shown, (on) => { symbols.shown = on; });
    this.box("grid", true, (on) => { stage.scenery.ground.classList.toggle("off", !on); });
    this.hues();
    lab.on("run", () => this.nameStrobe());
  }

  box(name: string, on: boolean, act: (on: boolean) => void) {
    const input = html("input", { type: "checkbox", id: `show-${name}` });
    input.checked = on;
    input.addEventListener("change", () => {
      act(input.checked);
      this.stage.rebuild();
    });
    const text = html("span", {}, this.words.say(name));
    this.bar.append(html("label", { class: "check" }, input, text));
    return text;
  }

  /** What colour a particle has. */
  hues() {
    const { stage, words } = this, { balls } = stage;
    const legend = html("div", { class: "ramp num" });
    const buttons = (["material", "speed", "kind"] as const).map((hue) => {
      const button = html("button", { type: "button", id: `hue-${hue}`, "aria-pressed": "false" },
        words.say(`hue-${hue}`));
      button.addEventListener("click", () => {
        balls.hue = hue;
        balls.measure();
        for (const other of buttons) other.setAttribute("aria-pressed", String(other === button));
        legend.hidden = hue !== "speed";
        legend.replaceChildren(html("i"), html("span", {}, "0"),
          html("span", {}, `${words.plain(0.5 * balls.fastest)}`),
          html("span", {}, `${words.plain(balls.fastest)} m/s`));
        stage.paint();
      });
      return button;
    });
    buttons[0].setAttribute("aria-pressed", "true");
    legend.hidden = true;
    const choice = html("div", { class: "seg" }, ...buttons);
    this.bar.append(html("p", {}, words.say("hue")), choice, legend);
  }

  nameStrobe() {
    const { words, stage } = this;
    this.strobe.textContent = words.say("strobe-every", { step: words.number(stage.strobeStep, 1) });
  }
}

export { Show };
