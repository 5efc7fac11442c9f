"""Machines once more: mirrored, shifted, turned, scaled, with other masses, in another order, cut.

Each takes the tables of a scene of surfaces, joints and single particles (see `alone`), and returns
others and the `Law` by which the results of their run follow from those of the first.
"""

from __future__ import annotations

import copy
from dataclasses import dataclass, field
from math import cos, degrees, radians, sin

import numpy as np

from chutelab.machine import build
from chutelab.scene import from_dict
from chutelab.scene.schema import DEFAULTS, TABLES
from chutelab.scene.tables import Motor, Shake, Travel

MIRROR = np.array([[-1.0, 0.0], [0.0, 1.0]])
JOINTS = ("string", "rod", "spring", "pin")
WAYS = {"up": (0.0, 1.0), "down": (0.0, -1.0), "left": (-1.0, 0.0), "right": (1.0, 0.0)}

NESTED = {"shake": Shake, "travel": Travel, "motor": Motor}
"""Keys of a table that are tables."""

DIMENSIONS = {
    "m": (1, 0, 0), "s": (0, 1, 0), "kg": (0, 0, 1), "m/s": (1, -1, 0), "m/s²": (1, -2, 0),
    "1/s": (0, -1, 0), "Hz": (0, -1, 0), "rad/s": (0, -1, 0), "degrees/s": (0, -1, 0),
    "N": (1, -2, 1), "N/m": (0, -2, 1), "N s/m": (0, -1, 1), "N m": (2, -2, 1),
    "N m/rad": (2, -2, 1), "N m s/rad": (2, -1, 1), "kg m2": (2, 0, 1), "kg/m³": (-3, 0, 1),
}  # fmt: skip
"""Powers of length, time and mass in each unit of the schema; others have none."""


@dataclass(frozen=True)
class Law:
    """How results follow a transformation.

    x -> length matrix x + shift, t -> time t, angles and spins times `hand`, masses times mass;
    particle i of the first run is particle order[i] of the other.
    """

    matrix: np.ndarray = field(default_factory=lambda: np.eye(2))
    shift: tuple[float, float] = (0.0, 0.0)
    hand: int = 1
    length: float = 1.0
    time: float = 1.0
    mass: float = 1.0
    order: tuple[int, ...] | None = None


def rows_of(tables, name):
    """Return the rows of a table that may be given once or several times."""
    rows = tables.get(name, [])
    return rows if isinstance(rows, list) else [rows]


def untwinned(tables):
    """Return tables without surfaces that lie on others: which is struck, their order decides."""
    courses, rows = [], []
    for row in tables["surface"]:
        course = {key: row.get(key) for key in ("from", "to", "points", "center", "radius")}
        rows += [row] if course not in courses else []
        courses.append(course)
    return {**tables, "surface": rows}


def alone(tables):
    """Return tables in which each particle is a stream of its own, and all values are explicit.

    So nothing is left to be drawn, and to be drawn in another order.
    """
    releases = build(from_dict(tables)).releases
    kinds, streams = rows_of(tables, "particle"), rows_of(tables, "stream")
    pair = {key: streams[0][key] for key in ("restitution", "friction", "interact")
            if key in streams[0]}  # fmt: skip
    rows = []
    for n, kind in enumerate(releases.kind):
        row = {"at": releases.position[n].tolist(), "velocity": releases.velocity[n].tolist(),
               "start": float(releases.t[n]), **pair}  # fmt: skip
        if "name" in kinds[kind]:
            row["particle"] = kinds[kind]["name"]
        if kinds[kind].get("spin"):
            row["omega"] = float(releases.omega[n])
        if kinds[kind].get("shape") in ("box", "polygon"):
            row["angle_deg"] = degrees(releases.angle[n])
        rows.append(row)
    run = {"dt": DEFAULTS["run"]["dt"], **tables["run"]}
    kinds = [{"mass": DEFAULTS["particle"]["mass"], **kind} for kind in kinds]
    return copy.deepcopy({**tables, "particle": kinds, "stream": rows, "run": run})


def mirrored(tables):
    """x -> -x: directions from a to 180° - a, all that turns the other way."""
    return _moved(tables, Law(matrix=MIRROR, hand=-1), lambda angle: 180.0 - angle)


def shifted(tables, by):
    """Everything by so much, m."""
    return _moved(tables, Law(shift=tuple(by)), lambda angle: angle)


def turned(tables, by_deg):
    """Everything about the origin, gravity with it; quarter turns without rounding."""
    quarter = {90.0: (0.0, 1.0), 180.0: (-1.0, 0.0), 270.0: (0.0, -1.0)}
    c, s = quarter.get(by_deg, (cos(radians(by_deg)), sin(radians(by_deg))))
    law = Law(matrix=np.array([[c, -s], [s, c]]))
    found, law = _moved(tables, law, lambda angle: angle + by_deg)
    found["gravity_deg"] = _angle(tables.get("gravity_deg", 0.0) + by_deg)
    return found, law


def _angle(angle):
    return (angle + 180.0) % 360.0 - 180.0


def _moved(tables, law, direction):
    """Return tables with places, vectors, directions and turns as a law has them."""
    found = copy.deepcopy(tables)

    def vector(v):
        return [float(x) for x in law.matrix @ v]

    def place(q):
        return [float(x) for x in law.matrix @ q + law.shift]

    def change(row, keys, how):
        for key in keys:
            if key in row:
                row[key] = how(row[key])

    def turn(value):
        return law.hand * value

    change(found, ["gravity_deg"], turn)
    for name in ("surface", "conveyor", *JOINTS, "stream"):
        for row in found.get(name, []):
            change(row, ["from", "to", "at", "center", "pivot", "over"], place)
            change(row, ["hinge"], lambda at: at if isinstance(at, str) else place(at))
            change(row, ["points"], lambda points: [place(q) for q in points])
            change(row, ["velocity"], vector)
            change(row, ["turn", "rest_deg", "omega"], turn)
            change(row, ["repeat"], lambda copies: [[n, *vector([x, y])] for n, x, y in copies])
            change(row, ["shake"], lambda it: {**it, "by": vector(it["by"])})
            change(row, ["travel"], lambda it: {**it, "to": place(it["to"])})
            change(row, ["motor"], lambda it: {**it, "speed_deg": turn(it["speed_deg"])})
            change(row, ["stops_deg"], lambda stops: sorted(turn(stop) for stop in stops))
            if row.get("passes") in WAYS:
                gone = vector(WAYS[row["passes"]])
                row["passes"] = max(WAYS, key=lambda way: np.dot(WAYS[way], gone))
            if "center" in row:
                ends = [direction(row.get("from_deg", 0.0)), direction(row.get("to_deg", 360.0))]
                whole = 360.0 * np.floor(min(ends) / 360.0)
                row["from_deg"], row["to_deg"] = (end - whole for end in ends)
    shapes = {row.get("name"): row.get("shape") for row in found["particle"]}
    for row in found["stream"]:
        if shapes[row.get("particle")] in ("box", "polygon"):
            at = row["angle_deg"]
            row["angle_deg"] = _angle(-at if law.hand < 0 else direction(at))
    if law.hand < 0:
        for row in found["particle"]:
            change(row, ["points"], lambda points: [vector(q) for q in points[::-1]])
    return found, law


def scaled(tables, length=1.0, time=1.0, mass=1.0):
    """Each number by its dimension, as the schema's unit has it.

    The viscosity of air, kg/(m s), stays: with air a mass has to go with length times time.
    """
    assert not tables.get("air_density") or mass == length * time

    def times(value, unit):
        if unit not in DIMENSIONS:
            return value
        a, b, c = DIMENSIONS[unit]
        return (np.array(value) * (length**a * time**b * mass**c)).tolist()

    def scale(row, fields):
        for key, model in fields.items():
            name = model.alias or key
            if name not in row or isinstance(row[name], str):
                continue
            if name in NESTED:
                row[name] = scale(dict(row[name]), NESTED[name].model_fields)
            elif name == "repeat":
                row[name] = [[n, length * x, length * y] for n, x, y in row[name]]
            else:
                row[name] = times(row[name], (model.json_schema_extra or {}).get("x-unit"))
        return row

    found = copy.deepcopy(tables)
    for name, table in TABLES.items():
        for row in rows_of(found, name):
            scale(row, table.model_fields)
    found["gravity"] = times(tables.get("gravity", 9.81), "m/s²")
    if "air_density" in found:
        found["air_density"] = times(found["air_density"], "kg/m³")
    return found, Law(length=length, time=time, mass=mass)


def resized(tables, length):
    """Lengths scaled, and times as gravity has them; without gravity, speeds stay."""
    time = length**0.5 if tables.get("gravity", 9.81) else length
    return scaled(tables, length, time, length * time if tables.get("air_density") else 1.0)


def reordered(tables, seed):
    """Surfaces, kinds, particles and joints in another order, pieces from the other end."""
    found, random = copy.deepcopy(tables), np.random.default_rng(seed)
    mixed = random.permutation(len(found["stream"]))
    place = np.argsort(mixed)
    for name in JOINTS:
        for row in found.get(name, []):
            row["particle"] = int(place[row.get("particle", 0)])
            if "other" in row:
                row["other"] = int(place[row["other"]])
    found["stream"] = [found["stream"][n] for n in mixed]
    for name in ("particle", "surface", "conveyor", *JOINTS):
        if name in found:
            found[name] = [found[name][n] for n in random.permutation(len(found[name]))]
    for row in found["surface"]:
        still = not {"turn", "travel", "hinge"} & {*row} or "pivot" in row
        if still and random.random() < 0.5:
            ends = ("from", "to") if "from" in row else ("from_deg", "to_deg")
            if "points" in row:
                row["points"] = row["points"][::-1]
            elif {*ends} <= {*row}:
                row[ends[0]], row[ends[1]] = row[ends[1]], row[ends[0]]
            else:
                continue
            if "speed" in row:
                row["speed"] = -row["speed"]
    return found, Law(order=tuple(place.tolist()))


def cut(tables, seed):
    """Straight pieces and arcs in two, at any place; the two are one surface, or each is its own.

    One surface stays what hangs, what a trigger or a pair names, and what appears, vanishes or
    lets through: it acts as a whole, and an arc is then not cut.
    """
    found, random = copy.deepcopy(tables), np.random.default_rng([3, seed])
    named = {name for pair in found.get("pair", []) for name in pair["between"]}
    for row in found["surface"]:
        named |= {row[key]["touched"] for key in row if key.endswith("_when")}
    rows = []
    for row in found["surface"]:
        whole = row["name"] in named or "hinge" in row or "passes" in row
        whole |= any(key.startswith(("opens", "closes", "starts")) for key in row)
        row |= {"pivot": _pivot(row)} if {"turn", "travel"} & {*row} else {}
        place = random.uniform(0.1, 0.9)
        if "center" in row:
            ends = row.get("from_deg", 0.0), row.get("to_deg", 360.0)
            middle = (1.0 - place) * ends[0] + place * ends[1]
            parts = [{"from_deg": ends[0], "to_deg": middle},
                     {"from_deg": middle, "to_deg": ends[1]}]  # fmt: skip
            rows += [row] if whole or "repeat" in row else _apart(row, parts)
            continue
        points = row.get("points") or [row["from"], row["to"]]
        n = int(random.integers(1, len(points)))
        middle = (1.0 - place) * np.array(points[n - 1]) + place * np.array(points[n])
        points = [*points[:n], middle.tolist(), *points[n:]]
        bare = {key: value for key, value in row.items() if key not in ("from", "to")}
        parts = [{"points": points[: n + 1]}, {"points": points[n:]}]
        one = whole or random.random() < 0.5
        rows += [bare | {"points": points}] if one else _apart(bare, parts)
    found["surface"] = rows
    return found, Law()


def with_more_above(tables):
    """Add a line, an arc, a belt and a gate, from which gravity pulls all that there is away.

    Not below, as tracks end below the lowest surface.
    """
    found, angle = copy.deepcopy(tables), radians(tables.get("gravity_deg", 0.0))
    up, side = np.array([-sin(angle), cos(angle)]), np.array([cos(angle), sin(angle)])
    line = {"from": (20.0 * up - side).tolist(), "to": (20.0 * up + side).tolist()}
    arc = {"center": (30.0 * up).tolist(), "radius": 1.0, "from_deg": 0.0, "to_deg": 120.0}
    for n, row in enumerate((line, arc, line | {"speed": 1.0}, line | {"opens_at": 9.0})):
        found["surface"].append({"name": f"above{n}", "restitution": 0.5, "friction": 0.3, **row})
    return found, Law()


def _pivot(row):
    first = row.get("center") or row.get("from") or row["points"][0]
    return row.get("pivot", first)


def _apart(row, parts):
    return [row | part | {"name": f"{row['name']}{n or ''}"} for n, part in enumerate(parts)]
