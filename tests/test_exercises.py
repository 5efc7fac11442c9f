"""Exercises: numbers from a name, answers from theory, each mistake told from the others."""

import gc
import json
import re
from fractions import Fraction
from math import atan, degrees, hypot, isfinite, nan, radians, sqrt, tan
from pathlib import Path
from xml.etree import ElementTree as ET

import numpy as np
import pytest

from chutelab.classroom.exercises import (
    EXERCISES,
    ExerciseError,
    Values,
    Verdict,
    find,
    lesson,
    told,
)
from chutelab.classroom.exercises.exercise import (
    Case,
    Exercise,
    Mistake,
    Question,
    attempt,
    draw,
    shown,
)
from chutelab.classroom.exercises.judging import judge
from chutelab.engines.simulation import simulate
from chutelab.results import Kind
from chutelab.results.ledger import ledger
from chutelab.scene import from_dict
from shared import some

NAMES = list(EXERCISES)
SOLUTIONS = Path(__file__).parent / "solutions"
LESSONS = Path(__file__).parent.parent / "lessons"
FEW = [f"student {i}" for i in range(6)]
G = 9.81


class Handed:
    """A task as a solution sees it."""

    def __init__(self, given):
        self.given = given


def solution(name, given):
    """The four answers, from formulas written out under tests/solutions."""
    names = {"task": Handed(given)}
    exec((SOLUTIONS / f"{name}.py").read_text(encoding="utf-8"), names)
    return [names[f"answer_{n}"] for n in (1, 2, 3, 4)]


# Parameters from names


def test_a_name_is_a_name_whatever_its_capitals_and_spaces():
    first = lesson(3, "Zoë  de Vries ").given
    again = lesson("03-the-bounce", " zoe\u0308 DE vries").given
    assert list(map(first.__getitem__, first)) == list(map(again.__getitem__, again))
    assert repr(lesson(3, "Zoe de Vries").given) != repr(first)


def test_students_differ_and_so_do_the_lessons_of_one():
    for name in NAMES:
        drawn = {repr(lesson(name, student).given) for student in FEW}
        assert len(drawn) >= len(FEW) - 1
    assert lesson("letting-go", "x").given.R != lesson("grip-or-slip", "x").given.R


@pytest.mark.parametrize("name", some(NAMES))
def test_most_exercises_accept_one_draw_in_ten(name):
    exercise = EXERCISES[name]
    fits = [attempt(exercise, f"draw {i}", 0) is not None for i in range(40)]
    assert sum(fits) >= 2


def test_draws_stay_where_the_lesson_is():
    for student in [f"domain {i}" for i in range(8)]:
        for name in ("letting-go", "grip-or-slip"):
            given = lesson(name, student).given
            assert given.v0**2 < G * given.R
        for name in ("the-bounce", "turning-the-plate"):
            given = lesson(name, student).given
            assert given.v0**2 > G * given.R
        tilted = lesson("turning-the-plate", student).given
        assert tan(radians(tilted.alpha)) < tilted.v0**2 / (2 * G * (tilted.R + tilted.d))


# Answers


@pytest.mark.parametrize("name", NAMES)
def test_formulas_written_out_by_hand_are_right(name):
    for student in FEW:
        task = lesson(name, student)
        answers = solution(name, task.given)
        replies = [task.check(n, answer) for n, answer in enumerate(answers, start=1)]
        assert [reply.verdict for reply in replies] == [Verdict.RIGHT] * 4
        assert task.progress().done == 4


@pytest.mark.parametrize("name", some(NAMES))
def test_answers_are_exact_and_the_tolerance_is_the_one_stated(name):
    task = lesson(name, "tolerance")
    for number, answer in enumerate(solution(name, task.given), start=1):
        assert "rounded to 3 digits (right to within 1 %)" in task.question(number).text
        case = draw(EXERCISES[name], "tolerance")[1][number - 1]
        assert case.right == pytest.approx(answer, rel=1e-4)  # told numbers have four digits
        assert task.check(number, case.right * 1.0099).right
        assert task.check(number, case.right * 0.9901).right
        assert not task.check(number, case.right * 1.0101).right
        assert not task.check(number, case.right * 0.9899).right


def held(thing, depth=5):
    """All that hangs on an object, by attributes and items."""
    yield thing
    if depth == 0 or callable(thing) or isinstance(thing, (str, int, float)):
        return
    inside = [getattr(thing, name) for name in dir(thing) if not name.startswith("__")]
    if isinstance(thing, (dict, list, tuple)):
        inside = list(thing.values() if isinstance(thing, dict) else thing)
    for one in inside:
        yield from held(one, depth - 1)


@pytest.mark.parametrize("name", some(NAMES))
def test_nothing_that_hangs_on_a_task_is_a_right_answer(name):
    task = lesson(name, "reader")
    for number in (1, 2, 3, 4):
        task.check(number, 1e-3)
    found = list(held(task))
    given = [task.given[key] for key in task.given]
    numbers = {one for one in found if isinstance(one, float)}
    assert numbers == {1e-3, *given}
    assert not any(isinstance(one, (Case, Exercise, Question, Mistake)) for one in found)
    gc.collect()
    assert not any(isinstance(one, Case) for one in gc.get_objects())


@pytest.mark.parametrize("name", NAMES)
def test_the_digits_shown_in_the_texts_are_enough(name):
    for student in FEW[:3]:
        task = lesson(name, student)
        rounded = Values({key: float(shown(task.given[key])) for key in task.given})
        for number, answer in enumerate(solution(name, rounded), start=1):
            assert task.check(number, float(f"{answer:.3g}")).right


def test_the_engine_starts_to_slip_where_the_exercise_says():
    for student in FEW[:2]:
        task = lesson("grip-or-slip", student)
        given = task.given
        scene = from_dict(
            {
                "particle": {"radius": given.r},
                "incoming": {
                    "speed": given.v0, "pulley_radius": given.R, "friction": given.mu,
                },
                "run": {"until": 2.0},
            }
        )  # fmt: skip
        slips = simulate(scene).select(Kind.SLIP)[0]
        x, y = slips["position"]
        assert task.check(2, degrees(atan(x / y))).right


def test_the_engine_spreads_a_stream_as_far_as_the_exercise_says():
    for student in FEW[:2]:
        task = lesson("a-stream", student)
        given = task.given
        drop = from_dict({
            "particle": {"radius": given.mm / 1000},
            "incoming": {"speed": given.v0, "pulley_radius": given.R},
            "plate": {"distance": given.d, "restitution": given.e},
            "outgoing": {"drop": given.d2},
            "stream": {"count": 400, "bed_height": given.bed},
        })  # fmt: skip
        landings = simulate(drop).select(Kind.LANDING)["position"][:, 0]
        # 400 draws leave some hundredths of the bed's height unused at its top.
        assert np.ptp(landings) == pytest.approx(solution("a-stream", given)[2], rel=0.03)


def test_the_engine_does_what_the_plates_of_the_design_are_to_do():
    for student in FEW[:2]:
        task = lesson("design", student)
        given, (down, lining, priced, _) = task.given, solution("design", task.given)
        price = given.paid / 1000
        for angle, e, key, wanted in (
            (down, given.e, "vx", 0.0),
            (given.alpha, lining, "vx", 0.0),
            (priced, given.e, "work", price),
        ):
            plate = {"distance": given.d, "pivot_height": given.pivot, "angle_deg": angle}
            recording = simulate(from_dict({
                "particle": {"radius": 0.0, "mass": given.grams / 1000},
                "incoming": {"speed": given.v0, "pulley_radius": given.R},
                "plate": {**plate, "restitution": e, "above": 0.1},
                "outgoing": {"drop": 0.5, "speed": given.vb},
                "run": {"until": "settled"},
            }))  # fmt: skip
            landed = recording.select(Kind.LANDING)[0]
            work = ledger(recording).by_surface["outgoing"]["belt_work"]
            found = {"vx": landed["velocity_before"][0], "work": work}[key]
            assert found == pytest.approx(wanted, abs=2e-3 * (given.v0 if key == "vx" else price))


@pytest.mark.parametrize("name", ["the-bounce", "a-stream"])
def test_nothing_strikes_the_pulley_on_its_way_back(name):
    for number in range(20):
        given = lesson(name, f"back {number}").given
        r, bed = (given.r, 0.0) if name == "the-bounce" else (given.mm / 1000, given.bed)
        x0, y0 = given.R + given.d - r, given.R + r
        t2 = x0 / given.v0
        t3 = (sqrt((G * t2) ** 2 + 2 * G * given.d2) - G * t2) / G
        for higher in (0.0, bed):
            for t in np.linspace(0.0, t3, 200).tolist():
                x, y = x0 - given.e * given.v0 * t, y0 + higher - 0.5 * G * (t2 + t) ** 2
                gap = hypot(x, y) if x > 0.0 else abs(y)  # the belt's strands run back from it
                assert gap > given.R + r


# Known mistakes


@pytest.mark.parametrize("pupils", [6, pytest.param(400, marks=pytest.mark.slow)])
@pytest.mark.parametrize("name", some(NAMES))
def test_every_mistake_is_recognised_as_itself(name, pupils):
    for student in [f"pupil {i}" for i in range(pupils)]:
        for number, case in enumerate(draw(EXERCISES[name], student)[1], start=1):
            assert judge(case, case.right).right
            for trace in case.mistakes:
                assert isfinite(trace.number)
                for digits in (trace.number, float(f"{trace.number:.4g}")):
                    reply = judge(case, digits)
                    found = reply.verdict, reply.mistake, reply.text
                    expected = Verdict.MISTAKE, trace.name, trace.says
                    assert found == expected, (student, number, trace)
            known = {mistake.name for mistake in case.question.mistakes}
            assert len(known) == len(case.question.mistakes) >= 3
            general = {"sign or direction", "power of ten", "a missing ½"}
            assert number > 1 or general <= {trace.name for trace in case.mistakes}


def by_hand():
    """The table of mistakes beside the solutions."""
    names = {}
    exec((SOLUTIONS / "mistakes.py").read_text(encoding="utf-8"), names)
    return names["MISTAKES"], names["GENERAL"]


MISTAKES, GENERAL = by_hand()


def test_every_mistake_of_every_question_is_made_by_hand_below():
    own = {
        (name, number): {mistake.name for mistake in question.mistakes}
        for name, exercise in EXERCISES.items()
        for number, question in enumerate(exercise.questions, start=1)
    }
    assert {key: set(made) for key, made in MISTAKES.items()} == own


@pytest.mark.parametrize(("name", "number"), some(MISTAKES))
def test_a_mistake_made_by_hand_is_named(name, number):
    for student in FEW[:1]:
        task = lesson(name, student)
        for mistake, formula in MISTAKES[name, number].items():
            assert task.check(number, formula(task.given)).mistake == mistake, (student, mistake)
        right = solution(name, task.given)[number - 1]
        for mistake, of in GENERAL.items():
            assert task.check(number, of(right)).mistake == mistake
        if EXERCISES[name].questions[number - 1].unit == "degrees":
            for turned in (radians(right), degrees(right)):
                assert task.check(number, turned).mistake == "radians for degrees"


def test_what_is_no_known_mistake_is_told_how_far_off_it_is():
    task = lesson("the-parabola", "x")
    right = solution("the-parabola", task.given)[0]
    replies = {
        1.03: "about 3 % too large. Were numbers rounded on the way, or is g not 9.81 m/s²?",
        0.97: "about 3 % too small",
        1.23: "about 23 % too large",
        3.3: "a factor of 3.3 too large",
        1 / 3.3: "70 % too small",
        33.0: "more than 10 times too large",
        1 / 3333.0: "more than 100 times too small",
        -1.23: "The sign is the other one",
        0.0: "The answer is not 0",
    }
    for ratio, text in replies.items():
        reply = task.check(1, ratio * right)
        assert reply.verdict is Verdict.OFF
        assert text in reply.text, (ratio, reply)


@pytest.mark.parametrize("name", some(NAMES))
def test_two_mistakes_at_once_are_both_named(name):
    found = {-1.0: 0, 1e3: 0, 1e-3: 0}
    for student in FEW[:2]:
        task, cases = lesson(name, student), draw(EXERCISES[name], student)[1]
        for number in (1, 2, 3, 4):
            for mistake, formula in MISTAKES[name, number].items():
                for factor in found:
                    reply = judge(cases[number - 1], factor * formula(task.given))
                    besides = "sign or direction" if factor < 0.0 else "power of ten"
                    if reply.mistake == f"{mistake}, and {besides}":
                        found[factor] += 1
                        assert (
                            "large" if factor > 1.0 else "small" if factor > 0.0 else "sign"
                        ) in reply.text.partition("Besides, ")[2]
    # Some pairs are another mistake by itself, or one of two pairs: those are not named so.
    made = 2 * sum(len(MISTAKES[name, number]) for number in (1, 2, 3, 4))
    assert min(found.values()) > 0.65 * made


@pytest.mark.parametrize("name", some(NAMES))
def test_no_random_answer_is_named_for_a_mistake_that_leads_elsewhere(name):
    task = lesson(name, "random")
    cases = draw(EXERCISES[name], "random")[1]
    for i, (times, power) in enumerate(np.random.default_rng(3).normal(size=(240, 2)).tolist()):
        number = 1 + i % 4
        answer = cases[number - 1].right * times * 10.0**power
        reply = judge(cases[number - 1], answer)
        first, _, besides = reply.mistake.partition(", and ")
        if first in MISTAKES[name, number]:
            leads = MISTAKES[name, number][first](task.given)
            factors = [1.0] if not besides else [-1.0] if "sign" in besides else [1e3, 1e-3]
            assert any(answer == pytest.approx(leads * one, rel=0.0101) for one in factors)


def test_somebody_elses_right_answer_is_recognised():
    mine, neighbour = lesson("the-parabola", "Ada"), lesson("the-parabola", "Bea")
    theirs = solution("the-parabola", neighbour.given)[1]
    for answer in (theirs, float(f"{theirs:.3g}")):
        reply = mine.check(2, answer)
        assert (reply.verdict, reply.mistake) == (Verdict.MISTAKE, "somebody else's numbers")
        assert "the numbers of “Bea”" in reply.text
    assert mine.check(2, 1.004 * theirs).mistake != "somebody else's numbers"
    assert neighbour.check(2, theirs).right
    unnamed = lesson("trust", "your name").given
    reply = lesson("trust", "Ada").check(1, solution("trust", unnamed)[0])
    assert "the numbers of “your name”" in reply.text


def test_no_reply_gives_the_answer_away():
    for name in NAMES:
        task = lesson(name, "secret")
        for number, case in enumerate(draw(EXERCISES[name], "secret")[1], start=1):
            words = [judge(case, trace.number).text for trace in case.mistakes]
            words += [judge(case, 1.3 * case.right).text, task.question(number).text]
            told = {shown(task.given[key]) for key in task.given} | {"1", "10", "0", "2"}
            found = set(re.findall(r"(?<![\w.])\d+(?:\.\d+)?(?![\w.])", " ".join(words)))
            assert shown(abs(case.right)) not in found - told


# Kind words


class Rude:
    def __float__(self):
        raise RuntimeError("no")

    def __repr__(self):
        raise RuntimeError("no")


NOTHING = [None, ..., "", "  ", "...", "?", [], (), np.array([])]
NO_NUMBER = [
    ((0, 35), "a point: 0.35"), ([0, 35], "2 values"), ((0, 3, 5), "3 values"),
    ("0,35", "0.35"), ("2 m/s", "unit"), ("2,5", "2.5"), ("-1.5", "-1.5"), ("two", "text"),
    (b"2", "quotes"),
    (True, "comparison"), (np.True_, "comparison"), (nan, "NaN"), (np.float64("nan"), "NaN"),
    (float("inf"), "infinite"), (10**400, "infinite"), (1 + 2j, "complex"),
    (np.complex128(1), "complex"), ([1.0, 2.0], "2 values"), (np.zeros((2, 2)), "4 values"),
    ({"a": 1}, "dict"), ({1}, "set"), (len, "function"), (Rude(), "Rude"), (Rude, "function"),
    ([[1.0, 2.0]], "2 values"), (["2 m"], "unit"), (object(), "object"), ("x" * 10**6, "text"),
    ("1" * 10**6, "text"),
]  # fmt: skip


@pytest.mark.parametrize("answer", NOTHING, ids=lambda value: type(value).__name__)
def test_nothing_attempted_is_said_to_be_so(answer):
    task = lesson("the-bounce", "blank")
    reply = task.check(1, answer)
    assert reply.verdict is Verdict.BLANK
    assert "not attempted" in str(reply)
    assert task.progress().rows[0].tries == 0


@pytest.mark.parametrize(("answer", "word"), NO_NUMBER, ids=lambda value: type(value).__name__)
def test_what_is_no_number_is_answered_kindly(answer, word):
    reply = lesson("the-bounce", "odd").check(1, answer)
    assert reply.verdict is Verdict.UNREAD
    assert word in reply.text
    assert len(str(reply)) < 400
    assert reply._repr_html_()


def test_any_kind_of_number_is_a_number():
    task = lesson("the-parabola", "kinds")
    right = solution("the-parabola", task.given)[0]
    kinds = (np.float32, np.float64, np.longdouble, Fraction, np.array)
    for answer in (*(kind(right) for kind in kinds), np.array([right]), [right]):
        assert task.check(1, answer).right


@pytest.mark.parametrize(
    "number", [0, 5, -1, 1.5, None, "first", nan, True, [], {}, Rude(), 10**400]
)
def test_an_unknown_question_is_answered_kindly(number):
    task = lesson("the-bounce", "unknown")
    for ask in (task.question, task.check, task.hint, task.reveal):
        assert ask() == ask(number)
        reply = ask(number)
        assert reply.verdict is Verdict.UNKNOWN
        assert "1 to 4" in str(reply)


# Hints, working, progress


def test_hints_come_one_by_one_and_the_working_only_when_asked():
    task = lesson("the-bounce", "hints")
    hints = [task.hint(2) for _ in range(4)]
    assert [hint.title[:11] for hint in hints] == [
        "Hint 1 of 3",
        "Hint 2 of 3",
        *["Hint 3 of 3"] * 2,
    ]
    assert len({hint.text for hint in hints}) == 3
    assert "task.reveal(2)" in hints[2].text
    assert task.revealed == ()
    answer = solution("the-bounce", task.given)[1]
    assert f"Answer: {answer:.4g} m/s" in task.reveal(2).text
    assert task.revealed == (2,)
    assert task.progress().rows[1].remarks == "3 hints, working shown"
    assert task.progress().rows[0].remarks == ""


@pytest.mark.parametrize("name", NAMES)
def test_every_text_has_its_numbers_in_it(name):
    task = lesson(name, "texts")
    for number in (1, 2, 3, 4):
        texts = [task.question(number), task.reveal(number)]
        texts += [task.hint(number) for _ in EXERCISES[name].questions[number - 1].hints]
        for text in texts:
            assert not re.search(r"[{}]|\bnan\b|None", str(text)), text
            assert max(map(len, str(text).splitlines())) <= 88
    assert [question.number for question in task.questions] == [1, 2, 3, 4]
    assert EXERCISES[name].title in repr(task)


def test_progress_says_what_is_done_in_words_and_in_a_picture():
    task = lesson("landing", "<script>alert(1)</script>")
    answers = solution("landing", task.given)
    task.check(1, answers[0])
    task.check(2, -answers[1])
    task.check(3, "soon")
    progress = task.progress()
    assert [row.verdict for row in progress.rows] == [
        Verdict.RIGHT, Verdict.MISTAKE, Verdict.UNREAD, Verdict.BLANK,
    ]  # fmt: skip
    assert "1 of 4 done" in str(progress)
    page = progress._repr_html_()
    assert page.count("<rect") == 4
    assert "<script>" not in page + task._repr_html_()
    task.check(2, answers[1])
    assert task.progress().done == 2
    assert task.progress().rows[1].tries == 2


def test_html_is_whole_and_takes_the_colours_of_the_page():
    task = lesson("a-stream", "html")
    for part in (
        task, task.question(1), task.check(1), task.check(1, 7.0), task.hint(1), task.reveal(1),
        task.progress(), task.check(99),
    ):  # fmt: skip
        html = part._repr_html_().replace("<br>", "<br/>")
        styles = [one.get("style", "") for one in ET.fromstring(f"<p>{html}</p>").iter()]
        assert not re.search(r"background|(?<!-)\bcolor:", " ".join(styles))


# Lessons and their notebooks


def test_lessons_are_found_by_number_or_name():
    for ask in (3, "3", "the-bounce", "03-the-bounce", "The Bounce", "03"):
        assert find(ask).name == "the-bounce"
    assert [exercise.number for exercise in EXERCISES.values()] == list(range(14))
    assert lesson("the-bounce", "digit").question("2").number == 2
    with pytest.raises(ExerciseError, match="Did you mean 'the-bounce'"):
        lesson("the-bonce", "x")
    with pytest.raises(ExerciseError, match=r"no lesson '99'.* 8 trust"):
        lesson(99, "x")


def test_the_students_numbers_can_be_read_and_not_changed():
    given = lesson("the-bounce", "given").given
    assert "v0 = " in repr(given)
    assert "v0" in dir(given)
    with pytest.raises(AttributeError, match="no number 'vx' here; there are v0, R"):
        _ = given.vx
    with pytest.raises(AttributeError, match="are given"):
        given.v0 = 3.0
    with pytest.raises(AttributeError, match="are given"):
        del given.v0
    assert next(iter(given)) == "v0"


@pytest.mark.parametrize("name", NAMES)
def test_notebooks_are_shipped_without_outputs_and_answers_and_ask_every_question(name):
    path = LESSONS / f"{EXERCISES[name].number:02}-{name}" / "exercise.ipynb"
    text = path.read_text(encoding="utf-8")
    for cell in json.loads(text)["cells"]:
        if cell["cell_type"] == "code":
            assert (cell["outputs"], cell["execution_count"]) == ([], None)
    assert f'task = lesson(\\"{name}\\", student=student)' in text
    for number, case in enumerate(draw(EXERCISES[name], "your name")[1], start=1):
        assert f"task.check({number}, answer_{number})" in text
        assert repr(case.right) not in text, number


@pytest.mark.parametrize("language", ["en", "de"])
def test_indices_are_below_the_line_as_in_the_lessons(language):
    """Names in Python, in code and between braces, keep their digits."""
    for name in NAMES:
        exercise = told(name, language)
        texts = [exercise.title, exercise.story, *(one.meaning for one in exercise.parameters)]
        texts += [one.symbol for one in exercise.parameters]
        for asked in exercise.questions:
            texts += [asked.title, asked.text, asked.working, *asked.hints]
            texts += [part for one in asked.mistakes for part in (one.called, one.says)]
        for text in texts:
            plain = re.sub(r"\{[^}]*\}|`[^`]*`", "", text)
            assert not re.findall(r"(?<![A-Za-z0-9_])[A-Za-zφ]{1,2}\d", plain), text
