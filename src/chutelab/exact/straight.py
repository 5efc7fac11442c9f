"""Flight, sliding on a face, being carried along the belt: constant acceleration to an event."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from chutelab.ballistics import closing_time
from chutelab.exact.detect import Motion, first_contact
from chutelab.exact.obstacles import NONE, Floats, Ints, dot, pick
from chutelab.exact.round import carry_round, ride_on
from chutelab.exact.swarm import Mode, Swarm
from chutelab.exact.touch import end_slip, face_pull, settle_law, strike
from chutelab.recording import Kind

if TYPE_CHECKING:
    from numpy.typing import NDArray

CONTACT, GRIP, END, EXIT, STOP = range(5)
"""What ends a stretch; earlier ones win ties."""

COLLINEAR = 1e-12
"""Sine of the angle at a joint below which one segment simply goes on as the next."""


def straight(s: Swarm, who: Ints) -> None:
    """Move particles on to their next event and resolve it."""
    face, carried = s.mode[who] == Mode.FACE, s.mode[who] == Mode.CARRIED
    motion, force = _motion(s, who, face, carried)
    times = _times(s, motion, face, carried, force)
    until = times[GRIP:].min(axis=0)
    times[CONTACT], obstacle, side = first_contact(motion, s.obstacles, s.radius, until)
    outcome = np.argmin(times, axis=0)
    dt = times[outcome, np.arange(len(who))]
    s.count_idle(who, dt)
    _move(s, motion, dt, face, force)

    stopped = outcome == STOP
    s.age[who[stopped]] = s.stop[who[stopped]]
    s.finish(who[stopped], "time")
    out = who[outcome == EXIT]
    s.event(Kind.EXIT, out)
    s.finish(out, "exit")
    _leave_face(s, who[(outcome == END) & face])
    carry_round(s, who[(outcome == END) & carried])
    end_slip(s, who[outcome == GRIP])
    hit = outcome == CONTACT
    if hit.any():
        strike(s, who[hit], obstacle[hit], side[hit])


def _motion(
    s: Swarm, who: Ints, face: NDArray[np.bool_], carried: NDArray[np.bool_]
) -> tuple[Motion, Floats]:
    """Return how the particles move now, and the friction force per mass on faces, (k,)."""
    acceleration, force = np.zeros((len(who), 2)), np.zeros(len(who))
    acceleration[~face & ~carried, 1] = -s.gravity
    if face.any():
        acceleration[face], force[face] = face_pull(s, who[face])
    left, order, on, side = s.left[who], s.order[who], s.on[who], s.side[who]
    if carried.any():
        # Held on the belt, whatever the height in the bed: neither belt nor pulley is met.
        left, order = np.where(carried, s.obstacles.pulley, left), np.where(carried, 4, order)
        on, side = np.where(carried, 0, on), np.where(carried, 1, side)
    motion = Motion(who, s.p[who], s.v[who], acceleration, left, s.left_side[who], order, on, side)
    return motion, force


def _times(
    s: Swarm, motion: Motion, face: NDArray[np.bool_], carried: NDArray[np.bool_], force: Floats
) -> Floats:
    """Return when each of the events would come, (5, k), but for contacts."""
    who = motion.rows
    times = np.full((5, len(who)), np.inf)
    if face.any():
        times[GRIP, face], times[END, face] = _grip_and_end(
            s, who[face], motion.acceleration[face], force[face]
        )
    if carried.any():
        v = motion.velocity[carried, 0]
        with np.errstate(divide="ignore"):
            times[END, carried] = np.where(v > 0.0, -motion.position[carried, 0] / v, np.inf)
    flying = ~face & ~carried
    if flying.any():
        times[EXIT, flying] = _exit(s, who[flying])
    times[STOP] = s.stop[who] - s.age[who]
    return times


def _move(s: Swarm, motion: Motion, dt: Floats, face: NDArray[np.bool_], force: Floats) -> None:
    """Carry the state over a stretch, and book what friction did."""
    who, step = motion.rows, dt[:, None]
    sliding = who[face]
    _slide_books(s, sliding, dt[face], motion.acceleration[face], force[face])
    s.age[who] += dt
    s.p[who] += step * (motion.velocity + 0.5 * step * motion.acceleration)
    s.v[who] += step * motion.acceleration
    if s.spins:
        s.z[who] += 2.0 * force * dt
    if len(sliding):
        s.p[sliding] = s.obstacles.snapped(
            sliding, s.on[sliding], s.side[sliding], s.p[sliding], s.radius
        )
    s.knots(who)


def _grip_and_end(
    s: Swarm, who: Ints, acceleration: Floats, force: Floats
) -> tuple[Floats, Floats]:
    """Return the times until the slip is used up and until the face ends."""
    c = s.contact(who, s.on[who], s.side[who])
    w, a = dot(s.v[who], c.tangent), dot(acceleration, c.tangent)
    slip = w + s.z[who] - c.belt
    rate = a + (2.0 * force if s.spins else 0.0)
    sign = s.slip[who]
    fading = (sign != 0.0) & (sign * rate < 0.0)
    grip = np.where(fading, np.maximum(-slip / np.where(fading, rate, 1.0), 0.0), np.inf)
    tangent = pick(s.obstacles.tangent, who, s.on[who])
    foot = dot(s.p[who] - pick(s.obstacles.start, who, s.on[who]), tangent)
    length = pick(s.obstacles.length, who, s.on[who])
    pace, pull = dot(s.v[who], tangent), dot(acceleration, tangent)
    ends = [
        closing_time(np.maximum(foot, 0.0), pace, pull),
        closing_time(np.maximum(length - foot, 0.0), -pace, -pull),
    ]
    return grip, np.minimum(*(np.where(t < 0.0, np.inf, t) for t in ends))


def _exit(s: Swarm, who: Ints) -> Floats:
    """Time until a flight leaves the scene."""
    left, right, bottom, top = s.machine.exit_box
    p, v = s.p[who], s.v[who]
    times = [closing_time(np.maximum(p[:, 1] - bottom, 0.0), v[:, 1], -s.gravity)]
    if s.gravity == 0.0:
        for gap, rate in (
            (p[:, 0] - left, v[:, 0]),
            (right - p[:, 0], -v[:, 0]),
            (top - p[:, 1], -v[:, 1]),
        ):
            times.append(closing_time(np.maximum(gap, 0.0), rate, 0.0))
    times = [np.where(t < 0.0, np.inf, t) for t in times]
    return np.asarray(np.min(times, axis=0))


def _slide_books(s: Swarm, who: Ints, dt: Floats, acceleration: Floats, force: Floats) -> None:
    """Book friction during a stretch on a face: the force is constant, the slip linear in time."""
    if not len(who):
        return
    c = s.contact(who, s.on[who], s.side[who])
    gripping = s.slip[who] == 0.0
    start = dot(s.v[who], c.tangent) + s.z[who] - c.belt
    rate = dot(acceleration, c.tangent) + (2.0 * force if s.spins else 0.0)
    mean = np.where(gripping, 0.0, start + 0.5 * rate * dt)
    s.recorder.book(who, c.surface, s.mass * force * c.belt * dt, 0.0, -s.mass * force * mean * dt)


def _leave_face(s: Swarm, who: Ints) -> None:
    """Go on at the end of a face: onto the next segment, round the end, or into flight."""
    if not len(who):
        return
    o = s.obstacles
    segment, side = s.on[who], s.side[who]
    foot = dot(s.p[who] - pick(o.start, who, segment), pick(o.tangent, who, segment))
    end = (foot > 0.5 * pick(o.length, who, segment)).astype(np.int64)
    following, circle = o.follow[segment, end], o.end_circle[segment, end]
    normal = side[:, None] * pick(o.normal, who, segment)
    next_normal = pick(o.normal, who, np.maximum(following, 0))
    sine = normal[:, 0] * next_normal[:, 1] - normal[:, 1] * next_normal[:, 0]
    smooth = (following != NONE) & (np.abs(sine) <= COLLINEAR)
    onto = who[smooth]
    s.on[onto] = following[smooth]
    s.side[onto] = np.where(dot(normal[smooth], next_normal[smooth]) > 0.0, 1, -1)
    settle_law(s, onto)
    round_ = ~smooth & (circle != NONE)
    ride_on(s, who[round_], circle[round_])
    off = ~smooth & (circle == NONE)
    s.event(Kind.SEPARATION, who[off], o.surface[segment[off]])
    s.fly(who[off], segment[off], side[off], 2)
