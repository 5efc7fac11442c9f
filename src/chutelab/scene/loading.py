"""Scenes from files, texts, mappings and by name: read, override, validate, say what is wrong.

Pydantic's errors are told as faults: the key's full path, and what is allowed in words.
"""

from __future__ import annotations

import difflib
import re
import tomllib
import types
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any, Final, Literal, Union, get_args, get_origin

import tomli_w
from annotated_types import Ge, Gt, Le, Lt, MaxLen
from pydantic import ValidationError
from pydantic.fields import FieldInfo

from chutelab.scene.overrides import Override, apply, at_path, joined
from chutelab.scene.rules import ConflictError, Look, conflicts
from chutelab.scene.schema import Scene
from chutelab.scene.units import MOST_POINTS, Point, Table
from chutelab.util.errors import MISSING, Fault, InputError, did_you_mean

_TITLE: Final = re.compile(r"""^title\s*=\s*["'](.*?)["']\s*(?:#.*)?$""", re.MULTILINE)


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
    """Return the files of the shipped scenes by name, in alphabetical order."""
    folder = _folder()
    found = {path.stem: path for path in folder.glob("*.toml")} if folder else {}
    return dict(sorted(found.items()))


def about() -> list[About]:
    """Describe the shipped scenes by their titles and the comments they begin with."""
    return [_about(name, path) for name, path in shipped().items()]


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


def _about(name: str, path: Path) -> About:
    text = path.read_text(encoding="utf-8")
    title = _TITLE.search(text)
    look = []
    for line in text.splitlines():
        if not line.startswith("#"):
            break
        if not line.startswith("#:"):
            look.append(line.lstrip("# "))
    return About(name, title[1] if title else name, tuple(look), path)


def _folder() -> Path | None:
    """Find the folder of shipped scenes: in the package or, in a checkout, beside ``src``."""
    # Imported here: a scene given as text or mapping needs no files.
    from importlib.resources import files

    package = Path(str(files("chutelab.scene"))).parent
    packaged = package / "data" / "scenes"
    checkout = package.parent.parent
    if packaged.is_dir():
        return packaged
    if (checkout / "pyproject.toml").is_file() and (checkout / "scenes").is_dir():
        return checkout / "scenes"
    return None


Location = tuple[str | int, ...]
"""Path of keys and indices, as Pydantic gives it."""

_NEAR: Final = 0.55
"""Likeness of a misspelt key and the one that was meant: pivot is taken for pivot_height."""

LISTS: Final = ("surface", "expect")
"""Tables of which there may be several."""

_WORDS: Final[dict[Any, str]] = {
    float: "a number",
    int: "a whole number",
    bool: "true or false",
    str: "a string",
}


def faults_of(error: ValidationError, document: Mapping[str, Any]) -> list[Fault]:
    """Say every error of a validation in words, one fault a key, in the order of the models' keys.

    Conflicts between keys are left out: `chutelab.scene.rules` finds them, also in a scene whose
    validation never came to them.
    """
    faults: dict[Location, Fault] = {}
    for detail in error.errors(include_url=False):
        cause = detail.get("ctx", {}).get("error")
        if isinstance(cause, ConflictError):
            continue
        parts, missing = detail["loc"], detail["type"] == "missing"
        if detail["type"] == "extra_forbidden":
            text = _unknown(parts)
        else:
            if missing and isinstance(parts[-1], int):
                # A point with one coordinate: show what is there, not what is not.
                parts, missing = parts[:-1], False
            # The location of a union's error ends with the name of the member that refused.
            parts, allowed = _allowed(parts)
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
    return [fault for parts, fault in faults.items() if parts not in broken_lists]


def misspelt_tables(document: Mapping[str, Any]) -> Iterator[str]:
    """Yield the tables that an unknown top-level key was probably meant to be."""
    for key in document:
        if key not in Scene.model_fields:
            yield from _nearest(key, Scene.model_fields)


def _keys(table: type[Table] | type[Scene]) -> dict[str, FieldInfo]:
    return {field.alias or name: field for name, field in table.model_fields.items()}


def _allowed(parts: Location) -> tuple[Location, str]:
    """Say what is allowed at a location, and cut off what follows the last key or index."""
    head = str(parts[0])
    table = Scene.tables().get(head)
    field, depth = Scene.model_fields[head], 1
    annotation, metadata = field.annotation, field.metadata
    if head in LISTS and len(parts) > 1:
        annotation, metadata, depth = table, [], 2
    if table is not None and len(parts) > depth:
        field = _keys(table)[str(parts[depth])]
        annotation, metadata, depth = field.annotation, field.metadata, depth + 1
    while depth < len(parts) and isinstance(parts[depth], int):
        annotation, metadata, depth = _item(annotation), [], depth + 1
    extra = field.json_schema_extra
    unit = f", in {extra['x-unit']}" if isinstance(extra, dict) else ""
    return parts[:depth], _listed(_phrases(annotation, metadata)) + unit


def _item(annotation: Any) -> Any:
    """Return the type of the entries of a tuple, optional or not."""
    if get_origin(annotation) is tuple:
        return get_args(annotation)[0]
    return _item(get_args(annotation)[0])


def _phrases(annotation: Any, metadata: Iterable[Any] = ()) -> list[str]:
    """Say a type with its limits in words: a phrase for each alternative."""
    origin, arguments = get_origin(annotation), get_args(annotation)
    if origin is Annotated:
        return _phrases(arguments[0], [*_flat(arguments[1:]), *metadata])
    if origin in (Union, types.UnionType):
        members = [member for member in arguments if member is not types.NoneType]
        return [phrase for member in members for phrase in _phrases(member, metadata)]
    if origin is Literal:
        return [f'"{choice}"' for choice in arguments]
    if annotation == Point:
        return ["a point [x, y] of two numbers"]
    if annotation == tuple[Point, ...]:
        return [f"a list of 2 to {MOST_POINTS} points [[x, y], ...]"]
    if origin is tuple:
        (most,) = (limit.max_length for limit in metadata if isinstance(limit, MaxLen))
        return [f"at most {most} tables, each headed by [[{arguments[0].__name__.lower()}]]"]
    if isinstance(annotation, type) and issubclass(annotation, Table):
        return ["a table of keys and values"]
    return [_WORDS[annotation] + _range(metadata)]


def _flat(metadata: Iterable[Any]) -> Iterator[Any]:
    # A Field inside Annotated carries its limits one level down.
    for item in metadata:
        if isinstance(item, FieldInfo):
            yield from item.metadata
        else:
            yield item


def _range(metadata: Iterable[Any]) -> str:
    lower, upper = "", ""
    for limit in metadata:
        match limit:
            case Ge(ge=bound):
                lower = f">= {_bound(bound)}"
            case Gt(gt=bound):
                lower = f"> {_bound(bound)}"
            case Le(le=bound):
                upper = f"<= {_bound(bound)}"
            case Lt(lt=bound):
                upper = f"< {_bound(bound)}"
            case MaxLen(max_length=bound):
                upper = f"of at most {bound} characters"
    if lower.startswith(">= ") and upper.startswith("<= "):
        return f" from {lower[3:]} to {upper[3:]}"
    limits = " and ".join(part for part in (lower, upper) if part)
    return f" {limits}" if limits else ""


def _bound(value: Any) -> str:
    return f"{value:g}" if isinstance(value, float) and abs(value) < 1e6 else str(int(value))


def _listed(choices: Iterable[str]) -> str:
    *first, last = choices
    return f"{', '.join(first)} or {last}" if first else last


def _nearest(key: str, known: Iterable[str]) -> list[str]:
    return difflib.get_close_matches(key, list(known), n=1, cutoff=_NEAR)


def _unknown(parts: Location) -> str:
    """Say that a key is unknown, and which one was probably meant."""
    *above, last = parts
    key = str(last)
    table = Scene.tables()[str(above[0])] if above else Scene
    known = _keys(table)
    if near := _nearest(key, known):
        return f"unknown key; did you mean {joined((*above, *near))}?"
    homes = [
        f"[[{name}]]" if name in LISTS else f"[{name}]"
        for name, other in Scene.tables().items()
        if key in _keys(other)
    ]
    if homes:
        return f"unknown key here; it belongs in {_listed(homes)}"
    return f"unknown key; known here are {', '.join(known)}"


_LARGEST_FILE: Final = 1 << 20
"""Bytes; a scene of a few tables is a thousandth of it, /dev/zero has more."""

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
    document: dict[str, Any] = plain(mapping)
    faults, given = apply(document, overrides)
    empty = not document
    if source != "<scene>":
        document.setdefault("title", Path(source).stem)
    scene: Scene | None = None
    try:
        scene = Scene.model_validate(document)
    except ValidationError as error:
        found = faults_of(error, document)
        faulty = {fault.key for fault in found} | set(misspelt_tables(document))
        found += conflicts(Look(document, Scene, faulty))
        faults += [_traced(fault, given) for fault in found]
    if scene is None or faults:
        raise SceneError(source, faults, f"The scene is empty. {_STARTER}" if empty else "")
    scene._source = source
    return scene


def to_dict(scene: Scene) -> dict[str, Any]:
    """Return the keys that were set, nested as in the file: `from_dict` makes the scene again."""
    return scene.model_dump(by_alias=True, exclude_unset=True)


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
    tables = scene.model_dump(
        by_alias=True, exclude_unset=True, exclude_none=True, exclude={"expect"}
    )
    # tomli-w writes a line for each number of a list; no text holds a line break as it stands.
    text = _POINT.sub(r"[\1, \2]", tomli_w.dumps(tables))
    remark = "".join(f"# {line}".rstrip() + "\n" for line in comment.splitlines())
    return f"{remark}\n{text}" if remark else text


def plain(value: object) -> Any:
    """Copy a value as `tomllib` would have made it: of dicts, lists and Python's own numbers."""
    match value:
        case Mapping():
            return {str(key): plain(content) for key, content in value.items()}
        case list() | tuple():
            return [plain(item) for item in value]
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
        with path.open("rb") as file:
            data = file.read(_LARGEST_FILE + 1)
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
