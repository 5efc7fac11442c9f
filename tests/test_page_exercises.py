"""Exercises in the live page: the same numbers, verdicts and sentences as Python's `Task`."""

import json
import re

import numpy as np
import pytest

from chutelab.classroom import exercises
from chutelab.classroom.exercises import EXERCISES, data_of, lesson, told, tree
from chutelab.classroom.exercises.exercise import (
    Case,
    Numbers,
    draw,
    normalized,
    shown,
)
from chutelab.classroom.exercises.judging import judge
from chutelab.classroom.lessons import scene_of
from chutelab.engines.simulation import simulate
from chutelab.scene.quantities import lookup
from chutelab.util.words import LANGUAGES, words
from live.node import ask as ask_node
from live.node import needs_node
from shared import find

pytestmark = needs_node

NAMES = list(EXERCISES)
STUDENTS = [
    "Ada Lovelace", "  zoë  de VRIES", "Иван Петров", "李小龍", "Işık Çelik", "Straße", "ﬁnn",
    "Σίσυφος",
]  # fmt: skip


def ask(**questions):
    """Return what the page's modules say."""
    return ask_node("exercises.mjs", questions)


# What it is made of


def test_digits_are_those_of_python():
    rng = np.random.default_rng(3)
    values = list(10.0 ** rng.uniform(-9, 9, 400) * rng.choice([-1.0, 1.0], 400))
    # Halfway between two, as only some binary numbers are.
    values += [n / 2**k for n in range(1, 200, 7) for k in range(1, 12)]
    values += [12345.0, 10005.0, 100050.0, 0.5, 2.5, 0.00012345, 99995.0, 9999.5, 0.0]
    fixed = [[value, places] for value in values for places in (0, 1, 2, 3)]
    counted = [[value, count] for value in values if value for count in (3, 4, 16)]
    found = ask(fixed=fixed, general=values, scientific=counted)
    assert found["fixed"] == [f"{value:.{places}f}" for value, places in fixed]
    assert found["general"] == [shown(value) for value in values]
    for (value, count), one in zip(counted, found["scientific"], strict=True):
        mantissa, power = f"{abs(value):.{count - 1}e}".split("e")
        assert one == {"digits": mantissa.replace(".", ""), "power": int(power)}


def test_a_formula_with_what_pages_do_not_know_is_refused():
    for formula in ("[x for x in y]", "x if y else z", "x in y", "x // y", "f'{x}'", "x is y"):
        with pytest.raises(ValueError, match="pages do not know"):
            tree(formula)


@pytest.mark.parametrize("name", NAMES)
def test_no_number_of_anybody_stands_in_the_data(name):
    data = json.dumps(data_of(EXERCISES[name]), ensure_ascii=False)
    for student in ("your name", "anybody", "Ada"):
        for case in draw(EXERCISES[name], student)[1]:
            texts = [shown(case.right), f"{case.right:.5g}"]
            # Not what is a round number, which a text may have for reasons of its own.
            for text in texts:
                if len(text.lstrip("-0.").replace(".", "")) >= 4:
                    assert text not in data


# The same numbers and replies


@pytest.mark.parametrize("many", [0, pytest.param(200, marks=pytest.mark.slow)])
def test_a_name_draws_the_same_numbers(many):
    students = [*STUDENTS, *(f"draw {n}" for n in range(many))]
    asked = [(n, student) for n in range(len(NAMES)) for student in students]
    drawn = ask(exercises=[data_of(EXERCISES[name]) for name in NAMES], drawn=asked)["drawn"]
    for (n, student), found in zip(asked, drawn, strict=True):
        given = draw(EXERCISES[NAMES[n]], student)[0]
        assert list(found) == list(given)
        for key in given:
            assert found[key] == pytest.approx(given[key], rel=1e-12, abs=0.0), (student, key)


def answers_to(case, rng):
    """The right answer, each mistake, pairs, and anything: as a student may give them, too."""
    numbers = [case.right, *(trace.number for trace in case.mistakes)]
    numbers += [trace.number for trace in case.pairs]
    numbers += [float(f"{number:.3g}") for number in numbers]
    near = case.right * np.array(
        [1.009, 1.011, 0.972, 0.953, 1.2, 1.7, 3.0, 9.0, 30.0, 500.0, 1e-9]
    )
    wild = case.right * 10.0 ** rng.uniform(-3, 3, 25) * rng.choice([-1.0, 1.0], 25)
    return [*numbers, *near.tolist(), *wild.tolist(), 0.0, 1e300, -1e-300]


@pytest.mark.parametrize("many", [1, pytest.param(8, marks=pytest.mark.slow)])
@pytest.mark.parametrize(
    ("name", "language"),
    [
        pytest.param(name, language, marks=() if n % 7 == 3 * m else pytest.mark.slow)
        for n, name in enumerate(NAMES)
        for m, language in enumerate(LANGUAGES)
    ],
)
def test_it_says_what_python_says(name, language, many, monkeypatch):
    monkeypatch.setattr(exercises, "OPENED", [])
    exercise = told(name, language)
    rng = np.random.default_rng(len(name))
    others = ["Somebody", "Ada Lovelace"]
    asked = []
    for student in STUDENTS[:many]:
        given, _ = draw(exercise, student)
        drawn = {key: given[key] for key in given}
        cases = [
            Case(n, question, Numbers(drawn, exercise.formulas, language=language))
            for n, question in enumerate(exercise.questions, 1)
        ]
        answers = [[case.number, value] for case in cases for value in answers_to(case, rng)]
        foreign = [
            (other, draw(exercise, other)[1])
            for other in ("your name", *others) if normalized(other) != normalized(student)
        ]  # fmt: skip
        answers += [
            [n, float(f"{case.right:.4g}")]
            for _, cases_ in foreign
            for n, case in enumerate(cases_, 1)
        ]
        asked.append((student, cases, answers, foreign))
    played = ask(
        exercises=[data_of(exercise)],
        played=[
            {"exercise": 0, "student": student, "answers": answers, "others": others}
            for student, _, answers, _ in asked
        ],
    )["played"]  # fmt: skip
    judged = 0
    for (student, cases, answers, foreign), found in zip(asked, played, strict=True):
        for (n, value), its in zip(answers, found["replies"], strict=True):
            case = cases[n - 1]
            mine = judge(case, value, [(name, other[n - 1].right) for name, other in foreign])
            hint = words(language).say("python-hint", number=n)
            text = mine.text.removesuffix(hint).rstrip()
            assert (its["verdict"], its["text"], its["mistake"]) == (
                mine.verdict.name.lower(), text, mine.called,
            ), (student, n, value)  # fmt: skip
            judged += 1
        task = lesson(name, student, language)
        compare(task, found, words(language).say)
    assert judged > 200 * many


def compare(task, found, say):
    """Everything that is read, and the progress after right answers, all hints and workings."""
    assert found["story"] in repr(task).replace("\n", " ")
    for n, asked in enumerate(found["asked"], 1):
        passage = task.question(n)
        assert passage.title == asked["title"]
        assert passage.text == f"{asked['text']}\n{asked['needed']}"
        reply = task.check(n, found["right"][n - 1])
        assert found["typed"][n - 1]["heading"] == reply.heading
        for hint in found["hints"][n - 1]:
            read = task.hint(n)
            assert (read.title, read.text.split("\n")[0]) == (hint["title"], hint["text"])
            assert hint["last"] == ("\n" in read.text)
        working = task.reveal(n)
        assert working.title == found["workings"][n - 1]["title"]
        assert working.text == "\n".join(found["workings"][n - 1]["lines"])
    rows = task.progress().rows
    assert found["states"] == [row.state for row in rows] == found["statesAgain"]
    assert found["progress"]["done"] == task.progress().done == found["progress"]["total"]
    assert found["resumed"] == found["result"]
    result = found["result"]
    assert result["answers"] == pytest.approx({str(n): a for n, a in task.answers.items()})
    assert result["revealed"] == list(task.revealed)
    symbols = [f"{symbol} = {value}" for symbol, value, _ in found["rows"]]
    html = re.sub(r"\s+", " ", task._repr_html_())
    assert all(symbol in html for symbol in symbols)


# What machines say


class Told:
    """Quantities of a run by their names, as `measured` has them."""

    def __init__(self, recording, name=""):
        self.recording, self.name = recording, name

    def __getattr__(self, key):
        name = f"{self.name}.{key}"
        known = lookup(name, self.recording.scene.surfaces)
        return self.recording.measure(name) if known else Told(self.recording, name)


@pytest.mark.parametrize("many", [2, pytest.param(100, marks=pytest.mark.slow)])
@pytest.mark.parametrize("name", [name for name in NAMES if EXERCISES[name].machine])
def test_the_machine_with_a_students_numbers_gives_the_answers(name, many):
    exercise, its = EXERCISES[name], find(name)
    scene = scene_of(its, its.page.scene, its.page.settings)
    assert sum(bool(question.measured) for question in exercise.questions) >= 3
    for student in [f"machine {n}" for n in range(many)]:
        cases = draw(exercise, student)[1]
        numbers = cases[0].numbers
        values = {key: numbers.of(formula) for key, formula in exercise.machine.items()}
        ran = simulate(scene.with_values(values), engine="contact")
        told = {key: Told(ran, key) for key in ("separation", "impact", "landing", "ledger")}
        for case in cases:
            if case.question.measured:
                found = eval(case.question.measured, {**numbers.known, **told}, numbers)
                # A disk for a point is larger by a share of 1e-6.
                assert found == pytest.approx(case.right, rel=1e-6, abs=0.0), student


# What is typed


TYPED = [
    ("0.45", "m", 0.45), ("0,45", "m", 0.45), (" -1,8 ", "m/s", -1.8), ("−1.8", "m/s", -1.8),
    (".5", "m", 0.5), (",5", "m", 0.5), ("5.", "m", 5.0), ("+3", "m", 3.0), ("1e-3", "J", 1e-3),
    ("1,2E-3 J", "J", 1.2e-3), ("1.2·10^-3", "J", 1.2e-3), ("1,2 * 10^-3 J", "J", 1.2e-3),
    ("1.2 × 10⁻³", "J", 1.2e-3), ("0.45 m", "m", 0.45), ("0,45m", "m", 0.45),
    ("1.8 m / s", "m/s", 1.8), ("30°", "degrees", 30.0), ("30 deg", "degrees", 30.0),
    ("30 Grad", "Grad", 30.0), ("12 KG/S", "kg/s", 12.0), ("0", "m", 0.0),
    ("", "m", None), ("  ", "m", None), ("...", "m", None), ("?", "m", None), ("-", "m", None),
    ("45 cm", "m", "unit"), ("0.4 ", "", 0.4), ("0.4 %", "", "unit"),
    ("30 rad", "degrees", "unit"), ("abc", "m", "text"), ("NaN", "m", "text"),
    ("m 0.4", "m", "text"), ("<b>1</b>", "m", "text"), ("1/2", "m", "sum"),
    ("2*3", "m", "sum"), ("1.234,5", "m", "pieces"), ("1 000", "m", "pieces"),
    ("1,2;3", "m", "unit"), ("1e999", "m", "infinite"), ("√2", "m", "text"),
    ("sqrt(2)", "m", "text"), ("x=2", "m", "text"), ("1..5", "m", "pieces"),
]  # fmt: skip


def test_what_is_typed_is_understood_or_answered():
    answers = ask(typed=[[text, unit] for text, unit, _ in TYPED])["typed"]
    for (text, unit, value), found in zip(TYPED, answers, strict=True):
        assert (found["why"] if isinstance(found, dict) else found) == value, (text, unit)
