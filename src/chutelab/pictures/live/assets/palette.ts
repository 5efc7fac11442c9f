// Parts to build a machine from, one for each row of their table; and the introduction of an empty
// page, with examples.

import { Balls } from "./balls.ts";
import { html, icon, iconButton } from "./panels.ts";
import { Scenery, svg } from "./scenery.ts";
import { build, cornersOf } from "./machine.ts";
import { resolve, type Given } from "./scene.ts";
import { View, boxOf } from "./view.ts";
import type { Bench } from "./bench.ts";
import type { Part } from "./edit.ts";
import { isBare, type Lab } from "./lab.ts";
import type { Stage } from "./stage.ts";
import type { Words } from "./words.ts";

/** Size of a picture of an example, px; and most particles in it. */
const WIDE = 176, HIGH = 104, MOST_BALLS = 400;

/** A finger that moves further than this, in pixels, drags a part instead of tapping it. */
const STRAY = 8;

/** The first machine, which a button makes. */
const FIRST: Given = {
  particle: { radius: 0.02, material: "rubber", shape: "sphere", spin: true },
  incoming: { speed: 2, pulley_radius: 0.1, length: 0.8 },
};

/** A first machine as dashes: path, and words with their places. */
const SKETCH = "M0 60H185A35 35 0 0 1 185 130H5M206 95A21 21 0 1 1 164 95A21 21 0 1 1 206 95"
  + "M246 8L431 192L442 181L257 -3ZM0 254H603M0 280H603M126 47A11 11 0 1 1 104 47A11 11 0 1 1 126 47";

class Palette {
  panel;
  /** Drawn once the parts are visible. */
  due: (() => void)[] = [];
  opener;
  tiles: [Part, any][];
  start?: any;

  constructor(
    home: Element, readonly bench: Bench, readonly stage: Stage, readonly lab: Lab,
    readonly words: Words,
  ) {
    this.tiles = lab.data.parts.map((part: Part) => [part, this.tile(part)]);
    const name = words.say("parts");
    this.panel = html("nav", { class: "float parts", "aria-label": name, id: "parts" },
      html("h2", {}, name, html("small", {}, words.say("letter-key"))),
      html("div", { class: "grid" }, ...this.tiles.map(([, tile]) => tile)), this.materials());
    home.append(this.panel);
    this.opener = iconButton("tool-add", "add", words.say("add-part"), () =>
      this.open(this.panel.hidden));
    document.getElementById("tool-hand")?.after(this.opener);
    bench.inspector.listeners.push(() => {
      if (bench.inspector.parts.length) this.open(false);
    });
    bench.listeners.push(() => {
      for (const [part, tile] of this.tiles) {
        tile.setAttribute("aria-pressed", String(bench.mode === part));
      }
    });
    if (lab.data.examples || lab.data.lacks) this.start = this.welcome(home);
    this.open(false);
    lab.on("scene", () => this.refresh());
    this.refresh();
    // Its letters act at once.
    if (!this.start || matchMedia("(pointer: coarse)").matches) return;
    stage.front.classList.add("quiet");
    stage.front.focus();
    addEventListener("keydown", () => stage.front.classList.remove("quiet"), { once: true });
  }

  open(on: boolean) {
    // The card of a chosen part is in the place of the parts.
    if (on && this.bench.inspector.parts.length) this.bench.inspector.choose();
    if (on) this.due.splice(0).forEach((draw) => draw());
    this.panel.hidden = !on;
    this.opener.setAttribute("aria-expanded", String(on));
  }

  /** The part that a letter begins. */
  partOf(letter: string): Part | undefined {
    return this.tiles.find(([part]) => part.letter === letter.toUpperCase())?.[0];
  }

  /** A part: a click begins to draw it in the picture, a drag puts it where it is dropped, and a
   * finger or a key puts it in the middle. */
  tile(part: Part) {
    const { words, bench, stage } = this;
    const tile = html("button", { class: "tile", "aria-pressed": "false",
      id: `part-${part.part}`, "aria-keyshortcuts": part.letter }, icon(part.part),
    html("span", {}, words.say(`part-${part.part}`)), html("kbd", { "aria-hidden": "true" }, part.letter));
    let from: [number, number] | null = null, dropped = false, pointer = "";
    tile.addEventListener("pointerdown", (event: PointerEvent) => {
      from = [event.clientX, event.clientY];
      pointer = event.pointerType;
      dropped = false;
      if (pointer === "mouse") tile.setPointerCapture(event.pointerId);
    });
    tile.addEventListener("pointerup", (event: PointerEvent) => {
      const far = from && Math.hypot(event.clientX - from[0], event.clientY - from[1]);
      from = null;
      if (pointer !== "mouse" || !far || far < STRAY) return;
      dropped = true;
      const over = document.elementFromPoint(event.clientX, event.clientY);
      if (!stage.home.contains(over)) return;
      const at = stage.placeOf(event), { view } = stage;
      bench.place(part, [view.worldX(at[0]), view.worldY(at[1])]);
    });
    tile.addEventListener("click", ({ detail }: MouseEvent) => {
      if (dropped) dropped = false;
      else if (detail === 0 || pointer === "touch") bench.place(part);
      else bench.set(bench.mode === part ? null : part);
    });
    return tile;
  }

  /** The material of the next balls. */
  materials() {
    const { words, bench, lab } = this, balls = new Balls(lab, () => "");
    const names = Object.keys(lab.data.presets).filter((name) => balls.isShaded(name));
    const choices = names.map((name) => {
      const said = words.choice(name);
      const picture = html("canvas", { width: "44", height: "44", "aria-hidden": "true" });
      this.due.push(() => picture.getContext("2d").drawImage(balls.picture(name), 0, 0, 44, 44));
      const click = () => {
        bench.material = bench.material === name ? "" : name;
        choices.forEach((one, n) =>
          one.setAttribute("aria-pressed", String(names[n] === bench.material)));
      };
      return html("button", { "aria-pressed": "false", title: said, "aria-label": said, click },
        picture);
    });
    return html("div", { class: "materials", role: "group", "aria-label": words.say("ball-of") },
      html("p", {}, words.say("ball-of")), html("div", {}, ...choices));
  }

  /** Introduction and examples; for a scene that is not shown whole, the missing parts. */
  welcome(home: Element) {
    const { words, lab } = this, { data } = lab;
    if (data.lacks) {
      const what = Object.entries(data.lacks).map(([kind, count]) =>
        words.say(`lack-${kind}`, { count: count as number })).join(", ");
      const note = html("aside", { class: "float lacks", id: "lacks" }, icon("stop"), html("div", {},
        html("p", {}, words.say("lacks", { what })),
        html("p", { class: "note" }, words.say("lacks-run"), " ",
          html("code", {}, `chutelab run ${data.source}`))),
      html("button", { click: () => note.remove() }, words.say("close")));
      home.querySelector(".notes")?.prepend(note);
      return undefined;
    }
    const click = () => this.show({ title: lab.first.title, ...FIRST });
    const begin = html("button", { class: "main", id: "begin", click }, icon("belt"),
      words.say("begin"));
    const named = ([["belt", 70, 101], ["ball", 114, 28], ["plate", 346, 76],
      ["second", 317, 272]] as const).map(([word, x, y]) => svg("text", {
      // Beside the plate there is room on one side only.
      x, y, "text-anchor": word === "plate" ? "start" : "middle" }, words.say(`sketch-${word}`)));
    const sketch = svg("svg", { viewBox: "-8 -14 620 304", class: "sketch", "aria-hidden": "true" },
      svg("path", { d: SKETCH }), ...named);
    const examples = Object.entries<Given>(data.examples).map(([name, given]) => html("button",
      { class: "example", id: `example-${name}`, click: () => this.show(given) },
      this.picture(given), html("span", {}, words.say(`example-${name}`))));
    const start = [
      html("section", { class: "hello", "aria-label": words.say("build") },
        html("h2", {}, words.say("build")), html("p", { class: "note" },
          words.say(matchMedia("(pointer: coarse)").matches ? "build-tap" : "build-how")),
        begin),
      sketch,
      html("section", { class: "float examples", "aria-label": words.say("examples") },
        html("h2", {}, words.say("examples")), html("div", { class: "row" }, ...examples)),
    ];
    home.append(...start);
    this.stage.home.append(sketch);
    return start;
  }

  /** Begin with a scene. */
  show(given: Given) {
    this.lab.asked = "";
    this.lab.replace(given);
    this.stage.fit();
    this.stage.fitted = false;
    document.getElementById("play")?.focus();
  }

  /** A small picture of a scene: its surfaces, and its first particles. */
  picture(given: Given) {
    const drawn = svg("svg", { viewBox: `0 0 ${WIDE} ${HIGH}`, class: "thumb surfaces", "aria-hidden": "true" });
    const scene = resolve(given, this.lab.data), machine = build(scene), view = new View();
    view.resize(WIDE, HIGH);
    view.free = { left: 0, top: 0, right: WIDE, bottom: HIGH };
    view.fit(boxOf(machine, []), 8);
    const scenery = new Scenery(view, this.words);
    scenery.draw(machine, scene);
    drawn.append(scenery.layer);
    machine.releases.slice(0, MOST_BALLS).forEach(({ x, y, stream, angle, t }, i) => {
      if (t > 0.5) return;
      const corners = cornersOf(machine, i, { x, y }, angle), own = { class: `kind-${stream % 5}` };
      drawn.append(corners.length ? svg("polygon", { ...own, points: corners.map(([u, v]) =>
        `${view.px(u)},${view.py(v)}`).join(" ") })
        : svg("circle", { cx: view.px(x), cy: view.py(y), ...own,
          r: Math.max(1.6, machine.radius[i] * view.scale) }));
    });
    return drawn;
  }

  /** While the scene is empty, the page says how to begin. */
  refresh() {
    const { given } = this.lab, { classList } = document.documentElement;
    const bare = Boolean(this.start) && Object.keys(given ?? {}).every((key) =>
      ["title", "stream", "view"].includes(key)) && given?.stream?.length === 0;
    if (bare !== classList.contains("bare")) {
      classList.toggle("bare", bare);
      this.open(bare || this.bench.mode !== null);
      this.stage.resize();
    }
    classList.toggle("still", given !== undefined && isBare(given));
    for (const [part, tile] of this.tiles) {
      if (part.places.length) continue;
      tile.disabled = given?.[part.table] !== undefined;
    }
  }
}

export { Palette };
