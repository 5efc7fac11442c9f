"""Every shipped scene on a notebook, a projector and a phone, light and dark: what is seen there.

No label lies on another or under a card, none is cut, no text reaches into a card's margin. All
text can be told from its ground (4.5:1), everything that is pressed is large enough, and the bar of
the scale lies where nothing is.
"""

from io import BytesIO

import numpy as np
import pytest
from PIL import Image

from chutelab.scene import shipped
from live.browser import DONE

SIZES = {"wide": [(1366, 768), (1920, 1080)], "phone": [(390, 844)]}

SAMPLE = {("phone", "mixture")}
"""What is looked at in every run of the tests; all others are slow."""

# Show a time in the middle of the run, or of what is computed of it.
MIDDLE = """() => new Promise((done) => {
  const { lab } = chutelab;
  lab.seek(lab.start + 0.7 * (lab.end - lab.start));
  setTimeout(done, 120);
})"""

SEEN = """() => {
  const box = (one) => {
    const { left, right, top, bottom } = one.getBoundingClientRect();
    return [left, right, top, bottom];
  };
  const all = (which, home = document) => [...home.querySelectorAll(which)]
    .filter((one) => one.checkVisibility({ visibilityProperty: true, opacityProperty: true }));
  const inside = ([left, right, top, bottom]) =>
    left < innerWidth && right > 0 && top < innerHeight && bottom > 0;
  const rgb = (colour) => colour.match(/[\\d.]+/g).map(Number);
  const light = (colour) => {
    const [r, g, b] = rgb(colour).map((part) => part / 255)
      .map((part) => (part <= 0.04045 ? part / 12.92 : ((part + 0.055) / 1.055) ** 2.4));
    return 0.2126 * r + 0.7152 * g + 0.0722 * b;
  };
  const contrast = (a, b) =>
    (Math.max(light(a), light(b)) + 0.05) / (Math.min(light(a), light(b)) + 0.05);
  const ground = (one) => {
    for (let at = one; at; at = at.parentElement) {
      const { backgroundColor } = getComputedStyle(at);
      if ((rgb(backgroundColor)[3] ?? 1) === 1) return backgroundColor;
    }
    return "rgb(255, 255, 255)";
  };
  const stage = document.querySelector("#stage");
  const labels = all("text", stage).map((one) => [one.textContent, box(one),
    contrast(getComputedStyle(one).fill, one.matches(".on-frame")
      ? getComputedStyle(all(".frame", one.parentElement)[0]).fill : ground(stage))])
    .filter(([, place]) => inside(place));
  const own = (one) => [...one.childNodes].some((node) => node.nodeType === 3
    && node.textContent.trim());
  const texts = all("body *:not(svg *, script, style, option, noscript, .hidden)")
    .filter(own);
  const scale = document.querySelector(".scale path:last-of-type");
  const bodies = all(".belt, .wall, rect.steel", stage).flatMap((shape) => {
    const long = shape.getTotalLength(), matrix = shape.getScreenCTM();
    const many = Math.min(400, Math.ceil(long / 8));
    return Array.from({ length: many + 1 }, (_, n) => {
      const { x, y } = shape.getPointAtLength((n * long) / many).matrixTransform(matrix);
      return [x, y];
    });
  });
  const [left, right, top, bottom] = box(scale);
  return {
    labels,
    dim: [...labels.map(([name, , told]) => [name, told]), ...texts
      .filter((one) => !one.matches(":disabled"))
      .map((one) => [one.textContent, contrast(getComputedStyle(one).color, ground(one))])]
      .filter(([, told]) => told < 4.5),
    cut: texts.filter((one) => getComputedStyle(one).overflow !== "visible"
      || one.matches("button, summary, td, th"))
      .filter(({ scrollWidth, clientWidth, scrollHeight, clientHeight }) =>
        clientWidth && (scrollWidth > clientWidth + 1 || scrollHeight > clientHeight + 4))
      .map((one) => [one.tagName, one.textContent]),
    out: all("#panels .body").flatMap((body) => {
      const right = box(body)[1] - parseFloat(getComputedStyle(body).paddingRight);
      return all(":not(:has(*), svg *, .wide *, option)", body)
        .map((one) => [one.textContent, box(one)[1] - right]).filter(([, far]) => far > 0.6);
    }),
    cards: all(".float, #panels, .dock").filter((one) => !one.closest(".drawer"))
      .map((one) => [one.className || one.id, box(one)]),
    small: all("button, select, summary, label:has([type=checkbox]), input:not([type=checkbox])")
      .map((one) => [one.id || one.textContent, box(one)])
      .map(([name, [west, east, north, south]]) => [name, east - west, south - north])
      .filter(([, wide, high]) => wide > 0 && Math.min(wide, high) < TARGET),
    met: scale && bodies.filter(([x, y]) => x > left - 2 && x < right + 2 && y > top - 22
      && y < bottom + 2).length,
    wide: document.documentElement.scrollWidth - innerWidth,
  };
}"""


def overlap(one, other):
    """By how many pixels two boxes (left, right, top, bottom) overlap; negative apart."""
    return min(
        min(one[1], other[1]) - max(one[0], other[0]),
        min(one[3], other[3]) - max(one[2], other[2]),
    )


@pytest.mark.parametrize(
    ("kind", "name"),
    [
        pytest.param(kind, name, marks=() if (kind, name) in SAMPLE else pytest.mark.slow)
        for kind in SIZES
        for name in shipped()
    ],
)
def test_what_is_seen_of_each_scene(shown, kind, name, tmp_path):
    touch = kind == "phone"
    sizes = SIZES[kind]
    options = {"has_touch": touch, "is_mobile": touch}
    view = {"width": sizes[0][0], "height": sizes[0][1]}
    # German words are longer.
    page = shown(name, viewport=view, language="de", **options)
    faults = []
    for width, height in sizes:
        page.set_viewport_size({"width": width, "height": height})
        page.evaluate(DONE)
        page.evaluate(MIDDLE)
        for scheme in ("light", "dark"):
            page.emulate_media(color_scheme=scheme)
            found = page.evaluate(SEEN.replace("TARGET", "43.9" if touch else "24"))
            shot = tmp_path / f"{name}-{width}-{scheme}.png"
            page.screenshot(path=shot)
            image = np.asarray(Image.open(BytesIO(shot.read_bytes())).convert("L")).astype(int)
            told = [(key, found[key]) for key in ("dim", "cut", "out", "small") if found[key]]
            if found["met"]:
                told.append(("scale", found["met"]))
            if found["wide"] > 0:
                told.append(("wide", found["wide"]))
            if np.ptp(image) < 150:
                told.append(("blank", int(np.ptp(image))))
            labels = found["labels"]
            for n, (text, place, _) in enumerate(labels):
                # A line of text is taller than its letters.
                told += [
                    ("labels", text, other)
                    for other, there, _ in labels[n + 1 :]
                    if overlap(place, there) > 5.0
                ]
                told += [
                    ("covered", text, card)
                    for card, there in found["cards"]
                    if 3.0 < overlap(place, there) < place[1] - place[0] - 1.0
                ]
            cards = found["cards"]
            told += [
                ("cards", one, other)
                for n, (one, place) in enumerate(cards)
                for other, there in cards[n + 1 :]
                if overlap(place, there) > 1.0
            ]
            faults += [(width, scheme, *each) for each in told]
    assert not faults, "\n".join(map(str, faults))
