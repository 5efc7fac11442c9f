"""What a contact does: a blow, coming to rest on a surface, gripping or slipping there."""

from __future__ import annotations

from dataclasses import fields
from typing import TYPE_CHECKING

import numpy as np

from chutelab.exact.arcs import bounds
from chutelab.exact.corner import hold
from chutelab.exact.obstacles import NONE, Floats, Ints, dot, pick
from chutelab.exact.swarm import COLLAPSE, Contact, Mode, Swarm, below
from chutelab.impact import impulses, limited
from chutelab.recording import Kind

if TYPE_CHECKING:
    from numpy.typing import NDArray

NEGLIGIBLE = 1e-12
"""m/s; an approach this slow is a touch, not a blow."""

REST = 1e-9
"""m/s; a rebound this slow is summed with all that would follow it: u_n (1 + ε)/(1 - ε) of normal
impulse in the time 2 u_n/(g_n (1 - ε)). At ε = 0.999 some 20,000 bounces come before.
At ε = 1 such a rebound, 1e-19 m high, is taken for rest."""


CRAWL = 1000.0 * REST
"""m/s; a particle this slow that goes to and fro between two obstacles is coming to rest there."""

OPPOSED = 1e-9
"""Sine of the angle at which two surfaces must meet to hold a particle between them."""


def strike(s: Swarm, who: Ints, obstacle: Ints, side: Ints) -> None:
    """Resolve the contacts of particles that have just reached an obstacle."""
    s.event(Kind.SEPARATION, who[s.mode[who] == Mode.CARRIED], 0)
    s.p[who] = s.obstacles.snapped(who, obstacle, side, s.p[who], s.radius)
    c = s.contact(who, obstacle, side)
    approach = np.maximum(-dot(s.v[who], c.normal), 0.0)
    rebound = np.where(approach > NEGLIGIBLE, c.restitution, 0.0) * approach
    landing = (c.surface == s.machine.landing) & ~s.landed[who]
    _blow(s, who, c, approach, rebound, landing)
    s.landed[who] |= landing
    if s.machine.until == "landed":
        s.finish(who[landing], "landed")

    jammed = _stop_jammed(s, who, obstacle, side)
    held = s.mode[who] >= Mode.FACE
    if held.any():
        held[held] = _still_on(s, who[held])
    rests = (_load(s, who, obstacle, c) > 0.0) & (rebound <= REST)
    live = (s.mode[who] != Mode.DONE) & ~jammed
    slides, falls, flies = held & live, rests & ~held & live, ~rests & ~held & live
    _slide_past(s, who[slides], obstacle[slides], side[slides], rebound[slides])
    rest_on(s, who[falls], obstacle[falls], side[falls], rebound[falls])
    leaves = flies & (s.on[who] != NONE)
    s.event(Kind.SEPARATION, who[leaves], s.obstacles.surface[s.on[who[leaves]]])
    s.fly(who[flies], obstacle[flies], side[flies], np.where(rebound[flies] > 0.0, 1, 2))


def _stop_jammed(s: Swarm, who: Ints, obstacle: Ints, side: Ints) -> NDArray[np.bool_]:
    """Bring to rest, and tell, who goes to and fro between two obstacles without getting on."""
    free = s.on[who] == NONE
    before = np.where(free, s.left[who], s.on[who])
    before_side = np.where(free, s.left_side[who], s.side[who])
    between = (before != NONE) & (before != obstacle) & (s.mode[who] != Mode.DONE)
    slow = np.hypot(s.v[who, 0], s.v[who, 1]) <= CRAWL
    s.crawls[who] = np.where(slow, s.crawls[who] + between, 0)
    jammed = between & ((s.idle[who] > COLLAPSE) | (s.crawls[who] > COLLAPSE))
    if not jammed.any():
        return np.asarray(jammed)
    # Faces that lie on each other make no corner.
    one = s.contact(who[jammed], before[jammed], before_side[jammed]).normal
    two = s.contact(who[jammed], obstacle[jammed], side[jammed]).normal
    jammed[jammed] = np.abs(one[:, 0] * two[:, 1] - one[:, 1] * two[:, 0]) > OPPOSED
    hold(s, who[jammed], (before[jammed], before_side[jammed]), (obstacle[jammed], side[jammed]))
    return np.asarray(jammed)


def _blow(
    s: Swarm, who: Ints, c: Contact, approach: Floats, rebound: Floats, landing: NDArray[np.bool_]
) -> None:
    """Change the velocities, book the energies, write events and knots."""
    real = approach > NEGLIGIBLE
    slip = s.slip_of(who, c)
    normal, tangential = impulses(
        approach, slip, np.where(real, c.restitution, 0.0), c.friction, s.share
    )
    before, omega_before = s.v[who], s.omega(who)
    # The normal speed is set, not added to: ε |v_n| to the last bit.
    along = dot(before, c.tangent) + tangential
    s.v[who] = rebound[:, None] * c.normal + along[:, None] * c.tangent
    if s.spins:
        s.z[who] += 2.0 * tangential
    after = slip + tangential / s.share
    s.recorder.book(
        who,
        c.surface,
        s.mass * tangential * c.belt,
        0.5 * s.mass * (approach - rebound) * (approach + rebound),
        -0.5 * s.mass * tangential * (slip + after),
    )
    told = real | landing | (tangential != 0.0)
    s.event(
        np.where(landing, Kind.LANDING, Kind.IMPACT)[told],
        who[told],
        c.surface[told],
        velocity_before=before[told],
        omega_before=omega_before[told],
        normal_impulse=s.mass * normal[told],
        tangential_impulse=s.mass * tangential[told],
    )
    s.recorder.contacts += int(np.count_nonzero(told))
    s.knots(who)


def _still_on(s: Swarm, who: Ints) -> NDArray[np.bool_]:
    """Tell which sliding or riding particles a blow from elsewhere leaves where they are."""
    c = s.contact(who, s.on[who], s.side[who])
    leaving = np.abs(dot(s.v[who], c.normal)) > NEGLIGIBLE
    return ~leaving & (_load(s, who, s.on[who], c) > 0.0)


def _load(s: Swarm, who: Ints, obstacle: Ints, c: Contact) -> Floats:
    """Return the normal force per mass that would keep a particle on an obstacle, m/s²."""
    load = s.weight_on(c.normal)
    circle = obstacle - s.obstacles.segments
    curved = circle >= 0
    rho = pick(s.obstacles.rho, who[curved], circle[curved])
    load[curved] -= dot(s.v[who[curved]], c.tangent[curved]) ** 2 / rho
    return load


def _slide_past(s: Swarm, who: Ints, obstacle: Ints, side: Ints, rebound: Floats) -> None:
    """Go on sliding after a blow from another obstacle, or stay in the corner of the two."""
    if not len(who):
        return
    s.left[who], s.left_side[who] = obstacle, side
    s.order[who] = np.where(rebound > 0.0, 1, 2)
    settle_law(s, who)
    who, kept = who[s.mode[who] == Mode.FACE], s.mode[who] == Mode.FACE
    other, other_side = obstacle[kept], side[kept]
    pull, _ = face_pull(s, who)
    against = s.contact(who, other, other_side)
    pressed = dot(pull, against.normal) < -OPPOSED * np.sqrt(dot(pull, pull))
    stuck = (rebound[kept] <= REST) & pressed
    on = (s.on[who[stuck]], s.side[who[stuck]])
    hold(s, who[stuck], on, (other[stuck], other_side[stuck]))


def rest_on(s: Swarm, who: Ints, obstacle: Ints, side: Ints, rebound: Floats) -> None:
    """Begin sliding, gripping or riding on an obstacle."""
    if not len(who):
        return
    _last_bounces(s, who, obstacle, side, rebound)
    flat = obstacle < s.obstacles.segments
    s.mode[who] = np.where(flat, Mode.FACE, Mode.ARC)
    s.on[who], s.side[who] = obstacle, side
    s.left[who], s.left_side[who], s.order[who] = NONE, 0, 0
    _ride(s, who[~flat])
    settle_law(s, who)


def _last_bounces(s: Swarm, who: Ints, obstacle: Ints, side: Ints, rebound: Floats) -> None:
    """Sum the bounces after a rebound slower than `REST`, geometric in time and impulse."""
    hops = (rebound > 0.0) & (obstacle < s.obstacles.segments)
    who, u = who[hops], rebound[hops]
    if not len(who):
        return
    c = s.contact(who, obstacle[hops], side[hops])
    weight, pull = s.weight_on(c.normal), s.weight_along(c.normal)
    # Without loss the series never ends; its motion is below what is resolved, so it is dropped.
    lost = np.where(c.restitution < 1.0, 1.0 - c.restitution, np.inf)
    time = np.minimum(2.0 * u / (weight * lost), s.stop[who] - s.age[who])
    w = dot(s.v[who], c.tangent)
    s.age[who] += time
    s.p[who] += (time * (w + 0.5 * pull * time))[:, None] * c.tangent
    s.v[who] = (w + pull * time)[:, None] * c.tangent
    slip = s.slip_of(who, c)
    tangential = limited(slip, np.maximum(weight * time - u, 0.0), c.friction, s.share)
    s.v[who] += tangential[:, None] * c.tangent
    if s.spins:
        s.z[who] += 2.0 * tangential
    s.recorder.book(
        who,
        c.surface,
        s.mass * tangential * c.belt,
        0.5 * s.mass * u * u,
        -0.5 * s.mass * tangential * (2.0 * slip + tangential / s.share),
    )
    s.knots(who)


def _ride(s: Swarm, who: Ints) -> None:
    """Begin a ride round a circle: find its ends, fix the speed of the surface."""
    if not len(who):
        return
    c = s.contact(who, s.on[who], s.side[who])
    s.belt[who] = c.belt
    circle = s.on[who] - s.obstacles.segments
    phi = np.arctan2(c.normal[:, 0], c.normal[:, 1])
    rho = pick(s.obstacles.rho, who, circle)
    found = bounds(s.obstacles, who, circle, rho, phi, s.radius)
    for field in fields(found):
        getattr(s.bounds, field.name)[who] = getattr(found, field.name)


def settle_law(s: Swarm, who: Ints) -> None:
    """Choose between gripping and slipping, and end tracks that have settled.

    Without slip, friction must hold against gravity: m*/m |g_t| <= µ N. Where it cannot, slip
    starts the way gravity pulls.
    """
    if not len(who):
        return
    c = s.contact(who, s.on[who], s.side[who])
    arc = s.mode[who] == Mode.ARC
    belt = np.where(arc, s.belt[who], c.belt)
    c = Contact(c.normal, c.tangent, belt, c.friction, c.restitution, c.surface)
    slip = s.slip_of(who, c)
    w = dot(s.v[who], c.tangent)
    still = slip == 0.0
    if s.spins:
        s.z[who] = np.where(still, belt - w, s.z[who])
    else:
        w = np.where(still, belt, w)
    s.v[who] = w[:, None] * c.tangent
    pull, load = s.weight_along(c.normal), _load(s, who, s.on[who], c)
    grips = still & below(s.share * np.abs(pull), c.friction, load)
    begins = grips & (s.slip[who] != 0.0)
    s.slip[who] = np.where(grips, 0.0, np.where(still, np.sign(pull), np.sign(slip)))
    s.event(Kind.STICK, who[begins], c.surface[begins])
    if s.machine.until == "settled":
        # Rolling down a slope is not lying on it.
        steady = grips & ((pull == 0.0) | ~np.full(len(who), s.spins)) & ~(arc & (w != 0.0))
        lies = steady & ((belt == 0.0) | (c.surface == s.machine.landing))
        s.event(Kind.SETTLE, who[lies], c.surface[lies])
        s.finish(who[lies], "settled")


def end_slip(s: Swarm, who: Ints) -> None:
    """Make a slip that is used up exactly zero, then see whether friction holds."""
    if not len(who):
        return
    c = s.contact(who, s.on[who], s.side[who])
    belt = np.where(s.mode[who] == Mode.ARC, s.belt[who], c.belt)
    if s.spins:
        s.z[who] = belt - dot(s.v[who], c.tangent)
    else:
        s.v[who] = belt[:, None] * c.tangent
    settle_law(s, who)


def face_pull(s: Swarm, who: Ints) -> tuple[Floats, Floats]:
    """Return acceleration (k, 2) and friction force per mass along the tangent (k,) on a face."""
    c = s.contact(who, s.on[who], s.side[who])
    pull, load = s.weight_along(c.normal), s.weight_on(c.normal)
    gripping = s.slip[who] == 0.0
    finite = np.where(np.isinf(c.friction) | gripping, 0.0, c.friction)
    force = np.where(gripping, -s.share * pull, -s.slip[who] * finite * load)
    return (pull + force)[:, None] * c.tangent, force
