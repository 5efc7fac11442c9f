"""What the parts of the engine share while one world runs."""

from __future__ import annotations

from math import ceil, floor, sqrt
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from chutelab.recording import EVENT, Kind
from chutelab.stepper.crowd import Crowd
from chutelab.stepper.curves import leave
from chutelab.stepper.idle import Idle
from chutelab.stepper.stays import Stays
from chutelab.stepper.tracks import Tracks
from chutelab.stepper.world import World

if TYPE_CHECKING:
    from chutelab.machine import Machine
    from chutelab.recorder import Recorder
    from chutelab.stepper.clash import Clashes
    from chutelab.stepper.solids import Solids

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]

HAIR = 2e-3
"""Share of the radius by which particles in contact may overlap before a step parts them. It also
bounds the step where `run.dt` is coarse or particles are small: gravity must not do more, g dt²."""


def step(machine: Machine, start: float) -> float:
    """Return the length of the steps from `start` (s) on, s; the last one ends with the run."""
    dt, whole = machine.dt, machine.end_time - start
    if machine.align and machine.gravity > 0.0:
        dt = min(dt, sqrt(HAIR * machine.particle.radius / machine.gravity))
    return whole / ceil(whole / dt - 1e-9) if whole > 0.0 else dt


class Run:
    """One world, its particles and their books.

    Attributes
    ----------
    count : int
        Number of particles in this world.
    dt : float
        s, the step.
    landed : ndarray of bool, (N,)
        Has met the outgoing belt.
    met : ndarray of bool, (N, K)
        Has met a solid.
    clashes : Clashes
        Where impacts are resolved.
    stays : Stays
        Who lies on which surface.
    calm : ndarray, (N,)
        Steps in a row without slip on a surface to settle on.
    touching : ndarray
        Keys of the contacts a step ago, sorted.
    ahead : tuple of ndarray, (M,), (M,) and (M, 3)
        Particles, surfaces and entries (J) of the second half of the last step's impulses.
    entries : ndarray, (N, 3)
        Ledger entries (J) of each particle.
    start, now : float
        s, from where steps are counted, and when the last one ended.
    inside : ndarray of bool, (N,)
        Whether pymunk has a body for the particle.
    version : ndarray, (N,)
        Counts the paths of each particle; what was foretold of an older one is void.
    crowd : Crowd
        Who had how many impacts lately.
    fresh : list of int
        Particles on new paths, of which nothing was foretold yet.
    sunk : ndarray, (N, 2)
        By how much the next step finds a particle deeper in what it was laid on, m.
    moved : ndarray of bool, (N,)
        Whether pymunk's body has to be put on the path anew.
    soft : float
        m/s; the speed that gravity gives in a step: what approaches more slowly does not bounce.
    slow : float
        m/s; in a step it leads to an overlap of a `HAIR` at most: what is in contact, and meets
        others more slowly, is left to the step.
    bend, bent : ndarray, (N,)
        Curvature of the path along the solid that a particle in contact goes round, and went round
        a step ago, 1/m; 0 on a face.
    """

    def __init__(
        self,
        machine: Machine,
        solids: Solids,
        recorder: Recorder,
        ids: Ints,
        start: float,
        clashes: Clashes,
    ) -> None:
        self.count = count = len(ids)
        self.machine, self.solids, self.recorder, self.ids = machine, solids, recorder, ids
        # Particles of one world follow each other.
        self.entries = recorder.entries[ids[0] : ids[-1] + 1]
        self.start, self.dt, self.now = start, step(machine, start), start
        self.clashes = clashes
        self._world: World | None = None
        self.tracks = Tracks(machine, recorder, ids)
        p = machine.particle
        self.radius, self.mass = p.radius, p.mass
        self.rolling_mass = (
            1.0 / (1.0 / p.mass + p.radius**2 / p.inertia) if p.inertia > 0.0 else p.mass
        )
        self.gravity = np.array([0.0, -machine.gravity])
        self.landed = np.zeros(count, dtype=bool)
        self.met = np.zeros((count, max(len(solids.reach), 1)), dtype=bool)
        self.stays = Stays(self)
        self.calm = np.zeros(count, dtype=np.int64)
        self.touching = np.empty(0, dtype=np.int64)
        self.ahead: tuple[Ints, Ints, Floats] = self.touching, self.touching, np.empty((0, 3))
        self.inside = np.zeros(count, dtype=bool)
        self.version = np.zeros(count, dtype=np.int64)
        self.fresh: list[int] = []
        self.moved = np.zeros(count, dtype=bool)
        self.soft = machine.gravity * self.dt
        self.slow = max(self.soft, HAIR * p.radius / self.dt)
        self.bend, self.bent = np.zeros((2, count))
        self.sunk = np.zeros((count, 2))
        self.idle = Idle(self)
        self.crowd = Crowd(self)
        self._told: list[tuple[Any, ...]] = []

    @property
    def world(self) -> World:
        """The Space for what is in contact, built when something is."""
        if self._world is None:
            self._world = World(self.machine, self.solids, self.count)
        return self._world

    def begun(self, keys: Ints) -> NDArray[np.bool_]:
        """Tell which contacts, by their sorted keys (M,), were not there a step ago."""
        known = self.touching
        if not len(known):
            return np.ones(len(keys), dtype=bool)
        return np.asarray(known.take(known.searchsorted(keys), mode="clip") != keys)

    @property
    def particles(self) -> int:
        """Index of the surface under which contacts between particles are booked."""
        return len(self.machine.surfaces)

    def event(
        self,
        kind: Kind | ArrayLike,
        who: Ints,
        t: ArrayLike,
        x: ArrayLike,
        v: ArrayLike,
        omega: ArrayLike,
        surface: ArrayLike = -1,
        other: ArrayLike = -1,
        *,
        velocity_before: ArrayLike | None = None,
        omega_before: ArrayLike | None = None,
        impulse: tuple[ArrayLike, ArrayLike] = (0.0, 0.0),
    ) -> None:
        """Write an event for each of some particles."""
        if len(who):
            self.recorder.events(
                kind, self.ids[who], t, x, v, omega,
                velocity_before=velocity_before, omega_before=omega_before, surface=surface,
                other=other, normal_impulse=impulse[0], tangential_impulse=impulse[1],
            )  # fmt: skip

    def finish(self, who: Ints, reason: str) -> None:
        """End tracks at their last knots and take the particles out."""
        self.tracks.finish(who, reason)
        for i in who.tolist():
            self.stays.tell_separation(i)
            self.changed(i)
        for i in who[self.inside[who]].tolist():
            self.world.remove(i)
        self.inside[who] = False

    def next_tick(self, t: float) -> float:
        """Return the time of the next step after t, s."""
        # What is a millionth of a step before one is on it: times are rounded.
        tick = self.start + (floor((t - self.start) / self.dt + 1e-6) + 1) * self.dt
        end = self.machine.end_time
        return end if abs(tick - end) < 1e-6 * self.dt and end > t else tick

    def sinks(self, off: float, upright: float, t: float) -> float:
        """Return how deep the next step finds what leaves a face at t, m; negative if it is off.

        Parameters
        ----------
        off : float
            Its speed along the normal, m/s.
        upright : float
            The normal's part upwards.
        """
        span = self.next_tick(t) - t
        return span * (0.5 * span * self.machine.gravity * upright - off)

    def turned(self, push: float) -> float:
        """Return the change of ω by a tangential impulse (N s), rad/s."""
        inertia = self.machine.particle.inertia
        return self.radius * push / inertia if inertia > 0.0 else 0.0

    def rest(
        self,
        i: int,
        normal: tuple[float, float] = (0.0, 0.0),
        solid: int = -1,
        curvature: float = 0.0,
        sunk: tuple[float, float] = (0.0, 0.0),
    ) -> None:
        """Let a particle rest from its last knot on.

        Parameters
        ----------
        normal, solid, curvature
            Of the solid it lies on, if it does; the last is that of its path, 1/m.
        sunk : tuple of float
            By how much the next step is to find it deeper in what it rests on, m.
        """
        self.tracks.stay(i, normal, solid if curvature == 0.0 else -1)
        self.bend[i], self.sunk[i] = curvature, sunk
        self.changed(i)

    def take_off(self, i: int) -> None:
        """Let a particle fly from its last knot."""
        self.tracks.fly(i)
        self.changed(i)

    def book(self, i: int, surface: int, belt: float, restitution: float, friction: float) -> None:
        """Book ledger entries (J) on one particle, and on the surface it met."""
        entries = self.entries[i], self.recorder.by_surface[surface]
        for row in entries:
            row[0] += belt
            row[1] += restitution
            row[2] += friction

    def tell(
        self,
        kind: Kind,
        i: int,
        j: int,
        surface: int,
        velocity: tuple[float, float],
        omega: float,
        impulse: tuple[float, float],
    ) -> None:
        """Write the event of an impact of particle i after its last knot."""
        k = self.tracks
        self._told.append(
            (
                float(k.t[i]), self.ids[i], self.ids[j] if j >= 0 else -1, kind, surface,
                tuple(k.x[i].tolist()), velocity, tuple(k.v[i].tolist()), omega,
                float(k.omega[i]), *impulse,
            )
        )  # fmt: skip
        self.recorder.contacts += 1

    def flush(self) -> None:
        """Hand over what was written one by one."""
        self.tracks.flush()
        self.recorder.tell(np.array(self._told, dtype=EVENT))

    def changed(self, i: int) -> None:
        """Note that a particle is on a new path."""
        self.version[i] += 1
        self.moved[i] = True
        self.fresh.append(i)

    def lift(self, who: Ints, t: float) -> None:
        """Let go what is in contact no more; whether it separated, its flight will tell."""
        for i in who.tolist():
            curved = self.bend[i] > 0.0 and self.tracks.from_t[i] == t
            if not (curved and leave(self, i, t)):
                self.tracks.lift(i, t, self.dt)
            self.changed(i)
            self.stays.left(i, t)
