"""When and what a particle in flight (or sliding straight) meets next: solved, not stepped."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from chutelab.ballistics import closing_time, first_descent
from chutelab.exact.obstacles import NONE, Floats, Ints, Obstacles, dot, pick, rows_of

if TYPE_CHECKING:
    from numpy.typing import NDArray

FOOT = 1e-12
"""Share of a segment's length by which its face reaches past its ends, so that no particle slips
through the joint of two segments by rounding."""

SIDES = np.array([1, -1])[:, None, None]
"""The two faces of a segment; the first wins ties."""

GLANCING = 1e-3
"""Share of the speed towards a circle below which a Newton step would not improve the contact."""

PARALLEL = 1e-14
"""Share of a speed or an acceleration along a surface below which it has no part towards it."""


@dataclass(frozen=True, eq=False)
class Motion:
    """Particles that move with constant acceleration until something happens, arrays (k, ...).

    Attributes
    ----------
    rows : ndarray, (k,)
        Which particles they are.
    position, velocity, acceleration : ndarray, (k, 2)
        SI units.
    left, left_side, order : ndarray, (k,)
        Obstacle (and face of it) in contact now that is being left, or -1; how many of the leading
        coefficients of the gap to it are zero: 1 after a rebound, 2 when leaving tangentially, 3
        when lifting off a circle. They are exactly zero, so they are divided out.
    on, on_side : ndarray, (k,)
        Segment (and face of it) the particle slides on, which it cannot meet, or -1.
    """

    rows: Ints
    position: Floats
    velocity: Floats
    acceleration: Floats
    left: Ints
    left_side: Ints
    order: Ints
    on: Ints
    on_side: Ints


def first_contact(
    motion: Motion, obstacles: Obstacles, radius: float, until: Floats
) -> tuple[Floats, Ints, Ints]:
    """Return time from now, obstacle and side of the first contact before `until`, each (k,).

    Finds: faces within a segment's length, ends of segments (for a disk), the pulley. Misses, by
    design: a point against the end of a segment, and anything the particle overlaps already.

    Parameters
    ----------
    motion : Motion
        k particles.
    obstacles : Obstacles
        What they can meet.
    radius : float
        r, m.
    until : ndarray, (k,)
        Finite time after which nothing matters, s.

    Returns
    -------
    time, obstacle, side
        inf and -1 where there is none; side is +1 or -1 for a face, 0 for a circle.
    """
    time, obstacle, side = _faces(motion, obstacles, radius, until)
    if obstacles.center.shape[1]:
        t, circle = _circles(motion, obstacles, np.minimum(time, until))
        sooner = t < time
        time = np.where(sooner, t, time)
        obstacle = np.where(sooner, circle + obstacles.segments, obstacle)
        side = np.where(sooner, 0, side)
    return time, obstacle, side


def _faces(
    motion: Motion, obstacles: Obstacles, radius: float, until: Floats
) -> tuple[Floats, Ints, Ints]:
    """Return time, segment and side of the first face met up to `until`, (k,); inf, -1, 0 if none.

    Works on arrays of shape (2, k, S): both faces of all segments.
    """
    count, segments = len(motion.rows), obstacles.segments
    if not segments:
        return np.full(count, np.inf), np.full(count, NONE), np.zeros(count, dtype=np.int64)
    normal, start = rows_of(obstacles.normal, motion.rows), rows_of(obstacles.start, motion.rows)
    p, v, a = (x[:, None] for x in (motion.position, motion.velocity, motion.acceleration))
    gap = SIDES * dot(p - start, normal) - radius
    rate, acceleration = SIDES * dot(v, normal), SIDES * dot(a, normal)
    columns = np.arange(segments)
    leaving = motion.left[:, None] == columns
    same = leaving & (motion.left_side[:, None] == SIDES)
    touching = (np.abs(gap) <= obstacles.touch) | same
    gap = np.where(touching, 0.0, gap)
    along_face = touching & (np.abs(rate) <= PARALLEL * np.sqrt(dot(v, v)))
    rate = np.where(along_face & ~same, 0.0, rate)
    unpressed = along_face & (np.abs(acceleration) <= PARALLEL * np.sqrt(dot(a, a)))
    acceleration = np.where(unpressed, 0.0, acceleration)
    time = closing_time(gap, rate, acceleration)
    own = (motion.on[:, None] == columns) & (motion.on_side[:, None] == SIDES)
    never = own | (leaving & ~same) | (same & (motion.order[:, None] > 1))
    never |= (time < 0.0) | (time > until[:, None])
    time = np.where(never, np.inf, time)
    finite = np.where(never, 0.0, time)[..., None]
    there = p + finite * (v + 0.5 * finite * a) - start
    tangent = rows_of(obstacles.tangent, motion.rows)
    foot, pace = dot(there, tangent), dot(v, tangent)
    length = rows_of(obstacles.length, motion.rows)
    reach = FOOT * length
    over = (foot >= -reach) & (foot <= length + reach)
    # Grazing the end on the way out is not lying on the face.
    outward = ((foot <= reach) & (pace < 0.0)) | ((foot >= length - reach) & (pace > 0.0))
    time = np.where(over & ~(along_face & outward), time, np.inf)
    nearest = np.argmin(time.transpose(1, 0, 2).reshape(count, -1), axis=1)
    side, segment = np.divmod(nearest, segments)
    first = time[side, np.arange(count), segment]
    met = np.isfinite(first)
    return first, np.where(met, segment, NONE), np.where(met, SIDES[side, 0, 0], 0)


def _circles(motion: Motion, obstacles: Obstacles, until: Floats) -> tuple[Floats, Ints]:
    """Time to the first circle met, and its number, (k,); inf and -1 if none."""
    time = np.full(len(motion.rows), np.inf)
    nearest = np.full(len(motion.rows), NONE, dtype=np.int64)
    who, circle = np.nonzero(_near(motion, obstacles, until))
    if not len(who):
        return time, nearest
    rows = motion.rows[who]
    v, a = motion.velocity[who], motion.acceleration[who]
    d = motion.position[who] - pick(obstacles.center, rows, circle)
    rho = pick(obstacles.rho, rows, circle)
    distance = np.hypot(d[:, 0], d[:, 1])
    # |d + v t + a t²/2|² - ρ², as a polynomial of t.
    gap = np.stack(
        [
            (distance - rho) * (distance + rho),
            2.0 * dot(d, v),
            dot(v, v) + dot(d, a),
            dot(v, a),
            0.25 * dot(a, a),
        ]
    )
    leaving = motion.left[who] == circle + obstacles.segments
    touching = np.abs(distance - rho) <= obstacles.touch
    grazing = touching & (np.abs(gap[1]) <= PARALLEL * 2.0 * rho * np.sqrt(dot(v, v)))
    gap[1] = np.where(grazing & ~leaving, 0.0, gap[1])
    order = np.where(leaving, motion.order[who], np.where(touching & (gap[1] >= 0.0), 1, 0))
    now = touching & ~leaving & (gap[1] < 0.0)
    for n in range(1, 4):
        shift = order >= n
        gap[:-1, shift] = gap[1:, shift]
        gap[-1, shift] = 0.0
    # Inside already (overlapping), or nothing ever pulls it in: no contact to find.
    open_ = ~now & (gap[0] >= 0.0) & (gap < 0.0).any(axis=0)
    t = np.where(now, 0.0, np.inf)
    if open_.any():
        found = first_descent(gap[:, open_], until[who[open_]])
        t[open_] = _polished(found, d[open_], v[open_], a[open_], rho[open_], order[open_] == 0)
    best = np.argsort(t, kind="stable")[::-1]
    time[who[best]], nearest[who[best]] = t[best], circle[best]
    return time, np.where(np.isfinite(time), nearest, NONE)


def _polished(
    t: Floats, d: Floats, v: Floats, a: Floats, rho: Floats, apart: NDArray[np.bool_]
) -> Floats:
    """Improve contact times by one Newton step on the distance itself.

    Its rounding does not grow with the flight, as the polynomial's does; but of a contact that is
    being left (not `apart` before) the polynomial, divided by t, is better on ways below ρ.
    """
    time = np.where(np.isfinite(t), t, 0.0)[:, None]
    there, pace = d + time * (v + 0.5 * time * a), v + time * a
    distance = np.hypot(there[:, 0], there[:, 1])
    rate = dot(there, pace) / distance
    steep = np.isfinite(t) & (rate < -GLANCING * np.sqrt(dot(pace, pace)))
    better = steep & (apart | (-rate * time[:, 0] > rho))
    correction = (distance - rho) / np.where(better, rate, 1.0)
    return np.where(better, np.maximum(t - correction, 0.0), t)


def _near(motion: Motion, obstacles: Obstacles, until: Floats) -> NDArray[np.bool_]:
    """Which circles the box of the path up to `until` touches, (k, C): a cheap way to skip most."""
    p, v, a = motion.position, motion.velocity, motion.acceleration
    t = until[:, None]
    with np.errstate(divide="ignore", invalid="ignore"):
        turn = -v / a
    turn = np.where((turn > 0.0) & (turn < t), turn, 0.0)
    places = np.stack([p, p + turn * (v + 0.5 * turn * a), p + t * (v + 0.5 * t * a)])
    low, high = places.min(axis=0)[:, None], places.max(axis=0)[:, None]
    center = rows_of(obstacles.center, motion.rows)
    reach = (rows_of(obstacles.rho, motion.rows) - obstacles.touch)[..., None]
    near = np.all((low < center + reach) & (high > center - reach), axis=-1)
    # A face that is left with the pull away from it hides its own two ends, as does one slid on.
    if not obstacles.segments:
        return np.asarray(near)
    left = np.where(motion.left < obstacles.segments, motion.left, NONE)
    normal = motion.left_side[:, None] * pick(obstacles.normal, motion.rows, np.maximum(left, 0))
    left = np.where(dot(a, normal) >= 0.0, left, NONE)
    for face in (left, motion.on):
        own = obstacles.owns[:, np.maximum(face, 0)].T
        near &= ~(own & (face != NONE)[:, None])
    return np.asarray(near)
