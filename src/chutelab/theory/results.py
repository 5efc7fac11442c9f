"""`Transfer`: what the theory answers, at which stage each quantity arises, or why it has none."""

from __future__ import annotations

from dataclasses import dataclass, fields, replace
from enum import StrEnum

import numpy as np
from numpy.typing import NDArray

from chutelab.util.arrays import Bools, Floats


class Reason(StrEnum):
    """First words of every non-empty `Transfer.reason`, up to its colon.

    What a reason claims, so that a simulation can confirm it:

    OUTSIDE
        A parameter or the scene is not what the equations describe. Claims nothing about the
        motion.
    EARLY
        The named surface is touched during the ride or in the first flight, and that contact is not
        the impact on the struck face of the plate. It is the first one after the release.
    NO_IMPACT
        Neither the ride nor the free flight from the pulley ever touches the plate; where the
        impact on its unbounded line should place the outgoing belt, there is no such impact.
    SECOND
        After the rebound, and before the landing, the named surface is the first to be touched.
    MISSES
        After the rebound the fall does not end on the upper face of the finite belt, and nothing
        is touched on the way down to its level. Below that, the disk may still clip the belt's end.
    """

    OUTSIDE = "outside the model"
    EARLY = "early contact"
    NO_IMPACT = "no impact"
    SECOND = "second contact"
    MISSES = "misses the outgoing belt"

    def because(self, what: str) -> str:
        """Return the full reason.

        Examples
        --------
        >>> Reason.SECOND.because("pulley")
        'second contact: pulley'
        """
        return f"{self.value}: {what}"

    @classmethod
    def of(cls, reason: object) -> Reason | None:
        """Return the class of a full reason, None for the empty one.

        Examples
        --------
        >>> Reason.of("no impact: passes below")
        <Reason.NO_IMPACT: 'no impact'>
        """
        text = str(reason)
        return cls(text.partition(":")[0]) if text else None


@dataclass(frozen=True, eq=False)
class Arrays:
    """An answer of read-only arrays, copies of what it is made of."""

    def __post_init__(self) -> None:
        for field in fields(self):
            array = np.array(getattr(self, field.name))
            array.flags.writeable = False
            object.__setattr__(self, field.name, array)


@dataclass(frozen=True, eq=False)
class Transfer(Arrays):
    """One transfer from belt to belt, or many: read-only arrays of one shape, SI units, radians.

    NaN where there is no answer; `reason` then says why, see `chutelab.theory.Reason`. Stages
    that were reached before the trouble keep their values.

    Attributes
    ----------
    phi1, v1 : ndarray
        Angle from the top of the pulley and speed at separation, Eqs. (1), (2).
    omega1 : ndarray
        Angular velocity from there on, rad/s, counter-clockwise; 0 unless a free disk slipped or
        rolled.
    t2, x2, y2 : ndarray
        Flight time to the plate; distance forward and *down* from the separation point,
        Eqs. (3)-(5).
    v2, v2x, v2y : ndarray
        Speed at the plate, forward and *down* components, Eq. (6).
    phi2 : ndarray
        Angle between the plate and the velocity before the impact, Eq. (7).
    phi2r, v2r, omega2 : ndarray
        The same angle, speed and angular velocity after it (the paper's φ2', v2'), Eqs. (8), (9).
    t3, x3, y3 : ndarray
        Time from impact to landing; distance *back* from the impact point, fall, Eqs. (10)-(12).
    v3, v3x, v3y : ndarray
        Speed at landing, components *back* (world v_x = -v3x) and down, Eq. (13).
    d3 : ndarray
        Height of the transfer, Eq. (16).
    dEk, P : ndarray
        Energy (J) and power (W) as the paper has them, Eqs. (14), (15). The sign of v3x is lost.
    belt_work, slip_heat : ndarray
        What the outgoing belt's drive pays until the particle no longer slips, and the part of it
        that becomes heat, J.
    reason : ndarray of str
        Empty where all is well.
    """

    phi1: Floats
    t2: Floats
    x2: Floats
    y2: Floats
    v1: Floats
    v2: Floats
    v2x: Floats
    v2y: Floats
    phi2: Floats
    phi2r: Floats
    v2r: Floats
    t3: Floats
    x3: Floats
    y3: Floats
    v3x: Floats
    v3y: Floats
    v3: Floats
    d3: Floats
    dEk: Floats  # noqa: N815 - the paper's symbol
    P: Floats
    belt_work: Floats
    slip_heat: Floats
    omega1: Floats
    omega2: Floats
    reason: NDArray[np.str_]


STAGES = {
    "separation": ("phi1", "v1", "omega1"),
    "impact": ("t2", "x2", "y2", "v2", "v2x", "v2y", "phi2"),
    "rebound": ("phi2r", "v2r", "omega2"),
    "landing": ("t3", "x3", "y3", "v3", "v3x", "v3y", "d3", "dEk", "P", "belt_work", "slip_heat"),
}
"""Quantities by the stage that yields them, in the order of events."""


def unanswered() -> Transfer:
    """Return a 0-d transfer that is NaN throughout, with no reason yet."""
    names = [name for stage in STAGES.values() for name in stage]
    return Transfer(reason=np.array(""), **dict.fromkeys(names, np.array(np.nan)))


def cut(found: Transfer, stage: str, reason: str) -> Transfer:
    """Return a 0-d transfer without a stage and all later ones, and say why."""
    order = list(STAGES)
    lost = [name for later in order[order.index(stage) :] for name in STAGES[later]]
    return replace(found, reason=np.array(reason), **dict.fromkeys(lost, np.array(np.nan)))


class Answers:
    """Results of N motions, stage by stage, and the reason where they end."""

    def __init__(self, count: int) -> None:
        self.values: dict[str, Floats] = {}
        self.reason = np.full(count, "", dtype=object)
        self.fine = np.full(count, True)

    def fail(self, where: Bools, reason: str) -> None:
        """State a reason where there is none yet."""
        if where.any():
            self.reason[where & self.fine] = reason
            self.fine &= ~where

    def require(self, rules: dict[str, Bools]) -> None:
        """Object to parameters that break a rule; NaN never holds."""
        for rule, holds in rules.items():
            if not holds.all():
                self.fail(~holds, Reason.OUTSIDE.because(f"{rule} is required"))

    def keep(self, **values: Floats) -> None:
        """Store results of a stage where nothing has gone wrong up to now."""
        self.values |= {name: np.where(self.fine, v, np.nan) for name, v in values.items()}
