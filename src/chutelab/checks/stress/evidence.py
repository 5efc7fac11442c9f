"""What a law looks at, a run and the numbers in play, and how it answers."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from functools import cached_property
from operator import itemgetter
from typing import Any

import numpy as np

from chutelab.checks.stress.surfaces import Bow, Piece, pieces
from chutelab.machine import Machine
from chutelab.results import Recording
from chutelab.results.ledger import ledger
from chutelab.results.recording import hermite
from chutelab.util.arrays import Floats, Ints

EPS = float(np.finfo(np.float64).eps)

PRESSED = 0.05
"""Share of the radius by which disks of a crowd may be pressed into each other or into a surface:
what the contact engine promises. A solver that iterates leaves some."""

SLOP = 1e-3
"""The same that Chipmunk is told to leave alone."""

ROUNDINGS = 500.0
"""Roundings that one number may have gone through between two contacts: some ten operations, each
on numbers up to some ten times as large as what comes out."""

ON_ARCS = 1e-9
"""Share of its radius by which a cubic between two knots may leave a circle: the recording's
contract."""

PIECES = 16
"""Parts into which an interval between two knots is cut to look for what happens inside."""

MOST_SAMPLES = 2_000_000
"""Samples beyond which intervals are cut into fewer parts, to bound the memory (some 100 MB)."""


@dataclass(frozen=True, eq=False)
class Samples:
    """Places on all tracks, one after the other, each in the order of time; arrays (M, ...)."""

    particle: Ints
    t: Floats  # s
    position: Floats  # (M, 2), m
    left: Ints  # knot before it
    share: Floats  # part of the interval to the next knot that has passed


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

    @property
    def alike(self) -> bool:
        """Whether all is left to Chipmunk, in steps that are all alike."""
        return self.engine == "pymunk" and (self.crowd or not self.machine.align)

    @cached_property
    def pieces(self) -> list[Piece]:
        """All pieces of its surfaces."""
        return pieces(self.machine)

    @cached_property
    def radii(self) -> Floats:
        """Radius of each particle, (N,), m."""
        return self._of_each(self.machine.particle.radius)

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
    def samples(self) -> Samples:
        """Every knot, and places between: what happens in between is no shorter than a piece."""
        knots, offsets = self.recording.knots, self.recording.offsets
        owner = np.repeat(np.arange(self.recording.count), np.diff(offsets))
        left = np.flatnonzero(owner[1:] == owner[:-1])
        pieces = int(np.clip(MOST_SAMPLES // max(1, len(left)), 1, PIECES))
        shares = np.linspace(0.0, 1.0, pieces + 1)
        index = np.repeat(left, len(shares))
        share = np.tile(shares, len(left))
        h = knots["t"][index + 1] - knots["t"][index]
        position = self.between(index, share)
        return Samples(owner[index], knots["t"][index] + share * h, position, index, share)

    def between(self, left: Ints, share: Floats) -> Floats:
        """Return positions (c, 2) between knots `left` (c,) and the ones that follow them, m."""
        knots = self.recording.knots
        return np.stack([hermite(knots, left, share, axis)[0] for axis in (0, 1)], axis=-1)

    @cached_property
    def speed(self) -> float:
        """Largest speed of anything that moves, belts included, m/s."""
        moving = max((abs(piece.speed) for piece in self.pieces), default=0.0)
        velocity = self.recording.knots["velocity"]
        if len(velocity):
            moving = max(moving, np.hypot(velocity[:, 0], velocity[:, 1]).max())
        return float(moving)

    @cached_property
    def length(self) -> float:
        """Largest length in play, m: coordinates, radii, and the way made while the clock ran.

        The clock's own rounding moves a particle: half an ulp of t, times its speed.
        """
        m = self.machine
        ends = np.concatenate([m.segments.start, m.segments.end]).ravel()
        size = max(np.abs(ends).max(initial=0.0), self.radius)
        for bow in self.bows:
            size = max(size, np.abs(bow.center).max() + bow.radius + self.radius)
        if len(self.samples.t):
            size = max(size, np.abs(self.samples.position).max())
            size = max(size, self.speed * np.abs(self.samples.t).max())
        return float(size)

    @cached_property
    def energy(self) -> float:
        """Energy in play, J: what every particle had at most, and what was booked on it.

        Of a crowd it is what was turned over.
        """
        if self.crowd or not len(self.recording.knots):
            return ledger(self.recording).turned_over
        kinetic, potential = self.recording.energies(self.recording.knots, self.recording.owner)
        height = kinetic + np.abs(potential) + np.abs(self.recording.knots["entries"]).sum(axis=1)
        offsets = self.recording.offsets
        starts = offsets[:-1][offsets[1:] > offsets[:-1]]
        return float(np.maximum.reduceat(height, starts).sum())

    @property
    def rounding(self) -> float:
        """What rounding may do to a length, m."""
        return ROUNDINGS * EPS * self.length

    @property
    def radius(self) -> float:
        """Radius of the largest particle, m."""
        return float(np.max(self.machine.particle.radius))

    @property
    def bows(self) -> list[Bow]:
        """Its bent pieces, the drive pulley among them."""
        return [piece for piece in self.pieces if isinstance(piece, Bow)]

    @cached_property
    def arcs(self) -> float:
        """How far a cubic between two knots may leave the way along an arc or round an end, m."""
        return ON_ARCS * (self.radius + max((bow.radius for bow in self.bows), default=0.0))

    @cached_property
    def bent(self) -> float:
        """Largest acceleration towards the centre of an arc that somebody moves along inside, m/s².

        Outside it is never more than gravity's: what is faster leaves.
        """
        found, radii = 0.0, self.radii[self.samples.particle]
        for bow in self.bows:
            inner = bow.radius - radii
            off = np.abs(bow.beside(self.samples.position) + radii)
            along = (inner > 0.0) & (off < 0.1 * radii) & bow.within(self.samples.position, 0.0)
            if along.any():
                found = max(found, self.speed**2 / float(inner[along].min()))
        return found

    @cached_property
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
        return (2.0 * self.machine.gravity + self.bent) * self.dt**2


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
