"""Impacts at the instant they happen: off one path, by one contact, onto another."""

from __future__ import annotations

from dataclasses import dataclass
from math import hypot
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from chutelab.recording import Kind
from chutelab.stepper.tracks import CARRIED, RESTING

if TYPE_CHECKING:
    from chutelab.stepper.outline import Touch
    from chutelab.stepper.state import Run

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]
Vector = tuple[float, float]

FAINT = 0.01
"""Share of a step's worth of gravity below which even a first approach is no impact."""


@dataclass(frozen=True)
class Partner:
    """The other side of an impact.

    Attributes
    ----------
    particle, solid : int
        Which one it is; the other is -1.
    normal : ndarray, (2,)
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
    """

    particle: int
    solid: int
    normal: Floats
    velocity: Vector
    omega: float
    free: bool
    supported: bool
    curvature: float


def solid_partner(run: Run, touch: Touch) -> Partner:
    """Return a solid, touched."""
    n = np.array(touch.normal)
    belt = float(run.solids.belt(np.array([touch.solid]), n[None])[0])
    return Partner(-1, touch.solid, n, (belt, 0.0), 0.0, False, True, touch.curvature)


def particle_partner(run: Run, i: int, j: int, t: float) -> Partner:
    """Return particle j, met by particle i at t."""
    k = run.tracks
    x, v = k.flight(np.array([i, j]), t)
    n = (x[0] - x[1]) / hypot(*(x[0] - x[1]))
    velocity = float(v[1] @ [n[1], -n[0]]), float(v[1] @ n)
    carried = bool(k.mode[j] == CARRIED)
    supported = bool((k.mode[[i, j]] == RESTING).any())
    omega = 0.0 if carried else k.turn(j)
    return Partner(j, -1, n, velocity, omega, not carried, carried or supported, 0.0)


def strike(run: Run, i: int, partner: Partner, t: float) -> None:
    """Resolve the contact of particle i, not carried, with a partner at t."""
    k, n = run.tracks, partner.normal
    who = np.array([i, partner.particle] if partner.free else [i])
    along = np.array([n[1], -n[0]])
    x, v = k.flight(who, t)
    spin = k.turn(i)
    mine = float(v[0] @ along), float(v[0] @ n)
    approach = mine[1] - partner.velocity[1]
    slip = mine[0] - partner.velocity[0] + run.radius * (spin + partner.omega)
    (j_t, j_n), spun = run.clash(partner.particle, partner.solid).resolve(
        mine, spin, partner.velocity, partner.omega
    )
    share = 0.5 if partner.free else 1.0
    m_n, m_t = share * run.mass, share * run.rolling_mass

    # What would bounce for less than two steps does not bounce.
    lifts = -run.machine.gravity
    if partner.solid >= 0:
        lifts = float(run.gravity @ n) + partner.curvature * mine[0] ** 2
    rebound = approach + j_n / m_n
    stays = partner.supported and lifts <= 0.0 and rebound <= -lifts * run.dt
    stays |= run.crowded(who, t)
    if stays:
        # On a solid it leaves half of what gravity takes from it up to the next step.
        hop = -0.5 * min(lifts, 0.0) * (run.next_tick(t) - t) if partner.solid >= 0 else 0.0
        j_n = max(j_n - m_n * (rebound - hop), 0.0)
        grip = run.grip(partner.particle, partner.solid) * j_n
        j_t = min(max(j_t, -grip), grip)
        spun = spin + run.turned(j_t)
    push = j_n * n + j_t * along

    surface = run.particles if partner.solid < 0 else int(run.solids.surface[partner.solid])
    spins = np.array([spin, partner.omega])[: len(who)]
    k.close(who[k.mode[who] == RESTING])
    k.knot(who, t, x, v, spins)
    if partner.solid < 0 and not partner.free:
        # Whoever is carried is held by the belt: what it gives, the drive pays.
        run.recorder.book(run.ids[who], 0, j_t * partner.velocity[0] + j_n * partner.velocity[1])
    run.recorder.book(
        run.ids[who],
        surface,
        j_t * partner.velocity[0] if partner.solid >= 0 else 0.0,
        -share * j_n * (approach + 0.5 * j_n / m_n),
        -share * j_t * (slip + 0.5 * j_t / m_t),
    )
    after = v + np.array([push, -push])[: len(who)] / run.mass
    k.knot(who, t, x, after, spins + (spun - spin))
    _after(run, i, partner, t, stays, (approach, spin, v[0], (j_n, j_t)), surface, who)


def _after(
    run: Run,
    i: int,
    partner: Partner,
    t: float,
    stays: bool,
    before: tuple[float, float, Floats, Vector],
    surface: int,
    who: Ints,
) -> None:
    """Tell of an impact, and send everybody on their way."""
    k, one = run.tracks, who[:1]
    approach, spin, velocity, impulse = before
    hops = stays and partner.solid >= 0 and run.hopped(i, surface, t)
    kind = None if hops else _kind(run, i, partner, -approach)
    if kind is not None:
        run.event(
            kind, one, t, k.x[one], k.v[one], k.omega[one], surface,
            run.ids[partner.particle] if partner.solid < 0 else -1,
            velocity_before=velocity, omega_before=spin, impulse=impulse,
        )  # fmt: skip
        run.recorder.contacts += 1
        if not stays:
            run.tell_separation(who)
            run.on[who] = -1
    if kind is Kind.LANDING:
        run.landed[i] = True
        if run.machine.until == "landed":
            run.finish(one, "landed")
            return
    rested = k.mode[who] == RESTING
    if stays and partner.solid >= 0:
        run.lay(i, partner.normal, partner.curvature)
        run.arrive(one, np.array([surface]), t)
        return
    if stays and not rested.all():
        # Who came in leans on who is held; the latter is pushed against what holds it.
        leans = who[~rested]
        for n in leans.tolist():
            run.lay(n, partner.normal if n == i else -partner.normal, None)
        run.arrive(leans, np.full(len(leans), -1), t)
        who = who[rested]
    run.take_off(who, t)


def _kind(run: Run, i: int, partner: Partner, approach: float) -> Kind | None:
    """Name an impact; None if it only renews a contact that was lost for a moment."""
    hop = run.machine.gravity * run.dt
    real = approach > hop
    if partner.solid < 0:
        return Kind.COLLISION if real else None
    landing = run.solids.surface[partner.solid] == run.machine.landing and not run.landed[i]
    first = approach > FAINT * hop and not run.met[i, partner.solid]
    run.met[i, partner.solid] = True
    if landing:
        return Kind.LANDING
    return Kind.IMPACT if real or first else None
