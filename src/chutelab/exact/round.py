"""Rides round a circle: by adhesion in closed form, by friction step by step along the arc."""

from __future__ import annotations

import numpy as np

from chutelab.exact.arcs import Bounds, bounds
from chutelab.exact.obstacles import Floats, Ints, dot, pick
from chutelab.exact.swarm import Mode, Swarm
from chutelab.exact.touch import end_slip, rest_on, settle_law, strike
from chutelab.recording import Kind
from chutelab.ride import STEP_ANGLE, Circle, Outcome, advance, normal_force


def ride_on(s: Swarm, who: Ints, circle: Ints) -> None:
    """Go on from the end of a face round a circle, or fly if it curves away too fast."""
    if not len(who):
        return
    left, side, surface = s.on[who].copy(), s.side[who].copy(), s.obstacles.surface[s.on[who]]
    c = s.contact(who, circle, np.zeros_like(side))
    rho = pick(s.obstacles.rho, who, circle - s.obstacles.segments)
    w = dot(s.v[who], c.tangent)
    stays = s.weight_on(c.normal) - w**2 / rho > 0.0
    rest_on(s, who[stays], circle[stays], np.zeros_like(side[stays]), np.zeros(int(stays.sum())))
    off = ~stays
    s.event(Kind.SEPARATION, who[off], surface[off])
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
    s.p[who, 0] = 0.0
    rho, v = s.p[who, 1].copy(), s.v[who, 0].copy()
    with np.errstate(divide="ignore"):
        cosine = np.minimum(v**2 / (s.gravity * rho), 1.0) if s.gravity > 0.0 else np.ones(len(who))
    phi = np.arctan2(np.sqrt((1.0 - cosine) * (1.0 + cosine)), cosine)
    pulley = np.full(len(who), o.pulley - o.segments)
    found = Bounds.free(len(who))
    if phi.any():
        found = bounds(o, who, pulley, rho, np.zeros(len(who)), s.radius)
    struck = ~found.high_handover & (found.high < phi)
    end = np.where(struck, found.high, phi)
    end = np.where(
        s.age[who] + end * rho / v > s.stop[who], (s.stop[who] - s.age[who]) * v / rho, end
    )
    start, above = s.age[who].copy(), rho
    rides = np.flatnonzero(end > 0.0)
    pieces = np.ceil(end / STEP_ANGLE).max(initial=0.0)
    for n in range(1, int(pieces) + 1):
        part = end * (n / pieces)
        _place(s, who[rides], rho[rides], part[rides], v[rides])
        s.age[who[rides]] = (start + rho * part / v)[rides]
        # The belt lets the particle down: F v = -m g v sin φ, summed from the last knot.
        height = rho * np.cos(part)
        work = -s.mass * s.gravity * (above - height)
        s.recorder.book(who[rides], o.surface[o.pulley], work[rides])
        above = height
        s.knots(who[rides])
    over = s.age[who] >= s.stop[who]
    s.finish(who[over], "time")
    hit = struck & ~over
    free = ~hit & ~over
    s.event(Kind.SEPARATION, who[free], 0)
    s.fly(who[free], o.pulley, 0, np.where(end[free] > 0.0, 3, 2))
    if hit.any():
        strike(s, who[hit], found.high_obstacle[hit], found.high_side[hit])


def ride(s: Swarm, who: Ints) -> None:
    """Move riders on by one knot, or to the next event, and resolve it."""
    circle = s.on[who]
    c = s.contact(who, circle, s.side[who])
    rho = pick(s.obstacles.rho, who, circle - s.obstacles.segments)
    state = Circle(
        phi=np.arctan2(c.normal[:, 0], c.normal[:, 1]),
        w=dot(s.v[who], c.tangent),
        z=s.z[who],
        rho=rho,
        gravity=np.full(len(who), s.gravity),
        friction=c.friction,
        belt=s.belt[who],
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
    center = s.p[who] - rho[:, None] * c.normal
    _place(s, who[go], rho[go], step.phi[go], step.w[go], center[go])
    s.z[who[go]] = step.z[go]
    s.recorder.book(
        who[go],
        c.surface[go],
        (s.mass * step.work * s.belt[who])[go],
        0.0,
        (s.mass * step.heat)[go],
    )
    s.knots(who[go])

    over = (outcome == Outcome.NOTHING) & (s.age[who] >= s.stop[who])
    s.finish(who[over], "time")
    lift = outcome == Outcome.LIFT
    s.event(Kind.SEPARATION, who[lift], c.surface[lift])
    s.fly(who[lift], circle[lift], 0, np.where(lifted[lift], 2, 3))
    onset = outcome == Outcome.ONSET
    s.slip[who[onset]] = np.sign(np.sin(step.phi[onset]))
    s.event(Kind.SLIP, who[onset], c.surface[onset])
    grip = outcome == Outcome.GRIP
    end_slip(s, who[grip])
    for name, code in (("low", Outcome.LOW), ("high", Outcome.HIGH)):
        at = outcome == code
        obstacle = getattr(s.bounds, f"{name}_obstacle")[who]
        side = getattr(s.bounds, f"{name}_side")[who]
        joins = at & getattr(s.bounds, f"{name}_handover")[who]
        s.mode[who[joins]] = Mode.FACE
        s.on[who[joins]], s.side[who[joins]] = obstacle[joins], side[joins]
        settle_law(s, who[joins])
        hit = at & ~joins
        if hit.any():
            strike(s, who[hit], obstacle[hit], side[hit])


def _place(
    s: Swarm, who: Ints, rho: Floats, phi: Floats, w: Floats, center: Floats | float = 0.0
) -> None:
    """Put particles at an angle of a circle, moving along it."""
    sine, cosine = np.sin(phi), np.cos(phi)
    s.p[who] = center + rho[:, None] * np.stack([sine, cosine], axis=-1)
    s.v[who] = w[:, None] * np.stack([cosine, -sine], axis=-1)
