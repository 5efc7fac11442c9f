"""The first circle met: a segment's end, or the pulley."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from chutelab.ballistics import first_descent
from chutelab.exact.motion import PARALLEL
from chutelab.exact.obstacles import Floats, Ints, Obstacles, dot, length_of, pick, rows_of
from chutelab.many import of

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from chutelab.exact.motion import Motion

    Bools = NDArray[np.bool_]

GLANCING = 1e-3
"""Share of the speed towards a circle below which a Newton step would not improve the contact."""

FROM_CURVE = 2
"""Least `Motion.order` with which a circle is left for good, unless the pull turns a path back."""


def touched(
    places: tuple[Floats, Floats], motion: Motion, obstacles: Obstacles, circles: Ints
) -> Bools:
    """Which circles' boxes the box of a path touches, (C, k)."""
    low, high = obstacles.low[:, obstacles.segments :], obstacles.high[:, obstacles.segments :]
    if len(circles) < low.shape[1]:
        low, high = low.take(circles, axis=1), high.take(circles, axis=1)
    near = places[0][:, None] < rows_of(high, motion.rows)
    near &= places[1][:, None] > rows_of(low, motion.rows)
    return np.asarray(near[0] & near[1])


def first_circle(
    motion: Motion, obstacles: Obstacles, until: Floats, circles: Ints, pairs: Bools
) -> tuple[Floats, Ints]:
    """Time to the first circle met, and its number, (k,); time inf if there is none.

    Of the given circles (C,), those that `pairs` (C, k) tells for each particle.
    """
    time = np.full(len(motion.rows), np.inf)
    nearest = np.zeros(len(motion.rows), dtype=np.int64)
    which, who = pairs.nonzero()
    circle = circles[which]
    rows = motion.rows[who]
    v = motion.velocity[:, who]
    a = np.broadcast_to(motion.acceleration, motion.velocity.shape)[:, who]
    d = motion.position[:, who] - pick(obstacles.center, rows, circle)
    rho = pick(obstacles.rho, rows, circle)
    distance = np.hypot(d[0], d[1])
    # |d + v t + a t²/2|² - ρ², as a polynomial of t.
    gap = np.empty((5, len(who)))
    gap[0] = (distance - rho) * (distance + rho)
    gap[1] = 2.0 * dot(d, v)
    gap[2] = dot(v, v) + dot(d, a)
    gap[3] = dot(v, a)
    gap[4] = 0.25 * dot(a, a)
    leaving = motion.left[who] == circle + obstacles.segments
    touch = of(obstacles.touch, rows)
    touching = np.abs(distance - rho) <= touch
    # The direction from the centre is as uncertain as the places are, over ρ.
    uncertain = 2.0 * (PARALLEL * rho + touch) * length_of(v)
    grazing = touching & (np.abs(gap[1]) <= uncertain)
    gap[1] = np.where(grazing & ~leaving, 0.0, gap[1])
    order = np.where(leaving, motion.order[who], np.where(touching & (gap[1] >= 0.0), 1, 0))
    now = touching & ~leaving & (gap[1] < 0.0)
    for n in range(1, 4):
        shift = order >= n
        gap[:-1, shift] = gap[1:, shift]
        gap[-1, shift] = 0.0
    # Inside already (overlapping), or nothing ever pulls it in: no contact to find.
    open_ = (~now & (gap[0] >= 0.0) & (gap < 0.0).any(axis=0)).nonzero()[0]
    t = np.where(now, 0.0, np.inf)
    if len(open_):
        found = first_descent(gap[:, open_], until[who[open_]])
        t[open_] = _polished(
            found, d[:, open_], v[:, open_], a[:, open_], rho[open_], order[open_] == 0
        )
    # The soonest is written last; of those met at once, the one with the lowest number.
    best = np.argsort(t, kind="stable")[::-1]
    time[who[best]], nearest[who[best]] = t[best], circle[best]
    return time, nearest


def _polished(t: Floats, d: Floats, v: Floats, a: Floats, rho: Floats, apart: Bools) -> Floats:
    """Improve contact times by one Newton step on the distance itself.

    Its rounding does not grow with the flight, as the polynomial's does; but of a contact that is
    being left (not `apart` before) the polynomial, divided by t, is better on ways below ρ.
    """
    time = np.where(np.isfinite(t), t, 0.0)
    there, pace = d + time * (v + 0.5 * time * a), v + time * a
    distance = np.hypot(there[0], there[1])
    rate = dot(there, pace) / distance
    steep = np.isfinite(t) & (rate < -GLANCING * length_of(pace))
    better = steep & (apart | (-rate * time > rho))
    correction = (distance - rho) / np.where(better, rate, 1.0)
    return np.where(better, np.maximum(t - correction, 0.0), t)


def hidden(motion: Motion, obstacles: Obstacles, circles: Ints) -> Bools:
    """Which of the circles a particle cannot meet, from where it is or comes from, (C, k)."""
    segments, left = obstacles.segments, motion.left
    out = np.zeros((len(circles), len(left)), dtype=bool)
    curved = motion.order >= FROM_CURVE
    if np.count_nonzero(curved):
        # Left tangentially with the speed not falling, all terms of the gap to a circle grow.
        curved &= dot(motion.velocity, motion.acceleration) >= 0.0
        out |= curved & (left == (circles + segments)[:, None])
    # A face that is left with the pull away from it hides its own two ends, as does one slid on.
    flat = (left >= 0) & (left < segments)
    if np.count_nonzero(flat):
        normal = motion.left_side * pick(obstacles.normal, motion.rows, left)
        flat &= dot(motion.acceleration, normal) >= 0.0
        out |= obstacles.owns[circles][:, np.where(flat, left, 0)] & flat
    if motion.on is not None:
        out |= obstacles.owns[circles][:, motion.on]
    return out
