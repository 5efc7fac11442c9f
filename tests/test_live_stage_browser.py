"""The picture of the live page: where it lies, what is grabbed in it, what it looks like."""

import math
import re
from io import BytesIO

import numpy as np
import pytest
from PIL import Image

from chutelab.scene import load
from live.browser import DONE, spot
from shared import some

playwright = pytest.importorskip(
    "playwright.sync_api", reason='needs Playwright: pip install "chutelab[test]"'
)


def pixel(page, place):
    """The colour of a pixel of the window."""
    image = Image.open(BytesIO(page.screenshot())).convert("RGB")
    return image.getpixel(tuple(map(round, place)))


SCREEN = """([x, y]) => {
  const { view, front } = chutelab.stage, box = front.getBoundingClientRect();
  return [box.left + view.px(x), box.top + view.py(y)];
}"""


def drag(page, start, end):
    page.mouse.move(*start)
    page.mouse.down()
    # One move only: a slow machine tells many as one.
    page.mouse.move(*end)
    page.mouse.up()


@pytest.mark.slow
def test_a_plate_is_moved_by_its_body_and_a_line_keeps_its_shape(shown):
    line = '[[surface]]\nname = "chute"\npoints = [[0.7, -0.2], [0.8, -0.25], [0.9, -0.25]]\n'
    page = shown("inclined-40", more=line)
    given = page.evaluate("chutelab.lab.scene.plates[0].distance")
    angle = np.radians(40.0)
    # A place on the plate that is no handle: 0.3 m below its pivot at (R + d, 0).
    pivot = page.evaluate("chutelab.stage.handles.find(({ id }) => id === 'plate.pivot')")
    body = pivot["x"] + 0.3 * np.sin(angle), pivot["y"] - 0.3 * np.cos(angle)
    x, y = page.evaluate(SCREEN, body)
    scale = page.evaluate("chutelab.stage.view.scale")
    drag(page, (x, y), (x + 0.05 * scale, y))
    moved = page.evaluate("chutelab.lab.scene.plates[0]")
    assert moved["distance"] == pytest.approx(given + 0.05, abs=2.0 / scale)
    assert moved["angle_deg"] == 40.0
    assert page.locator("#edit select").input_value() == "plate"

    before = np.array(page.evaluate("chutelab.lab.scene.surface[0].points"))
    x, y = page.evaluate(SCREEN, [0.85, -0.25])
    drag(page, (x, y), (x - 40, y + 25))
    way = np.array(page.evaluate("chutelab.lab.scene.surface[0].points")) - before
    # All corners go the same way: that of the pointer, to a pixel's rounding.
    assert np.ptp(way, axis=0) == pytest.approx([0.0, 0.0], abs=1e-12)
    assert way[0] == pytest.approx([-40 / scale, -25 / scale], abs=2.0 / scale)
    page.click("#undo")
    assert np.array_equal(page.evaluate("chutelab.lab.scene.surface[0].points"), before)


@pytest.mark.slow
def test_the_first_view_has_both_pulleys_of_the_belt(page_of):
    """Where both are large: the other one is as large as that which drives."""
    page = page_of(12)
    left = """() => {
      const { segments: [belt], pulley } = chutelab.lab.machine;
      return [belt.x - pulley.radius, belt.y];
    }"""
    x, _ = page.evaluate(SCREEN, page.evaluate(left))
    assert x >= page.locator("#stage").bounding_box()["x"]


def frame(page):
    """The frame round what is chosen, on the screen; None without one."""
    box = page.locator("#stage").bounding_box()
    found = page.evaluate("chutelab.stage.frame")
    return found and [
        found["left"] + box["x"], found["top"] + box["y"],
        found["right"] + box["x"], found["bottom"] + box["y"],
    ]  # fmt: skip


def ends(page):
    """Of the lines that are put into a scene, m."""
    rows = page.evaluate("chutelab.lab.given.surface.filter(({ points }) => points)")
    return np.array([row["points"] for row in rows])


LINES = """
[[surface]]
name = "one"
points = [[0.3, -0.1], [0.5, -0.2]]
[[surface]]
name = "two"
points = [[-0.4, -0.2], [-0.1, -0.3]]
"""


@pytest.mark.slow
def test_several_are_chosen_by_a_frame_and_move_together_by_it(shown):
    page = shown("free-fall", more=LINES, viewport={"width": 1366, "height": 768})
    box = page.locator("#stage").bounding_box()
    free, before = page.evaluate("chutelab.stage.view.free"), ends(page)
    # Shift and drag over all of the picture: a frame meets what lies in it.
    page.keyboard.down("Shift")
    page.mouse.move(box["x"] + free["left"] + 4, box["y"] + free["top"] + 4)
    page.mouse.down()
    page.mouse.move(box["x"] + free["right"] - 4, box["y"] + free["bottom"] - 4, steps=3)
    playwright.expect(page.locator(".band-frame")).to_be_visible()
    page.mouse.up()
    page.keyboard.up("Shift")
    many = page.evaluate("chutelab.bench.inspector.parts")
    assert {"one", "two"} <= set(many)
    # All that is chosen lies in its frame.
    left, top, right, bottom = frame(page)
    boxes = page.evaluate("""chutelab.bench.inspector.parts.flatMap((name) =>
      chutelab.stage.scenery.drawingsOf(name).map((one) => {
        const { left, right, top, bottom } = one.getBoundingClientRect();
        return [left, right, top, bottom];
      }))""")
    for west, east, north, south in boxes:
        assert left - 1 < west <= east < right + 1
        assert top - 1 < north <= south < bottom + 1
    # The frame is dragged where nothing is in it.
    bare = page.evaluate("""() => {
      const { stage, bench } = chutelab, { left, right, top, bottom } = stage.frame;
      const { free } = stage.view;
      for (let x = Math.max(left, free.left) + 9; x < Math.min(right, free.right) - 9; x += 9) {
        for (let y = Math.max(top, free.top) + 9; y < Math.min(bottom, free.bottom) - 9; y += 9) {
          if (!bench.nameAt([x, y])) return [x, y];
        }
      }
    }""")
    x, y = bare[0] + box["x"], bare[1] + box["y"]
    page.mouse.move(x, y)
    page.mouse.down()
    page.mouse.move(x + 30, y - 20, steps=3)
    page.mouse.up()
    page.evaluate(DONE)
    moved = ends(page) - before
    assert np.ptp(moved.reshape(-1, 2), axis=0) == pytest.approx(0, abs=1e-9)
    scale = page.evaluate("chutelab.stage.view.scale")
    assert moved[0, 0] * scale == pytest.approx([30, 20], abs=12)
    # One undo takes all back; arrows move all, too.
    page.click("#undo")
    assert ends(page) == pytest.approx(before)
    page.focus("#picture")
    page.keyboard.press("ArrowUp")
    page.evaluate(DONE)
    moved = (ends(page) - before).reshape(-1, 2)
    assert np.ptp(moved, axis=0) == pytest.approx(0, abs=1e-9)
    assert moved[0, 0] == 0.0
    assert moved[0, 1] > 0.0


@pytest.mark.slow
def test_a_finger_that_stays_chooses_a_further_body_and_draws_a_frame(shown):
    phone = {"viewport": {"width": 390, "height": 844}, "has_touch": True, "is_mobile": True}
    page = shown("free-fall", more=LINES, **phone)
    session = page.context.new_cdp_session(page)

    def touch(kind, *points):
        session.send("Input.dispatchTouchEvent", {"type": kind, "touchPoints": [
            {"x": x, "y": y} for x, y in points]})  # fmt: skip

    def on(name):
        row = page.evaluate(
            "(name) => chutelab.lab.scene.surface.find((one) => one.name === name)", name
        )
        x, y = page.evaluate(SCREEN, np.mean(row["points"], axis=0).tolist())
        return x, y

    chosen = "chutelab.bench.inspector.parts"
    first, second = "one", "two"
    page.touchscreen.tap(*on(first))
    assert page.evaluate(chosen) == [first]
    assert frame(page) is None
    touch("touchStart", on(second))
    page.wait_for_timeout(700)
    touch("touchEnd")
    assert page.evaluate(chosen) == [first, second]
    assert frame(page)
    # On an empty place a finger that stays draws a frame; the page does not scroll meanwhile.
    page.keyboard.press("Escape")
    assert page.evaluate(chosen) == []
    box = page.locator("#stage").bounding_box()
    x, y = box["x"] + 6, box["y"] + 70
    touch("touchStart", (x, y))
    page.wait_for_timeout(700)
    touch("touchMove", (x + 100, y + 60))
    touch("touchMove", (box["x"] + box["width"] - 6, box["y"] + box["height"] - 6))
    touch("touchEnd")
    assert {first, second} <= set(page.evaluate(chosen))
    assert page.evaluate("scrollY") == 0


def test_one_finger_on_an_empty_place_moves_neither_view_nor_machine(shown):
    page = shown("perpendicular", viewport={"width": 390, "height": 844}, has_touch=True)
    view = "JSON.stringify([chutelab.stage.view.x, chutelab.stage.view.y])"
    before, given = page.evaluate(view), page.evaluate("JSON.stringify(chutelab.lab.given)")
    touch = """([kind, points]) => {
      const { front } = chutelab.stage, box = front.getBoundingClientRect();
      points.forEach(([x, y], id) => front.dispatchEvent(new PointerEvent(kind, {
        pointerId: id + 5, pointerType: "touch", isPrimary: id === 0, bubbles: true, button: 0,
        clientX: box.left + x, clientY: box.top + y,
      })));
    }"""
    page.evaluate("Element.prototype.setPointerCapture = () => {}")
    for kind, at in (("pointerdown", 40), ("pointermove", 90), ("pointerup", 90)):
        page.evaluate(touch, [kind, [[30, at]]])
    assert page.evaluate(view) == before
    for kind, at in (("pointerdown", 40), ("pointermove", 90), ("pointerup", 90)):
        page.evaluate(touch, [kind, [[30, at], [60, at]]])
    assert page.evaluate(view) != before
    assert page.evaluate("JSON.stringify(chutelab.lab.given)") == given


def test_the_hand_moves_the_view_by_mouse_finger_and_keys_and_nothing_else(shown):
    page = shown("inclined-40", viewport={"width": 1366, "height": 768}, has_touch=True)
    view = "[chutelab.stage.view.x, chutelab.stage.view.y, chutelab.stage.view.scale]"
    given = page.evaluate("JSON.stringify(chutelab.lab.given)")
    page.click("#tool-hand")
    assert page.get_attribute("#tool-hand", "aria-pressed") == "true"
    assert page.get_attribute("#tool-select", "aria-pressed") == "false"
    pivot = page.evaluate("chutelab.stage.handles.find(({ id }) => id === 'plate.pivot')")
    angle = np.radians(40.0)
    body = pivot["x"] + 0.3 * np.sin(angle), pivot["y"] - 0.3 * np.cos(angle)
    x, y = page.evaluate(SCREEN, body)
    before = np.array(page.evaluate(view))
    drag(page, (x, y), (x + 60, y - 40))
    after = np.array(page.evaluate(view))
    assert (before - after)[:2] * after[2] == pytest.approx([60, 40])
    session = page.context.new_cdp_session(page)
    for kind, points in (
        ("touchStart", [(x, y)]), ("touchMove", [(x - 30, y)]), ("touchMove", [(x - 60, y + 40)]),
        ("touchEnd", []),
    ):  # fmt: skip
        places = [{"x": u, "y": v} for u, v in points]
        session.send("Input.dispatchTouchEvent", {"type": kind, "touchPoints": places})
    assert np.array(page.evaluate(view)) == pytest.approx(before, abs=12 / before[2])
    assert page.evaluate("JSON.stringify(chutelab.lab.given)") == given
    assert page.evaluate("chutelab.bench.inspector.parts") == []
    page.focus("#picture")
    page.keyboard.press("ArrowRight")
    page.keyboard.press("v")
    assert page.get_attribute("#tool-hand", "aria-pressed") == "false"
    page.mouse.click(*page.evaluate(SCREEN, body))
    assert page.evaluate("chutelab.bench.inspector.parts") == ["plate"]


def over(*names, quick=(0, 1)):
    """Scenes at three sizes of the window; all but some, each at another size, are slow."""
    sizes = [(1366, 768), (390, 844), (1920, 1080)]
    return pytest.mark.parametrize(
        ("name", "size"),
        [
            pytest.param(name, size, marks=() if n == k in quick else pytest.mark.slow)
            for n, name in enumerate(names)
            for k, size in enumerate(sizes)
        ],
    )


@over("inclined-40", "galton", "cascade", "spoon", "perpendicular", quick=(1,))
def test_the_machine_is_fitted_into_what_the_cards_leave_free(shown, name, size):
    page = shown(name, viewport={"width": size[0], "height": size[1]})
    free = page.evaluate("chutelab.stage.view.free")
    box = page.locator("#stage").bounding_box()
    for card in page.locator(".float:visible, #panels > .card:visible").all():
        its = card.bounding_box()
        left, top = its["x"] - box["x"], its["y"] - box["y"]
        # Each card is beside the free part, or below the picture.
        assert (
            left >= free["right"] or left + its["width"] <= free["left"]
            or top >= free["bottom"] or top + its["height"] <= free["top"]
        ), card.get_attribute("class")  # fmt: skip
    assert page.evaluate("document.documentElement.scrollWidth") == size[0]
    # What particle 0 does after it has left the belt is in sight.
    track = page.evaluate("""() => {
      const { lab: { recording }, stage: { view } } = chutelab;
      const [first] = recording.machine.interact ? [] : recording.tracks;
      const seen = first ? recording.points(0, 0.002) : [];
      return seen.filter(({ x }) => x > 0).map(({ x, y }) => [view.px(x), view.py(y)]);
    }""")
    for x, y in track:
        assert free["left"] <= x <= free["right"]
        assert free["top"] - 1 <= y <= free["bottom"] + 1
    if name in ("inclined-40", "cascade", "spoon"):
        the_card_of_what_is_chosen_covers_neither_it_nor_another_card(page, size)


def test_belts_run_with_their_speed_and_wheels_turn_with_them(shown):
    page = shown("perpendicular")
    at = """t => { chutelab.lab.seek(t);
      return new Promise((then) => requestAnimationFrame(() => requestAnimationFrame(() => then(
        [...document.querySelectorAll(".surfaces .cleat")].map((cleat) =>
          [parseFloat(cleat.getAttribute("stroke-dashoffset")), 24])
        .concat([...document.querySelectorAll(".wheel g")].map((wheel) => [parseFloat(
          wheel.getAttribute("transform").match(/rotate\\((.*?) /)[1]), 360])))))); }"""
    scale = page.evaluate("chutelab.stage.view.scale")
    before, after = (np.array(page.evaluate(at, t)) for t in (0.1, 0.12))
    cleats, wheels = before[:, 1] == 24, before[:, 1] == 360
    assert cleats.sum() == 2
    assert wheels.sum() == 2
    # Both belts run with 2 m/s, the pulley of 0.1 m turns with v / R, clockwise on the screen.
    gone = (before[cleats, 0] - after[cleats, 0]) % 24
    assert gone == pytest.approx(0.04 * scale % 24, abs=1e-6)
    turned = (after[wheels, 0] - before[wheels, 0]) % 360
    assert turned == pytest.approx(np.degrees(0.04 / 0.1) % 360, abs=1e-6)
    page.emulate_media(reduced_motion="reduce")
    still = np.array(page.evaluate(at, 0.14))
    assert np.array_equal(still, after)


def test_particles_have_the_colour_of_their_material_or_of_their_speed(shown):
    page = shown("perpendicular", ["particle.material=glass", "particle.radius=0.03"])
    ball = "chutelab.lab.recording.tracks[0].state(chutelab.lab.t)"
    x, y = page.evaluate(SCREEN, page.evaluate(f"(({{ x, y }}) => [x, y])({ball})"))
    red, _, blue = pixel(page, (x, y))
    assert blue > red  # glass is bluish
    page.locator("#show summary").click()
    page.click("#hue-speed")
    page.evaluate("() => new Promise((then) => requestAnimationFrame(then))")
    found = pixel(page, (x, y + 3))
    legend = page.evaluate(LEGEND)
    assert [text for _, text in legend["texts"]] == ["Speed", "5 m/s", "2.5", "0"]
    # 2 m/s on the belt, of eight equal steps up to the largest, from below.
    assert list(found) == legend["colours"][int(8 * 2.0 / 5.0)]


LEGEND = """() => {
  const box = (one) => {
    const { left, right, top, bottom } = one.getBoundingClientRect();
    return [left, right, top, bottom];
  };
  const layer = document.querySelector(".hues");
  const bodies = [...document.querySelectorAll("#stage :is(.belt, .wall, rect.steel, .track)")];
  return {
    texts: [...layer.querySelectorAll("text")].map((one) => [box(one), one.textContent]),
    notes: layer.querySelectorAll(".small").length,
    colours: [...layer.querySelectorAll("rect:not(.ring)")].map((one) =>
      getComputedStyle(one).fill.match(/\\d+/g).map(Number)),
    boxes: [...layer.querySelectorAll("rect:not(.ring), circle")].map(box),
    scale: box(document.querySelector(".scale")),
    bodies: bodies.flatMap((shape) => {
      const long = shape.getTotalLength(), matrix = shape.getScreenCTM();
      return Array.from({ length: 201 }, (_, n) => {
        const { x, y } = shape.getPointAtLength((n * long) / 200).matrixTransform(matrix);
        return [x, y];
      });
    }),
  };
}"""


@over("inclined-40", "hopper", "mixture", quick=(0,))
def test_the_legend_tells_colours_and_lies_on_nothing(shown, name, size):
    page = shown(name, viewport={"width": size[0], "height": size[1]}, language="de")
    kinds = page.evaluate("chutelab.lab.machine.streams.length")
    assert not page.evaluate(LEGEND)["texts"]
    for hue in ("speed", "kind"):
        page.evaluate(f"document.getElementById('hue-{hue}').click()")
        seen = page.evaluate(LEGEND)
        if hue == "kind":
            told = len(seen["texts"]) - seen["notes"]
            assert told == len(seen["boxes"]) + 1 == kinds + 1
        else:
            assert len(set(map(tuple, seen["colours"]))) == len(seen["boxes"]) == 8
            most = float(re.findall(r"([\d,]+) m/s", str(seen["texts"]))[0].replace(",", "."))
            faster, half = page.evaluate(
                """(most) => {
                  const { tracks, begin, end } = chutelab.lab.recording, speeds = [];
                  for (const track of tracks) for (let n = 1; n < 40; n += 1) {
                    const its = track.state(begin + ((end - begin) * n) / 40);
                    if (its && !its.ended) speeds.push(Math.hypot(its.vx, its.vy));
                  }
                  const share = (part) => speeds.filter((v) => v > part).length / speeds.length;
                  return [share(most), share(most / 2.5)];
                }""",
                most,
            )
            # Few are beyond the last colour, and with the next lower round speed more would be.
            assert faster < 0.04
            assert half > 0.01
        boxes = [*seen["boxes"], *[box for box, _ in seen["texts"]]]
        left, right = min(box[0] for box in boxes), max(box[1] for box in boxes)
        top, bottom = min(box[2] for box in boxes), max(box[3] for box in boxes)
        assert not [1 for x, y in seen["bodies"] if left < x < right and top < y < bottom]
        scale = seen["scale"]
        assert scale[2] > bottom or scale[1] < left
        home, free = (
            page.locator("#stage").bounding_box(),
            page.evaluate("chutelab.stage.view.free"),
        )
        assert left > home["x"] + free["left"]
        assert right < home["x"] + free["right"]
        assert top > home["y"] + free["top"]


def test_what_is_dragged_leaves_its_place_faint_and_tells_its_value_at_the_pointer(shown):
    page = shown("inclined-40")
    pivot = page.evaluate("chutelab.stage.handles.find(({ id }) => id === 'plate.pivot')")
    angle = np.radians(40.0)
    # Idle there are no handles; the plate is clicked where it is none.
    playwright.expect(page.locator(".grip.own")).to_have_count(0)
    x, y = page.evaluate(
        SCREEN, [pivot["x"] + 0.3 * np.sin(angle), pivot["y"] - 0.3 * np.cos(angle)]
    )
    page.mouse.click(x, y)
    playwright.expect(page.locator("#chosen")).to_be_visible()
    turn = page.evaluate("chutelab.stage.handles.find(({ id }) => id === 'turn-plate')")
    start = page.evaluate(SCREEN, [turn["x"], turn["y"]])
    page.mouse.move(*start)
    page.mouse.down()
    far = np.hypot(turn["x"] - pivot["x"], turn["y"] - pivot["y"])
    # To 60.8 degrees from the vertical, which is nearly a round angle.
    to = np.radians(60.8)
    goal = pivot["x"] + far * np.sin(to), pivot["y"] - far * np.cos(to)
    page.mouse.move(*page.evaluate(SCREEN, goal), steps=3)
    page.evaluate("() => new Promise((then) => setTimeout(then, 60))")
    tip = page.locator(".tip")
    assert tip.inner_text().split("\n") == ["angle α = 60.0°", "was 40.0°"]
    playwright.expect(page.locator(".ghost .steel")).to_have_count(1)
    playwright.expect(page.locator("#chosen")).to_be_hidden()
    # With Alt it is as exact as the pointer.
    page.keyboard.down("Alt")
    page.mouse.move(*[place + 1 for place in page.evaluate(SCREEN, goal)])
    page.mouse.move(*page.evaluate(SCREEN, goal))
    page.mouse.up()
    page.keyboard.up("Alt")
    assert page.evaluate("chutelab.lab.scene.plates[0].angle_deg") == pytest.approx(60.8, abs=0.5)
    assert page.evaluate("chutelab.lab.scene.plates[0].angle_deg") != 60.0
    playwright.expect(page.locator(".ghost > *")).to_have_count(0)
    playwright.expect(page.locator("#chosen")).to_be_visible()
    page.click("#undo")
    assert page.evaluate("chutelab.lab.scene.plates[0].angle_deg") == 40.0


def test_what_cannot_be_is_said_at_the_pointer_and_nothing_moves(shown):
    stream = '[[stream]]\nname = "drop"\nat = [0.3, 0.3]\nvelocity = [0.0, 0.0]\n'
    page = shown("belt-landing", ["outgoing.drop_from=top"], more=stream)
    page.mouse.click(*page.evaluate(SCREEN, [0.3, 0.3]))
    before = page.evaluate("chutelab.toml()")
    inside = [0.602, 0.0]  # 2 mm from the plate, a third of the radius
    page.mouse.move(*page.evaluate(SCREEN, [0.3, 0.3]))
    page.mouse.down()
    page.mouse.move(*page.evaluate(SCREEN, inside))
    page.evaluate("() => new Promise((then) => setTimeout(then, 60))")
    assert "start inside a surface" in page.inner_text(".tip.refused")
    playwright.expect(page.locator("#fault")).to_be_hidden()
    page.mouse.up()
    assert page.evaluate("chutelab.toml()") == before


def the_card_of_what_is_chosen_covers_neither_it_nor_another_card(page, size):
    names = page.evaluate("[...chutelab.lab.machine.surfaces, ...chutelab.lab.machine.streams]")
    for one in names:
        page.evaluate("(name) => chutelab.bench.inspector.choose(name)", one)
        card = page.locator("#chosen").bounding_box()
        right, bottom = card["x"] + card["width"], card["y"] + card["height"]
        assert 0.0 <= card["x"] < right <= size[0]
        if size[0] < 1200:
            continue
        assert 0.0 <= card["y"] < bottom <= size[1]
        shapes = page.evaluate("""() => [...document.querySelectorAll(".outline .chosen")]
          .flatMap((shape) => Array.from({ length: 60 }, (_, n) => {
            const { x, y } = shape.getPointAtLength((n / 59) * shape.getTotalLength());
            const at = new DOMPoint(x, y).matrixTransform(shape.getScreenCTM());
            return [at.x, at.y];
          }))""")
        assert shapes
        covered = [p for p in shapes if card["x"] < p[0] < right and card["y"] < p[1] < bottom]
        # A belt may be as long as the picture is wide.
        assert len(covered) <= 0.05 * len(shapes), one
        for other in page.locator("#panels, .transport, .bench, header > *").all():
            its = other.bounding_box()
            apart = (
                its["x"] >= right or its["x"] + its["width"] <= card["x"]
                or its["y"] >= bottom or its["y"] + its["height"] <= card["y"]
            )  # fmt: skip
            assert apart, other.get_attribute("class")


def test_a_badge_says_when_the_engine_is_slower_than_time(shown):
    page = shown("perpendicular")
    playwright.expect(page.locator("#slow")).to_be_hidden()
    # An engine that computes 0.3 s of the machine in each second.
    page.evaluate("""() => {
      const { lab } = chutelab;
      lab.recording.state = "running";
      lab.playing = true;
      lab.tick = (seconds) => { lab.t += 0.3 * seconds; };
    }""")
    badge = page.locator("#slow")
    badge.wait_for(state="visible", timeout=5000)
    assert badge.inner_text() == "computing at 0.3×"
    badge.click()
    assert "nothing is left out" in page.inner_text("#slow-why")
    # In slow motion that is fast enough.
    page.evaluate("chutelab.lab.rate = 0.25")
    badge.wait_for(state="hidden", timeout=5000)
    playwright.expect(page.locator("#slow-why")).to_be_hidden()


@pytest.mark.slow
def test_the_projector_shows_the_machine_large_and_little_else(shown):
    page = shown("perpendicular")
    size = "parseFloat(getComputedStyle(document.documentElement).fontSize)"
    before = page.evaluate(size)
    page.click("#full")
    assert page.evaluate(size) > 1.15 * before
    playwright.expect(page.locator("#bench")).to_be_hidden()
    playwright.expect(page.locator("#numbers")).to_be_hidden()
    playwright.expect(page.locator("#energy")).to_be_visible()
    # Left alone it shows title, picture and time; the pointer or a key brings the rest.
    page.locator("#energy").wait_for(state="hidden", timeout=6000)
    playwright.expect(page.locator("#play")).to_be_visible()
    playwright.expect(page.locator("#views")).to_be_hidden()
    page.keyboard.press("Tab")
    playwright.expect(page.locator("#energy")).to_be_visible()
    # On a small one it lies over no part of the plate until it is opened.
    page.set_viewport_size({"width": 1366, "height": 768})
    page.mouse.move(400, 300)
    playwright.expect(page.locator("#energy")).to_be_visible()
    card, plate = (page.locator(one).first.bounding_box() for one in ("#energy", ".surfaces .face"))
    assert plate["x"] + plate["width"] < card["x"] or card["y"] + card["height"] < plate["y"]
    page.click("#full")
    assert page.evaluate(size) == before
    playwright.expect(page.locator("#bench")).to_be_visible()


LABELS = """() => {
  const home = chutelab.stage.front.getBoundingClientRect();
  return [...document.querySelectorAll(".symbols text, .surfaces .on-frame, .scale text")]
    .map((text) => [
      text.textContent, text.getBoundingClientRect(), text.closest(".symbols") !== null])
    .map(([text, { left, right, top, bottom }, own]) =>
      [text, [left - home.left, right - home.left, top - home.top, bottom - home.top], own]);
}"""


# Points along lines that lead to labels and those that show a length.
LEADERS = """() => {
  const home = document.querySelector("#stage").getBoundingClientRect();
  return [...document.querySelectorAll(".symbols :is(.leader, .length)")].flatMap((line) => {
    const long = line.getTotalLength(), matrix = line.getScreenCTM();
    return Array.from({ length: Math.ceil(long / 2) + 1 }, (_, n) => {
      const { x, y } = line.getPointAtLength(Math.min(long, 2 * n)).matrixTransform(matrix);
      return [x - home.left, y - home.top];
    });
  });
}"""


@over("perpendicular", "inclined-60", "inclined-20", "inclined-conveyor", "low-speed", "cascade")
def test_no_label_lies_on_another_or_is_cut_off(shown, name, size):
    page = shown(name, viewport={"width": size[0], "height": size[1]})
    found, free = page.evaluate(LABELS), page.evaluate("chutelab.stage.view.free")
    assert 3 <= sum(own for *_, own in found) <= 6
    for n, (text, (left, right, top, bottom), own) in enumerate(found):
        if own:
            assert free["left"] - 4 <= left < right <= free["right"] + 4, text
            assert free["top"] - 4 <= top < bottom <= free["bottom"] + 4, text
        for other, (left2, right2, top2, bottom2), own2 in found[n + 1 :]:
            # A line of text is taller than its letters.
            apart = min(right, right2) - max(left, left2), min(bottom, bottom2) - max(top, top2)
            assert not (own or own2) or min(apart) <= 5.0, (text, other, apart)
        for x, y in page.evaluate(LEADERS):
            # Its letters are lower than the line of text.
            within = left < x < right and top + 5.0 < y < bottom - 5.0
            assert not (own and within), (text, x, y)


# Boxes of texts, and of steel and belts that lie level or upright, so that their boxes are they.
BODIES = """() => {
  const boxes = (kind) => [...document.querySelectorAll(kind)].map((one) => {
    const { left, right, top, bottom } = one.getBoundingClientRect();
    return [left, right, top, bottom];
  });
  const bodies = boxes(".surfaces :is(rect.steel, .frame, .belt)");
  return [boxes(".symbols text, .measures text"), bodies];
}"""


def test_labels_of_what_is_pointed_at_and_of_tools_do_not_lie_on_the_machine(shown):
    page = shown("perpendicular", viewport={"width": 1366, "height": 768})
    page.click("#tool-flow")
    page.click("#tool-tape")
    page.hover("#numbers [data-id=x3]")
    for share in (0.5, 0.62, 0.3):
        # Across the belt, the plate, and below the pulley.
        page.evaluate(
            """(share) => {
              const { stage, tools } = chutelab, { view } = stage;
              const x = view.worldX(share * view.width), y = view.worldY(0.82 * view.height);
              tools.flow.move([[x, y], [x + 0.2, y]]);
              tools.tape = [[x, y + 0.3], [x + 0.2, y + 0.3]];
              tools.refresh();
            }""",
            share,
        )
        texts, bodies = page.evaluate(BODIES)
        assert len(texts) >= 8
        for left, right, top, bottom in texts:
            for left2, right2, top2, bottom2 in bodies:
                if right2 - left2 > 60.0 and bottom2 - top2 > 60.0:
                    continue  # the loop of a belt, whose box is not it
                apart = min(right, right2) - max(left, left2), min(bottom, bottom2) - max(top, top2)
                assert min(apart) <= 4.0


@pytest.mark.parametrize("name", some(["inclined-40", "damper-plate", "hopper", "low-speed"], 4))
def test_both_bars_of_the_energy_are_equally_long_at_any_time(shown, name):
    few = ["stream.count=60"] if name == "hopper" else ()
    page = shown(name, few, viewport={"width": 1366, "height": 768})
    ends = """(share) => {
      chutelab.lab.seek(chutelab.lab.start + share * (chutelab.lab.end - chutelab.lab.start));
      chutelab.panels.find((one) => one.closes).refresh();
      return ["put-in", "is-now"].map((id) =>
        [...document.getElementById(id).children].at(-1).getBoundingClientRect().right);
    }"""
    for share in np.linspace(0.0, 1.0, 12).tolist():
        put_in, is_now = page.evaluate(ends, share)
        assert abs(put_in - is_now) < 1.0, share


# The calculated flights, as points, and the run's path as they are drawn, m.
DRAWN = """() => {
  const { view } = chutelab.stage, world = ([x, y]) => [view.worldX(x), view.worldY(y)];
  const pairs = (text) => text.match(/[-\\d.]+[ ,][-\\d.]+/g)
    .map((pair) => world(pair.split(/[ ,]/).map(Number)));
  const rail = document.querySelector(".rail:not(.within)")?.getAttribute("d") ?? "";
  const flights = rail.split("M").slice(1).map(pairs).map(([a, b, c]) =>
    Array.from({ length: 41 }, (_, n) => [0, 1].map((k) => ((1 - n / 40) ** 2) * a[k]
      + 2 * (n / 40) * (1 - n / 40) * b[k] + ((n / 40) ** 2) * c[k])));
  return [flights, [...document.querySelectorAll(".track")].map((line) =>
    pairs(line.getAttribute("points")))];
}"""


def test_the_run_lies_between_two_lines_of_the_calculated_flights(shown):
    scene = load("perpendicular")
    page = shown("perpendicular")
    ((to_plate, to_belt), (track,)) = page.evaluate(DRAWN)
    v, g, e = scene.incoming.speed, scene.gravity, scene.plates[0].restitution
    ride = scene.incoming.pulley_radius + scene.particles[0].radius
    near = 0.3 / page.evaluate("chutelab.stage.view.scale")
    for x, y in to_plate:
        assert y == pytest.approx(ride - 0.5 * g * (x / v) ** 2, abs=near)
    (wall, height), t2 = to_plate[-1], to_plate[-1][0] / v
    for x, y in to_belt:
        t = (wall - x) / (e * v)
        assert y == pytest.approx(height - g * t2 * t - 0.5 * g * t * t, abs=10 * near)
    for x, y in track:
        far = [math.hypot(x - u, y - w) for u, w in [*to_plate, *to_belt]]
        assert x < 0.0 or min(far) < 0.03
    # The label of a number that is pointed at tells its value.
    page.locator("#numbers [data-id=x3] td").first.hover()
    said = page.locator("#numbers [data-id=x3] td").first.text_content()
    assert f"x₃ = {said} m" in page.locator(".symbols text").all_text_contents()
    page.locator("h1").hover()
    assert "x₃" in page.locator(".symbols text").all_text_contents()
    # What was put in is where it is now.
    assert page.locator("#energy .good").text_content().endswith(" mJ: it closes")


@pytest.mark.parametrize(("name", "overrides"), [
    ("hopper", ["stream.count=20"]), ("perpendicular", ["live.predict=true"])])  # fmt: skip
def test_no_flight_is_calculated_for_a_crowd_or_before_a_prediction(shown, name, overrides):
    rails, tracks = shown(name, overrides).evaluate(DRAWN)
    assert (rails, tracks) == ([], [])


PHONE = {"viewport": {"width": 390, "height": 844}, "has_touch": True, "is_mobile": True}

# Where the last of what is seen of an element ends.
LAST = """(all) => Math.max(...[...all.querySelectorAll("*")]
  .filter((one) => one.checkVisibility()).map((one) => one.getBoundingClientRect().bottom))"""

# Of what can be pressed and is seen, what is less than a finger: name, width and height.
SMALL = """() => [...document.querySelectorAll(
    "button, select, summary, label:has([type=checkbox]), input:not([type=checkbox]), .grip .room")]
  .filter((one) => one.checkVisibility())
  .map((one) => [one.id || one.textContent, one.getBoundingClientRect()])
  .map(([name, { width, height }]) => [name, width, height])
  .filter(([, width, height]) => width > 0 && (width < 43.9 || height < 43.9))"""


@pytest.mark.slow
@pytest.mark.parametrize(
    ("name", "size"), some([("stream", (320, 568)), ("perpendicular", (390, 844))])
)
def test_on_a_phone_one_card_or_drawer_lies_under_the_picture(shown, name, size):
    phone = PHONE | {"viewport": {"width": size[0], "height": size[1]}}
    page = shown(name, **phone)
    dock, sheet = (
        page.locator(".dock"),
        ".drawer:visible, .parts:visible, #panels:visible, #chosen:visible",
    )
    picture = page.locator("#stage").bounding_box()

    def look():
        """Picture, time and tools are seen whole, and below the time one thing, to its end."""
        assert page.locator("#stage").bounding_box() == picture
        assert page.evaluate("document.documentElement.scrollWidth") == size[0]
        play, bar = page.locator(".transport").bounding_box(), dock.bounding_box()
        assert bar["y"] + bar["height"] == pytest.approx(size[1], abs=1)
        playwright.expect(page.locator(sheet)).to_have_count(1)
        box = page.locator(sheet).bounding_box()
        assert play["y"] + play["height"] - 1 <= box["y"]
        assert box["y"] + box["height"] <= bar["y"] + 1
        page.locator(sheet).evaluate("(one) => one.scrollTo(0, 1e6)")
        last = page.locator(sheet).evaluate(LAST)
        assert last <= bar["y"] + 1
        assert page.evaluate(SMALL) == []

    look()
    first = page.locator("#numbers" if name == "stream" else "#energy")
    assert first.is_visible()
    # What comes up again shows what was changed under a chosen part.
    seen, said = playwright.expect(first), first.inner_text()
    page.evaluate("chutelab.bench.inspector.choose('incoming')")
    seen.to_be_hidden()
    page.evaluate("chutelab.lab.change({ 'incoming.speed': 3 })")
    page.evaluate(DONE)
    page.evaluate("chutelab.bench.inspector.choose()")
    seen.to_be_visible()
    assert first.inner_text() != said
    page.evaluate("chutelab.lab.undo()")
    for tab in page.locator(".tabs button").all():
        tab.click()
        playwright.expect(page.locator(f"#{tab.get_attribute('data-of')}")).to_be_visible()
        playwright.expect(page.locator("#panels > .card:visible")).to_have_count(1)
        look()
    for tool, seen in (("add", "#part-belt"), ("tape", "#tool-tape"), ("eye", "#show-grid"),
                       ("more", "#keys")):  # fmt: skip
        page.click(f"#dock-{tool}")
        page.locator(seen).scroll_into_view_if_needed()
        playwright.expect(page.locator(seen)).to_be_visible()
        look()
    # What is taken leaves the picture to be measured in; what is chosen has its card.
    page.click("#dock-tape")
    page.click("#tool-tape")
    playwright.expect(page.locator(".measures .tape")).to_have_count(1)
    playwright.expect(page.locator(".tabs")).to_be_visible()
    page.evaluate("chutelab.bench.inspector.choose(chutelab.lab.machine.surfaces[0])")
    playwright.expect(page.locator("#chosen")).to_be_visible()
    look()
    # Turned, or on a wider window, all is where it belongs there.
    page.set_viewport_size({"width": 1366, "height": 768})
    playwright.expect(page.locator(".bench #tool-tape")).to_be_visible()
    assert page.locator("#panels > .card:visible").count() > 2


def test_the_bar_of_the_scale_is_in_no_drum(shown):
    """On a phone, where it is half as long as elsewhere: all of it is further out than the wall."""
    phone = {"viewport": {"width": 390, "height": 844}, "has_touch": True, "is_mobile": True}
    page = shown("drum", **phone)
    found = page.evaluate("""() => {
      const box = (which) => document.querySelector(which).getBoundingClientRect();
      const { view } = chutelab.stage, { left, top } = box("#stage"), { scene } = chutelab.lab;
      const [x, y] = scene.surface[0].pivot;
      const wall = scene.surface[0].points.map(([u, v]) => Math.hypot(u - x, v - y) * view.scale);
      const { left: west, right: east, top: north, bottom: south } = box(".scale");
      const middle = [left + view.px(x), top + view.py(y)];
      return { wall: Math.max(...wall), middle, west, east, north, south,
        said: document.querySelector(".scale text").textContent };
    }""")
    across = max(found["west"] - found["middle"][0], found["middle"][0] - found["east"], 0.0)
    up = max(found["north"] - found["middle"][1], found["middle"][1] - found["south"], 0.0)
    assert np.hypot(across, up) > found["wall"]
    assert found["west"] >= 0.0
    long = float(found["said"].removesuffix(" m")) * page.evaluate("chutelab.stage.view.scale")
    assert found["east"] - found["west"] == pytest.approx(long, abs=4.0)


@pytest.mark.slow
def test_the_picture_has_a_frame_when_keys_come_to_it_and_none_when_it_is_clicked(shown):
    page = shown("perpendicular")
    frame = "getComputedStyle(document.querySelector('#picture')).outlineStyle"
    focused = "document.activeElement.id"
    x, y = spot(page, 0.5, 0.5)
    page.mouse.click(x, y)
    assert (page.evaluate(focused), page.evaluate(frame)) == ("picture", "none")
    page.evaluate("document.activeElement.blur()")
    while page.evaluate(focused) != "picture":
        page.keyboard.press("Tab")
    assert page.evaluate(frame) == "solid"
