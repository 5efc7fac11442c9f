"""Where the particles are, and what the books say, between the knots.

Work goes by *cells*, the pairs of a time and a particle whose track covers it; particles that are
not there cost next to nothing. Cells come in blocks, so that memory does not grow with the times.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from chutelab.recording.layout import ENTRIES, Floats, Ints, Particle, balance

if TYPE_CHECKING:
    from collections.abc import Iterator

    from numpy.typing import NDArray

CELLS = 2**18
"""Times × particles in one block: some 30 arrays of 2 MB each, near enough to the cache."""

COLUMNS = ("kinetic", "potential", *ENTRIES, "residual")
"""What `energies` returns, in this order."""


@dataclass(frozen=True, eq=False)
class Cells:
    """Times at which particles are on their way, arrays (c,).

    Attributes
    ----------
    row, particle : ndarray of int
        Indices of the time and of the particle.
    left : ndarray of int
        Index of the last knot that is not later; ``left + 1`` closes the interval. At the end of a
        track it is the last knot but one.
    h : ndarray
        Length of the interval, s; 0 where a track ends with an impact.
    share : ndarray
        Part of the interval that has passed, 0 to 1; 1 where `h` is 0.
    """

    row: Ints
    particle: Ints
    left: Ints
    h: Floats
    share: Floats


def blocks(knots: NDArray[Any], offsets: Ints, times: Floats) -> Iterator[Cells]:
    """Find the interval of every cell, block by block in the order of `times`.

    Parameters
    ----------
    knots : ndarray, (K,), dtype `KNOT`
        All tracks, one after the other.
    offsets : ndarray, (N + 1,)
        Particle i owns ``knots[offsets[i]:offsets[i + 1]]``.
    times : ndarray, (T,)
        s, in any order.
    """
    t = knots["t"]
    released = np.flatnonzero(offsets[1:] > offsets[:-1])
    first, last = offsets[released], offsets[released + 1] - 1
    rows = max(1, CELLS // max(1, len(released)))
    for begin in range(0, len(times), rows):
        now = times[begin : begin + rows, None]
        row, column = np.nonzero((now >= t[first]) & (now <= t[last]))
        at = times[begin + row]
        left = _bisect(t, first[column], last[column], at)
        h = t[left + 1] - t[left]
        share = np.divide(at - t[left], h, out=np.ones_like(h), where=h > 0.0)
        yield Cells(begin + row, released[column], left, h, share)


def _bisect(t: Floats, low: Ints, high: Ints, at: Floats) -> Ints:
    """Return the last knot in [low, high) whose time is not later, all cells at once."""
    low, high = low.copy(), high.copy()
    while np.any(high - low > 1):
        middle = (low + high) // 2
        passed = t[middle] <= at
        low = np.where(passed, middle, low)
        high = np.where(passed, high, middle)
    return low


def hermite(knots: NDArray[Any], cells: Cells, axis: int) -> tuple[Floats, Floats]:
    """Return one coordinate (m) and its velocity (m/s) on the cubic between two knots, (c,)."""
    left, s, h = cells.left, cells.share, cells.h
    position, velocity = knots["position"][:, axis], knots["velocity"][:, axis]
    pa, pb, va, vb = position[left], position[left + 1], velocity[left], velocity[left + 1]
    dx = pb - pa
    # Written around the left knot, so that a long flight loses no digits.
    where = pa + s * (
        h * va + s * ((3.0 * dx - h * (2.0 * va + vb)) + s * (h * (va + vb) - 2.0 * dx))
    )
    slope = np.divide(dx, h, out=vb.copy(), where=h > 0.0)
    pace = va + s * (2.0 * (3.0 * slope - 2.0 * va - vb) + 3.0 * s * (va + vb - 2.0 * slope))
    over = s >= 1.0
    return np.where(over, pb, where), np.where(over, vb, pace)


def energies(
    knots: NDArray[Any], offsets: Ints, times: Floats, particle: Particle, gravity: float
) -> Floats:
    """Return the books at each time, summed over released particles, (6, T), J; see `COLUMNS`.

    A particle that has ended keeps what it had. Between two knots the entries follow from what
    goes on there: the restitution loss changes in impacts only, at knots. While a particle slips,
    the force and so the power of the belt is constant on a face, and the friction loss is what the
    energy balance asks for, with the residuals of the two knots interpolated linearly. While it is
    carried without slip, the belt work is. In flight nothing is booked, and what the balance leaves
    over is the residual.
    """
    released = offsets[1:] > offsets[:-1]
    firsts, lasts = knots[offsets[:-1][released]], knots[offsets[1:][released] - 1]
    at_release = np.zeros(len(offsets) - 1)
    at_release[released] = _energy(firsts, particle, gravity).sum(axis=0)

    final = np.empty((len(COLUMNS), len(lasts)))
    final[:2] = _energy(lasts, particle, gravity)
    final[2:5] = lasts["entries"].T
    final[5] = final[:2].sum(axis=0) - at_release[released] - balance(lasts["entries"])
    order = np.argsort(lasts["t"], kind="stable")
    sums = np.concatenate([np.zeros((len(COLUMNS), 1)), final[:, order].cumsum(axis=1)], axis=1)
    out = sums[:, np.searchsorted(lasts["t"][order], times, side="left")]

    for cells in blocks(knots, offsets, times):
        values = _under_way(knots, cells, at_release[cells.particle], particle, gravity)
        for total, value in zip(out, values, strict=True):
            np.add.at(total, cells.row, value)
    return out


def _energy(knots: NDArray[Any], particle: Particle, gravity: float) -> Floats:
    """Kinetic and potential energy of knots, (2, k)."""
    velocity = knots["velocity"]
    return np.stack(
        [
            particle.kinetic(velocity[..., 0], velocity[..., 1], knots["omega"]),
            particle.mass * gravity * knots["position"][..., 1],
        ]
    )


def _under_way(
    knots: NDArray[Any], cells: Cells, at_release: Floats, particle: Particle, gravity: float
) -> tuple[Floats, ...]:
    """Return the `COLUMNS` of each cell, (c,)."""
    share = cells.share
    a, b = (_Books.of(knots, cells.left + side, at_release, particle, gravity) for side in (0, 1))
    (_, vx), (y, vy) = hermite(knots, cells, 0), hermite(knots, cells, 1)
    omega = a.omega + share * (b.omega - a.omega)
    kinetic = particle.kinetic(vx, vy, omega)
    potential = particle.mass * gravity * y
    gain = kinetic + potential - at_release

    slips, driven = a.friction != b.friction, a.belt != b.belt
    restitution = np.where(share < 1.0, a.restitution, b.restitution)
    residual = a.residual + share * (b.residual - a.residual)
    belt = np.where(
        driven & ~slips,
        gain + restitution + a.friction - residual,
        a.belt + share * (b.belt - a.belt),
    )
    friction = np.where(slips, belt - restitution + residual - gain, a.friction)
    residual = np.where(slips | driven, residual, gain - (belt - restitution - friction))
    return kinetic, potential, belt, restitution, friction, residual


@dataclass(frozen=True, eq=False)
class _Books:
    """Entries and residual (J), angular velocity (rad/s) at knots, arrays (c,)."""

    belt: Floats
    restitution: Floats
    friction: Floats
    residual: Floats
    omega: Floats

    @classmethod
    def of(
        cls,
        knots: NDArray[Any],
        index: Ints,
        at_release: Floats,
        particle: Particle,
        gravity: float,
    ) -> _Books:
        omega = knots["omega"][index]
        velocity, entries = knots["velocity"], knots["entries"]
        energy = particle.kinetic(velocity[index, 0], velocity[index, 1], omega)
        energy += particle.mass * gravity * knots["position"][index, 1]
        belt, restitution, friction = (entries[index, column] for column in range(3))
        residual = energy - at_release - (belt - restitution - friction)
        return cls(belt, restitution, friction, residual, omega)
