"""Result files of a lesson's live page: marked like notebooks, and none of them stops a class."""

import json
import math
import os
import re

import pytest
from click.testing import CliRunner
from markdown_it import MarkdownIt

from chutelab.classroom import grading
from chutelab.classroom.exercises import EXERCISES, lesson
from chutelab.classroom.exercises.exercise import draw
from chutelab.classroom.exercises.judging import is_rounded
from chutelab.classroom.grading import LARGEST_RESULT, Grade, grade
from chutelab.cli import main


def right(student):
    """The right answer to question 1 of lesson 3: off the plate at ε v0, back."""
    given = lesson("the-bounce", student).given
    return -given.e * given.v0


def result(student="Ada", **changes):
    if "answers" not in changes:
        changes["answers"] = {"1": right(student)}
    return {
        "chutelab_result": 1, "lesson": "the-bounce", "student": student, "tries": {"1": 2},
        "hints": {"1": 1}, "revealed": [], "words": {}, "language": "en", **changes,
    }  # fmt: skip


@pytest.fixture
def returned(tmp_path):
    """Write what was returned into the folder of a class; return its path."""
    folder = tmp_path / "class"
    folder.mkdir()

    def write(name, content):
        text = content if isinstance(content, str) else json.dumps(content)
        path = folder / name
        path.write_text(text, encoding="utf-8")
        return path

    return write


def test_a_result_file_is_judged_again_for_the_numbers_of_its_name(returned):
    forged = result(verdicts={"1": "right", "2": "right"}, score=100, done=4)
    ada = returned("the-bounce-Ada.chutelab.json", forged)
    sign = {"1": -right("Ben"), "2": 3}
    ben = returned("the-bounce-Ben.chutelab (1).JSON", result("Ben", answers=sign, revealed=[2, 2]))
    first, second = grade([ada, ben])
    assert first == Grade(str(ada), "Ada", "the-bounce", (1, 0, 0, 0), 4)
    assert second == Grade(str(ben), "Ben", "the-bounce", (0, 0, 0, 0), 4, (2,))
    assert second.mistakes[1] == "sign or direction"


@pytest.mark.parametrize("name", EXERCISES)
def test_all_right_answers_of_every_lesson_are_marked_so(returned, name):
    # What the working says is right, rounded as the question asks.
    task = lesson(name, "Ada")
    said = [task.reveal(n + 1).text for n in range(len(task.questions))]
    numbers = [next(x for x in text.splitlines() if x.startswith("Answer: ")) for text in said]
    answers = {str(n): float(x.split()[1]) for n, x in enumerate(numbers, 1)}
    [row] = grade([returned("x.json", result(lesson=name, answers=answers))])
    assert row.marks == (1,) * len(numbers)


NONSENSE = [
    ("not JSON", "my homework"),
    ("not JSON", "[" * 100_000),
    ("not JSON", '{"answers": ' + "1" * 10_000 + "}"),
    ("not UTF-8 text", b"\xff\xfe"),
    ('it has no "chutelab_result"', "[]"),
    ('it has no "chutelab_result"', "null"),
    ('it has no "chutelab_result"', {"cells": []}),
    ("upgrade to read it", result(chutelab_result=2)),
    ("chutelab_result: ", result(chutelab_result="1")),
    ("no lesson 'dancing'", result(lesson="dancing")),
    ("lesson: ", result(lesson=["the-bounce"])),
    ("student: ", result(student="  ", answers={})),
    ("student: ", result(student=5, answers={})),
    ("student: ", result(student="x" * 201, answers={})),
    ("student: ", result(student="\ud800", answers={})),
    ("answers: ", result(answers=[1.0])),
    ("answers: 1: ", result(answers={"1": True})),
    ("answers: 1: ", result(answers={"1": "2"})),
    ("answers: 1: ", result(answers={"1": None})),
    ("answers: 1: ", result(answers={"1": 10**400})),
    ("answers: 1: ", result(answers={"1": math.nan})),
    ("answers: 1: ", result(answers={"1": -math.inf})),
    ("answers: ", result(answers={"one": 1})),
    ("questions 1 to 4 only", result(answers={"5": 1.0})),
    ("questions 1 to 4 only", result(revealed=[0])),
    ("revealed: 0: ", result(revealed=[True])),
    ("revealed: ", result(revealed=[1] * 1000)),
    ("words: ", result(words="I think")),
    ("words: explain: ", result(words={"explain": "x" * 10_001})),
]


def test_nonsense_has_its_reason_as_its_row_and_stops_no_other(returned, tmp_path):
    paths = [returned("first.json", result())]
    for i, (_, content) in enumerate(NONSENSE):
        paths.append(returned(f"{i}.json", content if not isinstance(content, bytes) else ""))
        if isinstance(content, bytes):
            paths[-1].write_bytes(content)
    paths.append(returned("last.json", result("Zoe")))
    first, *rows, last = grade(paths)
    for (reason, _), row in zip(NONSENSE, rows, strict=True):
        assert reason in row.reason
        assert len(row.reason) <= 200
        assert (row.student, row.marks, row.out_of) == ("", (), 0)
    assert first.marks == last.marks == (1, 0, 0, 0)


def test_what_is_no_file_or_too_large_a_one_is_said_and_not_waited_for(tmp_path):
    os.mkfifo(tmp_path / "pipe.json")
    (tmp_path / "endless.json").symlink_to("/dev/zero")
    (tmp_path / "folder.json").mkdir()
    with (tmp_path / "large.json").open("wb") as large:
        large.truncate(LARGEST_RESULT + 1)
    names = ("pipe", "endless", "folder", "large", "gone")
    assert [row.reason for row in grade([tmp_path / f"{name}.json" for name in names])] == [
        "not a result file: not a regular file",
        "not a result file: not a regular file",
        "not a result file: not a regular file",
        "too large for a result file, which has at most 256 kB",
        "cannot be read: No such file or directory",
    ]


def test_the_same_student_twice_and_answers_of_another_are_told(returned, monkeypatch):
    # Of 300 made-up students two have this answer: (2 + 1) / (300 + 2) is Laplace's rule.
    right = next(iter(result()["answers"].values()))
    drawn = ((right,) * 4,) * 2 + ((0.0,) * 4,) * 298
    monkeypatch.setattr(grading, "_drawn", lambda _: drawn)
    ada = returned("1.json", result())
    again = returned("2.json", result(" ADA "))
    copied = returned("3.json", result("Cleo", answers=result()["answers"]))
    unnamed = returned("4.json", result("Your name", answers={}))
    reasons = [row.reason for row in grade([ada, again, copied, unnamed])]
    assert reasons == [
        "",
        f"same lesson and student as {ada}",
        "answers 1 are right for the numbers of Ada (by chance: 1 in 101)",
        "the name was left at 'your name'",
    ]


@pytest.mark.slow
def test_it_is_told_how_likely_a_copied_answer_is_by_chance(returned):
    """v = -ε v0 has few values: one of them is right for many; three answers at once are not.

    Shares are counted here among names of this test's own, as a check of those of the grading.
    """
    names = [f"pupil {n}" for n in range(200)]
    rights = [[case.right for case in draw(EXERCISES["the-bounce"], name)[1]] for name in names]

    def told(answers):
        ada = returned("1.json", result("Ada", answers={}))
        ben = returned("2.json", result("Ben", answers={str(n): x for n, x in answers.items()}))
        return [row.reason for row in grade([ada, ben])][1]

    ada = [case.right for case in draw(EXERCISES["the-bounce"], "Ada")[1]]
    share = sum(is_rounded(ada[0], right[0]) for right in rights) / len(names)
    said = told({1: ada[0]})
    chance = re.search(r"are right for the numbers of Ada \((.*)\)", said)[1]
    if chance == "this may be chance":
        assert share > 0.03
    else:
        odds = float(chance.removeprefix("by chance: 1 in "))
        assert 1.0 / odds == pytest.approx(share, rel=0.6, abs=0.01)
    three = {1: ada[0], 2: ada[1], 3: ada[2]}
    assert "(by chance: at most 1 in 302)" in told(three)
    # In a class of thirty the bound for one of the others is 29 times that, and still a bound.
    thirty = [returned(f"{n}.json", result(f"pupil {n}", answers={})) for n in range(28)]
    copied = returned("ben.json", result("Ben", answers={str(n): x for n, x in three.items()}))
    row = list(grade([*thirty, returned("1.json", result("Ada", answers={})), copied]))[-1]
    assert "(by chance: at most 1 in 11)" in row.reason
    # A mistake with one's own numbers is no sign of copying, whatever it is right for.
    assert told({1: -right("Ben")}) == ""


def test_one_page_tells_of_a_class(returned, tmp_path):
    answers = {"1": right("Mia Berg"), "2": 2.0 * right("Mia Berg")}
    returned("1.json", result("Berg, Mia", answers=answers, words={"explain": SAID}))
    returned("2.json", result("Mia Berg", answers={"1": -right("Mia Berg")}))
    returned("3.json", "{")
    page = tmp_path / "class.html"
    marking = ["lesson", "grade", str(tmp_path / "class"), "--report", str(page), "-q"]
    assert CliRunner().invoke(main, marking).exit_code == 0
    text = page.read_text(encoding="utf-8")
    # One pupil under both names: the numbers are the same ones.
    assert "<td class=right>✓ right<small>2 tries, 1 hint</small>" in text
    assert "<td class=wrong>sign or direction<small>2 tries, 1 hint</small>" in text
    assert "<td class=none>no answer" in text
    assert "Not counted" in text
    assert "not a result file: not JSON" in text
    assert "<td>1 of 2<small>1 × sign or direction</small>" in text
    assert "<td>1 of 4" in text
    assert "<h3>What they wrote</h3>" in text
    for markup in ("<b>", "<i>", "<img", "<script", "\x1b"):
        assert markup not in text


def test_the_report_keeps_all_files_of_one_name(returned, tmp_path):
    """Two students may have one name, or one of them has returned twice."""
    first = returned("1.json", result(words={"explain": "The plate took half."}))
    returned("2.json", result(" ADA ", answers={"1": -right("Ada")}, words={"explain": "Later."}))
    returned("3.json", result("Ben"))
    report = tmp_path / "class.md"
    marking = ["lesson", "grade", str(tmp_path / "class"), "--report", str(report), "-q"]
    assert CliRunner().invoke(main, marking).exit_code == 0
    text = report.read_text(encoding="utf-8").replace("\\", "")
    assert "2 students, 3 files" in text
    assert "Ada: several files have this name, and all count" in text
    assert f"**Ada** (explain, {first}):" in text
    cells = [row.split(" | ")[1:] for row in text.splitlines() if row.startswith("| 1 ")]
    assert cells[0] == ["2", "1", "0", "0 |"]
    assert "The plate took half." in text
    assert "Later." in text
    assert "Not counted" not in text


def test_only_notebooks_need_a_kernel(returned, monkeypatch):
    monkeypatch.setattr("chutelab.classroom.grading.find_spec", lambda _: None)
    path = returned("x.json", result())
    assert [row.total for row in grade([path])] == [1]
    with pytest.raises(ImportError, match="grading notebooks needs IPython and psutil"):
        grade([path, "x.ipynb"])


SAID = "The belt | *gave* it <b>ε</b> v0.\x1b[31m\n\n# Not a heading\n![x](http://x)"


def test_table_csv_json_and_report_tell_of_a_class(returned, tmp_path):
    ada = returned("ada.json", result(revealed=[1], words={"explain": SAID, "empty": " "}))
    answers = {"1": -right("*Ben* | <i>")}
    returned("ben.json", result("*Ben* | <i>", answers=answers))
    returned("broken.json", "{")
    out, report = tmp_path / "class.csv", tmp_path / "class.md"
    marking = ["lesson", "grade", str(ada.parent), "--out", str(out), "--report", str(report)]
    shown = CliRunner(env={"COLUMNS": "200"}).invoke(main, marking)
    assert shown.exit_code == 0
    assert "1 of 4 (1* 0 0 0)" in shown.output
    assert "Ada,the-bounce,1,0,0,0,1,4,1,," in out.read_text(encoding="utf-8").splitlines()[1]
    as_json = json.loads(CliRunner().invoke(main, [*marking, "--json"]).output)
    assert [one["student"] for one in as_json["grades"]] == ["Ada", "*Ben* | <i>", ""]
    assert as_json["grades"][0]["revealed"] == [1]
    assert as_json["grades"][0]["words"] == {"explain": SAID.replace("\x1b", r"\x1b")}
    assert as_json["grades"][1]["mistakes"] == {"1": "sign or direction"}
    text = report.read_text(encoding="utf-8")
    made = MarkdownIt("commonmark").enable("table").render(text)
    assert "2 students" in made
    cells = [row.split(" | ")[1:] for row in text.splitlines() if row.startswith("| 1 ")]
    assert cells == [["1", "1", "0", "1 |"], ["sign or direction", "1 |"]]
    assert "<strong>Ada</strong> (explain)" in made
    assert "not a result file: not JSON" in made
    # What a student wrote is shown as it is.
    for markup in ("<b>", "<i>", "<img", "<h1>Not", "<em>", "href", "\x1b"):
        assert markup not in made
    assert "The belt | *gave* it &lt;b&gt;ε&lt;/b&gt; v0." in made


def test_a_folder_stands_for_all_in_it_but_hidden_copies(returned, tmp_path):
    for place in ("Ada_1", "Ben_2/.ipynb_checkpoints"):
        (tmp_path / "class" / place).mkdir(parents=True)
    returned("Ada_1/result.json", result())
    returned("Ben_2/result.json", result("Ben"))
    returned("Ben_2/.ipynb_checkpoints/result.json", result("Ben"))
    marking = ["lesson", "grade", str(tmp_path / "class"), "--json"]
    returned("Ada_1/homework.docx", "")
    shown = CliRunner().invoke(main, marking)
    found = json.loads(shown.stdout)["grades"]
    assert [one["student"] for one in found] == ["Ada", "Ben"]
    assert shown.stderr == "neither notebook (*.ipynb) nor result file (*.json): homework.docx\n"
