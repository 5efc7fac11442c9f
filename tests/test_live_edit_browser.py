"""Editing, predicting, keeping and the layout of the live page, in a real browser."""

import csv
from io import BytesIO, StringIO

import numpy as np
import pytest
from PIL import Image

import chutelab
from chutelab.pictures.live import html
from chutelab.results import Kind
from chutelab.scene import load, parse
from live.browser import DONE, spot
from shared import some

expect = pytest.importorskip("playwright.sync_api").expect

PREDICT = """
[live]
predict = true
[[live.presets]]
name = "Moon"
set = { gravity = 1.62 }
"""


def value(page, key):
    parts = "".join(f"?.[{part}]" if part.isdigit() else f"?.{part}" for part in key.split("."))
    return page.evaluate(f"chutelab.lab.given{parts}")


def field(page, label):
    return page.get_by_label(label, exact=False).and_(page.locator("#edit input"))


def world(page, x, y):
    return page.evaluate(
        """([x, y]) => {
          const { view, front } = chutelab.stage, box = front.getBoundingClientRect();
          return [view.worldX(x - box.left), view.worldY(y - box.top)];
        }""",
        [x, y],
    )


@pytest.mark.slow
def test_on_a_phone_buttons_beside_a_value_step_it_within_its_range(shown):
    phone = {"viewport": {"width": 390, "height": 844}, "has_touch": True, "is_mobile": True}
    page = shown("inclined-40", ["plate.restitution=0.985"], **phone)
    page.evaluate("chutelab.bench.inspector.choose('plate')")

    def tap(key, way):
        name = f"{key}: {way}"
        page.locator("#chosen").get_by_role("button", name=name, exact=True).tap()

    tap("angle α", "more")
    assert value(page, "plate.angle_deg") == 41.0
    for _ in range(2):
        tap("angle α", "less")
    assert value(page, "plate.angle_deg") == 39.0
    tap("distance", "less")
    assert 0.0 < value(page, "plate.distance") < 0.05
    # To the next round value, and no further than the last one that is allowed.
    for wanted in (0.99, 1.0, 1.0):
        tap("restitution ε", "more")
        assert value(page, "plate.restitution") == pytest.approx(wanted, abs=0.006)
    assert value(page, "plate.restitution") == 1.0
    expect(page.locator("#fault")).to_be_hidden()
    page.click("#undo")
    assert value(page, "plate.restitution") < 1.0
    # On a desk a slider does that.
    page = shown("inclined-40", viewport={"width": 1366, "height": 768})
    page.evaluate("chutelab.bench.inspector.choose('plate')")
    expect(page.locator("#chosen .step:visible")).to_have_count(0)
    expect(page.locator("#chosen input[type=range]:visible")).to_have_count(3)


def test_numbers_are_typed_and_a_wrong_one_says_why(shown):
    page = shown(language="de")
    angle = field(page, "Prallplatte: Winkel")
    angle.fill("12,5")
    angle.press("Enter")
    assert value(page, "plate.angle_deg") == 12.5
    expect(page.locator("#fault")).to_be_hidden()
    for typed, why in (("95", "zwischen −90 und 90"), ("steil", "eine Zahl"), ("0x10", "eine")):
        angle.fill(typed)
        angle.press("Enter")
        said = page.locator(f"[id='{angle.get_attribute('aria-describedby')}']")
        assert why in said.inner_text()
        expect(page.locator("#fault")).to_be_hidden()
        below = said.bounding_box()["y"] - angle.bounding_box()["y"]
        assert 0.0 < below < 60.0
        assert angle.get_attribute("aria-invalid") == "true"
        assert angle.input_value() == typed
        assert value(page, "plate.angle_deg") == 12.5
    page.get_by_role("button", name="Zurück zu 12,5").click()
    expect(page.locator(".why:visible")).to_have_count(0)
    assert angle.input_value() == "12,5"
    distance = field(page, "Prallplatte: Abstand")
    distance.fill("-0,2")
    distance.press("Enter")
    assert "zwischen 1e−9 und" in page.inner_text(".why:visible")
    distance.fill("0,4 m")  # with the unit that stands there
    distance.press("Enter")
    expect(page.locator(".why:visible")).to_have_count(0)
    assert value(page, "plate.distance") == 0.4
    page.locator("h1").click()
    page.keyboard.press("Control+z")
    assert value(page, "plate.distance") == 0.5
    page.keyboard.press("Control+z")
    assert value(page, "plate.angle_deg") is None
    assert angle.input_value() == "0"
    page.keyboard.press("Control+Shift+z")
    assert value(page, "plate.angle_deg") == 12.5


def test_a_tool_stays_and_what_it_drew_is_chosen_moved_copied_and_deleted(shown):
    page = shown()
    page.click("#tool-add")
    page.click("#part-line")
    assert "Point 1 of 2" in page.inner_text(".chip")
    a, b, c = spot(page, 0.42, 0.3), spot(page, 0.55, 0.43), spot(page, 0.7, 0.3)
    page.mouse.move(*a)
    page.mouse.down()
    page.mouse.move(*b, steps=3)
    page.mouse.up()
    line = value(page, "surface.0.points")
    near = 12.0 / page.evaluate("chutelab.stage.view.scale")
    for point, place in zip(line, (a, b), strict=True):
        assert point == pytest.approx(world(page, *place), abs=near)
    # The tool stays, and the next line begins where the last one ends: to the last bit.
    page.mouse.click(b[0] + 5, b[1] - 4)
    page.mouse.click(*c)
    assert value(page, "surface.1.points.0") == line[1]
    page.click("#part-arc")
    corners = [spot(page, u, v) for u, v in ((0.75, 0.6), (0.85, 0.62), (0.8, 0.7))]
    page.keyboard.down("Alt")
    for n, corner in enumerate(corners):
        assert f"Point {n + 1} of 3" in page.inner_text(".chip")
        page.mouse.click(*corner)
    page.keyboard.up("Alt")
    arc = value(page, "surface.2")
    pixel = 2.0 / page.evaluate("chutelab.stage.view.scale")
    for corner in corners:
        far = np.hypot(*(np.array(world(page, *corner)) - arc["center"]))
        assert far == pytest.approx(arc["radius"], abs=pixel)
    page.click("#part-ball")
    above = spot(page, 0.8, 0.2)
    page.mouse.click(*above)
    assert value(page, "stream.1.at") == pytest.approx(world(page, *above), abs=near)
    page.click("#done")
    expect(page.locator(".chip")).to_be_hidden()
    page.evaluate(DONE)
    assert page.evaluate("chutelab.lab.recording.tracks.length") == 2
    first, second = ((a[0] + b[0]) / 2, (a[1] + b[1]) / 2), ((b[0] + c[0]) / 2, (b[1] + c[1]) / 2)
    page.mouse.click(*first)
    assert page.locator("#edit select").input_value() == "line1"
    # Two lines together are moved as one, and copied.
    page.keyboard.down("Shift")
    page.mouse.click(*second)
    page.keyboard.up("Shift")
    assert "2 parts" in page.inner_text("#chosen")
    before = np.array([value(page, f"surface.{n}.points") for n in range(2)])
    page.mouse.move(*first)
    page.mouse.down()
    page.mouse.move(first[0] + 10, first[1] + 70)
    page.mouse.up()
    after = np.array([value(page, f"surface.{n}.points") for n in range(2)])
    assert np.ptp((after - before).reshape(4, 2), axis=0) == pytest.approx([0.0, 0.0], abs=1e-9)
    assert abs(after - before).max() > 0.0
    page.focus("#picture")
    page.keyboard.press("Control+c")
    page.keyboard.press("Control+v")
    page.keyboard.press("Control+d")
    names = [one["name"] for one in value(page, "surface")]
    assert names == ["line1", "line2", "arc1", "line3", "line4", "line5", "line6"]
    copies = np.array([value(page, f"surface.{n}.points") for n in (3, 4)])
    assert np.ptp((copies - after).reshape(4, 2), axis=0) == pytest.approx([0.0, 0.0], abs=1e-9)
    page.keyboard.press("Delete")
    assert len(value(page, "surface")) == 5
    page.click("#undo")
    assert len(value(page, "surface")) == 7
    page.click("#menu > summary")
    page.click("#reset")
    assert value(page, "surface") is None


@pytest.mark.slow
def test_a_tile_is_dragged_into_the_picture(shown):
    page = shown()
    page.click("#tool-add")
    tile = page.locator("#part-plate").bounding_box()
    page.mouse.move(tile["x"] + 20, tile["y"] + 20)
    page.mouse.down()
    here = spot(page, 0.8, 0.5)
    page.mouse.move(*here, steps=3)
    page.mouse.up()
    pixel = 2.0 / page.evaluate("chutelab.stage.view.scale")
    assert value(page, "plate.1.pivot") == pytest.approx(world(page, *here), abs=pixel)
    expect(page.locator("#chosen")).to_be_visible()
    expect(page.locator("#parts")).to_be_hidden()


@pytest.mark.slow
def test_all_of_that_goes_with_the_keyboard_alone(shown):
    page = shown()
    for _ in range(80):
        page.keyboard.press("Tab")
        if page.evaluate("document.activeElement.id") == "tool-add":
            break
    page.keyboard.press("Enter")
    page.focus("#part-line")
    page.keyboard.press("Enter")
    before = value(page, "surface.0.points.0")
    handle = page.evaluate("document.activeElement.getAttribute('data-id')")
    assert handle == "surface[0].points[0]"
    page.keyboard.press("ArrowRight")
    page.keyboard.press("ArrowUp")
    page.keyboard.press("ArrowUp")
    moved = value(page, "surface.0.points.0")
    assert moved == pytest.approx([before[0] + 0.01, before[1] + 0.02], abs=0.0051)
    page.keyboard.press("Space")
    assert page.evaluate("chutelab.lab.playing")
    page.keyboard.press("Space")
    assert not page.evaluate("chutelab.lab.playing")
    page.keyboard.press("?")
    expect(page.locator("#help")).to_be_visible()
    assert page.evaluate("document.querySelector('#help').scrollTop") == 0
    page.keyboard.press("Escape")
    expect(page.locator("#help")).to_be_hidden()
    page.keyboard.press("Delete")
    assert value(page, "surface") is None
    assert page.evaluate("document.activeElement.id") == "picture"
    page.focus("#undo")
    while page.locator("#undo").is_enabled():
        page.keyboard.press("Enter")
    assert page.evaluate("document.activeElement.id") == "redo"
    page.evaluate(DONE)
    page.focus("#time")
    page.keyboard.press("End")
    assert page.evaluate("chutelab.lab.t") == page.evaluate("chutelab.lab.end")
    page.keyboard.press("Home")
    assert page.evaluate("chutelab.lab.t") == 0.0
    page.evaluate("document.activeElement.blur()")
    page.keyboard.press("End")
    end = page.evaluate("chutelab.lab.end")
    assert page.evaluate("chutelab.lab.t") == end
    page.keyboard.press("ArrowLeft")
    assert page.evaluate("chutelab.lab.t") == pytest.approx(end - 1 / 60)
    page.keyboard.press("Home")
    assert page.evaluate("chutelab.lab.t") == 0.0


@pytest.mark.slow
def test_the_picture_is_moved_and_zoomed_about_the_place_that_is_held(shown):
    page = shown(has_touch=True)
    here = spot(page, 0.15, 0.25)
    held = world(page, *here)
    page.mouse.move(*here)
    page.mouse.wheel(0, -400)
    page.evaluate(DONE)
    assert world(page, *here) == pytest.approx(held, abs=1e-9)
    scale = page.evaluate("chutelab.stage.view.scale")
    page.mouse.down()
    there = here[0] + 60, here[1] + 30
    page.mouse.move(*there, steps=3)
    page.mouse.up()
    assert world(page, *there) == pytest.approx(held, abs=1e-9)
    assert page.evaluate("chutelab.stage.view.scale") == scale
    # Two fingers twice as far apart show all twice as large.
    session = page.context.new_cdp_session(page)
    for kind, half in (("touchStart", 30), ("touchMove", 45), ("touchMove", 60)):
        points = [{"x": there[0] + s * half, "y": there[1], "id": (s + 1) // 2} for s in (-1, 1)]
        session.send("Input.dispatchTouchEvent", {"type": kind, "touchPoints": points})
    session.send("Input.dispatchTouchEvent", {"type": "touchEnd", "touchPoints": []})
    assert page.evaluate("chutelab.stage.view.scale") == pytest.approx(2 * scale, rel=0.02)
    page.click("#fit")
    assert page.evaluate("chutelab.stage.view.scale") < 2 * scale


def landing_of(scene):
    return chutelab.simulate(scene).select(Kind.LANDING)[0]["position"][0]


@pytest.mark.slow
def test_path_and_numbers_are_hidden_until_there_is_a_mark_and_play_was_pressed(shown):
    page = shown("inclined-40", more=PREDICT)
    hidden = ("#numbers", "#energy", "#curves", ".tools", ".symbols")
    dots = "chutelab.stage.paths.childElementCount"

    def is_hidden():
        assert all(page.locator(one).is_hidden() for one in hidden)
        assert page.evaluate(dots) == 0
        assert page.locator("#time").is_disabled()
        expect(page.get_by_text("Table of the run")).to_be_hidden()

    is_hidden()
    page.click("#play")
    assert not page.evaluate("chutelab.lab.playing")
    is_hidden()
    # It says what is to be done first, and the flag has the focus now.
    assert "First your flag" in page.inner_text("#guess")
    assert page.evaluate("document.activeElement.getAttribute('aria-describedby')") == "guess"
    for _ in range(3):
        page.keyboard.press("PageUp")
    x = float(page.locator(".guess").get_attribute("aria-valuenow"))
    # The flag has a pole, and a foot in it.
    pole, foot = (page.locator(f".guess .{part}").evaluate(
        "(one) => [getComputedStyle(one).stroke, getComputedStyle(one).fill]")
        for part in ("pole", "foot"))  # fmt: skip
    assert pole[0] == foot[0] != foot[1]
    expect(page.locator("#show-all")).to_be_visible()
    page.click("#play")
    assert page.evaluate("chutelab.lab.playing")
    expect(page.locator("#show-all")).to_be_hidden()
    assert page.evaluate(dots) > 0
    assert all(page.locator(one).is_visible() for one in ("#numbers", "#energy", ".tools"))
    off = abs(landing_of(load("inclined-40")) - x) * 100
    said = page.inner_text("#guess")
    assert float(said.split(" by ")[1].split(" cm")[0]) == pytest.approx(off, rel=6e-3)
    page.select_option("#presets", label="Moon")
    assert value(page, "gravity") == 1.62
    page.evaluate(DONE)
    is_hidden()
    # With a finger, too: the flag is dragged to where it lands.
    x = landing_of(load("inclined-40", ["gravity=1.62"]))
    mark = page.locator(".guess .room").bounding_box()
    at = mark["x"] + mark["width"] / 2, mark["y"] + mark["height"] / 2
    scale = page.evaluate("chutelab.stage.view.scale")
    now = float(page.locator(".guess").get_attribute("aria-valuenow"))
    page.mouse.move(*at)
    page.mouse.down()
    page.mouse.move(at[0] + (x - now) * scale, at[1] - 30, steps=3)
    page.mouse.up()
    page.click("#play")
    said = page.inner_text("#guess")
    assert float(said.split(" by ")[1].split(" cm")[0]) < 200 / scale
    page.evaluate("chutelab.lab.reset()")
    page.click("#show-all")
    page.select_option("#presets", label="Moon")
    expect(page.locator("#numbers")).to_be_visible()
    expect(page.locator("#guess")).to_be_hidden()


def test_a_scene_says_what_can_be_changed(shown):
    live = """
[live]
controls = ["plate.angle_deg"]
panels = ["numbers", "edit"]
ranges = { "plate.angle_deg" = [20, 60] }
"""
    page = shown("inclined-40", more=live)
    grips = page.evaluate("chutelab.stage.handles.flatMap(({ axes }) => axes.map((a) => a.key))")
    assert set(grips) == {"plate.angle_deg"}
    expect(page.locator("#tool-add, #parts")).to_have_count(0)
    panels = page.evaluate(
        "[...document.querySelectorAll('#panels > .card')].filter((e) => e.offsetHeight)"
        ".map((e) => e.id)"
    )
    assert panels == ["numbers", "edit"]
    expect(page.locator(".tools")).to_be_hidden()
    expect(page.locator("#edit input")).to_have_count(1)
    angle = page.locator("#edit input")
    angle.fill("61")
    angle.press("Enter")
    assert "between 20 and 60" in page.inner_text(".why")
    assert value(page, "plate.angle_deg") == 40.0
    page.focus("[data-id='plate.angle_deg']")
    for _ in range(4):
        page.keyboard.press("PageUp")
    assert value(page, "plate.angle_deg") == 60.0


def test_the_address_holds_the_scene_and_one_that_does_not_is_said(shown):
    page = shown()
    assert page.evaluate("location.hash") == ""
    page.evaluate("chutelab.lab.change({ 'plate.angle_deg': 33.5, 'incoming.speed': 1.75 })")
    address = page.evaluate("location.hash")
    given = page.evaluate("chutelab.lab.given")
    again = shown(address=address)
    assert again.evaluate("chutelab.lab.given") == given
    assert again.evaluate("location.hash") == address
    again.evaluate("location.hash = ''")
    again.wait_for_timeout(50)
    assert value(again, "plate.angle_deg") is None
    again.evaluate("location.hash = '#nonsense'")
    again.wait_for_timeout(50)
    assert "address" in again.inner_text("#fault")
    assert value(again, "plate.distance") == 0.5
    again.click("#undo")
    assert again.evaluate("chutelab.lab.given") == given
    # One that has numbers, but cannot be built.
    page.evaluate("chutelab.lab.reset()")
    assert page.evaluate("location.hash") == ""


def saved(page, name):
    page.evaluate("document.getElementById('share').open = true")
    with page.expect_download() as waiting:
        page.get_by_role("button", name=name, exact=True).click()
    return waiting.value.suggested_filename, waiting.value.path().read_bytes()


@pytest.mark.slow
def test_scene_tables_and_picture_are_saved(shown):
    page = shown(language="de")
    page.evaluate("chutelab.lab.change({ 'plate.angle_deg': 33.5, 'incoming.speed': 1.75 })")
    page.evaluate(DONE)
    name, text = saved(page, "Als Szene speichern")
    assert name == "Perpendicular-damping-plate-2-m-s.toml"
    recording = chutelab.simulate(parse(text.decode()), engine="contact")
    _, table = saved(page, "Tabelle des Laufs")
    rows = list(csv.reader(StringIO(table.decode("utf-8-sig")), delimiter=";"))
    found = np.array([[float(cell.replace(",", ".")) for cell in row] for row in rows[1:]])
    knots = recording.knots
    expected = np.column_stack([knots["t"], knots["position"], knots["velocity"]])
    assert np.array_equal(found[:, 1:6], expected)
    page.uncheck("#comma")
    _, table = saved(page, "Tabelle der Zahlen")
    numbers = {row[0]: row[1:] for row in csv.reader(StringIO(table.decode("utf-8-sig")))}
    landing = recording.select(Kind.LANDING)[0]
    assert float(numbers["x"][0]) == pytest.approx(landing["position"][0], abs=1e-12)
    assert numbers["v₃"][2] == "m/s"
    name, data = saved(page, "Bild speichern")
    image = np.asarray(Image.open(BytesIO(data)).convert("RGB")).astype(int)
    box = page.locator("#stage").bounding_box()
    assert image.shape[:2] == (round(2 * box["height"]), round(2 * box["width"]))
    # The struck face, the belt's body and the path.
    for colour in ((201, 84, 0), (43, 56, 65), (0, 114, 178)):
        assert np.mean(np.abs(image - np.array(colour)).max(axis=-1) < 30) > 5e-4


@pytest.mark.slow
@pytest.mark.parametrize("own_file", [True, False])
def test_in_a_frame_that_is_hidden_at_first_it_draws_once_it_is_seen_and_tells_changes(
    opened, tmp_path, own_file
):
    outer, inner = tmp_path / "outer.html", html(load("perpendicular"))
    (tmp_path / "inner.html").write_text(inner, "utf-8")
    # As the notebook's widget has it: a text of its own, without an origin.
    text = inner.replace("&", "&amp;").replace('"', "&quot;")
    frame = f'sandbox="allow-scripts allow-downloads" srcdoc="{text}"'
    outer.write_text(
        "<!doctype html><script>addEventListener('message', ({data}) => (window.heard = data))"
        "</script><div id='tab' style='display: none'><iframe style='width: 700px; height: 560px' "
        f"{'src=inner.html' if own_file else frame}></iframe></div>",
        "utf-8",
    )
    page = opened(outer)
    page.wait_for_timeout(300)
    page.evaluate("document.getElementById('tab').style.display = 'block'")
    frame = page.frames[1]
    frame.evaluate(DONE)
    frame.wait_for_selector(".surfaces path", state="attached")
    size = frame.evaluate("[chutelab.stage.view.width, chutelab.stage.canvas.width]")
    assert min(size) > 300
    assert frame.evaluate("document.querySelectorAll('.track').length") == 1
    assert page.evaluate("window.heard") is None
    frame.evaluate("chutelab.lab.change({ 'plate.angle_deg': 20 }, { done: false })")
    page.wait_for_timeout(50)
    assert page.evaluate("window.heard") is None
    frame.evaluate("chutelab.lab.settle()")
    page.wait_for_timeout(50)
    heard = page.evaluate("window.heard")
    assert heard["chutelab"] == "scene"
    assert parse(heard["toml"]).plates[0].angle_deg == 20.0


@pytest.mark.parametrize(
    ("size", "scheme"),
    some([((740, 360), "light"), ((1366, 620), "dark"), ((360, 740), "light")]),
)
def test_picture_and_play_are_seen_together_and_fingers_hit(shown, size, scheme):
    width, height = size
    page = shown(
        "inclined-40", more=PREDICT, viewport={"width": width, "height": height},
        color_scheme=scheme, has_touch=True, reduced_motion="reduce",
    )  # fmt: skip
    page.click("#show-all")
    page.evaluate("scrollTo(0, 0)")
    assert page.evaluate("document.documentElement.scrollWidth") == width
    for one in ("#stage", "#play"):
        box = page.locator(one).bounding_box()
        assert box["y"] >= 0.0
        assert box["y"] + box["height"] <= height
    assert page.locator("#stage").bounding_box()["height"] >= 180.0
    assert not page.evaluate("chutelab.lab.playing")
    small = page.evaluate("""() => [...document.querySelectorAll("button, select, .grip .room")]
      .filter((e) => e.getBoundingClientRect().width)
      .map((e) => [e.id, e.getBoundingClientRect()])
      .map(([id, { width, height }]) => [id, Math.min(width, height)])
      .filter(([, size]) => size < 39.9)""")
    assert small == []
    image = np.asarray(Image.open(BytesIO(page.screenshot())).convert("RGB")).astype(int)
    assert (image[2, 2].mean() > 200.0) == (scheme == "light")


@pytest.mark.slow
def test_it_is_printed_on_one_sheet_dark_or_not(shown):
    page = shown(color_scheme="dark")
    pdf = page.pdf(format="A4")
    assert pdf.count(b"/Type /Page\n") + pdf.count(b"/Type /Page ") == 1
    page.emulate_media(media="print")
    expect(page.locator("#numbers")).to_be_visible()
    for one in (".transport", ".bench", ".grips", "#edit", "#share"):
        expect(page.locator(one)).to_be_hidden()
    image = np.asarray(Image.open(BytesIO(page.screenshot())).convert("L")).astype(int)
    assert np.median(image) > 250


@pytest.mark.slow
def test_particles_that_were_dropped_are_taken_back_and_dropped_again(shown):
    """While a crowd runs: no track or event is left of one that is not there any more."""
    page = shown("stream", ["stream.count=30"])
    told = page.evaluate(
        """async () => {
          const { lab } = chutelab, wait = (ms) => new Promise((go) => setTimeout(go, ms));
          lab.play();
          await wait(300);
          for (const x of [0.3, 0.35, 0.4]) {
            const drop = { name: `drop${100 * x}`, at: [x, 0.8], velocity: [0, 0], start: lab.t };
            const { stream } = lab.given, rows = Array.isArray(stream) ? stream : [stream];
            lab.replace({ ...lab.given, stream: [...rows, drop] });
            await wait(100);
          }
          // As many tracks as are expected, or how many there are after two seconds.
          const counts = [], come = async (many) => {
            const end = performance.now() + 2000;
            do await wait(10);
            while (lab.recording.tracks.length !== many && performance.now() < end);
            counts.push(lab.recording.tracks.length);
          };
          for (const step of ["undo", "undo", "redo", "undo", "undo", "redo", "redo", "redo"]) {
            const many = lab.recording.tracks.length + (step === "undo" ? -1 : 1);
            lab[step]();
            await come(many);
          }
          // One in the middle goes: those after it stay what they were.
          const rows = lab.given.stream.filter(({ name }) => name !== "drop35");
          lab.replace({ ...lab.given, stream: rows });
          await come(32);
          lab.pause();
          const { events, tracks } = lab.recording;
          const starts = tracks.map((track) => track.at(0, 1)), all = tracks.length;
          const released = events.filter(({ kind }) => kind === 0);
          return [
            counts, events.every(({ disk, other }) => disk < all && other < all), all,
            starts.slice(-2),
            released.every(({ disk, x }) => Math.abs(x - starts[disk]) < 1e-9),
          ];
        }"""
    )
    assert told == [[32, 31, 32, 31, 30, 31, 32, 33, 32], True, 32, [0.3, 0.4], True]


@pytest.mark.parametrize(
    ("damage", "place", "said"),
    [
        pytest.param(
            lambda page, at: page[: at + 2000] + "AAAAAAAA" + page[at + 2008 :],
            "#fault", "engine", marks=pytest.mark.slow,
        ),
        (lambda page, at: page[: at + 2000] + "!!" + page[at + 2002 :], "#fault", "engine"),
        pytest.param(
            lambda page, at: page[: at + 4000], "#broken", "This page does not start",
            marks=pytest.mark.slow,
        ),
    ],
    ids=["core", "no base64", "half a file"],
)  # fmt: skip
def test_a_damaged_page_says_so(browser, tmp_path, damage, place, said):
    page = html(load("perpendicular"))
    (tmp_path / "page.html").write_text(damage(page, page.index('"wasm":"')), encoding="utf-8")
    shown = browser.new_page()
    shown.goto((tmp_path / "page.html").as_uri())
    shown.locator(place).wait_for(state="visible", timeout=20_000)
    assert said in shown.locator(place).inner_text()
    shown.close()
