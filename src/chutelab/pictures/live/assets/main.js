// Sliders and clock: what is shown, and when.

const SPEEDS = [0.01, 0.02, 0.05, 0.1, 0.2, 0.5, 1, 2];
const WATCHED = 4; // s on the screen that a run takes at first, at least
const QUIET = 350; // ms without a change before it is read out

const calm = window.matchMedia("(prefers-reduced-motion: reduce)");
const picture = new Film();
const energies = new Energies();
const numbers = new Numbers();
const inputs = [];
const shown = { strobe: true, parabola: true, arrows: true };
const state = { variant: variants[0], t: 0, playing: false, speed: 1 };
let frame = 0;
let announcement = 0;

const sizes = data.sliders.map((slider) => slider.values.length);
const indexOf = (positions) => positions.reduce((index, p, axis) => index * sizes[axis] + p, 0);
const positionsOf = (index) =>
  sizes.map((_, axis) => {
    const below = sizes.slice(axis + 1).reduce((a, b) => a * b, 1);
    return Math.floor(index / below) % sizes[axis];
  });
const valuesOf = (index) => positionsOf(index).map((p, axis) => data.sliders[axis].values[p]);

function buildSliders() {
  data.sliders.forEach((slider, axis) => {
    const id = `slider-${axis}`;
    const key = element("small", { textContent: slider.key });
    const label = element("label", { htmlFor: id }, `${slider.label} `, key);
    const output = element("output", { htmlFor: id });
    const input = element("input", {
      type: "range", id, min: 0, max: slider.values.length - 1, step: 1,
    });
    input.value = slider.start;
    input.disabled = slider.values.length < 2;
    input.addEventListener("input", vary);
    inputs.push({ input, output });
    byId("sliders").append(element("div", { className: "slider" }, label, output, input));
  });
}

/** Take over the positions of the sliders. */
function vary() {
  const positions = inputs.map(({ input }) => Number(input.value));
  const variant = variants[indexOf(positions)];
  const before = state.variant;
  state.variant = variant;
  inputs.forEach(({ input, output }, axis) => {
    const { values, unit } = data.sliders[axis];
    const text = withUnit(brief(values[positions[axis]]), unit);
    output.textContent = text;
    input.setAttribute("aria-valuetext", text);
  });
  if (variant.offsets) {
    // Who looks at the end goes on looking at the end.
    const wasAtEnd = before.offsets && before !== variant && state.t >= before.span[1];
    state.t = wasAtEnd ? variant.span[1] : within(state.t, variant.span);
  }
  numbers.show(variant.index);
  byId("refused").hidden = !variant.fault;
  byId("caption").hidden = Boolean(variant.fault);
  byId("refused").firstElementChild.textContent = variant.fault
    ? `No run at this position: ${variant.fault}.${variant.offsets ? " Shown without the outgoing belt." : ""}`
    : "";
  byId("reason").hidden = !variant.reason || Boolean(variant.fault);
  const parabola = variant.arcs?.length ? "The analytic parabola ends early" : "No analytic parabola";
  byId("reason").textContent = variant.reason ? `${parabola}: ${variant.reason}.` : "";
  byId("strobe-step").textContent = variant.strobe ? `every ${brief(variant.strobe)} s` : "";
  clearTimeout(announcement);
  const text = summaryOf(variant, valuesOf(variant.index));
  announcement = setTimeout(() => { byId("summary").textContent = text; }, byId("summary").textContent ? QUIET : 0);
  redraw();
}

const within = (t, [low, high]) => Math.min(Math.max(t, low), high);

function redraw() {
  picture.still(state.variant, shown);
  show();
}

function show() {
  const { variant, t } = state;
  picture.show(variant, t, shown);
  energies.show(variant, t);
  const time = byId("time");
  const [begin, end] = variant.span || [0, 0];
  time.disabled = !variant.offsets;
  time.value = end > begin ? Math.round((1000 * (t - begin)) / (end - begin)) : 0;
  time.setAttribute("aria-valuetext", `${t.toFixed(3)} s`);
  byId("clock").textContent = variant.offsets ? `${t.toFixed(3)} s` : "–";
  caption();
}

function caption() {
  const { variant, t } = state;
  let last = null;
  for (const event of variant.events || []) if (event[0] <= t) last = event;
  const id = last ? last[0] + last[2] : "";
  if (byId("caption").dataset.said === id) return;
  byId("caption").dataset.said = id;
  if (!last) {
    const rides = (variant.events || []).some(([, kind]) => kind === "separation");
    byId("caption").replaceChildren(rides ? "rides the incoming belt" : "");
    return;
  }
  const [what, ...more] = last[2].split("\n");
  byId("caption").replaceChildren(
    element("b", { textContent: `${last[0].toFixed(3)} s` }), what,
    ...more.map((line) => element("span", { textContent: line })),
  );
}

function seek(t) {
  if (!state.variant.offsets) return;
  state.t = within(t, state.variant.span);
  show();
}

function play(on) {
  const { variant } = state;
  if (!variant.offsets) on = false;
  if (on === state.playing) return;
  state.playing = on;
  byId("play").classList.toggle("playing", on);
  byId("play").setAttribute("aria-label", on ? "Pause" : "Play");
  cancelAnimationFrame(frame);
  if (!on) return;
  if (state.t >= variant.span[1]) state.t = variant.span[0];
  let then = null;
  const tick = (now) => {
    if (!state.playing) return;
    then ??= now;
    // Calm readers get a still picture every half second instead of a film.
    if (!calm.matches || now - then >= 500) {
      const step = calm.matches ? state.variant.strobe || 0 : (state.speed * (now - then)) / 1000;
      then = now;
      seek(state.t + step);
    }
    if (!state.variant.offsets || state.t >= state.variant.span[1]) play(false);
    else frame = requestAnimationFrame(tick);
  };
  frame = requestAnimationFrame(tick);
}

/** Move the sliders to the nearest variant without a fault. */
function toNearest() {
  const here = positionsOf(state.variant.index);
  let best = null;
  for (const variant of variants) {
    if (variant.fault) continue;
    const there = positionsOf(variant.index);
    const far = there.reduce((most, p, axis) => most + Math.abs(p - here[axis]), 0);
    if (!best || far < best.far) best = { far, there };
  }
  best.there.forEach((p, axis) => { inputs[axis].input.value = p; });
  vary();
}

async function copy() {
  const text = numbers.text(valuesOf(state.variant.index), state.variant.index);
  let done = true;
  try {
    await navigator.clipboard.writeText(text);
  } catch {
    const area = document.body.appendChild(element("textarea", { value: text, className: "hidden" }));
    area.select();
    done = document.execCommand("copy");
    area.remove();
    byId("copy").focus();
  }
  byId("copied").textContent = done ? "copied" : "could not be copied";
  setTimeout(() => { byId("copied").textContent = ""; }, 2500);
}

function download() {
  // The mark at the beginning tells spreadsheets that it is UTF-8.
  const blob = new Blob(["\ufeff", numbers.csv(valuesOf)], { type: "text/csv" });
  const link = element("a", { href: URL.createObjectURL(blob), download: "chutelab.csv" });
  link.click();
  setTimeout(() => URL.revokeObjectURL(link.href), 1000);
}

function listen() {
  byId("play").addEventListener("click", () => play(!state.playing));
  byId("back").addEventListener("click", () => step(-1));
  byId("forward").addEventListener("click", () => step(1));
  byId("first").addEventListener("click", () => seek(-Infinity));
  byId("last").addEventListener("click", () => seek(Infinity));
  byId("time").addEventListener("input", (event) => {
    play(false);
    const [begin, end] = state.variant.span;
    seek(begin + ((end - begin) * event.target.value) / 1000);
  });
  byId("speed").addEventListener("change", (event) => setSpeed(event.target.selectedIndex));
  for (const name of Object.keys(shown)) {
    byId(name).addEventListener("change", (event) => {
      shown[name] = event.target.checked;
      redraw();
    });
  }
  byId("copy").addEventListener("click", copy);
  byId("download").addEventListener("click", download);
  byId("refused").querySelector("button").addEventListener("click", toNearest);
  document.addEventListener("keydown", onKey);
  window.matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () => {
    picture.colour = colours();
    redraw();
  });
  new ResizeObserver(() => {
    picture.resize();
    redraw();
  }).observe(canvas.parentElement);
  listenToTouch();
}

for (const speed of SPEEDS) {
  const text = speed < 1 ? `1/${Math.round(1 / speed)}` : `${speed} ×`;
  byId("speed").append(element("option", { textContent: speed === 1 ? "real time" : text }));
}
byId("parabola").parentElement.hidden = !variants.some(({ arcs }) => arcs?.length);
buildSliders();
picture.resize();
vary();
if (state.variant.span) state.t = state.variant.span[0];
const [from, to] = state.variant.span || [0, 1];
setSpeed(SPEEDS.filter((speed) => (to - from) / speed >= WATCHED).length - 1);
byId("about").textContent = `Computed by the ${data.engine.join(" and ")} engine.`;
listen();
show();

// Read only, for whoever wants to check the page.
window.chutelab = Object.freeze({
  get state() {
    const { variant, t, playing, speed } = state;
    const landed = (variant.events || []).find(([, kind]) => kind === "landing");
    return {
      values: valuesOf(variant.index),
      fault: variant.fault,
      t, playing, speed,
      span: variant.span ? [...variant.span] : null,
      shown: { ...shown },
      position: variant.offsets ? stateAt(variant, 0, t) : null,
      landing: landed ? { t: landed[0], ...stateAt(variant, 0, landed[0]) } : null,
      energy: variant.offsets && !variant.fault ? booksAt(variant, t) : null,
    };
  },
  at: (t, particle = 0) => (state.variant.offsets ? stateAt(state.variant, particle, t) : null),
  energyAt: (t) => (state.variant.offsets ? booksAt(state.variant, t) : null),
});
