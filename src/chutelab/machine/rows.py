"""A scene as the core takes it, one row of numbers, and the surfaces that it makes of that.

The keys of the scene's tables stand under their own names in `layout.h`; NaN is what is not given.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache
from itertools import chain
from math import inf, nan
from typing import Any

import numpy as np
from numpy.typing import NDArray

from chutelab.core.module import REAL, Module, dtype
from chutelab.scene import Scene
from chutelab.util.arrays import Numbers

WORDS = {"adhesion": inf, "impact": 0.0, "top": 1.0}
"""Numbers of what keys may say in words; `drop_from` as in layout.h."""

WORD = 2**32
"""Seeds are handed over as two numbers below it."""

ROOM = 64
"""Segments and arcs of all members for which there is room at first."""


@cache
def _keys(struct: str) -> list[tuple[str, int]]:
    """Return the keys of a struct of layout.h as attributes, and how many numbers each has."""
    fields: Any = dtype(struct).fields
    return [
        ("from_" if name == "from" else name, kind.itemsize // 8)
        for name, (kind, _) in fields.items()
    ]


def _numbers(struct: str, table: Any, **own: Any) -> list[Numbers]:
    """Return the keys of a table as numbers; `own` has those that it does not hold itself."""
    found: list[Any] = []
    for name, width in _keys(struct):
        value = own[name] if name in own else getattr(table, name)
        if type(value) is float:
            found.append(value)
        elif value is None:
            found += [nan] * width
        elif isinstance(value, tuple):
            flat = [*chain(*value)] if value and isinstance(value[0], tuple) else value
            found += [*flat, *[nan] * (width - len(flat))]
        else:
            found.append(WORDS[value] if isinstance(value, str) else value)
    return found


def row(scene: Scene, friction: Numbers) -> list[Numbers]:
    """Return all numbers of a scene; of a family what varies is an array (N,).

    `friction` is that of the nominal particle on the incoming belt, inf with adhesion.
    """
    found = _numbers("SceneKeys", scene)
    for kind in scene.particles:
        found += _numbers("ParticleKeys", kind, corners=len(kind.outline))
    for stream, number in zip(scene.streams, scene.kinds, strict=True):
        seed = stream.seed % WORD, stream.seed // WORD
        found += _numbers("StreamKeys", stream, kind=number, seed=seed)
    if scene.incoming is not None:
        adheres = isinstance(scene.incoming.friction, str)
        found += _numbers("IncomingKeys", scene.incoming, friction=friction, adheres=adheres)
    for plate in scene.plates:
        found += _numbers("PlateKeys", plate)
    if scene.outgoing is not None:
        found += _numbers("OutgoingKeys", scene.outgoing)
    for conveyor in scene.conveyor:
        found += _numbers("ConveyorKeys", conveyor)
    for surface in scene.surface:
        found += _numbers("SurfaceKeys", surface, corners=len(surface.points or ()))
    return [*found, *chain(*(point for one in scene.surface for point in one.points or ()))]


@dataclass(frozen=True, eq=False)
class Laid:
    """Surfaces of a scene, or of each of N scenes of a family.

    Attributes
    ----------
    segments : ndarray, (S,) or (N, S)
        Rows as `Segment` in layout.h.
    arcs : ndarray, (A,) or (N, A)
        As `Arc`.
    nominal : ndarray, () or (N,)
        As `Nominal`.
    """

    segments: NDArray[Any]
    arcs: NDArray[Any]
    nominal: NDArray[Any]


def lay(module: Module, scene: Scene, friction: Numbers) -> Laid:
    """Have the core lay the surfaces of a scene, or of a family's."""
    numbers = row(scene, friction)
    every = scene.shape[0] if scene.shape else 1
    rows = np.empty((every, len(numbers)))
    if scene.shape:
        for column, value in enumerate(numbers):
            rows[:, column] = value
    else:
        rows[0] = numbers
    segments, arcs = ROOM // every, ROOM // every
    while True:
        module.place(
            ("rows", REAL, rows.size), ("nominal", dtype("Nominal"), every),
            ("segments", dtype("Segment"), every * segments),
            ("arcs", dtype("Arc"), every * arcs), of="Plan",
        )  # fmt: skip
        plan = module.structs["Plan"]
        module.array("rows", REAL, rows.size, of="Plan")[:] = rows.ravel()
        plan.members, plan.width = rows.shape
        plan.particles, plan.streams = len(scene.particles), len(scene.streams)
        plan.incoming, plan.outgoing = scene.incoming is not None, scene.outgoing is not None
        plan.plates, plan.conveyors = len(scene.plates), len(scene.conveyor)
        plan.surfaces = len(scene.surface)
        plan.segment_room, plan.arc_room = every * segments, every * arcs
        if module.call("build"):
            break
        segments, arcs = plan.segment_count, plan.arc_count
    found = (
        module.array(name, dtype(struct), every * count, of="Plan")
        .copy()
        .reshape((*scene.shape, *more))
        for name, struct, count, more in (
            ("segments", "Segment", plan.segment_count, (plan.segment_count,)),
            ("arcs", "Arc", plan.arc_count, (plan.arc_count,)),
            ("nominal", "Nominal", 1, ()),
        )
    )
    return Laid(*found)
