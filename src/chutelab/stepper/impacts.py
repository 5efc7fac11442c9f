"""Impacts at the instant they happen: off one path, by one contact, onto another.

Plain numbers throughout: an impact concerns one or two particles, and there are many of them.
"""

from __future__ import annotations

from math import hypot
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from chutelab.recording import Kind
from chutelab.stepper.crowd import MOST
from chutelab.stepper.outline import PARALLEL, Touch
from chutelab.stepper.solids import DEEP, SLOP
from chutelab.stepper.tracks import CARRIED, FLYING, RESTING

if TYPE_CHECKING:
    from chutelab.stepper.state import Run

Vector = tuple[float, float]

SHALLOW = 0.5 * SLOP
"""Share of the radius by which what is struck may sink into the face it lies on until the next step
parts them: less than pymunk leaves alone, so that many of them make no deep overlap."""

FAINT = 0.01
"""Share of a step's worth of gravity below which even a first approach is no impact."""


class Partner(NamedTuple):
    """The other side of an impact.

    Attributes
    ----------
    particle, solid : int
        Which one it is; the other is -1.
    normal : tuple of float
        Unit normal from it.
    velocity : tuple of float
        Of its surface along (n_y, -n_x), of the whole along n, m/s; rotation left out.
    omega : float
        rad/s; 0 for a solid.
    free : bool
        Whether an impulse moves it.
    supported : bool
        Whether it, or who meets it, is in contact with something else already.
    curvature : float
        1/m, of the path of a disk that stays in contact with it.
    gap : float
        m; negative if they overlap.
    """

    particle: int
    solid: int
    normal: Vector
    velocity: Vector
    omega: float
    free: bool
    supported: bool
    curvature: float
    gap: float


def solid_partner(run: Run, touch: Touch) -> Partner:
    """Return a solid, touched."""
    belt = run.solids.belt_at(touch.solid, touch.normal)
    return Partner(
        -1, touch.solid, touch.normal, (belt, 0.0), 0.0, False, True, touch.curvature, touch.gap
    )  # fmt: skip


def particle_partner(run: Run, i: int, j: int, t: float) -> Partner:
    """Return particle j, met by particle i at t."""
    k = run.tracks
    x, y, _, _ = k.state(i, t)
    xj, yj, ux, uy = k.state(j, t)
    dx, dy = x - xj, y - yj
    apart = hypot(dx, dy)
    nx, ny = dx / apart, dy / apart
    carried = bool(k.mode[j] == CARRIED)
    supported = carried or bool(k.mode[i] == RESTING) or bool(k.mode[j] == RESTING)
    return Partner(
        j, -1, (nx, ny), (ux * ny - uy * nx, ux * nx + uy * ny), 0.0 if carried else k.turn(j),
        not carried, supported, 0.0, min(apart - 2.0 * run.radius, 0.0),
    )  # fmt: skip


def strike(run: Run, i: int, partner: Partner, t: float) -> None:
    """Resolve the contact of particle i, not carried, with a partner at t."""
    k, (nx, ny), j = run.tracks, partner.normal, partner.particle
    x, y, vx, vy = k.state(i, t)
    spin, belt = k.turn(i), partner.velocity[0]
    mine = vx * ny - vy * nx, vx * nx + vy * ny
    approach = mine[1] - partner.velocity[1]
    slip = mine[0] - belt + run.radius * (spin + partner.omega)
    impacts = run.crowd.count(i, j if partner.free else i, t)
    calm = run.soft if partner.supported else 0.0
    if run.crowd.is_in(impacts):
        calm = run.crowd.least_approach(impacts)
    if j >= 0 and -approach <= calm:
        _join(run, i, partner, t)
        return
    (j_t, j_n), spun = run.clashes.of(partner.solid, free=partner.free).resolve(
        mine, spin, partner.velocity, partner.omega
    )
    share = 0.5 if partner.free else 1.0
    m_n, m_t = share * run.mass, share * run.rolling_mass

    # What would bounce for less than two steps does not bounce.
    g = run.machine.gravity
    lifts = partner.curvature * mine[0] ** 2 - g * ny if partner.solid >= 0 else -g
    presses = lifts < -PARALLEL * g
    rebound = approach + j_n / m_n
    stays = partner.supported and presses and rebound <= -lifts * run.dt
    stays |= impacts > MOST
    if stays:
        j_n = max(j_n - m_n * rebound, 0.0)
        grip = run.clashes.grip(partner.solid) * j_n
        j_t = min(max(-m_t * slip, -grip), grip)
        spun = spin + run.turned(j_t)
    px, py = j_n * nx + j_t * ny, j_n * ny - j_t * nx

    surface = run.particles if partner.solid < 0 else int(run.solids.surface[partner.solid])
    lost = -j_n * (approach + 0.5 * j_n / m_n), -j_t * (slip + 0.5 * j_t / m_t)
    who = [(i, (x, y, vx, vy), spin, 1.0)]
    if partner.free:
        who.append((j, k.state(j, t), partner.omega, -1.0))
    for n, state, omega, _ in who:
        if k.mode[n] == RESTING:
            run.idle.disturb(n)
            k.close_one(n)
        k.mark(n, t, *state, omega)
        paid = j_t * belt if partner.solid >= 0 else 0.0
        run.book(n, surface, paid, share * lost[0], share * lost[1])
    if j >= 0 and not partner.free:
        # Whoever is carried is held by the belt: what it gives, the drive pays.
        run.book(i, 0, j_t * belt + j_n * partner.velocity[1], 0.0, 0.0)
    for n, (xn, yn, un, wn), omega, sign in who:
        un, wn = un + sign * px / run.mass, wn + sign * py / run.mass
        k.mark(n, t, xn, yn, un, wn, omega + spun - spin)
    hops = stays and partner.solid >= 0 and run.stays.hopped(i, surface, t)
    kind = None if hops else _kind(run, i, partner, -approach)
    if kind is not None:
        run.tell(kind, i, j, surface, (vx, vy), spin, (j_n, j_t))
    _part(run, i, partner, t, stays, kind, surface)


def _join(run: Run, i: int, partner: Partner, t: float) -> None:
    """Let particles that come together slowly stay in contact: the next step sees to them."""
    k = run.tracks
    for n, sign in ((i, 1.0), (partner.particle, -1.0)):
        if k.mode[n] == FLYING:
            k.mark(n, t, *k.state(n, t), float(k.omega[n]))
            _lean(run, n, partner, sign, t)


def _deeper(run: Run, partner: Partner) -> float:
    """Return how much deeper a particle has to lie for pymunk to see the contact, m."""
    return max(DEEP * run.radius + partner.gap, 0.0)


def _lean(run: Run, n: int, partner: Partner, sign: float, t: float) -> None:
    """Let a particle rest against another, from whose normal the sign leads to it."""
    nx, ny = partner.normal
    deep = sign * _deeper(run, partner)
    run.rest(n, sunk=(-deep * nx, -deep * ny))
    run.stays.arrive_one(n, -1, t)


def _lie_down(run: Run, i: int, partner: Partner, surface: int, t: float) -> None:
    """Let a particle rest on a solid, a hair inside, where it will be again at the next step.

    Half of what gravity takes from it up to then the solid gives it now, friction included.
    """
    k, (nx, ny), belt = run.tracks, partner.normal, partner.velocity[0]
    (x, y), (vx, vy), omega = k.x[i].tolist(), k.v[i].tolist(), float(k.omega[i])
    speed = vx * ny - vy * nx
    pressed = max(run.machine.gravity * ny - partner.curvature * speed**2, 0.0)
    span = run.next_tick(t) - t
    j_n = 0.5 * run.mass * pressed * span
    slip = speed + run.radius * omega - belt
    # The next step rubs for a whole dt, half of it for the time before: for span, not for dt.
    short = span - 0.5 * run.dt
    grip = run.clashes.grip(partner.solid) * run.mass * pressed * abs(short)
    stop = -run.rolling_mass * slip
    j_t = min(max(stop, -grip), grip)
    if short < 0.0:
        # That much too long: it is given back, unless the slip ends in that step anyhow.
        j_t = -j_t if abs(stop) > grip else 0.0
    run.book(
        i, surface, j_t * belt, -0.5 * j_n**2 / run.mass,
        -j_t * (slip + 0.5 * j_t / run.rolling_mass),
    )  # fmt: skip
    vx, vy = vx + (j_n * nx + j_t * ny) / run.mass, vy + (j_n * ny - j_t * nx) / run.mass
    k.mark(i, t, x, y, vx, vy, omega + run.turned(j_t))
    deep = _deeper(run, partner)
    run.rest(i, partner.normal, partner.solid, partner.curvature, (-deep * nx, -deep * ny))
    run.stays.arrive_one(i, surface, t)


def _part(
    run: Run, i: int, partner: Partner, t: float, stays: bool, kind: Kind | None, surface: int
) -> None:
    """Send everybody on their way after an impact."""
    k = run.tracks
    who = [i, partner.particle] if partner.free else [i]
    if kind is not None and not stays:
        for n in who:
            run.stays.tell_separation(n)
            run.stays.on[n] = -1
    if kind is Kind.LANDING:
        run.landed[i] = True
        if run.machine.until == "landed":
            run.finish(np.array([i]), "landed")
            return
    if stays and partner.solid >= 0:
        _lie_down(run, i, partner, surface, t)
        return
    crowded = max(run.crowd.impacts[n] for n in who) > MOST
    rested = [n for n in who if k.mode[n] == RESTING and not crowded]
    if stays and len(rested) < len(who):
        # Who came in leans on who is held; the latter is pushed against what holds it.
        for n in who:
            if n not in rested:
                _lean(run, n, partner, 1.0 if n == i else -1.0, t)
        who = rested
    for n in who:
        face = int(k.face[n]) if k.mode[n] == RESTING else -1
        if face < 0:
            run.take_off(n)
            continue
        normal = nx, ny = tuple(k.upon[n].tolist())
        off = float(k.v[n, 0]) * nx + float(k.v[n, 1]) * ny
        if abs(off) <= run.soft and 0.0 <= run.sinks(off, ny, t) <= SHALLOW * run.radius:
            run.rest(n)
            continue
        run.take_off(n)
        if off < 0.0:
            # Pushed against the face it lies on, it is held by it at once.
            strike(run, n, solid_partner(run, Touch(0.0, face, normal, gap=-DEEP * run.radius)), t)


def _kind(run: Run, i: int, partner: Partner, approach: float) -> Kind | None:
    """Name an impact; None if it only renews a contact that was lost for a moment."""
    real = approach > run.soft
    if partner.solid < 0:
        return Kind.COLLISION if real else None
    landing = run.solids.surface[partner.solid] == run.machine.landing and not run.landed[i]
    first = approach > FAINT * run.soft and not run.met[i, partner.solid]
    run.met[i, partner.solid] = True
    if landing:
        return Kind.LANDING
    return Kind.IMPACT if real or first else None
