"""Scenes from files, texts and mappings: read, override, validate, and say all that is wrong."""

from __future__ import annotations

import re
import tomllib
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

from pydantic import ValidationError

from chutelab.scene import overrides as _overrides
from chutelab.scene.errors import Fault, SceneError
from chutelab.scene.library import find
from chutelab.scene.models import Scene
from chutelab.scene.rules import Look, conflicts
from chutelab.scene.wording import faults_of, misspelt_tables

if TYPE_CHECKING:
    from collections.abc import Sequence

_LARGEST_FILE: Final = 1 << 20
"""Bytes; a scene of a few tables is a thousandth of it, /dev/zero has more."""

_STARTER: Final = "`chutelab new` writes a complete scene to start from."


def load(path: str | Path, overrides: Sequence[str] = ()) -> Scene:
    """Load a scene from a file or, by name, from the shipped ones.

    Parameters
    ----------
    path
        A file, or the name of a shipped scene, with or without ``.toml``.
    overrides
        ``KEY=VALUE`` each, laid over the file; see `chutelab.scene.overrides.apply`.

    Raises
    ------
    SceneError
        With all faults of the file and of the overrides.
    """
    found = find(path)
    return parse(_read(found), str(found), overrides)


def parse(text: str, source: str = "<scene>", overrides: Sequence[str] = ()) -> Scene:
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
    mapping: Mapping[str, Any], source: str = "<scene>", overrides: Sequence[str] = ()
) -> Scene:
    """Validate a scene given as nested mappings, with the keys of the file.

    Raises
    ------
    SceneError
        With all faults.
    """
    document: dict[str, Any] = plain(mapping)
    faults, given = _overrides.apply(document, overrides)
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


def overridden(scene: Scene, overrides: Sequence[str]) -> Scene:
    """Return a scene with overrides laid over it, validated anew.

    Raises
    ------
    SceneError
        If it refuses a value, or two that do not go together.
    """
    return from_dict(to_dict(scene), scene.source, overrides)


def to_dict(scene: Scene) -> dict[str, Any]:
    """Return the keys that were set, nested as in the file: `from_dict` makes the scene again."""
    return scene.model_dump(by_alias=True, exclude_unset=True)


def plain(value: object) -> Any:
    """Copy a mapping as `tomllib` would have made it: of dicts and lists, with texts as keys."""
    match value:
        case Mapping():
            return {str(key): plain(content) for key, content in value.items()}
        case list() | tuple():
            return [plain(item) for item in value]
    return value


def _traced(fault: Fault, given: Mapping[str, str]) -> Fault:
    """Add to a fault which override it came from, if one."""
    for path, typed in given.items():
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
