"""Motion between events: flight, sliding on a face, being carried, riding round a circle.

The first three have constant acceleration. A ride by adhesion is in closed form, one by friction
goes step by step along the arc.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from chutelab.engines.exact.contacts import (
    end_roll,
    end_slip,
    face_force,
    look_round,
    pressed,
    rest_on,
    strike,
)
from chutelab.engines.exact.detect import FEW, Motion, bounds, first_contact
from chutelab.engines.exact.obstacles import NONE, dot, length_of, pick, rows_of
from chutelab.engines.exact.particle_state import Mode, State
from chutelab.mechanics.ballistics import descent
from chutelab.mechanics.contact import STEP_ANGLE, Circle, Outcome, advance, normal_force
from chutelab.results.record import Kind
from chutelab.util.arrays import Bools, Floats, Ints


def go_on(s: State, index: Ints, obstacle: Ints, side: Floats, joint: Ints) -> None:
    """Go on from the end of a face or an arc on what follows, or fly if nothing holds there.

    `joint` tells what is touched there, see `Joints.groups`.
    """
    if not len(index):
        return
    o, left, face = s.obstacles, s.on[index], s.side[index]
    ends = obstacle == NONE
    obstacle, side = np.where(ends, left, obstacle), np.where(ends, face, side)
    stays = ~ends & pressed(s, index, obstacle, s.contact(index, obstacle, side))
    off = ~stays
    s.part(index[off], o.surface[left[off]])
    # From a tangential joint it flies off what follows; from an end it leaves what ends.
    flush = ends | (obstacle < o.segments) | (obstacle >= o.first_arc)
    last, last_side = np.where(flush, obstacle, left), np.where(flush, side, face)
    s.fly(index[off], last[off], last_side[off], 2, joint[off])
    # Another surface is come on to without a blow: what it did on the one before ends there.
    surface = o.surface[obstacle]
    onto = stays & (surface != o.surface[left])
    lands = onto & (surface == s.machine.landing) & ~s.landed[index]
    s.slip[index[onto]], s.landed[index[lands]] = 1.0, True
    s.event(int(Kind.LANDING), index[lands], surface[lands])
    if s.machine.until == "landed":
        s.finish(index[lands], "landed")
        stays &= ~lands
    rest_on(s, index[stays], obstacle[stays], side[stays], np.zeros(np.count_nonzero(stays)))
    slips = onto & stays & ~lands & (s.slip[index] != 0.0)
    s.event(int(Kind.SLIP), index[slips], surface[slips])


def carry_round(s: State, index: Ints, start: Floats, v: Floats) -> None:
    """Carry particles by adhesion round the pulley, from an angle until cos φ1 = v²/(g ρ)."""
    if not len(index):
        return
    o = s.obstacles
    up = np.empty((2, len(index)))
    up[0], up[1] = np.sin(start), np.cos(start)
    rho = dot(s.p[:, index], up)
    s.p[:, index] = rho * up
    stop = s.next_change(index)
    left = stop - s.age[index]
    cosine = np.minimum(v**2 / (s.gravity[index] * rho), 1.0)
    end, found = start.copy(), None
    struck = cut = np.zeros(len(index), dtype=bool)
    stays = cosine < up[1]
    if np.count_nonzero(stays):
        last = np.arctan2(np.sqrt((1.0 - cosine) * (1.0 + cosine)), cosine)
        end = np.where(stays, last, start)
        pulley = np.full(len(index), o.pulley - o.segments)
        clockwise = np.ones(len(index))
        found = bounds(o, index, pulley, clockwise, rho, start, s.radius[index], s.epoch(index))[1]
        struck = ~found["handover"] & (found["angle"] < end)
        end = np.where(struck, found["angle"], end)
        cut = (end - start) * rho / v > left
        end = np.where(cut, start + left * v / rho, end)
        _ease_round(s, index, rho, v, start, end)
        if len(s.changes):
            s.age[index[cut]] = stop[cut]
    over = s.age[index] >= s.stop[index]
    # Where a gate opens or shuts the ride goes on, with another look at what is in the way.
    waits = cut & ~over if len(s.changes) else np.zeros(len(index), dtype=bool)
    hit, free = struck & ~over & ~waits, ~struck & ~over & ~waits
    s.finish(index[over], "time")
    s.part(index[free], 0)
    s.fly(index[free], o.pulley, 0, 2 + (end[free] > start[free]))
    if found is not None and np.count_nonzero(hit):
        strike(s, index[hit], found["obstacle"][hit], found["side"][hit])


def _ease_round(s: State, index: Ints, rho: Floats, v: Floats, first: Floats, end: Floats) -> None:
    """Carry particles from an angle of the pulley to another, knot by knot."""
    surface = s.obstacles.surface[s.obstacles.pulley]
    start, above, way = s.age[index], rho * np.cos(first), end - first
    pieces = np.ceil(way / STEP_ANGLE)
    for n in range(1, int(pieces.max()) + 1):
        on = (pieces >= n).nonzero()[0]
        riders, turn = index[on], way[on] * (n / pieces[on])
        part = first[on] + turn
        _place(s, riders, rho[on], part, v[on])
        s.age[riders] = start[on] + rho[on] * turn / v[on]
        # The belt lifts the particle, or lets it down: F v = -m g v sin φ, from the last knot on.
        height = rho[on] * np.cos(part)
        work = -s.mass[riders] * s.gravity[riders] * (above[on] - height)
        s.book(riders, np.full(len(riders), surface), work)
        above[on] = height
        s.knots(riders)


def ride(s: State, index: Ints) -> None:
    """Move riders on by one knot, or to the next event, and resolve it."""
    o, circle = s.obstacles, s.on[index]
    c = s.contact(index, circle, s.side[index])
    rho = pick(s.obstacles.rho, index, circle - s.obstacles.segments)
    phi = np.arctan2(c.normal[0], c.normal[1])
    # The angle goes on where a turn is complete.
    phi += 2.0 * np.pi * np.rint((s.angle[index] - phi) / (2.0 * np.pi))
    state = Circle(
        phi=phi,
        w=dot(s.v.take(index, axis=1), c.tangent),
        z=s.z[index],
        rho=rho,
        gravity=s.gravity[index],
        friction=c.friction,
        belt=c.belt,
        slip=s.slip[index],
        share=s.share[index],
        low=s.bounds["angle"][0, index],
        high=s.bounds["angle"][1, index],
    )
    if s.rolls:
        turn = s.surface_spin(index, circle)
        state = replace(state, rolling=s.rolling[index], roll=s.roll[index], turn=turn)
    lifted = ~pressed(s, index, circle, c)
    stop = s.next_change(index)
    step = advance(state, stop - s.age[index])
    outcome = np.where(lifted, Outcome.LIFT, step.outcome)
    go = np.flatnonzero(~lifted)
    s.count_idle(index, np.where(lifted, 0.0, step.dt))
    center = s.p.take(index, axis=1) - rho * c.normal
    mass = s.mass[index]

    def booked(work: Floats, heat: Floats, twist: Floats) -> tuple[Floats, Floats]:
        drive = work * c.belt
        return mass * (drive + twist * turn if s.rolls else drive), mass * heat

    at = ((step.knots[0] < step.dt) & ~lifted).nonzero()
    if len(at[1]):
        t, angle, w, z, *sums = step.knots
        work, heat = booked(*sums)
        rows = s.now(index)[:, at[1]]
        rows[0] += t[at]
        rows[1:3], rows[3:5] = _on_circle(rho[at[1]], angle[at], w[at], center[:, at[1]])
        if s.spins:
            rows[5] = z[at] / s.radius[index[at[1]]]
        rows[6] += work[at]
        rows[8] += heat[at]
        s.log.add(index[at[1]], rows)
    s.age[index[go]] += step.dt[go]
    _place(s, index[go], rho[go], step.phi[go], step.w[go], center[:, go])
    s.angle[index[go]] = step.phi[go]
    s.z[index[go]] = step.z[go]
    work, heat = booked(step.work, step.heat, step.twist)
    s.book(index[go], c.surface[go], work[go], 0.0, heat[go])
    s.knots(index[go])

    over = (outcome == Outcome.NOTHING) & (s.age[index] >= s.stop[index])
    s.finish(index[over], "time")
    if len(s.changes):
        changed = (outcome == Outcome.NOTHING) & (s.age[index] >= stop) & ~over
        s.age[index[changed]] = stop[changed]
        stays = o.present[s.epoch(index), circle]
        look_round(s, index[changed & stays])
        s.drop(index[changed & ~stays])
    lift = outcome == Outcome.LIFT
    s.part(index[lift], c.surface[lift])
    s.fly(index[lift], circle[lift], 0, np.where(lifted[lift], 2, 3))
    onset = outcome == Outcome.ONSET
    tends = np.sin(step.phi)
    if s.rolls:
        state = replace(state, phi=step.phi, w=step.w)
        load = normal_force(state)
        tends = state.gravity * tends - state.lever * s.roll[index] * s.rolling[index] * load
        starts = outcome == Outcome.ROLL
        s.roll[index[starts]] = -np.sign(np.sin(step.phi[starts]))
        end_roll(s, index[outcome == Outcome.HALT])
    s.slip[index[onset]] = np.sign(tends[onset])
    s.event(int(Kind.SLIP), index[onset], c.surface[onset])
    grip = outcome == Outcome.GRIP
    end_slip(s, index[grip])
    for way, code in enumerate((Outcome.LOW, Outcome.HIGH)):
        at = outcome == code
        there = s.bounds[way, index]
        obstacle, side = there["obstacle"], there["side"]
        joins = at & there["handover"]
        go_on(s, index[joins], obstacle[joins], side[joins], there["joint"][joins])
        hit = at & ~joins
        if hit.any():
            strike(s, index[hit], obstacle[hit], side[hit])


def _place(
    s: State, index: Ints, rho: Floats, phi: Floats, w: Floats, center: Floats | float = 0.0
) -> None:
    """Put particles at an angle of a circle, moving along it."""
    s.p[:, index], s.v[:, index] = _on_circle(rho, phi, w, center)


def _on_circle(
    rho: Floats, phi: Floats, w: Floats, center: Floats | float
) -> tuple[Floats, Floats]:
    """Return place and velocity (2, k) at an angle of a circle, moving along it."""
    sine, cosine = np.sin(phi), np.cos(phi)
    return center + rho * np.stack([sine, cosine]), w * np.stack([cosine, -sine])


CLEAR = 16.0
"""Way, in `Obstacles.touch`, after which a point has been away from what it touches."""

AT_REST = np.zeros((2, 1))
"""No acceleration."""


def fly(s: State, index: Ints) -> None:
    """Move particles in flight on to their next event and resolve it."""
    motion = _motion(s, index, rows_of(s.fall, index))
    joint = s.joint[index]
    if np.count_nonzero(joint != NONE):
        motion.joint = joint
    stops, leaves = s.stop[index] - s.age[index], None
    # What falls meets surfaces before it leaves the scene: when that is matters to few.
    if not s.falls or s.obstacles.segments > FEW:
        leaves = _exit(s, motion)
    dt, hits, obstacle, side = _next(
        s, motion, stops if leaves is None else np.minimum(leaves, stops)
    )
    free = ~hits
    goes_on = np.count_nonzero(free) > 0
    if goes_on and leaves is None:
        leaves = _exit(s, motion)
        dt = np.where(hits, dt, np.minimum(leaves, stops))
    _move(s, motion, dt)
    s.knots(index)
    if goes_on:
        out = index[free & (leaves <= stops)]
        s.event(int(Kind.EXIT), out)
        s.finish(out, "exit")
        _stop(s, index[free & (s.mode[index] != Mode.DONE)])
    _strike(s, index, hits, obstacle, side)


def carry(s: State, index: Ints) -> None:
    """Move particles that the belt carries on to the pulley, or to what is in the way."""
    if len(s.changes):
        # Particles that were on the pulley when a gate opened or shut.
        place = s.p[:, index]
        round_ = dot(place, s.up_belt[:, index]) > rows_of(s.obstacles.touch, index)
        turn, pace = np.arctan2(place[0], place[1]), length_of(s.v[:, index])
        carry_round(s, index[round_], turn[round_], pace[round_])
        index = index[~round_]
        if not len(index):
            return
    motion = _motion(s, index, AT_REST)
    motion.never = s.obstacles.under_belt
    before, v, way = motion.position, motion.velocity[0], motion.position[0]
    stops = s.stop[index] - s.age[index]
    if s.tilted:
        up_belt = rows_of(s.up_belt, index)
        v, way = dot(motion.velocity, up_belt), dot(before, up_belt)
    ends = -way / v
    ends[~(v > 0.0)] = np.inf
    dt, hits, obstacle, side = _next(s, motion, np.minimum(ends, stops))
    _move(s, motion, dt)
    if s.tilted:
        lifted = s.mass[index] * s.gravity[index] * (s.p[1, index] - before[1])
        s.book(index, s.obstacles.surface[np.zeros(len(index), dtype=np.int64)], lifted)
    s.knots(index)
    free = ~hits
    _stop(s, index[free & (stops < ends)])
    onto = free & (ends <= stops)
    start = np.arctan2(-up_belt[1], up_belt[0]) if s.tilted else np.zeros(len(index))
    carry_round(s, index[onto], start[onto], v[onto])
    _strike(s, index, hits, obstacle, side)


def slide(s: State, index: Ints) -> None:
    """Move particles on a face on to their next event and resolve it."""
    on, face = s.on[index], s.side[index]
    c = s.contact(index, on, face)
    pull, force, couple = face_force(s, index, c)
    motion = _motion(s, index, pull)
    motion.on, motion.on_side = on, face
    # The slip is linear in time, while there is one.
    slip = dot(motion.velocity, c.tangent) + s.z[index] - c.belt
    twist = s.lever[index] * (force + couple) if s.spins else np.zeros(len(index))
    rate = dot(pull, c.tangent) + twist
    fading = s.slip[index] * rate < 0.0
    grips = np.where(fading, np.maximum(-slip / np.where(fading, rate, 1.0), 0.0), np.inf)
    halts = np.full(len(index), np.inf)
    if s.rolls:
        spin = s.z[index].copy()
        halting = s.roll[index] * twist < 0.0
        halts[halting] = np.maximum(-spin[halting] / twist[halting], 0.0)
    ends = _end(s, motion)
    # Whatever it lies on may vanish; that counts as a stop.
    stop = np.minimum(s.stop[index], s.vanish(index)) if len(s.changes) else s.stop[index]
    stops = np.maximum(stop - s.age[index], 0.0)
    soonest = np.minimum(np.minimum(grips, halts), np.minimum(ends, stops))
    dt, hits, obstacle, side = _next(s, motion, soonest)
    mean = np.where(s.slip[index] == 0.0, 0.0, slip + 0.5 * rate * dt)
    mass = s.mass[index]
    heat = -mass * force * mean * dt
    if s.rolls:
        heat -= mass * couple * (spin + 0.5 * twist * dt) * dt
    s.book(index, c.surface, mass * force * c.belt * dt, 0.0, heat)
    _move(s, motion, dt)
    s.snap(index, on, face)
    if s.spins:
        s.z[index] += twist * dt
    # What was left at the beginning is some way off now.
    s.left[index[dt > 0.0]] = NONE
    s.knots(index)
    free = ~hits
    if s.rolls:
        halt = free & (halts <= soonest)
        end_roll(s, index[halt])
        free &= ~halt
    over = free & (stops < grips) & (stops < ends)
    if len(s.changes):
        opens = over & (stop < s.stop[index])
        s.age[index[opens]] = np.maximum(s.age[index], stop)[opens]
        s.drop(index[opens])
        over &= ~opens
    _stop(s, index[over])
    _leave_face(s, index[free & (ends < grips) & (ends <= stops)])
    end_slip(s, index[free & (grips <= ends) & (grips <= stops)])
    _strike(s, index, hits, obstacle, side)


def _motion(s: State, index: Ints, acceleration: Floats) -> Motion:
    return Motion(
        index,
        s.p.take(index, axis=1),
        s.v.take(index, axis=1),
        acceleration,
        s.left[index],
        s.left_side[index],
        s.order[index],
        s.past,
        gates=s.changes[:, index] - s.age[index] if len(s.changes) else None,
    )


def _next(s: State, motion: Motion, until: Floats) -> tuple[Floats, Bools, Ints, Floats]:
    """Return what `first_contact` does, and count events that take no time."""
    found = first_contact(motion, s.obstacles, s.radius[motion.rows], until)
    s.count_idle(motion.rows, found[0])
    return found


def _move(s: State, motion: Motion, dt: Floats) -> None:
    """Carry the state over a stretch."""
    at = s.at(motion.rows)
    s.age[at] += dt
    s.p[:, at] = place = motion.after(dt)
    if s.past is not None:
        middle = motion.after(0.5 * dt)
        touch = rows_of(s.obstacles.touch, motion.rows)
        away = (np.abs(place - middle) > CLEAR * touch).any(axis=0)
        s.past.place[:, motion.rows[away]] = middle[:, away]
    s.v[:, at] = motion.velocity + dt * motion.acceleration


def _strike(s: State, index: Ints, hits: Bools, obstacle: Ints, side: Floats) -> None:
    count = np.count_nonzero(hits)
    if count == len(index):
        strike(s, index, obstacle, side)
    elif count:
        strike(s, index[hits], obstacle[hits], side[hits])


def _stop(s: State, index: Ints) -> None:
    """End the tracks of particles whose time is over."""
    if len(index):
        s.age[index] = s.stop[index]
        s.finish(index, "time")


def _end(s: State, motion: Motion) -> Floats:
    """Return the times until the face ends."""
    index, on, o = motion.rows, s.on[motion.rows], s.obstacles
    tangent, length = pick(o.tangent, index, on), pick(o.length, index, on)
    foot = dot(motion.position - pick(o.start, index, on), tangent)
    pace, pull = dot(motion.velocity, tangent), dot(motion.acceleration, tangent)
    back, forth = _when(foot, pace, pull), _when(length - foot, -pace, -pull)
    return np.minimum(back, forth)


def _exit(s: State, motion: Motion) -> Floats:
    """Time until a flight leaves the scene."""
    left, bottom, right, top = s.exit_box[:, motion.rows]
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


def _leave_face(s: State, index: Ints) -> None:
    """Go on at the end of a face: onto the next segment, round the end, or into flight."""
    if not len(index):
        return
    o = s.obstacles
    segment, side = s.on[index], s.side[index]
    foot = dot(
        s.p.take(index, axis=1) - pick(o.start, index, segment), pick(o.tangent, index, segment)
    )
    end = (foot > 0.5 * pick(o.length, index, segment)).astype(np.int64)
    face = (side < 0.0).astype(np.int64)
    at = (s.epoch(index), segment, end, face)
    obstacle, obstacle_side = (array[at] for array in o.joints.onward)
    go_on(s, index, obstacle, obstacle_side, o.joints.groups[0][segment, end, face])
