// The menu that chooses what the picture shows and what the colours of particles mean.

import { html, menuOf } from "./panels.ts";
import { Legend } from "./legend.ts";
import type { Hue } from "./balls.ts";
import type { LoadsPanel } from "./loads.ts";
import type { Lab } from "./lab.ts";
import type { Stage } from "./stage.ts";
import type { Symbols } from "./symbols.ts";
import type { Words } from "./words.ts";

const HUES: Hue[] = ["material", "speed", "size", "kind"];

class Show {
  bar;
  strobe;

  constructor(lab: Lab, readonly stage: Stage, readonly words: Words, symbols: Symbols,
    loads?: LoadsPanel) {
    const menu = menuOf("show", "eye", words.say("show"));
    menu.classList.add("looks");
    this.bar = menu.lastElementChild;
    document.getElementById("views")?.prepend(menu);
    const show = stage.show as Record<string, boolean>;
    this.box("trails", show.trails, (on) => { show.trails = on; });
    this.strobe = this.box("strobe", show.strobe, (on) => { show.strobe = on; });
    this.box("velocity-arrows", show.velocity, (on) => { show.velocity = on; });
    this.box("force-arrows", show.forces, (on) => { show.forces = on; });
    if (loads) this.box("loads", Boolean(lab.machine?.loads), (on) => loads.show(on));
    this.box("symbols", symbols.shown, (on) => { symbols.shown = on; });
    this.box("grid", true, (on) => { stage.scenery.ground.classList.toggle("off", !on); });
    this.hues();
    new Legend(stage);
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

  /** Add the buttons that choose what the colours mean; the legend explains them. */
  hues() {
    const { stage, words } = this, { balls } = stage;
    const buttons = HUES.map((hue) => html("button",
      { id: `hue-${hue}`, "aria-pressed": "false", click: () => choose(hue) },
      words.say(`hue-${hue}`)));
    const choose = (hue: Hue) => {
      balls.hue = hue;
      balls.measure();
      buttons.forEach((one, n) => one.setAttribute("aria-pressed", String(HUES[n] === hue)));
      stage.rebuild();
    };
    buttons[0].setAttribute("aria-pressed", "true");
    this.bar.append(html("p", {}, words.say("hue")), html("div", { class: "seg" }, ...buttons));
    const offer = () => {
      const { hasSizes } = balls;
      buttons[HUES.indexOf("size")].hidden = !hasSizes;
      if (balls.hue === "size" && !hasSizes) choose("material");
    };
    this.stage.lab.on("scene", offer);
    offer();
  }

  nameStrobe() {
    const { words, stage } = this;
    this.strobe.textContent = words.say("strobe-every", { step: words.number(stage.strobeStep, 1) });
  }
}

export { Show };
