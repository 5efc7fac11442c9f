// Things to take along: a link, the scene, the picture, tables; and the address with the changes.

import { toToml } from "./keys.ts";
import { pictureOf } from "./film.ts";
import { numbersOf } from "./numbers.ts";
import { card, html, menuOf } from "./panels.ts";
import { predict } from "./prediction.ts";
import { Fault, type Given, type Scene } from "./scene.ts";
import { download, fileStem, fromHash, knotRows, toCsv, toHash } from "./share.ts";
import { historyOf } from "./stages.ts";
import { isBare, type Lab } from "./lab.ts";
import type { Recording } from "./recording.ts";
import type { Stage } from "./stage.ts";
import type { Words } from "./words.ts";

class Keep {
  comma;
  said;

  constructor(home: Element, readonly stage: Stage, readonly lab: Lab, readonly words: Words) {
    this.comma = html("input", { type: "checkbox", id: "comma" });
    this.comma.checked = words.comma;
    this.said = html("p", { class: "note", role: "status" });
    const button = (id: string, click: () => void, reveals = false) =>
      html("button", { class: reveals ? "reveals" : "", click }, words.say(id));
    // In a lesson the step defines the machine.
    const { lesson } = lab.data, hasAddress = !lesson && /^(https?|file):$/.test(location.protocol);
    const head = (id: string) => (lesson ? [] : [html("p", {}, words.say(id))]);
    const take = hasAddress ? [...head("share-link"), html("div", { class: "row" },
      button("copy-link", () => this.copy(location.href)),
      button("copy-embed", () => this.copy(this.frame)))] : [];
    const files = [...head("share-file"), html("div", { class: "row" },
      button("save-scene", () => {
        const bare = isBare(lab.given as Given);
        this.said.textContent = bare ? words.say("save-needs-ball") : "";
        if (!bare) this.save("toml", this.toml, "application/toml");
      }),
      button("save-picture", () => this.picture()),
      button("save-knots", () => this.table("knots", knotRows(this.recording)), true),
      button("save-numbers", () => this.table("numbers", this.numbers), true),
      html("label", { class: "check" }, this.comma, ` ${words.say("decimal-comma")}`)), this.said];
    if (lesson) home.append(card("share", words.say("share"), ...files));
    else {
      document.getElementById("keys")?.before(
        menuOf("share", "share", words.say("share"), ...take, ...files));
    }
    lab.on("scene", () => this.follow());
    if (lab.data.lesson) return;
    addEventListener("hashchange", () => this.open());
    this.open();
  }

  get recording() {
    return this.lab.recording as Recording;
  }

  get toml() {
    return toToml(this.lab.given as Given);
  }

  get numbers(): (string | number)[][] {
    const { lab, words } = this, machine = lab.machine as any;
    const { numbers } = predict(lab.scene as Scene, this.recording);
    const found = numbersOf(historyOf(lab)?.stages ?? [], numbers,
      machine.pulley?.radius ?? NaN, machine.radius);
    return [["", words.say("simulated"), words.say("analytic"), ""],
      ...found.map(({ id, simulated, analytic }) => {
        const { symbol, unit } = lab.data.quantities[id];
        return [symbol, simulated, analytic, words.unit(unit)];
      })];
  }

  /** Take over the scene of the address, if it is valid. */
  open() {
    const { lab } = this, { hash } = location;
    if (hash === this.hash || (hash.length < 2 && !this.hash)) return;
    this.hash = hash;
    const given = hash.length < 2 ? lab.first : fromHash(lab.first, hash);
    if (given) lab.replace(given);
    else lab.refuse(new Fault("", hash, "address"));
  }

  hash = "";

  told: object | undefined;

  /** Finished changes go into the address, and are reported to a page around this one. */
  follow() {
    const { lab } = this, { given } = lab;
    if (!given || lab.before || this.told === given) return;
    const first = !this.told && given === lab.first;
    this.told = given;
    if (first) return;
    this.hash = toHash(lab.first, given);
    if (!lab.data.lesson) try {
      history.replaceState(null, "", this.hash || location.href.replace(/#.*/s, ""));
    } catch {
      // A page without its own address, such as a frame's text, has none to change.
    }
    if (parent !== window) parent.postMessage({ chutelab: "scene", toml: this.toml }, "*");
  }

  /** HTML that shows this machine within another page. */
  get frame() {
    const { href, protocol } = location, frame = html("iframe", {
      // A page beside this one finds it by its name.
      src: protocol === "file:" ? href.replace(/^[^#]*\//, "") : href,
      title: this.lab.scene?.title ?? "", width: "100%", height: "640",
      allow: "fullscreen; clipboard-write",
    });
    return frame.outerHTML;
  }

  async copy(text: string) {
    try {
      await navigator.clipboard.writeText(text);
      this.said.textContent = this.words.say("copied");
    } catch {
      prompt(this.words.say("share"), text);
    }
  }

  save(ending: string, content: BlobPart, type: string) {
    const scene = this.lab.scene as Scene;
    download(`${fileStem(scene.title)}.${ending}`, content, type);
  }

  table(name: string, rows: (string | number)[][]) {
    // The mark shows spreadsheets that it is Unicode.
    this.save(`${name}.csv`, `\ufeff${toCsv(rows, this.comma.checked)}`, "text/csv");
  }

  /** The picture as it is now. */
  async picture() {
    const canvas = await pictureOf(this.stage);
    canvas.toBlob((blob) => { if (blob) this.save("png", blob, "image/png"); }, "image/png");
  }
}

export { Keep };
