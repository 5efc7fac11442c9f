"""Flight, sliding on a face, being carried along the belt: constant acceleration to an event."""

from __future__ import annotations

import numpy as np

from chutelab.ballistics import closing_time
from chutelab.exact.detect import Motion, first_contact
from chutelab.exact.obstacles import NONE, Floats, Ints, dot, pick
from chutelab.exact.round import carry_round, ride_on
from chutelab.exact.swarm import Mode, Swarm
from chutelab.exact.touch import end_slip, face_pull, settle_law, strike
from chutelab.recording import Kind

CONTACT, GRIP, END, EXIT, STOP = range(5)
"""What ends a stretch; earlier ones win ties."""

COLLINEAR = 1e-12
"""Sine of the angle at a joint below which one segment simply goes on as the next."""


def straight(s: Swarm, who: Ints) -> None:
    """Move particles on to their next event and resolve it."""
    face, carried = s.mode[who] == Mode.FACE, s.mode[who] == Mode.CARRIED
    flying = s.mode[who] == Mode.FLIGHT
    acceleration = np.zeros((len(who), 2))
    acceleration[flying, 1] = -s.gravity
    force = np.zeros(len(who))
    acceleration[face], force[face] = face_pull(s, who[face])

    times = np.full((5, len(who)), np.inf)
    times[GRIP, face], times[END, face] = _grip_and_end(
        s, who[face], acceleration[face], force[face]
    )
    v = s.v[who[carried], 0]
    with np.errstate(divide="ignore"):
        times[END, carried] = np.where(v > 0.0, -s.p[who[carried], 0] / v, np.inf)
    times[EXIT, flying] = _exit(s, who[flying])
    times[STOP] = s.stop[who] - s.age[who]
    on = np.where(carried, 0, s.on[who])
    motion = Motion(
        who, s.p[who], s.v[who], acceleration,
        np.where(carried, s.obstacles.pulley, s.left[who]),
        s.left_side[who], np.where(carried, 4, s.order[who]),
        on, np.where(carried, 1, s.side[who]),
    )  # fmt: skip
    times[CONTACT], obstacle, side = first_contact(
        motion, s.obstacles, s.radius, times[1:].min(axis=0)
    )
    outcome = np.argmin(times, axis=0)
    dt = times[outcome, np.arange(len(who))]
    s.count_idle(who, dt)

    _slide_books(s, who[face], dt[face], acceleration[face], force[face])
    s.age[who] += dt
    step = dt[:, None]
    s.p[who] += step * (s.v[who] + 0.5 * step * acceleration)
    s.v[who] += step * acceleration
    if s.spins:
        s.z[who] += 2.0 * force * dt
    s.p[who[face]] = s.obstacles.snapped(
        who[face], s.on[who[face]], s.side[who[face]], s.p[who[face]], s.radius
    )
    s.knots(who)

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
