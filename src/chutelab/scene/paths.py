"""What is at the full path of a key, such as ``plate.angle_deg`` or ``stream.at[0]``."""

from __future__ import annotations

import re
from functools import cache
from typing import TYPE_CHECKING, Any

import numpy as np

from chutelab.scene.editor import schema
from chutelab.scene.errors import MISSING

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from chutelab.scene.models import Scene


def parts_of(path: str) -> list[str | int]:
    """Return the keys and indices of a path.

    >>> parts_of("surface[0].speed")
    ['surface', 0, 'speed']
    """
    return [int(part) if part.isdecimal() else part for part in re.findall(r"[^.\[\]]+", path)]


def value_at(scene: Scene, path: str) -> Any:
    """Return what a scene has at a path, defaults filled in.

    `MISSING` if there is no such thing; an array for a varied key of a family of scenes.
    """
    found: Any = scene
    for part in parts_of(path):
        try:
            found = found[part] if isinstance(part, int) else getattr(found, part)
        except (AttributeError, IndexError, TypeError):
            return MISSING
    return found


def rule_at(parts: Sequence[str | int]) -> Mapping[str, Any] | None:
    """Return what the JSON Schema says of a path; None where it leads nowhere."""
    rule: Mapping[str, Any] | None = _schema()
    for part in parts:
        if rule is None:
            return None
        rule = _referred(rule)
        if isinstance(part, str):
            rule = rule.get("properties", {}).get(part)
        elif part < len(rule.get("prefixItems", [])):
            rule = rule["prefixItems"][part]
        else:
            rule = rule.get("items")
    return None if rule is None else _referred(rule)


def limits_of(rule: Mapping[str, Any]) -> tuple[float, float] | None:
    """Return the least and the largest float that a rule allows; None if it allows none.

    An excluded bound is moved by one float.
    """
    kinds = [kind for kind in rule.get("anyOf", [rule]) if kind.get("type") == "number"]
    if not kinds:
        return None
    limits = kinds[0]
    low, high = limits.get("minimum", -np.inf), limits.get("maximum", np.inf)
    if "exclusiveMinimum" in limits:
        low = np.nextafter(limits["exclusiveMinimum"], np.inf)
    if "exclusiveMaximum" in limits:
        high = np.nextafter(limits["exclusiveMaximum"], -np.inf)
    return float(low), float(high)


@cache
def _schema() -> dict[str, Any]:
    return schema()


def _referred(rule: Mapping[str, Any]) -> Mapping[str, Any]:
    if "$ref" not in rule:
        return rule
    found: Mapping[str, Any] = _schema()["$defs"][rule["$ref"].rpartition("/")[2]]
    return found
