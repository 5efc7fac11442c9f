"""What the varied keys of a scene are: their definitions and units."""

from __future__ import annotations

import json
import re
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Final

from chutelab.scene import MISSING, Scene, SceneError, from_dict, to_dict
from chutelab.scene.overrides import Setting, apply
from chutelab.variation.reading import Vary, VaryError

if TYPE_CHECKING:
    from collections.abc import Sequence

_VARIABLE: Final = ("particle", "incoming", "plate", "outgoing", "surface", "stream", "run")
"""Tables whose numbers change what happens."""


@dataclass(frozen=True)
class Quantity:
    """What a varied key is.

    Attributes
    ----------
    path : str
        The key as messages have it; free surfaces by index.
    label : str
        Its definition, up to the first semicolon or colon; of a free surface, after its name.
    unit : str
        "" for a pure number; "degrees" for angles.
    whole : bool
        Whether it takes whole numbers only.
    """

    path: str
    label: str
    unit: str
    whole: bool = False


def quantity(scene: Scene, vary: Vary) -> Quantity:
    """Return what a varied key of a scene is.

    Raises
    ------
    VaryError
        If the scene knows no such key, or it holds no number.
    """
    # Through JSON, so that there are lists to lay a value into, as in a file.
    document = json.loads(json.dumps(to_dict(scene)))
    faults, given = apply(document, [setting(vary.key, vary.values[0])])
    if faults:
        raise VaryError(vary.typed, faults[0].allowed)
    (path,) = given
    table, _, name = path.partition(".")
    home = Scene if table == path else Scene.tables().get(table.partition("[")[0])
    key = (name or table).partition("[")[0]
    if home is None or key not in {f.alias or n for n, f in home.model_fields.items()}:
        raise VaryError(vary.typed, _unknown(document, path))
    about = home.model_json_schema()["properties"][key]
    indexed = (name or table) != key
    if not (indexed or _numeric(about)) or (home is not Scene and not table.startswith(_VARIABLE)):
        raise VaryError(vary.typed, f"{path} is no number, and only numbers can be varied")
    unit = str(about.get("x-unit") or "")
    if vary.unit not in ("", unit) and (vary.unit, unit) != ("%", ""):
        own = f"is in {unit}" if unit else "is a pure number"
        raise VaryError(vary.typed, f"{path} {own}, not in {vary.unit}; plain numbers will do")
    if indexed:
        return Quantity(path, path, unit)
    label = re.split("[;:]", str(about.get("description", path)))[0].removesuffix(".")
    label = label.removesuffix(f" ({unit})").replace("->", "→")
    if table.startswith("surface["):
        name = document["surface"][int(table[8:-1])].get("name")
        label = f"{name}: {label[0].lower()}{label[1:]}"
    return Quantity(path, label, unit, whole="number" not in _kinds(about))


def _numeric(about: dict[str, Any]) -> bool:
    return bool(_kinds(about) & {"number", "integer"})


def _kinds(about: dict[str, Any]) -> set[Any]:
    return {about.get("type"), *(option.get("type") for option in about.get("anyOf", ()))}


def _unknown(document: dict[str, Any], path: str) -> str:
    """Say what the scene says of a key that it does not know."""
    try:
        from_dict(document)
    except SceneError as error:
        for fault in error.faults:
            if fault.value is not MISSING and path.startswith(fault.key):
                return fault.allowed
    return "unknown key; `chutelab schema` lists all"


def quantities(scene: Scene, varies: Sequence[Vary]) -> tuple[Quantity, ...]:
    """Return what each of the varied keys is.

    Raises
    ------
    VaryError
        If a key cannot be varied, or two are the same.
    """
    found: list[Quantity] = []
    for vary in varies:
        one = quantity(scene, vary)
        if any(one.path == other.path for other in found):
            raise VaryError(vary.typed, f"{one.path} is varied already")
        found.append(one)
    return tuple(found)


def setting(key: str, value: float) -> Setting:
    """Return an override of one key, in digits that give the value back."""
    # A whole number will do for a float, but not the other way round.
    whole = value.is_integer() and abs(value) < 2.0**53
    written = str(int(value)) if whole else repr(value)
    return Setting(f"{key}={written}", f"--vary {key}={written}")
