"""The exercise of every lesson's page, by mouse, touch and keyboard: it says what Python says."""

import json
from collections import deque
from pathlib import Path

import pytest

from chutelab.classroom import exercises
from chutelab.classroom.exercises import EXERCISES, Verdict, lesson
from chutelab.classroom.exercises.exercise import draw
from chutelab.classroom.exercises.judging import MARKS
from chutelab.classroom.grading import grade
from chutelab.classroom.lessons.pages import live_page
from chutelab.util.words import words
from live.browser import DONE, Hand
from shared import find

expect = pytest.importorskip("playwright.sync_api").expect

STUDENT = "Zoë O'Neil"
NONSENSE = ["two metres", "", "  ", "NaN", "1/0", "2..5", "<b>1</b>", "9" * 400, "😀", "x = 3"]
WRITTEN = 'Die Platte nimmt ½ m v² (1 - ε²).\n<b>Not</b> g, \\ or "it".'

WHOLE = [(name, way, "en", 6) for name in EXERCISES for way in ("mouse", "touch", "keyboard")]
GERMAN = [("the-bounce", "mouse", "de", 6)]


def answer(hand, question, typed):
    """Type an answer, and have it checked by the button or by Enter."""
    hand.write(question.locator("input"), typed)
    if hand.by == "keyboard":
        hand.page.keyboard.press("Enter")
    else:
        hand.press(question.locator(".check"))


def one_line(text):
    return " ".join(text.split())


def answers_to(case, most):
    """Wrong ones, up to `most` that have a name and as many that are just off, and the right one.

    The question's own mistakes come before those that any question knows.
    """
    off = [factor * case.right for factor in (1.03, 1.5, 1.2e4)]
    return [*(trace.number for trace in case.mistakes[:most]), *[*off, 0.0][:most], case.right]


# The other steps are played through elsewhere.
TO_NUMBERS = """() => {
  const { lesson } = chutelab, n = lesson.lesson.steps.findIndex(({ kind }) => kind === "numbers");
  lesson.kept.done.push(...Array(n).keys());
  lesson.go(n);
}"""


@pytest.mark.slow
@pytest.mark.parametrize(
    ("name", "way", "language", "most"),
    [*WHOLE, *GERMAN],
)
def test_a_lesson_is_played_through(name, way, language, most, opened, tmp_path, monkeypatch):
    monkeypatch.setattr(exercises, "OPENED", deque())
    task = lesson(name, STUDENT, language)
    said = words(language)
    _, cases = draw(EXERCISES[name], STUDENT)
    path = tmp_path / "page.html"
    live_page(find(name, language), path)
    touches = way == "touch"
    view = {"width": 390, "height": 844} if touches else {"width": 1366, "height": 900}
    page = opened(path, viewport=view, has_touch=touches, is_mobile=touches)
    page.evaluate(DONE)
    hand = Hand(page, way)
    expect(page.locator(".question")).to_have_count(0)
    hand.write(page.locator("#student"), STUDENT)
    hand.press(page.locator("#begin"))
    page.evaluate(TO_NUMBERS)
    for case in cases:
        n = case.number
        question = page.locator(f'.question[data-question="{n}"]')
        reply = question.locator(".reply")
        if not question.locator("input").is_visible():
            hand.press(question.locator("summary"))
        assert one_line(task.question(n).text) in one_line(question.inner_text())
        for typed in NONSENSE[n - 1 :: len(cases)][:most]:
            answer(hand, question, typed)
            verdict = task.check(n, typed).verdict
            assert verdict in (Verdict.BLANK, Verdict.UNREAD)
            assert reply.get_attribute("data-verdict") == verdict.name.lower(), typed
            assert len(reply.inner_text()) > 20
            assert reply.locator("b").count() == 1  # no markup but the page's own
        for hint in case.question.hints:
            hand.press(question.locator(".hint"))
            told = task.hint(n).text.split("\n")[0]
            assert one_line(told) in one_line(question.inner_text()), hint
        verdicts = set()
        for value in answers_to(case, most):
            typed = f"{value:.3g}" if value == case.right else f"{value:.6g}"
            wanted = task.check(n, float(typed))
            verdicts.add(wanted.verdict)
            answer(hand, question, said.local(typed))
            advice = said.say("python-hint", number=n)
            text = wanted.text.removesuffix(advice)
            expected = f"{MARKS[wanted.verdict][0]} {wanted.heading}. {text}"
            assert one_line(reply.inner_text()) == one_line(expected), typed
            assert reply.get_attribute("data-verdict") == wanted.verdict.name.lower()
        assert verdicts == {Verdict.RIGHT, Verdict.MISTAKE, Verdict.OFF}
    second = page.locator('.question[data-question="2"]')
    hand.press(second.locator(".working"))
    for line in task.reveal(2).text.split("\n"):
        assert one_line(line) in one_line(second.inner_text())
    for row in task.progress().rows:
        state = page.locator(f'.question[data-question="{row.number}"] .state')
        assert one_line(state.text_content()) == row.state
    explain = page.locator("#explain")
    wrote = explain.count() == 1
    if wrote:
        hand.write(explain, WRITTEN)
    with page.expect_download() as waiting:
        hand.press(page.locator("#result"))
    returned = tmp_path / waiting.value.suggested_filename
    assert returned.name.endswith(".chutelab.json")
    waiting.value.save_as(returned)
    result = json.loads(Path(returned).read_text(encoding="utf-8"))
    assert result["tries"] == {str(row.number): row.tries for row in task.progress().rows}
    [row] = grade([returned])
    assert (row.student, row.lesson, row.reason) == (STUDENT, name, "")
    assert row.marks == (1,) * len(cases)
    assert row.revealed == (2,)
    assert row.words == ({"explain": WRITTEN} if wrote else {})
    page.reload()
    page.evaluate(DONE)
    assert page.locator(".question .mark.right").count() == len(cases)
