"""The data of a page about its scene and about scene files: `describe`."""

from __future__ import annotations

from collections import Counter
from typing import Any, Final

from chutelab.engines.simulation import uncornered, unjoined
from chutelab.machine import build
from chutelab.scene import Fault, Scene, SceneError, load, to_dict
from chutelab.scene.conflicts import RULES
from chutelab.scene.formulas import tree
from chutelab.scene.look import EITHER, JOINTS
from chutelab.scene.materials import VALUES, presets
from chutelab.scene.messages import LISTS
from chutelab.scene.overrides import limits_of, rule_at
from chutelab.scene.units import LARGEST, SHORTEST

MOST: Final = 100_000
"""Most particles of a page, which keeps their tracks and draws them in each frame."""

EXAMPLES: Final = ("inclined-40", "cascade", "spoon", "hopper", "galton", "free-fall")
"""Scenes offered by the empty page, with the words ``example-NAME`` in its catalogues."""


def _part(
    part: str, letter: str, table: str, places: str, main: str, needs: str = "", **row: Any
) -> dict[str, Any]:
    return {
        "part": part, "letter": letter, "table": table, "places": places.split(),
        "main": main.split(), "needs": needs.split(), "row": row,
    }  # fmt: skip


PARTS: Final = (
    _part("belt", "E", "conveyor", "from to", "speed pulley_radius friction",
          pulley_radius=0.05, speed=1.0),
    _part("pulley", "U", "incoming", "", "speed pulley_radius length",
          speed=2.0, pulley_radius=0.1, length=0.6),
    _part("plate", "P", "plate", "pivot", "angle_deg distance restitution below",
          angle_deg=30.0, above=0.05, below=0.3),
    _part("line", "L", "surface", "points points", "restitution friction speed"),
    _part("arc", "C", "surface", "arc arc arc", "radius restitution friction", "center"),
    _part("ball", "B", "stream", "at", "velocity start restitution",
          velocity=[0.0, 0.0], interact=True),
    _part("box", "A", "stream", "at", "size mass angle_deg", "size",
          velocity=[0.0, 0.0], interact=True, shape="box", size=[0.1, 0.06], mass=0.25, spin=True,
          material="wood"),
    _part("stream", "R", "stream", "at to", "count rate velocity", "count",
          velocity=[0.0, 0.0], count=60, rate=40.0, interact=True),
    _part("pegs", "G", "surface", "center", "radius repeat restitution", "center repeat",
          radius=0.012, repeat=[[6, 0.08, 0.0], [4, 0.04, -0.07]], restitution=0.4),
    _part("gate", "D", "surface", "points points", "opens_at closes_at friction", "opens_at",
          opens_at=1.0),
    _part("oneway", "O", "surface", "points points", "passes restitution friction", "passes",
          passes="up"),
    _part("flap", "F", "surface", "points points", "spring damper mass", "hinge",
          hinge="pivot", mass=0.2, spring=0.5, damper=0.01),
    _part("rotor", "M", "surface", "points points", "motor.speed_deg motor.torque mass",
          "hinge motor", hinge="pivot", mass=0.2, motor={"speed_deg": 90.0, "torque": 1.0}),
    _part("shaker", "K", "surface", "points points", "shake.by shake.frequency friction", "shake",
          shake={"by": [0.0, 0.003], "frequency": 15.0}),
    _part("pusher", "T", "surface", "points points travel.to", "travel.at travel.in friction",
          "travel", travel={"at": 0.5, "in": 1.0}),
    _part("trigger", "Q", "surface", "points points touched", "opens_when restitution friction",
          "opens_when"),
    _part("string", "N", "string", "tie ball", "length particle from"),
    _part("rod", "X", "rod", "tie ball", "particle other from"),
    _part("spring", "W", "spring", "tie ball", "stiffness damper length"),
    _part("pin", "I", "pin", "pin", "particle other from"),
    _part("sensor", "S", "sensor", "from to", "name from to"),
)  # fmt: skip
"""Parts that can be added to a machine, one row each: word, shortcut key, table, the key for each
point set in the picture, the three keys shown first, the keys that distinguish it from other parts
of its table, and its further initial values (m and kg, for a picture one metre high). Keys that a
stream lacks belong to the kind of its particles."""


def describe(scene: Scene | None, *, partly: bool = False) -> dict[str, Any]:
    """Return the scene and the rules of scene files as plain data for JSON.

    A drop measured from the impact is converted to one from the top of the pulley, so that the
    outgoing belt stays in place while the plate is turned.

    Parameters
    ----------
    scene : Scene, optional
        One scene, not a family, without mass points. None is an empty machine.
    partly : bool
        Whether parts that the page cannot show are left out instead of refused.

    Returns
    -------
    dict
        ``scene``: its keys as in its file, with a seed beyond 2**53 as text; ``stream`` is [] if
        there is none. ``tables``: of each key of each table (those outside of tables under
        ``scene``) default, unit, low and high, its form as JSON Schema, and whether it is required;
        of a table in a table the same of its ``parts``. ``rules``: contradictions within a row of a
        table, by tables: keys, condition, id of a text, and the other key in it. ``presets``: the
        numbers of each material. ``parts``: see `PARTS`. Of an empty machine ``examples``: scenes
        by name. If something is left out ``lacks``: numbers by kind, and ``source``: the scene's
        file.

    Raises
    ------
    SceneError
        If the page cannot show it: mass points, too many particles, or boxes and polygons with
        features that the contact engine lacks for them; or if its geometry contradicts itself.
    """
    materials = {
        name: {key: getattr(preset.material, key) for key in VALUES}
        for name, preset in presets().items()
    }
    rules = {
        table: [[keys.split(), tree(when), *text.split()] for keys, when, text, _ in rows if text]
        for table, rows in RULES.items()
    }
    common: dict[str, Any] = {
        "tables": _rules(), "rules": rules, "presets": materials, "parts": PARTS,
    }  # fmt: skip
    if scene is None:
        examples = {name: describe(load(name))["scene"] for name in EXAMPLES}
        return {"scene": {"stream": []}, **common, "examples": examples}
    cornered = [*uncornered(build(scene))] if scene.cornered else []
    faults = [Fault(key, value, f"must be {allowed}") for key, value, allowed in cornered]
    lacks: Counter[str] = Counter()
    foreign = {
        n
        for n, kind in enumerate(scene.particles)
        if kind.radius == 0.0 or (kind.outline and cornered)
    }
    for n in sorted(foreign):
        kind, table = scene.particles[n], scene.head("particle", n)
        many = sum(s.count for s, its in zip(scene.streams, scene.kinds, strict=True) if its == n)
        lacks[kind.shape if kind.outline else "point"] += many
        if not kind.outline:
            allowed = "must be more than 0; a page that answers shows what has a size"
            faults.append(Fault(f"{table}.radius", 0.0, allowed))
    # Joints refer to numbers of particles, some of which would be left out.
    lacks += Counter(table for table, _ in scene.joints if foreign)
    for n, pair in enumerate(scene.pair):
        if (key := pair.clings) and scene.hinges:
            text = (
                "must be 0 with what hangs on hinges: the contact engine, which pages run, lacks it"
            )
            faults.append(Fault(f"pair[{n}].{key}", getattr(pair, key), text))
            partly = False
    if partly:
        faults = []
    if scene.count > MOST:
        counts = [stream.count for stream in scene.streams]
        table = scene.head("stream", counts.index(max(counts)))
        text = f"a page has room for {MOST} particles, and these are {scene.count}"
        faults.append(Fault(f"{table}.count", max(counts), text))
    if faults:
        raise SceneError(scene.source, faults)
    tables = to_dict(scene)
    if lacks:
        _leave_out(tables, scene, foreign)
        common |= {"lacks": dict(lacks), "source": scene.source}
    machine, out = build(scene), scene.outgoing
    if machine.joints and not lacks and (why := unjoined(machine)):
        text = f"must be other than in this scene: {why}"
        raise SceneError(scene.source, [Fault(machine.joints[0].kind, None, text)])
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
            # JavaScript's numbers hold all whole numbers up to here.
            if row.get("seed", 0) > 2**53:
                row["seed"] = str(row["seed"])
    return {"scene": tables, **common}


def _leave_out(tables: dict[str, Any], scene: Scene, kinds: set[int]) -> None:
    """Remove kinds of particles, their streams, and all joints from the keys of a scene."""
    names = {scene.particles[n].name for n in kinds}
    for table, gone in (
        ("particle", [n in kinds for n in range(len(scene.particles))]),
        ("stream", [n in kinds for n in scene.kinds]),
        ("pair", [bool(names & {*pair.between}) for pair in scene.pair]),
    ):
        rows = tables.pop(table, [])
        rows = [rows] if isinstance(rows, dict) else rows
        if kept := [row for row, out in zip(rows, gone, strict=False) if not out]:
            tables[table] = kept
    left = tables.setdefault("stream", [])
    # `interact` may have been set in a stream that was removed.
    if scene.crowded and sum(stream.get("count", 1) for stream in left) > 1:
        left[0]["interact"] = True
    for table in (*JOINTS, "live"):
        tables.pop(table, None)


def _rules() -> dict[str, dict[str, dict[str, Any]]]:
    """Return default, unit and range of each key, by tables."""
    rules: dict[str, dict[str, dict[str, Any]]] = {"scene": {}}
    for name, field in Scene.model_fields.items():
        key = field.alias or name
        if key in Scene.tables():
            continue
        rules["scene"][key] = _rule([key])
    for table, model in Scene.tables().items():
        if table == "expect":
            continue
        several = table in LISTS or table in EITHER
        rules[table] = {}
        for name, field in model.model_fields.items():
            key = field.alias or name
            rule = _rule([table, 0, key] if several else [table, key])
            if field.is_required():
                rule["required"] = True
            rules[table][key] = rule
    # Mass points need another engine.
    particle = rules["particle"]
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
        limits = rule["minimum"], rule.get("maximum", MOST)
    if limits is not None:
        found["low"], found["high"] = limits
    found["form"] = _form(rule)
    if needs := rule.get("required"):
        found["form"] = {"type": "object"}
        found["parts"] = {
            key: _rule([*path, key]) | {"required": key in needs} for key in rule["properties"]
        }
    return found


SAID: Final = ("default", "description", "title", "x-unit", "x-words")


def _form(rule: Any) -> Any:
    """Return a JSON Schema without its texts."""
    if isinstance(rule, list):
        return [_form(part) for part in rule]
    if not isinstance(rule, dict):
        return rule
    return {key: _form(part) for key, part in rule.items() if key not in SAID}
