"""What a law looks at, a run and the numbers in play, and how it answers."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from functools import cached_property
from math import sqrt
from operator import itemgetter
from typing import TYPE_CHECKING, Any

import numpy as np

from chutelab.machine import Machine
from chutelab.results.ledger import ledger
from chutelab.results.recording import Recording
from chutelab.results.surfaces import Bow, Piece, pieces
from chutelab.util.arrays import Bools, Floats, Ints

if TYPE_CHECKING:
    from chutelab.results.barriers import Hit

EPS = float(np.finfo(np.float64).eps)

PRESSED = 0.05
"""Share of the radius by which disks of a crowd may be pressed into each other or into a surface:
what the contact engine promises. A solver that iterates leaves some."""

SLOP = 1e-3
"""The same that Chipmunk and the contact engine leave alone."""

PARTS, DEEP, OPENS, GIVES = 0.1, 0.03, 1e-2, 3e-3
"""How the contact engine parts overlaps in a crowd: which share of one in a step, that of one as
deep as `DEEP` radii all; by how many radii at most; and how much less for an impulse, in m/s times
the heaviest mass."""

SMOOTH = 1e-4
"""m/s on Earth, see `Machine.pace`: what a track of the contact engine in a crowd may leave out."""

BULGE = 1e-5
"""Share of the radius by which the cubic between two knots may be off the way of a particle by
itself with the contact engine, which writes a knot where it would be more."""

A_CONTACT = 2.0
"""eps that one contact may move an energy by: half an ulp for each of two velocity components, a
height and a sum."""

BOOKED = 1e-9
"""Share of the energy turned over that the contact engine may misbook in a crowd: its promise."""

ROUGH = 1e-4
"""Share of the radius by which a track of the pymunk engine may be off between two knots."""

HAIR = 1e-10
"""Share of the radius by which the pymunk engine's disks are larger, and so their levers."""

ROUNDINGS = 500.0
"""Roundings that one number may have gone through between two contacts: some ten operations, each
on numbers up to some ten times as large as what comes out."""

ON_ARCS = 1e-9
"""Share of its radius by which a cubic between two knots may leave a circle: the recording's
contract."""


def _most(value: Any) -> float:
    """Return a number, or the largest of several: NumPy takes microseconds to find that of one."""
    return value if isinstance(value, float) else float(np.max(value))


def _size(values: Floats) -> float:
    """Return the largest size of some finite numbers; 0 of none."""
    if values.size > 32:
        return float(np.abs(values).max())
    # Several times as fast of few.
    return max(map(abs, values.ravel().tolist()), default=0.0)


def _of(value: Any, which: Any) -> Any:
    return value if np.ndim(value) == 0 else value[which]


def overlaps(places: Floats, radii: Floats) -> tuple[Floats, Floats]:
    """Return how deep disks (N, 2), (N,), m, are in each other, (P,), m, and the lesser radii."""
    order, most = np.argsort(places[:, 0]), float(radii.max(initial=0.0))
    x = places[order, 0]
    ahead = np.searchsorted(x, x + 2.0 * most, side="right") - np.arange(1, len(x) + 1)
    first = np.repeat(np.arange(len(x)), ahead)
    then = first + 1 + np.arange(len(first)) - np.repeat(np.cumsum(ahead) - ahead, ahead)
    i, j = order[first], order[then]
    depth = radii[i] + radii[j] - np.hypot(*(places[i] - places[j]).T)
    return depth[depth > 0.0], np.minimum(radii[i], radii[j])[depth > 0.0]


@dataclass(frozen=True, eq=False)
class Evidence:
    """One run: the scene, resolved, and what an engine made of it."""

    machine: Machine
    recording: Recording

    @property
    def engine(self) -> str:
        """Engine that ran."""
        return self.recording.engine

    @property
    def dt(self) -> float | None:
        """Its step, s; None for the exact engine."""
        return None if self.engine == "exact" else self.machine.dt

    @property
    def crowd(self) -> bool:
        """Whether particles meet each other."""
        return self.machine.interact

    @cached_property
    def columns(self) -> Floats:
        """The numbers of all knots, each in a row, (9, K), in the order of `KNOT`."""
        knots = self.recording.knots
        if not len(knots):
            return np.empty((9, 0))
        return np.frombuffer(knots, np.float64).reshape(len(knots), -1).T.copy()

    @cached_property
    def sizes(self) -> Floats:
        """Largest size of each number of a knot, (9,); NaN if one is. Of one knot or more."""
        low, high = np.minimum.reduce(self.columns, axis=1), np.maximum.reduce(self.columns, axis=1)
        return np.asarray(np.maximum(-low, high))

    @property
    def alike(self) -> bool:
        """Whether all is left to Chipmunk, in steps that are all alike."""
        m = self.machine
        return self.engine == "pymunk" and (
            m.interact
            or not m.align
            or len(m.threads) > 0
            or any(o is not None for o in m.outlines)
        )

    @property
    def family(self) -> bool:
        """Whether each particle has a machine of its own, see `Machine`."""
        return self.machine.segments.length.ndim > 1

    @cached_property
    def pieces(self) -> list[Piece]:
        """All pieces of its surfaces."""
        return pieces(self.machine)

    def pieces_of(self, particle: int) -> list[Piece]:
        """Return the pieces that a particle may meet: of a family those of its own machine."""
        return pieces(self.machine, particle) if self.family else self.pieces

    @cached_property
    def radius_of(self) -> Any:
        """Radius of the particles, m, or of each, (N,); of one with corners the circle inside."""
        m = self.machine
        if all(outline is None for outline in m.outlines):
            return m.particle.radius
        found = np.broadcast_to(np.asarray(m.particle.radius, dtype=float), m.count).copy()
        for kind, corners in enumerate(m.outlines):
            if corners is not None:
                edge = np.roll(corners, -1, axis=0) - corners
                off = corners[:, 0] * edge[:, 1] - corners[:, 1] * edge[:, 0]
                found[m.releases.kind == kind] = (off / np.hypot(*edge.T)).min()
        return found

    @cached_property
    def sized(self) -> bool:
        """Whether particles have a size; a mass point has none."""
        return -_most(-self.radius_of) > 0.0

    @cached_property
    def radii(self) -> Floats:
        """Radius of each particle, (N,), m."""
        return self._of_each(self.radius_of)

    @cached_property
    def masses(self) -> Floats:
        """Mass of each particle, (N,), kg."""
        return self._of_each(self.machine.particle.mass)

    @cached_property
    def inertias(self) -> Floats:
        """Moment of inertia of each particle, (N,), kg m²."""
        return self._of_each(self.machine.particle.inertia)

    def _of_each(self, value: Any) -> Floats:
        return np.broadcast_to(np.asarray(value, dtype=float), self.recording.count)

    @cached_property
    def gravity(self) -> float:
        """m/s²; of a family the largest."""
        return _most(self.machine.gravity)

    @cached_property
    def speed(self) -> float:
        """Largest speed of anything that moves, belts included, m/s."""
        m = self.machine
        belts = [_size(m.segments.speed), _size(m.arcs.speed)]
        if m.pulley is not None:
            belts.append(_most(np.abs(m.pulley.speed)))
        return max(*belts, sqrt(_size(self.paces)))

    @cached_property
    def paces(self) -> Floats:
        """Square of the speed at each knot, (K,), m²/s²."""
        vx, vy = self.columns[3:5]
        return np.asarray(vx * vx + vy * vy)

    @cached_property
    def length(self) -> float:
        """Largest length in play, m: coordinates, radii, and the way made while the clock ran.

        The clock's own rounding moves a particle: half an ulp of t, times its speed.
        """
        m = self.machine
        size = max(self.radius, _size(m.segments.start) + _size(m.segments.length))
        if m.arcs.radius.size:
            size = max(size, _size(m.arcs.center) + _size(m.arcs.radius) + self.radius)
        if m.pulley is not None:
            size = max(size, _most(m.pulley.radius) + self.radius)
        if self.columns.size:
            t, x, y = self.sizes[:3].tolist()
            size = max(size, x, y, self.speed * t)
        return size

    @cached_property
    def energies(self) -> tuple[Floats, Floats]:
        """Kinetic and potential energy at each knot, (K,), J."""
        body, g = self.recording.particle, self.machine.gravity
        mass: Any = body.mass
        inertia: Any = body.inertia
        if np.ndim(g) or np.ndim(mass) or np.ndim(inertia):
            owner = self.recording.owner
            mass, inertia, g = (_of(value, owner) for value in (mass, inertia, g))
        kinetic = 0.5 * mass * self.paces
        omega = self.columns[5]
        kinetic += 0.5 * inertia * (omega * omega)
        return kinetic, mass * g * self.columns[2]

    @cached_property
    def gain(self) -> Floats:
        """Energy at each knot, less what the books say it got, (K,), J: what is unexplained."""
        kinetic, potential = self.energies
        belt, restitution, friction = self.columns[6:]
        gain = kinetic + potential
        booked = belt - restitution
        booked -= friction
        gain -= booked
        return gain

    @cached_property
    def within(self) -> Bools:
        """Tell after which knots another one of the same particle comes, (K - 1,)."""
        same = np.ones(len(self.recording.knots) - 1, dtype=bool)
        same[self.ends[0][1:] - 1] = False
        return same

    @cached_property
    def ends(self) -> tuple[Ints, Ints]:
        """First and last knot of each particle that was released, (n,)."""
        first, beyond = self.recording.offsets[:-1], self.recording.offsets[1:]
        there = beyond > first
        if not there.all():
            first, beyond = first[there], beyond[there]
        return first, beyond - 1

    @cached_property
    def energy(self) -> float:
        """Energy in play, J: what every particle had at most, and what was booked on it.

        Of a crowd it is what was turned over.
        """
        if self.crowd or not len(self.recording.knots):
            return ledger(self.recording).turned_over
        kinetic, potential = self.energies
        height = np.add.reduce(np.abs(self.columns[6:]), axis=0)
        height += np.abs(potential)
        height += kinetic
        return float(np.maximum.reduceat(height, self.ends[0]).sum())

    @cached_property
    def energy_bound(self) -> float:
        """What numbers may do to the energy, as a share of the energy in play.

        Contacts round it. In a stepped engine each contact moves it, besides, by the weight times
        `late`, where an overlap is parted: impulses themselves are booked to the last bit.
        """
        rounding = EPS * (ROUNDINGS + A_CONTACT * self.recording.contacts)
        if self.dt is None:
            return rounding
        if self.crowd and self.engine == "contact":
            return BOOKED
        steps = EPS * A_CONTACT * self.recording.steps
        touched = max(1, self.recording.contacts)
        if self.engine != "contact":
            steps += touched * HAIR
        pulled = touched * float(self.masses.max()) * self.gravity * self.late
        return rounding + steps + (pulled / self.energy if self.energy else 0.0)

    @cached_property
    def parted(self) -> float:
        """Energy that parting overlaps may give, J: no more than lifts all by how deep they were.

        Of lone particles a knot in contact holds the mean velocity of a step, half a step's pull
        off its books: that of the weight along the way, and across it that of an arc's inside.
        """
        if self.dt is None:
            return 0.0
        if not self.crowd:
            heaviest = float(self.masses.max())
            across = 0.5 * (0.5 * self.bent * self.dt) ** 2
            return heaviest * (self.speed * self.gravity * self.dt + across)
        allowed = float(self.masses.sum()) * self.gravity * self.late
        if self.alike:
            # The pymunk engine leaves out touches that move a track by less than `ROUGH` of the
            # radius. A cubic whose end velocity is off by w is off by 4/27 w τ in place, τ a step
            # or more.
            off = 27.0 / 4.0 * ROUGH * self.radius / self.dt
            allowed += 2.0 * float(self.masses.max()) * self.speed * off
        return allowed

    @cached_property
    def untold(self) -> float:
        """Energy that a crowd's tracks may leave out between two knots, J.

        m v w, where constant acceleration is as good as the true way but for a velocity w.
        """
        if not self.crowd or self.engine != "contact":
            return 0.0
        return float(self.masses.sum() * self.speed * SMOOTH * self.machine.pace)

    def opened(self, times: Floats) -> Floats:
        """Return the energy that parting overlaps may give in the steps at times (T,), J.

        A solve raises the kinetic energy by at most the sum of J a, J the impulse of a contact and
        a the speed with which it is to open. Of an overlap d that is a = p d / h - c J, a spring's,
        with c = 0.003 / M: J a is at most (p d / h)² / (4 c). See docs/physics.md.
        """
        m, radii, found = self.machine, self.radii, np.zeros(len(times))
        step = m.dt if m.gravity == 0.0 else min(m.dt, sqrt(8e-3 * float(radii.min()) / m.gravity))
        for n, x in enumerate(self.recording.at(times)[0]):
            there = np.isfinite(x[:, 0])
            both = [overlaps(x[there], radii[there])]
            both += [
                (-piece.gap(x[there], radii[there]), radii[there])
                for piece in self.pieces
                if piece.there(times[n])
            ]
            depth, least = (np.concatenate(some) for some in zip(*both, strict=True))
            deep = depth / least
            part = np.minimum(np.maximum(PARTS, deep / DEEP), 1.0) * np.maximum(deep - SLOP, 0.0)
            speed = np.minimum(part, OPENS) * least / step
            found[n] = float(self.masses.max()) / (4.0 * GIVES) * float((speed * speed).sum())
        return found

    @property
    def rounding(self) -> float:
        """What rounding may do to a length, m."""
        return ROUNDINGS * EPS * self.length

    @cached_property
    def radius(self) -> float:
        """Radius of the largest particle, m."""
        return _most(self.machine.particle.radius)

    @property
    def bows(self) -> list[Bow]:
        """Its bent pieces, the drive pulley among them."""
        return [piece for piece in self.pieces if isinstance(piece, Bow)]

    @property
    def arcs(self) -> float:
        """How far a curve between two knots may leave the way along an arc or round an end, m."""
        m = self.machine
        bent = _size(m.arcs.radius)
        if m.pulley is not None:
            bent = max(bent, _most(m.pulley.radius))
        return ON_ARCS * (self.radius + bent)

    @property
    def side(self) -> float:
        """How far from a line a centre has to be to be on one side of it, m."""
        return max(self.rounding, ON_ARCS * self.radius)

    @cached_property
    def allowed(self) -> float:
        """How deep a disk may be in a surface, m: by rounding, the curve between knots, a step."""
        bulge = BULGE * self.radius if self.engine == "contact" and not self.crowd else 0.0
        return self.rounding + self.arcs + self.late + bulge

    @cached_property
    def limit_of(self) -> Any:
        """How near a centre may come to a surface, m, of all particles or of each, (N,).

        Of a mass point only the side counts: it may be beyond by what is allowed.
        """
        radius = self.radius_of
        if np.ndim(radius) == 0:
            return max(radius - self.allowed, 0.0) if radius else -self.allowed
        return np.where(radius == 0.0, -self.allowed, np.maximum(radius - self.allowed, 0.0))

    @cached_property
    def hits(self) -> list[Hit]:
        """Where particles are too deep in surfaces, or pass them, see `results.barriers`."""
        from chutelab.results.barriers import hits

        return hits(self)

    @cached_property
    def bent(self) -> float:
        """Largest acceleration towards the centre of an arc that one moves along inside, m/s².

        Outside it is never more than gravity's: what is faster leaves.
        """
        if not self.machine.arcs.radius.size:
            # No particle is inside the drive pulley.
            return 0.0
        found, places = 0.0, self.recording.knots["position"]
        radii = self.radii[self.recording.owner]
        for bow in self.bows:
            inner = bow.radius - radii
            off = np.abs(bow.beside(places) + radii)
            along = (inner > 0.0) & (off < 0.1 * radii) & bow.within(places, 0.0)
            if along.any():
                found = max(found, float((self.paces[along] / inner[along]).max()))
        return found

    @property
    def late(self) -> float:
        """How far beyond a surface a step may take a disk, m; 0 for the exact engine.

        Where steps are all alike a contact is seen up to a step late, so by the way of a step, and
        Chipmunk leaves its slop. A lone particle's blows are found at their own instants; where it
        stays in contact a step goes straight on, off by less than a dt². On a straight surface a is
        the weight, on a rim it is v²/ρ besides, which is no more than g where it does not lift off;
        inside an arc it may be more.
        In a crowd of the contact engine disks are pressed, by what `PRESSED` says.
        """
        if self.dt is None:
            return 0.0
        if self.alike:
            return self.speed * self.dt + SLOP * self.radius
        if self.crowd:
            return PRESSED * self.radius
        return (2.0 * self.gravity + self.bent) * self.dt**2


@dataclass(frozen=True)
class Verdict:
    """What a law found."""

    figure: float  # the worst there was
    bound: float  # what it must not exceed
    detail: str = ""  # unit, and where it was
    law: str = ""
    unpromised: str = ""  # why the engine does not promise a law that is not kept; "" if it does

    @property
    def holds(self) -> bool:
        """Whether the law is kept; it never is by a figure that is no number."""
        return self.figure <= self.bound

    @property
    def broken(self) -> bool:
        """Whether a promised law is not kept."""
        return not self.holds and not self.unpromised


def worst(found: Iterable[tuple[float, str]], bound: float, unit: str) -> Verdict:
    """Return the verdict on the largest of some figures, each with where it was; at least 0."""
    figure, where = max([(0.0, ""), *found], key=itemgetter(0))
    return Verdict(float(figure), bound, f"{unit}, {where}" if where else unit)
