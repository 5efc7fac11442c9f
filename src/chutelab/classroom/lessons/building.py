"""Build a lesson's film and notebook; start new lessons.

``lesson.gif``, in another language ``lesson.LANGUAGE.gif``, is made anew only if what it is made
from has changed; a stamp of its inputs is kept in a comment of the GIF. A new lesson comes from the
template or is a copy of another: it validates and builds at once.

``exercise.ipynb`` has the steps, ``exercise.LANGUAGE.ipynb`` has them in another language; the runs
of tables are made by `classroom.book`. ``notebook.py``, in the percent format, has what only the
notebook has: ``# %% 3`` is a cell at the end of step 3, ``# %% [markdown:de] 3`` a text in German;
a line ``# needs: notebook,fit`` names the extras of the package that it takes. The same files make
the same bytes.
"""

from __future__ import annotations

import hashlib
import json
import re
import shutil
from collections.abc import Callable
from dataclasses import dataclass
from errno import ELOOP
from functools import partial
from io import BytesIO
from math import prod
from pathlib import Path
from typing import Any, Final

from PIL import Image
from PIL.GifImagePlugin import GifImageFile

from chutelab.classroom.exercises import EXERCISES, UNNAMED
from chutelab.classroom.lessons import (
    OWN_WORDS,
    Lesson,
    LessonError,
    called_in,
    machine_of,
    read,
    scene_of,
    shipped_folders,
    split,
    unusable,
)
from chutelab.classroom.lessons.sheets import asked, table, titled
from chutelab.engines.simulation import judged
from chutelab.scene import Fault, Scene, to_dict
from chutelab.util.files import aside, refuse_other, version_of, whole
from chutelab.util.words import words

_HERE: Final = Path(__file__).parent
PICTURE: Final = "lesson.gif"
MACHINE: Final = "machine.png"
SPLIT: Final = "split.png"
"""The film, the machine before anything has happened, and the velocity at the plate."""

MOST_PIXELS: Final = 3840 * 2160
"""Most pixels of a picture, as in `lessons.Picture`."""

NO_SETTINGS: Final = {"scene", "set", "machine", "film"}
"""Keys of `lessons.Picture` that are not settings of the film: the scene and the texts."""

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
    """Make film and machine picture of a lesson, in its language, unless they are up to date.

    The same lesson and versions give the same bytes. They go into `folder`, made if need be, by
    default the lesson's own; with `force` they are made in any case. `progress` is called with the
    share of the simulation that is done, 0 to 1.

    Raises a `SceneError` if the scene cannot be run; an `OSError` if the file cannot be written.
    """
    path = (lesson.folder if folder is None else folder) / called_in(PICTURE, lesson.language)
    wanted = stamp_of(lesson)
    machine = path.with_name(called_in(MACHINE, lesson.language))
    made = force or comment_of(path) != wanted or not machine.is_file()
    if made:
        from chutelab.pictures.animation import animate, still
        from chutelab.pictures.plots import look
        from chutelab.pictures.plots.measures import split_velocity

        with aside(path.parent, path):
            refuse_other(path)
        scene = scene_of(lesson, lesson.picture.scene, lesson.picture.set)
        # Lesson 8 shows a run that breaks a law.
        recording = judged(scene, progress=progress)
        settings = lesson.picture.model_dump(exclude={*NO_SETTINGS, "split"})
        path.parent.mkdir(parents=True, exist_ok=True)
        with look(language=lesson.language):
            animate(
                recording, path, question=lesson.question, predict=True, comment=wanted, **settings
            )
            other = _marked(lesson)
            begun = recording if other is None else judged(other)
            still(begun, machine, width=lesson.picture.width, height=lesson.picture.height)
        if lesson.picture.split:
            split = path.with_name(SPLIT)
            split_velocity(recording, split)
            with Image.open(split) as drawn:
                # The lesson's page contains it and should be small.
                few = drawn.convert("RGB").quantize(32, dither=Image.Dither.NONE)
            few.save(split, optimize=True)
    return Built(path, path.stat().st_size, made)


def build_notebook(lesson: Lesson, folder: Path | None = None) -> Built:
    """Make the notebook of a lesson, unless it is there already.

    Raises a `LessonError` if a cell of the lesson's own belongs to no step; an `OSError` if the
    file cannot be written.
    """
    text = notebook_of(lesson)
    path = (lesson.folder if folder is None else folder) / name_of(lesson.language)
    made = not path.is_file() or path.read_text(encoding="utf-8") != text
    if made:
        path.parent.mkdir(parents=True, exist_ok=True)
        with whole(path) as unfinished:
            unfinished.write_text(text, encoding="utf-8", newline="\n")
    return Built(path, path.stat().st_size, made)


def is_current(lesson: Lesson) -> bool:
    """Tell whether a lesson's picture was made from its present inputs, with any versions."""
    path = lesson.folder / called_in(PICTURE, lesson.language)
    found, wanted = comment_of(path), stamp_of(lesson)
    return found.split("; ")[:2] == wanted.split("; ")[:2]


def stamp_of(lesson: Lesson) -> str:
    """Return what determines every byte of a lesson's picture, in one line.

    That is a hash of the scene that is filmed and of the picture's settings, then the versions of
    all that simulates and draws.
    """
    other = _marked(lesson)
    scene = to_dict(scene_of(lesson, lesson.picture.scene, lesson.picture.set))
    machine = {} if other is None else {"machine": to_dict(other)}
    for hidden in ("expect", "live"):  # neither shows in its picture
        for one in (scene, *machine.values()):
            one.pop(hidden, None)
    # Without defaults, which the version determines.
    settings = lesson.picture.model_dump(exclude_unset=True, exclude=NO_SETTINGS)
    inputs = {
        "scene": scene, "picture": settings, "question": lesson.question, "predict": True,
        "language": lesson.language, **machine,
    }  # fmt: skip
    text = json.dumps(inputs, sort_keys=True, ensure_ascii=True)
    digest = hashlib.sha256(text.encode("ascii")).hexdigest()[:32]
    versions = ", ".join(f"{name} {version_of(name) or 'unknown'}" for name in LIBRARIES)
    return f"chutelab lesson; inputs {digest}; {versions}"


def _marked(lesson: Lesson) -> Scene | None:
    """Return the machine in whose picture a flag is set first, if it is not that of the film."""
    step = next((one for one in lesson.steps if any(ask.mark for ask in one.asks)), None)
    return machine_of(lesson, step) if step is not None and step.set else None


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

    The folder's name is the lesson's: lower-case letters, digits and hyphens. `model` is a lesson
    to copy with all its files; by default there is a template.

    Raises a `LessonError` if the name will not do, or something is there already: nothing is
    overwritten; an `OSError` if it cannot be written.
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
    return called_in("exercise.ipynb", language)


def notebook_of(lesson: Lesson) -> str:
    """Return the text of a lesson's notebook, JSON: its steps, in the lesson's language.

    Raises a `LessonError` if a cell of ``notebook.py`` belongs to no step.
    """
    said = words(lesson.language)
    say, own, exercise = said.say, _own(lesson), EXERCISES.get(lesson.name)
    cells: list[dict[str, Any]] = []

    def add(kind: str, name: str, *parts: str) -> None:
        source = "\n\n".join(part.strip() for part in parts if part.strip())
        cell: dict[str, Any] = {"cell_type": kind, "id": name, "metadata": {}}
        if kind == "code":
            cell |= {"execution_count": None, "outputs": []}
        cells.append(cell | {"source": source.splitlines(keepends=True)})

    text, code = partial(add, "markdown"), partial(add, "code")
    needs = re.search(r"^# needs: *(.*)$", _source(lesson), re.MULTILINE)
    extras = say("notebook-needs", extras=needs[1] if needs else "notebook")
    text("title", f"# {titled(lesson)}", f"**{lesson.question}**", say("notebook-order"), extras)
    shipped = lesson.folder in [folder.resolve() for folder in shipped_folders()]
    name = f'"{lesson.name}"' if shipped else '"."'
    language = "" if lesson.language == "en" else f', language="{lesson.language}"'
    opened = f"from chutelab.classroom.book import Book\n\nbook = Book({name}{language})"
    code("machine", "import math\n", f"{opened}\nbook.machine()")
    if exercise is not None:
        text("name-text", f"## {say('notebook-name-head')}", say("notebook-name"))
        task = f'task = lesson("{exercise.name}", student=student{language})\ntask'
        given = f'from chutelab.classroom.exercises import lesson\n\nstudent = "{UNNAMED}"\n'
        code("name", given + task)
    for n, step in enumerate(lesson.steps, 1):
        head, place = f"## {n}. {say(f'step-{step.kind}')}", f"step-{n}"
        if step.kind == "numbers" and exercise is not None:
            questions = say("notebook-questions", first=exercise.parameters[0].name)
            text(f"{place}-text", head, step.text, questions)
        else:
            text(f"{place}-text", head, *asked(lesson, step))
        match step.kind:
            case "predict":
                lines = "".join(f"    {m}: None,\n" for m in range(1, len(step.asks) + 1))
                text(f"{place}-how", say("notebook-predict"))
                code(place, f"predictions = {{\n{lines}}}\nbook.predict({n}, predictions)")
            case "try" if lesson.page is not None:
                code(place, f"book.live({n})")
            case "note":
                if any(one.value for one in step.columns) and step.rows:
                    code(place, f"book.note({n})")
                if not all(one.value or one.given for one in step.columns):
                    text(f"{place}-table", say("notebook-fill"), table(step, said))
            case "explain":
                # The cell that is graded has its own id: the last one.
                last = not any(one.kind == "explain" for one in lesson.steps[n:])
                if step.asks:
                    text(OWN_WORDS if last else f"{place}-words", say("notebook-words"))
                code(place, f"book.explain({n})")
        for m, (kind, source) in enumerate(own.pop(str(n), ()), 1):
            add(kind, f"{place}-own-{m}", source)
        if step.kind == "numbers" and exercise is not None:
            for m in range(1, len(exercise.questions) + 1):
                code(f"question-{m}", f"task.question({m})")
                code(f"answer-{m}", f"answer_{m} = None\ntask.check({m}, answer_{m})")
            text("progress-text", f"## {say('notebook-progress')}")
            code("progress", "task.progress()")
    if own:
        raise unusable(lesson.folder / OWN, f"there is no place for a cell # %% {next(iter(own))}")
    kernel = {"display_name": "Python 3", "language": "python", "name": "python3"}
    about = {"kernelspec": kernel, "language_info": {"name": "python"}}
    made = {"cells": cells, "metadata": about, "nbformat": 4, "nbformat_minor": 5}
    return json.dumps(made, indent=1, ensure_ascii=False, sort_keys=True) + "\n"


def _source(lesson: Lesson) -> str:
    path = lesson.folder / OWN
    return path.read_text(encoding="utf-8") if path.is_file() else ""


def _own(lesson: Lesson) -> dict[str, list[tuple[str, str]]]:
    """Return kinds and sources of the cells in ``notebook.py`` by the numbers of their steps.

    A text that begins with another language, as in ``# %% [markdown:de] 3``, is left out.
    """
    found: dict[str, list[tuple[str, str]]] = {}
    pieces = re.split(
        r"^# %% *(?:\[(markdown)(?::(\w+))?\])? *(.*)\n", _source(lesson), flags=re.MULTILINE
    )
    for kind, language, place, source in zip(*(pieces[n::4] for n in (1, 2, 3, 4)), strict=True):
        if kind:
            source = re.sub(r"^# ?", "", source, flags=re.MULTILINE)
        if language in (None, lesson.language):
            found.setdefault(place.strip(), []).append((kind or "code", source.strip("\n")))
    return found
