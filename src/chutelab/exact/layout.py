"""From a machine to obstacles: which faces and circles there are, and how they join."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from chutelab.exact.obstacles import NONE, Floats, Ints, Obstacles

if TYPE_CHECKING:
    from chutelab.machine import Machine

JOINT = 1e-12
"""Share of the scene's size within which two ends are one joint."""

FOLDED = 1e-9
"""Difference of two directions below which one segment lies on the other."""

TOUCH_ULPS = 256.0
"""Rounding of a coordinate, in units of the last place of the scene's size: closer is touching."""


def obstacles(machine: Machine) -> Obstacles:
    """Resolve a machine's surfaces into obstacles.

    How segments join is read off the first row where each particle has its own. Of segments that
    lie on each other the first one counts, as it does when two are met at once.
    """
    seg, r = machine.segments, machine.particle.radius
    size = max(
        float(np.abs(places).max(initial=0.0))
        for places in (seg.start, seg.end, machine.releases.position)
    )
    shared = seg.length.ndim == 1
    all_ends = np.stack([seg.start, seg.end], axis=-2)
    kept = _distinct(all_ends if shared else all_ends[0], JOINT * size)

    def wide(array: Floats) -> Floats:
        return (array[None] if shared else array)[:, kept]

    start, tangent, length = wide(seg.start), wide(seg.tangent), wide(seg.length)
    end = start + length[..., None] * tangent
    rows, count = length.shape
    corners = np.stack([start[0], end[0]], axis=1)
    on_pulley = (0, 1) if machine.pulley is not None else None
    places, end_circle = _ends(corners, JOINT * size, on_pulley) if r > 0.0 else _points(count)

    owner = np.array([s for s, _ in places], dtype=np.int64)
    owns = (end_circle[None] == np.arange(len(places))[:, None, None]).any(axis=-1)
    center = np.stack([(start, end)[e][:, s] for s, e in places], axis=1) if places else None
    center = np.empty((rows, 0, 2)) if center is None else center
    rho = np.full((rows, len(places)), r)
    end_circle = np.where(end_circle == NONE, NONE, end_circle + count)

    def with_ends(array: Floats) -> Floats:
        return np.concatenate([array, array[:, owner]], axis=1)

    belt = with_ends(wide(seg.speed)[..., None] * tangent)
    restitution, friction = with_ends(wide(seg.restitution)), with_ends(wide(seg.friction))
    surface = np.concatenate([seg.surface[kept], seg.surface[kept][owner]])
    pulley, pulley_speed = NONE, 0.0
    if machine.pulley is not None:
        p = machine.pulley
        pulley, pulley_speed = count + len(places), p.speed
        end_circle[0, 1] = pulley
        owns = np.concatenate([owns, np.zeros((1, count), dtype=bool)])
        center = np.concatenate([center, np.zeros((rows, 1, 2))], axis=1)
        rho = _column(rho, p.radius + r)
        belt = np.concatenate([belt, np.zeros((rows, 1, 2))], axis=1)
        restitution, friction = _column(restitution, p.restitution), _column(friction, p.friction)
        surface = np.append(surface, p.surface)
    return Obstacles(
        start=start,
        tangent=tangent,
        normal=np.stack([-tangent[..., 1], tangent[..., 0]], axis=-1),
        length=length,
        center=center,
        rho=rho,
        belt=belt,
        restitution=restitution,
        friction=friction,
        surface=surface.astype(np.int64),
        end_circle=end_circle,
        follow=_joints(corners, JOINT * size),
        owns=owns,
        pulley=pulley,
        pulley_speed=pulley_speed,
        touch=TOUCH_ULPS * float(np.finfo(np.float64).eps) * size,
    )


def _column(array: Floats, value: float) -> Floats:
    return np.concatenate([array, np.full((len(array), 1), value)], axis=1)


def _distinct(ends: Floats, tolerance: float) -> Ints:
    """Return the segments, (S', ), that do not lie on an earlier one; `ends` is (S, 2, 2)."""
    kept: list[int] = []
    for s, pair in enumerate(ends):
        earlier = (ends[k] for k in kept)
        if not any(
            np.abs(pair - other[::order]).max() <= tolerance
            for other in earlier
            for order in (1, -1)
        ):
            kept.append(s)
    return np.array(kept, dtype=np.int64)


def _points(count: int) -> tuple[list[tuple[int, int]], Ints]:
    """No circles: a point meets the end of a segment with probability zero."""
    return [], np.full((count, 2), NONE, dtype=np.int64)


def _ends(
    corners: Floats, tolerance: float, without: tuple[int, int] | None
) -> tuple[list[tuple[int, int]], Ints]:
    """Give each distinct end of the segments, `corners` (S, 2, 2), a number; leave one out.

    Returns
    -------
    places : list of (segment, end)
        Where each of them is, first come.
    number : ndarray, (S, 2)
        Which of them each end of each segment is, -1 for the one left out.
    """
    places, number = _points(len(corners))
    for s, e in np.ndindex(number.shape):
        if (s, e) == without:
            continue
        for n, place in enumerate(places):
            if np.abs(corners[s, e] - corners[place]).max() <= tolerance:
                number[s, e] = n
                break
        else:
            number[s, e] = len(places)
            places.append((s, e))
    return places, number


def _joints(corners: Floats, tolerance: float) -> Ints:
    """Return which segment goes on where another ends, (S, 2); the first one found wins.

    Segments that fold back onto each other do not go on from each other.
    """
    follow = np.full(corners.shape[:2], NONE, dtype=np.int64)
    along = corners[:, 1] - corners[:, 0]
    along = along / np.hypot(along[:, 0], along[:, 1])[:, None]
    outward = np.stack([-along, along], axis=1)
    for s, e in np.ndindex(follow.shape):
        for other, f in np.ndindex(follow.shape):
            if other == s or follow[s, e] != NONE or follow[other, f] != NONE:
                continue
            apart = np.abs(corners[s, e] - corners[other, f]).max()
            folded = np.abs(outward[s, e] - outward[other, f]).max() <= FOLDED
            if apart <= tolerance and not folded:
                follow[s, e], follow[other, f] = other, s
    return follow
