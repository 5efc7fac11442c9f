"""A lesson's folder: read, validated with its scenes, and all that is wrong said at once."""

from __future__ import annotations

import difflib
import tomllib
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

from pydantic import ValidationError

from chutelab.hints import did_you_mean
from chutelab.lessons.models import LEVELS, TABLES, Lesson, Page, Picture
from chutelab.scene import MISSING, Fault, Scene, SceneError, load, shipped
from chutelab.scene.errors import at_path, joined
from chutelab.scene.measures import suggestion, unit_of
from chutelab.variation import VaryError, parse, quantity

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping, Sequence

    from pydantic import BaseModel

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
        lesson = _sound_part(document, {str(detail["loc"][0]) for detail in error.errors()})
    lesson._folder = folder.resolve()
    if faults := [*faults, *_judged(lesson)]:
        raise LessonError(str(source), faults)
    return lesson


def _sound_part(document: Mapping[str, Any], faulty: set[str]) -> Lesson:
    """Return a lesson of the keys that are sound, so that their values can be judged, too."""
    sound = {name: value for name, value in document.items() if name not in faulty}
    needed = {"title": "-", "level": LEVELS[0], "question": "-", "scenes": ["-"]}
    lesson = Lesson.model_validate(needed | sound)
    return lesson.model_copy(update={"scenes": ()}) if "scenes" not in sound else lesson


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


def _judged(lesson: Lesson) -> Iterator[Fault]:
    """Yield what no key can be judged for alone: scenes that load, names that are in them."""
    if not lesson.scenes:
        return
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
                yield Fault(here, name, f"{error.source}: {fault}")
    yield from _measured(lesson, scenes)
    for table in TABLES:
        part = getattr(lesson, table)
        if part is None:
            continue
        name = part.scene or lesson.scenes[0]
        if name not in lesson.scenes:
            allowed = f"must be one of scenes: {', '.join(lesson.scenes)}"
            yield Fault(f"{table}.scene", name, allowed)
        elif name in scenes:
            yield from _varied(lesson, table, name, part)


def _varied(lesson: Lesson, table: str, name: str, part: Picture | Page) -> Iterator[Fault]:
    """Yield what is wrong with the settings of a table's scene, or else with what it varies."""
    try:
        scene = scene_of(lesson, name, part.set)
    except SceneError as error:
        for fault in error.faults:
            yield Fault(f"{table}.set", list(part.set), str(fault))
        return
    for i, text in enumerate(part.vary if isinstance(part, Page) else ()):
        try:
            quantity(scene, parse(text))
        except VaryError as error:
            said = str(error).removeprefix(f"--vary {text}: ")
            yield Fault(f"{table}.vary[{i}]", text, said)


def unit_in(lesson: Lesson, quantity: str) -> str:
    """Return the unit of a quantity in the first of a lesson's scenes that has it."""
    found = (unit_of(quantity, scene_of(lesson, name).surfaces) for name in lesson.scenes)
    return next((unit for unit in found if unit is not None), "")


def _measured(lesson: Lesson, scenes: Mapping[str, Scene]) -> Iterator[Fault]:
    surfaces = [scene.surfaces for scene in scenes.values()]
    if len(scenes) < len(lesson.scenes):
        return  # one that is broken may be the one that has it
    for name, words in lesson.quantities.items():
        if all(unit_of(name, names) is None for names in surfaces):
            text = f"no such quantity in its scenes; {suggestion(name, surfaces[0])}"
            yield Fault(f"quantities.{name}", words, text)


def _faults(error: ValidationError, document: Mapping[str, Any]) -> Iterator[Fault]:
    """Yield each error of a validation in words, one fault a key."""
    told = set()
    for detail in error.errors(include_url=False):
        parts, missing = detail["loc"], detail["type"] == "missing"
        table, path = _table(parts)
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


def _table(parts: tuple[str | int, ...]) -> tuple[type[BaseModel], tuple[str | int, ...]]:
    """Return the model that a location is in, and its path without indices."""
    inner = TABLES.get(str(parts[0])) if len(parts) > 1 else None
    return (Lesson, parts[:1]) if inner is None else (inner, parts[:2])
