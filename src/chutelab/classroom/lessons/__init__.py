"""Lessons: a question, steps, an exercise, a picture, and scenes to run.

Here is ``lesson.toml`` as a frozen model, validated with its scenes, all faults in one message; and
the shipped lessons, found by number, by name or by folder.

- `steps`: the questions of each step, the keys that may be changed, the runs of its table.
- `texts`: a lesson's Markdown as HTML and for a terminal, and its formulas.
- `sheets`: the student's sheet, the teacher's and the explanation, as Markdown, HTML and PDF.
- `building`: ``lesson.gif``, ``exercise.ipynb``, a new lesson from a template.
- `pages`: all lessons as web pages, and packages for learning platforms.

A lesson is a folder ``NN-name`` with ``lesson.toml``, the film ``lesson.gif``, and the notebook
``exercise.ipynb``; scene files of its own lie beside them.
"""

from __future__ import annotations

import os
import re
import tomllib
from collections.abc import Callable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import Annotated, Any, Final, Literal

from pydantic import AfterValidator, Field, PrivateAttr, ValidationError

from chutelab.classroom.lessons.steps import (
    LONGEST,
    MOST,
    TABLES,
    Column,
    Markdown,
    Names,
    Row,
    Said,
    Step,
    faults_of,
    in_language,
    key,
)
from chutelab.scene import MISSING, Fault, Scene, SceneError, load, shipped
from chutelab.scene.overrides import Override, at_path, joined
from chutelab.scene.units import Number, Table, Text, Whole
from chutelab.util.errors import did_you_mean, nearest
from chutelab.util.words import words

__all__ = ["Lesson", "LessonError", "find", "read", "scene_of", "shipped_lessons"]

Words = Annotated[Text, AfterValidator(lambda text: " ".join(text.split()))]
"""A text that may be broken into lines anywhere."""

Answers = Annotated[tuple[Words, ...], Field(max_length=MOST)]


class Chosen(Table):
    """One of a lesson's scenes, with settings laid over it."""

    scene: Said | None = key(
        None, "The scene; default: the first of the lesson", "one of the names in scenes"
    )
    set: Names = key(
        (), "Keys of that scene to change", f'a list of at most {MOST} texts such as "run.dt=0.01"'
    )


class Picture(Chosen):
    """How ``lesson.gif`` is made."""

    slow: Number | None = key(
        None,
        "Seconds on the screen for one of the recording; default: a round one that suits",
        "a number from 0.01 to 1000",
        ge=0.01,
        le=1000.0,
    )
    fps: Literal[10, 20, 25, 50] | None = key(
        None, "Pictures a second; default: 25, of a stream 20", "10, 20, 25 or 50"
    )
    width: Whole = key(1280, "Width, pixels", "a whole number from 320 to 3840", ge=320, le=3840)
    title: Said | None = key(
        None, "What stands above the film; default: the scene's title", "a text"
    )
    machine: Said | None = key(None, "What machine.png shows, in words", "a text")
    film: Said | None = key(None, "What lesson.gif shows, in words", "a text")
    split: bool = key(
        False, "Also make split.png: how the velocity at the plate splits", "true or false"
    )
    height: Whole = key(720, "Height, pixels", "a whole number from 180 to 2160", ge=180, le=2160)


class Page(Chosen):
    """What the live page of the lesson offers; without this table it has none."""

    live: dict[str, Any] = key(
        {},
        "What is laid over [live] of the scene; predict is true unless it says false",
        "a table such as [live] of a scene: predict, controls, panels, ranges, presets",
    )

    @property
    def settings(self) -> list[str | Override]:
        """What is laid over the scene."""
        live = {"predict": True, **self.live}
        return [*self.set, *(Override(f"live.{name}", value) for name, value in live.items())]


class Teacher(Table):
    """What the teacher's sheet has besides the worksheet and the exercise."""

    goals: Names = key(
        (), "What one can do afterwards", f"a list of at most {MOST} texts, each of one sentence"
    )
    say: Words = key("", "What to say and do in class", "a text")
    misconceptions: Annotated[tuple[tuple[Words, Words], ...], Field(max_length=MOST)] = key(
        (),
        "What pupils often believe, and a question that brings it out",
        f"a list of at most {MOST} pairs of texts",
    )
    basic: Words = key("", "What to leave out for a short version", "a text")
    stretch: Words = key("", "What to add for students who are done", "a text")
    curriculum: Answers = key(
        (), "Where it sits in curricula, by name", f"a list of at most {MOST} texts"
    )


class Lesson(Table):
    """A validated lesson; its files lie in `folder`."""

    title: Said = key(..., "What the lesson is called", f"a text of 1 to {LONGEST} characters")
    level: Literal["start", "core", "advanced"] = key(
        ..., "For whom", '"start", "core" or "advanced"'
    )
    minutes: Whole = key(45, "Time it takes in class", "a whole number from 5 to 600", ge=5, le=600)
    question: Said = key(
        ..., "What one should be able to answer afterwards", f"a text of 1 to {LONGEST} characters"
    )
    scenes: Annotated[Names, Field(min_length=1)] = key(
        ...,
        "What is simulated",
        f"a list of 1 to {MOST} names: of shipped scenes, or of .toml files beside lesson.toml",
    )
    steps: Annotated[tuple[Step, ...], Field(max_length=MOST)] = key(
        ..., "What is done, step by step", f"1 to {MOST} tables [[steps]]", min_length=1
    )
    terminal: Markdown = key("", "What else can be done in a terminal", "a text")
    picture: Picture = key(Picture(), "How lesson.gif is made", "a table of keys and values")
    page: Page | None = key(None, "What its page offers", "a table of keys and values")
    teacher: Teacher | None = key(
        None, "What the teacher's sheet has besides", "a table of keys and values"
    )

    _folder: Path = PrivateAttr()
    _language: str = PrivateAttr("en")
    _untranslated: tuple[str, ...] = PrivateAttr(())

    @property
    def folder(self) -> Path:
        """Where the lesson's files are."""
        return self._folder

    @property
    def language(self) -> str:
        """Of its texts."""
        return self._language

    @property
    def untranslated(self) -> tuple[str, ...]:
        """Parts without a translation: keys of ``lesson.toml``, and files."""
        return self._untranslated

    @property
    def name(self) -> str:
        """The name without its number: ``the-bounce`` of ``03-the-bounce``."""
        return split(self._folder)[1]

    @property
    def number(self) -> int | None:
        """The number its folder begins with; None for one that has none."""
        return split(self._folder)[0]

    @property
    def heading(self) -> str:
        """Number and title."""
        return self.title if self.number is None else f"{self.number}. {self.title}"

    @property
    def columns(self) -> dict[str, Column]:
        """Formulas of the columns of its tables."""
        return {one.value: one for step in self.steps for one in step.columns if one.value}


def split(folder: Path) -> tuple[int | None, str]:
    """Return number and name of a lesson's folder; the number is None if it has none."""
    match = re.fullmatch(r"(\d+)-(.*)", folder.name)
    return (int(match[1]), match[2]) if match else (None, folder.name)


PARTS_OF: Final[dict[str, type[Table]]] = {
    "picture": Picture, "page": Page, "teacher": Teacher, **TABLES,
}  # fmt: skip
"""Model of each table by its key."""


def shipped_lessons(language: str = "en") -> list[Lesson]:
    """Return the shipped lessons in the order of their numbers."""
    return [read(folder, language) for folder in shipped_folders()]


PLAN: Final = "lesson.toml"

OWN_WORDS: Final = "explanation"
"""Id of the cell of a notebook in which a student writes in words."""

LARGEST: Final = 1 << 20
"""Most bytes of ``lesson.toml``."""


class LessonError(SceneError):
    """A lesson that cannot be used; its text lists every fault."""


def unusable(place: object, text: str) -> LessonError:
    """Return the error that says what is wrong with a folder, a file or a name as a whole."""
    return LessonError(str(place), [Fault("", None, text)])


def read(folder: str | Path, language: str = "en") -> Lesson:
    """Read and validate the lesson in a folder.

    Parameters
    ----------
    folder
        Where ``lesson.toml`` is.
    language
        Of its texts; texts without a translation are in English.

    Raises
    ------
    LessonError
        With all faults of ``lesson.toml``, those of its scenes and settings included, or if it
        cannot be read.
    LanguageError
        If there is no such language.
    """
    source = Path(folder) / PLAN
    if source.is_file():
        if strays := _strays(source.parent):
            raise LessonError(str(source.parent), strays)
        if source.stat().st_size > LARGEST:
            raise unusable(source, f"too large: it has at most {LARGEST} bytes")
    elif source.exists():
        raise unusable(source, "cannot be read: it is no regular file")
    untranslated: list[str] = []
    try:
        document = tomllib.loads(source.read_text(encoding="utf-8"))
    except OSError as error:
        raise unusable(source, f"cannot be read: {error.strerror or error}") from None
    except UnicodeDecodeError:
        raise unusable(source, "not UTF-8 text; save the file as UTF-8") from None
    except (ValueError, RecursionError) as error:
        raise unusable(source, f"not TOML: {error}") from None
    words(language)  # refuses an unknown language
    document = in_language(document, language, untranslated)
    faults: list[Fault] = []
    sound = document
    try:
        lesson = Lesson.model_validate(document)
    except ValidationError as error:
        faults += _faults(error, document)
        # The sound keys are still checked, so that all faults are listed at once.
        faulty = {detail["loc"][0] for detail in error.errors()}
        sound = {name: value for name, value in document.items() if name not in faulty}
        needed: dict[str, Any] = {"title": "-", "level": "start", "question": "-", "scenes": ["-"]}
        needed |= {"steps": [{"kind": "try"}]}
        lesson = Lesson.model_validate(needed | sound)
    lesson._folder = source.parent.resolve()
    lesson._language, lesson._untranslated = language, tuple(untranslated)
    if "scenes" in sound:
        faults += _misfits(lesson)
    if faults:
        raise LessonError(str(source), faults)
    return lesson


def _strays(folder: Path) -> list[Fault]:
    """Return the files of a folder that are links to files elsewhere.

    A page or a copy of the lesson would contain those files.
    """
    home = os.path.realpath(folder)
    try:
        paths = sorted(folder.iterdir())
    except OSError as error:
        raise unusable(folder, f"cannot be read: {error.strerror or error}") from None
    return [
        Fault(path.name, None, "a symbolic link out of the lesson's folder; put the file in there")
        for path in paths
        if path.is_symlink() and not path.is_dir()
        and not Path(os.path.realpath(path)).is_relative_to(home)
    ]  # fmt: skip


def scene_of(
    lesson: Lesson, name: str | None = None, settings: Sequence[str | Override] = ()
) -> Scene:
    """Load one of a lesson's scenes, by default the first, with settings laid over it.

    Raises
    ------
    SceneError
        With all faults of the scene and the settings.
    """
    name = name or lesson.scenes[0]
    return load(beside(lesson, name) or name, settings)


def beside(lesson: Lesson, name: str) -> Path | None:
    """Return the file of a lesson that has this name, None if there is none."""
    plain = name.isprintable() and Path(name).name == name
    return lesson.folder / name if plain and (lesson.folder / name).is_file() else None


def called_in(name: str, language: str) -> str:
    """Return what a file is called in a language.

    >>> called_in("lesson.gif", "en"), called_in("lesson.gif", "de")
    ('lesson.gif', 'lesson.de.gif')
    """
    stem, dot, suffix = name.rpartition(".")
    return name if language == "en" else f"{stem}.{language}{dot}{suffix}"


def picture_of(lesson: Lesson, name: str) -> str:
    """Return the name of a lesson's picture in its language, or in English if that is not made."""
    said = called_in(name, lesson.language)
    return name if beside(lesson, said) is None else said


def _misfits(lesson: Lesson) -> Iterator[Fault]:
    """Yield faults that concern several keys: scenes that do not load, names not in them."""
    scenes: dict[str, Scene] = {}
    for i, name in enumerate(lesson.scenes):
        here = f"scenes[{i}]"
        if beside(lesson, name) is None and name not in shipped():
            hint = did_you_mean(name, shipped(), "`chutelab scenes` lists the shipped")
            yield Fault(here, name, f"no shipped scene, and no file beside lesson.toml; {hint}")
            continue
        try:
            scenes[name] = scene_of(lesson, name)
        except SceneError as error:
            for fault in error.faults:
                yield Fault(here, name, f"{error.file}: {fault}")
    for table in ("picture", "page"):
        part = getattr(lesson, table)
        if not isinstance(part, Chosen):
            continue
        name = part.scene or lesson.scenes[0]
        if name not in lesson.scenes:
            listed = ", ".join(lesson.scenes)
            yield Fault(f"{table}.scene", name, f"must be one of scenes: {listed}")
        if name not in scenes:
            continue
        try:
            scene_of(lesson, name, part.settings if isinstance(part, Page) else part.set)
        except SceneError as error:
            for fault in error.faults:
                if fault.key.startswith("live"):
                    yield Fault(f"{table}.{fault.key}", fault.value, fault.allowed)
                else:
                    yield Fault(f"{table}.set", list(part.set), str(fault))
            return
    if len(scenes) == len(lesson.scenes):
        yield from faults_of(lesson.steps, *_machines(lesson))


def _machines(lesson: Lesson) -> tuple[Callable[[Mapping[str, Any]], Scene], Mapping[str, Any]]:
    """Return how to load the machine of steps with changed keys, and what their page offers."""
    page = lesson.page or Page()
    laid = page.settings if lesson.page else []

    def machine(changed: Mapping[str, Any]) -> Scene:
        return scene_of(lesson, page.scene, [*laid, *(Override(k, v) for k, v in changed.items())])

    return machine, page.live


def machine_of(lesson: Lesson, step: Step, row: Row | None = None) -> Scene:
    """Load the machine of a step, or of a row of its table.

    Raises a `SceneError` with all faults of the scene and the settings.
    """
    return _machines(lesson)[0]({**step.set, **(row.set if row else {})})


def _faults(error: ValidationError, document: Mapping[str, Any]) -> list[Fault]:
    """Return the errors of a validation in words, one fault a key."""
    faults: dict[tuple[str | int, ...], Fault] = {}
    for detail in error.errors(include_url=False):
        # The key, without indices inside its value, and its table.
        loc = detail["loc"]
        table: type[Table] | None = Lesson
        for n, part in enumerate(loc):
            if isinstance(part, str):
                if table is None:
                    break
                owner, table, path = table, PARTS_OF.get(part), loc[: n + 1]
        keys, missing = owner.model_fields, detail["type"] == "missing"
        if detail["type"] == "extra_forbidden":
            near = nearest(str(path[-1]), keys)
            known = f"known are {', '.join(keys)}"
            meant = f"did you mean {joined((*path[:-1], *near))}?" if near else known
            text = f"unknown key; {meant}"
        else:
            extra = keys[str(path[-1])].json_schema_extra
            allowed = extra["allowed"] if isinstance(extra, dict) else ""
            text = str(allowed) if missing else f"must be {allowed}"
        value = MISSING if missing else at_path(document, path)
        faults.setdefault(path, Fault(joined(path), value, text))
    return list(faults.values())


def find(wanted: str | int | Path, language: str = "en") -> Lesson:
    """Return one lesson.

    Parameters
    ----------
    wanted
        A number (3, "3" or "03"), a name ("the-bounce" or "03-the-bounce"), or a folder that holds
        a ``lesson.toml``.
    language
        Of its texts, see `read`.

    Raises
    ------
    LessonError
        If there is none; it suggests shipped lessons. Or with the faults of the lesson.
    """
    said = str(wanted).strip().rstrip("/")
    folders = shipped_folders()
    for folder in folders:
        number, name = split(folder)
        if said.lower() in (name, folder.name) or (said.isdecimal() and int(said) == number):
            return read(folder, language)
    path = Path(said)
    if (path / PLAN).is_file():
        return read(path, language)
    if path.name == PLAN and path.is_file():
        return read(path.parent, language)
    names = [split(folder)[1] for folder in folders]
    listed = ", ".join(folder.name for folder in folders)
    advice = did_you_mean(said.lower(), names, f"there are {listed}", most=2)
    text = f"no lesson of this number or name, and no folder with a {PLAN}; {advice}"
    raise unusable(said or '""', text)


def shipped_folders() -> list[Path]:
    """Return the folders of the shipped lessons, which lie beside those of the scenes."""
    scene = next(iter(shipped().values()), None)
    found = scene.parent.parent.glob(f"lessons/*-*/{PLAN}") if scene else ()
    numbered = [plan.parent for plan in found if split(plan.parent)[0] is not None]
    return sorted(numbered, key=lambda folder: (split(folder)[0] or 0, folder.name))
