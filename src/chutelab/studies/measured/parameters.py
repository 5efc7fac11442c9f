"""What can be fitted: the numbers of a scene, and how the measured points lie in the world.

Units and bounds are those of the scene's own validation, read from its JSON Schema.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass
from typing import Any, Final

from chutelab.scene import MISSING, Fault, Scene, shown, to_dict
from chutelab.scene.overrides import at_path, joined, limits_of, names_of, resolved, rule_at
from chutelab.studies.measured.track import LARGEST, MeasuredError, Track
from chutelab.util.errors import did_you_mean

SMALLEST: Final = 1e-6
"""Of its start: the least value at which a number that must be positive is searched. A fit of what
the points do not tell is driven to a bound by rounding, and next to 0 a length has no direction."""


@dataclass(frozen=True)
class Parameter:
    """A number that a fit may change.

    Attributes
    ----------
    key, unit : str
        What it is called: a full path in the scene as it was given, or a key of `placements`; ""
        for the unit of a pure number.
    start : float
        Its value in the scene or the placement.
    low, high : float
        The least and the largest value that are searched: those that are allowed, but not below
        `SMALLEST` of the start where 0 is not.
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


def placements(track: Track) -> dict[str, Parameter]:
    """Return what can be fitted of a track's `Placement`."""
    place, anything = track.placement, (-LARGEST, LARGEST)
    found = (
        Parameter("t0", "s", place.t0, *anything),
        Parameter("scale", "m per unit", place.scale, SMALLEST * place.scale, LARGEST),
        Parameter("origin.x", "file units", place.origin[0], *anything),
        Parameter("origin.y", "file units", place.origin[1], *anything),
    )
    return {one.key: one for one in found}


def resolve(scene: Scene, track: Track, keys: Sequence[str]) -> tuple[Parameter, ...]:
    """Return the parameters that keys name.

    Raises
    ------
    MeasuredError
        With all keys that are unknown, no number, without a value to start from, or given twice.
    """
    document, placed = to_dict(scene, defaults=True), placements(track)
    faults: list[Fault] = []
    found: list[Parameter] = []
    if not keys:
        faults.append(Fault("fit", None, "name at least one key, such as plate.restitution"))
    for key in keys:
        known = placed.get(key) or _of_scene(document, key, placed)
        if isinstance(known, str):
            faults.append(Fault(f"fit {key}", None, known))
        elif any(resolved(document, key) == resolved(document, one.key) for one in found):
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
    given = {one.key: float(value) for one, value in zip(parameters, values, strict=True)}
    place = {key: given.pop(key, one.start) for key, one in placements(track).items()}
    origin = place["origin.x"], place["origin.y"]
    moved = track.placed(t0=place["t0"], scale=place["scale"], origin=origin)
    return scene.with_values(given) if given else scene, moved


def _of_scene(document: Mapping[str, Any], key: str, others: Iterable[str]) -> Parameter | str:
    """Return the parameter of a key of the scene, or why there is none, with other known keys."""
    rule = None
    with suppress(ValueError):
        parts = resolved(document, key)
        rule = rule_at(parts)
    if rule is None:
        known = [*numbers(document), *others]
        last = key.rpartition(".")[2]
        near = [name for name in known if name.rpartition(".")[2] == last]
        advice = f"did you mean {' or '.join(near)}?" if near else f"known are {', '.join(known)}"
        return f"unknown key; {did_you_mean(key, known, advice, most=3)}"
    head = str(parts[0])
    if document.get(head) in (None, ()):
        return f"the scene has no [{head}]"
    value: Any = at_path(document, parts)
    path, limits = joined(parts), limits_of(rule)
    if value is None or value is MISSING:
        if limits is None:
            return "not a number"
        return f"has no value in this scene; give one to start from, --set {path}=..."
    if limits is None or isinstance(value, (str, bool)):
        return f"{shown(value)} is not a number that can vary continuously"
    low, high = limits
    low = max(low, SMALLEST * value) if low > 0.0 else low
    return Parameter(key, rule.get("x-unit", ""), float(value), low, high)


def numbers(document: Mapping[str, Any]) -> Iterator[str]:
    """Yield the keys of a scene's tables whose values are numbers that can be fitted."""
    tables = {"": document}
    tables |= {f"{head}.": table for head, table in document.items() if isinstance(table, dict)}
    for head, names in names_of(document).items():
        tables |= {f"{head}.{n}.": row for n, row in zip(names, document[head], strict=True)}
    for head, table in tables.items():
        yield from (f"{head}{key}" for key, value in table.items() if isinstance(value, float))
