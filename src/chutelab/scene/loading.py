"""Scenes from files, texts, mappings and by name: read, override, validate, say what is wrong.

Pydantic's errors are told as faults: the key's full path, and what is allowed in words.
"""

from __future__ import annotations

import difflib
import re
import tomllib
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import takewhile
from pathlib import Path
from typing import Any, Final

import tomli_w
from pydantic import ValidationError

from chutelab.scene.conflicts import EITHER, ConflictError, Look, conflicts
from chutelab.scene.overrides import Override, apply, at_path, joined, rule_at
from chutelab.scene.schema import DEFAULTS, Scene, as_written
from chutelab.util.errors import MISSING, Fault, InputError, cut, did_you_mean, printable
from chutelab.util.files import first_bytes


class SceneError(InputError):
    """A scene that cannot be used; its text lists every fault.

    Parameters
    ----------
    file
        The file, or a stand-in such as ``<scene>``.
    faults
        What is wrong, at least one.
    hint
        What to do next, if there is something better than mending each fault.
    """

    def __init__(self, file: str, faults: Sequence[Fault], hint: str = "") -> None:
        first = faults[0]
        super().__init__(first.allowed, first.key, first.value, file)
        # As `copy` and `pickle` will call it.
        self.args = file, faults, hint
        self.faults, self.hint = list(faults), hint


@dataclass(frozen=True)
class About:
    """What the list of scenes says of one: name, title and what to look at."""

    name: str
    title: str
    look: tuple[str, ...]
    path: Path


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
    """Return the file meant: one that exists, or else the shipped scene of this name.

    Raises
    ------
    SceneError
        If there is neither; it suggests shipped scenes.
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
        raise SceneError(source, [Fault("", None, text)])
    advice = did_you_mean(path.stem, scenes, f"there are {', '.join(scenes)}", most=3)
    text = f"no such file, and no shipped scene of this name; {advice}"
    raise SceneError(source or '""', [Fault("", None, text)])


def template() -> str:
    """Return a complete, commented scene to start from, as TOML text."""
    return (Path(__file__).parent / "starter.toml").read_text(encoding="utf-8")


Location = tuple[str | int, ...]
"""Path of keys and indices, as Pydantic gives it."""

_NEAR: Final = 0.55
"""Likeness of a misspelt key and the one that was meant: pivot is taken for pivot_height."""

LISTS: Final = ("material", "pair", "conveyor", "surface", "string", "expect")
"""Tables that are always lists; of those in `EITHER` there may be one or several."""

_WORDS: Final = {
    "number": "a number",
    "integer": "a whole number",
    "boolean": "true or false",
    "string": "a string",
}
_SIGNS: Final = {"minimum": ">=", "exclusiveMinimum": ">", "maximum": "<=", "exclusiveMaximum": "<"}


def faults_of(error: ValidationError, document: Mapping[str, Any]) -> list[Fault]:
    """Say every error of a validation in words, one fault a key, in the order of the models' keys.

    Conflicts between keys are left out: `scene.conflicts` finds them, also in a scene whose
    validation never came to them.
    """
    faults: dict[Location, Fault] = {}
    for detail in error.errors(include_url=False):
        cause = detail.get("ctx", {}).get("error")
        if isinstance(cause, ConflictError):
            continue
        parts, missing = detail["loc"], detail["type"] == "missing"
        if parts[0] in EITHER and isinstance(document.get(str(parts[0])), Mapping):
            parts = (parts[0], *parts[2:])
        if detail["type"] == "extra_forbidden":
            text = _unknown(parts)
        else:
            if missing and isinstance(parts[-1], int):
                # A point with one coordinate: show what is there, not what is not.
                parts, missing = parts[:-1], False
            # The location of a union's error ends with the name of the member that refused.
            while (rule := rule_at(parts)) is None:
                parts = parts[:-1]
            last_key = max(depth for depth, part in enumerate(parts) if isinstance(part, str))
            unit = (rule_at(parts[: last_key + 1]) or {}).get("x-unit")
            allowed = _listed(_phrases(rule)) + (f", in {unit}" if unit else "")
            text = str(cause) if cause else allowed if missing else f"must be {allowed}"
        value = MISSING if missing else at_path(document, parts)
        faults.setdefault(parts, Fault(joined(parts), value, text))
    # A list whose entries are refused is refused as too short, too.
    broken_lists = {
        parts[:depth]
        for parts in faults
        for depth in range(1, len(parts))
        if all(isinstance(part, int) for part in parts[depth:])
    }
    broken_lists |= {parts[:1] for parts in faults if len(parts) > 1 and parts[0] in EITHER}
    return [fault for parts, fault in faults.items() if parts not in broken_lists]


def _phrases(rule: Mapping[str, Any]) -> list[str]:
    """Say a rule of the JSON Schema in words: a phrase for each alternative."""
    if "anyOf" in rule:
        return [phrase for choice in rule["anyOf"] for phrase in _phrases(choice)]
    if "x-words" in rule:
        return [str(rule["x-words"])]
    if "$ref" in rule:
        return ["a table of keys and values"]
    if "enum" in rule or "const" in rule:
        return [f'"{choice}"' for choice in rule.get("enum", [rule.get("const")])]
    if rule["type"] == "object":
        return ["a table of keys and values"]
    if rule["type"] != "array":
        return [_WORDS[rule["type"]] + _range(rule)]
    if "prefixItems" in rule:
        return ["a point [x, y] of two numbers"]
    if "$ref" in rule["items"]:
        table = rule["items"]["$ref"].rpartition("/")[2].lower()
        return [f"at most {rule['maxItems']} tables, each headed by [[{table}]]"]
    return [f"a list of {rule['minItems']} to {rule['maxItems']} points [[x, y], ...]"]


def _range(rule: Mapping[str, Any]) -> str:
    if "maxLength" in rule:
        return f" of at most {rule['maxLength']} characters"
    if "minimum" in rule and "maximum" in rule:
        return f" from {_bound(rule['minimum'])} to {_bound(rule['maximum'])}"
    limits = [f"{sign} {_bound(rule[key])}" for key, sign in _SIGNS.items() if key in rule]
    return f" {' and '.join(limits)}" if limits else ""


def _bound(value: float) -> str:
    return f"{value:g}" if isinstance(value, float) and abs(value) < 1e6 else str(int(value))


def _listed(choices: Iterable[str]) -> str:
    *first, last = choices
    return f"{', '.join(first)} or {last}" if first else last


def _nearest(key: str, known: Iterable[str]) -> list[str]:
    return difflib.get_close_matches(key, list(known), n=1, cutoff=_NEAR)


def _unknown(parts: Location) -> str:
    """Say that a key is unknown, and which one was probably meant."""
    *above, last = parts
    key, known = str(last), _keys(above)
    homes = [
        f"[[{name}]]" if name in LISTS else f"[{name}]"
        for name in Scene.tables()
        if key in _keys([name, 0] if name in LISTS else [name])
    ]
    if not homes and (near := _nearest(key, known)):
        return f"unknown key; did you mean {joined((*above, *near))}?"
    if homes:
        return f"unknown key here; it belongs in {_listed(homes)}"
    return f"unknown key; known here are {', '.join(known)}"


def _keys(table: Sequence[str | int]) -> list[str]:
    rule = rule_at(table)
    rule = rule["anyOf"][0] if rule and "anyOf" in rule else rule
    rule = rule_at([*table, 0]) if rule and "$ref" in rule else rule
    return list(rule["properties"]) if rule else []


_LARGEST_FILE: Final = 1 << 20
"""Bytes; a scene of a few tables is a thousandth of it, /dev/zero has more."""

_DEEPEST: Final = 20
"""Levels of keys and lists; a scene has four, and what is deeper by much cannot even be copied."""

_MOST_DOTS: Final = 200
"""Dots between two signs that end a key or a value."""

_STARTER: Final = "`chutelab new` writes a complete scene to start from."


def load(path: str | Path, overrides: Sequence[str | Override] = ()) -> Scene:
    """Load a scene from a file or, by name, from the shipped ones.

    Parameters
    ----------
    path
        A file, or the name of a shipped scene, with or without ``.toml``.
    overrides
        Texts ``KEY=VALUE``, laid over the file; see `chutelab.scene.overrides.Override`.

    Raises
    ------
    SceneError
        With all faults of the file and of the overrides.
    """
    found = find(path)
    return parse(_read(found), str(found), overrides)


def parse(text: str, source: str = "<scene>", overrides: Sequence[str | Override] = ()) -> Scene:
    """Validate a scene given as TOML text; `source` is what messages call it.

    Raises
    ------
    SceneError
        With all faults, or with the place of a syntax error.
    """
    # For a key of many parts tomllib takes time with their number squared.
    if any(part.count(".") > _MOST_DOTS for part in re.split(r"[][{},=\n]", text)):
        raise SceneError(source, [Fault("", None, "not TOML to be read: a key is nested too deep")])
    try:
        document = tomllib.loads(text.removeprefix("\N{ZERO WIDTH NO-BREAK SPACE}"))
    except tomllib.TOMLDecodeError as error:
        raise SceneError(source, [_syntax_fault(text, str(error))]) from None
    except (ValueError, RecursionError):
        # tomllib passes on what Python itself refuses: dates out of the calendar, integers of
        # thousands of digits, arrays nested a thousand deep.
        fault = Fault("", None, "not TOML to be read: a value is too large or nested too deep")
        raise SceneError(source, [fault]) from None
    return from_dict(document, source, overrides)


def from_dict(
    mapping: Mapping[str, Any], source: str = "<scene>", overrides: Sequence[str | Override] = ()
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
        raise SceneError(source, [Fault("", None, str(error))]) from None
    faults, given = apply(document, overrides)
    empty = not document
    if source != "<scene>":
        document.setdefault("title", cut(printable(Path(source).stem), 200))
    # Bytes of a command line that are no UTF-8 come as these; no file could be written with them.
    halves = [one for one in _texts(document) if not one[1].isascii() and SURROGATE.search(one[1])]
    if halves:
        allowed = "must be Unicode, without halves of characters"
        broken = [Fault(joined(path), text, allowed) for path, text in halves]
        raise SceneError(source, faults + [_traced(fault, given) for fault in broken])
    scene: Scene | None = None
    try:
        scene = Scene.model_validate(document)
    except ValidationError as error:
        found = faults_of(error, document)
        faulty = {fault.key for fault in found}
        # A table that is only misspelt is not missing.
        tables = [field.alias or name for name, field in Scene.model_fields.items()]
        for key in document.keys() - set(tables):
            faulty.update(_nearest(key, tables))
        found += conflicts(Look(document, DEFAULTS, faulty))
        faults += [_traced(fault, given) for fault in found]
    if scene is None or faults:
        raise SceneError(source, faults, f"The scene is empty. {_STARTER}" if empty else "")
    scene._source = source
    return scene


def need_plain(scene: Scene, allowed: str) -> None:
    """Raise a `SceneError` unless a scene is plain.

    That is: straight surfaces that are always there, a level belt, and one stream of disks of one
    size. `allowed` says what to do with others.
    """
    kind, belt = scene.particle, scene.incoming
    has: list[tuple[str, object, bool]] = [
        ("particle", f"{len(scene.particles)} kinds", len(scene.particles) > 1),
        ("particle.shape", kind.shape, kind.shape != "disk"),
        ("particle.radius", list(kind.span or ()), kind.span is not None),
        ("stream", f"{len(scene.streams)} streams", len(scene.streams) > 1),
        ("conveyor", None, bool(scene.conveyor)),
        ("string", None, bool(scene.string)),
    ]
    if belt is not None:
        has.append(("incoming.incline_deg", belt.incline_deg, belt.incline_deg != 0.0))
    for i, surface in enumerate(scene.surface):
        for name in ("center", "opens_at", "closes_at"):
            value = getattr(surface, name)
            has.append((f"surface[{i}].{name}", value, value is not None))
    if faults := [Fault(key, value, allowed) for key, value, there in has if there]:
        raise SceneError(scene.source, faults)


SURROGATE: Final = re.compile("[\ud800-\udfff]")


def _texts(
    value: object, path: tuple[str | int, ...] = ()
) -> Iterator[tuple[tuple[str | int, ...], str]]:
    """Yield where the texts of a document are, its keys too, and the texts."""
    match value:
        case str():
            yield path, value
        case dict():
            for key, content in value.items():
                yield (*path, key), key
                yield from _texts(content, (*path, key))
        case list():
            for index, item in enumerate(value):
                yield from _texts(item, (*path, index))


def to_dict(scene: Scene) -> dict[str, Any]:
    """Return the keys that were set, nested as in the file: `from_dict` makes the scene again."""
    return as_written(scene)


_POINT: Final = re.compile(r"\[\n\s+([-+\w.]+),\n\s+([-+\w.]+),\n\s*\]")


def to_toml(scene: Scene, comment: str = "") -> str:
    """Return the keys of a scene that were set, as the text of a scene file.

    Its ``[[expect]]`` are left out: they were promised for another scene.

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
    tables = as_written(scene)
    tables.pop("expect", None)
    # tomli-w writes a line for each number of a list; no text holds a line break as it stands.
    text = _POINT.sub(r"[\1, \2]", tomli_w.dumps(tables))
    remark = "".join(f"# {printable(line)}".rstrip() + "\n" for line in comment.splitlines())
    return f"{remark}\n{text}" if remark else text


def plain(value: object, levels: int = _DEEPEST) -> Any:
    """Copy a value as `tomllib` would have made it: of dicts, lists and Python's own numbers.

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
    """Add to a fault which override it came from, if one."""
    for path, typed in given.items():
        if not typed:
            continue
        inside = fault.key == path or fault.key.startswith((path + ".", path + "["))
        if inside or path.startswith(fault.key + "."):
            return Fault(fault.key, fault.value, f"{fault.allowed} (from {typed})")
    return fault


def _read(path: Path) -> str:
    source = str(path)
    try:
        data = first_bytes(path, _LARGEST_FILE)
    except OSError as error:
        reason = error.strerror or str(error)
        raise SceneError(source, [Fault("", None, f"cannot be read: {reason}")]) from None
    if len(data) > _LARGEST_FILE:
        text = f"too large for a scene, which has at most {_LARGEST_FILE} bytes"
        raise SceneError(source, [Fault("", None, text)])
    if b"\0" in data:
        raise SceneError(source, [Fault("", None, "not a text file, so not a scene in TOML")])
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
    return Fault(f"line {line}, column {column}", found, f"not TOML: {reason}")
