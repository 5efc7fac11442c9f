// Keyboard and touch.

const STEPS = 60; // steps from beginning to end

function step(direction) {
  play(false);
  const [begin, end] = state.variant.span || [0, 0];
  seek(state.t + (direction * (end - begin)) / STEPS);
}

function toEvent(direction) {
  play(false);
  const { variant, t } = state;
  if (!variant.offsets) return;
  const times = [...variant.events.map(([at]) => at), ...variant.span].sort((a, b) => a - b);
  const ahead = times.filter((at) => (direction > 0 ? at > t + 1e-9 : at < t - 1e-9));
  if (ahead.length) seek(direction > 0 ? ahead[0] : ahead[ahead.length - 1]);
}

function nudge(axis, direction) {
  if (!inputs[axis]) return;
  const { input } = inputs[axis];
  input.value = Number(input.value) + direction;
  vary();
}

function setSpeed(index) {
  const at = Math.min(Math.max(index, 0), SPEEDS.length - 1);
  byId("speed").selectedIndex = at;
  state.speed = SPEEDS[at];
}

function toggle(name) {
  const box = byId(name);
  box.checked = !box.checked;
  shown[name] = box.checked;
  redraw();
}

const KEYS = {
  " ": () => play(!state.playing),
  ArrowLeft: (event) => (event.shiftKey ? toEvent(-1) : step(-1)),
  ArrowRight: (event) => (event.shiftKey ? toEvent(1) : step(1)),
  Home: () => seek(-Infinity),
  End: () => seek(Infinity),
  ArrowUp: () => nudge(0, 1),
  ArrowDown: () => nudge(0, -1),
  ".": () => nudge(1, 1),
  ",": () => nudge(1, -1),
  "+": () => setSpeed(byId("speed").selectedIndex + 1),
  "-": () => setSpeed(byId("speed").selectedIndex - 1),
  s: () => toggle("strobe"),
  p: () => toggle("parabola"),
  v: () => toggle("arrows"),
};
const OF_SLIDERS = ["ArrowLeft", "ArrowRight", "ArrowUp", "ArrowDown", "Home", "End"];

function onKey(event) {
  if (event.ctrlKey || event.metaKey || event.altKey) return;
  const at = event.target;
  if (event.key === " " && at.closest("button, summary, select, input[type=checkbox]")) return;
  if (OF_SLIDERS.includes(event.key) && at.closest("input[type=range], select, .scroll")) return;
  if (at.closest("select") && event.key.length === 1) return;
  const action = KEYS[event.key.length === 1 ? event.key.toLowerCase() : event.key];
  if (!action) return;
  event.preventDefault();
  action(event);
}

/** A tap plays or pauses; a drag across the scene goes through time. */
function listenToTouch() {
  let down = null;
  canvas.addEventListener("pointerdown", (event) => {
    if (event.button !== 0) return;
    down = { x: event.clientX, t: state.t, moved: false };
    canvas.setPointerCapture(event.pointerId);
  });
  canvas.addEventListener("pointermove", (event) => {
    if (!down || !state.variant.offsets) return;
    const across = event.clientX - down.x;
    if (!down.moved && Math.abs(across) < 8) return;
    down.moved = true;
    play(false);
    const [begin, end] = state.variant.span;
    seek(down.t + ((end - begin) * across) / canvas.clientWidth);
  });
  canvas.addEventListener("pointerup", () => {
    if (down && !down.moved) play(!state.playing);
    down = null;
  });
  canvas.addEventListener("pointercancel", () => { down = null; });
}
