"""Which machines of a family can run together: those whose surfaces join in the same way."""

from __future__ import annotations

from itertools import combinations
from typing import TYPE_CHECKING

import numpy as np

from chutelab.exact.layout import JOINT, corners_of, size_of, spots_of, touch_of
from chutelab.exact.obstacles import FOLDED, Floats, Ints

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from chutelab.machine import Machine

    Bools = NDArray[np.bool_]

MOST_KINDS = 16
"""Kinds that are looked for; what is left over runs by itself."""


def kinds(machine: Machine) -> list[Ints]:
    """Return the members of a family by what the engine reads off the first one only.

    That is: how segments join, and whether there are points, points that may lie in a surface,
    gravity, and a belt at rest.

    Parameters
    ----------
    machine : Machine
        A family, see `Machine`.

    Returns
    -------
    list of ndarray
        Numbers of members that are alike; each member is in one of them.
    """
    left = np.arange(machine.count)
    found: list[Ints] = []
    while len(left) and len(found) < MOST_KINDS:
        same = _like(machine, left)
        if not same[0]:
            # Ends so near each other that a joins b and b joins c, but a does not join c.
            same = np.arange(len(left)) == 0
        found.append(left[same])
        left = left[~same]
    return found + [np.array([member]) for member in left.tolist()]


def _like(machine: Machine, members: Ints) -> Bools:
    """Tell which of the members are like the first of them."""
    every = np.zeros(machine.count)
    radius, gravity = machine.particle.radius + every, machine.gravity + every
    corners = corners_of(machine)
    size = size_of(corners, machine.releases.position) + every
    signs = [radius > 0.0, radius <= touch_of(size), gravity > 0.0]
    if machine.pulley is not None:
        signs.append(machine.pulley.speed + every == 0.0)
    table = np.stack(signs)[:, members]
    same = np.asarray((table == table[:, :1]).all(axis=0))
    corners, reach = corners[..., members], JOINT * size[members]
    spots = [spot for pair in spots_of(corners[..., 0], float(reach[0])) for spot in pair]
    # Ends that stay where they are: a wider tolerance must not join more of them.
    wide = [spot for pair in spots_of(corners[..., 0], float(reach.max())) for spot in pair]
    if _partition(wide) != _partition(spots):
        same &= reach == reach[0]
    count = corners.shape[1] // 2
    # Ends are numbered as `corners` are: all first ones, then all second ones.
    number = np.array(spots[0::2] + spots[1::2])
    moving = np.flatnonzero((corners != corners[..., :1]).any(axis=(0, 2)))
    for end in moving.tolist():
        apart = np.abs(corners - corners[:, end : end + 1])
        close = (apart <= reach).all(axis=0)
        same &= (close == (number == number[end])[:, None]).all(axis=0)
    for end, other in _joined(number):
        same &= (np.abs(corners[:, end] - corners[:, other]) <= reach).all(axis=0)
        if end % count != other % count:
            folds = _folds(machine, members, (end, other))
            same &= folds == folds[0]
    return np.asarray(same)


def _partition(spots: list[int]) -> list[int]:
    """Name the places by the first end that is there."""
    return [spots.index(spot) for spot in spots]


def _joined(number: Ints) -> list[tuple[int, int]]:
    """Return the pairs of ends that are at one place."""
    order = np.argsort(number, kind="stable")
    groups = np.split(order, np.flatnonzero(np.diff(number[order])) + 1)
    return [pair for group in groups for pair in combinations(group.tolist(), 2)]


def _folds(machine: Machine, members: Ints, ends: tuple[int, int]) -> Bools:
    """Tell whether two segments that meet at these ends lie on each other, (k,)."""
    tangent = machine.segments.tangent
    count = tangent.shape[-2]
    out: list[Floats] = [
        tangent[members, end % count] * (1.0 if end >= count else -1.0) for end in ends
    ]
    return np.asarray(np.abs(out[0] - out[1]).max(axis=1) <= FOLDED)
