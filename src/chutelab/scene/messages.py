"""Faults of a scene in words: Pydantic's errors, and invalid keys of ``[live]``.

A fault has the key's full path, and what is allowed. In ``[live]`` each key and value is checked
only by itself; the page checks whether a preset fits the rest, as for every change there.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from copy import deepcopy
from typing import Any, Final

from pydantic import ValidationError

from chutelab.scene.conflicts import ConflictError
from chutelab.scene.look import ALWAYS, EITHER, NO_MACHINE
from chutelab.scene.overrides import (
    Override,
    apply,
    at_path,
    joined,
    limits_of,
    parts_of,
    resolved,
    rule_at,
    unit_of,
)
from chutelab.scene.schema import TABLES, SceneTables
from chutelab.scene.tables import Live
from chutelab.scene.units import read_any, units_of
from chutelab.util.errors import MISSING, Fault, InputError, nearest

Location = tuple[str | int, ...]
"""Path of keys and indices, as Pydantic gives it."""

LISTS: Final = (
    "material", "pair", "conveyor", "surface", "string", "rod", "spring", "pin", "sensor", "expect",
)  # fmt: skip
"""Tables that are always lists; those in `EITHER` may also be single."""

_WORDS: Final = {
    "number": "a number",
    "integer": "a whole number",
    "boolean": "true or false",
    "string": "a string",
}
_SIGNS: Final = {"minimum": ">=", "exclusiveMinimum": ">", "maximum": "<=", "exclusiveMaximum": "<"}


def faults_of(error: ValidationError, document: Mapping[str, Any]) -> list[Fault]:
    """Return every error of a validation in words, one fault per key, in the order of the models.

    Conflicts between keys are left out: `scene.conflicts` finds them, also if validation did not
    get that far.
    """
    faults: dict[Location, Fault] = {}
    for detail in error.errors(include_url=False):
        cause = detail.get("ctx", {}).get("error")
        if isinstance(cause, ConflictError):
            continue
        parts, missing, unit = detail["loc"], detail["type"] == "missing", ""
        if parts[0] in EITHER and isinstance(document.get(str(parts[0])), Mapping):
            parts = (parts[0], *parts[2:])
        if detail["type"] == "extra_forbidden":
            text = unknown(parts)
        else:
            if missing and isinstance(parts[-1], int):
                # A point with one coordinate: show the given value, not the missing one.
                parts, missing = parts[:-1], False
            # The location of a union's error ends with the name of the member that refused.
            while (rule := rule_at(parts)) is None:
                parts = parts[:-1]
            unit = unit_of(parts)
            allowed = _listed(_phrases(rule)) + (f", in {unit}" if unit else "")
            text = str(cause) if cause else allowed if missing else f"must be {allowed}"
        value = MISSING if missing else at_path(document, parts)
        if isinstance(value, str) and unit and read_any(value)[1] not in ("", unit):
            text += f"; units are {', '.join(units_of(unit))}"
        if value is MISSING and not missing:
            # For keys that were given as nested tables.
            value = detail["input"]
        if len(parts) == 1 and parts[0] in LISTS and isinstance(value, Mapping):
            text = f"head it [[{parts[0]}]], with two brackets each: there may be several"
        faults.setdefault(parts, Fault(joined(parts), value, text))
    # Pydantic also calls a list too short if it refused its entries.
    broken_lists = {
        parts[:depth]
        for parts in faults
        for depth in range(1, len(parts))
        if all(isinstance(part, int) for part in parts[depth:])
    }
    broken_lists |= {parts[:1] for parts in faults if len(parts) > 1 and parts[0] in EITHER}
    return [fault for parts, fault in faults.items() if parts not in broken_lists]


def _phrases(rule: Mapping[str, Any]) -> list[str]:
    """Describe a rule of the JSON Schema in words: a phrase for each alternative."""
    if "anyOf" in rule:
        return [phrase for choice in rule["anyOf"] for phrase in _phrases(choice)]
    if "x-words" in rule:
        return [str(rule["x-words"])]
    if "$ref" in rule or rule.get("type") == "object":
        return ["a table of keys and values"]
    if "enum" in rule or "const" in rule:
        return [f'"{choice}"' for choice in rule.get("enum", [rule.get("const")])]
    if rule["type"] != "array":
        least = rule.get("not", {}).get("exclusiveMaximum")
        if least is not None:
            return [_WORDS[rule["type"]] + _range({**rule, "minimum": least}), "0"]
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


def unknown(parts: Sequence[str | int]) -> str:
    """Report that a key is unknown, and which one was probably meant."""
    *above, last = parts
    key, known = str(last), _keys(above)
    homes = [
        f"[[{name}]]" if name in LISTS else f"[{name}]"
        for name in SceneTables.tables()
        if key in _keys([name, 0] if name in LISTS else [name])
    ]
    if not homes and (near := nearest(key, known)):
        return f"unknown key; did you mean {joined((*above, *near))}?"
    if homes:
        return f"unknown key here; it belongs in {_listed(homes)}"
    return f"unknown key; known here are {', '.join(known)}"


def _keys(table: Sequence[str | int]) -> list[str]:
    rule = rule_at(table)
    rule = rule["anyOf"][0] if rule and "anyOf" in rule else rule
    rule = rule_at([*table, 0]) if rule and "$ref" in rule else rule
    return list(rule["properties"]) if rule else []


def live_faults(document: Mapping[str, Any], live: Live) -> Iterator[Fault]:
    """Yield keys of ``[live]`` that the scene lacks, and values that a key cannot have.

    `document` is the scene's tables, which are valid.
    """
    for i, key in enumerate(live.controls or ()):
        if said := _refused(document, key):
            yield Fault(f"live.controls[{i}]", key, said)
        elif resolved(document, key)[0] == "run":
            yield Fault(f"live.controls[{i}]", key, "a page runs without steps, as [run] sets them")
    for key, ends in live.ranges.items():
        said = _refused(document, key)
        if not said:
            rule = rule_at(resolved(document, key)) or {}
            if (limits := limits_of(rule, ("number", "integer"))) is None:
                said = "it is no number, so it has no range"
            elif not limits[0] <= ends[0] < ends[1] <= limits[1]:
                said = "it can be from {:g} to {:g} only".format(*limits)
        if said:
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
            # Whether the change fits the rest is not checked.
            for fault in faults_of(error, changed):
                yield Fault(f"{path}.set", None, str(fault))


def live_of(scene: SceneTables, document: Mapping[str, Any]) -> dict[str, Any]:
    """Return ``[live]`` for a page: defaults filled in, and every key by index, not by name.

    `document` is the scene's tables as the page has them. If they measure the drop to the outgoing
    belt from another place than the scene, the drops are converted, so that the belt is where it
    was meant.
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
    """Return why a text is not a changeable key of a scene; "" if it is one."""
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
