"""What a page is told of its scene and of scene files: `describe`."""

from __future__ import annotations

from typing import Any, Final

from chutelab.machine import build
from chutelab.scene import Fault, Scene, SceneError, to_dict
from chutelab.scene.conflicts import EITHER
from chutelab.scene.materials import PRESETS, VALUES
from chutelab.scene.overrides import limits_of, rule_at
from chutelab.scene.units import LARGEST, SHORTEST

MOST: Final = 100_000
"""Particles that a page has room for: it keeps their tracks, and draws them in each frame."""

LISTS: Final = ("material", "pair", "conveyor", "surface")


def describe(scene: Scene) -> dict[str, Any]:
    """Return a scene of disks and spheres and the rules of scene files as plain data for JSON.

    A drop that is measured from the impact is written as one from the top of the pulley: the
    outgoing belt stays where it is while the plate is turned.

    ``scene`` has its keys as its file has them, with a seed beyond 2**53 as text. ``tables`` has of
    each key of each table (those outside of tables under ``scene``) default, unit, low and high,
    its form as JSON Schema, and whether it is required. ``presets``: the numbers of each material.
    Raises a `SceneError` if the page cannot show it: mass points, boxes, polygons, strings, or too
    many particles; or if the scene contradicts itself where it is laid out.
    """
    allowed = "a page that answers shows disks and spheres"
    faults = []
    for n, kind in enumerate(scene.particles):
        table = scene.head("particle", n)
        if kind.outline:
            faults.append(Fault(f"{table}.shape", kind.shape, allowed))
        elif kind.radius == 0.0:
            faults.append(Fault(f"{table}.radius", 0.0, f"more than 0; {allowed}"))
    if scene.count > MOST:
        counts = [stream.count for stream in scene.streams]
        table = scene.head("stream", counts.index(max(counts)))
        text = f"a page has room for {MOST} particles, and these are {scene.count}"
        faults.append(Fault(f"{table}.count", max(counts), text))
    if scene.string:
        faults.append(Fault("string", None, f"{allowed}, without strings"))
    if faults:
        raise SceneError(scene.source, faults)
    tables = to_dict(scene)
    machine, out = build(scene), scene.outgoing
    if out is not None and out.drop_from == "impact":
        height = machine.segments.start[machine.segments.surface == machine.landing][0, 1].item()
        assert scene.incoming is not None
        drop = scene.incoming.pulley_radius - height
        if not SHORTEST <= drop <= LARGEST:
            allowed = (
                "more: a page measures the drop from the top of the pulley, and must find the belt"
                f" below that; it would be {drop:.4g} m"
            )
            raise SceneError(scene.source, [Fault("outgoing.drop", out.drop, allowed)])
        tables["outgoing"] = {**tables["outgoing"], "drop": drop, "drop_from": "top"}
    tables.pop("expect", None)
    for key in EITHER:
        rows = tables.get(key, ())
        for row in (rows,) if isinstance(rows, dict) else rows:
            # JavaScript's numbers have all digits of whole numbers up to here.
            if row.get("seed", 0) > 2**53:
                row["seed"] = str(row["seed"])
    materials = {
        name: {key: getattr(preset.material, key) for key in VALUES}
        for name, preset in PRESETS.items()
    }
    return {"scene": tables, "tables": _rules(), "presets": materials}


def _rules() -> dict[str, dict[str, dict[str, Any]]]:
    """Return default, unit and range of each key, by tables."""
    rules: dict[str, dict[str, dict[str, Any]]] = {"scene": {}}
    for name, field in Scene.model_fields.items():
        key = field.alias or name
        if key in Scene.tables():
            continue
        rules["scene"][key] = _rule([key])
    for table, model in Scene.tables().items():
        if table in ("string", "expect"):
            continue
        several = table in LISTS or table in EITHER
        rules[table] = {}
        for name, field in model.model_fields.items():
            key = field.alias or name
            rule = _rule([table, 0, key] if several else [table, key])
            if field.is_required():
                rule["required"] = True
            if table == "particle" and key in ("size", "points"):
                continue
            rules[table][key] = rule
    # Mass points, boxes and polygons are for other engines.
    particle = rules["particle"]
    particle["shape"]["form"] = {"enum": ["disk", "sphere"]}
    particle["radius"]["low"] = SHORTEST
    number, span = particle["radius"]["form"]["anyOf"]
    number = {"type": number["type"], "minimum": SHORTEST, "maximum": number["maximum"]}
    particle["radius"]["form"] = {"anyOf": [number, span]}
    count = rules["stream"]["count"]
    count["high"] = count["form"]["maximum"] = MOST
    return rules


def _rule(path: list[str | int]) -> dict[str, Any]:
    rule = rule_at(path) or {}
    found = {"default": rule["default"]} if "default" in rule else {}
    if "x-unit" in rule:
        found["unit"] = rule["x-unit"]
    limits = limits_of(rule)
    if rule.get("type") == "integer":
        limits = rule["minimum"], rule["maximum"]
    if limits is not None:
        found["low"], found["high"] = limits
    found["form"] = _form(rule)
    return found


SAID: Final = ("default", "description", "title", "x-unit", "x-words")


def _form(rule: Any) -> Any:
    """Return a JSON Schema without its words."""
    if isinstance(rule, list):
        return [_form(part) for part in rule]
    if not isinstance(rule, dict):
        return rule
    return {key: _form(part) for key, part in rule.items() if key not in SAID}
