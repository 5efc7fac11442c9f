"""What is made of a lesson: its film and its notebook, and new lessons.

``lesson.gif`` is made anew only if what it is made from has changed; the stamp that tells is kept
in a comment of the GIF itself. A new lesson comes from the template or is a copy of another: it
validates and builds at once.

``exercise.ipynb`` has the parts of the worksheet; a translated worksheet makes one in its language.
A block of commands becomes a cell that runs the same (`classroom.book`); paragraphs that begin with
``*In a terminal`` are left out. ``notebook.py``, in the percent format, has what only the notebook
has: a cell ``# %% Run`` follows what stands under "Run", a cell ``# %% Run 2`` takes the place of
its second block, and ``# %% [markdown] Run`` is text; a line ``# needs: notebook,fit`` names the
extras of the package that it takes. The same files make the same bytes.
"""

from __future__ import annotations

import hashlib
import json
import re
import shutil
import textwrap
from collections.abc import Callable
from dataclasses import dataclass
from errno import ELOOP
from functools import partial
from io import BytesIO
from math import prod
from pathlib import Path
from typing import Any, Final

from PIL.GifImagePlugin import GifImageFile

from chutelab.classroom.exercises import EXERCISES
from chutelab.classroom.exercises.catalogue import UNNAMED
from chutelab.classroom.lessons.reading import (
    OWN_WORDS,
    PARTS,
    Lesson,
    LessonError,
    read,
    scene_of,
    shipped_lessons,
    split,
    unusable,
)
from chutelab.classroom.words import words
from chutelab.engines.simulation import judged
from chutelab.scene import Fault, to_dict
from chutelab.util.files import aside, refuse_other, whole
from chutelab.util.versions import version_of

_HERE: Final = Path(__file__).parent
PICTURE: Final = "lesson.gif"
MACHINE: Final = "machine.png"
SPLIT: Final = "split.png"
"""The film, the machine before anything has happened, and the velocity at the plate."""

MOST_PIXELS: Final = 3840 * 2160
"""Most pixels of a picture, as in `reading.Picture`."""

NO_SETTINGS: Final = {"scene", "set", "machine", "film"}
"""Keys of `reading.Picture` that are no settings of the film: which scene, and its words."""

LIBRARIES: Final = ("chutelab", "numpy", "pymunk", "matplotlib", "pillow")
"""Packages whose versions determine the bytes of a picture, besides its inputs."""


@dataclass(frozen=True)
class Built:
    """A lesson's film, or its notebook, after `build`: where, its size, and whether it was made."""

    path: Path
    size: int
    made: bool


def build(
    lesson: Lesson,
    folder: Path | None = None,
    *,
    force: bool = False,
    progress: Callable[[float], None] | None = None,
) -> Built:
    """Make film and machine picture of a lesson, unless they are up to date.

    The same lesson and versions give the same bytes.

    Parameters
    ----------
    folder
        Where to write it (made if need be); default: the lesson's own folder.
    force
        Make them even if they are.
    progress
        Called with the share of the simulation that is done, 0 to 1.

    Raises
    ------
    SceneError
        If the scene cannot be run.
    OSError
        If the file cannot be written.
    """
    path = (lesson.folder if folder is None else folder) / PICTURE
    lesson = _in_english(lesson)
    wanted = stamp_of(lesson)
    machine = path.with_name(MACHINE)
    made = force or comment_of(path) != wanted or not machine.is_file()
    if made:
        from chutelab.pictures.animation import animate, still
        from chutelab.pictures.plots.figure import split_velocity

        with aside(path.parent, path):
            refuse_other(path)
        scene = scene_of(lesson, lesson.picture.scene, lesson.picture.set)
        # Lesson 8 shows a run that breaks a law.
        recording = judged(scene, progress=progress)
        settings = lesson.picture.model_dump(exclude={*NO_SETTINGS, "split"})
        path.parent.mkdir(parents=True, exist_ok=True)
        animate(recording, path, question=lesson.question, predict=True, comment=wanted, **settings)
        still(recording, machine, width=lesson.picture.width, height=lesson.picture.height)
        if lesson.picture.split:
            split_velocity(recording, path.with_name(SPLIT))
    return Built(path, path.stat().st_size, made)


def build_notebook(lesson: Lesson, folder: Path | None = None) -> Built | None:
    """Make the notebook of a lesson, unless it is there already; None if there is none to make.

    That is so if its worksheet has not all the parts of a notebook, see `cells`.

    Raises
    ------
    LessonError
        If a cell of the lesson's own belongs to no part.
    OSError
        If the file cannot be written.
    """
    text = notebook_of(lesson)
    if not text:
        return None
    path = (lesson.folder if folder is None else folder) / name_of(lesson.language)
    made = not path.is_file() or path.read_text(encoding="utf-8") != text
    if made:
        path.parent.mkdir(parents=True, exist_ok=True)
        with whole(path) as unfinished:
            unfinished.write_text(text, encoding="utf-8", newline="\n")
    return Built(path, path.stat().st_size, made)


def _in_english(lesson: Lesson) -> Lesson:
    """Return a lesson in English, the language of its film."""
    return lesson if lesson.language == "en" else read(lesson.folder)


def is_current(lesson: Lesson) -> bool:
    """Tell whether a lesson's picture was made from its present inputs, with any versions."""
    found, wanted = comment_of(lesson.folder / PICTURE), stamp_of(lesson)
    return found.split("; ")[:2] == wanted.split("; ")[:2]


def stamp_of(lesson: Lesson) -> str:
    """Return what determines every byte of a lesson's picture, in one line.

    That is a hash of the scene that is filmed and of the picture's settings, then the versions of
    all that simulates and draws.
    """
    lesson = _in_english(lesson)
    scene = to_dict(scene_of(lesson, lesson.picture.scene, lesson.picture.set))
    for table in ("expect", "live"):  # neither shows in its picture
        scene.pop(table, None)
    # Without defaults, which the version determines.
    settings = lesson.picture.model_dump(exclude_unset=True, exclude=NO_SETTINGS)
    inputs = {"scene": scene, "picture": settings, "question": lesson.question, "predict": True}
    text = json.dumps(inputs, sort_keys=True, ensure_ascii=True)
    digest = hashlib.sha256(text.encode("ascii")).hexdigest()[:32]
    versions = ", ".join(f"{name} {version_of(name) or 'unknown'}" for name in LIBRARIES)
    return f"chutelab lesson; inputs {digest}; {versions}"


def comment_of(picture: Path) -> str:
    """Return the comment of a GIF file; "" if there is none, or no whole GIF of a sane size."""
    gif = picture.read_bytes() if picture.is_file() else b""
    try:
        with GifImageFile(BytesIO(gif)) as opened:
            size, comment = opened.size, opened.info.get("comment", b"")
    except SyntaxError:
        return ""
    if prod(size) > MOST_PIXELS:
        return ""
    # A whole GIF ends with a semicolon.
    return str(comment.decode("ascii", "replace")) if gif.endswith(b";") else ""


_NAME: Final = re.compile(r"[a-z0-9]+(-[a-z0-9]+)*")
_MOST: Final = 60


def start(path: str | Path, model: Lesson | None = None) -> Path:
    """Make the folder of a new lesson, whole or not at all.

    Parameters
    ----------
    path
        The folder; its name is the lesson's: lower-case letters, digits and hyphens.
    model
        A lesson to copy with all its files; by default there is a template.

    Raises
    ------
    LessonError
        If the name will not do, or something is there already: nothing is overwritten.
    OSError
        If it cannot be written.
    """
    path = Path(path)
    if not _NAME.fullmatch(path.name) or len(path.name) > _MOST:
        text = (
            f"must be 1 to {_MOST} lower-case letters, digits and hyphens, such as my-lesson"
            " or 09-my-lesson"
        )
        raise LessonError(str(path), [Fault("name", path.name, text)])
    if path.exists() or path.is_symlink():
        raise unusable(path, "is there already; choose another name")
    with aside(path.parent, path) as made:
        unfinished = made / path.name
        unfinished.mkdir()
        if model is None:
            title = split(path)[1].replace("-", " ").capitalize()
            for file in (_HERE / "template").iterdir():
                said = json.dumps(title) if file.suffix == ".toml" else title
                text = file.read_text(encoding="utf-8").replace("TITLE", said)
                (unfinished / file.name).write_text(text, encoding="utf-8")
        else:
            for file in files_of(model):
                shutil.copyfile(file, unfinished / file.name)
        made_lesson = read(unfinished)
        if model is None:
            build_notebook(made_lesson)
        path.parent.mkdir(parents=True, exist_ok=True)
        unfinished.rename(path)
    return path


def files_of(lesson: Lesson) -> list[Path]:
    """Return the files of a lesson in alphabetical order, hidden ones left out."""
    found = lesson.folder.iterdir()
    return sorted(path for path in found if path.is_file() and not path.name.startswith("."))


def check_inside(folder: Path) -> None:
    """Refuse to write into a folder that is a link: an `OSError`."""
    if folder.is_symlink():
        raise OSError(ELOOP, "it is a symbolic link, which may lead anywhere", str(folder))


OWN: Final = "notebook.py"


def name_of(language: str) -> str:
    """Return the name of a notebook's file."""
    return "exercise.ipynb" if language == "en" else f"exercise.{language}.ipynb"


def notebook_of(lesson: Lesson) -> str:
    """Return the text of a lesson's notebook, JSON; "" if its worksheet has not all of `PARTS`.

    The worksheet is that in the lesson's language; so is the notebook.

    Raises
    ------
    LessonError
        If a cell of ``notebook.py`` belongs to no part.
    """
    say = words(lesson.language).say
    heading, *pieces = re.split(r"^## (.*)\n+", lesson.text("README"), flags=re.MULTILINE)
    parts = dict(zip(pieces[::2], pieces[1::2], strict=True))
    heads = [say(key) for key in PARTS]
    if not parts.keys() >= {*heads}:
        return ""
    predict, run, compare = (parts[head] for head in heads)
    own = _own(lesson)
    left = dict.fromkeys(own)
    cells: list[dict[str, Any]] = []

    def add(kind: str, name: str, source: str, place: str = "") -> None:
        cell: dict[str, Any] = {"cell_type": kind, "id": name, "metadata": {}}
        if kind == "code":
            cell |= {"execution_count": None, "outputs": []}
        cells.append(cell | {"source": source.splitlines(keepends=True)})
        left.pop(place, None)

    text, code = partial(add, "markdown"), partial(add, "code")

    def add_own(place: str) -> None:
        for n, (kind, source) in enumerate(own.get(place, ()), start=1):
            add(kind, f"{place}-own-{n}".lower().replace(" ", "-"), source, place)

    def prose(part: str) -> str:
        """Return paragraphs on a line each, without those that are for a terminal.

        Lists and tables keep their line breaks.
        """
        terminal = f"*{say('notebook-terminal')}"
        paragraphs = re.split(r"\n{2,}", part.strip())
        kept = [textwrap.dedent(one) for one in paragraphs if not one.startswith(terminal)]
        broken = r"\n(?!\s*(?:[-*] |\||\d+\. )|#)\s*"
        return "\n\n".join(re.sub(broken, " ", one) for one in kept)

    exercise = EXERCISES.get(lesson.name)
    title, _, opening = heading.partition("\n")
    # The notebook draws the machine itself: a student may have no other file.
    opening = prose(re.sub(r"^!\[.*\n+", "", opening, flags=re.MULTILINE))
    order = say("notebook-order-exercise" if exercise is not None else "notebook-order")
    needs = re.search(r"^# needs: *(.*)$", _source(lesson), re.MULTILINE)
    extras = say("notebook-needs", extras=needs[1] if needs else "notebook")
    text("title", f"{title}\n\n{opening}\n\n{order}\n\n{extras}")
    shipped = any(one.folder == lesson.folder for one in shipped_lessons())
    book = f"book = Book({json.dumps(lesson.name if shipped else '.')})\nbook.machine()"
    code("machine", f"from chutelab.classroom.book import Book\n\n{book}")
    if exercise is not None:
        text("name-text", f"## {say('notebook-name-head')}\n\n{say('notebook-name')}")
        language = "" if lesson.language == "en" else f', language="{lesson.language}"'
        task = f'task = lesson("{exercise.name}", student=student{language})\ntask'
        given = f'from chutelab.classroom.exercises import lesson\n\nstudent = "{UNNAMED}"\n'
        code("name", given + task)
    text("predict-text", f"## {heads[0]}\n\n{prose(predict)}\n\n{say('notebook-predict')}")
    asked = re.findall(r"^(\d+)\. ", predict, flags=re.MULTILINE)
    lines = "".join(f"    {number}: None,\n" for number in asked)
    code("predict", f"predictions = {{\n{lines}}}")
    add_own("Predict")

    # The texts under "Run", and a cell for each block of commands.
    before, *pieces = re.split(r"^```sh\n(.*?)^```$", run, flags=re.MULTILINE | re.DOTALL)
    head = f"## {heads[1]}\n\n"
    for n, (block, after) in enumerate(zip(pieces[::2], pieces[1::2], strict=True), start=1):
        name, place = "run" if n == 1 else f"run-{n}", f"Run {n}"
        if said := f"{head}{prose(before)}".strip():
            text(f"{name}-text", said)
        for i, (kind, source) in enumerate(own.get(place) or [("code", _commands(block))]):
            add(kind, name if i == 0 else f"run-{n}-own-{i}", source, place)
        if place not in own and " --out " in block:
            code(f"{name}-picture", "import chutelab\n\nchutelab.overlay(runs[0])")
        head, before = "", after
    if rest := prose(before):
        text("run-end", rest)
    add_own("Run")

    compared = prose(compare)
    fill = f"\n\n{say('notebook-fill')}" if "|---" in compared else ""
    text("compare-text", f"## {heads[2]}\n\n{compared}{fill}")
    code("compare", "book.compare(predictions)")
    add_own("Compare")
    text("explain-text", f"## {say('notebook-explain-head')}\n\n{say('notebook-explain')}")
    text(OWN_WORDS, say("notebook-words"))
    if exercise is not None:
        questions = say("notebook-questions", first=exercise.parameters[0].name)
        text("questions-text", f"## {say('notebook-questions-head')}\n\n{questions}")
        add_own("Questions")
        for n in range(1, len(exercise.questions) + 1):
            code(f"question-{n}", f"task.question({n})")
            code(f"answer-{n}", f"answer_{n} = None\ntask.check({n}, answer_{n})")
    if lesson.page is not None:
        (_, said), *_ = own.get("Try it live", [("markdown", "")])
        text("live-text", f"## {say('notebook-live')}\n\n{said}".strip(), "Try it live")
        code("live", "book.live()")
    if exercise is not None:
        text("progress-text", f"## {say('notebook-progress')}")
        code("progress", "task.progress()")
    if left:
        raise unusable(lesson.folder / OWN, f"there is no place for a cell # %% {next(iter(left))}")
    kernel = {"display_name": "Python 3", "language": "python", "name": "python3"}
    about = {"kernelspec": kernel, "language_info": {"name": "python"}}
    made = {"cells": cells, "metadata": about, "nbformat": 4, "nbformat_minor": 5}
    return json.dumps(made, indent=1, ensure_ascii=False, sort_keys=True) + "\n"


def _source(lesson: Lesson, name: str = OWN) -> str:
    path = lesson.folder / name
    return path.read_text(encoding="utf-8") if path.is_file() else ""


def _own(lesson: Lesson) -> dict[str, list[tuple[str, str]]]:
    """Return the kinds and sources of the cells in ``notebook.py`` by their places.

    In another language the texts, in their order, are those of ``notebook.LANGUAGE.py``.
    """
    found = _cells_in(_source(lesson))
    told = _cells_in(_source(lesson, f"notebook.{lesson.language}.py"))
    for place, cells in told.items():
        texts = iter(cells)
        found[place] = [
            next(texts, cell) if cell[0] == "markdown" else cell for cell in found.get(place, ())
        ]
    return found


def _cells_in(source: str) -> dict[str, list[tuple[str, str]]]:
    found: dict[str, list[tuple[str, str]]] = {}
    pieces = re.split(r"^# %% *(\[markdown\])? *(.*)\n", source, flags=re.MULTILINE)
    for markdown, place, source in zip(pieces[1::3], pieces[2::3], pieces[3::3], strict=True):
        kind = "markdown" if markdown else "code"
        if markdown:
            source = re.sub(r"^# ?", "", source, flags=re.MULTILINE)
        found.setdefault(place.strip(), []).append((kind, source.strip("\n")))
    return found


def _commands(block: str) -> str:
    """Return the cell that runs the scenes of ``chutelab run`` in a block; other commands are left.

    What is left needs a cell in `OWN`.
    """
    found = re.findall(r"^chutelab run (.*?)$", block, flags=re.MULTILINE)
    runs = [re.sub(r" --(out|only) \S+", "", line) for line in found]
    lines = "".join(f"    {json.dumps(run, ensure_ascii=False)},\n" for run in runs)
    return f"runs = book.run(\n{lines})\nruns"
