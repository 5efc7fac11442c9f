"""From a machine to obstacles: which faces and circles there are, and how they join."""

from __future__ import annotations

from sys import float_info
from typing import TYPE_CHECKING

import numpy as np

from chutelab.exact.obstacles import NONE, Floats, Ints, Obstacles
from chutelab.many import Value, at

if TYPE_CHECKING:
    from chutelab.machine import Machine, Segments

FOOT = 1e-12
"""Share of a segment's length by which its face reaches past its ends, so that no particle slips
through the joint of two segments by rounding."""

JOINT = 1e-12
"""Share of the scene's size within which two ends are one joint."""

TOUCH_ULPS = 256.0
"""Rounding of a coordinate, in units of the last place of the scene's size: closer is touching."""

GIVEN_ULPS = 1.0
"""The same of a coordinate in the scene file, for one far from the origin."""

BOX_TOUCHES = 64.0
"""Width, in `Obstacles.touch`, by which the boxes of faces are larger than they need be."""


def obstacles(machine: Machine, origin: tuple[float, float] = (0.0, 0.0)) -> Obstacles:
    """Resolve a machine's surfaces into obstacles, in coordinates from an origin.

    How segments join, and whether particles are points, is read off the first row where each
    particle has its own: see `chutelab.exact.kinds`. Of segments that
    lie on each other the first one counts, as it does when two are met at once.
    """
    seg, r, wheel = machine.segments, machine.particle.radius, machine.pulley
    tangent, length = _vectors(seg.tangent), _scalars(seg.length)
    far = max(map(abs, origin))
    corners, places = corners_of(machine), machine.releases.position
    if far > 0.0:
        start = _vectors(seg.start) - np.reshape(origin, (2, 1, 1))
        corners = np.concatenate([start, start + length * tangent], axis=1)
        places = places - origin
    size = size_of(corners, places)
    touch = touch_of(size, far)
    spots = spots_of(corners[..., 0], JOINT * at(size, 0))
    kept = _distinct(spots)
    if len(kept) < len(spots):
        corners = corners[:, [*kept, *(s + len(spots) for s in kept)]]
        spots, tangent, length = [spots[s] for s in kept], tangent[:, kept], length[kept]

    # Segments, then their ends, then the pulley.
    flat = len(length)
    disks = at(r, 0) > 0.0
    ends, end_circle = _ends(spots, wheel is not None) if disks else _points(flat)
    where = [s + e * flat for s, e in ends]
    owner = kept + [kept[s] for s, _ in ends]
    if wheel is not None:
        end_circle[0][1] = flat + len(ends)
        # It stands in for an end of the first segment until its own values are put in.
        where.append(0)
        owner.append(0)
    center = corners.take(np.array(where, dtype=np.int64), axis=1)
    rho = np.empty(center.shape[1:])
    rho[:] = r
    material, surface = _material(seg, owner)
    pulley = NONE
    if wheel is not None:
        pulley = flat + len(ends)
        center[:, -1], rho[-1], surface[-1] = 0.0, wheel.radius + r, wheel.surface
        for row, value in enumerate((wheel.speed, wheel.restitution, wheel.friction)):
            material[row, -1] = value
    first, second = corners[:, :flat], corners[:, flat:]
    # A circle's box is smaller: what only touches it does not meet it.
    reach, inner = r + BOX_TOUCHES * touch, rho - touch
    return Obstacles(
        faces=_faces(first, tangent, length),
        length=length,
        center=center,
        rho=rho,
        material=material,
        low=np.concatenate([np.minimum(first, second) - reach, center - inner], axis=1),
        high=np.concatenate([np.maximum(first, second) + reach, center + inner], axis=1),
        surface=surface,
        spots=tuple(spots),
        end_circle=np.array(end_circle, dtype=np.int64).reshape(-1, 2),
        pulley=pulley,
        touch=touch,
    )


def corners_of(machine: Machine) -> Floats:
    """Return all first ends of the segments, then all second ones, (2, 2 S, n), m."""
    start = _vectors(machine.segments.start)
    along = _scalars(machine.segments.length) * _vectors(machine.segments.tangent)
    return np.concatenate([start, start + along], axis=1)


def touch_of(size: Value, far: float = 0.0) -> Value:
    """Return `Obstacles.touch` of a scene of a size, counted from a point that far away, m."""
    # Far away the scene's own numbers are rounded, each by half a last place.
    return float_info.epsilon * (TOUCH_ULPS * size + GIVEN_ULPS * far)


def size_of(corners: Floats, places: Floats) -> Value:
    """Return the largest coordinate, m; for each particle, (N,), where each has its own corners."""
    if corners.shape[-1] == 1:
        # Not their methods, which take twice as long.
        sizes = (np.maximum.reduce(np.abs(x), axis=None, initial=0.0) for x in (corners, places))
        return float(max(sizes))
    return np.maximum(np.abs(corners).max(axis=(0, 1), initial=0.0), np.abs(places).max(axis=1))


def _faces(start: Floats, tangent: Floats, length: Floats) -> Floats:
    """Return `Obstacles.faces`."""
    faces = np.empty((2, 4, len(length), 1, length.shape[1]))
    normal, along, first, feet = faces[:, :, :, 0].swapaxes(0, 1)
    normal[0], normal[1], along[:], first[:] = -tangent[1], tangent[0], tangent, start
    over = FOOT * length
    feet[0], feet[1] = -over, over + length
    return faces


def _material(segments: Segments, owner: list[int]) -> tuple[Floats, Ints]:
    """Return `Obstacles.material` and `Obstacles.surface` of obstacles that belong to segments."""
    each = (segments.speed, segments.restitution, segments.friction)
    material = np.stack([_scalars(values) for values in each])
    which = np.array(owner, dtype=np.int64)
    return material.take(which, axis=1), segments.surface.take(which)


def _vectors(array: Floats) -> Floats:
    """(S, 2) or (N, S, 2) to (2, S, n)."""
    return array.T[..., None] if array.ndim == 2 else array.transpose(2, 1, 0).copy()


def _scalars(array: Floats) -> Floats:
    """(S,) or (N, S) to (S, n)."""
    return array[:, None] if array.ndim == 1 else array.T.copy()


def spots_of(ends: Floats, tolerance: float) -> list[tuple[int, int]]:
    """Return numbers of the places where segments begin and end; within the tolerance one place.

    `ends` is (2, 2 S): all the first ones, then all the second ones.
    """
    x, y = ends.tolist()
    count = len(x) // 2
    number = list(range(2 * count))
    window: list[int] = []
    for n in sorted(number, key=x.__getitem__):
        while window and x[n] - x[window[0]] > tolerance:
            del window[0]
        for m in window:
            if abs(y[n] - y[m]) <= tolerance:
                number[n] = number[m]
                break
        window.append(n)
    return list(zip(number[:count], number[count:], strict=True))


def _distinct(spots: list[tuple[int, int]]) -> list[int]:
    """Return the segments that do not lie on an earlier one."""
    seen: dict[frozenset[int], int] = {}
    for s, pair in enumerate(spots):
        seen.setdefault(frozenset(pair), s)
    return list(seen.values())


def _points(count: int) -> tuple[list[tuple[int, int]], list[list[int]]]:
    """No circles: a point meets the end of a segment with probability zero."""
    return [], [[NONE, NONE] for _ in range(count)]


def _ends(
    spots: list[tuple[int, int]], pulley: bool
) -> tuple[list[tuple[int, int]], list[list[int]]]:
    """Give each distinct end of the segments a circle; the pulley stands for the first one's end.

    Returns
    -------
    ends : list of (segment, end)
        Where each of them is, first come.
    circles : list of (int, int), (S,)
        Obstacle number of the circle at each end of each segment, -1 for the one left out.
    """
    known: dict[int, int] = {}
    ends, circles = _points(len(spots))
    for s, pair in enumerate(spots):
        for e, spot in enumerate(pair):
            if pulley and s == 0 and e == 1:
                continue
            if spot not in known:
                known[spot] = len(spots) + len(ends)
                ends.append((s, e))
            circles[s][e] = known[spot]
    return ends, circles
