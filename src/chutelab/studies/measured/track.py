"""`Track`: the points that somebody measured, and how they lie in the world."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from math import isfinite
from typing import Any

import numpy as np

from chutelab.scene import Fault, SceneError
from chutelab.util.arrays import Floats, Ints
from chutelab.util.tables import Sheet, Shown


class MeasuredError(SceneError):
    """A measured track, or a fit to it, that cannot be used; its text says where and why."""


@dataclass(frozen=True)
class Placement:
    """How the numbers of a file become positions in the world and times of the simulation.

    x = scale (x_file - origin_x), y = ± scale (y_file - origin_y), t = t_file - t0.

    Attributes
    ----------
    scale : float
        Metres per unit of the file.
    origin : tuple of float
        The pulley's axis (the world's origin), in the units of the file.
    flip_y : bool
        Whether y is counted downward in the file, as pixels are.
    t0 : float
        s; the time in the file at which particle 0 is released, t = 0 of the simulation.

    Raises
    ------
    MeasuredError
        If the scale is not above 0, or a number is not finite.
    """

    scale: float = 1.0
    origin: tuple[float, float] = (0.0, 0.0)
    flip_y: bool = False
    t0: float = 0.0

    def __post_init__(self) -> None:
        faults = []
        if not (isfinite(self.scale) and self.scale > 0.0):
            faults.append(Fault("scale", self.scale, "must be a number > 0, metres per unit"))
        if len(self.origin) != 2 or not all(isfinite(value) for value in self.origin):
            faults.append(Fault("origin", self.origin, "must be two numbers, X and Y"))
        if not isfinite(self.t0):
            faults.append(Fault("t0", self.t0, "must be a number, seconds"))
        if faults:
            raise MeasuredError("placement", faults)


@dataclass(frozen=True, eq=False, repr=False)
class Track(Shown):
    """Measured points of one particle; arrays are read-only.

    Attributes
    ----------
    name, source : str
        The track's name in the file, "" without one; the file.
    seconds : ndarray, shape (P,)
        Times as the file has them, s, ascending.
    points : ndarray, shape (P, 2)
        Positions as the file has them, in its units.
    lines : ndarray, shape (P,)
        Line of the file that each point stands in, from 1.
    placement : Placement
        How they lie in the world.
    skipped : int
        Lines without a position, which were left out.
    """

    name: str
    source: str
    seconds: Floats
    points: Floats
    lines: Ints
    placement: Placement = field(default=Placement())
    skipped: int = 0

    def __post_init__(self) -> None:
        for name, kind in (("seconds", np.float64), ("points", np.float64), ("lines", np.int64)):
            values = np.array(getattr(self, name), dtype=kind)
            values.flags.writeable = False
            object.__setattr__(self, name, values)

    def __len__(self) -> int:
        return len(self.seconds)

    @property
    def t(self) -> Floats:
        """Times on the simulation's clock, s, shape (P,)."""
        return self.seconds - self.placement.t0

    @property
    def position(self) -> Floats:
        """Positions in the world, m, shape (P, 2)."""
        placement = self.placement
        up = -1.0 if placement.flip_y else 1.0
        return (self.points - placement.origin) * (placement.scale * np.array([1.0, up]))

    @property
    def x(self) -> Floats:
        """Forward from the pulley's axis, m, shape (P,)."""
        return self.position[:, 0]

    @property
    def y(self) -> Floats:
        """Up from the pulley's axis, m, shape (P,)."""
        return self.position[:, 1]

    def placed(self, **changes: Any) -> Track:
        """Return the track with some attributes of its `Placement` changed."""
        return replace(self, placement=replace(self.placement, **changes))

    def said(self) -> str:
        """Return what it is in one sentence."""
        named = f'"{self.name}"' if self.name else "track"
        text = f"{named} of {self.source}: {len(self)} points"
        if self.skipped:
            text += f", {counted(self.skipped, 'line')} without a position"
        return text

    def sheet(self) -> Sheet:
        """Return the extent of the points, on the simulation's clock and in the world."""
        columns = (("time, s", self.t), ("x, m", self.x), ("y, m", self.y))
        rows = tuple((name, f"{v.min():.4g}", f"{v.max():.4g}") for name, v in columns)
        return Sheet(self.said(), ("", "least", "most"), rows)


def counted(number: int, thing: str) -> str:
    """Return a number of things.

    >>> counted(1, "line"), counted(3, "line")
    ('1 line', '3 lines')
    """
    return f"{number} {thing}{'' if number == 1 else 's'}"
