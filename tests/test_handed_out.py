"""Nothing that a student gets before the prediction has a number of the answer on it.

Read are the sheet in each format, the lesson's page, its card and its live page, and the pictures:
what is written in the film's first part and in the picture of the machine, and its pixels.
"""

import io
import re
from functools import cache
from html.parser import HTMLParser

import numpy as np
import pytest
from PIL import Image
from pypdf import PdfReader

from chutelab.classroom.exercises import EXERCISES
from chutelab.classroom.exercises import find as find_exercise
from chutelab.classroom.exercises.exercise import draw, shown
from chutelab.classroom.lessons import scene_of
from chutelab.classroom.lessons.pages import bundle
from chutelab.classroom.lessons.sheets import printed
from chutelab.classroom.lessons.steps import quantities_in
from chutelab.classroom.lessons.texts import without_tex
from chutelab.engines.simulation import judged
from chutelab.pictures.animation import lay_out
from chutelab.pictures.animation.files import palette
from chutelab.pictures.animation.moments import asked, film, slowness, span
from chutelab.pictures.plots import style
from chutelab.results.quantities import measure
from chutelab.util.words import words
from shared import find, lessons, some

NUMBERS = [lesson.number for lesson in lessons()]

TOLD = {
    0: {"30", "60"},  # frames a second
    3: {"0.137", "0.371", "0.550"},  # the paper's table, which is to be judged
    4: {"20", "40", "60"},  # the plates that one chooses from
    6: {"36.4", "0.5"},  # the textbook's angle, and the belt's µ
    7: {"10", "50"},  # rates to choose from
    8: {"0.05", "0.1", "0.2", "0.200", "9.7", "4.9", "13"},  # steps, ms, and their errors
    9: {"60", "14"},  # the end of the range that is searched, and an equation
    11: {"0.8"},  # a rolling friction to try
    12: {"0.3"},  # how far below the axis the formulas are compared, m
    13: {"0.01"},  # a damper, N m s
}
"""What answers share with questions, by lesson, since the question gives it."""


def numbers_in(text):
    """Numbers with decimals, and whole ones of two digits or more, as they are written."""
    text = re.sub(r"(?<=\d),(?=\d)", ".", text)
    text = re.sub(r"^chutelab .*$|^ *--.*$|`[^`]*`", "", text, flags=re.MULTILINE)
    return set(re.findall(r"(?<![\w.])\d+\.\d+|(?<![\w.])\d{2,}(?![\w.])", text))


@cache
def recording(number, name, settings=()):
    return judged(scene_of(find(number), name, settings))


@cache
def answers(number):
    """Numbers of the teacher's key, of the exercise as shipped, and of what the runs measure."""
    lesson = find(number)
    found = set()
    for step in lesson.steps:
        for ask in step.asks:
            # What one chooses from stands on the sheet.
            told = numbers_in(without_tex(ask.answer)) - numbers_in(" ".join(ask.choices))
            found |= told
    if lesson.name in EXERCISES:
        _, cases = draw(find_exercise(lesson.name), "your name")
        found |= numbers_in(" ".join(shown(abs(case.right)) for case in cases))
    for name in lesson.scenes:
        if "stream" in name:  # seconds of computing, and the bed's numbers are the same
            continue
        for quantity in {one for formula in lesson.columns for one in quantities_in(formula)}:
            try:
                value = abs(measure(recording(number, name), quantity))
            except KeyError:
                continue
            forms = (f"{value:.4f}", f"{value:.3f}", f"{value:.2f}", f"{1e3 * value:.1f}")
            found |= {form for form in forms if float(form)} if value % 1.0 else set()
    return found


class Words(HTMLParser):
    """What a reader of a page sees or hears: text, titles, words for pictures."""

    def __init__(self, page):
        super().__init__()
        self.said, self.open = [], []
        self.feed(page)

    def handle_starttag(self, tag, attrs):
        if tag in ("script", "style"):
            self.open.append(tag)
        self.said += [value or "" for key, value in attrs if key in ("alt", "title", "aria-label")]

    def handle_endtag(self, tag):
        if self.open and self.open[-1] == tag:
            self.open.pop()

    def handle_data(self, data):
        if not self.open:
            self.said.append(data)


def seen(page):
    """Text of a page, formulas and code apart."""
    page = re.sub(r"<(math|pre|code).*?</\1>", " ", page, flags=re.DOTALL)
    return "\n".join(Words(page).said)


@pytest.fixture(scope="module")
def web(tmp_path_factory):
    made = tmp_path_factory.mktemp("web")

    @cache
    def of(number):
        bundle([find(number)], made / str(number), wheel=False)
        return made / str(number)

    return of


@pytest.fixture(params=some([1, *(n for n in NUMBERS if n != 1)], len(NUMBERS)))
def number(request):
    return request.param


def given_away(number, text):
    return numbers_in(text) & answers(number) - TOLD.get(number, set())


@pytest.mark.parametrize("kind", ["md", "html", pytest.param("pdf", marks=pytest.mark.slow)])
def test_no_number_of_the_answer_is_on_the_students_sheet(number, kind):
    sheet = printed(find(number), "student", kind)
    if kind == "pdf":
        reader = PdfReader(io.BytesIO(sheet))
        text = "\n".join(page.extract_text() for page in reader.pages)
        # Numbers of pages.
        text = re.sub(r"chutelab \d / \d", "", text)
    else:
        text = sheet.decode("utf-8")
        text = seen(text) if kind == "html" else without_tex(text)
    assert len(answers(number)) > 3
    assert "Your numbers" in text
    assert given_away(number, text) == set()
    assert "teacher" not in text


def test_no_number_of_the_answer_is_on_the_lessons_page(number, web):
    lesson = find(number)
    web = web(number)
    page = (web / lesson.folder.name / "index.html").read_text(encoding="utf-8")
    assert lesson.title in page
    assert given_away(number, seen(page)) == set()
    live = (web / lesson.folder.name / "page.html").read_text(encoding="utf-8")
    assert given_away(number, seen(live)) == set()
    index = (web / "index.html").read_text(encoding="utf-8")
    (card,) = re.findall(
        rf'<li class="card">\s*<a href="{lesson.folder.name}/.*?</li>', index, re.DOTALL
    )
    assert given_away(number, seen(card)) == set()


def first_part(path):
    """The frames of a film up to the one that waits for a prediction, and the last frame."""
    with Image.open(path) as opened:
        frames, delays = [], []
        for index in range(opened.n_frames):
            opened.seek(index)
            delays.append(opened.info["duration"])
            frames.append(np.asarray(opened.convert("RGB")))
    waits = delays.index(3000)
    return frames[: waits + 1], frames[-1]


def dashes(frame):
    """How many pixels of the scene have the colour of the analytic path."""
    colour = [int(style.ANALYTIC[i : i + 2], 16) for i in (1, 3, 5)]
    assert style.ANALYTIC.lower() in [one.lower() for one in palette()]
    height, width = frame.shape[:2]
    # Below the legend, left of the energy.
    scene = frame[int(0.23 * height) : int(0.86 * height), : int(0.68 * width)]
    return int((scene == colour).all(axis=-1).sum())


def test_a_film_begins_without_the_path_and_waits(number):
    lesson = find(number)
    before, last = first_part(lesson.folder / "lesson.gif")
    assert [dashes(frame) for frame in before] == [0] * len(before)
    made = recording(number, lesson.picture.scene, tuple(lesson.picture.set))
    # Of a ball, of streams and of what hangs there is no closed form.
    known = number not in (0, 7, 10, 11, 12, 13)
    assert (dashes(last) > 30) is known
    machine = np.asarray(Image.open(lesson.folder / "machine.png").convert("RGB"))
    colour = [int(style.ANALYTIC[i : i + 2], 16) for i in (1, 3, 5)]
    assert not (np.abs(machine.astype(int) - colour).max(axis=-1) < 8).any()
    layout = lay_out(made, width=800, height=450, question=lesson.question)
    begin, end = span(made, layout.window)
    ask = asked(made, begin)
    moments = film(made, begin, end, fps=25, slow=slowness(end - begin), ask=ask)
    early = [moment.words for moment in moments if moment.t <= ask]
    assert early[-1] == words().say("picture-ask")
    assert given_away(number, "\n".join(early)) == set()
    assert (moments[0].t, moments[-1].t) == (begin, end)
