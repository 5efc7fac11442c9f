"""Motion between events: flight, sliding on a face, being carried, riding round a circle.

The first three have constant acceleration. A ride by adhesion is in closed form, one by friction
goes step by step along the arc.
"""

from __future__ import annotations

import numpy as np

from chutelab.engines.exact.contacts import end_slip, face_force, rest_on, settle_law, strike
from chutelab.engines.exact.detect import FEW, Motion, bounds, first_contact
from chutelab.engines.exact.obstacles import NONE, bare, dot, pick, rows_of
from chutelab.engines.exact.particle_state import Mode, Swarm
from chutelab.mechanics.ballistics import descent
from chutelab.mechanics.ride import STEP_ANGLE, Circle, Outcome, advance, normal_force
from chutelab.results import Kind
from chutelab.util.arrays import Bools, Floats, Ints


def ride_on(s: Swarm, who: Ints, circle: Ints) -> None:
    """Go on from the end of a face round a circle, or fly if it curves away too fast."""
    if not len(who):
        return
    left, side, surface = s.on[who].copy(), s.side[who].copy(), s.obstacles.surface[s.on[who]]
    c = s.contact(who, circle, np.zeros_like(side))
    rho = pick(s.obstacles.rho, who, circle - s.obstacles.segments)
    w = dot(s.v.take(who, axis=1), c.tangent)
    stays = s.weight_on(who, c.normal) - w**2 / rho > 0.0
    rest_on(s, who[stays], circle[stays], np.zeros_like(side[stays]), np.zeros(int(stays.sum())))
    off = ~stays
    s.part(who[off], surface[off])
    # From the pulley it flies tangentially, above it for good; from an end it leaves the face.
    from_pulley = circle[off] == s.obstacles.pulley
    s.fly(
        who[off],
        np.where(from_pulley, circle[off], left[off]),
        np.where(from_pulley, 0, side[off]),
        2,
    )


def carry_round(s: Swarm, who: Ints) -> None:
    """Carry particles by adhesion from the top of the pulley until cos φ1 = v²/(g ρ)."""
    if not len(who):
        return
    o = s.obstacles
    s.p[0, who] = 0.0
    rho, v = s.p[1, who], s.v[0, who]
    left = s.stop[who] - s.age[who]
    cosine = np.minimum(v**2 / (s.gravity[who] * rho), 1.0)
    end, struck, found = np.zeros(len(who)), np.zeros(len(who), dtype=bool), None
    if np.count_nonzero(cosine < 1.0):
        end = np.arctan2(np.sqrt((1.0 - cosine) * (1.0 + cosine)), cosine)
        pulley = np.full(len(who), o.pulley - o.segments)
        top, clockwise = np.zeros(len(who)), np.ones(len(who))
        found = bounds(o, who, pulley, clockwise, rho, top, s.radius[who])
        struck = ~found.high_handover & (found.high < end)
        end = np.where(struck, found.high, end)
        end = np.where(end * rho / v > left, left * v / rho, end)
        _ease_round(s, who, rho, v, end)
    over = s.age[who] >= s.stop[who]
    hit, free = struck & ~over, ~struck & ~over
    s.finish(who[over], "time")
    s.part(who[free], 0)
    s.fly(who[free], o.pulley, 0, 2 + (end[free] > 0.0))
    if found is not None and np.count_nonzero(hit):
        strike(s, who[hit], found.high_obstacle[hit], found.high_side[hit])


def _ease_round(s: Swarm, who: Ints, rho: Floats, v: Floats, end: Floats) -> None:
    """Carry particles from the top of the pulley to an angle, knot by knot."""
    surface = s.obstacles.surface[s.obstacles.pulley]
    start, above = s.age[who], rho.copy()
    pieces = np.ceil(end / STEP_ANGLE)
    for n in range(1, int(pieces.max()) + 1):
        on = (pieces >= n).nonzero()[0]
        riders, part = who[on], end[on] * (n / pieces[on])
        _place(s, riders, rho[on], part, v[on])
        s.age[riders] = start[on] + rho[on] * part / v[on]
        # The belt lets the particle down: F v = -m g v sin φ, summed from the last knot.
        height = rho[on] * np.cos(part)
        work = -s.mass[riders] * s.gravity[riders] * (above[on] - height)
        s.book(riders, np.full(len(riders), surface), work)
        above[on] = height
        s.knots(riders)


def ride(s: Swarm, who: Ints) -> None:
    """Move riders on by one knot, or to the next event, and resolve it."""
    circle = s.on[who]
    c = s.contact(who, circle, s.side[who])
    rho = pick(s.obstacles.rho, who, circle - s.obstacles.segments)
    state = Circle(
        phi=np.arctan2(c.normal[0], c.normal[1]),
        w=dot(s.v.take(who, axis=1), c.tangent),
        z=s.z[who],
        rho=rho,
        gravity=s.gravity[who],
        friction=c.friction,
        belt=c.belt,
        slip=s.slip[who],
        turns=np.full(len(who), s.spins),
        low=s.bounds.low[who],
        high=s.bounds.high[who],
    )
    lifted = normal_force(state) <= 0.0
    step = advance(state, s.stop[who] - s.age[who])
    outcome = np.where(lifted, Outcome.LIFT, step.outcome)
    go = np.flatnonzero(~lifted)
    s.count_idle(who, np.where(lifted, 0.0, step.dt))
    s.age[who[go]] += step.dt[go]
    center = s.p.take(who, axis=1) - rho * c.normal
    _place(s, who[go], rho[go], step.phi[go], step.w[go], center[:, go])
    s.z[who[go]] = step.z[go]
    mass = s.mass[who]
    s.book(
        who[go],
        c.surface[go],
        (mass * step.work * c.belt)[go],
        0.0,
        (mass * step.heat)[go],
    )
    s.knots(who[go])

    over = (outcome == Outcome.NOTHING) & (s.age[who] >= s.stop[who])
    s.finish(who[over], "time")
    lift = outcome == Outcome.LIFT
    s.part(who[lift], c.surface[lift])
    s.fly(who[lift], circle[lift], 0, np.where(lifted[lift], 2, 3))
    onset = outcome == Outcome.ONSET
    s.slip[who[onset]] = np.sign(np.sin(step.phi[onset]))
    s.event(int(Kind.SLIP), who[onset], c.surface[onset])
    grip = outcome == Outcome.GRIP
    end_slip(s, who[grip])
    for name, code in (("low", Outcome.LOW), ("high", Outcome.HIGH)):
        at = outcome == code
        obstacle = getattr(s.bounds, f"{name}_obstacle")[who]
        side = getattr(s.bounds, f"{name}_side")[who]
        joins = at & getattr(s.bounds, f"{name}_handover")[who]
        rest_on(s, who[joins], obstacle[joins], side[joins], np.zeros(np.count_nonzero(joins)))
        hit = at & ~joins
        if hit.any():
            strike(s, who[hit], obstacle[hit], side[hit])


def _place(
    s: Swarm, who: Ints, rho: Floats, phi: Floats, w: Floats, center: Floats | float = 0.0
) -> None:
    """Put particles at an angle of a circle, moving along it."""
    sine, cosine = np.sin(phi), np.cos(phi)
    s.p[:, who] = center + rho * np.stack([sine, cosine])
    s.v[:, who] = w * np.stack([cosine, -sine])


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
    mass = s.mass[who]
    s.book(who, c.surface, mass * force * c.belt * dt, 0.0, -mass * force * mean * dt)
    _move(s, motion, dt)
    s.p[:, who], _ = s.obstacles.snapped(who, on, side, s.p, s.radius[who])
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
    radius = s.radius[motion.rows]
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
        touch = rows_of(s.obstacles.touch, motion.rows)
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
    left, right, bottom, top = (side[motion.rows] for side in s.exit_box)
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
