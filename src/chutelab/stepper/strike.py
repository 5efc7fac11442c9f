"""Impacts of lone particles: out of flight, against one partner, back into flight or to rest."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from chutelab.recording import Kind
from chutelab.stepper.blow import Capsule, Touch, Vector, shifted_impulse, touch
from chutelab.stepper.solids import SLOP
from chutelab.stepper.tracks import CARRIED, FLYING

if TYPE_CHECKING:
    from chutelab.stepper.state import Run
    from chutelab.stepper.world import Contacts

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]

FAINT = 0.01
"""Share of a step's worth of gravity below which even a first approach is no impact."""


@dataclass
class _Partner:
    """The other side of an impact: a solid at rest in the frame (0, 0), or a particle."""

    capsule: Capsule
    x: Floats
    v: Floats
    omega: float
    spin_radius: float
    belt: float
    friction: float
    restitution: float
    flies: bool
    still: bool


def lone(run: Run, contacts: Contacts) -> NDArray[np.bool_]:
    """Tell which contacts are the only ones of particles in flight, (M,)."""
    partner = contacts.other < run.count
    other = np.where(partner, contacts.other, contacts.first)
    uses = np.bincount(contacts.first, minlength=run.count)
    uses += np.bincount(contacts.other[partner], minlength=run.count)
    free = (uses == 1) & (run.tracks.mode == FLYING)
    carried = run.tracks.mode == CARRIED
    return np.asarray(free[contacts.first] & (~partner | free[other] | carried[other]))


def strike(run: Run, contacts: Contacts, row: int, t: float, states: Floats) -> None:
    """Resolve one lone contact of the step that ended at t.

    `states` holds pymunk's positions and velocities after the step, (N, 4); of carried partners
    they are the true ones.
    """
    k, i, j = run.tracks, int(contacts.first[row]), int(contacts.other[row])
    partner = _partner(run, j, t, contacts.normal[row], states)
    pair = np.array([i, j] if partner.flies else [i])
    found = _found(run, partner, pair, contacts.normal[row], t)
    undo = _undo(run, partner, pair, contacts.normal[row], t)
    at, normal = t - found.back, np.array(found.normal)
    along = np.array([normal[1], -normal[0]])
    x, v = k.flight(pair, at)
    relative = v[0] - (v[1] if partner.flies else partner.v)
    if j >= run.count:
        partner.belt = float(run.solids.belt(np.array([j - run.count]), normal[None])[0])
    turning = float(k.omega[i]) * run.radius + partner.omega * partner.spin_radius
    approach, slip = float(relative @ normal), float(relative @ along) + turning - partner.belt
    j_n, j_t = _impulse(run, contacts, row, partner, pair, t, (approach, slip, turning))

    share = 0.5 if partner.flies else 1.0
    m_n, m_t = share * run.mass, share * run.rolling_mass
    lifts = float(run.gravity @ normal) + found.curvature * float(relative @ along) ** 2
    rebound = approach + j_n / m_n
    stays = partner.still and lifts <= 0.0 and rebound <= -lifts * run.dt
    if stays:
        # What would bounce for less than two steps does not bounce.
        j_n = max(j_n - m_n * rebound, 0.0)
        j_t = min(max(j_t, -partner.friction * j_n), partner.friction * j_n)
    elif j_n == 0.0:
        # They part already: half a step ago, where pymunk looks from, they did not.
        run.fly_on(pair, t, undo)
        return
    push = j_n * normal + j_t * along

    surface = run.particles if j < run.count else int(run.solids.surface[j - run.count])
    k.knot(pair, at, x, v, k.omega[pair])
    if not partner.still and not partner.flies:
        # Whoever is carried is held by the belt: what it gives, the drive pays.
        run.recorder.book(run.ids[pair], 0, float(push @ partner.v))
    run.recorder.book(
        run.ids[pair],
        surface,
        j_t * partner.belt,
        -share * j_n * (approach + 0.5 * j_n / m_n),
        -share * j_t * (slip + 0.5 * j_t / m_t),
    )
    inertia = run.machine.particle.inertia
    spin = k.omega[pair]
    spun = spin + (run.radius * j_t / inertia if inertia > 0.0 else 0.0)
    k.knot(pair, at, x, v + np.array([push, -push])[: len(pair)] / run.mass, spun)

    kind = None if stays and run.hopped(i, surface, at) else _kind(run, i, j, -approach)
    if kind is not None:
        run.event(
            kind, pair[:1], at, x[:1], k.v[pair[:1]], spun[:1], surface,
            run.ids[j] if j < run.count else -1,
            velocity_before=v[:1], omega_before=spin[:1], impulse=(j_n, j_t),
        )  # fmt: skip
        run.recorder.contacts += 1
    if kind is Kind.LANDING:
        run.landed[i] = True
        if run.machine.until == "landed":
            run.finish(pair, "landed")
            return
    if stays:
        normal = _stay(run, i, partner, found, t, undo[0])
        if found.curvature > 0.0:
            run.follow(i, normal, 1.0 / found.curvature)
        run.arrive(pair, np.array([surface]), at)
        return
    k.fly(pair)
    run.fly_on(pair, t, undo)
    if kind is not None:
        run.tell_separation(pair)
        run.on[pair] = -1


def _found(run: Run, partner: _Partner, pair: Ints, normal: Floats, t: float) -> Touch:
    """Follow the flight back to the touch; if that fails, take the end of the step as it is."""
    x, v = (a[0] for a in run.tracks.flight(pair[:1], t))
    gravity = 0.0 if partner.flies else run.machine.gravity
    # Pymunk looks once a step; a body may have been put in within the step before.
    longest = min(t - float(run.tracks.t[pair].max()), 2.0 * run.dt)
    offset: Vector = tuple((x - partner.x).tolist())
    found = touch(offset, tuple((v - partner.v).tolist()), gravity, partner.capsule, longest)
    if found is None:
        rounded = partner.capsule.nearest(*offset)[2]
        curvature = 1.0 / partner.capsule.reach if rounded else 0.0
        found = Touch(0.0, (float(normal[0]), float(normal[1])), curvature)
    return found


def _partner(run: Run, j: int, t: float, normal: Floats, states: Floats) -> _Partner:
    """Describe the other side of a contact."""
    m = run.machine
    if j < run.count:
        disk = Capsule((0.0, 0.0), (0.0, 0.0), 2.0 * run.radius)
        flies = bool(run.tracks.mode[j] == FLYING)
        if flies:
            x, v = (a[0] for a in run.tracks.flight(np.array([j]), t))
        else:
            x, v = states[j, :2], states[j, 2:]
        omega = float(run.tracks.omega[j]) if flies else 0.0
        return _Partner(
            disk, x, v, omega, run.radius, 0.0, m.pair_friction, m.pair_restitution, flies, False
        )
    s, solid = run.solids, j - run.count
    a, b, out = s.face(solid, normal)
    return _Partner(
        Capsule(a, b, float(s.reach[solid]) + run.radius, out),
        np.zeros(2), np.zeros(2), 0.0, 0.0,
        float(s.belt(np.array([solid]), normal[None])[0]),
        float(s.friction[solid]), float(s.restitution[solid]), False, True,
    )  # fmt: skip


def _impulse(
    run: Run,
    contacts: Contacts,
    row: int,
    partner: _Partner,
    pair: Ints,
    t: float,
    speeds: tuple[float, float, float],
) -> tuple[float, float]:
    """Pymunk's impulse, shifted from the velocities of the step to those at the touch.

    `speeds` are there: the normal speed, the slip, and what rotation has in it.
    """
    approach, slip, turning = speeds
    n = contacts.normal[row]
    along = np.array([n[1], -n[0]])
    velocity = run.tracks.flight(pair[:1], t)[1][0] - partner.v
    # The solver bounces off the velocity half a step ago, and stops that half a step ahead.
    half = 0.0 if partner.flies else 0.5 * run.dt * run.gravity
    e = partner.restitution
    early, late = velocity - half, velocity + half
    change_n = approach - float((e * early + late) @ n) / (1.0 + e)
    change_t = slip - (float(late @ along) + turning - partner.belt)
    share = 0.5 if partner.flies else 1.0
    found = float(contacts.impulse[row] @ n), float(contacts.impulse[row] @ along)
    return shifted_impulse(
        found, change_n, change_t, slip,
        (share * run.mass, share * run.rolling_mass), e, partner.friction,
    )  # fmt: skip


def _kind(run: Run, i: int, j: int, approach: float) -> Kind | None:
    """Name an impact; None if it only renews a contact that pymunk lost for a moment."""
    hop = run.machine.gravity * run.dt
    real = approach > hop
    if j < run.count:
        return Kind.COLLISION if real else None
    solid = j - run.count
    landing = run.solids.surface[solid] == run.machine.landing and not run.landed[i]
    first = approach > FAINT * hop and not run.met[i, solid]
    run.met[i, solid] = True
    if landing:
        return Kind.LANDING
    return Kind.IMPACT if real or first else None


def _undo(run: Run, partner: _Partner, pair: Ints, normal: Floats, t: float) -> Floats:
    """Displacements (k, 2) that cancel how pymunk will part the bodies in its next step.

    It still means the overlap it saw; seen at the touch there is none.
    """
    x = run.tracks.flight(pair[:1], t)[0][0] - partner.x
    gap, _, _ = partner.capsule.nearest(float(x[0]), float(x[1]))
    apart = run.world.parting(-gap, run.dt) * normal
    return np.array([-0.5 * apart, 0.5 * apart]) if partner.flies else -apart[None]


def _stay(run: Run, i: int, partner: _Partner, found: Touch, t: float, undo: Floats) -> Floats:
    """Let a particle glide along the surface it fell on, a hair inside, so that pymunk sees it.

    Return the normal where it is at t.
    """
    k, who, first = run.tracks, np.array([i]), np.array(found.normal)
    pull = run.gravity - float(run.gravity @ first) * first
    x = k.x[i] + found.back * (k.v[i] + 0.5 * found.back * pull)
    w = k.v[i] + (found.back + 0.5 * run.dt) * pull
    gap, normal, _ = partner.capsule.nearest(float(x[0]), float(x[1]))
    n = np.array(normal)
    x = x - (gap + 0.5 * SLOP * run.radius) * n
    # Round a curve the velocity turns with it.
    along = np.array([n[1], -n[0]])
    w = float(w @ np.array([first[1], -first[0]])) * along
    run.world.place(i, tuple((x + undo).tolist()), tuple(w.tolist()), float(k.omega[i]))
    k.rest(who)
    k.leave(who, x, w, k.omega[who])
    k.upon[i] = n
    return n
