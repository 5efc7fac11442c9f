"""``lesson``: list, show, build, start, grade and bundle lessons."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

import click
from click.shell_completion import CompletionItem

from chutelab.cli import console
from chutelab.cli.console import InOrder, RefusedError, main, progress
from chutelab.cli.options import (
    FileName,
    Folder,
    FolderName,
    Number,
    Texts,
    beginning,
    check_file,
    command,
)
from chutelab.util.errors import printable
from chutelab.util.files import whole, write_lines, writing

if TYPE_CHECKING:
    from chutelab.classroom.grading import Grade
    from chutelab.classroom.lessons import Lesson


def complete_lesson(begun: str) -> list[CompletionItem]:
    """Offer the shipped lessons whose names, with or without number, begin with a text."""
    from chutelab.classroom.lessons import shipped_lessons

    found = shipped_lessons()
    titles = {name: one.title for one in found for name in (one.name, one.folder.name)}
    return beginning(titles, begun)


HEADS = ("file", "student", "lesson", "marks (*: working shown)", "remarks")

MOST_NAMED = 8
"""Most files of a folder that are listed as left out."""

LessonName = Annotated[str, FileName(), complete_lesson]
LessonNames = Annotated[Texts, FileName(), complete_lesson]


@main.group(
    cls=InOrder,
    short_help="Lessons: list, show, new, page, build, grade, scorm and more.",
    epilog="Begin with: chutelab lesson list, then: chutelab lesson show 1",
)
def lesson() -> None:
    """Teach with chutelab: lessons with a worksheet, an exercise and an animation each.

    A lesson is given by its number (3), its name (the-bounce), or the folder of one that you wrote
    yourself. The worksheet says what to predict, what to run, what to compare and what to explain.
    """


@command("List the lessons.", lesson)
def list_(*, json_: bool) -> None:
    """List the lessons: number, name, level, duration, and the question of each."""
    from chutelab.classroom.lessons import shipped_lessons
    from chutelab.util.tables import Sheet

    found = shipped_lessons()
    rows = [
        (str(one.number), one.name, one.level, str(one.minutes), f"{one.title}\n{one.question}")
        for one in found
    ]
    heads = ("", "lesson", "level", "minutes", "what it is about")
    table = Sheet("", heads, tuple(rows), texts=5)
    console.tell({"lessons": [_plain(one) for one in found]}, table, as_json=json_)


@command("Show one lesson, or print its sheets.", lesson)
def show(
    lesson: LessonName | None = None,
    *,
    sheet: Literal["student", "teacher", "explanation"] | None,
    out: Path | None,
    format_: Literal["md", "html", "pdf"] | None,
    all_: bool,
    language: str = "en",
    json_: bool,
) -> None:
    """Show one lesson: its question, scenes and quantities, its files, and the worksheet.

    With --sheet it is one sheet; without -o it is printed, as Markdown in plain characters.

    chutelab lesson show 3
    chutelab lesson show 3 --sheet student -o sheet.pdf
    chutelab lesson show --all --sheet teacher -o sheets/
    chutelab lesson show 3 --language de
    chutelab lesson show ./my-lesson

    --sheet  One sheet to hand out: the student's (without answers), the teacher's (key, mistakes,
        goals), or the explanation.
    -o, --out FILE  Write the sheet into this file, or into a folder. The ending of the file, .md,
        .html or .pdf, sets the format.
    --format  Markdown, a web page in one file, or A4 to print (which needs the extra
        chutelab[pdf]); default: as the file's name says, in a folder pdf.
    --all  The sheet of every shipped lesson.
    --json  Print one JSON object instead of text.
    """
    if (lesson is None) is not all_:
        raise RefusedError("name one LESSON, as in: chutelab lesson show 3; or give --all")
    if sheet is not None or out is not None or format_ is not None or all_:
        if json_:
            raise RefusedError("--sheet is a text, and --json is not: give one of them")
        if sheet is None:
            raise RefusedError("say which one: --sheet student, teacher or explanation")
        _hand_out(_lessons((lesson,) if lesson else (), language), sheet, out, format_)
        return
    from rich.markdown import Markdown
    from rich.text import Text

    from chutelab.classroom.lessons import find, scene_of
    from chutelab.classroom.lessons.sheets import worksheet
    from chutelab.classroom.lessons.texts import plain_of, without_tex
    from chutelab.util.tables import Sheet
    from chutelab.util.words import words

    found, say = find(lesson or "", language), words(language).say
    if json_:
        console.show_json({"format": 1, **_plain(found)})
        return
    number = "" if found.number is None else f"{found.number}  "
    level = say("show-about", level=say(f"level-{found.level}"), minutes=found.minutes)
    about = f"\n{found.question}\n{level}"
    head = Text(f"{number}{found.title}", style="bold").append(about, style="not bold")
    scenes = tuple((name, scene_of(found, name).title) for name in found.scenes)
    if found.untranslated:
        console.show(Text(f"{say('untranslated')}\n"))
    heads = (say("show-scene"), say("show-shows"))
    console.show(head, Sheet(say("show-scenes"), heads, scenes, texts=2))
    if found.columns:
        unit = words(language).unit
        rows = tuple(
            (name, unit(one.unit), without_tex(one.head)) for name, one in found.columns.items()
        )
        columns = (say("show-quantity"), say("show-unit"), say("show-meaning"))
        console.show(Sheet(say("show-quantities"), columns, rows, texts=3))
    console.show(Text(f"\n{say('show-files', folder=found.folder)}\n"))
    console.show(Markdown(plain_of(worksheet(found)), hyperlinks=False))


def _hand_out(lessons: list[Lesson], sheet: str, out: Path | None, kind: str | None) -> None:
    """Print one sheet of each lesson, or write it into a file or a folder."""
    from chutelab.classroom.lessons.sheets import FORMATS, printed
    from chutelab.classroom.lessons.texts import without_tex

    if out is None:
        if kind == "pdf" or len(lessons) > 1:
            raise RefusedError("say where to: -o sheet.pdf, or a folder: -o sheets/")
        made = printed(lessons[0], sheet, kind or "md").decode("utf-8")
        console.say(made if kind else without_tex(made), end="")
        return
    ending = out.suffix.removeprefix(".").lower()
    into = out.is_dir() or len(lessons) > 1 or not ending
    if not into and ending not in FORMATS:
        raise RefusedError(f"{out.name}: allowed are files that end in .md, .html or .pdf")
    if not into and kind not in (None, ending):
        raise RefusedError(f"{out.name} ends in .{ending}, and --format says {kind}")
    how = kind or ("pdf" if into else ending)
    with writing(instead="another place: -o"):
        for one in lessons:
            path = out / f"{one.folder.name}-{sheet}.{how}" if into else out
            content = printed(one, sheet, how)
            path.parent.mkdir(parents=True, exist_ok=True)
            with whole(path) as unfinished:
                unfinished.write_bytes(content)
            console.say(f"wrote {path}")


@command("Make film and notebook of each lesson that changed.", lesson)
def build(lessons: LessonNames = (), *, out: Folder, force: bool, quiet: bool) -> None:
    """Make lesson.gif and exercise.ipynb of each LESSON (default: all shipped), where they changed.

    The notebooks are made from the steps in lesson.toml, notebook.py and the exercise. There is one
    film and one notebook for each language of the texts: lesson.de.gif is German.

    A picture is up to date if it was made from the same scene and settings with the same versions
    of chutelab, numpy, pymunk, matplotlib and pillow; a comment in the GIF records them. The same
    inputs make the same bytes.

    --out DIR  Write each picture into a folder NN-name in here, not into the lesson's own: for an
        installed chutelab, whose folders cannot be written to.
    --force  Make them even if nothing has changed.
    """
    from chutelab.classroom.lessons import find
    from chutelab.classroom.lessons.building import build as build_lesson
    from chutelab.classroom.lessons.building import build_notebook, check_inside
    from chutelab.util.words import LANGUAGES

    for one in _lessons(lessons):
        with (
            writing(instead="another folder: --out DIR"),
            progress(one.name, quiet=quiet) as update,
        ):
            target = out / one.folder.name if out else None
            if target is not None:
                check_inside(target)
            told = [find(one.folder, language) for language in LANGUAGES]
            films = [
                build_lesson(lesson, target, force=force, progress=update)
                for lesson in told
                if lesson.language == "en" or not lesson.untranslated
            ]
            books = [build_notebook(lesson, target) for lesson in told]
        for built in (*films, *books):
            if built is not None and not quiet:
                done = "written" if built.made else "up to date"
                console.say(f"{built.path}: {done}, {built.size / 1000:.0f} kB")


@command("Start a lesson of your own.", lesson)
def new(name: Path, *, from_: LessonName | None) -> None:
    """Start a lesson of your own: a folder NAME with lesson.toml, a scene and a notebook.

    It can be shown and built at once; change it from there. With --from it is a copy of a shipped
    lesson, to adapt one, or to work through it. Nothing is ever overwritten.

    chutelab lesson new my-lesson
    chutelab lesson new our-bounce --from 3

    --from LESSON  Begin with a copy of this lesson: worksheet, exercise, scenes and all.
    """
    from chutelab.classroom.lessons import find
    from chutelab.classroom.lessons.building import start

    copied = None if from_ is None else find(from_)
    with writing(instead="another place"):
        made = start(name, copied)
    # With a folder in front it means the folder, even if a shipped lesson has this name.
    said = made if len(made.parts) > 1 else f"./{made}"
    console.say(f"wrote {made}; edit it, and make its picture with: chutelab lesson build {said}")


@command("Bundle the lessons as web pages that need no server.", lesson)
def page(
    lessons: LessonNames = (),
    *,
    out: Annotated[Path, FolderName()],
    language: str = "en",
    wheel: bool = True,
    quiet: bool,
) -> None:
    """Bundle lessons (without LESSON: all that are shipped) into a folder of web pages.

    The folder has index.html and, for each lesson, its worksheet, animation, files, and a live page
    that offers what [page.live] of lesson.toml says. All links are relative: the folder works from
    a memory stick, from any static web server, and on a phone. A live page contains the lesson's
    exercise, with numbers for each student, and saves the file to hand in. For the notebooks, the
    folder has the wheel of this chutelab, and index.html says how to install it.

    With one LESSON and a FOLDER that ends in .html, only that lesson's live page is written, into a
    file of that name.

    -o, --out DIR  The folder, or FILE.html; files that are there are replaced. [required]
    --wheel / --no-wheel  With or without the wheel that students install for the notebooks.
    """
    from chutelab.classroom.lessons.pages import bundle, live_page

    if out.suffix == ".html":
        chosen = _lessons(lessons, language)
        if len(chosen) != 1:
            raise click.UsageError("a single page is of one lesson: name it, or a folder")
        with writing(instead="another file"):
            size = live_page(chosen[0], out)
        if not quiet:
            console.say(f"wrote {out}, {size / 1e3:.0f} kB")
        return
    with writing(instead="another folder"), progress("making the pages", quiet=quiet) as update:
        made = bundle(_lessons(lessons, language), out, update, wheel=wheel)
    if not quiet:
        size = sum(path.stat().st_size for path in made)
        console.say(f"wrote {len(made)} files, {size / 1e6:.1f} MB; open {out / 'index.html'}")


@command("Package lessons for a learning platform (SCORM 1.2).", lesson)
def scorm(
    lessons: LessonNames = (), *, all_: bool, out: Path = Path(), language: str = "en", quiet: bool
) -> None:
    """Make a SCORM 1.2 package of each LESSON: its live page with its exercise, for a course.

    The platform gives the page each student's name, from which the numbers are drawn. It keeps the
    score (0 to 100, the share of right answers), whether the lesson is completed (each question is
    right, or its working was shown), each answer, the time, and where to continue next time. The
    page loads nothing from the network; students install nothing.

    Moodle  "Add an activity", "SCORM package", and the zip into "Package file".
            Appearance: "New window" gives it room. Grade: "Highest grade", maximum 100.
            Attempts: "Force new attempt" stays "No", so that students go on where they
            were. Results: "Reports" of the activity.
    ILIAS   "Add New Item", "Learning Module SCORM", and the zip. Settings: online.
            Results: "Learning Progress" and "Tracking Data" of the module.
    others  Import it as SCORM 1.2.

    If no platform is found, as when index.html is opened from a folder, a line on the page says so;
    students then hand in the result file for `chutelab lesson grade`. A score from a browser can be
    forged, as on every platform: use it to see where a class stands, not as an exam.

    chutelab lesson scorm 3
    chutelab lesson scorm 1 2 3 --language de -o packages/
    chutelab lesson scorm --all -o packages/

    --all  All lessons that are shipped.
    -o, --out DIR|FILE.zip  The folder for the packages, NN-name.scorm.zip each, by default this
        one; or, for one lesson, the zip file itself. Files that are there are replaced.
    """
    from chutelab.classroom.lessons.pages import package

    if all_ == bool(lessons):
        raise RefusedError("give lessons, such as: chutelab lesson scorm 3; or --all")
    chosen = _lessons(lessons, language)
    is_file = out.suffix.lower() == ".zip"
    if is_file and len(chosen) > 1:
        raise RefusedError(f"--out {out}: {len(chosen)} lessons go into a folder, not one zip")
    with writing(instead="another place"), progress("packaging", quiet=quiet) as update:
        if not is_file:
            out.mkdir(parents=True, exist_ok=True)
        for i, one in enumerate(chosen, 1):
            target = out if is_file else out / f"{one.folder.name}.scorm.zip"
            made = package(one, target)
            if update is not None:
                update(i / len(chosen))
            if not quiet:
                console.say(f"wrote {made}, {made.stat().st_size / 1000:.0f} kB")


def _lessons(wanted: tuple[str, ...], language: str = "en") -> list[Lesson]:
    """Return the lessons that are named, or all that are shipped."""
    from chutelab.classroom.lessons import find, shipped_lessons

    return [find(name, language) for name in wanted] or shipped_lessons(language)


def _plain(lesson: Lesson) -> dict[str, object]:
    from chutelab.classroom.lessons.building import files_of

    return {
        "number": lesson.number,
        "name": lesson.name,
        **lesson.model_dump(mode="json"),
        "folder": str(lesson.folder),
        "files": [path.name for path in files_of(lesson)],
    }


@command("Mark what students returned: notebooks, result files.", lesson)
def grade(
    # A file that cannot be read gets a row of its own.
    files: Annotated[tuple[Path, ...], FileName(exists=True, readable=False, path_type=Path)],
    *,
    out: Annotated[Path | None, FileName(dir_okay=False, path_type=Path)],
    report: Path | None,
    time_limit: Annotated[float, Number(1.0, 3600.0)] = 60.0,
    decimal_comma: bool,
    json_: bool,
    quiet: bool,
) -> None:
    """Mark each question of the exercises that students returned.

    They return notebooks (*.ipynb), or the result files that a lesson's live page writes (*.json);
    a folder stands for all files in it and in its subfolders. Each answer is judged again, with the
    numbers that belong to the student's name; verdicts in a notebook or a file do not count.

    THIS RUNS THE CODE IN NOTEBOOKS, with all your rights on this computer. Each notebook has its
    own folder and processes, which end with it, and limits of time, memory and processes. These
    protect against accidents only: grade the notebooks of strangers in a container. Result files
    contain no code.

    Marks say which numbers were handed in, not how they were found. Students can find the right
    ones by trying until the replies say so, with chutelab's theory, or in the exercises' source.
    Questions whose working was shown are in the column "revealed", and have a * in the table; a
    forged result file can hide this.

    A wrong answer that is right for another student's numbers is reported, with the probability of
    this without copying.

    Ctrl-C, or a crash, keeps the marks so far, in FILE.part.

    chutelab lesson grade returned/ --out class.csv --report class.html
    chutelab lesson grade anna.ipynb the-bounce-Ben.chutelab.json --time-limit 30

    --out FILE  Write the marks into this CSV file, a row for each file returned. Until the last is
        marked, the rows are in FILE.part.
    --report FILE  Write a report on the class into this file. A file that ends in .html is a web
        page: students and questions, mistakes by name, tries and hints, what students wrote, and
        files that did not count. Any other is Markdown: how many answers were right, how often each
        mistake was made, and what students wrote.
    --decimal-comma  Write the CSV for versions of Excel with a decimal comma: numbers have one, and
        semicolons separate cells.
    --time-limit S  Seconds that a notebook may run. [default]
    -q, --quiet  Print no table, and show no progress bar.
    """
    from chutelab.classroom.grading import grade as grade_returned
    from chutelab.classroom.grading import page as class_page
    from chutelab.classroom.grading import report as class_report
    from chutelab.classroom.grading import write_csv
    from chutelab.util.tables import Sheet

    returned: list[Path] = []
    left_out: list[str] = []
    for file in files:
        found = [file]
        if file.is_dir():
            # Jupyter keeps copies of its own in hidden folders.
            inside = sorted(
                one for one in file.rglob("*.*")
                if not one.is_dir() and "/." not in f"/{one.relative_to(file).as_posix()}"
            )  # fmt: skip
            found = [one for one in inside if one.suffix in (".ipynb", ".json")]
            left_out += [one.name for one in inside if one not in found]
        if not found:
            said = "there is no notebook (*.ipynb) and no result file (*.json) in this folder"
            raise RefusedError(f"{file}: {said}")
        returned += found
    for option, target in (("--out", out), ("--report", report)):
        if target is None:
            continue
        check_file(option, target)
        if target.exists() and any(one.exists() and one.samefile(target) for one in returned):
            said = "is one of the files that were returned; give another name"
            raise RefusedError(f"{option} {target}: {said}")
    if out is not None:
        part = out.with_name(f"{out.name}.part")
        with writing(f"--out {out}", instead="another name"):
            interrupted = part.exists()
        if interrupted:
            raise RefusedError(
                f"{part}: has the marks of a grading that was interrupted, or still runs; move or"
                " remove it first"
            )
    done: list[Grade] = []

    def marks(one: Grade) -> str:
        given = enumerate(one.marks, 1)
        shown = " ".join(f"{mark}*" if n in one.revealed else str(mark) for n, mark in given)
        return f"{one.total} of {one.out_of} ({shown})" if one.marks else "-"

    def marked(update: Callable[[float], None] | None) -> Iterator[Grade]:
        for row in grade_returned(returned, time_limit=time_limit):
            done.append(row)
            yield row
            if update is not None:
                update(len(done) / len(returned))
        if not any(one.marks for one in done):
            raise RefusedError(
                "nothing to mark: none of these is a notebook or a result file of a lesson's"
                " exercise"
            )

    try:
        with progress("marking", quiet=quiet) as update, writing(f"--out {out}"):
            if out is None:
                deque(marked(update), maxlen=0)
            else:
                write_csv(marked(update), out, decimal_comma=decimal_comma)
    finally:
        if done and json_:
            console.show_json({"format": 1, "grades": done})
        elif done and not quiet:
            rows = [(one.file, one.student, one.lesson, marks(one), one.reason) for one in done]
            console.show(Sheet("", HEADS, tuple(rows), texts=5))
        if done and left_out and not quiet:
            names = ", ".join(sorted(left_out)[:MOST_NAMED]) + ", ..." * (
                len(left_out) > MOST_NAMED
            )
            said = f"neither notebook (*.ipynb) nor result file (*.json): {names}"
            console.say(printable(said), err=True)
        if out is not None and part.exists():
            count = f"{len(done)} of {len(returned)} files"
            console.say(f"the marks of {count} are in {part}", err=True)
    if report is not None:
        with writing(f"--report {report}"):
            told = class_page(done) if report.suffix == ".html" else class_report(done)
            write_lines(report, [told], errors="replace")
    for target in filter(None, (out, report)):
        if not json_:
            console.say(f"wrote {target}")
