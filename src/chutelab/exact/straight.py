"""Flight, sliding on a face, being carried along the belt: constant acceleration to an event."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from chutelab.ballistics import descent
from chutelab.exact.detect import FEW, first_contact
from chutelab.exact.grip import end_slip, face_force, settle_law
from chutelab.exact.motion import Motion
from chutelab.exact.obstacles import NONE, Floats, Ints, bare, dot, pick, rows_of
from chutelab.exact.round import carry_round, ride_on
from chutelab.exact.swarm import Mode
from chutelab.exact.touch import strike
from chutelab.many import of
from chutelab.recording import Kind

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from chutelab.exact.swarm import Swarm

    Bools = NDArray[np.bool_]

COLLINEAR = 1e-12
"""Sine of the angle at a joint below which one segment simply goes on as the next."""

CLEAR = 16.0
"""Way, in `Obstacles.touch`, after which a point has been away from what it touches."""

AT_REST = np.zeros((2, 1))
"""No acceleration."""


def fly(s: Swarm, who: Ints) -> None:
    """Move particles in flight on to their next event and resolve it."""
    motion = _motion(s, who, rows_of(s.fall, who))
    stops, leaves = s.stop[who] - s.age[who], None
    # What falls meets surfaces before it leaves the scene: when that is matters to few.
    if not s.falls or s.obstacles.segments > FEW:
        leaves = _exit(s, motion)
    dt, hits, meeting = _next(s, motion, stops if leaves is None else np.minimum(leaves, stops))
    free = ~hits
    goes_on = np.count_nonzero(free) > 0
    if goes_on and leaves is None:
        leaves = _exit(s, motion)
        dt = np.where(hits, dt, np.minimum(leaves, stops))
    _move(s, motion, dt)
    s.knots(who)
    if goes_on:
        out = who[free & (leaves <= stops)]
        s.event(int(Kind.EXIT), out)
        s.finish(out, "exit")
        _stop(s, who[free & (s.mode[who] != Mode.DONE)])
    _strike(s, who, hits, meeting)


def carry(s: Swarm, who: Ints) -> None:
    """Move particles that the belt carries on to the pulley, or to what is in the way."""
    motion = _motion(s, who, AT_REST)
    motion.never = s.obstacles.under_belt
    v = motion.velocity[0]
    ends, stops = -motion.position[0] / v, s.stop[who] - s.age[who]
    ends[~(v > 0.0)] = np.inf
    dt, hits, meeting = _next(s, motion, np.minimum(ends, stops))
    _move(s, motion, dt)
    s.knots(who)
    free = ~hits
    _stop(s, who[free & (stops < ends)])
    carry_round(s, who[free & (ends <= stops)])
    _strike(s, who, hits, meeting)


def slide(s: Swarm, who: Ints) -> None:
    """Move particles on a face on to their next event and resolve it."""
    on, side = s.on[who], s.side[who]
    c = s.contact(who, on, side)
    pull, force = face_force(s, who, c)
    motion = _motion(s, who, pull)
    motion.on = on
    # The slip is linear in time, while there is one.
    slip = dot(motion.velocity, c.tangent) + s.z[who] - c.belt
    rate = dot(pull, c.tangent) + (2.0 * force if s.spins else 0.0)
    grips, ends = _grip(s.slip[who], slip, rate), _end(s, motion)
    stops = s.stop[who] - s.age[who]
    dt, hits, meeting = _next(s, motion, np.minimum(np.minimum(grips, ends), stops))
    mean = np.where(s.slip[who] == 0.0, 0.0, slip + 0.5 * rate * dt)
    mass = of(s.mass, who)
    s.book(who, c.surface, mass * force * c.belt * dt, 0.0, -mass * force * mean * dt)
    _move(s, motion, dt)
    s.p[:, who], _ = s.obstacles.snapped(who, on, side, s.p, of(s.radius, who))
    if s.spins:
        s.z[who] += 2.0 * force * dt
    # What was left at the beginning is some way off now.
    s.left[who[dt > 0.0]] = NONE
    s.knots(who)
    free = ~hits
    _stop(s, who[free & (stops < grips) & (stops < ends)])
    _leave_face(s, who[free & (ends < grips) & (ends <= stops)])
    end_slip(s, who[free & (grips <= ends) & (grips <= stops)])
    _strike(s, who, hits, meeting)


def _motion(s: Swarm, who: Ints, acceleration: Floats) -> Motion:
    return Motion(
        who,
        s.p.take(who, axis=1),
        s.v.take(who, axis=1),
        acceleration,
        s.left[who],
        s.left_side[who],
        s.order[who],
        past=None if s.past is None else s.past.of(who),
    )


def _next(s: Swarm, motion: Motion, until: Floats) -> tuple[Floats, Bools, tuple[Ints, Floats]]:
    """Return how long the particles go on, who meets something then, and what (and its side).

    Not longer than `until`; a contact at that very time comes first.
    """
    radius = of(s.radius, motion.rows)
    dt, hits, obstacle, side = first_contact(motion, s.obstacles, radius, until)
    s.count_idle(motion.rows, dt)
    return dt, hits, (obstacle, side)


def _move(s: Swarm, motion: Motion, dt: Floats) -> None:
    """Carry the state over a stretch."""
    at = s.at(motion.rows)
    s.age[at] += dt
    s.p[:, at] = place = motion.after(dt)
    if s.past is not None:
        middle = motion.after(0.5 * dt)
        touch = of(s.obstacles.touch, motion.rows)
        away = (np.abs(place - middle) > CLEAR * touch).any(axis=0)
        s.past.place[:, motion.rows[away]] = middle[:, away]
    s.v[:, at] = motion.velocity + bare(dt) * motion.acceleration


def _strike(s: Swarm, who: Ints, hits: Bools, meeting: tuple[Ints, Floats]) -> None:
    obstacle, side = meeting
    count = np.count_nonzero(hits)
    if count == len(who):
        strike(s, who, obstacle, side)
    elif count:
        strike(s, who[hits], obstacle[hits], side[hits])


def _stop(s: Swarm, who: Ints) -> None:
    """End the tracks of particles whose time is over."""
    if len(who):
        s.age[who] = s.stop[who]
        s.finish(who, "time")


def _grip(sign: Floats, slip: Floats, rate: Floats) -> Floats:
    """Return the times until the slip is used up; inf where there is none or it grows."""
    fading = (sign != 0.0) & (sign * rate < 0.0)
    return np.where(fading, np.maximum(-slip / np.where(fading, rate, 1.0), 0.0), np.inf)


def _end(s: Swarm, motion: Motion) -> Floats:
    """Return the times until the face ends."""
    who, on, o = motion.rows, s.on[motion.rows], s.obstacles
    tangent, length = pick(o.tangent, who, on), pick(o.length, who, on)
    foot = dot(motion.position - pick(o.start, who, on), tangent)
    pace, pull = dot(motion.velocity, tangent), dot(motion.acceleration, tangent)
    back, forth = _when(foot, pace, pull), _when(length - foot, -pace, -pull)
    return np.minimum(back, forth)


def _exit(s: Swarm, motion: Motion) -> Floats:
    """Time until a flight leaves the scene; never in a run that lasts a number of seconds."""
    if s.machine.until == "time":
        return np.full(len(motion.rows), np.inf)
    left, right, bottom, top = (of(side, motion.rows) for side in s.exit_box)
    (x, y), (vx, vy) = motion.position, motion.velocity
    fall = rows_of(s.fall, motion.rows)
    time = _when(y - bottom, vy, fall[1])
    if not s.falls:
        for gap, rate in ((x - left, vx), (right - x, -vx), (top - y, -vy)):
            time = np.minimum(time, _when(gap, rate, fall[0]))
    return time


def _when(gap: Floats, rate: Floats, acceleration: Floats) -> Floats:
    """Time until a gap closes, at once if it is closed; inf if that was in the past or never is."""
    time = descent(np.maximum(gap, 0.0), rate, acceleration)
    return np.where(time >= 0.0, time, np.inf)


def _leave_face(s: Swarm, who: Ints) -> None:
    """Go on at the end of a face: onto the next segment, round the end, or into flight."""
    if not len(who):
        return
    o = s.obstacles
    segment, side = s.on[who], s.side[who]
    foot = dot(s.p.take(who, axis=1) - pick(o.start, who, segment), pick(o.tangent, who, segment))
    end = (foot > 0.5 * pick(o.length, who, segment)).astype(np.int64)
    following, circle = o.follow[segment, end], o.end_circle[segment, end]
    normal = side * pick(o.normal, who, segment)
    next_normal = pick(o.normal, who, np.maximum(following, 0))
    sine = normal[0] * next_normal[1] - normal[1] * next_normal[0]
    smooth = (following != NONE) & (np.abs(sine) <= COLLINEAR)
    onto = who[smooth]
    s.on[onto] = following[smooth]
    s.side[onto] = np.where(dot(normal[:, smooth], next_normal[:, smooth]) > 0.0, 1.0, -1.0)
    settle_law(s, onto)
    round_ = ~smooth & (circle != NONE)
    ride_on(s, who[round_], circle[round_])
    off = ~smooth & (circle == NONE)
    s.part(who[off], o.surface[segment[off]])
    s.fly(who[off], segment[off], side[off], 2)
