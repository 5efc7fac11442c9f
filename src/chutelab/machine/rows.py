"""A scene as the core takes it, one row of numbers, and the surfaces that it makes of that.

A family of scenes is as many rows, one below the other.

The keys of the scene's tables stand under their own names in `layout.h`; NaN is what is not given.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache
from itertools import chain
from math import inf, nan, prod
from typing import Any

import numpy as np
from numpy.typing import NDArray

from chutelab.core.module import REAL, Module, dtype
from chutelab.machine.shapes import KINDS
from chutelab.scene import Scene
from chutelab.scene.variants import Family
from chutelab.util.arrays import Numbers

WORDS = {"adhesion": inf, "impact": 0.0, "top": 1.0}
"""Numbers of what keys may say in words; `drop_from` as in layout.h."""

WORD = 2**32
"""Seeds are handed over as two numbers below it."""


@cache
def _keys(struct: str) -> list[tuple[str, int]]:
    """Return the keys of a struct of layout.h as attributes, and how many numbers each has."""
    fields: Any = dtype(struct).fields
    return [
        ("from_" if name == "from" else name, kind.itemsize // 8)
        for name, (kind, _) in fields.items()
    ]


def row(scenes: Scene | Family, friction: Numbers) -> list[Numbers]:
    """Return all numbers of a scene; of a family what varies is an array (N,).

    `friction` is that of the nominal particle on the incoming belt, inf with adhesion.
    """
    scene, value, found = scenes.scene, scenes.value, list[Any]()

    def add(struct: str, table: Any, **own: Any) -> None:
        for name, width in _keys(struct):
            one = own[name] if name in own else value(table, name)
            if type(one) is float:
                found.append(one)
            elif one is None:
                found.extend([nan] * width)
            elif isinstance(one, tuple):
                flat = [*chain(*one)] if one and isinstance(one[0], tuple) else one
                found.extend([*flat, *[nan] * (width - len(flat))])
            else:
                found.append(WORDS[one] if isinstance(one, str) else one)

    add("SceneKeys", scene)
    for kind in scene.particles:
        add("ParticleKeys", kind, corners=len(kind.outline))
    for stream, number in zip(scene.streams, scene.kinds, strict=True):
        add("StreamKeys", stream, kind=number, seed=(stream.seed % WORD, stream.seed // WORD))
    if scene.incoming is not None:
        adheres = isinstance(value(scene.incoming, "friction"), str)
        add("IncomingKeys", scene.incoming, friction=friction, adheres=adheres)
    for plate in scene.plates:
        add("PlateKeys", plate)
    if scene.outgoing is not None:
        add("OutgoingKeys", scene.outgoing)
    for conveyor in scene.conveyor:
        add("ConveyorKeys", conveyor)
    for surface in scene.surface:
        add("SurfaceKeys", surface, corners=len(surface.points or ()))
    for string in scene.string:
        add("StringKeys", string)
    return [*found, *chain(*(point for one in scene.surface for point in one.points or ()))]


@dataclass(frozen=True, eq=False)
class Laid:
    """Surfaces of a scene, or of each of N scenes of a family.

    Attributes
    ----------
    parts : dict of ndarray, (S,) or (N, S)
        For each of `KINDS` rows as that in layout.h, by the part of a machine.
    nominal : ndarray, () or (N,)
        As `Nominal`.
    """

    parts: dict[str, NDArray[Any]]
    nominal: NDArray[Any]


def lay(module: Module, scenes: Scene | Family, friction: Numbers) -> Laid:
    """Have the core lay the surfaces of a scene, or of all scenes of a family."""
    scene, numbers = scenes.scene, row(scenes, friction)
    shape = (len(scenes),) if isinstance(scenes, Family) else ()
    plan, every = module.structs["Plan"], shape[0] if shape else 1
    plan.members, plan.width = every, len(numbers)
    plan.particles, plan.streams = len(scene.particles), len(scene.streams)
    plan.incoming, plan.outgoing = scene.incoming is not None, scene.outgoing is not None
    plan.plates, plan.conveyors = len(scene.plates), len(scene.conveyor)
    plan.surfaces, plan.strings = len(scene.surface), len(scene.string)
    module.work("lay_out_plan")
    rows = module.array("rows", REAL, every * len(numbers), of="Plan").reshape(every, -1)
    varies = [n for n, number in enumerate(numbers) if isinstance(number, np.ndarray)]
    rows[:] = [nan if n in varies else number for n, number in enumerate(numbers)]
    for column in varies:
        rows[:, column] = numbers[column]
    module.work("build")
    plan = module.structs["Plan"]

    def found(name: str, kind: str, *count: int) -> NDArray[Any]:
        rows = module.array(name, dtype(kind), every * prod(count), of="Plan")
        return rows.copy().reshape((*shape, *count))

    parts = {
        f"{kind.lower()}s": found(f"{kind.lower()}s", kind, getattr(plan, f"{kind.lower()}_count"))
        for kind in KINDS
    }
    return Laid(parts, found("nominal", "Nominal"))
