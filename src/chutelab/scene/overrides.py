"""``KEY=VALUE`` texts, as ``--set plate.angle_deg=20`` takes them, laid over a scene's tables."""

from __future__ import annotations

import difflib
import re
import tomllib
from typing import TYPE_CHECKING, Any, Final

from chutelab.scene.errors import Fault, joined

if TYPE_CHECKING:
    from collections.abc import Sequence

_SEGMENT: Final = re.compile(r"([^\s.=\[\]\"']+)((?:\[\d{1,9}\])*)")
_FORM: Final = "must be KEY=VALUE, such as plate.angle_deg=20 or surface[0].speed=1"


class Setting(str):
    """A ``KEY=VALUE`` that an option of its own stands for; `typed` is what messages call it."""

    __slots__ = ("typed",)
    typed: str

    def __new__(cls, override: str, typed: str) -> Setting:
        """Keep what was typed beside the text."""
        setting = super().__new__(cls, override)
        setting.typed = typed
        return setting


class _RefusedError(Exception):
    """Why an override cannot be laid over the scene."""


def apply(document: dict[str, Any], overrides: Sequence[str]) -> tuple[list[Fault], dict[str, str]]:
    """Lay overrides over a scene's tables, in place and in order; the last one wins.

    Parameters
    ----------
    document
        The tables of a scene, as `tomllib` reads them.
    overrides
        ``KEY=VALUE`` each. KEY is a full path; a free surface goes by index or by name,
        ``surface[0].speed`` or ``surface.hood.speed``. VALUE is a TOML value, or else taken as a
        string as it stands. A missing table is made.

    Returns
    -------
    faults, given
        Overrides that could not be laid over, and what was typed for each of the others by the full
        path that it set.
    """
    faults: list[Fault] = []
    given: dict[str, str] = {}
    for override in overrides:
        typed = override.typed if isinstance(override, Setting) else f"--set {override}"
        key, equals, text = override.partition("=")
        try:
            path = _resolve(document, _split(key.strip() if equals else ""))
            _put(document, path, value_of(text))
        except _RefusedError as refusal:
            faults.append(Fault(typed, None, str(refusal)))
        else:
            given[joined(path)] = typed
    return faults, given


def value_of(text: str) -> object:
    """Read a TOML value; what is none stands for itself, as a string.

    >>> value_of("0.5"), value_of("[0, 1]"), value_of("adhesion")
    (0.5, [0, 1], 'adhesion')
    """
    try:
        read = tomllib.loads(f"value = {text}")
    except (ValueError, RecursionError):
        return text.strip()
    # A line break in the text could smuggle in further keys.
    return read["value"] if set(read) == {"value"} else text.strip()


def _split(key: str) -> list[str | int]:
    path: list[str | int] = []
    for segment in key.split("."):
        match = _SEGMENT.fullmatch(segment)
        if match is None:
            raise _RefusedError(_FORM)
        path.append(match[1])
        path += [int(index) for index in re.findall(r"\d+", match[2])]
    return path


def _resolve(document: dict[str, Any], path: list[str | int]) -> list[str | int]:
    """Turn the name of a free surface into its index."""
    surfaces = document.get("surface")
    if path[0] != "surface" or len(path) < 2 or isinstance(path[1], int):
        return path
    if not isinstance(surfaces, list):
        raise _RefusedError("the scene has no [[surface]]")
    names = [s.get("name") if isinstance(s, dict) else None for s in surfaces]
    if path[1] not in names:
        known = [name for name in names if isinstance(name, str)]
        near = difflib.get_close_matches(path[1], known, n=1)
        hint = f"did you mean surface.{near[0]}?" if near else f"there are: {', '.join(known)}"
        raise _RefusedError(f"no surface has the name {path[1]}; {hint}")
    return ["surface", names.index(path[1]), *path[2:]]


def _put(document: dict[str, Any], path: list[str | int], value: object) -> None:
    place: Any = document
    for depth, part in enumerate(path):
        last = depth == len(path) - 1
        if isinstance(part, int):
            if not isinstance(place, list):
                raise _RefusedError(f"{joined(path[:depth])} is no list")
            if part >= len(place):
                raise _RefusedError(f"{joined(path[:depth])} has {len(place)} entries, from [0]")
        elif not isinstance(place, dict):
            raise _RefusedError(f"{joined(path[:depth])} is no table")
        elif not last and part not in place:
            if isinstance(path[depth + 1], int):
                raise _RefusedError(f"{joined(path[: depth + 1])} is not there; give it whole")
            place[part] = {}
        if last:
            place[part] = value
        else:
            place = place[part]
