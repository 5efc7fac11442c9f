"""Rides round a circle: by adhesion in closed form, by friction step by step along the arc."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from chutelab.exact.arcs import bounds
from chutelab.exact.grip import end_slip
from chutelab.exact.obstacles import Floats, Ints, dot, pick
from chutelab.exact.touch import rest_on, strike
from chutelab.many import of
from chutelab.recording import Kind
from chutelab.ride import STEP_ANGLE, Circle, Outcome, advance, normal_force

if TYPE_CHECKING:
    from chutelab.exact.swarm import Swarm


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
    cosine = np.minimum(v**2 / (of(s.gravity, who) * rho), 1.0)
    end, struck, found = np.zeros(len(who)), np.zeros(len(who), dtype=bool), None
    if np.count_nonzero(cosine < 1.0):
        end = np.arctan2(np.sqrt((1.0 - cosine) * (1.0 + cosine)), cosine)
        pulley = np.full(len(who), o.pulley - o.segments)
        top, clockwise = np.zeros(len(who)), np.ones(len(who))
        found = bounds(o, who, pulley, clockwise, rho, top, of(s.radius, who))
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
        work = -of(s.mass, riders) * of(s.gravity, riders) * (above[on] - height)
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
        gravity=np.full(len(who), of(s.gravity, who)),
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
    mass = of(s.mass, who)
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
