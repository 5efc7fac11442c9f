"""Loads on surfaces in bins of time, from impacts and lasting contacts.

Engines add up impulses with their places and times; forces are these over the width of a bin. They
act on the surface: `normal` presses it, `along` drags it along (n_y, -n_x), with n the normal
towards the particle: forward on a belt that carries particles.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import inf, nan, prod
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from chutelab.core import REAL, Module, dtype
from chutelab.core import number as constant
from chutelab.machine import Machine
from chutelab.results.record import Record, kept
from chutelab.results.rows import LASTING, LOAD
from chutelab.util.arrays import Floats
from chutelab.util.errors import InputError, did_you_mean
from chutelab.util.tables import Sheet, Shown, number

NONE = np.empty((0, 0), LOAD)
"""Loads of a run without them."""

MOST_BINS: int = constant("MOST_BINS")
OVERFLOW = f"so long that the run has {MOST_BINS:,} bins or fewer"

MANY = 1000
"""Calls of `Bins.bear` that are added up together."""

TOLERANCE = 1e-9
"""Share of a bin by which a width may differ from a whole number of bins."""


def gather(module: Module, surfaces: int) -> NDArray[np.void]:
    """Return the core's loads on so many surfaces, (bins, surfaces)."""
    told: Any = module.structs["Loads"]
    if not told.bins:
        return NONE
    if told.overflow:
        raise InputError(OVERFLOW, "run.loads", told.every)
    shape = told.used, told.owner_count, LOAD.itemsize // REAL.itemsize
    rows = module.array("bins", REAL, prod(shape), of="Loads").reshape(shape)
    # Plain numbers are copied faster than records.
    return rows[:, :surfaces].copy().view(LOAD)[..., 0]


def gather_lasting(module: Module) -> NDArray[np.void]:
    """Return the impulses of lasting contacts from the core's contact engine, (C,)."""
    told: Any = module.structs["Loads"]
    if told.overflow:
        raise InputError("so long that all bins have room in memory", "run.stress", told.each)
    rows = module.array("lasting", dtype("Lasting"), told.lasting_count, of="Loads")
    return rows.copy().view(LASTING)


class Bins:
    """Adds up impulses on particles, like `core/loads.c`, for engines outside the core.

    It must not be used for a machine without loads: check `every` first.
    """

    def __init__(self, machine: Machine) -> None:
        self.every = machine.loads
        self.surfaces = len(machine.surfaces)
        self._sums = np.zeros((0, self.surfaces, 7))
        self._waiting: list[Floats] = []

    def bear(
        self, surface: Any, begin: Any, end: Any, place: Any, normal: Any, push: Any,
        couple: Any = 0.0,
    ) -> None:  # fmt: skip
        """Count impulses (N s) on particles, spread evenly over a time (s), no longer than a bin.

        Parameters
        ----------
        surface : int or (k,)
            The surfaces that they act on.
        begin, end : float or (k,)
            When.
        place, normal, push : (2,) or (2, k)
            Where on the surface (m), its unit normal, and the impulse on the particle.
        couple : float or (k,)
            N m s, on the particle.
        """
        rows = np.empty((10, len(surface) if np.ndim(surface) else 1))
        for row, of in zip(
            rows, (*place, *normal, *push, couple, begin, end, surface), strict=True
        ):
            row[:] = of
        self._waiting.append(rows)
        if len(self._waiting) >= MANY:
            self._count()

    def _count(self) -> None:
        """Add up the waiting calls."""
        x, y, nx, ny, px, py, turn, begin, end, surface = np.concatenate(self._waiting, axis=1)
        self._waiting.clear()
        first = np.floor(begin / self.every).astype(np.int64).clip(0)
        rows, own = max(len(self._sums), int(first.max(initial=0)) + 2), surface.astype(np.int64)
        if rows > MOST_BINS:
            raise InputError(OVERFLOW, "run.loads", self.every)
        # The share that is in the next bin.
        span = np.where(end > begin, end - begin, inf)
        late = ((end - (first + 1) * self.every) / span).clip(0.0, 1.0)
        press, fx, fy = px * nx + py * ny, -px, -py
        told = [press, fx * ny - fy * nx, fx, fy, x * fy - y * fx - turn, press * x, press * y]
        sums = np.zeros((rows, self.surfaces, len(told)))
        sums[: len(self._sums)] = self._sums
        for bins, share in ((first, 1.0 - late), (first + 1, late)):
            places = bins * self.surfaces + own
            for n, of in enumerate(told):
                added = np.bincount(places, share * of, rows * self.surfaces)
                sums[..., n] += added.reshape(rows, -1)
        self._sums = sums

    def counted(self) -> NDArray[np.void]:
        """Return all loads, (bins, surfaces)."""
        if self._waiting:
            self._count()
        used = np.flatnonzero(self._sums.any(axis=(1, 2)))
        rows = self._sums[: used[-1] + 1 if len(used) else 0]
        return rows.copy().view(LOAD)[..., 0] if len(rows) else NONE


class Part(NamedTuple):
    """A load in its unit: its mean over time, the largest size of a bin, the root mean square.

    It is taken from the first to the last bin with a load; NaN without one. The end is the mean in
    the last bin that the run filled.
    """

    mean: float
    peak: float
    rms: float
    end: float


@dataclass(frozen=True, eq=False, repr=False)
class Load(Shown):
    """The load on a surface over time.

    Attributes
    ----------
    name : str
        Of the surface.
    edges : ndarray, shape (T + 1,)
        Of the bins of time, s.
    normal, along : ndarray, shape (T,)
        Mean force in each bin that presses it, and mean force along (n_y, -n_x), N.
    force : ndarray, shape (T, 2)
        The whole force, N.
    place : ndarray, shape (T, 2)
        Place of the normal load, m: mean of the contact points, weighted with their normal
        impulses; NaN without one.
    pivot : (float, float)
        Reference point of torques, m: hinge or pivot, as written, of a moving surface; a plate's
        pivot, the axis of the drive pulley, an arc's centre; for other surfaces the first end.
    torque : ndarray, shape (T,)
        Of the force about the pivot, counterclockwise, N m; about where it is in the middle of the
        bin, if it travels or shakes.
    filled : int
        How many bins the run went through; bins after T have no load.
    """

    name: str
    edges: Floats
    normal: Floats
    along: Floats
    force: Floats
    place: Floats
    pivot: tuple[float, float]
    torque: Floats
    filled: int

    def part(self, key: str) -> Part:
        """Return mean, peak, rms and end of ``normal``, ``along`` or ``torque``."""
        values = getattr(self, key)
        borne = np.flatnonzero(self.force.any(axis=1))
        if not len(borne):
            return Part(nan, nan, nan, nan)
        some, last = values[borne[0] : borne[-1] + 1], self.filled - 1
        return Part(
            float(some.mean()), float(np.abs(some).max()), float(np.sqrt((some**2).mean())),
            float(values[last]) if 0 <= last < len(values) else 0.0 if last >= 0 else nan,
        )  # fmt: skip

    def sheet(self, *, details: bool = False) -> Sheet:
        """Return mean, peak, root mean square and end of each."""
        units = {"normal": "N", "along": "N", "torque": "N m"}
        rows = tuple(
            (f"{key}, {unit}", *map(number, self.part(key))) for key, unit in units.items()
        )
        return Sheet(f"Loads on {self.name}", ("", "mean", "peak", "rms", "end"), rows)


def pivot_of(machine: Machine, surface: int) -> tuple[float, float]:
    """Return the reference point of torques on a surface, see `Load`, m."""
    name, scene, mover = machine.surfaces[surface], machine.scene, machine.mover(surface)
    if mover is not None:
        return mover.pivot
    if machine.pulley is not None and surface == machine.pulley.surface:
        return 0.0, 0.0
    for plate in scene.plates:
        if plate.pivot is not None and plate.name == name:
            return plate.pivot
        if plate.pivot is None and name == "plate" and scene.incoming is not None:
            assert plate.distance is not None
            assert plate.pivot_height is not None
            return scene.incoming.pulley_radius + plate.distance, plate.pivot_height
    arcs, segments = machine.arcs, machine.segments
    bent, straight = (np.flatnonzero(part.surface == surface) for part in (arcs, segments))
    x, y = (segments.start[straight[0]] if len(straight) else arcs.center[bent[0]]).tolist()
    return x, y


def need_loads(recording: Record) -> None:
    """Raise an `InputError` if a recording has no loads."""
    if not recording.machine.loads:
        allowed = "a width of bins, such as 0.01 s: this run counted no loads"
        raise InputError(allowed, "run.loads", None)


def loads(recording: Record, name: str, every: float | None = None) -> Load:
    """Return the load on a surface over time, in bins of ``run.loads`` or a multiple of it.

    Parameters
    ----------
    recording : Record
        Of a run with ``run.loads``.
    name : str
        Of the surface.
    every : float, optional
        Width of the bins, s.

    Raises
    ------
    InputError
        If the run has no loads, there is no such surface, or the bins do not divide.
    """
    need_loads(recording)
    machine, rows = recording.machine, recording.impulses
    if name not in machine.surfaces:
        there = f"the scene has {', '.join(machine.surfaces)}"
        raise InputError(did_you_mean(name, machine.surfaces, there), "surface", name)
    width = machine.loads if every is None else every
    many = round(width / machine.loads) if 0.0 < width < inf else 0
    if many < 1 or abs(width / machine.loads - many) > TOLERANCE * many:
        raise InputError(f"{machine.loads:g} s, or a multiple of it", "every", every)
    surface = machine.surfaces.index(name)
    first = np.arange(0, len(rows), many)
    sums = {
        key: np.add.reduceat(rows[key][:, surface], first, axis=0) / width
        for key in LOAD.names or ()
        if len(rows)
    } or {key: np.zeros((0, *LOAD[key].shape)) for key in LOAD.names or ()}
    normal, force = sums["normal"], sums["force"]
    edges = machine.loads * many * np.arange(len(first) + 1.0)
    pivot, mover = pivot_of(machine, surface), machine.mover(surface)
    x, y = pivot if mover is None else mover.pose(0.5 * (edges[1:] + edges[:-1]))[:, :2].T
    pressed = normal[:, None] > 0.0
    return Load(
        name=name,
        edges=edges,
        normal=normal,
        along=sums["along"],
        force=force,
        place=np.divide(sums["at"], normal[:, None], out=np.full_like(force, nan), where=pressed),
        pivot=pivot,
        torque=sums["moment"] - x * force[:, 1] + y * force[:, 0],
        filled=int(float(recording.knots["t"].max(initial=0.0)) / width + TOLERANCE),
    )


@kept
def load(recording: Record, name: str) -> Load:
    """Return the load on a surface, in the bins of the run."""
    return loads(recording, name)


def borne(recording: Record) -> dict[str, Load]:
    """Return the loads of all surfaces that have any, by their names."""
    if not recording.impulses.size:
        return {}
    bear = np.flatnonzero(recording.impulses["force"].any(axis=(0, 2))).tolist()
    return {name: load(recording, name) for name in np.array(recording.surfaces)[bear].tolist()}


def told(recording: Record) -> dict[str, dict[str, dict[str, float]]]:
    """Return the loads for the JSON of a run: by surface and part, mean, peak, rms and end."""
    parts = ("normal", "along", "torque")
    return {
        name: {key: one.part(key)._asdict() for key in parts}
        for name, one in borne(recording).items()
    }


def sheet(recording: Record) -> Sheet | None:
    """Return a table of the loads of all surfaces; None without any."""
    found = borne(recording)
    if not found:
        return None
    heads = ("surface", "normal, N", "peak", "rms", "along, N", "torque, N m", "at x, m", "y, m")
    rows = []
    for name, one in found.items():
        total = np.nansum(one.place * one.normal[:, None], axis=0) / one.normal.sum()
        numbers = (*one.part("normal")[:3], one.part("along").mean, one.part("torque").mean, *total)
        rows.append((name, *(number(float(value)) for value in numbers)))
    width = recording.machine.loads
    note = f"means over time, from the first to the last load, and peaks in bins of {width:g} s"
    return Sheet("Loads", heads, tuple(rows), notes=(note,))
