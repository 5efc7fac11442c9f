"""`Record`: a finished run as an engine leaves it.

A particle's track is a list of *knots*; between two knots it is the cubic Hermite curve through
them. With exact end velocities that curve is the parabola of free flight, so a flight costs two
knots however long it lasts; along arcs the exact engine's is within 1e-9 of the radius. An impact
is two knots at one time.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field, replace
from functools import cached_property, wraps
from inspect import signature
from math import isnan, nan
from typing import Any, Concatenate, ParamSpec, TypeVar

import numpy as np
from numpy.typing import ArrayLike, NDArray

from chutelab.machine import SWING, Machine, Particle
from chutelab.results.rows import LASTING, LOAD, PARTICLES, REASONS, TOTAL, Kind, kind_of
from chutelab.scene import Scene
from chutelab.scene.variants import Family
from chutelab.util.arrays import Bools, Floats, Ints
from chutelab.util.errors import InputError, did_you_mean
from chutelab.util.tables import Sheet, Shown


def must_move(name: str, moving: list[str]) -> None:
    """Raise an `InputError` if a surface is not among those that move."""
    if name not in moving:
        there = f"what moves is {', '.join(moving) or 'nothing'}"
        raise InputError(did_you_mean(name, moving, there), "name", name)


CELLS = 2**18
"""Times × particles in one block: some 30 arrays of 2 MB each, about the size of the cache."""

BRIEF = 1e-10
"""Share of a coordinate: a smaller displacement gives no velocity."""

Cells = tuple[Ints, Ints, Ints, Floats]
"""Particles under way at times, arrays (c,): index of the time, and of the particle; index of the
last knot that is not later (``left``; ``left + 1`` closes the interval, so at the end of a track it
is the last knot but one); and the share of the interval that has passed, 0 to 1 (1 if a track ends
with an impact)."""


def hermite(knots: NDArray[Any], left: Ints, share: Floats) -> tuple[Floats, Floats]:
    """Return places (m) and velocities (m/s) on the cubics between two knots each, (c, 2)."""
    s, h = share, knots["t"][left + 1] - knots["t"][left]
    places, velocities = np.empty((2, len(left), 2))
    over = s >= 1.0
    for axis in (0, 1):
        position, velocity = knots["position"][:, axis], knots["velocity"][:, axis]
        pa, pb, va, vb = position[left], position[left + 1], velocity[left], velocity[left + 1]
        dx = pb - pa
        # Expanded about the left knot, so that a long flight loses no digits.
        where = pa + s * (
            h * va + s * ((3.0 * dx - h * (2.0 * va + vb)) + s * (h * (va + vb) - 2.0 * dx))
        )
        # A displacement that is lost in the digits of the place gives no velocity.
        told = h * (np.abs(va) + np.abs(vb)) > BRIEF * np.abs(pa)
        slope = np.divide(dx, h, out=0.5 * (va + vb), where=told)
        pace = va + s * (2.0 * (3.0 * slope - 2.0 * va - vb) + 3.0 * s * (va + vb - 2.0 * slope))
        places[:, axis], velocities[:, axis] = np.where(over, pb, where), np.where(over, vb, pace)
    return places, velocities


def turned(knots: NDArray[Any], angle: Floats, left: Ints, share: Floats) -> Floats:
    """Return angles (rad) between two knots each, (c,), from angles at all knots, (K,).

    The spin is linear there; a difference between its integral and the angles is distributed
    evenly.
    """
    omega, h = knots["omega"], knots["t"][left + 1] - knots["t"][left]
    gained = h * share * (omega[left] + 0.5 * share * (omega[left + 1] - omega[left]))
    missed = angle[left + 1] - angle[left] - 0.5 * h * (omega[left + 1] + omega[left])
    return np.asarray(angle[left] + gained + share * missed)


class Motion(tuple[Floats, Floats]):
    """A pair: positions (m) and velocities (m/s) at times, (T, N, 2); with angles and spins.

    NaN before a particle's release and after its end; at an impact the state after it.
    """

    _record: Record
    _times: Floats

    def __new__(cls, position: Floats, velocity: Floats, record: Record, times: Floats) -> Motion:
        """Return the pair, of a recording at times (T,), s."""
        self = super().__new__(cls, (position, velocity))
        self._record, self._times = record, times
        return self

    @property
    def position(self) -> Floats:
        """Positions of the centres, (T, N, 2), m."""
        return self[0]

    @property
    def velocity(self) -> Floats:
        """Their velocities, (T, N, 2), m/s."""
        return self[1]

    @property
    def omega(self) -> Floats:
        """Angular velocity, counterclockwise, (T, N), rad/s: linear between knots."""
        found, omega = np.full(self[0].shape[:2], np.nan), self._record.knots["omega"]
        for row, particle, left, share in self._record.blocks(self._times):
            found[row, particle] = omega[left] + share * (omega[left + 1] - omega[left])
        return found

    @property
    def angle(self) -> Floats:
        """Counterclockwise angles of particles from their shape as written, (T, N), rad.

        The integral of `omega` since the release; with `Recording.angle`, corrected to these angles
        evenly from knot to knot.
        """
        some, found = self._record, np.full(self[0].shape[:2], np.nan)
        passed, begun = some.angle, np.zeros(some.count)
        if not len(passed):
            t, omega = some.knots["t"], some.knots["omega"]
            passed = np.append(0.0, np.cumsum(0.5 * (omega[1:] + omega[:-1]) * np.diff(t)))
            begun = passed[some.offsets[:-1].clip(max=len(passed) - 1)]
        for row, particle, left, share in some.blocks(self._times):
            found[row, particle] = turned(some.knots, passed, left, share) - begun[particle]
        return found


@dataclass(frozen=True, eq=False, repr=False)
class Record(Shown):
    """A finished run: read-only arrays, the same type from every engine.

    The base of `Recording`, which `simulate` returns. Engines write it and the modules of this
    package read it, so it imports none of them.

    Attributes
    ----------
    machine : Machine
        The machine that was run; it has the scene.
    engine : str
        ``"exact"``, ``"contact"`` or ``"pymunk"``.
    knots : ndarray, shape (K,), dtype `KNOT`
        All tracks, one after the other.
    offsets : ndarray, shape (N + 1,)
        Particle i owns ``knots[offsets[i]:offsets[i + 1]]``: two or more, in the order of time, or
        none if it was never released.
    ended : ndarray, shape (N,)
        Indices into `REASONS`.
    events : ndarray, shape (E,), dtype `EVENT`
        Sorted by time; at one time by particle, then in the order of recording. In a family by
        particle, then by time.
    by_surface : ndarray, shape (len(surfaces), 3)
        Ledger entries (J) of each surface, summed over particles. Only in a family of machines (see
        `chutelab.engines.exact`) those of each particle, (N, len(surfaces), 3).
    steps : int
        Steps taken; for the exact engine the largest number of events of a particle.
    contacts : int
        Impacts and collisions resolved.
    seconds : float
        Wall time from the validated scene to the recording; NaN in one that was loaded, or
        that an engine made without `simulate`.
    angle : ndarray, shape (K,), or (0,)
        Counterclockwise angle of the particle from its shape as written, at each knot, rad, if some
        are boxes or polygons: Chipmunk also turns them to remove overlaps, which ω does not show.
        Empty if all are round: then the angle is the integral of ω.
    instead : str
        If the first engine broke a law of every run and this one ran instead: which engine, and
        which law; else empty.
    gained : float
        Energy (J) made by the contact engine's solver beyond what moving surfaces and the removal
        of overlaps give, summed over all steps: rounding of the energy turned over, or the solver
        is wrong (docs/physics.md, "The law of a solve"). 0 for other engines.
    hastened : float
        Greatest acceleration of a particle by a push by hand, m/s²: laws allow for it as for
        gravity.
    torque : float
        Greatest torque of a motor that was set during the run, N m.
    air_loss : float
        Energy of all particles lost to air, J; in the tracks it is part of the friction loss.
    totals : ndarray, shape (S,) or (0,), dtype `TOTAL`
        Energies of all particles together at each step of the contact engine in a crowd: its tracks
        leave out changes smaller than a hop, so energies summed from them are less accurate.
    unsolved : ndarray, shape (S,) or (0,)
        How well each of these steps was solved: the largest overlap, in radii, left beyond what was
        asked for. A solve ends when this is small, or after a number of sweeps.
    unit : float
        Unit (J) in which a crowd's entries were saved, 0 if they have all bits; laws allow for it.
    drives : ndarray, shape (len(surfaces),) or (0,)
        The part of the belt work (J) in `by_surface`, in the knots and in `totals` that is the work
        of a surface's drive, see docs/physics.md, "Moving surfaces". Empty if none moves.
    impulses : ndarray, shape (B, len(surfaces) - 1) or (0, 0), dtype `LOAD`
        The loads on each surface in bins of ``run.loads`` seconds from 0 s on, up to the last bin
        with a load; empty without ``run.loads``.
    lasting : ndarray, shape (C,) or (0,), dtype `LASTING`
        Impulses of lasting contacts in bins of ``run.stress`` seconds, or over the time of sleep;
        impacts are events. Only from the contact engine, with ``run.stress``.
    swings : ndarray, shape (K,) or (0,), dtype `SWING`
        States of hinges, surface by surface, in the order of time.
    hinge_work : ndarray, shape (len(surfaces), 4) or (0, 4)
        For hinges, J: work of the motor, losses at the stops and in the damper, and work of pushes
        by hand. Empty without hinges.
    stopped : ndarray, shape (K,) or (0,)
        For each of `swings`, J: the loss at the stops of its hinge until then. Only from the
        contact engine.
    springs : ndarray, shape (S, 4)
        For each ``[[spring]]``, J: its energy when it was tied and at the end, the loss in its
        damper, and its work on particles, which is part of their belt work in the knots.
    triggered : ndarray, shape (len(machine.triggers),)
        Times at which triggers acted, s; inf for those that did not.
    """

    machine: Machine
    engine: str
    knots: NDArray[Any]
    offsets: Ints
    ended: NDArray[np.int8]
    events: NDArray[Any]
    by_surface: Floats
    steps: int
    contacts: int
    seconds: float = nan
    angle: Floats = field(default_factory=lambda: np.zeros(0))
    instead: str = ""
    gained: float = 0.0
    hastened: float = 0.0
    torque: float = 0.0
    air_loss: float = 0.0
    totals: NDArray[Any] = field(default_factory=lambda: np.empty(0, TOTAL))
    unsolved: Floats = field(default_factory=lambda: np.empty(0))
    unit: float = 0.0
    drives: Floats = field(default_factory=lambda: np.zeros(0))
    impulses: NDArray[Any] = field(default_factory=lambda: np.empty((0, 0), LOAD))
    lasting: NDArray[Any] = field(default_factory=lambda: np.empty(0, LASTING))
    swings: NDArray[Any] = field(default_factory=lambda: np.empty(0, SWING))
    hinge_work: Floats = field(default_factory=lambda: np.zeros((0, 4)))
    stopped: Floats = field(default_factory=lambda: np.zeros(0))
    springs: Floats = field(default_factory=lambda: np.zeros((0, 4)))
    triggered: Floats = field(default_factory=lambda: np.zeros(0))

    def __post_init__(self) -> None:
        for value in vars(self).values():
            if isinstance(value, np.ndarray):
                value.setflags(write=False)
        if len(self.triggered):
            object.__setattr__(self, "machine", self.machine.when(self.triggered))
        if len(self.swings):
            by_hand = np.setdiff1d(self.swings["surface"], [m.surface for m in self.machine.movers])
            movers = *self.machine.movers, *map(self.machine.steered, by_hand.tolist())
            swung = tuple(mover.swung(self.swings) for mover in movers)
            object.__setattr__(self, "machine", replace(self.machine, movers=swung))

    @property
    def scene(self) -> Scene:
        """The scene that was run; for a family one of its scenes."""
        return self.machine.scene

    @property
    def family(self) -> Family | None:
        """All scenes that were run at once, if there are several."""
        return self.machine.family

    @property
    def variants(self) -> int:
        """Number of scenes V; in a family each has the same number of particles, in turn."""
        return 1 if self.family is None else self.count // self.family.each

    @property
    def title(self) -> str:
        """The scene's title."""
        return self.scene.title

    @property
    def particle(self) -> Particle:
        """Radius, mass and inertia."""
        return self.machine.particle

    @property
    def gravity(self) -> float:
        """m/s²."""
        return self.machine.gravity

    @property
    def radius(self) -> Floats:
        """Of each particle, (N,), m."""
        return np.broadcast_to(self.particle.radius, self.count)

    @property
    def mass(self) -> Floats:
        """Of each particle, (N,), kg."""
        return np.broadcast_to(self.particle.mass, self.count)

    @cached_property
    def surfaces(self) -> tuple[str, ...]:
        """Names that `events["surface"]` indexes; the last is always ``"particles"``."""
        return (*self.machine.surfaces, PARTICLES)

    @cached_property
    def found(self) -> dict[Any, Any]:
        """Cached results of readers, see `kept`."""
        return {}

    @cached_property
    def t(self) -> Floats:
        """Times of all knots, s, in order and each once."""
        return np.unique(self.knots["t"])

    @property
    def count(self) -> int:
        """Number of particles."""
        return len(self.offsets) - 1

    @property
    def released(self) -> Bools:
        """Which particles were released, (N,)."""
        return self.offsets[1:] > self.offsets[:-1]

    def ended_by(self, reason: str) -> Bools:
        """Return which tracks ended for one of `REASONS`, (N,)."""
        return np.asarray(self.ended == REASONS.index(reason))

    def sheet(self, *, details: bool = False) -> Sheet:
        """Return a short description; with `details` also how it was computed."""
        first, last = self.ends()
        happened = sorted(Counter(self.events["kind"].tolist()).items())
        ended = sorted(Counter(self.ended.tolist()).items())
        told = {
            "particles": f"{self.count:,}",
            "time": f"{first['t'].min():.6g} to {last['t'].max():.6g} s" if len(first) else "none",
            "events": ", ".join(f"{n:,} {Kind(k).name.lower()}" for k, n in happened),
            "ended": ", ".join(f"{n:,} {REASONS[k]}" for k, n in ended),
        }
        if details:
            told |= {"engine": self.engine, "knots": f"{len(self.knots):,}"}
        if details and not isnan(self.seconds):
            told["run time"] = f"{self.seconds:.3g} s"
        return Sheet(self.title, ("", ""), tuple(told.items()), texts=2)

    @property
    def owner(self) -> Ints:
        """The particle of each knot, (K,)."""
        return np.repeat(np.arange(self.count), np.diff(self.offsets))

    def track(self, particle: int) -> NDArray[Any]:
        """Return the knots of one particle, shape (k,)."""
        return self.knots[self.offsets[particle] : self.offsets[particle + 1]]

    def ends(self) -> tuple[NDArray[Any], NDArray[Any]]:
        """Return the first and last knots of all released particles, each of shape (n,)."""
        if len(self.knots) == 2 * self.count and (np.diff(self.offsets) == 2).all():
            # Of these, as of a family of which only ends are kept, no row has to be copied.
            return self.knots[::2], self.knots[1::2]
        first, end = self.offsets[:-1][self.released], self.offsets[1:][self.released]
        # Indexing would copy rows field by field, which takes fifty times as long.
        return self.knots.take(first), self.knots.take(end - 1)

    def surface_index(self, name: str) -> int:
        """Return the index of a surface, or -1 if the scene has none of that name."""
        return self.surfaces.index(name) if name in self.surfaces else -1

    @cached_property
    def labels(self) -> tuple[NDArray[np.int8], NDArray[np.int16], Ints]:
        """Kind, surface and particle of each event: rows of events are long, and these short."""
        kind, surface, particle = (self.events[name] for name in ("kind", "surface", "particle"))
        return kind.copy(), surface.copy(), particle.copy()

    def which(self, *kinds: Kind | str, surface: str | None = None) -> Ints:
        """Return the indices of events, see `select`."""
        if surface is not None and surface not in self.surfaces:
            there = f"the scene has {', '.join(self.surfaces)}"
            raise InputError(did_you_mean(surface, self.surfaces, there), "surface", surface)
        own, place, _ = self.labels
        keep: Bools = np.ones(len(own), dtype=bool)
        if surface is not None:
            keep = place == self.surface_index(surface)
        if kinds:
            # Several times as fast as `np.isin` for few events, as those of one particle.
            keep &= np.logical_or.reduce([own == kind for kind in map(kind_of, kinds)])
        return np.flatnonzero(keep)

    def select(self, *kinds: Kind | str, surface: str | None = None) -> NDArray[Any]:
        """Return events, sorted by time.

        Parameters
        ----------
        *kinds : Kind or str
            Their kinds, ``Kind.IMPACT`` or ``"impact"``; all if none is given.
        surface : str, optional
            Only those on this surface of the scene.

        Raises
        ------
        InputError
            If there is no such kind, or the scene has no such surface.
        """
        return self.events.take(self.which(*kinds, surface=surface))

    def first(self, events: NDArray[Any]) -> NDArray[Any]:
        """Reduce events to the first one of each particle, in the order of the particles."""
        index, particle = np.full(self.count, -1), events["particle"].astype(np.int64)
        # Of several assignments the last one stays.
        index[particle[::-1]] = np.arange(len(particle))[::-1]
        return events.take(index[index >= 0])

    def pose(self, name: str, times: ArrayLike) -> Floats:
        """Return the pose of a moving surface: x, y of its pivot, m, and its angle, rad, (T, 3).

        The pivot is that of the scene file; without one it is the first point, or the centre of an
        arc.

        Parameters
        ----------
        name : str
            A surface that moves.
        times : array_like, shape (T,)
            s, in any order.

        Raises
        ------
        InputError
            If no surface of that name moves.
        """
        movers = {self.machine.surfaces[mover.surface]: mover for mover in self.machine.movers}
        must_move(name, list(movers))
        return movers[name].pose(np.atleast_1d(times))

    def blocks(self, times: Floats) -> Iterator[Cells]:
        """Find for each particle the knots before and after times (T,), s, in any order.

        Block by block in the order of the times; see `Cells`.
        """
        t, offsets = self.knots["t"], self.offsets
        released = np.flatnonzero(offsets[1:] > offsets[:-1])
        first, last = offsets[released], offsets[released + 1] - 1
        rows = max(1, CELLS // max(1, len(released)))
        for begin in range(0, len(times), rows):
            now = times[begin : begin + rows, None]
            row, column = np.nonzero((now >= t[first]) & (now <= t[last]))
            at = times[begin + row]
            # The last knot in [left, right) whose time is not later, by bisection of all at once.
            left, right = first[column], last[column]
            while np.any(right - left > 1):
                middle = (left + right) // 2
                passed = t[middle] <= at
                left, right = np.where(passed, middle, left), np.where(passed, right, middle)
            h = t[left + 1] - t[left]
            share = np.divide(at - t[left], h, out=np.ones_like(h), where=h > 0.0)
            yield begin + row, released[column], left, share

    def at(self, times: ArrayLike) -> Motion:
        """Return positions (m) and velocities (m/s), (T, N, 2), at times (T,), s, in any order.

        The result is a pair of arrays, and has `Motion.angle` and `Motion.omega`, (T, N).
        """
        times = np.atleast_1d(np.asarray(times, dtype=np.float64))
        position, velocity = np.full((2, len(times), self.count, 2), np.nan)
        for row, particle, left, share in self.blocks(times):
            where, pace = hermite(self.knots, left, share)
            position[row, particle], velocity[row, particle] = where, pace
        return Motion(position, velocity, self, times)

    def energies(
        self, knots: NDArray[Any], particle: Ints | int | None = None
    ) -> tuple[Floats, Floats]:
        """Return kinetic (rotation included) and potential energy (J) of knots of any shape.

        `particle` has the particle of each; it is not needed if all particles are alike.
        """
        body = self.particle if particle is None else self.particle.of(particle)
        vx, vy = knots["velocity"][..., 0], knots["velocity"][..., 1]
        potential = body.mass * self.gravity * self.machine.height(knots["position"])
        return body.kinetic(vx, vy, knots["omega"]), potential


Args = ParamSpec("Args")
Result = TypeVar("Result")


def kept(
    reader: Callable[Concatenate[Record, Args], Result],
) -> Callable[Concatenate[Record, Args], Result]:
    """Cache a reader's result in its record, for each further arguments; arrays are read-only."""
    form = signature(reader)
    name, usual = (reader.__module__, reader.__name__), [*form.parameters.values()][1:]
    defaults = [one.default for one in usual]

    @wraps(reader)
    def read(record: Record, /, *args: Args.args, **more: Args.kwargs) -> Result:
        key: tuple[Any, ...] = (*name, *args, *defaults[len(args) :])
        if more:
            given = form.bind(record, *args, **more)
            given.apply_defaults()
            key = (*name, *given.args[1:])
        if key not in record.found:
            record.found[key] = found = reader(record, *args, **more)
            if isinstance(found, np.ndarray):
                found.flags.writeable = False
        result: Result = record.found[key]
        return result

    return read
