"""``[live]``: what a scene says of its live page, and whether its keys are there.

Only each key and value by itself is judged. Whether a preset goes together with the rest is for the
page to say, as of everything that is changed there.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from copy import deepcopy
from typing import Any

from pydantic import ValidationError

from chutelab.scene.conflicts import ALWAYS, NO_MACHINE
from chutelab.scene.messages import LISTS, faults_of, unknown
from chutelab.scene.overrides import (
    Override,
    apply,
    at_path,
    joined,
    limits_of,
    parts_of,
    resolved,
    rule_at,
)
from chutelab.scene.schema import TABLES, SceneTables
from chutelab.scene.tables import Live
from chutelab.util.errors import MISSING, Fault, InputError


def live_faults(document: Mapping[str, Any], live: Live) -> Iterator[Fault]:
    """Yield the keys of ``[live]`` that a scene has not, and the values that a key cannot have.

    Parameters
    ----------
    document
        The tables of the scene, which are valid.
    live
        Its table ``[live]``.
    """
    for i, key in enumerate(live.controls or ()):
        if said := _refused(document, key):
            yield Fault(f"live.controls[{i}]", key, said)
        elif resolved(document, key)[0] == "run":
            yield Fault(f"live.controls[{i}]", key, "a page runs without steps, as [run] sets them")
    for key, ends in live.ranges.items():
        if said := _refused(document, key) or _beyond(document, key, ends):
            yield Fault(joined(("live", "ranges", key)), list(ends), said)
    names = [preset.name for preset in live.presets]
    for i, preset in enumerate(live.presets):
        path = f"live.presets[{i}]"
        if preset.name in names[:i]:
            yield Fault(f"{path}.name", preset.name, "must differ from those of other presets")
        refused = {key: said for key in preset.set if (said := _refused(document, key))}
        for key, said in refused.items():
            yield Fault(joined(("live", "presets", i, "set", key)), preset.set[key], said)
        changed = deepcopy({key: table for key, table in document.items() if key != "live"})
        sound = {key: value for key, value in preset.set.items() if key not in refused}
        apply(changed, [Override(key, value) for key, value in sound.items()])
        try:
            SceneTables.validated(changed)
        except ValidationError as error:
            # Nothing of a change that does not go together with the rest.
            for fault in faults_of(error, changed):
                yield Fault(f"{path}.set", None, str(fault))


def live_of(scene: SceneTables, document: Mapping[str, Any]) -> dict[str, Any]:
    """Return ``[live]`` for a page: defaults filled in, and every key by index, not by name.

    Parameters
    ----------
    scene
        The scene.
    document
        Its tables as the page has them. If they measure the drop to the outgoing belt from
        elsewhere than the scene, so do the drops that are returned: the belt is where it was meant.
    """
    live, out = scene.live, scene.outgoing
    lower = 0.0 if out is None else document["outgoing"]["drop"] - out.drop

    def path(key: str) -> str:
        return joined(resolved(document, key))

    def moved(key: str, value: Any) -> Any:
        return value + lower if lower and path(key) == "outgoing.drop" else value

    return {
        "predict": live.predict,
        "controls": None if live.controls is None else [path(key) for key in live.controls],
        "panels": None if live.panels is None else list(live.panels),
        "ranges": {path(k): [moved(k, end) for end in ends] for k, ends in live.ranges.items()},
        "presets": [
            {"name": one.name, "set": {path(k): moved(k, value) for k, value in one.set.items()}}
            for one in live.presets
        ],
    }


def _refused(document: Mapping[str, Any], key: str) -> str:
    """Say why a text is no key of a scene that can be changed; "" if it is one."""
    try:
        parts_of(key)
    except InputError:
        return "no key, such as plate.angle_deg or surface[0].speed"
    try:
        path = resolved(document, key)
    except InputError as error:
        return str(error)
    table = str(path[0])
    if table in NO_MACHINE:
        return f"[{table}] is no part of the machine"
    for depth in range(1, len(path) + 1):
        if rule_at(path[:depth]) is None:
            return unknown(path[:depth])
    if table in TABLES and table not in ALWAYS and table not in document:
        return f"the scene has no [[{table}]]" if table in LISTS else f"the scene has no [{table}]"
    for depth, part in enumerate(path, start=1):
        if isinstance(part, int) and at_path(document, path[:depth]) is MISSING:
            return f"the scene has no {joined(path[:depth])}"
    if table in TABLES and all(isinstance(part, int) for part in path[1:]):
        return "a whole table; name one of its keys"
    return ""


def _beyond(document: Mapping[str, Any], key: str, ends: tuple[float, float]) -> str:
    """Say why a key has no such range; "" if it has."""
    limits = limits_of(rule_at(resolved(document, key)) or {}, ("number", "integer"))
    if limits is None:
        return "it is no number, so it has no range"
    low, high = limits
    return "" if low <= ends[0] and ends[1] <= high else f"it can be from {low:g} to {high:g} only"
