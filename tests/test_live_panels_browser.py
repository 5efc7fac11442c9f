"""Panels and tools of the live page under a pointer and under the keyboard alone."""

import re
from pathlib import Path

import numpy as np
import pytest

import chutelab
from chutelab.results.loads import borne
from chutelab.results.sensors import readings, sensed
from chutelab.scene import load, parse, to_toml
from live.browser import DONE

playwright = pytest.importorskip(
    "playwright.sync_api", reason='needs Playwright: pip install "chutelab[test]"'
)


def said_by(page, selector):
    return page.get_attribute(selector, "aria-valuetext")


def numbers_in(text):
    plain = text.replace("\N{MINUS SIGN}", "-").replace(",", " ")
    return [float(number) for number in re.findall(r"-?\d+\.\d+", plain)]


def middle_of(page, selector):
    box = page.locator(selector).bounding_box()
    return box["x"] + 0.5 * box["width"], box["y"] + 0.5 * box["height"]


@pytest.mark.slow
def test_tape_and_tracer_with_the_keyboard_alone(shown):
    page = shown("perpendicular")
    page.focus("#undo")
    for _ in range(30):
        page.keyboard.press("Tab")
        if page.evaluate("document.activeElement.id") == "tool-tape":
            break
    assert page.evaluate("document.activeElement.id") == "tool-tape"
    page.keyboard.press("Enter")
    assert page.get_attribute("#tool-tape", "aria-pressed") == "true"
    end = '[data-id="tape-1"]'
    assert page.get_attribute(end, "role") == "slider"
    *_, x, y = numbers_in(said_by(page, end))
    *_, x0, y0 = numbers_in(said_by(page, '[data-id="tape-0"]'))
    page.focus(end)
    for key in ("ArrowRight", "ArrowRight", "ArrowUp"):
        page.keyboard.press(key)
    assert page.evaluate("document.activeElement.dataset.id") == "tape-1"
    now = numbers_in(said_by(page, end))
    # Arrow keys go to whole hundredths.
    x, y = round(x + 0.02, 2), round(y + 0.01, 2)
    wanted = [np.hypot(x - x0, y - y0), x - x0, y - y0, x, y]
    assert now == pytest.approx(wanted, abs=6e-4)

    page.focus("#tool-tracer")
    page.keyboard.press("Enter")
    page.focus('[data-id="tracer"]')
    for _ in range(13):
        page.keyboard.press("ArrowRight")
    t, x, y, v = numbers_in(said_by(page, '[data-id="tracer"]'))
    # At a strobe dot, 0.05 s apart; carried for 0.5 s, then a parabola.
    assert t == 0.65
    fall = 0.15
    top = 0.1 + 0.006
    assert (x, y) == pytest.approx((2.0 * fall, top - 0.5 * 9.81 * fall**2), abs=6e-4)
    assert v == pytest.approx(np.hypot(2.0, 9.81 * fall), abs=6e-4)


@pytest.mark.slow
def test_tape_and_tracer_with_a_pointer(shown):
    page = shown("perpendicular")
    page.click("#tool-tape")
    scale = page.evaluate("chutelab.stage.view.scale")
    before = numbers_in(said_by(page, '[data-id="tape-0"]'))
    x, y = middle_of(page, '[data-id="tape-0"] .knob')
    page.mouse.move(x, y)
    page.mouse.down()
    page.mouse.move(x - 30, y - 40, steps=4)
    page.mouse.up()
    after = numbers_in(said_by(page, '[data-id="tape-0"]'))
    assert after[3] - before[3] == pytest.approx(-30 / scale, abs=2 / scale)
    assert after[4] - before[4] == pytest.approx(40 / scale, abs=2 / scale)

    page.click("#tool-tracer")
    home = page.locator("#stage").bounding_box()
    place = """t => { const { x, y } = chutelab.lab.recording.tracks[0].state(t);
      return [chutelab.stage.view.px(x), chutelab.stage.view.py(y)]; }"""
    px, py = page.evaluate(place, 0.7)
    page.mouse.move(home["x"] + px + 2, home["y"] + py + 2)
    traced = re.compile(r"^t = 0\.700 s")
    playwright.expect(page.locator('[data-id="tracer"]')).to_have_attribute(
        "aria-valuetext", traced
    )


@pytest.mark.slow
def test_curves_are_read_off_and_set_the_time(shown):
    page = shown("perpendicular")
    page.focus(".curves")
    page.keyboard.press("Home")
    for _ in range(3):
        page.keyboard.press("PageUp")
    end = page.evaluate("chutelab.lab.end")
    t, x, y, vx, vy, v, *_ = numbers_in(said_by(page, ".curves"))
    assert t == pytest.approx(0.3 * end, abs=6e-4)
    # Still carried by the belt, which begins 1 m before the pulley's axis.
    assert (x, y, vx, vy, v) == pytest.approx((-1.0 + 2.0 * 0.3 * end, 0.106, 2, 0, 2), abs=6e-4)
    assert page.evaluate("chutelab.lab.t") == 0.0
    page.keyboard.press("Enter")
    assert page.evaluate("chutelab.lab.t") == pytest.approx(0.3 * end, rel=1e-9)
    page.locator(".curves .chart >> nth=1").scroll_into_view_if_needed()
    px, py = middle_of(page, ".curves .chart >> nth=1")
    page.mouse.click(px, py)
    # The axis takes a share of the narrow panel.
    assert 0.35 * end < page.evaluate("chutelab.lab.t") < 0.55 * end


def test_no_curve_jumps_at_the_end_what_the_landing_leaves_is_a_dot(shown):
    """A track that ends with a blow: v_y from -4.277 m/s to 0, which is no line upright."""
    page = shown("perpendicular")
    page.locator("#curves").scroll_into_view_if_needed()
    lines = page.evaluate("""[...document.querySelectorAll(".curve")].map((line) =>
      [...line.points].map(({ x, y }) => [x, y]))""")
    dots = page.evaluate("""[...document.querySelectorAll(".curves .last")].map((dot) =>
      [dot.cx.baseVal.value, dot.cy.baseVal.value])""")
    assert len(lines) == len(dots) >= 7
    # x and y go on smoothly into their dots; the velocity is another one after the landing.
    for line, dot in zip(lines[:2], dots[:2], strict=True):
        assert line[-1] == pytest.approx(dot, abs=0.6)
    (vx, vy), (x_dot, y_dot) = (lines[2][-1], lines[3][-1]), dots[2:4]
    assert abs(vy[1] - y_dot[1]) > 20.0
    assert abs(vx[1] - x_dot[1]) > 10.0
    # Of the line that falls through the last tenth of the time each step is small.
    steps = [abs(b[1] - a[1]) for a, b in zip(lines[3][-16:], lines[3][-15:], strict=False)]
    assert max(steps) < 3.0


@pytest.mark.slow
@pytest.mark.parametrize("name", ["hopper", "stream"])
def test_while_a_crowd_runs_its_energy_at_the_release_stays(shown, name):
    """Heights count from the machine's lowest point, which no particle moves: at one time the
    ledger is the same however far the run has come, for all and for one.
    """
    page = shown(name, ["stream.count=60"])
    told = page.evaluate("""async () => {
      const { lab, panels } = chutelab, frame = () => new Promise(requestAnimationFrame);
      const curves = panels.find(({ samples }) => samples), told = [];
      const cells = [..."start kinetic potential".split(" ")].map((id) =>
        document.querySelector(`#energy tr[data-id=${id}] td`));
      lab.seek(0.3);
      for (let n = 1; n < 12; n += 1) {
        await frame();
        await frame();
        panels.find(({ cells }) => cells).refresh();
        curves.draw();
        told.push([...cells.map((cell) => cell.textContent), curves.samples[0].potential]);
        lab.engine.allow(0.2 * n);
        for (let k = 0; k < 4; k += 1) await frame();
      }
      return [told, lab.recording.now];
    }""")
    assert told[1] > 0.5
    assert told[0] == [told[0][0]] * 11
    assert told[0][0][3] > 0.0


@pytest.mark.slow
def test_the_numbers_of_a_crowd_lead_and_what_is_computed_is_hatched(shown):
    page = shown("hopper", ["stream.count=60"])
    assert page.locator("#panels > .card:visible").first.get_attribute("id") == "numbers"
    assert page.locator("#numbers tr:visible").first.get_attribute("data-id") == "released"
    assert "as far as it is computed" in page.inner_text("#numbers caption")
    hatched = """() => [document.querySelector(".scrub").matches(".computing"),
      Number(document.querySelector(".scrub").style.getPropertyValue("--ready")),
      chutelab.lab.end / chutelab.lab.horizon]"""
    page.evaluate("chutelab.lab.tell('time')")
    on, ready, share = page.evaluate(hatched)
    assert on
    assert 0.0 < ready < 1.0
    assert ready == round(share, 3)
    # Time goes no further than what is computed, wherever one points.
    page.evaluate("chutelab.lab.seek(chutelab.lab.horizon)")
    assert page.evaluate("chutelab.lab.t <= chutelab.lab.end")
    page.evaluate("""() => new Promise((done) => {
      chutelab.lab.on("run", () => chutelab.lab.recording.state === "done" && done());
      chutelab.lab.engine.allow(1e6);
    })""")
    page.evaluate("chutelab.lab.tell('time')")
    assert page.evaluate(hatched)[:2] == [False, 1.0]
    assert shown("perpendicular").locator(".computing").count() == 0


MARKS = """[...document.querySelectorAll(".marks > *")].map((one) => ({
  says: one.getAttribute("aria-label"), at: Number(one.style.getPropertyValue("--at")),
  tip: getComputedStyle(one, "::after").content, done: one.matches(".done"),
  left: one.getBoundingClientRect().left, stop: one.tabIndex }))"""


@pytest.mark.slow
def test_marks_on_the_time_tell_what_happens_and_lead_there(shown):
    page = shown("inclined-40", viewport={"width": 1366, "height": 768})
    events = chutelab.simulate("inclined-40", engine="exact").events
    times = [float(events["t"][events["kind"] == kind][0]) for kind in (1, 3, 4)]
    words = ["leaves the belt", "impact: plate", "lands"]
    says = [f"{word}, {t:.3f} s" for word, t in zip(words, times, strict=True)]
    marks = page.evaluate(MARKS)
    assert [mark["says"] for mark in marks] == says
    assert [mark["at"] for mark in marks] == pytest.approx([t / times[-1] for t in times])
    # The keyboard stops at one of them, the next are reached by arrows.
    assert [mark["stop"] for mark in marks] == [0, -1, -1]
    page.focus("#picture")
    for n, key in ((0, "."), (1, "."), (2, "."), (1, ","), (0, ",")):
        page.keyboard.press(key)
        assert page.evaluate("chutelab.lab.t") == pytest.approx(times[n], abs=1e-9)
        assert said_by(page, "#time") == says[n]
        tips = [mark["tip"] for mark in page.evaluate(MARKS)]
        assert tips == ["none"] * n + [f'"{says[n]}"'] + ["none"] * (2 - n)
    # What it says lets the pointer through to what is below, and goes after a while.
    says_now = page.locator(".marks .now")
    hit = says_now.evaluate("""(one) => {
      const { left, top } = one.getBoundingClientRect();
      return document.elementFromPoint(left + 20, top - 20).closest(".marks");
    }""")
    assert hit is None
    shows = "(one) => getComputedStyle(one, '::after').visibility"
    assert says_now.evaluate(shows) == "visible"
    page.evaluate("document.getAnimations().forEach((one) => one.finish())")
    assert says_now.evaluate(shows) == "hidden"
    page.locator(".marks button").nth(2).click()
    assert [mark["done"] for mark in page.evaluate(MARKS)] == [True] * 3
    page.keyboard.press("ArrowLeft")
    assert page.evaluate("chutelab.lab.t") == pytest.approx(times[1], abs=1e-9)
    page.evaluate("chutelab.lab.seek(0)")
    page.locator(".marks button").nth(0).hover()
    assert page.evaluate(MARKS)[0]["tip"] == f'"{says[0]}"'
    # What comes to rest by ever shorter hops has marks that can be told apart, and none is lost.
    page = shown("free-fall", ["run.until=settled"], viewport={"width": 1366, "height": 768})
    marks = page.evaluate(MARKS)
    lefts = [mark["left"] for mark in marks]
    assert min(np.diff(lefts)) >= 24
    assert len(page.evaluate("chutelab.lab.recording.events")) > len(marks) > 3
    assert [mark for mark in marks if mark["says"].endswith("\N{HORIZONTAL ELLIPSIS}")]
    # On a phone they are ticks beside no finger's way; of what is to be predicted there are none.
    phone = {"viewport": {"width": 390, "height": 844}, "has_touch": True}
    page = shown("inclined-40", language="de", **phone)
    playwright.expect(page.locator(".marks i")).to_have_count(3)
    playwright.expect(page.locator(".marks button")).to_have_count(0)
    page.focus("#time")
    page.keyboard.press(".")
    assert said_by(page, "#time") == f"verlässt das Band, {times[0]:.3f} s".replace(".", ",")
    page = shown("inclined-40", more="\n[live]\npredict = true\n")
    playwright.expect(page.locator(".marks > *")).to_have_count(0)


@pytest.mark.slow
def test_a_streams_arrivals_fill_up_with_time_and_a_lone_particle_has_none(shown):
    assert shown("perpendicular").locator("#landing").is_hidden()
    page = shown("stream-independent", ["stream.count=60"], language="de")
    result = page.locator("#landing .result")
    playwright.expect(result).to_have_text(re.compile("^Mittelwert von 60: x = 0,4"))
    times = page.evaluate(
        "chutelab.panels.find(({ arrivals }) => arrivals).arrivals.map(({ t }) => t)"
    )
    assert len(times) == 60
    page.evaluate("t => chutelab.lab.seek(t)", 0.5 * (times[29] + times[30]))
    playwright.expect(result).to_have_text(re.compile("^Mittelwert von 30:"))
    crowd = page.locator("#numbers .crowd")
    playwright.expect(crowd).to_contain_text(re.compile("ausgegeben\\s*60 / 60"))
    playwright.expect(crowd).to_contain_text(
        re.compile("Ort der Ankunft, Mittelwert ± Streuung\\s*0,4")
    )
    playwright.expect(page.locator("#stage .envelope")).to_have_count(1)
    playwright.expect(page.locator("#stage .track")).to_have_count(1)
    # Particle 0 on request.
    table = page.locator("#numbers table:not(.crowd)")
    assert table.is_hidden()
    page.locator("#numbers summary", has_text="Teilchen 0").click()
    # A long word may part.
    assert "φ₁ Ablösewinkel" in table.inner_text().replace("\N{SOFT HYPHEN}", "")
    page = shown("stream-independent", ["stream.count=12"], language="de")
    playwright.expect(page.locator("#numbers .crowd")).to_be_hidden()
    assert "Mittel von 12" in page.locator("#numbers").inner_text()


EDGES = """() => { const { view } = chutelab.stage, { left, right, top, bottom } = view.free;
  return [view.worldX(left), view.worldY(bottom), view.worldX(right), view.worldY(top)]; }"""


def test_the_page_shows_the_machine_not_the_fall_and_what_a_view_says(shown):
    # It misses the belt, which is far away, and falls to 1 m below all: some of that is shown.
    small = ["incoming.pulley_radius=0.02", "incoming.length=0.1", "plate.distance=0.05"]
    small += ["plate.above=0.02", "plate.below=0.03", "outgoing.drop_from=top"]
    small += ["outgoing.drop=0.1", "outgoing.start=1", "outgoing.length=0.1", "run.until=3"]
    page = shown("perpendicular", small)
    gone = page.evaluate("chutelab.lab.recording.tracks[0].state(1e9).y")
    assert gone == pytest.approx(-1.08, abs=1e-9)
    left, bottom, right, top = page.evaluate(EDGES)
    assert left < -0.02
    assert bottom > -0.5
    assert right > 0.07
    page = shown("perpendicular", more="[view]\nfrom = [-0.2, -0.5]\nto = [0.8, 0.3]\n")
    left, bottom, right, top = page.evaluate(EDGES)
    assert left <= -0.2 + 1e-9
    assert bottom <= -0.5 + 1e-9
    assert right >= 0.8 - 1e-9
    assert top >= 0.3 - 1e-9
    assert min((right - left) / 1.0, (top - bottom) / 0.8) == pytest.approx(1.0, rel=1e-9)
    # A new corner is shown at once.
    page.evaluate("chutelab.lab.change({ 'view.to': [1.8, 1.3] })")
    left, bottom, right, top = page.evaluate(EDGES)
    assert min((right - left) / 2.0, (top - bottom) / 1.8) == pytest.approx(1.0, rel=1e-9)


DAMAGE = """([column, change]) => {
  const { lab } = chutelab, [{ rows, count }] = lab.recording.tracks, n = (count - 1) * 11 + column;
  const sound = rows[n];
  rows[n] += change;
  lab.judge(lab.recording);
  // What is judged is a copy; no curve is drawn through what is no number.
  rows[n] = sound;
}"""


@pytest.mark.parametrize("language", ["en", "de"])
def test_the_energy_of_a_crowd_is_balanced_after_changes_during_its_run(shown, language):
    """Σ energies - start - work + losses - given = residual: rounding, and what a step leaves.

    With other friction nothing is given, and no entry jumps. What the particles that are taken away
    had beyond their own balance they got from others: of that the rest gave the opposite.
    """
    page = shown("hopper", ["stream.count=120"], language=language)
    page.evaluate("chutelab.lab.allow(1e9)")
    page.evaluate(DONE)
    balances = """(from) => {
      const { recording } = chutelab.lab, found = [];
      for (let t = from; t < recording.end; t += 1 / 60) {
        const at = recording.ledger(t), losses = at.friction_loss + at.restitution_loss;
        const whole = at.kinetic + at.potential, { start, belt_work, changed, residual } = at;
        found.push([whole - start - belt_work + losses - changed, residual, changed, losses,
          Math.abs(start) + Math.abs(at.potential) + losses]);
      }
      return found;
    }"""
    change = """async ([t, values]) => {
      const { lab } = chutelab, before = lab.recording.ledger(t);
      lab.seek(t);
      lab.change(values);
      return [before.friction_loss, lab.recording.ledger(t).friction_loss];
    }"""
    entry = page.locator("#energy tr[data-id=changed]")
    friction = page.evaluate(change, [0.75, {"surface[0].friction": 0.7}])
    page.evaluate(DONE)
    page.evaluate("chutelab.lab.allow(1e9)")
    page.evaluate(DONE)
    off, residual, changed, _, size = np.array(page.evaluate(balances, 0.0)).T
    assert friction[0] == pytest.approx(friction[1], rel=1e-9)
    for one in (off, residual, changed):
        assert np.abs(one).max() < 1e-12 * size.max()
    assert entry.is_hidden()
    open_ = page.evaluate("""() => {
      const { recording } = chutelab.lab;
      return recording.tracks.slice(80).reduce((sum, _, n) =>
        sum + (recording.ledgerOf(80 + n, 0.85)?.residual ?? 0), 0);
    }""")
    page.evaluate(change, [0.85, {"stream.count": 80}])
    page.evaluate(DONE)
    page.evaluate("chutelab.lab.allow(1e9)")
    page.evaluate(DONE)
    off, residual, changed, losses, size = np.array(page.evaluate(balances, 0.86)).T
    assert np.abs(off).max() < 1e-12 * size.max()
    assert np.abs(residual).max() < 1e-12 * size.max()
    assert np.ptp(changed) < 1e-12 * size.max()
    assert abs(changed[0]) > 1e-3 * size.max()
    assert changed[0] == pytest.approx(-open_, rel=1e-2)
    assert (np.diff(losses) > -1e-6 * losses[-1]).all()
    name = {"en": "from changes", "de": "durch Änderungen"}[language]
    assert name in entry.inner_text()
    # What a step itself leaves is still the residual.
    left = page.evaluate("""() => {
      const { recording } = chutelab.lab, t = 0.951, [before, after] = recording.stepAt(t);
      before[1] += 0.001;
      after[1] += 0.001;
      return recording.ledger(t).residual;
    }""")
    assert left == pytest.approx(1e-3, abs=1e-9)


def test_the_energy_of_joined_particles_is_there_from_their_release_on(shown):
    """One ball of the cradle, a sphere of steel on 0.4 m of string, is lifted by 30°, at rest:
    m g L (1 - cos 30°).
    """
    page = shown("cradle")
    energy = 7850.0 * 4.0 / 3.0 * np.pi * 0.02**3 * 9.81 * 0.4 * (1.0 - np.cos(np.pi / 6.0))
    for t in (0.0, 1e-4, 0.3, 1.0):
        page.evaluate(f"chutelab.lab.seek({t})")
        told = page.locator("#energy tr[data-id=start] td")
        playwright.expect(told).to_have_text(f"{1e3 * energy:.1f} mJ")
        # The part of the bar is a new element in each frame.
        full, bar = page.evaluate("""["#put-in", "#put-in i"].map((part) =>
          document.querySelector(part).getBoundingClientRect().width)""")
        assert bar > 0.98 * full


def test_a_page_shows_no_work_and_no_numbers_that_its_machine_has_not(shown, tmp_path):
    """A see-saw has no drive and no belt. A lone ball falls from height 0: m g y = -½ m g² t²."""
    for name, has in (("see-saw", False), ("perpendicular", True)):
        page = shown(name)
        assert page.locator("#energy tr[data-id=kinetic]").is_visible()
        assert page.locator("#energy tr[data-id=belt_work]").is_visible() is has
        assert page.locator("#numbers").is_visible() is has
        assert page.locator("#numbers .of-rail").is_visible() is has
    # No closed form has a plate on a hinge, and no column has dashes alone.
    page = shown("damper-plate")
    assert not page.locator("#numbers .of-rail").is_visible()
    assert all(text[-1].isdigit() for text in page.locator("#numbers td").all_inner_texts() if text)
    alone = tmp_path / "alone.toml"
    alone.write_text("[particle]\nradius = 0.01\nmass = 0.02\n[stream]\nat = [0.0, 0.5]\n"
                     "velocity = [0.0, 0.0]\n[run]\nuntil = 0.5\n")  # fmt: skip
    page = shown(alone)
    page.evaluate("chutelab.lab.seek(0.4)")
    fallen = 1e3 * 0.5 * 0.02 * (9.81 * 0.4) ** 2
    told = page.locator("#energy tr[data-id=potential] td")
    playwright.expect(told).to_have_text(f"\N{MINUS SIGN}{fallen:.1f} mJ")
    assert "where the lowest particle is released" in page.locator("#energy").inner_text()


@pytest.mark.parametrize("name", ["dominoes", "drum", "flap-gate"])
def test_the_energy_of_a_crowd_is_balanced_in_every_frame(shown, name):
    """Within a step the paths of a crowd are curves; Σ energies - Σ work + Σ losses stays."""
    page = shown(name)
    page.evaluate("chutelab.lab.allow(1e9)")
    page.evaluate(DONE)
    frames = """() => {
      const { recording } = chutelab.lab, found = [];
      for (let n = 0; n < 60 * recording.end; n += 1) {
        const at = recording.ledger(n / 60);
        const losses = at.friction_loss + at.restitution_loss + at.damper_loss;
        const whole = at.kinetic + at.potential + at.spring;
        found.push([whole - at.start - at.belt_work + losses, at.residual, whole + losses]);
      }
      return found;
    }"""
    off, residual, size = np.array(page.evaluate(frames)).T
    assert np.abs(off).max() < 1e-12 * size.max()
    assert np.abs(residual).max() < 1e-12 * size.max()
    # What a step itself leaves is the residual.
    missing = page.evaluate("""() => {
      const { recording } = chutelab.lab, t = 0.301, [before, after] = recording.stepAt(t);
      before[1] += 0.001;
      after[1] += 0.002;
      return [recording.ledger(t).residual, recording.stepAt(t)[2]];
    }""")
    assert missing[0] == pytest.approx(1e-3 + 1e-3 * missing[1], abs=1e-12)
    assert 0.0 < missing[1] < 1.0


def test_what_a_flap_takes_and_gives_is_no_work_of_drives(shown):
    """Between steps, and where a run is computed in part, it is not balanced to the last digit."""
    page = shown("flap-gate")
    page.evaluate("chutelab.lab.allow(1e9)")
    page.evaluate(DONE)
    seen = """() => {
      const { lab } = chutelab, row = document.querySelector("#energy tr[data-id=belt_work]");
      let many = 0, most = 0;
      for (let n = 0; n < 400; n += 1) {
        lab.seek(n / 200);
        many += !row.hidden;
        most = Math.max(most, Math.abs(lab.recording.ledger(lab.t).belt_work));
      }
      return [many, most];
    }"""
    many, most = page.evaluate(seen)
    assert many == 0
    assert 0.0 < most < 1e-3
    # As in the middle of an impact.
    page.evaluate("""() => {
      const { lab } = chutelab, { recording } = lab, ledger = recording.ledger.bind(recording);
      recording.ledger = (t) => ({ ...ledger(t), belt_work: -0.015 });
      lab.tell("run");
    }""")
    assert page.locator("#numbers tr[data-id=released]").count() == 1
    assert page.locator("#numbers tr[data-id=power]").count() == 0


def test_a_broken_law_is_told_below_the_picture(shown):
    """A sound run has no such line; one whose last knot is off has it, in the page's language."""
    page = shown("perpendicular", language="de")
    line = page.locator("#law")
    page.evaluate(DAMAGE, [3, 0.0])
    page.wait_for_timeout(300)
    assert line.is_hidden()
    page.evaluate(DAMAGE, [3, 0.5])
    playwright.expect(line).to_be_visible()
    playwright.expect(line).to_contain_text("Gesetz verletzt: die Bilanz geht nicht auf.")
    # Another run of the scene is sound again.
    page.evaluate("chutelab.lab.change({ 'plate.distance': 0.45 })")
    playwright.expect(line).to_be_hidden()
    page.evaluate(DAMAGE, [0, float("nan")])
    playwright.expect(line).to_contain_text("endlich")


def wait(page, condition):
    """A page without `eval` cannot be waited for by Playwright's own conditions."""
    look = f"const look = () => ({condition} ? resolve() : setTimeout(look, 20));"
    page.evaluate(f"() => new Promise((resolve) => {{ {look} look(); }})")


PASSAGES = "ends => { const { flow } = chutelab.tools; flow.show(ends); return flow.passages; }"


def test_a_flow_line_counts_a_throw_on_its_way_up_and_on_its_way_down(shown):
    throw = Path(__file__).parents[1] / "lessons" / "01-the-parabola" / "throw.toml"
    page = shown(str(throw), ["incoming.incline_deg=20"])
    first = page.evaluate("() => chutelab.lab.recording.events.find(({ kind }) => kind === 1)")
    (u, v, *_), t0, x0, y0 = first["after"], first["t"], first["x"], first["y"]
    # v t - g t²/2 = rise: on the parabola between two knots, once up and once down.
    rise = 0.9 * v**2 / (2 * 9.81)
    roots = v / 9.81 + np.array([-1.0, 1.0]) * np.sqrt(v**2 - 2 * 9.81 * rise) / 9.81
    found = page.evaluate(PASSAGES, [[x0 - 1.0, y0 + rise], [x0 + 3.0, y0 + rise]])
    assert [passage["t"] for passage in found] == pytest.approx(t0 + roots, abs=1e-12)
    assert [passage["at"] for passage in found] == pytest.approx(1.0 + u * roots, abs=1e-12)
    # To the left of a line to the right is above it.
    assert [passage["way"] for passage in found] == [-1, 1]
    assert page.evaluate(PASSAGES, [[x0 - 2.0, y0 + rise], [x0 - 1.0, y0 + rise]]) == []


@pytest.mark.slow
def test_a_flow_line_counts_a_crowd_as_python_finds_it_by_small_steps(shown):
    overrides = ["stream.count=40", "run.until='settled'"]
    page = shown("stream", overrides)
    ends = np.array([[0.45, -0.45], [0.65, -0.35]])
    recording = chutelab.simulate("stream", overrides, engine="contact")
    times = np.arange(0.0, recording.t.max(), 5e-5)
    along = (ends[1] - ends[0]) / np.hypot(*(ends[1] - ends[0]))
    places, wanted = recording.at(times)[0] - ends[0], []
    for track in range(40):
        x, y = places[:, track].T
        left, at = along[0] * y - along[1] * x, along[0] * x + along[1] * y
        inside = (at[:-1] >= 0.0) & (at[:-1] <= np.hypot(*(ends[1] - ends[0])))
        passing = np.flatnonzero(inside & ((left[:-1] < 0) != (left[1:] < 0)))
        wanted.extend(zip(times[passing], at[passing], strict=True))
    page.evaluate("chutelab.lab.play()")
    wait(page, "chutelab.lab.recording.state !== 'running'")
    found = page.evaluate(PASSAGES, ends.tolist())
    assert len(found) == len(wanted) > 20
    seen = [(passage["t"], passage["at"]) for passage in found]
    assert seen == pytest.approx(np.array(sorted(wanted)), abs=2e-4)
    page.evaluate("chutelab.lab.seek(1e9)")
    said = page.text_content("#flow .result")
    assert f"{len(wanted)} of 40 so far" in said


SENSORS = """
[[sensor]]
name = "slot"
from = [-0.1, -0.03]
to = [0.1, -0.03]
[[sensor]]
name = "upward"
from = [0.05, 0.3]
to = [-0.05, 0.3]
"""


@pytest.mark.slow
def test_loads_are_those_of_python_with_arrows_where_they_press(shown):
    options = ["stream.count=40", "run.until=1.2", "run.loads=0.02"]
    page = shown("hopper", options, viewport={"width": 1366, "height": 768}, language="de")
    page.evaluate("chutelab.lab.engine.allow(1e9)")
    wait(page, "chutelab.lab.recording.state === 'done'")
    recording = chutelab.simulate(load("hopper", options), engine="contact")
    told = borne(recording)
    assert len(told) >= 3
    page.evaluate("chutelab.lab.seek(0.61)")
    found = {one["name"]: one for one in page.evaluate("chutelab.loads.loads")}
    assert found.keys() == told.keys()
    for name, one in told.items():
        part, its = one.part("normal"), found[name]
        assert its["mean"] == pytest.approx(part.mean, rel=1e-12)
        assert its["peak"] == pytest.approx(part.peak, rel=1e-12)
        pressed = one.normal[30] if len(one.normal) > 30 else 0.0
        assert its["now"] == pytest.approx(pressed, rel=1e-12)
        if pressed > 0.0:
            assert its["force"] == pytest.approx(one.force[30].tolist(), rel=1e-12)
            assert its["place"] == pytest.approx(one.place[30].tolist(), rel=1e-9)
    playwright.expect(page.locator("#loads tr[data-id]")).to_have_count(len(told))
    # The menu has them counted in any scene, and no more; the run is the same.
    knots = "chutelab.lab.recording.tracks.map(({ count, end }) => [count, end])"
    before = page.evaluate(knots)
    page.click("#show > summary")
    page.uncheck("#show-loads")
    playwright.expect(page.locator("#loads")).to_be_hidden()
    page.evaluate("chutelab.lab.engine.allow(1e9)")
    wait(page, "chutelab.lab.recording.state === 'done'")
    assert page.evaluate(knots) == before
    assert page.evaluate("chutelab.loads.loads") == []


@pytest.mark.slow
def test_sensors_tell_what_python_tells_of_the_same_run(shown):
    options = ["stream.count=60", "run.until=1.2", "surface.gate.opens_at=0.1", "stream.width=0.5"]
    page = shown("hopper", options, more=SENSORS, viewport={"width": 1366, "height": 768})
    page.evaluate("chutelab.lab.allow(1e9)")
    wait(page, "chutelab.lab.recording.state !== 'running'")
    page.evaluate("chutelab.lab.engine.allow(1e9)")
    scene = parse(to_toml(load("hopper", options)) + SENSORS)
    told = readings(chutelab.simulate(scene, engine="contact"))
    assert told["slot"].count > 20
    page.evaluate("chutelab.lab.engine.allow(1e9)")
    wait(page, "chutelab.lab.recording.state === 'done'")
    page.evaluate("chutelab.lab.seek(1e9)")
    table = page.locator("#sensors table")
    assert table.evaluate("(one) => one.scrollWidth <= one.parentElement.clientWidth")
    for name, its in page.evaluate("chutelab.sensors.readings"):
        wanted = told[name]
        assert (its["count"], its["back"]) == (wanted.count, wanted.back)
        quantiles = [wanted.speed[one] for one in ("q02", "q50", "q98")]
        for ours, theirs in zip(
            [its["rate"], its["speed"], *its["speeds"], its["flow"], its["whole"]],
            [wanted.rate, wanted.speed["mean"], *quantiles, wanted.mass_rate, wanted.whole_rate],
            strict=True,
        ):
            assert ours == pytest.approx(theirs, rel=1e-12, nan_ok=True)
    row = page.locator("#sensors tr[data-id=slot] td")
    playwright.expect(row.first).to_have_text(str(told["slot"].count))
    assert float(row.nth(1).inner_text()) == pytest.approx(told["slot"].rate, rel=1e-2)
    # Half-way only what has passed by then counts; a sensor that is moved does not run it anew.
    times = sensed_times(scene)
    page.evaluate("t => chutelab.lab.seek(t)", 0.5 * (times[9] + times[10]))
    assert page.evaluate("chutelab.sensors.readings")[0][1]["count"] == 10
    page.evaluate("globalThis.was = chutelab.lab.recording")
    page.evaluate("chutelab.lab.change({ 'sensor.slot.to': [-0.09, -0.03] })")
    assert page.evaluate("chutelab.lab.recording === was && was.state === 'done'")
    assert page.evaluate("chutelab.sensors.readings")[0][1]["count"] == 0
    page.click("#undo")
    assert page.evaluate("chutelab.sensors.readings")[0][1]["count"] == 10
    # One is drawn by its key, counts at once, can be renamed, and is in the file.
    page.evaluate("chutelab.lab.seek(1e9)")
    page.focus("#picture")
    page.keyboard.press("s")
    for place in ([-0.1, -0.05], [0.1, -0.05]):
        page.mouse.click(*page.evaluate(PLACE, place))
    page.keyboard.press("Escape")
    name, its = page.evaluate("chutelab.sensors.readings")[2]
    assert name == "sensor1"
    assert its["count"] == pytest.approx(told["slot"].count, abs=3)
    assert [one.name for one in parse(page.evaluate("chutelab.toml()")).sensor][2] == "sensor1"
    page.evaluate("chutelab.bench.inspector.choose('sensor1')")
    page.keyboard.press("Delete")
    playwright.expect(page.locator("#sensors tr[data-id]")).to_have_count(2)


def sensed_times(scene):
    """When particles pass the slot, s, from passages on the recorded curves."""
    found = sensed(chutelab.simulate(scene, engine="contact"), "slot")
    return found["t"][found["way"] > 0]


PLACE = """([x, y]) => {
  const { view, front } = chutelab.stage, box = front.getBoundingClientRect();
  return [box.left + view.px(x), box.top + view.py(y)];
}"""


TAPS = """() => {
  globalThis.taps = [];
  class Node { connect(next) { return next; } start() {} stop() {} }
  globalThis.AudioContext = class {
    resume() {} get currentTime() { return chutelab.lab.t; }
  };
  globalThis.GainNode = class extends Node {
    constructor(_, { gain }) { super(); taps.push(gain); }
    gain = { exponentialRampToValueAtTime() {} };
  };
  globalThis.OscillatorNode = Node;
}"""


HEARD = """() => {
  const { lab } = chutelab;
  lab.restart();
  lab.playing = true;
  while (lab.playing) lab.tick(1 / 60);
  return taps;
}"""


def test_impacts_sound_once_asked_louder_the_stronger(shown):
    """All frames are a sixtieth of a second here, and the clock of the sound is the run's."""
    page = shown("free-fall", ["stream.count=1"])
    page.evaluate(TAPS)
    assert page.evaluate(HEARD) == []
    page.click("#sound")
    assert page.get_attribute("#sound", "aria-pressed") == "true"
    heard = page.evaluate(HEARD)
    end, blows = page.evaluate("""() => {
      const { end, recording: { events } } = chutelab.lab;
      return [end, events.filter(({ kind }) => kind >= 3 && kind <= 5)
        .map(({ t, before: [a, b], after: [c, d] }) => [t, Math.hypot(c - a, d - b)])];
    }""")
    wanted, t, last = [], 0.0, -1.0
    strongest = max(strength for _, strength in blows)
    while t < end:
        since, t = t, min(t + 1.0 / 60.0, end)
        now = max((strength for when, strength in blows if since < when <= t), default=0.0)
        # At most 20 in a second; of those in one frame the strongest.
        if now == 0.0 or t - last < 0.05:
            continue
        last = t
        # Two decades of strength are heard.
        loud = 0.3 * (1.0 + np.log10(now / strongest) / 2.0)
        wanted += [loud] if loud > 0.0 else []
    assert heard == pytest.approx(wanted)
    assert max(heard) == pytest.approx(0.3)
    assert len(heard) > 3
    assert min(heard) < 0.2


@pytest.mark.slow
def test_a_video_of_the_picture_is_saved(shown):
    page = shown("perpendicular")
    with page.expect_download(timeout=30_000) as waiting:
        page.click("#film")
    video = waiting.value
    assert video.suggested_filename.endswith(".webm")
    content = video.path().read_bytes()
    # EBML, the container of WebM.
    assert content[:4] == b"\x1aE\xdf\xa3"
    assert len(content) > 10_000
    assert page.get_attribute("#film", "aria-pressed") == "false"
