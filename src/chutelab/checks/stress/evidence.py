"""What a law looks at, a run and the numbers in play, and how it answers."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from functools import cached_property
from operator import itemgetter
from typing import Any

import numpy as np

from chutelab.core.module import number
from chutelab.machine import Machine, Pieces
from chutelab.results import Recording
from chutelab.results.laws import Findings, alike, examine, inner_radius
from chutelab.util.arrays import Floats

EPS: float = number("EPS")

PRESSED: float = number("PRESSED")
"""Share of the radius by which disks of a crowd may be pressed into each other or into a surface:
what the contact engine promises. A solver that iterates leaves some."""

A_CONTACT: int = number("A_CONTACT")
"""eps that one contact may move an energy by: half an ulp for each of two velocity components, a
height and a sum."""

ROUNDINGS: int = number("ROUNDINGS")
"""Roundings that one number may have gone through between two contacts: some ten operations, each
on numbers up to some ten times as large as what comes out."""

ON_ARCS: float = number("ON_ARCS")
"""Share of its radius by which a cubic between two knots may leave a circle: the recording's
contract."""


@dataclass(frozen=True, eq=False)
class Evidence:
    """One run: the scene, resolved, and what an engine made of it."""

    recording: Recording

    @property
    def machine(self) -> Machine:
        """What was run."""
        return self.recording.machine

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
        return alike(self.recording)

    @property
    def pieces(self) -> tuple[Pieces, ...]:
        """All pieces of its surfaces."""
        return self.machine.pieces

    @cached_property
    def radii(self) -> Floats:
        """Radius of each particle, (N,), m; of one with corners that of the circle inside."""
        return self._of_each(inner_radius(self.machine))

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
    def radius(self) -> float:
        """Radius of the largest particle, m."""
        return float(np.max(self.machine.particle.radius))

    @cached_property
    def energies(self) -> tuple[Floats, Floats]:
        """Kinetic and potential energy at each knot, (K,), J."""
        return self.recording.energies(self.recording.knots, self.recording.owner)

    @cached_property
    def found(self) -> Findings:
        """What the laws of every run find, see `results.laws`."""
        return examine(self.recording)

    @property
    def bounds(self) -> Any:
        """Numbers in play and what they bound, under the names of the core's `Laws` (layout.h)."""
        return self.found.figures


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
