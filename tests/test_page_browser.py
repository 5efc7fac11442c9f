"""The page in a real browser: Debian's chromium, driven by Playwright; skipped without them."""

from __future__ import annotations

import csv
import shutil
from io import BytesIO, StringIO
from time import monotonic

import numpy as np
import pytest
from PIL import Image

import chutelab
from chutelab import scene as scenes
from chutelab.pictures.live import page
from chutelab.results import Kind

playwright = pytest.importorskip(
    "playwright.sync_api", reason='needs Playwright: pip install "chutelab[test]"'
)
CHROMIUM = next(filter(None, map(shutil.which, ("chromium", "chromium-browser"))), None)
pytestmark = pytest.mark.skipif(
    CHROMIUM is None, reason="needs a browser: apt-get install chromium"
)

ANGLES = np.linspace(-6.0, 84.0, 46)
OWN = int(np.argmin(np.abs(ANGLES - 40.0)))
PHONE = {"width": 360, "height": 740}
DESKTOP = {"width": 1280, "height": 800}


@pytest.fixture(scope="module")
def browser():
    with playwright.sync_playwright() as driver:
        opened = driver.chromium.launch(executable_path=CHROMIUM)
        yield opened
        opened.close()


@pytest.fixture(scope="module")
def file(tmp_path_factory):
    path = tmp_path_factory.mktemp("page") / "page.html"
    page.write(scenes.load("inclined-40"), ["plate.angle_deg=-6:84:46"], path)
    return path


@pytest.fixture(scope="module")
def recordings():
    """Of every angle that can be run; None for the others."""
    found = []
    for angle in ANGLES:
        try:
            scene = scenes.load("inclined-40", [f"plate.angle_deg={angle}"])
            found.append(chutelab.simulate(scene))
        except scenes.SceneError:
            found.append(None)
    return found


class Tab:
    """A page that is open, and all that it complained of or asked for."""

    def __init__(self, browser, file, **options):
        self.context = browser.new_context(**{"viewport": DESKTOP, **options})
        self.page = self.context.new_page()
        self.trouble = []
        self.page.on("console", lambda message: self.trouble.append(message.text))
        self.page.on("pageerror", lambda error: self.trouble.append(str(error)))
        self.page.on("request", lambda request: self._requested(request.url))
        self.file = file
        self.page.goto(file.as_uri())

    def _requested(self, url):
        if url != self.file.as_uri() and not url.startswith(("data:", "blob:")):
            self.trouble.append(url)

    @property
    def state(self):
        return self.page.evaluate("window.chutelab.state")

    def press(self, *keys):
        for key in keys:
            self.page.keyboard.press(key)

    def wait(self, condition, seconds=20.0):
        """Wait for a condition; Playwright's own wait needs eval, which the page forbids."""
        end = monotonic() + seconds
        while not self.page.evaluate(condition):
            assert monotonic() < end, condition
            self.page.wait_for_timeout(20)

    def slide(self, position, axis=0):
        self.page.evaluate(
            """([axis, position]) => {
                const slider = document.getElementById(`slider-${axis}`);
                slider.value = position;
                slider.dispatchEvent(new Event("input", { bubbles: true }));
            }""",
            [axis, position],
        )


@pytest.fixture
def tab(browser, file):
    opened = Tab(browser, file)
    yield opened
    assert opened.trouble == []
    opened.context.close()


def landing_of(recording):
    return recording.select(Kind.LANDING)[0]


def test_the_landing_point_follows_the_slider_as_python_computed_it(tab, recordings):
    assert tab.state["values"] == [40.0]
    ran = 0
    for position, recording in enumerate(recordings):
        tab.slide(position)
        state = tab.state
        assert state["values"][0] == pytest.approx(ANGLES[position], abs=1e-9)
        if recording is None:
            assert state["landing"] is None
            assert "never meets the plate" in state["fault"]
            continue
        event = landing_of(recording)
        found = [state["landing"][name] for name in ("t", "x", "y")]
        np.testing.assert_allclose(found, [event["t"], *event["position"]], rtol=0.0, atol=1e-12)
        ran += 1
    assert ran == 45


@pytest.mark.parametrize("position", [0, OWN, 44])
def test_curves_and_books_are_python_s_at_any_time(tab, recordings, position):
    recording = recordings[position]
    tab.slide(position)
    last = recording.knots["t"].max()
    times = np.sort(np.concatenate([np.linspace(0.0, last, 60), recording.knots["t"]]))
    found = tab.page.evaluate("ts => ts.map((t) => window.chutelab.at(t))", times.tolist())
    where, velocity = recording.at(times)
    np.testing.assert_allclose([[s["x"], s["y"]] for s in found], where[:, 0], rtol=0, atol=1e-12)
    np.testing.assert_allclose(
        [[s["vx"], s["vy"]] for s in found], velocity[:, 0], rtol=0, atol=1e-11
    )
    books = tab.page.evaluate("ts => ts.map((t) => window.chutelab.energyAt(t))", times.tolist())
    expected = recording.energy_at(times)
    for name in ("kinetic", "belt_work", "restitution_loss", "friction_loss"):
        np.testing.assert_allclose([b[name] for b in books], expected[name], rtol=0, atol=1e-15)
    for b in books:
        put_in = b["start"] + b["belt_work"] + b["residual"]
        is_now = b["kinetic"] + b["potential"] + b["restitution_loss"] + b["friction_loss"]
        assert put_in == pytest.approx(is_now, abs=1e-16)
        assert abs(b["residual"]) < 1e-15
        assert b["potential"] > -1e-16


def test_riding_slipping_and_many_particles_are_python_s_too(browser, tmp_path):
    for name, changes in (
        ("slip", []),
        ("belt-landing", []),
        ("stream-independent", ["stream.count=9", "stream.bed_height=0.05"]),
    ):
        scene = scenes.load(name, changes)
        tab = Tab(browser, page.write(scene, [], tmp_path / f"{name}.html").path)
        recording = chutelab.simulate(scene)
        times = np.linspace(0.0, recording.knots["t"].max(), 80)
        books = tab.page.evaluate("ts => ts.map(window.chutelab.energyAt)", times.tolist())
        expected = recording.energy_at(times)
        for entry in ("kinetic", "belt_work", "restitution_loss", "friction_loss", "residual"):
            np.testing.assert_allclose(
                [b[entry] for b in books], expected[entry], rtol=0, atol=1e-14
            )
        last = recording.count - 1
        where, _ = recording.at(times)
        found = tab.page.evaluate(
            "([ts, i]) => ts.map((t) => window.chutelab.at(t, i))", [times.tolist(), last]
        )
        there = np.isfinite(where[:, last, 0])
        np.testing.assert_allclose(
            [[s["x"], s["y"]] for s, seen in zip(found, there, strict=True) if seen],
            where[there, last],
            rtol=0,
            atol=1e-12,
        )
        assert tab.trouble == []
        tab.context.close()


def test_both_bars_are_equally_long_and_the_table_adds_up(tab):
    for key in ("Home", "ArrowRight", "End"):
        tab.press(key)
        widths = tab.page.evaluate(
            """() => ["put-in", "is-now"].map((id) =>
                [...document.getElementById(id).children]
                    .reduce((sum, part) => sum + parseFloat(part.style.width), 0))"""
        )
        assert widths[0] == pytest.approx(widths[1], abs=1e-3)  # styles keep six digits
        assert 5.0 < widths[0] <= 100.0 + 1e-9
    cells = tab.page.locator("#energy td").all_inner_texts()
    start, kinetic, potential, belt, restitution, friction = (
        float(text.replace("−", "-")) for text in cells[:6]
    )
    total = float(cells[7])
    assert total == pytest.approx(start + belt, abs=0.011)
    assert total == pytest.approx(kinetic + potential + restitution + friction, abs=0.021)


def test_keys_play_step_scrub_and_move_the_slider(tab):
    begin, end = tab.state["span"]
    assert tab.state["t"] == begin
    tab.press("ArrowRight", "ArrowRight", "ArrowLeft")
    assert tab.state["t"] == pytest.approx(begin + (end - begin) / 60)
    tab.press("End")
    assert tab.state["t"] == end
    tab.press("Shift+ArrowLeft")
    plate = tab.page.evaluate("document.getElementById('caption').innerText")
    assert "strikes the plate" in plate
    tab.press("Home")
    assert tab.state["t"] == begin
    tab.press("ArrowUp", "ArrowUp", "ArrowDown")
    assert tab.state["values"] == [42.0]
    tab.press("s", "p", "v")
    assert tab.state["shown"] == {"strobe": False, "parabola": False, "arrows": False}
    before = tab.state["speed"]
    tab.press("+")
    assert tab.state["speed"] > before
    tab.press("-", "-")
    assert tab.state["speed"] < before
    tab.press(" ")
    assert tab.state["playing"]
    tab.press(" ")
    assert not tab.state["playing"]


def test_a_slider_with_the_focus_keeps_its_keys(tab):
    tab.page.focus("#slider-0")
    t = tab.state["t"]
    tab.press("ArrowRight")
    assert tab.state["values"] == [42.0]
    tab.press("Home")
    assert tab.state["values"] == [-6.0]
    tab.press("End", "PageDown")
    assert tab.state["values"][0] < 84.0
    assert tab.state["t"] >= t
    tab.press(" ")
    assert tab.state["playing"]


def test_it_plays_to_the_end_and_stops_there(tab):
    tab.page.select_option("#speed", label="2 ×")
    tab.page.click("#play")
    assert tab.page.get_attribute("#play", "aria-label") == "Pause"
    tab.wait("!window.chutelab.state.playing")
    assert tab.state["t"] == tab.state["span"][1]
    assert tab.page.get_attribute("#play", "aria-label") == "Play"
    assert "lands on the outgoing belt" in tab.page.inner_text("#caption")


def test_a_drag_goes_through_time_and_a_tap_plays(browser, file):
    tab = Tab(browser, file, viewport=PHONE, has_touch=True)
    box = tab.page.locator("#scene").bounding_box()
    y = box["y"] + box["height"] / 2
    tab.page.mouse.move(box["x"] + 20, y)
    tab.page.mouse.down()
    tab.page.mouse.move(box["x"] + 20 + box["width"] / 2, y, steps=4)
    tab.page.mouse.up()
    state = tab.state
    middle = sum(state["span"]) / 2
    assert state["t"] == pytest.approx(middle, abs=0.02 * (state["span"][1] - state["span"][0]))
    assert not state["playing"]
    tab.page.touchscreen.tap(box["x"] + 50, y)
    tab.wait("window.chutelab.state.playing")
    assert tab.trouble == []
    tab.context.close()


def test_a_position_without_a_run_says_so_and_leads_back(tab):
    tab.slide(45)
    assert "never meets the plate" in tab.page.inner_text("#refused")
    assert tab.page.locator("#caption").is_hidden()
    assert set(tab.page.locator("#energy td").all_inner_texts()) == {"–"}
    tab.wait("document.getElementById('summary').innerText.includes('never')")
    tab.page.click("#refused button")
    assert tab.state["values"] == [82.0]
    assert tab.page.locator("#refused").is_hidden()


def test_numbers_are_copied_with_all_digits_and_downloaded_for_all_variants(
    tab, recordings, tmp_path
):
    tab.context.grant_permissions(["clipboard-read", "clipboard-write"])
    tab.page.click("#copy")
    tab.wait("document.getElementById('copied').innerText === 'copied'")
    copied = {
        line.split("\t")[0]: line.split("\t")[1:]
        for line in tab.page.evaluate("navigator.clipboard.readText()").splitlines()
    }
    assert copied["plate.angle_deg"] == ["40", "", "°"]
    x = float(landing_of(recordings[OWN])["position"][0])
    assert float(copied["Lands at x"][0]) == x

    with tab.page.expect_download() as waiting:
        tab.page.click("#download")
    waiting.value.save_as(tmp_path / "numbers.csv")
    text = (tmp_path / "numbers.csv").read_text(encoding="utf-8-sig")
    rows = list(csv.DictReader(StringIO(text)))
    assert [float(row["plate.angle_deg (°)"]) for row in rows] == pytest.approx(ANGLES.tolist())
    for row, recording in zip(rows, recordings, strict=True):
        if recording is None:
            assert row["landing.x (m)"] == ""
            assert "never meets" in row["fault"]
        else:
            assert float(row["landing.x (m)"]) == landing_of(recording)["position"][0]


def test_it_speaks_to_a_screen_reader(tab):
    said = tab.page.inner_text("#summary")
    assert "Angle α from the vertical: 40°." in said
    assert "strikes the plate at 0.548 s" in said
    assert "lands at x = 0.209 m" in said
    assert tab.page.get_attribute("#summary", "role") == "status"
    tab.press("ArrowUp")
    tab.wait("document.getElementById('summary').innerText.includes('42°')")
    assert tab.page.get_attribute("#slider-0", "aria-valuetext") == "42°"
    for role, name in (
        ("slider", "Angle α from the vertical plate.angle_deg"),
        ("slider", "Time"),
        ("button", "Play"),
        ("combobox", "Speed"),
        ("checkbox", "Analytic parabola"),
        ("table", "Energy now"),
    ):
        assert tab.page.get_by_role(role, name=name, exact=True).count() == 1
    unnamed = tab.page.evaluate(
        """[...document.querySelectorAll("input, select, button")]
            .filter((e) => !e.labels?.length && !e.ariaLabel && !e.innerText.trim()).length"""
    )
    assert unnamed == 0


def test_who_wants_less_motion_gets_still_pictures(browser, file):
    tab = Tab(browser, file, reduced_motion="reduce")
    begin = tab.state["t"]
    tab.press(" ")
    tab.wait(f"window.chutelab.state.t > {begin}")
    strobes = (tab.state["t"] - begin) / 0.02
    assert strobes == pytest.approx(round(strobes), abs=1e-9)
    assert tab.state["playing"]
    tab.context.close()


@pytest.mark.parametrize("scheme", ["light", "dark"])
@pytest.mark.parametrize("size", [PHONE, DESKTOP], ids=["phone", "desktop"])
def test_it_shows_something_and_fits(browser, file, size, scheme):
    tab = Tab(browser, file, viewport=size, color_scheme=scheme)
    assert tab.page.evaluate("document.documentElement.scrollWidth") == size["width"]
    image = np.asarray(Image.open(BytesIO(tab.page.screenshot())).convert("RGB")).astype(int)
    paper = image[3, 3]
    assert (paper.mean() > 200.0) == (scheme == "light")
    canvas = tab.page.locator("#scene").screenshot()
    drawn = np.asarray(Image.open(BytesIO(canvas)).convert("RGB")).astype(int)
    ground = np.median(drawn.reshape(-1, 3), axis=0)
    share = np.mean(np.abs(drawn - ground).max(axis=-1) > 60)
    assert 0.01 < share < 0.3
    orange, green = ((230, 159, 0), (0, 158, 115) if scheme == "light" else (47, 199, 154))
    for colour in (orange, green):
        assert np.mean(np.abs(drawn - np.array(colour)).max(axis=-1) < 40) > 1e-3
    targets = tab.page.evaluate(
        """[...document.querySelectorAll(".transport button")]
            .map((b) => Math.min(b.offsetWidth, b.offsetHeight))"""
    )
    assert min(targets) >= 44
    assert tab.trouble == []
    tab.context.close()


def test_two_sliders_move_independently(browser, tmp_path):
    scene = scenes.load("inclined-40")
    written = page.write(
        scene, ["plate.angle_deg=20:60:3", "incoming.speed=1.5,2,2.5"], tmp_path / "two.html"
    )
    tab = Tab(browser, written.path)
    assert tab.state["values"] == [40.0, 2.0]
    tab.press("ArrowUp", ".")
    assert tab.state["values"] == [60.0, 2.5]
    changes = ["plate.angle_deg=60", "incoming.speed=2.5"]
    event = landing_of(chutelab.simulate(scenes.load("inclined-40", changes)))
    assert tab.state["landing"]["x"] == pytest.approx(event["position"][0], abs=1e-12)
    tab.press(",", ",")
    assert tab.state["values"] == [60.0, 1.5]
    assert tab.trouble == []
    tab.context.close()
