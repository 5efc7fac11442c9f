"""What can be fitted: the numbers of a scene, and how the measured points lie in the world.

Units and bounds are those of the scene's own validation, read from its JSON Schema.
"""

from __future__ import annotations

import difflib
import re
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from chutelab.measured.track import MeasuredError
from chutelab.scene import MISSING, Fault, from_dict, schema, to_dict

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping, Sequence

    from chutelab.measured.track import Track
    from chutelab.scene import Scene

PLACEMENT: Final = {
    "t0": ("s", -np.inf, np.inf),
    "scale": ("m per unit", 0.0, np.inf),
    "origin.x": ("file units", -np.inf, np.inf),
    "origin.y": ("file units", -np.inf, np.inf),
}
"""What can be fitted of a track's `Placement`: unit and bounds."""


@dataclass(frozen=True)
class Parameter:
    """A number that a fit may change.

    Attributes
    ----------
    key, unit : str
        Its full path in the scene, or one of `PLACEMENT`; "" for the unit of a pure number.
    start : float
        Its value in the scene or the placement.
    low, high : float
        The least and the largest value that are allowed.
    """

    key: str
    unit: str
    start: float
    low: float
    high: float

    @property
    def size(self) -> float:
        """By how much it may be expected to change: its own size, but not next to nothing."""
        return max(abs(self.start), 0.1)


def resolve(scene: Scene, track: Track, keys: Sequence[str]) -> tuple[Parameter, ...]:
    """Return the parameters that keys name.

    Raises
    ------
    MeasuredError
        With all keys that are unknown, no number, without a value to start from, or given twice.
    """
    document = scene.model_dump(by_alias=True)
    described = schema()
    faults: list[Fault] = []
    found: list[Parameter] = []
    if not keys:
        faults.append(Fault("fit", None, "name at least one key, such as plate.restitution"))
    for key in keys:
        known = _placed(track, key) if key in PLACEMENT else _of_scene(document, described, key)
        if isinstance(known, str):
            faults.append(Fault(f"fit {key}", None, known))
        elif any(known.key == other.key for other in found):
            faults.append(Fault(f"fit {key}", None, "given twice"))
        else:
            found.append(known)
    if faults:
        raise MeasuredError(scene.source, faults)
    return tuple(found)


def changed(
    scene: Scene, track: Track, parameters: Sequence[Parameter], values: Sequence[float]
) -> tuple[Scene, Track]:
    """Return scene and track with the values of some parameters changed.

    Raises
    ------
    SceneError
        If the scene refuses a value, or two that do not go together.
    """
    overrides = []
    origin = list(track.placement.origin)
    placement: dict[str, Any] = {}
    for parameter, value in zip(parameters, (float(value) for value in values), strict=True):
        match parameter.key:
            case "origin.x":
                origin[0] = value
            case "origin.y":
                origin[1] = value
            case "t0" | "scale":
                placement[parameter.key] = value
            case key:
                overrides.append(f"{key}={value!r}")
    if overrides:
        scene = from_dict(to_dict(scene), scene.source, overrides)
    return scene, track.placed(origin=(origin[0], origin[1]), **placement)


def _placed(track: Track, key: str) -> Parameter:
    unit, low, high = PLACEMENT[key]
    placement = track.placement
    start = {
        "t0": placement.t0,
        "scale": placement.scale,
        "origin.x": placement.origin[0],
        "origin.y": placement.origin[1],
    }[key]
    return Parameter(key, unit, start, low, high)


def _of_scene(
    document: Mapping[str, Any], described: Mapping[str, Any], key: str
) -> Parameter | str:
    """Return the parameter of a key of the scene, or why there is none."""
    parts = _parts(document, key)
    rule = _rule(described, parts)
    head = str(parts[0]) if parts else ""
    if rule is None:
        return _unknown(document, described, key)
    if document.get(head) in (None, ()):
        return f"the scene has no [{head}]"
    value: Any = document
    for part in parts:
        try:
            value = value[part]
        except (LookupError, TypeError):
            value = MISSING
            break
    path = re.sub(r"\.(\d+)", r"[\1]", ".".join(map(str, parts)))
    kinds = [option for option in rule.get("anyOf", [rule]) if option.get("type") == "number"]
    if value is None or value is MISSING:
        if not kinds:
            return "not a number"
        return f"has no value in this scene; give one to start from, --set {path}=..."
    if not kinds or isinstance(value, (str, bool)):
        return f"{_said(value)} is not a number that can vary continuously"
    (limits,) = kinds
    # least_squares keeps off its bounds by no margin: an excluded bound is moved by one float.
    low, high = limits.get("minimum", -np.inf), limits.get("maximum", np.inf)
    if "exclusiveMinimum" in limits:
        low = np.nextafter(limits["exclusiveMinimum"], np.inf)
    if "exclusiveMaximum" in limits:
        high = np.nextafter(limits["exclusiveMaximum"], -np.inf)
    return Parameter(path, rule.get("x-unit", ""), float(value), float(low), float(high))


def _said(value: Any) -> str:
    from chutelab.scene import shown

    return shown(value)


def _parts(document: Mapping[str, Any], key: str) -> list[str | int]:
    """Split ``surface.hood.speed`` or ``stream.at[0]`` into keys and indices."""
    parts: list[str | int] = [
        int(part) if part.isdecimal() else part
        for part in re.sub(r"\[(\d{1,9})\]", r".\1", key).split(".")
    ]
    if len(parts) > 1 and parts[0] == "surface":
        names = [surface["name"] for surface in document["surface"]]
        if parts[1] in names:
            parts[1] = names.index(parts[1])
    return parts


def _rule(described: Mapping[str, Any], parts: Sequence[str | int]) -> Mapping[str, Any] | None:
    """Follow a path through the JSON Schema; None where it leads nowhere."""
    rule: Mapping[str, Any] | None = described
    for part in parts:
        if rule is None:
            return None
        rule = _referred(described, rule)
        if isinstance(part, str):
            rule = rule.get("properties", {}).get(part)
        elif part < len(rule.get("prefixItems", [])):
            rule = rule["prefixItems"][part]
        else:
            rule = rule.get("items")
    return None if rule is None else _referred(described, rule)


def _referred(described: Mapping[str, Any], rule: Mapping[str, Any]) -> Mapping[str, Any]:
    if "$ref" in rule:
        found: Mapping[str, Any] = described["$defs"][rule["$ref"].rpartition("/")[2]]
        return found
    return rule


def _unknown(document: Mapping[str, Any], described: Mapping[str, Any], key: str) -> str:
    known = [*numbers(document, described), *PLACEMENT]
    near = difflib.get_close_matches(key, known, n=3, cutoff=0.6)
    if not near:
        near = [name for name in known if name.rpartition(".")[2] == key.rpartition(".")[2]]
    advice = f"did you mean {' or '.join(near)}?" if near else f"known are {', '.join(known)}"
    return f"unknown key; {advice}"


def numbers(document: Mapping[str, Any], described: Mapping[str, Any]) -> Iterator[str]:
    """Yield the keys of a scene's tables whose values are numbers that can be fitted."""
    for head, table in document.items():
        entries = {head: table}
        if isinstance(table, dict):
            entries = {f"{head}.{name}": value for name, value in table.items()}
        elif head == "surface":
            entries = {
                f"surface.{surface['name']}.{name}": value
                for surface in table
                for name, value in surface.items()
            }
        for key, value in entries.items():
            if isinstance(value, float) and _rule(described, _parts(document, key)):
                yield key
