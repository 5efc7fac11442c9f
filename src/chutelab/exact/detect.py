"""When and what a particle in flight (or sliding straight) meets next: solved, not stepped."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from chutelab.ballistics import descent
from chutelab.exact.circles import first_circle, hidden, touched
from chutelab.exact.motion import PARALLEL, Motion
from chutelab.exact.obstacles import Floats, Ints, Obstacles, dot, length_of, rows_of
from chutelab.many import Value
from chutelab.many import of as some_of

if TYPE_CHECKING:
    from numpy.typing import NDArray

    Bools = NDArray[np.bool_]

SIDES = np.array([[1.0], [-1.0]])
"""The two faces of a segment."""

FEW = 4
"""Segments up to which looking at all takes no longer than finding out which to look at."""


def first_contact(
    motion: Motion, obstacles: Obstacles, radius: Value, until: Floats
) -> tuple[Floats, Bools, Ints, Floats]:
    """Return until when particles go on, who meets something then, and its number and side, (k,).

    Finds: faces within a segment's length, ends of segments (for a disk), the pulley. Misses, by
    design: a point against the end of a segment, and anything the particle overlaps already.

    Parameters
    ----------
    motion : Motion
        k particles.
    obstacles : Obstacles
        What they can meet.
    radius : float, or ndarray, (k,)
        r, m.
    until : ndarray, (k,)
        Finite time after which nothing matters, s.

    Returns
    -------
    time, hits, obstacle, side
        Time from now, not longer than `until`: a contact at that very time comes first. The last
        two are any numbers where there is none; side is +1 or -1 for a face, 0 for a circle.
    """
    segments, count = obstacles.segments, len(until)
    held = motion.never is not None or motion.on is not None
    places = _box(motion, until) if held or segments > FEW else None
    faces, circles = _reached(motion, obstacles, places)
    if len(faces):
        time, obstacle, side = _faces(motion, obstacles, radius, until, faces)
        hits = time <= until
        until = np.minimum(time, until)
        places = None
    else:
        hits, side = np.zeros(count, dtype=bool), np.zeros(count)
        obstacle = np.zeros(count, dtype=np.int64)
    if not len(circles):
        return until, hits, obstacle, side
    if places is None:
        places = _box(motion, until)
    pairs = touched(places, motion, obstacles, circles)
    if np.count_nonzero(pairs):
        pairs &= ~hidden(motion, obstacles, circles)
    if np.count_nonzero(pairs):
        t, circle = first_circle(motion, obstacles, until, circles, pairs)
        # Before a face that is met then, and at the latest at the end.
        sooner = (t < until) | (~hits & (t == until))
        until = np.where(sooner, t, until)
        hits |= sooner
        obstacle = np.where(sooner, circle + segments, obstacle)
        side = np.where(sooner, 0, side)
    return until, hits, obstacle, side


def _box(motion: Motion, until: Floats) -> tuple[Floats, Floats]:
    """Lowest and highest coordinates of each path up to `until`, (2, k)."""
    p, v, a = motion.position, motion.velocity, motion.acceleration
    end = motion.after(until)
    low, high = np.minimum(p, end), np.maximum(p, end)
    turn = -v / a
    turns = (turn > 0.0) & (turn < until)
    if np.count_nonzero(turns):
        turn = np.where(turns, turn, 0.0)
        top = p + turn * (v + (0.5 * turn) * a)
        low, high = np.minimum(low, top), np.maximum(high, top)
    return low, high


def _reached(
    motion: Motion, obstacles: Obstacles, places: tuple[Floats, Floats] | None
) -> tuple[Ints, Ints]:
    """Return segments and circles that any of the paths may touch: a cheap way to skip most.

    `places` are the boxes of the paths; without them all may.
    """
    if places is None:
        return obstacles.numbers
    low, high = places
    if low.shape[1] > 1:
        low = np.minimum.reduce(low, axis=1, keepdims=True)
        high = np.maximum.reduce(high, axis=1, keepdims=True)
    each = (low < obstacles.bound_high) & (high > obstacles.bound_low)
    near = each[0] & each[1]
    if motion.never is not None:
        near &= ~motion.never
    faces = near[: obstacles.segments].nonzero()[0]
    if motion.on is not None and len(faces):
        # Along a face nobody meets the other one either.
        faces = faces[(motion.on != faces[:, None]).any(axis=1)]
    return faces, near[obstacles.segments :].nonzero()[0]


def _faces(
    motion: Motion, obstacles: Obstacles, radius: Value, until: Floats, segments: Ints
) -> tuple[Floats, Ints, Floats]:
    """Return time, segment and side of the first face met up to `until`, (k,); time inf if none.

    Of the given segments; works on arrays of shape (S, F, k), where F is 1 if nobody turns back
    from a segment before `until` and can so meet one of its faces only, else 2.
    """
    some = len(segments) < obstacles.segments
    faces = obstacles.faces.take(segments, axis=2) if some else obstacles.faces
    faces = rows_of(faces, motion.rows)
    frame = faces[:, :2]
    # Components along the normals and the tangents of the segments.
    rise, pace = dot(motion.velocity[:, None, None, None], frame)
    pull, push = dot(motion.acceleration[:, None, None, None], frame)
    height, foot = dot(motion.position[:, None, None, None] - faces[:, 2:3], frame)
    last = rise + pull * until
    turns = np.count_nonzero(rise * last < 0.0)
    sides = SIDES if turns else np.where(rise + last > 0.0, -1.0, 1.0)
    gap, rate, fall = sides * height - radius, sides * rise, sides * pull

    leaving = motion.left == segments[:, None, None]
    same = leaving & (motion.left_side == sides)
    touching = np.abs(gap) <= some_of(obstacles.touch, motion.rows)
    touching |= same
    grazing: Bools | None = None
    if np.count_nonzero(touching):
        gap[touching] = 0.0
        grazing = touching & (np.abs(rate) <= PARALLEL * length_of(motion.velocity))
        if np.count_nonzero(grazing):
            rate[grazing > same] = 0.0
            unpressed = grazing & (np.abs(fall) <= PARALLEL * length_of(motion.acceleration))
            if np.count_nonzero(unpressed):
                fall = np.where(unpressed, 0.0, fall)
        else:
            grazing = None
    time = descent(gap, rate, fall)
    valid = (time >= 0.0) & (time <= until)
    if np.count_nonzero(leaving):
        valid &= ~leaving | (same & (motion.order <= 1))
    if motion.on is not None:
        valid &= motion.on != segments[:, None, None]

    if motion.past is not None and np.count_nonzero(touching):
        past = motion.past
        height_then = dot(past.place[:, None, None] - faces[:, 2], frame[:, 0])
        known = past.obstacle == segments[:, None, None]
        behind = sides * np.where(known, past.side, height_then) < 0.0
        valid &= ~(touching & ~same & behind & (time == 0.0))

    # How far along the segment the contact is.
    foot = foot + time * (pace + (0.5 * time) * push)
    low, high = faces[:, 3]
    valid &= (foot >= low) & (foot <= high)
    if grazing is not None:
        length = rows_of(obstacles.length[segments], motion.rows)[:, None]
        reach = -low
        # Grazing the end on the way out is not lying on the face.
        outward = ((foot <= reach) & (pace < 0.0)) | ((foot >= length - reach) & (pace > 0.0))
        valid &= ~(grazing & outward)
    time[~valid] = np.inf
    flat = time.reshape(-1, time.shape[-1])
    nearest, column = flat.argmin(axis=0), np.arange(flat.shape[1])
    first = flat[nearest, column]
    # Rows go by segments, then by faces.
    segment = nearest // 2 if turns else nearest
    side = 1.0 - 2.0 * (nearest % 2) if turns else sides[segment, 0, column]
    return first, segments[segment], side
