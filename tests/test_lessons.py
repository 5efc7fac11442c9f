"""The lessons: found, validated, started, built."""

import json
import re
import shutil
from math import inf
from pathlib import Path

import pytest
from PIL import Image

from chutelab.classroom.lessons import LessonError, find, machine_of, read, scene_of
from chutelab.classroom.lessons.building import build, comment_of, is_current, start
from chutelab.classroom.lessons.steps import quantities_in
from chutelab.machine import build as build_machine
from chutelab.pictures.live.describe import describe
from chutelab.scene import MISSING
from chutelab.scene.overrides import value_at
from chutelab.scene.quantities import lookup, whose
from shared import chutelab, lessons, some

NAMES = [
    "film-a-ball",
    "the-parabola",
    "letting-go",
    "the-bounce",
    "turning-the-plate",
    "landing",
    "grip-or-slip",
    "a-stream",
    "trust",
]


# What there is -----------------------------------------------------------------------------------


def test_the_lessons_are_in_order():
    assert [lesson.name for lesson in lessons()][: len(NAMES)] == NAMES
    assert [lesson.number for lesson in lessons()] == list(range(len(lessons())))


@pytest.mark.parametrize("wanted", [3, "3", "03", "the-bounce", "03-the-bounce", "The-Bounce"])
def test_a_lesson_is_found_by_number_or_name(wanted):
    assert find(wanted).folder.name == "03-the-bounce"


@pytest.mark.parametrize(
    ("wanted", "said"),
    [("bounce", "did you mean the-bounce?"), ("99", "there are 00-film-a-ball"), ("", "there are")],
)
def test_what_is_not_there_is_refused_with_advice(wanted, said):
    result = chutelab("lesson", "show", wanted)
    assert result.exit_code == 2
    assert said in result.stderr


NUMBERS = [lesson.number for lesson in lessons()]


@pytest.mark.parametrize("number", some(NUMBERS))
def test_every_table_can_be_filled_on_the_lessons_page(number):
    """Each value that a step asks for can be set there, each quantity is told there.

    The page knows a key as a number with a range, a point, or a friction; and what it starts with
    is within the ranges, and measured from the top of the pulley, as it measures itself.
    """
    lesson = find(number)
    scene = scene_of(lesson, lesson.page.scene, lesson.page.settings)
    page = describe(scene)
    live, tables = lesson.page.live, page["tables"]
    assert scene.outgoing is None or scene.outgoing.drop_from == "top"
    for key, (low, high) in live["ranges"].items():
        value = value_at(scene, key)
        assert value == "adhesion" or low <= value <= high, key
    kinds = []
    for step in lesson.steps:
        kinds.append(step.kind)
        own = machine_of(lesson, step)
        for key in step.open(live["controls"]):
            table, *_, name = re.sub(r"\[\d+\]", "", key if "." in key else f"scene.{key}").split(
                "."
            )
            rule = tables[table][name]
            assert "low" in rule or "unit" in rule or name in ("from", "to"), key
            assert name in ("from", "to") or value_at(own, key) is not MISSING
        for row in step.rows:
            assert set(row.set) <= set(step.open(live["controls"]))
            for key, value in row.set.items():
                low, high = live["ranges"].get(key, (-inf, inf))
                assert isinstance(value, str | list) or low <= value <= high
            # What the page makes of the row is what Python does.
            assert build_machine(machine_of(lesson, step, row)) is not None
            describe(machine_of(lesson, step, row))
        for column in step.columns:
            names = quantities_in(column.value) if column.value else []
            for name in names:
                assert lookup(name, own.surfaces) is not None
                assert whose(lookup(name, own.surfaces), own.count) == ""
            assert len(column.given) in (0, len(step.rows))
    assert kinds[0] == "predict"
    assert kinds[-2:] == ["explain", "numbers"]
    assert sum(step.minutes for step in lesson.steps) == lesson.minutes
    # A prediction asks what the lesson asks: nothing is marked where it cannot be right.
    for step in lesson.steps:
        for ask in step.asks:
            assert not ask.choices or ask.right in range(1, len(ask.choices) + 1)
            assert ask.mark in (None, "landing.x", "separation.x")


def test_lesson_2_asks_where_the_particle_lets_go():
    (step, *_) = find(2).steps
    assert [ask.mark for ask in step.asks if ask.mark] == ["separation.x"]


# lesson.toml -------------------------------------------------------------------------------------


BROKEN = """
title = 3
levl = "core"
minutes = 2
scenes = ["perpendicular", "inclined-21"]

[picture]
fps = 30
widht = 3

[page]
scene = "elsewhere"
"""


def test_all_faults_of_a_file_are_in_one_message(tmp_path):
    (tmp_path / "lesson.toml").write_text(BROKEN, encoding="utf-8")
    with pytest.raises(LessonError) as caught:
        read(tmp_path)
    message = str(caught.value)
    assert message.startswith(f"{tmp_path / 'lesson.toml'}: 10 faults")
    for said in (
        "title = 3: must be a text of 1 to 200 characters",
        'level is missing: "start", "core" or "advanced"',
        "minutes = 2: must be a whole number from 5 to 600",
        "question is missing: a text of 1 to 200 characters",
        "picture.fps = 30: must be 10, 20, 25 or 50",
        "picture.widht = 3: unknown key; did you mean picture.width?",
        'levl = "core": unknown key; did you mean level?',
        'scenes[1] = "inclined-21": no shipped scene, and no file beside lesson.toml; did you mean',
        "steps is missing: 1 to 20 tables [[steps]]",
        'page.scene = "elsewhere": must be one of scenes: perpendicular, inclined-21',
    ):
        assert said in message


@pytest.fixture(scope="module")
def fresh(tmp_path_factory):
    return start(tmp_path_factory.mktemp("fresh") / "my-lesson")


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        ('value = "x3"', 'value = "x9"', 'steps[2].columns[0].value = "x9": no quantity of this'),
        ('value = "x3"', 'value = "x3 +"', 'columns[0].value = "x3 +": must be a formula of'),
        ('value = "x3"', 'valeu = "x3"', "steps[2].columns[0].valeu"),
        ('"plate.restitution" = 1 ', '"plate.restitution" = 2 ', "steps[2].rows[1].set"),
        ('"plate.restitution" = 1 ', '"plate.angle_deg" = 1 ', "must be one of the step's contr"),
        ("{plate.restitution}", "{plate.angle_deg}", 'steps[1].text = "plate.angle_deg": must be'),
        ('replies = ["Yes.", ', "replies = [", "steps[0].asks[1].replies"),
        ("right = 1", "right = 3", "steps[0].asks[1].right = 3: must say which of choices"),
        ('mark = "landing.x"', 'mark = "flying.x"', 'asks[0].mark = "flying.x": no quantity'),
        ('kind = "try"', 'kind = "play"', 'steps[1].kind = "play": must be "predict", "try"'),
        ("set = []", 'set = ["plate.tilt=3"]', "picture.set = "),
        ('["plate.restitution"]', '["plate.tilt"]', 'page.live.controls[0] = "plate.tilt": unk'),
        ("[page.live]", "live = 3\n[other]", "page.live = 3: must be a table such as [live] of"),
        ("[page.live]", "[page.vary]", "page.vary = a table: unknown key; known are scene, set, l"),
        ("ranges = {", "predict = 1\nranges = {", "page.live.predict = 1: must be true or false"),
        (
            "ranges = {",
            "panel = []\nranges = {",
            "page.live.panel = []: unknown key; did you",
        ),
        ("minutes = 45", "minutes = true", "minutes = true: must be a whole number"),
        ('["scene.toml"]', '["../scene.toml"]', 'scenes[0] = "../scene.toml": no shipped scene'),
        ('["scene.toml"]', '["a\\u0000b"]', "scenes[0] = "),
        ('["scene.toml"]', "3", "scenes = 3: must be a list of 1 to 20 names"),
        ('["scene.toml"]', "[]", "scenes = []: must be a list of 1 to 20 names"),
        ("title =", "title = =", "not TOML"),
    ],
)
def test_a_fault_names_file_key_value_and_what_is_allowed(fresh, tmp_path, old, new, said):
    folder = Path(shutil.copytree(fresh, tmp_path / "my-lesson"))
    plan = folder / "lesson.toml"
    text = plan.read_text(encoding="utf-8")
    assert old in text
    plan.write_text(text.replace(old, new, 1), encoding="utf-8")
    result = chutelab("lesson", "show", folder)
    assert result.exit_code == 2
    assert str(plan.resolve()) in result.stderr or str(plan) in result.stderr
    assert said in result.stderr
    assert chutelab("lesson", "build", folder).exit_code == 2
    assert not (folder / "lesson.gif").exists()


def test_a_broken_scene_beside_a_lesson_is_a_fault_of_the_lesson(tmp_path):
    folder = start(tmp_path / "my-lesson")
    scene = folder / "scene.toml"
    scene.write_text(scene.read_text(encoding="utf-8").replace("speed = 2.0", "speed = -2.0"))
    with pytest.raises(LessonError, match=r"scenes\[0\] = \"scene.toml\": .*incoming.speed = -2.0"):
        read(folder)


# build -------------------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def small(tmp_path_factory):
    """A lesson with a small picture, built; the tests copy it."""
    folder = start(tmp_path_factory.mktemp("built") / "small")
    plan = folder / "lesson.toml"
    text = plan.read_text(encoding="utf-8")
    for old, new in (("fps = 25", "fps = 10"), ("800", "320"), ("450", "180")):
        text = text.replace(old, new, 1)
    plan.write_text(text.replace("# slow = 8 ", "slow = 2 ", 1), encoding="utf-8")
    assert build(read(folder)).made
    return folder


@pytest.fixture
def copied(small, tmp_path):
    return Path(shutil.copytree(small, tmp_path / "small"))


def test_what_has_not_changed_is_not_built_again(copied):
    before = (copied / "lesson.gif").stat().st_mtime_ns
    assert not build(read(copied)).made
    assert (copied / "lesson.gif").stat().st_mtime_ns == before
    assert build(read(copied), force=True).made


@pytest.mark.parametrize(
    ("file", "old", "new", "made"),
    [
        ("scene.toml", "restitution = 0.5", "restitution = 0.4", True),
        ("scene.toml", "# What to look at.", "# Another comment.", False),
        pytest.param(
            "lesson.toml",
            "set = []",
            'set = ["plate.restitution=0.3"]',
            True,
            marks=pytest.mark.slow,
        ),
        ("lesson.toml", "slow = 2", "slow = 1.5", True),
        ("lesson.toml", "minutes = 45", "minutes = 50", False),
        ("lesson.toml", "Where does the particle land?", "Where will it land?", False),
    ],
)
def test_a_picture_is_built_again_when_what_it_shows_has_changed(copied, file, old, new, made):
    text = (copied / file).read_text(encoding="utf-8")
    assert old in text
    (copied / file).write_text(text.replace(old, new, 1), encoding="utf-8")
    assert build(read(copied)).made is made


@pytest.mark.slow
def test_a_picture_without_a_stamp_or_a_broken_one_is_built_again(copied):
    picture = copied / "lesson.gif"
    whole = picture.read_bytes()
    for broken in (whole[:1000], whole.replace(b"chutelab lesson", b"somebody's film")):
        picture.write_bytes(broken)
        assert build(read(copied)).made
        assert picture.read_bytes() == whole


def test_the_stamp_is_the_comment_of_the_picture(small, tmp_path):
    data = (small / "lesson.gif").read_bytes()
    stamp = comment_of(small / "lesson.gif")
    versions = r"chutelab \d.*, numpy \d.*, matplotlib \d.*, pillow \d.*"
    assert re.fullmatch(rf"chutelab lesson; inputs [0-9a-f]{{32}}; {versions}", stamp)
    with Image.open(small / "lesson.gif") as gif:
        assert gif.info["comment"].decode() == stamp
    for broken in (data[:-1], b"\x89PNG;", b""):
        (tmp_path / "broken.gif").write_bytes(broken)
        assert comment_of(tmp_path / "broken.gif") == ""
    assert comment_of(tmp_path / "missing.gif") == ""


@pytest.mark.parametrize("lesson", lessons(), ids=lambda lesson: lesson.name)
def test_shipped_pictures_show_what_the_lessons_say(lesson):
    assert is_current(lesson), f"run: chutelab lesson build {lesson.number}"
    picture = lesson.folder / "lesson.gif"
    assert picture.stat().st_size < 400_000
    with Image.open(picture) as film:
        assert film.size == (1280, 720)
        assert film.n_frames > 40


def test_a_film_has_the_machine_beside_it_and_the_split_if_wanted(copied):
    with Image.open(copied / "machine.png") as machine:
        # The scene of the film alone, at twice its pixels.
        assert machine.size == pytest.approx((2 * 0.675 * 320, 2 * 0.65 * 180), abs=1)
    assert not (copied / "split.png").exists()
    (copied / "machine.png").unlink()
    plan = (copied / "lesson.toml").read_text(encoding="utf-8")
    (copied / "lesson.toml").write_text(plan.replace("split = false", "split = true"))
    assert build(read(copied)).made
    assert (copied / "machine.png").is_file()
    assert (copied / "split.png").is_file()


@pytest.mark.slow
def test_build_of_the_command_line_writes_elsewhere_too(copied, tmp_path):
    out = tmp_path / "out"
    first = chutelab("lesson", "build", copied, "--out", out)
    again = chutelab("lesson", "build", copied, "--out", out)
    assert (first.exit_code, again.exit_code) == (0, 0)
    assert "lesson.gif: written, " in first.stdout
    assert "lesson.gif: up to date, " in again.stdout
    assert (out / "small" / "lesson.gif").read_bytes() == (copied / "lesson.gif").read_bytes()
    assert chutelab("lesson", "build", copied, "-q").stdout == ""


def test_where_nothing_can_be_written_says_so_and_what_to_do(copied, tmp_path):
    (tmp_path / "file").write_text("in the way")
    result = chutelab("lesson", "build", copied, "--out", tmp_path / "file")
    assert result.exit_code == 2
    assert "cannot be written" in result.stderr
    assert "--out DIR" in result.stderr


# new ---------------------------------------------------------------------------------------------


def test_a_new_lesson_can_be_shown_at_once(tmp_path):
    result = chutelab("lesson", "new", tmp_path / "09-our-lesson")
    assert result.exit_code == 0
    shown = chutelab("lesson", "show", tmp_path / "09-our-lesson")
    assert shown.exit_code == 0
    assert "9  Our lesson" in shown.stdout
    assert "Note these runs, and one of your own." in shown.stdout


def test_a_new_lesson_can_be_a_copy(tmp_path):
    assert chutelab("lesson", "new", tmp_path / "ours", "--from", "3").exit_code == 0
    lesson, model = find(tmp_path / "ours"), find(3)
    assert lesson.model_dump() == model.model_dump()
    assert {p.name for p in lesson.folder.iterdir()} >= {"table-1.toml", "lesson.gif"}
    pictures = [(one.folder / "lesson.gif").read_bytes() for one in (lesson, model)]
    assert pictures[0] == pictures[1]


def test_new_never_overwrites(tmp_path):
    (tmp_path / "mine").mkdir()
    (tmp_path / "mine" / "notes").write_text("dear to me")
    result = chutelab("lesson", "new", tmp_path / "mine")
    assert result.exit_code == 2
    assert "is there already" in result.stderr
    assert [path.name for path in tmp_path.iterdir()] == ["mine"]
    assert (tmp_path / "mine" / "notes").read_text() == "dear to me"


@pytest.mark.parametrize("name", ["My lesson", "-x", "x" * 61, "ärger", ".hidden"])
def test_names_that_will_not_do_are_refused(tmp_path, name):
    with pytest.raises(LessonError, match="lower-case letters, digits and hyphens"):
        start(tmp_path / name)
    assert list(tmp_path.iterdir()) == []


# list and show -----------------------------------------------------------------------------------


def test_list_names_every_lesson():
    printed = chutelab("lesson", "list").stdout
    for name in NAMES:
        assert name in printed
    listed = json.loads(chutelab("lesson", "list", "--json").stdout)["lessons"]
    assert [one["name"] for one in listed] == [lesson.name for lesson in lessons()]
    assert set(listed[3]["files"]) >= {"lesson.gif", "lesson.toml", "table-1.toml"}


@pytest.mark.parametrize("number", some(NUMBERS))
def test_show_has_question_scenes_quantities_and_worksheet(number):
    lesson = find(number)
    shown = chutelab("lesson", "show", number)
    assert shown.exit_code == 0
    flat = " ".join(shown.stdout.split())
    for said in (lesson.title, lesson.question, "1. Predict", "Your numbers"):
        assert said in flat
    assert "$" not in flat
    assert " ".join(lesson.teacher.say.split()[:6]) not in flat
    for name in lesson.scenes:
        assert name in flat
    assert json.loads(chutelab("lesson", "show", number, "--json").stdout)["number"] == number


def test_grade_refuses_what_is_no_notebook(tmp_path):
    assert chutelab("lesson", "grade").exit_code == 2
    assert chutelab("lesson", "grade", tmp_path / "missing.ipynb").exit_code == 2
    result = chutelab("lesson", "grade", tmp_path)
    assert result.exit_code == 2
    assert "no notebook (*.ipynb)" in result.stderr
    (tmp_path / "broken.ipynb").write_text("{", encoding="utf-8")
    result = chutelab("lesson", "grade", tmp_path, "--out", tmp_path / "class.csv")
    assert result.exit_code == 2
    assert "JSON" in result.stdout
    assert "nothing to mark" in result.stderr
    assert not (tmp_path / "class.csv").exists()
