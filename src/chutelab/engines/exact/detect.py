"""What a particle meets next, and when: solved, not stepped.

In flight, or sliding straight, it may meet a face or a circle (an end, an arc from outside or
inside, the pulley). A ride round a circle is stopped by something else at an angle in closed form.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from chutelab.engines.exact.obstacles import FACES, NONE, Obstacles, dot, length_of, pick, rows_of
from chutelab.mechanics.ballistics import descent, descents
from chutelab.util.arrays import Bools, Floats, Ints

PARALLEL = 1e-14
"""Share of a speed or an acceleration along a surface below which it has no part towards it."""


@dataclass(slots=True, eq=False)
class Past:
    """What tells the side of a segment that points touch, of all particles of a block.

    A disk that touches a face cannot be on its other side, a point could.
    """

    obstacle: Ints  # what they touched before what they touch or leave now; -1 for nothing
    side: Floats  # its face
    place: Floats  # (2, n), where they last were away from what they touch now, m


@dataclass(slots=True, eq=False)
class Motion:
    """Particles (k,) that move with constant acceleration until something happens."""

    rows: Ints  # which particles they are
    position: Floats  # (2, k), m
    velocity: Floats  # (2, k), m/s
    acceleration: Floats  # (2, k) or (2, 1), m/s²
    # Obstacle (and face of it) in contact now that is being left, or -1; how many of the leading
    # coefficients of the gap to it are zero: 1 after a rebound, 2 when leaving tangentially, 3 when
    # lifting off a circle. They are exactly zero, so they are divided out.
    left: Ints
    left_side: Floats
    order: Ints
    past: Past | None = None  # of points
    on: Ints | None = None  # segment they slide on, which they cannot meet, and its face
    on_side: Floats | None = None
    joint: Ints | None = None  # set of `Joints.groups` that they leave all of, tangentially, or -1
    never: Bools | None = None  # (S + C,), obstacles that none of them can meet
    gates: Floats | None = None  # (T, k), times until gates open or shut, s

    def after(self, t: Floats) -> Floats:
        """Return where they are after times (k,), (2, k), m."""
        return self.position + t * (self.velocity + 0.5 * t * self.acceleration)


def epoch_of(gates: Floats, t: Floats) -> Ints:
    """Return how many of the changes at times `gates` (T, k) have been by times t (..., k)."""
    return sum((gate <= t for gate in gates), np.zeros(t.shape, dtype=np.int64))


def _counts(
    obstacles: Obstacles, gates: Floats | None, t: Floats, rows: Ints, circle: Ints, away: Floats
) -> Bools:
    """Tell which contacts with circles (k,) count: on the arc, and with what is there then."""
    counts = np.ones(len(rows), dtype=bool)
    if obstacles.span.size:
        counts &= obstacles.spanned(rows, circle, away)
    if gates is not None:
        counts &= obstacles.reached(rows, circle, away, epoch_of(gates, t))
    return counts


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
    which, index = pairs.nonzero()
    circle = circles[which]
    rows = motion.rows[index]
    v = motion.velocity[:, index]
    a = np.broadcast_to(motion.acceleration, motion.velocity.shape)[:, index]
    d = motion.position[:, index] - pick(obstacles.center, rows, circle)
    rho = pick(obstacles.rho, rows, circle)
    distance = np.hypot(d[0], d[1])
    # |d + v t + a t²/2|² - ρ², as a polynomial of t; ρ² less that from inside.
    sense, rho, touch = np.sign(rho), np.abs(rho), rows_of(obstacles.touch, rows)
    gap = np.empty((5, len(index)))
    gap[0] = (distance - rho) * (distance + rho)
    gap[1] = 2.0 * dot(d, v)
    gap[2] = dot(v, v) + dot(d, a)
    gap[3] = dot(v, a)
    gap[4] = 0.25 * dot(a, a)
    gap *= sense
    left = motion.left[index] - obstacles.segments
    leaving = left == circle
    if obstacles.arcs > 1:
        # Arcs that lie on each other are left together.
        alike = obstacles.joints.alike
        leaving |= (left >= 0) & (alike[np.maximum(left, 0)] == alike[circle])
    if motion.past is not None:
        leaving |= motion.left[index] == obstacles.back(circle)
    if motion.joint is not None:
        leaving |= obstacles.joints.shares(motion.joint[index], circle + obstacles.segments, 0)
    touching = np.abs(distance - rho) <= touch
    # The direction from the centre is as uncertain as the places are, over ρ.
    uncertain = 2.0 * (PARALLEL * rho + touch) * length_of(v)
    grazing = touching & (np.abs(gap[1]) <= uncertain)
    gap[1] = np.where(grazing & ~leaving, 0.0, gap[1])
    closing = touching & (gap[1] < 0.0)
    if motion.past is not None:
        # A point behind a circle does not meet it, however near it is.
        then = motion.past.place[:, rows] - pick(obstacles.center, rows, circle)
        closing &= sense * (np.hypot(then[0], then[1]) - rho) >= -touch
    order = np.where(leaving, motion.order[index], np.where(touching & ~closing, 1, 0))
    now = closing & ~leaving
    gates = None if motion.gates is None else motion.gates[:, index]
    now &= _counts(obstacles, gates, np.zeros(len(index)), rows, circle, d)
    for n in range(1, 4):
        shift = order >= n
        gap[:-1, shift] = gap[1:, shift]
        gap[-1, shift] = 0.0
    # Already past it for good, or never approaching it: no contact to find.
    open_ = (
        ~now & ((gap[0] >= 0.0) | (gap > 0.0).any(axis=0)) & (gap < 0.0).any(axis=0)
    ).nonzero()[0]
    t = np.where(now, 0.0, np.inf)
    if len(open_):
        d, v, a = d[:, open_], v[:, open_], a[:, open_]
        found = descents(gap[:, open_], until[index[open_]])
        if obstacles.span.size or gates is not None:
            gates = None if gates is None else gates[:, open_]
            for times in found:
                place = d + times * (v + 0.5 * times * a)
                ends = rows[open_], circle[open_]
                times[~_counts(obstacles, gates, times, *ends, place)] = np.inf
        t[open_] = _polished(
            found.min(axis=0), d, v, a, sense[open_] * rho[open_], order[open_] == 0
        )
    if obstacles.span.size:
        bent = (pick(obstacles.span[1], rows, circle) < 2.0 * np.pi).nonzero()[0]
        if len(bent):
            at = index[bent]
            sides = None if motion.gates is None else motion.gates[:, at]
            t[bent] = np.minimum(
                t[bent], _entry(motion, obstacles, until[at], at, circle[bent], sides)
            )
    # The soonest is written last; of those met at once, the one with the lowest number.
    best = np.argsort(t, kind="stable")[::-1]
    time[index[best]], nearest[index[best]] = t[best], circle[best]
    return time, nearest


def _entry(
    motion: Motion, obstacles: Obstacles, until: Floats, index: Ints, circle: Ints,
    gates: Floats | None,
) -> Floats:  # fmt: skip
    """Return when paths come in past the end of an arc along its face, (k,); inf if they do not.

    Before that the arc is not beside the particle, and the gap to its circle may have any sign.
    Where the gap is zero at the instant at which the arc comes to be beside it, there is no
    crossing from positive to negative: it is a contact if the gap falls from there.
    """
    rows = motion.rows[index]
    d = motion.position[:, index] - pick(obstacles.center, rows, circle)
    v = motion.velocity[:, index]
    a = np.broadcast_to(motion.acceleration, motion.velocity.shape)[:, index]
    rho, touch = pick(obstacles.rho, rows, circle), rows_of(obstacles.touch, rows)
    begin, extent = pick(obstacles.span, rows, circle)
    first = np.full(len(index), np.inf)
    for end, angle, turn in ((1, begin, 1.0), (0, begin + extent, -1.0)):
        out = np.stack([np.cos(angle), np.sin(angle)])
        away = turn * np.stack([out[1], -out[0]])
        ahead = dot(away, d)
        if motion.joint is not None:
            # It is exactly there now.
            joint = motion.joint[index]
            here = (joint != NONE) & obstacles.joints.groups[2][joint, circle, end]
            ahead = np.where(here, 0.0, ahead)
        time = descent(ahead, dot(away, v), dot(away, a))
        enters = (time > 0.0) & (time < until)
        time = np.where(enters, time, 0.0)
        place, pace = d + time * (v + 0.5 * time * a), v + time * a
        enters &= np.abs(dot(out, place) - np.abs(rho)) <= touch
        some = enters.nonzero()[0]
        if not len(some):
            continue
        place, pace, pull, time = place[:, some], pace[:, some], a[:, some], time[some]
        if gates is not None:
            there = epoch_of(gates[:, some], time)
            enters[some] = obstacles.reached(rows[some], circle[some], place, there)
        # The gap, which is zero then, over the time since: so its own zero is divided out.
        gap = np.zeros((5, len(some)))
        gap[0], gap[1] = 2.0 * dot(place, pace), dot(pace, pace) + dot(place, pull)
        gap[2], gap[3] = dot(pace, pull), 0.25 * dot(pull, pull)
        gap *= np.sign(rho[some])
        falls = np.where(gap[0] < 0.0, 0.0, descents(gap, until[some] - time).min(axis=0))
        first[some] = np.minimum(first[some], np.where(enters[some], time + falls, np.inf))
    return first


def _polished(t: Floats, d: Floats, v: Floats, a: Floats, rho: Floats, apart: Bools) -> Floats:
    """Improve contact times by one Newton step on the distance itself.

    Its rounding does not grow with the flight, as the polynomial's does; but of a contact that is
    being left (not `apart` before) the polynomial, divided by t, is better on ways below ρ.
    """
    time = np.where(np.isfinite(t), t, 0.0)
    there, pace = d + time * (v + 0.5 * time * a), v + time * a
    distance = np.hypot(there[0], there[1])
    rate = np.sign(rho) * dot(there, pace) / distance
    steep = np.isfinite(t) & (rate < -GLANCING * length_of(pace))
    better = steep & (apart | (-rate * time > np.abs(rho)))
    correction = np.sign(rho) * (distance - np.abs(rho)) / np.where(better, rate, 1.0)
    return np.where(better, np.maximum(t - correction, 0.0), t)


def hidden(motion: Motion, obstacles: Obstacles, circles: Ints) -> Bools:
    """Which of the circles a particle cannot meet, from where it is or comes from, (C, k)."""
    segments, left = obstacles.segments, motion.left
    out = np.zeros((len(circles), len(left)), dtype=bool)
    curved = motion.order >= FROM_CURVE
    if np.count_nonzero(curved):
        # Left tangentially with the speed not falling, all terms of the gap to a circle grow.
        curved &= dot(motion.velocity, motion.acceleration) >= 0.0
        if obstacles.arcs:
            curved &= pick(obstacles.rho, motion.rows, np.maximum(left - segments, 0)) > 0.0
        out |= curved & (left == (circles + segments)[:, None])
    # A face that is left with the pull away from it hides its own two ends, as does one slid on.
    flat = (left >= 0) & (left < segments)
    if np.count_nonzero(flat):
        normal = motion.left_side * pick(obstacles.normal, motion.rows, left)
        flat &= dot(motion.acceleration, normal) >= 0.0
        out |= obstacles.joints.owns[circles][:, np.where(flat, left, 0)] & flat
    if motion.on is not None:
        assert motion.on_side is not None
        face = np.where(motion.on_side < 0.0, 1, 0)
        out |= obstacles.joints.beside[circles][:, motion.on, face]
    return out


SIDES = np.array([[1.0], [-1.0]])
"""The two faces of a segment."""

FEW = 4
"""Segments up to which looking at all takes no longer than finding out which to look at."""


def first_contact(
    motion: Motion, obstacles: Obstacles, radius: Floats, until: Floats
) -> tuple[Floats, Bools, Ints, Floats]:
    """Return when particles meet something, which of them do, and its number and side, (k,).

    Finds: faces within a segment's length, ends of segments (for a disk), the pulley. Misses, by
    design: a point against the end of a segment, and anything the particle overlaps already.

    Times count from now, and are not longer than `until` (s, finite, after which nothing matters):
    a contact at that very time comes first. Number and side are anything where there is no contact;
    the side is +1 or -1 for a face, 0 for a circle.
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
        return np.arange(obstacles.segments), np.arange(len(obstacles.rho))
    low, high = places
    if low.shape[1] > 1:
        low = np.minimum.reduce(low, axis=1, keepdims=True)
        high = np.maximum.reduce(high, axis=1, keepdims=True)
    lowest, highest = obstacles.bound
    each = (low < highest) & (high > lowest)
    near = each[0] & each[1]
    if motion.never is not None:
        near &= ~motion.never
    faces = near[: obstacles.segments].nonzero()[0]
    if motion.on is not None and len(faces):
        # A sliding particle cannot hit the opposite face.
        faces = faces[(motion.on != faces[:, None]).any(axis=1)]
    return faces, near[obstacles.segments :].nonzero()[0]


def _faces(
    motion: Motion, obstacles: Obstacles, radius: Floats, until: Floats, segments: Ints
) -> tuple[Floats, Ints, Floats]:
    """Return time, segment and side of the first face met up to `until`, (k,); time inf if none.

    Of the given segments; works on arrays of shape (S, F, k), where F is 1 if no path turns back
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
    if motion.joint is not None:
        face = np.where(sides < 0.0, 1, 0)
        both = obstacles.joints.shares(motion.joint, segments[:, None, None], face)
        same, leaving = same | both, leaving | both
    touching = np.abs(gap) <= rows_of(obstacles.touch, motion.rows)
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
        place, segment = past.place.take(motion.rows, axis=1), segments[:, None, None]
        height_then = dot(place[:, None, None] - faces[:, 2], frame[:, 0])
        known = past.obstacle[motion.rows] == segment
        behind = sides * np.where(known, past.side[motion.rows], height_then) < 0.0
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
    if motion.gates is not None:
        valid &= obstacles.present[epoch_of(motion.gates, time), segments[:, None, None]]
    time[~valid] = np.inf
    flat = time.reshape(-1, time.shape[-1])
    nearest, column = flat.argmin(axis=0), np.arange(flat.shape[1])
    first = flat[nearest, column]
    # Rows go by segments, then by faces.
    segment = nearest // 2 if turns else nearest
    side = 1.0 - 2.0 * (nearest % 2) if turns else sides[segment, 0, column]
    return first, segments[segment], side


NOW = 2e-11
"""rad; an obstacle this close to the present angle is met now: by rounding it may be passed."""

WAYS = np.array([[-1.0], [1.0]])
"""Backwards and forwards, as rows of what `bounds` returns."""


BOUND = np.dtype(
    [("angle", "f8"), ("obstacle", "i8"), ("side", "f8"), ("handover", "?"), ("joint", "i8")]
)
"""Nearest angle (rad) in one direction where a ride ends, and what is there.

∓inf and obstacle -1 where the way is free. `handover` marks where something takes over without a
blow: at an end of the circle a face of its segment, at the tip of a moving one, where the rim
changes its direction, the other half of the circle. `joint` is what is touched all at once where a
piece ends, a number in `Joints.groups`, or -1."""


def bounds(
    obstacles: Obstacles, rows: Ints, circle: Ints, side: Floats, rho: Floats, phi: Floats,
    radius: Floats, epoch: Ints,
) -> NDArray[Any]:  # fmt: skip
    """Return what stops rides round circles backwards and forwards, (2, k), dtype `BOUND`.

    Of particles `rows` on circles (obstacle number less S), on the half that `side` tells (see
    `Obstacles.rim_side`), whose centres move at a radius `rho` (m) and are now at `phi` (rad, from
    the top, clockwise). Only of what is there now, after so many changes as `epoch` tells.
    """
    found = np.zeros((2, len(rows)), dtype=BOUND)
    found["angle"], found["obstacle"] = WAYS * np.inf, NONE

    def narrow(
        angle: Floats, closing: Floats, met: Bools, obstacle: Ints | int, side: Floats | int,
        handover: bool = False, joint: int = NONE,
    ) -> None:  # fmt: skip
        """Take in one more obstacle, whose gap falls with φ at the rate `closing` at `angle`."""
        rate = WAYS * closing
        ahead = np.maximum(np.mod(WAYS * (angle - phi) + NOW, 2.0 * np.pi) - NOW, 0.0)
        place = phi + WAYS * ahead
        nearer = met & (rate > 0.0) & (WAYS * (place - found["angle"]) < 0.0)
        np.copyto(found["angle"], place, where=nearer)
        np.copyto(found["obstacle"], obstacle, where=nearer)
        np.copyto(found["side"], side, where=nearer)
        np.copyto(found["handover"], handover, where=nearer)
        np.copyto(found["joint"], joint, where=nearer)

    center, facing, joints = pick(obstacles.center, rows, circle), np.sign(rho), obstacles.joints
    for segment in range(obstacles.segments):
        start = rows_of(obstacles.start[:, segment], rows)
        tangent = rows_of(obstacles.tangent[:, segment], rows)
        normal = rows_of(obstacles.normal[:, segment], rows)
        length = rows_of(obstacles.length[segment], rows)
        for n, face in enumerate(FACES):
            # The gap to a face is ρ (cos(φ - tilt) - level).
            tilt = np.arctan2(face * normal[0], face * normal[1])
            level = (face * dot(start - center, normal) + radius) / rho
            half = np.arccos(np.clip(level, -1.0, 1.0))
            # A ride that only touches goes on.
            met = (np.abs(level) < 1.0) & ~joints.beside[circle, segment, n]
            met &= obstacles.present[epoch, segment]
            for angle in (tilt - half, tilt + half):
                foot = dot(center + rho * _up(angle) - start, tangent)
                beside = met & (foot >= 0.0) & (foot <= length)
                narrow(angle, facing * np.sin(angle - tilt), beside, segment, face)
    here = circle + obstacles.segments
    for this in np.unique(here).tolist():
        for piece, end, face, onto in joints.handovers.get(this, ()):
            outward = rows_of(joints.tips[1][:, piece, end], rows)
            tilt = np.arctan2(outward[0], outward[1])
            angle = tilt - 0.5 * np.pi if (face > 0) == (end > 0) else tilt + 0.5 * np.pi
            closing = facing * np.sin(angle - tilt)
            number = joints.obstacle(piece, face)
            goes = (here == this) & obstacles.present[epoch, number]
            joint = int(joints.groups[0][piece, end, FACES.index(face)])
            if onto:
                narrow(angle, closing, goes, number, face, True, joint)
            else:
                at = (epoch, piece, end, FACES.index(face))
                obstacle, side_there = (array[at] for array in joints.onward)
                narrow(angle, -closing, goes, obstacle, side_there, True, joint)
    crown = pick(joints.crown, rows, circle)
    tilt = np.arctan2(crown[0], crown[1])
    moves = (crown != 0.0).any(axis=0) & (pick(obstacles.material, rows, here)[0] != 0.0)
    for angle in (tilt - 0.5 * np.pi, tilt + 0.5 * np.pi):
        narrow(angle, side * np.sin(angle - tilt), moves, here, -side, True)
    for other in range(obstacles.center.shape[1]):
        # The gap to a circle grows with -cos(φ - tilt).
        apart = rows_of(obstacles.center[:, other], rows) - center
        distance = np.hypot(apart[0], apart[1])
        distinct = (circle != other) & (distance > rows_of(obstacles.touch, rows))
        distinct &= ~joints.beside[circle, other + obstacles.segments, 0]
        reach = rows_of(obstacles.rho[other], rows)
        level = (rho**2 + distance**2 - reach**2) / np.where(distinct, 2.0 * rho * distance, 1.0)
        met = distinct & (np.abs(level) < 1.0)
        half = np.arccos(np.clip(level, -1.0, 1.0))
        tilt = np.arctan2(apart[0], apart[1])
        for angle in (tilt - half, tilt + half):
            closing = -np.sign(reach) * facing * np.sin(angle - tilt)
            spans, which, away = met, np.full(len(rows), other), rho * _up(angle) - apart
            if obstacles.span.size:
                spans = spans & obstacles.spanned(rows, which, away)
            if len(obstacles.changes):
                spans = spans & obstacles.reached(rows, which, away, epoch)
            narrow(angle, closing, spans, other + obstacles.segments, 0)
    return found


def _up(angle: Floats) -> Floats:
    return np.stack([np.sin(angle), np.cos(angle)])
