"""Lessons played through in their pages: by mouse, touch and keyboard, right, wrong and odd."""

import json
import math
import re
from io import BytesIO
from pathlib import Path

import pytest
from pypdf import PdfReader

from chutelab.classroom.exercises import EXERCISES
from chutelab.classroom.exercises import lesson as exercise
from chutelab.classroom.exercises.exercise import draw
from chutelab.classroom.lessons import scene_of
from chutelab.classroom.lessons.steps import quantities_in
from chutelab.engines.simulation import simulate
from chutelab.results.quantities import measure
from live.browser import DONE, Hand, axe
from shared import find, lessons

expect = pytest.importorskip("playwright.sync_api").expect

WAYS = [("mouse", "odd"), ("touch", "wrong"), ("keyboard", "right")]
QUICK = ("landing", "touch")
PLAYED = [
    pytest.param(one.name, *way, marks=() if (one.name, way[0]) == QUICK else pytest.mark.slow)
    for one in lessons()
    for way in WAYS
]
"""Each lesson in each way; all but one are slow, and the mouse, which most other tests use."""

DESK, PHONE = (1366, 768), (390, 844)

FAR = {"mouse": DESK, "touch": PHONE, "keyboard": DESK}
"""By what a lesson is played, and how large the page is then."""


def step_of(page):
    return page.evaluate("chutelab.lesson.kept.at")


def run_of(lesson, step, row):
    """What Python's engine of the page gives for a row of a table."""
    changed = {**step.set, **(row.set if row else {})}
    settings = [f"{key}={json.dumps(value)}" for key, value in changed.items()]
    scene = scene_of(lesson, lesson.page.scene, [*lesson.page.settings, *settings])
    return simulate(scene, engine="contact")


def value_of(recording, formula):
    """The value of a column."""
    names = quantities_in(formula)
    text = formula
    for n, name in sorted(enumerate(names), key=lambda one: -len(one[1])):
        text = re.sub(rf"(?<![\w.]){re.escape(name)}(?![\w.])", f"q{n}_", text)
    known = {f"q{n}_": measure(recording, name) for n, name in enumerate(names)}
    return eval(text, {**vars(math), "abs": abs, **known})


def told(page):
    """All that the page says, to the eye and to the ear."""
    return page.evaluate("""() => {
      const copy = document.body.cloneNode(true);
      for (const one of copy.querySelectorAll("script, noscript, option")) one.remove();
      return copy.outerHTML.replace(/<path[^>]*>|<polyline[^>]*>|transform="[^"]*"/g, "");
    }""")


def secrets(lesson, step):
    """Numbers of a run that the page must not tell before it is predicted, in three digits."""
    recording = run_of(lesson, step, None)
    formulas = [one.value for other in lesson.steps for one in other.columns if one.value]
    found = set()
    for formula in [*formulas, "landing.x", "impact.vy", "impact.t", "landing.t", "ended.t"]:
        try:
            value = value_of(recording, formula)
        except (KeyError, ValueError, ZeroDivisionError):
            continue
        if value == value and abs(value) > 1e-9 and abs(value * 100) % 1 > 1e-6:
            found.add(f"{abs(value):.4g}")
    return {one for one in found if len(one) > 4}


def answered(hand, lesson, kind):
    """Answer all that a step asks; `kind` is "right", "wrong" or "odd"."""
    page, step = hand.page, lesson.steps[step_of(hand.page)]
    for n, ask in enumerate(step.asks):
        if ask.choices:
            right = ask.right - 1
            chosen = right if kind == "right" else (right + 1) % len(ask.choices)
            name = f"ask-{step_of(page)}-{n}"
            hand.press(page.locator(f'input[name="{name}"]').nth(chosen))
        elif ask.mark:
            hand.mark()
        elif ask.sketch:
            hand.draw(0.7)
        else:
            text = {"right": "What it pushes.", "wrong": "No idea", "odd": "<b>&lt;\\\"'; ½"}[kind]
            hand.write(page.locator(f"#ask-{step_of(page)}-{n}"), text)


@pytest.mark.parametrize(("name", "by", "kind"), PLAYED)
def test_it_is_played_through(page_of, name, by, kind):
    lesson = find(name)
    page = page_of(name, size=FAR[by], has_touch=by == "touch", is_mobile=by == "touch")
    hand = Hand(page, by)
    hand.write(page.locator("#student"), "Ada")
    hand.press(page.locator("#begin"))
    for n, step in enumerate(lesson.steps):
        assert step_of(page) == n
        expect(page.locator("[aria-current=step]")).to_have_count(1)
        # What was seen in the step before is not seen in this one.
        assert n not in page.evaluate("chutelab.lesson.kept.done")
        # Only what the step allows can be changed.
        live = page.evaluate("chutelab.lab.data.live.controls")
        assert len(live) == len(step.open(tuple(lesson.page.live.get("controls", ()))))
        if step.kind == "predict":
            text = told(page)
            for secret in secrets(lesson, step):
                assert secret not in text, secret
            expect(page.locator(".track, .noted, #energy, #numbers, #curves")).to_have_count(0)
            if step.asks:
                hand.press(page.locator("#play"))
                assert not page.evaluate("chutelab.lab.playing")
                assert page.locator("#step-next").is_disabled()
            assert apart(page, "#guess", "#stage")
        answered(hand, lesson, kind)
        if step.kind == "note":
            noted(hand, lesson, step, kind)
        elif step.kind in ("predict", "try"):
            hand.play()
        elif step.kind == "explain" and step.asks:
            expected = [a for one in lesson.steps[:n] if one.kind == "predict" for a in one.asks]
            told_of = page.locator(".reply:not([data-ask])")
            assert told_of.count() <= len(expected)
            rights = sum(bool(one.choices) for one in expected) if kind == "right" else 0
            assert page.locator(".reply.right:not([data-ask])").count() >= rights
            if page.locator("#written").count():
                assert page.locator(".then").inner_text() == ""
                hand.press(page.locator("#written"))
            if step.then:
                assert page.locator(".then").inner_text() != ""
        elif step.kind == "numbers":
            counted(hand, lesson, kind)
        if step.kind != "numbers" or kind == "right":
            assert page.evaluate("chutelab.lesson.kept.done").count(n) == 1, step.kind
        if n + 1 < len(lesson.steps):
            hand.press(page.locator("#step-next"))
    expect(page.locator("#step-next")).to_be_hidden()


def apart(page, first, second):
    a, b = (page.locator(one).bounding_box() for one in (first, second))
    return not a or a["y"] >= b["y"] + b["height"] - 1 or a["y"] + a["height"] <= b["y"] + 1


def noted(hand, lesson, step, kind):
    """Note a run for each row, from the last on; compare with Python's."""
    page = hand.page
    button = page.locator("#note")
    if not any(column.value for column in step.columns):
        assert button.count() == 0
        hand.write(page.locator("table.runs input").first, "1/2")
        return
    assert button.get_attribute("aria-disabled") == "true"
    hand.press(button, force=True)
    assert page.locator("#guess").inner_text() != ""
    rows = list(enumerate(step.rows))
    for n, row in reversed(rows):
        line = page.locator("table.runs tbody tr").nth(n)
        hand.press(line.locator(".set"))
        hand.play()
        expect(button).not_to_have_attribute("aria-disabled", "true")
        hand.press(button)
        expect(line).to_have_class(re.compile(r"\bnew\b"))
        values = page.evaluate(f"chutelab.lesson.kept.runs[{step_of(page)}][{n}].values")
        recording = run_of(lesson, step, row)
        for value, column in zip(values, step.columns, strict=True):
            if column.value:
                expected = value_of(recording, column.value)
                assert value is None or value == pytest.approx(expected, rel=1e-5, abs=1e-9)
                assert (value is None) == (expected != expected)
    for n in range(step.free):
        key = page.evaluate("[...chutelab.lesson.values.fields.keys()][0]")
        page.evaluate("(key) => chutelab.lesson.values.nudge(key, -3)", key)
        hand.play()
        hand.press(button)
        assert page.evaluate(f"chutelab.lesson.kept.runs[{step_of(page)}][{len(rows) + n}].values")
    if kind == "odd":
        for cell in page.locator("table.runs input").all():
            hand.write(cell, "<i>")


def counted(hand, lesson, kind):
    """Answer the questions with numbers of one's own."""
    page, task = hand.page, exercise(lesson.name, "Ada")
    for n, right in enumerate(exercise_answers(lesson.name), start=1):
        question = page.locator(f'[data-question="{n}"]')
        if question.get_attribute("open") is None:
            hand.press(question.locator("summary"))
        typed = {"right": f"{right:.5g}", "wrong": f"{0.5 * right:.5g}", "odd": "about 3,5 metres"}
        hand.write(question.locator("input"), typed[kind])
        hand.press(question.locator(".check"))
        reply, bar = question.locator(".reply"), page.locator(".turnbar")
        above = reply.evaluate("(one) => one.getBoundingClientRect().bottom")
        assert above <= bar.bounding_box()["y"]
        verdict = reply.get_attribute("data-verdict")
        assert (verdict == "right") == (kind == "right")
        if kind == "wrong":
            assert task.check(n, float(typed[kind])).text in reply.inner_text()
        if kind == "odd":
            assert verdict == "unread"


def exercise_answers(name):
    return [one.right for one in draw(EXERCISES[name], "Ada")[1]]


@pytest.mark.slow
def test_on_the_projector_hands_are_counted_and_the_run_is_shown(page_of):
    page = page_of("the-parabola", size=(1920, 1080))
    page.locator("#begin").click()
    expect(page.locator(".vote").first).to_be_hidden()
    page.evaluate("document.documentElement.requestFullscreen = async () => {}")
    page.locator("#full").click()
    votes = page.locator(".choice").first.locator(".vote")
    for n, hands in enumerate((1, 3, 0)):
        for _ in range(hands):
            votes.nth(n).locator("button").last.click()
    votes.first.locator("button").first.click()
    votes.nth(2).locator("button").first.click()
    votes.first.locator("button").last.click()
    assert votes.locator("output").all_text_contents() == ["1", "3", "0"]
    widths = votes.locator("i").evaluate_all("(all) => all.map((one) => one.offsetWidth)")
    assert widths[1] == pytest.approx(3 * widths[0], abs=2)
    assert widths[2] == 0
    assert axe(page) == []
    page.locator("#play").click()
    assert page.evaluate("chutelab.lesson.kept.done") == [0]
    assert page.evaluate("chutelab.lesson.kept.said") == {}
    expect(page.locator(".track")).to_have_count(1)


@pytest.mark.slow
def test_what_was_done_is_kept_for_its_pupil_only(page_of):
    page = page_of("the-bounce")
    hand = Hand(page, "mouse")
    hand.write(page.locator("#student"), "Mia Berg")
    hand.press(page.locator("#begin"))
    answered(hand, find("the-bounce"), "wrong")
    hand.play()
    hand.press(page.locator("#step-next"))
    hand.press(page.locator("#step-next"))
    hand.play()
    hand.press(page.locator("#note"))
    kept = page.evaluate("chutelab.lesson.kept")
    # The same pupil goes on, with the path of what was noted.
    page.reload()
    page.evaluate(DONE)
    assert page.evaluate("chutelab.lesson.kept") == kept
    page.locator(".noted").wait_for(state="attached")
    # The next one sees neither name nor answers, in this tab or in another.
    hand.press(page.locator("#somebody-else"))
    assert "Mia" not in told(page)
    assert page.locator("#student").input_value() == ""
    hand.write(page.locator("#student"), "Ada")
    hand.press(page.locator("#begin"))
    expect(page.locator("input:checked, .noted, .sketch[d^=M]")).to_have_count(0)
    assert step_of(page) == 0
    page.evaluate("sessionStorage.clear()")
    page.reload()
    page.evaluate(DONE)
    assert page.locator("#student").input_value() == ""
    # A name is written in more than one way.
    hand.write(page.locator("#student"), " mia  BERG")
    hand.press(page.locator("#begin"))
    assert page.evaluate("chutelab.lesson.kept") == kept


@pytest.mark.slow
def test_two_tabs_of_one_pupil_lose_nothing_of_each_other(page_of):
    page = page_of("the-bounce")
    page.fill("#student", "Mia")
    page.click("#begin")
    other = page.context.new_page()
    other.goto(page.url)
    other.evaluate(DONE)
    other.fill("#student", "Mia")
    other.click("#begin")
    answered(Hand(other, "mouse"), find("the-bounce"), "wrong")
    Hand(other, "mouse").play()
    other.click("#step-next")
    done = other.evaluate("chutelab.lesson.kept")
    assert done["said"]
    # Back in the first tab, the pupil goes on from there, and what is as it was stays untouched.
    focus = "() => { dispatchEvent(new Event('focus')); return chutelab.lesson.kept; }"
    assert page.evaluate(focus) == done
    page.evaluate("chutelab.lesson.kept.mark = 1")
    assert page.evaluate(focus)["mark"] == 1
    page.evaluate("delete chutelab.lesson.kept.mark")
    page.click("#step-next")
    expect(page.locator("#step-next")).to_be_visible()
    assert other.evaluate(focus) == page.evaluate("chutelab.lesson.kept")


@pytest.mark.slow
def test_odd_things_that_were_kept_are_left_out(page_of):
    page = page_of("the-bounce")
    for odd in (
        "{",
        "7",
        '{"steps": 7}',
        '{"steps": {"at": 99, "done": "x", "said": 3, "runs": 4}}',
        '{"steps": {"at": 3, "done": [77, -1], "said": {}, "runs": {"2": [3, null]}}}',
    ):
        page.evaluate(
            "(odd) => localStorage.setItem('chutelab/the-bounce/ada', odd)", odd
        )  # fmt: skip
        page.evaluate("chutelab.lesson.leave()")
        page.fill("#student", "Ada")
        page.click("#begin")
        # Nothing is opened beyond a prediction that was not made.
        assert step_of(page) == 0


@pytest.mark.slow
def test_a_number_in_the_text_is_dragged_typed_and_moved_by_keys(page_of):
    page = page_of("the-bounce")
    page.click("#begin")
    page.click("#skip")
    number = page.locator(".scrub.num").first

    def value():
        return page.evaluate("chutelab.lab.given.plate.restitution")

    assert value() == 0.5
    box = number.bounding_box()
    page.mouse.move(box["x"] + 10, box["y"] + 10)
    page.mouse.down()
    page.mouse.move(box["x"] + 30, box["y"] + 10, steps=4)
    page.mouse.up()
    assert value() > 0.5
    number.click()
    page.keyboard.type("0,7")
    page.keyboard.press("Enter")
    assert value() == 0.7
    page.keyboard.press("ArrowLeft")
    assert value() == pytest.approx(0.695, abs=1e-9)
    assert number.get_attribute("aria-valuetext") == "0.695"
    # What cannot be is refused beside the value, and nothing is changed.
    for odd in ("7", "x", ""):
        field = page.locator(".values input[type=text]").last
        field.fill(odd)
        field.press("Enter")
        expect(page.locator(".values .why:visible")).to_have_count(1)
        assert field.get_attribute("aria-invalid") == "true"
        assert value() == pytest.approx(0.695)
        field.press("Escape")
        assert field.get_attribute("aria-invalid") is None
    # One step of undo for each.
    page.locator("#stage").focus()
    page.evaluate("chutelab.lab.undo()")
    assert value() == 0.7


@pytest.mark.slow
def test_the_table_is_a_file_for_spreadsheets(page_of):
    page = page_of("the-bounce", "de")
    page.click("#begin")
    page.click("#skip")
    page.click("#step-next")
    page.evaluate("chutelab.lab.seek(1e9)")
    page.click("#note")
    with page.expect_download() as download:
        page.click("text=Tabelle als CSV")
    text = Path(download.value.path()).read_text(encoding="utf-8-sig")
    head, first, *_ = text.splitlines()
    assert head.startswith("meine Läufe;")
    assert head.count(";") == 4
    assert first.split(";")[1] == "-1"
    assert re.fullmatch(r"-2,91\d+", first.split(";")[2])


@pytest.mark.slow
@pytest.mark.parametrize(
    ("language", "scheme", "size"),
    [
        ("de", "dark", PHONE),
        pytest.param("en", "light", DESK, marks=pytest.mark.slow),
        pytest.param("de", "light", (844, 390), marks=pytest.mark.slow),
    ],
)
def test_axe_finds_nothing_in_any_step(page_of, language, scheme, size):
    page = page_of("the-bounce", language, size, color_scheme=scheme)
    lesson = find("the-bounce", language)
    hand = Hand(page, "mouse")

    def is_clean():
        assert page.evaluate("document.documentElement.scrollWidth") <= size[0]
        assert axe(page) == []
        # Marks on the time, which the slider does as well, are as large as handles.
        small = page.evaluate("""() => [...document.querySelectorAll("button, summary, select")]
          .filter((one) => one.checkVisibility() && !one.closest(".question")
            && Math.min(one.offsetWidth, one.offsetHeight) < (one.closest(".marks") ? 24 : 36))
          .map((one) => one.outerHTML.slice(0, 90))""")
        assert small == []

    is_clean()
    page.fill("#student", "Ada")
    page.click("#begin")
    for n in range(len(lesson.steps)):
        answered(hand, lesson, "wrong")
        if lesson.steps[n].kind == "note":
            page.evaluate("chutelab.lab.seek(1e9)")
            page.click("#note")
        if page.locator("#written").count():
            page.click("#written")
        is_clean()
        if n + 1 < len(lesson.steps):
            page.click("#step-next")


def test_nothing_but_the_page_itself_is_allowed(page_of, tmp_path):
    page_of("the-bounce")
    text = (tmp_path / "the-bounce-en.html").read_text(encoding="utf-8")
    policy = re.search(r'Content-Security-Policy" content="([^"]*)"', text)[1]
    assert "default-src 'none'" in policy
    assert "unsafe-inline" not in policy
    assert "unsafe-eval" not in policy.replace("wasm-unsafe-eval", "")


@pytest.mark.slow
@pytest.mark.parametrize(
    ("name", "language"),
    [
        ("the-bounce", "de"),
        *(
            pytest.param(one.name, language, marks=pytest.mark.slow)
            for one in lessons()
            for language in ("en", "de")
            if (one.name, language) != ("the-bounce", "de")
        ),
    ],
)
def test_it_is_printed_one_step_after_the_other_with_room_to_write(page_of, name, language):
    page, lesson = page_of(name, language, color_scheme="dark"), find(name, language)
    page.fill("#student", "Ada")
    page.click("#begin")
    answered(Hand(page, "mouse"), lesson, "wrong")
    places = """[...document.querySelectorAll("#stage, .paper")].map((one) =>
      [one.className, one.parentElement.className])"""
    before = page.evaluate(places)
    # On paper: in black on white, and no wider than a page.
    page.emulate_media(media="print")
    page.evaluate("dispatchEvent(new Event('beforeprint'))")
    page.set_viewport_size({"width": 680, "height": 900})
    assert page.evaluate("document.documentElement.scrollWidth") <= 680
    too_wide = """() => [...document.querySelectorAll(".paper :is(p, li, table, img, math, .line)")]
      .filter((one) => one.getBoundingClientRect().right > 681).map((one) => one.outerHTML)"""
    assert page.evaluate(too_wide) == []
    operated = page.locator("button, input, textarea, select, details").all()
    assert not any(one.is_visible() for one in operated)
    heads = page.locator(".paper h2").all_inner_texts()
    assert [int(head.split(".")[0]) for head in heads] == [*range(1, len(lesson.steps) + 1)]
    for n, step in enumerate(lesson.steps):
        section = page.locator(".paper section").nth(n)
        assert section.locator("li:has-text('☐'), li:has-text('☒')").count() == sum(
            len(ask.choices) for ask in step.asks
        )
        if step.columns:
            assert section.locator("table").last.locator("tr").count() == (
                1 + len(step.rows) + step.free
            )
        # What is not yet answered in words has lines.
        open_ = sum(not (one.choices or one.mark or one.sketch) for one in step.asks)
        assert section.locator(".line").count() >= (3 * open_ if n else 0)
    assert page.locator(".paper li:has-text('☒')").count() == sum(
        bool(ask.choices) for ask in lesson.steps[0].asks
    )
    page.evaluate("dispatchEvent(new Event('afterprint'))")
    page.emulate_media(media="null")
    assert page.evaluate(places) == before
    # The browser itself says before and after.
    pdf = PdfReader(BytesIO(page.pdf(format="A4")))
    text = " ".join("".join(one.extract_text().split()) for one in pdf.pages)
    assert [one for one in heads if "".join(one.split()) not in text] == []
    assert len(pdf.pages) <= 9
    assert page.evaluate(places) == before
