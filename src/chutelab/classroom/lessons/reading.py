"""Lessons: ``lesson.toml`` as a frozen model, a lesson's folder, and the shipped lessons.

A folder is validated with its scenes, and all that is wrong is said at once.
"""

from __future__ import annotations

import difflib
import re
import tomllib
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Annotated, Any, Final, Literal

from pydantic import Field, PrivateAttr, ValidationError

from chutelab.scene import MISSING, Fault, Scene, SceneError, load, shipped
from chutelab.scene.overrides import at_path, joined
from chutelab.scene.rules import suggestion, unit_of
from chutelab.scene.units import Number, Table, Text, Whole
from chutelab.scene.variants import parse, quantity
from chutelab.util.errors import InputError, did_you_mean

LEVELS: Final = ("start", "core", "advanced")
MOST: Final = 20
"""Entries of a list at most: a lesson that needs more is two lessons."""

LONGEST: Final = 200
"""Characters of a text at most: it has to go on one slide."""

VARIED: Final = 2
"""Sliders of a page at most."""

Said = Annotated[Text, Field(min_length=1, max_length=LONGEST)]
Names = Annotated[tuple[Said, ...], Field(max_length=MOST)]


def key(default: Any, what: str, allowed: str, **limits: Any) -> Any:
    """Describe one key: its default, its definition in a sentence, and what it allows."""
    return Field(default, description=f"{what}.", json_schema_extra={"allowed": allowed}, **limits)


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
    width: Whole = key(800, "Width, pixels", "a whole number from 320 to 3840", ge=320, le=3840)
    height: Whole = key(450, "Height, pixels", "a whole number from 180 to 2160", ge=180, le=2160)


class Page(Chosen):
    """What the page of the lesson lets one vary; without this table it has none."""

    vary: Annotated[tuple[Said, ...], Field(min_length=1, max_length=VARIED)] = key(
        ...,
        "A slider each",
        f'a list of 1 to {VARIED} texts such as "plate.angle_deg=-20:70:46" (from, to, how many)',
    )


class Lesson(Table):
    """A validated lesson; its files lie in `folder`."""

    title: Said = key(..., "What the lesson is called", f"a text of 1 to {LONGEST} characters")
    level: Literal["start", "core", "advanced"] = key(
        ..., "For whom", ", ".join(f'"{level}"' for level in LEVELS[:-1]) + f' or "{LEVELS[-1]}"'
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
    quantities: Annotated[dict[Said, Said], Field(max_length=MOST)] = key(
        {},
        "What one looks at, and what it is in words",
        f'a table of at most {MOST} lines such as x3 = "way back from the plate"; names with dots'
        " in quotes",
    )
    picture: Picture = key(Picture(), "How lesson.gif is made", "a table of keys and values")
    page: Page | None = key(None, "What its page varies", "a table of keys and values")

    _folder: Path = PrivateAttr()

    @property
    def folder(self) -> Path:
        """Where the lesson's files are."""
        return self._folder

    @property
    def name(self) -> str:
        """The name without its number: ``the-bounce`` of ``03-the-bounce``."""
        return re.sub(r"^\d+-", "", self._folder.name)

    @property
    def number(self) -> int | None:
        """The number its folder begins with; None for one that has none."""
        match = re.match(r"(\d+)-", self._folder.name)
        return int(match[1]) if match else None

    @property
    def worksheet(self) -> Path:
        """The worksheet, in Markdown."""
        return self._folder / "README.md"


TABLES: Final[dict[str, type[Chosen]]] = {"picture": Picture, "page": Page}
"""Model of each table by its key."""


def shipped_lessons() -> list[Lesson]:
    """Return the shipped lessons in the order of their numbers.

    Raises
    ------
    LessonError
        With the faults of the first that is broken.
    """
    return [read(folder) for folder in _folders()]


PLAN: Final = "lesson.toml"


class LessonError(SceneError):
    """A lesson that cannot be used; its text lists every fault."""


def read(folder: str | Path) -> Lesson:
    """Read and validate the lesson in a folder.

    Raises
    ------
    LessonError
        With all faults of ``lesson.toml``, those of its scenes and settings included, or if it
        cannot be read.
    """
    folder = Path(folder)
    source = folder / PLAN
    try:
        document = tomllib.loads(source.read_text(encoding="utf-8"))
    except OSError as error:
        reason = error.strerror or str(error)
        raise LessonError(str(source), [Fault("", None, f"cannot be read: {reason}")]) from None
    except UnicodeDecodeError:
        fault = Fault("", None, "not UTF-8 text; save the file as UTF-8")
        raise LessonError(str(source), [fault]) from None
    except (ValueError, RecursionError) as error:
        raise LessonError(str(source), [Fault("", None, f"not TOML: {error}")]) from None
    faults: list[Fault] = []
    try:
        lesson = Lesson.model_validate(document)
    except ValidationError as error:
        faults += _faults(error, document)
        # What is sound is judged all the same, so that all faults are said at once.
        faulty = {detail["loc"][0] for detail in error.errors()}
        sound = {name: value for name, value in document.items() if name not in faulty}
        needed = {"title": "-", "level": LEVELS[0], "question": "-", "scenes": ["-"]}
        lesson = Lesson.model_validate(needed | sound)
        if "scenes" not in sound:
            lesson = lesson.model_copy(update={"scenes": ()})
    lesson._folder = folder.resolve()
    if lesson.scenes:
        faults += _misfits(lesson)
    if faults:
        raise LessonError(str(source), faults)
    return lesson


def scene_of(lesson: Lesson, name: str | None = None, settings: Sequence[str] = ()) -> Scene:
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


def _misfits(lesson: Lesson) -> Iterator[Fault]:
    """Yield what no key can be judged for alone: scenes that load, names that are in them."""
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
    if len(scenes) == len(lesson.scenes):  # one that is broken may be the one that has a quantity
        surfaces = [scene.surfaces for scene in scenes.values()]
        for name, words in lesson.quantities.items():
            if all(unit_of(name, names) is None for names in surfaces):
                text = f"no such quantity in its scenes; {suggestion(name, surfaces[0])}"
                yield Fault(f"quantities.{name}", words, text)
    for table in TABLES:
        part: Chosen | None = getattr(lesson, table)
        if part is None:
            continue
        name = part.scene or lesson.scenes[0]
        if name not in lesson.scenes:
            allowed = f"must be one of scenes: {', '.join(lesson.scenes)}"
            yield Fault(f"{table}.scene", name, allowed)
        if name not in scenes:
            continue
        try:
            scene = scene_of(lesson, name, part.set)
        except SceneError as error:
            for fault in error.faults:
                yield Fault(f"{table}.set", list(part.set), str(fault))
            continue
        for i, text in enumerate(part.vary if isinstance(part, Page) else ()):
            try:
                quantity(scene, parse(text))
            except InputError as error:
                yield Fault(f"{table}.vary[{i}]", text, error.allowed)


def unit_in(lesson: Lesson, quantity: str) -> str:
    """Return the unit of a quantity in the first of a lesson's scenes that has it."""
    found = (unit_of(quantity, scene_of(lesson, name).surfaces) for name in lesson.scenes)
    return next((unit for unit in found if unit is not None), "")


def _faults(error: ValidationError, document: Mapping[str, Any]) -> Iterator[Fault]:
    """Yield each error of a validation in words, one fault a key."""
    told = set()
    for detail in error.errors(include_url=False):
        parts, missing = detail["loc"], detail["type"] == "missing"
        inside = str(parts[0]) in TABLES and len(parts) > 1
        table: type[Table] = TABLES[str(parts[0])] if inside else Lesson
        path = parts[:2] if inside else parts[:1]  # without indices
        if detail["type"] == "extra_forbidden":
            near = difflib.get_close_matches(str(parts[-1]), table.model_fields, n=1, cutoff=0.55)
            known = ", ".join(table.model_fields)
            text = "unknown key; " + (
                f"did you mean {joined((*path[:-1], *near))}?" if near else f"known are {known}"
            )
        else:
            extra = table.model_fields[str(path[-1])].json_schema_extra
            allowed = extra["allowed"] if isinstance(extra, dict) else ""
            text = str(allowed) if missing else f"must be {allowed}"
        if path not in told:
            told.add(path)
            yield Fault(joined(path), MISSING if missing else at_path(document, path), text)


def find(wanted: str | int | Path) -> Lesson:
    """Return one lesson.

    Parameters
    ----------
    wanted
        A number (3, "3" or "03"), a name ("the-bounce" or "03-the-bounce"), or a folder that holds
        a ``lesson.toml``.

    Raises
    ------
    LessonError
        If there is none; it suggests shipped lessons. Or with the faults of the lesson.
    """
    said = str(wanted).strip().rstrip("/")
    folders = _folders()
    for folder in folders:
        number, name = folder.name.split("-", 1)
        same_number = said.isdecimal() and int(said) == int(number)
        if same_number or said.lower() in (name, folder.name):
            return read(folder)
    path = Path(said)
    if (path / PLAN).is_file():
        return read(path)
    if path.name == PLAN and path.is_file():
        return read(path.parent)
    names = [folder.name.split("-", 1)[1] for folder in folders]
    listed = ", ".join(folder.name for folder in folders)
    advice = did_you_mean(said.lower(), names, f"there are {listed}", most=2)
    text = f"no lesson of this number or name, and no folder with a {PLAN}; {advice}"
    raise LessonError(said or '""', [Fault("", None, text)])


def _folders() -> list[Path]:
    """Return the folders of the shipped lessons, which lie beside those of the scenes."""
    scene = next(iter(shipped().values()), None)
    found = scene.parent.parent.glob(f"lessons/*/{PLAN}") if scene else ()
    numbered = [path.parent for path in found if re.match(r"\d+-.", path.parent.name)]
    return sorted(numbered, key=lambda path: (int(path.name.split("-")[0]), path.name))
