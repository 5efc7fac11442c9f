"""Every step of every lesson, as it looks: nothing overlaps, is cut off, pale or too small.

Each view is also a picture in the test's own folder: `pytest --basetemp=DIR` keeps them.
"""

import pytest

from chutelab.classroom.lessons.pages import live_page
from live.browser import DONE
from shared import find, lessons

DESK, WALL, PHONE = (1366, 768), (1920, 1080), (390, 844)

QUICK = [("letting-go", PHONE, "dark", "de")]
WHOLE = [
    (one.name, size, scheme, language)
    for one in lessons()
    for size in (DESK, WALL, PHONE)
    for scheme, language in (("light", "de"), ("dark", "en"))
]

# A step as it is opened first (`done` is false), or after all in it was done: wrong answers, a full
# table, a hint and a reply to each question.
STEP = """([n, done]) => {
  const { lesson } = chutelab, { steps } = lesson.lesson;
  lesson.kept.done = [...Array(n + done).keys()];
  if (done) {
    steps[n].asks.forEach(({ choices, right, mark, sketch }, k) => {
      lesson.kept.said[`${n}.${k}`] = choices.length ? right % choices.length : mark ? [0.3, -0.8]
        : sketch ? [[0, 0], [0.3, -0.2], [0.5, -0.7]] : "Words, and more words.";
      if (mark || sketch) lesson.kept.said[`${n}.${k}.off`] = 0.123;
    });
    const { rows, free, columns } = steps[n];
    lesson.kept.runs[n] = Array.from({ length: columns.length && rows.length + free }, (_, k) => ({
      set: rows[k]?.set ?? {}, values: columns.map(() => -0.04567891) }));
  }
  lesson.go(n);
  for (const question of done ? document.querySelectorAll(".question") : []) {
    question.open = true;
    question.querySelector("input").value = "-1,5";
    for (const name of [".check", ".hint"]) question.querySelector(name).click();
  }
}"""

# What is wrong with what is seen now, in words.
FAULTS = """() => {
  // What is too wide for it widens the window of a phone, which shows it smaller.
  const found = [], { innerHeight } = window, innerWidth = document.documentElement.clientWidth;
  const called = ({ tagName, id, classList, textContent }) => `<${tagName.toLowerCase()}`
    + `${id ? `#${id}` : ""}${classList.length ? `.${classList[0]}` : ""}> `
    + `${(textContent || "").trim().slice(0, 40)}`;
  const style = (one) => getComputedStyle(one);
  const ancestors = function* (one) { for (; one; one = one.parentElement) yield one; };
  const isSeen = (one) => one.checkVisibility({ opacityProperty: true, visibilityProperty: true })
    && ![...ancestors(one)].some((up) => style(up).clipPath !== "none" || up.tagName === "DEFS");
  // What stays while the page scrolls lies above it.
  const held = (one) => [...ancestors(one)].find((up) =>
    ["fixed", "sticky"].includes(style(up).position));
  /** What of a box is seen: within all that scrolls or cuts. */
  const clipped = (box, one) => {
    let [left, top, right, bottom] = [box.left, box.top, box.right, box.bottom];
    for (const up of ancestors(one)) {
      if (style(up).overflowX === "visible" && style(up).overflowY === "visible") continue;
      if (up === document.documentElement || up === document.body) continue;
      const its = up.getBoundingClientRect();
      [left, right] = [Math.max(left, its.left), Math.min(right, its.right)];
      [top, bottom] = [Math.max(top, its.top), Math.min(bottom, its.bottom)];
    }
    return { left, top, right, bottom };
  };
  const isThere = ({ left, top, right, bottom }) => right - left > 1 && bottom - top > 1;

  const walker = document.createTreeWalker(document.body, NodeFilter.SHOW_TEXT), texts = [];
  while (walker.nextNode()) {
    const node = walker.currentNode, one = node.parentElement;
    const silent = "script, style, template, noscript, option, title, defs";
    if (!node.textContent.trim() || one.closest(silent) || !isSeen(one)) continue;
    const range = document.createRange();
    range.selectNodeContents(node);
    for (const box of range.getClientRects()) {
      const { left, top, right, bottom } = box;
      if (right - left < 1) continue;
      // A line of text is less high than its box.
      const trim = 0.2 * (bottom - top);
      const line = { left, right, top: top + trim, bottom: bottom - trim };
      texts.push({ one, line, seen: clipped(line, one), held: held(one) });
    }
  }

  // Nothing is cut off sideways but what scrolls, and nothing sticks out of the page.
  if (document.documentElement.scrollWidth > innerWidth) found.push("the page scrolls sideways");
  for (const { one, line, seen } of texts) {
    const scrolls = [...ancestors(one)].some((up) =>
      ["auto", "scroll"].includes(style(up).overflowX) && up.scrollWidth > up.clientWidth);
    if (line.right > innerWidth + 1 && !scrolls) found.push(`sticks out: ${called(one)}`);
    if (isThere(seen) && seen.right < line.right - 2 && !scrolls) {
      found.push(`cut off: ${called(one)}`);
    }
    if (parseFloat(style(one).fontSize) < (one.closest("math, sub, sup, svg") ? 9 : 12.5)) {
      found.push(`small type, ${style(one).fontSize}: ${called(one)}`);
    }
  }
  if (innerWidth > 1300) {
    for (const one of document.querySelectorAll(".wide, .page > table")) {
      const over = one.scrollWidth - one.clientWidth;
      if (over > 0) found.push(`too wide by ${over} px: ${called(one)}`);
    }
  }

  // No text lies on another, and none on a button or a field that it is not in.
  const kinds = "button, input, select, textarea, summary";
  const controls = [...document.querySelectorAll(kinds)].filter(isSeen);
  const boxes = controls.map((one) => ({ one, line: one.getBoundingClientRect(),
    seen: clipped(one.getBoundingClientRect(), one), held: held(one) }));
  const all = [...texts, ...boxes].filter(({ seen }) => isThere(seen));
  all.forEach((a, n) => {
    for (const b of all.slice(n + 1)) {
      if (a.held !== b.held || a.one.contains(b.one) || b.one.contains(a.one)) continue;
      if (a.one.closest("math") && a.one.closest("math") === b.one.closest("math")) continue;
      const wide = Math.min(a.seen.right, b.seen.right) - Math.max(a.seen.left, b.seen.left);
      const high = Math.min(a.seen.bottom, b.seen.bottom) - Math.max(a.seen.top, b.seen.top);
      if (wide > 1.5 && high > 1.5) found.push(`${called(a.one)} lies on ${called(b.one)}`);
    }
  });

  // Text stands out from what is behind it.
  const canvas = document.createElement("canvas").getContext("2d", { willReadFrequently: true });
  const rgba = (color) => {
    canvas.clearRect(0, 0, 1, 1);
    canvas.fillStyle = color;
    canvas.fillRect(0, 0, 1, 1);
    return [...canvas.getImageData(0, 0, 1, 1).data];
  };
  const light = (color) => color.slice(0, 3).map((part) => part / 255)
    .map((part) => (part <= 0.04045 ? part / 12.92 : ((part + 0.055) / 1.055) ** 2.4))
    .reduce((sum, part, n) => sum + part * [0.2126, 0.7152, 0.0722][n], 0);
  const behind = (one) => {
    for (const up of ancestors(one)) {
      const color = rgba(style(up).backgroundColor);
      if (color[3] > 250) return color;
    }
    return rgba(style(document.documentElement).getPropertyValue("--stage"));
  };
  for (const { one } of texts) {
    // What cannot be used may be pale; in the picture a halo is behind each text.
    if (one.closest(":disabled, [aria-disabled=true], label:has(:disabled)")) continue;
    const inPicture = one.closest("svg"), { color, fill, fontSize, fontWeight } = style(one);
    const [a, b] = [rgba(inPicture ? fill : color), behind(one)].map(light);
    const ratio = (Math.max(a, b) + 0.05) / (Math.min(a, b) + 0.05), size = parseFloat(fontSize);
    const isLarge = size >= 24 || (size >= 18.66 && Number(fontWeight) >= 700);
    if (!one.closest(".machine, .beds") && ratio < (isLarge ? 3 : 4.5)) {
      found.push(`contrast ${ratio.toFixed(2)}: ${called(one)}`);
    }
  }

  // What is pressed is large enough for a pointer, and for a finger.
  const least = matchMedia("(pointer: coarse)").matches ? 44 : 24;
  for (const one of [...controls, ...document.querySelectorAll("[role=slider]:not(svg *)")]) {
    const target = ["radio", "checkbox"].includes(one.type) ? one.closest("label") ?? one : one;
    if (!isSeen(one) || one.disabled) continue;
    const { width, height } = target.getBoundingClientRect();
    // The rail of a slider is pressed above and below it, too.
    if (width < least - 0.5 || (height < least - 0.5 && one.type !== "range")) {
      found.push(`${width.toFixed(0)} x ${height.toFixed(0)} px: ${called(one)}`);
    }
  }
  return [...new Set(found)];
}"""


@pytest.mark.slow
@pytest.mark.parametrize(
    ("name", "size", "scheme", "language"),
    [*QUICK, *(pytest.param(*one, marks=pytest.mark.slow) for one in WHOLE if one not in QUICK)],
)
def test_a_step_is_seen_whole(name, size, scheme, language, opened, tmp_path):
    lesson = find(name, language)
    path = tmp_path / "page.html"
    live_page(lesson, path)
    view, is_phone = {"width": size[0], "height": size[1]}, size == PHONE
    page = opened(path, viewport=view, color_scheme=scheme, has_touch=is_phone, is_mobile=is_phone)
    page.evaluate(DONE)
    found = {"start": page.evaluate(FAULTS)}
    page.screenshot(path=tmp_path / "0.png")
    page.locator("#student").fill("Ada")
    page.keyboard.press("Enter")
    for n, step in enumerate(lesson.steps):
        for done in (0, 1):
            page.evaluate(STEP, [n, done])
            page.evaluate(DONE)
            page.screenshot(path=tmp_path / f"{n + 1}-{step.kind}-{done}.png")
            found[f"{n + 1}. {step.kind}, {done}"] = page.evaluate(FAULTS)
            if is_phone:
                page.evaluate("scrollTo(0, 1e6)")
                page.screenshot(path=tmp_path / f"{n + 1}-{step.kind}-{done}-end.png")
                found[f"{n + 1}. {step.kind}, {done}, its end"] = page.evaluate(FAULTS)
    assert {view: said for view, said in found.items() if said} == {}
