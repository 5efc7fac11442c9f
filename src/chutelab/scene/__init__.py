"""Scene files: from TOML text to a frozen, validated `Scene`, and back.

Here are `Scene`, what reads, overrides, validates and writes it, and the shipped scenes.

- `units`: sizes with their units; strict types and ranges of keys.
- `materials`: particles and their materials; presets with their spread and sources.
- `quantities`: the registry of a run's quantities, the source of all their names.
- `conflicts`: rules between several keys.
- `tables`: the tables of a scene as frozen Pydantic models, with the defaults.
- `schema`: all tables together, and defaults that depend on other tables.
- `overrides`: keys by their full path: JSON Schema, limits, ``KEY=VALUE`` texts.
- `messages`: Pydantic's errors in words; checks of the keys in ``[live]``.
- `variants`: one scene with other values: ``--vary``, combinations, families.
"""

from __future__ import annotations

import re
import tomllib
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cache, lru_cache
from itertools import takewhile
from pathlib import Path
from typing import Any, Final

from pydantic import ValidationError

from chutelab.scene.conflicts import ConflictError, conflicts
from chutelab.scene.look import JOINTS, Look
from chutelab.scene.materials import Particle
from chutelab.scene.messages import faults_of, live_faults
from chutelab.scene.overrides import Override, apply, joined, schema, sized
from chutelab.scene.schema import DEFAULTS, SceneTables, plain_number, to_dict
from chutelab.scene.tables import Conveyor, Expect, Incoming, Outgoing, Plate, Run, Stream, Surface
from chutelab.scene.units import RESERVED_NAMES, flat
from chutelab.util.errors import (
    MISSING,
    Fault,
    InputError,
    cut,
    did_you_mean,
    nearest,
    need_all,
    printable,
    shown,
)
from chutelab.util.files import first_bytes

__all__ = [
    "MISSING", "RESERVED_NAMES", "About", "AnyScene", "Conveyor", "Expect", "Fault", "Incoming",
    "Outgoing", "Overrides", "Particle", "Plate", "Run", "Scene", "SceneError", "Stream", "Surface",
    "about", "find", "from_dict", "load", "parse", "schema", "shipped", "shown", "template",
    "to_dict", "to_toml",
]  # fmt: skip

need_all()


class SceneError(InputError):
    """A scene that cannot be used; its text lists every fault.

    Parameters
    ----------
    file
        The file, or a stand-in such as ``<scene>``.
    faults
        The faults, at least one; a text if it concerns the whole file.
    hint
        What to do next, if there is something better than correcting each fault.
    """

    def __init__(self, file: str, faults: Sequence[Fault] | str, hint: str = "") -> None:
        if isinstance(faults, str):
            faults = [Fault("", None, faults)]
        first = faults[0]
        super().__init__(first.allowed, first.key, first.value, file)
        # The arguments for `copy` and `pickle`.
        self.args = file, faults, hint
        self.faults, self.hint = list(faults), hint


@dataclass(frozen=True)
class About:
    """Entry of the list of scenes: name, title and what to look at."""

    name: str
    title: str
    look: tuple[str, ...]
    path: Path


@cache
def shipped() -> dict[str, Path]:
    """Return the files of the shipped scenes by name, in alphabetical order.

    They are in the package or, in a checkout, beside ``src``.
    """
    package = Path(__file__).parents[1]
    folder = package / "data" / "scenes"
    if not folder.is_dir() and (package.parents[1] / "pyproject.toml").is_file():
        folder = package.parents[1] / "scenes"
    return dict(sorted((path.stem, path) for path in folder.glob("*.toml")))


def about() -> list[About]:
    """Describe the shipped scenes by their titles and the comments they begin with."""
    found = []
    for name, path in shipped().items():
        text = path.read_text(encoding="utf-8")
        comment = takewhile(lambda line: line.startswith("#"), text.splitlines())
        look = tuple(line.lstrip("# ") for line in comment if not line.startswith("#:"))
        found.append(About(name, tomllib.loads(text).get("title", name), look, path))
    return found


def find(name_or_path: str | Path) -> Path:
    """Return an existing file, or else the shipped scene of this name.

    Raises
    ------
    SceneError
        If there is neither; the message suggests shipped scenes.
    """
    source = str(name_or_path)
    path = Path(source)
    try:
        exists, folder = path.exists(), path.is_dir()
    except (OSError, ValueError):
        exists = folder = False
    if exists and not folder:
        return path
    scenes = shipped()
    if (name := source.removesuffix(".toml")) in scenes:
        return scenes[name]
    if folder and source:
        text = "a directory; give a scene file, or the name of a shipped scene"
        raise SceneError(source, text)
    there = f"there are {', '.join([*scenes][:5])} and others, see `chutelab scenes`"
    advice = did_you_mean(path.stem, scenes, there, most=3)
    text = f"no such file, and no shipped scene of this name; {advice}"
    raise SceneError(source or '""', text)


def template() -> str:
    """Return a complete, commented scene to start from, as TOML text."""
    return (Path(__file__).parent / "starter.toml").read_text(encoding="utf-8")


_LARGEST_FILE: Final = 1 << 20
"""Bytes; a scene of a few tables is a thousandth of it, /dev/zero has more."""

_DEEPEST: Final = 20
"""Most levels of keys and lists; a scene has four, and much deeper ones cannot even be copied."""

_MOST_DOTS: Final = 200
"""Dots between two signs that end a key or a value."""

Overrides = str | Override | Mapping[str, object] | Iterable["Overrides"]
"""Overrides of a scene: a text ``KEY=VALUE``, values by key, or several of these."""


class Scene(SceneTables):
    """A validated scene, all defaults filled in that need no geometry.

    `particles`, `plates` and `streams` have all tables of their kind; `stream` is the first,
    `particle` its kind, and `plate` the one at a distance from the pulley.

    Raises
    ------
    SceneError
        With all faults.
    """

    def __init__(self, **tables: Any) -> None:
        try:
            super().__init__(**tables)
        except ValidationError as error:
            faults, details = faults_of(error, tables), error.errors(include_url=False)
            for cause in (detail.get("ctx", {}).get("error") for detail in details):
                if isinstance(cause, ConflictError):
                    faults += cause.faults
            raise SceneError("<scene>", faults) from None

    def with_values(self, values: Mapping[str, object]) -> Scene:
        """Return the scene with other values, validated, and with defaults filled in anew.

        Parameters
        ----------
        values
            By full path, such as ``plate.angle_deg``, ``surface.hood.speed`` or
            ``surface[0].speed``; also whole tables. None removes a key, so that it has its default.
            A whole float such as 3.0 is accepted for a whole number.

        Raises
        ------
        SceneError
            With all values that the scene refuses, and those that contradict each other.

        Examples
        --------
        >>> from chutelab.scene import load
        >>> load("perpendicular").with_values({"plate.angle_deg": 20.0}).plate.angle_deg
        20.0
        """
        overrides = [Override(key, plain_number(plain(value))) for key, value in values.items()]
        return from_dict(to_dict(self), self.source, overrides)

    def alone(self) -> Scene:
        """Return the scene with its first particle only, without expectations and view."""
        tables = to_dict(self)
        streams = tables.get("stream", {})
        first = streams[0] if isinstance(streams, tuple) else streams
        one = {**first, "count": 1, "interact": False}
        changed: dict[str, Any] = {"stream": one, "expect": None, "live": None}
        for table in JOINTS:
            rows = tables.get(table, ())
            own = [row for row in rows if not row.get("particle") and "other" not in row]
            changed[table] = own or None
        return self.with_values(changed)


AnyScene = Scene | str | Path | Mapping[str, Any]
"""Everything that `load`, and every function that takes a scene, accepts."""


def load(scene: AnyScene, overrides: Overrides = (), *more: Overrides) -> Scene:
    """Load a scene from a file or, by name, from the shipped ones.

    Parameters
    ----------
    scene
        A file; the name of a shipped scene, with or without ``.toml``; the tables of a file as
        nested mappings; or a scene, which is validated again if there are overrides.
    overrides, *more
        Overrides; the last one wins: texts ``KEY=VALUE``; mappings of values by full path, or
        nested as in the file; or lists of these.

    Raises
    ------
    SceneError
        With all faults of the scene and of the overrides.

    Examples
    --------
    >>> load("perpendicular", "incoming.speed=3", "plate.angle_deg=20").incoming.speed
    3.0
    >>> load("perpendicular", {"incoming.speed": 3, "plate": {"angle_deg": 20}}).plate.angle_deg
    20.0
    >>> load({"surface": [{"name": "floor", "from": [0, 0], "to": [1, 0]}],
    ...       "stream": {"at": [0.5, 1.0], "velocity": [0, 0]}}).surfaces
    ('floor',)
    """
    overrides = (overrides, *more)
    if isinstance(scene, Scene):
        changes = list(_each(overrides))
        return from_dict(to_dict(scene), scene.source, changes) if changes else scene
    if isinstance(scene, Mapping):
        return from_dict(scene, overrides=overrides)
    found = find(scene)
    # For a shipped scene its name says more than a path inside an environment.
    source = found.stem if found != Path(scene) else str(found)
    return parse(_read(found, source), source, overrides)


def _each(overrides: Overrides) -> Iterator[str | Override]:
    match overrides:
        case str() | Override():
            yield overrides
        case Mapping():
            for key, value in flat(overrides).items():
                yield Override(key, plain_number(plain(value)))
        case _:
            for several in overrides:
                yield from _each(several)


def parse(text: str, source: str = "<scene>", overrides: Overrides = ()) -> Scene:
    """Validate a scene given as TOML text; `source` is what messages call it.

    Raises
    ------
    SceneError
        With all faults, or with the place of a syntax error.
    """
    changes = list(_each(overrides))
    return from_dict(_document(text, source), source, changes) if changes else _sound(text, source)


@lru_cache(16)
def _sound(text: str, source: str) -> Scene:
    """Return the scene of a text; a scene never changes, so it is cached."""
    return from_dict(_document(text, source), source)


def _document(text: str, source: str) -> dict[str, Any]:
    """Read TOML."""
    # For a key of many parts tomllib takes time proportional to their number squared.
    if any(part.count(".") > _MOST_DOTS for part in re.split(r"[][{},=\n]", text)):
        raise SceneError(source, "not TOML to be read: a key is nested too deep")
    try:
        document = tomllib.loads(text.removeprefix("\N{ZERO WIDTH NO-BREAK SPACE}"))
    except tomllib.TOMLDecodeError as error:
        raise SceneError(source, [_syntax_fault(text, str(error))]) from None
    except (ValueError, RecursionError):
        # tomllib raises Python's own errors for impossible dates, integers of thousands of digits,
        # and arrays nested a thousand deep.
        text = "not TOML to be read: a value is too large or nested too deep"
        raise SceneError(source, text) from None
    return document


def from_dict(
    mapping: Mapping[str, Any], source: str = "<scene>", overrides: Overrides = ()
) -> Scene:
    """Validate a scene given as nested mappings, with the keys of the file.

    Raises
    ------
    SceneError
        With all faults.
    """
    try:
        document: dict[str, Any] = plain(mapping)
    except RecursionError as error:
        raise SceneError(source, str(error)) from None
    document = sized(document)
    faults, given = apply(document, _each(overrides))
    empty = not document
    if source != "<scene>":
        document.setdefault("title", cut(printable(Path(source).stem), 200))
    if halves := list(_halves(document)):
        raise SceneError(source, faults + [_traced(fault, given) for fault in halves])
    try:
        scene = Scene.validated(document)
    except ValidationError as error:
        found = faults_of(error, document)
        faulty = {fault.key for fault in found}
        # A misspelt table is not reported as missing, too.
        tables = [field.alias or name for name, field in Scene.model_fields.items()]
        for key in document.keys() - set(tables):
            faulty.update(nearest(key, tables))
        found += conflicts(Look(document, DEFAULTS, faulty))
    else:
        scene._source = source
        found = list(live_faults(document, scene.live))
        if not (faults or found):
            return scene
    faults += [_traced(fault, given) for fault in found]
    hint = "The scene is empty. `chutelab new` writes a complete scene to start from."
    raise SceneError(source, faults, hint if empty else "") from None


def _halves(value: object, path: tuple[str | int, ...] = ()) -> Iterator[Fault]:
    """Yield the texts of a document, keys included, that have lone surrogates.

    Bytes of a command line that are not UTF-8 become such; no file could be written with them.
    """
    match value:
        case str() if not value.isascii() and any("\ud800" <= one <= "\udfff" for one in value):
            yield Fault(joined(path), value, "must be Unicode, without halves of characters")
        case dict():
            for key, content in value.items():
                yield from _halves(key, (*path, key))
                yield from _halves(content, (*path, key))
        case list():
            for index, item in enumerate(value):
                yield from _halves(item, (*path, index))


_POINT: Final = re.compile(r"\[\n\s+([-+\w.]+),\n\s+([-+\w.]+),\n\s*\]")


def to_toml(scene: Scene, comment: str = "") -> str:
    """Return the keys of a scene that were set, as the text of a scene file.

    Its ``[[expect]]`` are left out: they belong to another scene.

    Parameters
    ----------
    comment : str
        Lines to begin with.

    Examples
    --------
    >>> scene = load("perpendicular")
    >>> parse(to_toml(scene)).plate == scene.plate
    True
    """
    import tomli_w

    tables = to_dict(scene)
    tables.pop("expect", None)
    # tomli-w writes a line for each number of a list; texts contain no raw line breaks.
    text = _POINT.sub(r"[\1, \2]", tomli_w.dumps(tables))
    remark = "".join(f"# {printable(line)}".rstrip() + "\n" for line in comment.splitlines())
    return f"{remark}\n{text}" if remark else text


def plain(value: object, levels: int = _DEEPEST) -> Any:
    """Copy a value as `tomllib` would return it: of dicts, lists and Python's own numbers.

    A RecursionError if there are more levels than `levels`.
    """
    if levels < 0:
        raise RecursionError(f"nested too deep: more than {_DEEPEST} levels of keys and lists")
    match value:
        case Mapping():
            return {str(key): plain(content, levels - 1) for key, content in value.items()}
        case list() | tuple():
            return [plain(item, levels - 1) for item in value]
    # NumPy's numbers and arrays, without its import.
    return value.tolist() if hasattr(value, "tolist") else value


def _traced(fault: Fault, given: Mapping[str, str]) -> Fault:
    """Add the override to a fault, if it came from one."""
    for path, typed in given.items():
        if not typed:
            continue
        inside = fault.key == path or fault.key.startswith((path + ".", path + "["))
        if inside or path.startswith(fault.key + "."):
            return Fault(fault.key, fault.value, f"{fault.allowed} (from {typed})")
    return fault


def _read(path: Path, source: str) -> str:
    try:
        data = first_bytes(path, _LARGEST_FILE)
    except OSError as error:
        raise SceneError(source, f"cannot be read: {error.strerror or error}") from None
    if len(data) > _LARGEST_FILE:
        text = f"too large for a scene, which has at most {_LARGEST_FILE} bytes"
        raise SceneError(source, text)
    if b"\0" in data:
        raise SceneError(source, "not a text file, so not a scene in TOML")
    try:
        return data.decode("utf-8")
    except UnicodeDecodeError as error:
        line = data.count(b"\n", 0, error.start) + 1
        text = f"not UTF-8 text (byte 0x{data[error.start]:02x}); save the file as UTF-8"
        raise SceneError(source, [Fault(f"line {line}", None, text)]) from None


def _syntax_fault(text: str, message: str) -> Fault:
    place = re.search(r" ?\(at (?:line (\d+), column (\d+)|end of document)\)$", message)
    lines = text.splitlines() or [""]
    if place is None or place[1] is None:
        line, column = len(lines), len(lines[-1]) + 1
    else:
        line, column = int(place[1]), int(place[2])
    reason = message[: place.start()] if place else message
    found = lines[line - 1].strip() if line <= len(lines) else ""
    unquoted = re.search(r"=[^\"'{#]*[^\W\d_]", found)
    advice = "; put texts, and numbers with units, in quotation marks" if unquoted else ""
    return Fault(f"line {line}, column {column}", found, f"not TOML: {reason}{advice}")
