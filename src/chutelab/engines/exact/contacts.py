"""What a contact does: a blow, coming to rest, gripping or slipping, rest in a corner."""

from __future__ import annotations

from dataclasses import fields

import numpy as np

from chutelab.engines.exact.detect import bounds
from chutelab.engines.exact.obstacles import NONE, bare, dot, length_of, pick
from chutelab.engines.exact.particle_state import COLLAPSE, Contact, Mode, Swarm, below
from chutelab.mechanics.impact import impulses, limited
from chutelab.results import Kind
from chutelab.util.arrays import Bools, Floats, Ints

WEIGHTLESS = 1e-9
"""Share of the weight that a surface may seem to pull with, by rounding, where it holds nothing."""


class CornerError(RuntimeError):
    """A spinning disk held between moving surfaces: beyond the exact engine."""


def hold(s: Swarm, who: Ints, on: tuple[Ints, Floats], other: tuple[Ints, Floats]) -> Bools:
    """Bring particles to rest in the corner of two obstacles, each given with its side.

    A moving surface under them goes on doing work, all of it heat. Where a surface is at rest its
    friction is taken as zero: it dissipates nothing, and the balance of the two normal forces needs
    none. Where friction pulls the particle in harder than any load can hold it (self-locking, as
    with adhesion) a real drive would stall: the particle stays, and nothing more is booked. Where
    gravity pulls out of the corner it falls, from rest.

    Returns
    -------
    ndarray of bool, (k,)
        Which of them gravity pulls away from the one, and onto the other: they are to rest there.
    """
    if not len(who):
        return np.zeros(0, dtype=bool)
    a, b = s.contact(who, *on), s.contact(who, *other)
    moving = (a.belt != 0.0) | (b.belt != 0.0)
    if s.spins and moving.any():
        raise CornerError(
            "a spinning disk is held between two surfaces of which one moves; the exact engine"
            ' cannot follow that: run it with engine = "contact"'
        )
    v, mass = s.v.take(who, axis=1), s.mass[who]
    kinetic = 0.5 * mass * (dot(v, v) + 0.5 * s.z[who] ** 2)
    s.v[:, who], s.z[who] = 0.0, 0.0
    s.book(who, b.surface, 0.0, kinetic, 0.0)
    s.knots(who)
    loads, locked = _corner_loads(s.gravity[who], a, b)
    stays = locked | np.all(loads >= -WEIGHTLESS * s.gravity[who], axis=0)
    onto = ~stays & (loads[0] < 0.0) & (s.weight_on(who, b.normal) > 0.0)
    falls = ~stays & ~onto
    s.fly(who[falls], other[0][falls], other[1][falls], 2)
    rest = stays & ~moving & (s.machine.until == "settled")
    s.event(int(Kind.SETTLE), who[rest], a.surface[rest])
    s.finish(who[rest], "settled")
    waits = stays & ~rest
    time = s.stop[who] - s.age[who]
    for c, load in zip((a, b), loads, strict=True):
        heat = np.where(
            waits & ~locked, mass * _grip(c) * np.abs(c.belt) * np.maximum(load, 0.0) * time, 0.0
        )
        s.book(who, c.surface, heat, 0.0, heat)
    s.age[who[waits]] = s.stop[who[waits]]
    s.knots(who[waits])
    s.finish(who[waits], "time")
    return np.asarray(onto)


def _grip(c: Contact) -> Floats:
    """Return the friction coefficient of a surface that slides under a resting particle, else 0."""
    return np.where((c.belt == 0.0) | np.isinf(c.friction), 0.0, c.friction)


def _corner_loads(gravity: Floats, a: Contact, b: Contact) -> tuple[Floats, Bools]:
    """Return the two normal forces per mass that hold a particle, (2, k), and where it locks."""
    first, second = (c.normal + (np.sign(c.belt) * _grip(c)) * c.tangent for c in (a, b))
    determinant = first[0] * second[1] - first[1] * second[0]
    loads = gravity * np.stack([-second[0], first[0]]) / determinant
    loads = np.where(np.isfinite(loads), loads, -1.0)
    inwards = np.zeros(len(determinant), dtype=bool)
    for c, against in ((a, b), (b, a)):
        drawn = np.sign(c.belt) * dot(c.tangent, against.normal) < 0.0
        inwards |= drawn & (
            np.isinf(c.friction) | (loads < -WEIGHTLESS * gravity).any(axis=0) & (c.friction > 0.0)
        )
    return loads, inwards


def load_on(s: Swarm, who: Ints, obstacle: Ints, c: Contact) -> Floats:
    """Return the normal force per mass that would keep a particle on an obstacle, m/s²."""
    load = s.weight_on(who, c.normal)
    curved = (obstacle >= s.obstacles.segments).nonzero()[0]
    if len(curved):
        rho = pick(s.obstacles.rho, who[curved], obstacle[curved] - s.obstacles.segments)
        load[curved] -= dot(s.v[:, who[curved]], c.tangent[:, curved]) ** 2 / rho
    return load


def settle_law(s: Swarm, who: Ints) -> None:
    """Choose between gripping and slipping, and end tracks that have settled.

    Without slip, friction must hold against gravity: m*/m |g_t| <= µ N. Where it cannot, slip
    starts the way gravity pulls.
    """
    if not len(who):
        return
    c = s.contact(who, s.on[who], s.side[who])
    arc = s.mode[who] == Mode.ARC
    w = dot(s.v.take(who, axis=1), c.tangent)
    slip = s.slip_of(who, c, w)
    still = slip == 0.0
    if s.spins:
        s.z[who] = np.where(still, c.belt - w, s.z[who])
    else:
        w = np.where(still, c.belt, w)
    s.v[:, who] = w * c.tangent
    pull, load = s.weight_along(who, c.normal), load_on(s, who, s.on[who], c)
    grips = still & below(s.share * np.abs(pull), c.friction, load)
    begins = grips & (s.slip[who] != 0.0)
    s.slip[who] = np.where(grips, 0.0, np.where(still, np.sign(pull), np.sign(slip)))
    s.event(int(Kind.STICK), who[begins], c.surface[begins])
    if s.machine.until == "settled":
        # Rolling down a slope is not lying on it.
        steady = grips & ((pull == 0.0) | (not s.spins)) & ~(arc & (w != 0.0))
        lies = steady & ((c.belt == 0.0) | (c.surface == s.machine.landing))
        s.event(int(Kind.SETTLE), who[lies], c.surface[lies])
        s.finish(who[lies], "settled")


def end_slip(s: Swarm, who: Ints) -> None:
    """Make a slip that is used up exactly zero, then see whether friction holds."""
    if not len(who):
        return
    c = s.contact(who, s.on[who], s.side[who])
    if s.spins:
        s.z[who] = c.belt - dot(s.v.take(who, axis=1), c.tangent)
    else:
        s.v[:, who] = c.belt * c.tangent
    settle_law(s, who)


def face_force(s: Swarm, who: Ints, c: Contact) -> tuple[Floats, Floats]:
    """Return acceleration (2, k) and friction force per mass along the tangent (k,) on a face."""
    pull, load = s.weight_along(who, c.normal), s.weight_on(who, c.normal)
    slip = s.slip[who]
    gripping = slip == 0.0
    finite = np.where(np.isinf(c.friction) | gripping, 0.0, c.friction)
    force = np.where(gripping, -s.share * pull, -slip * finite * load)
    return (pull + force) * c.tangent, force


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


def strike(s: Swarm, who: Ints, obstacle: Ints, side: Floats) -> None:
    """Resolve the contacts of particles that have just reached an obstacle."""
    carried = s.mode[who] == Mode.CARRIED
    if np.count_nonzero(carried):
        s.part(who[carried], 0)
    place, normal = s.obstacles.snapped(who, obstacle, side, s.p, s.radius[who])
    s.p[:, s.at(who)] = place
    c = s.contact(who, obstacle, side, normal)
    before = s.v.take(who, axis=1)
    approach = np.maximum(-dot(before, c.normal), 0.0)
    soft = approach <= NEGLIGIBLE
    if np.count_nonzero(soft):
        c = c._replace(restitution=np.where(soft, 0.0, c.restitution))
    rebound = c.restitution * approach
    landing = (c.surface == s.machine.landing) & ~s.landed[who]
    lands = np.count_nonzero(landing) > 0
    _blow(s, who, c, before, approach, rebound, landing if lands else None)
    if lands:
        s.landed[who] |= landing
        if s.machine.until == "landed":
            s.finish(who[landing], "landed")
            if np.count_nonzero(landing) == len(who):
                return
    _after(s, who, obstacle, side, c, rebound)


def _after(s: Swarm, who: Ints, obstacle: Ints, side: Floats, c: Contact, rebound: Floats) -> None:
    """Decide whether particles fly on, slide on or come to rest after a blow."""
    if s.past is not None:
        before, before_side = _touched_before(s, who)
        other = before != obstacle
        s.past.obstacle[who[other]], s.past.side[who[other]] = before[other], before_side[other]
    jammed = _stop_jammed(s, who, obstacle, side, rebound)
    mode = s.mode[who]
    live = mode != Mode.DONE
    if jammed is not None:
        live &= ~jammed
    held = mode >= Mode.FACE
    on_surface = np.count_nonzero(held) > 0
    if on_surface:
        held[held] = _still_on(s, who[held])
        slides = held & live
        _slide_past(s, who[slides], obstacle[slides], side[slides], rebound[slides])
        live &= ~held
    rests = live & (rebound <= REST)
    if np.count_nonzero(rests):
        rests &= load_on(s, who, obstacle, c) > 0.0
        rest_on(s, who[rests], obstacle[rests], side[rests], rebound[rests])
        live &= ~rests
    if np.count_nonzero(live) < len(live):
        who, obstacle, side, rebound = who[live], obstacle[live], side[live], rebound[live]
    if on_surface:
        on = s.on[who]
        leaves = on != NONE
        s.part(who[leaves], s.obstacles.surface[on[leaves]])
    s.fly(who, obstacle, side, 2 - (rebound > 0.0))


def _stop_jammed(
    s: Swarm, who: Ints, obstacle: Ints, side: Floats, rebound: Floats
) -> Bools | None:
    """Bring to rest, and tell, who goes to and fro between two obstacles without getting on."""
    if not (s.idling or s.crawling or np.count_nonzero(rebound <= 2.0 * CRAWL)):
        return None
    slow = length_of(s.v.take(who, axis=1)) <= CRAWL
    if not (s.idling or s.crawling or np.count_nonzero(slow)):
        return None
    before, before_side = _touched_before(s, who)
    between = (before != NONE) & (before != obstacle) & (s.mode[who] != Mode.DONE)
    s.crawls[who] = np.where(slow, s.crawls[who] + between, 0)
    s.crawling = bool(s.crawls.any())
    jammed = between & ((s.idle[who] > COLLAPSE) | (s.crawls[who] > COLLAPSE))
    if not np.count_nonzero(jammed):
        return None
    # Faces that lie on each other make no corner.
    one = s.contact(who[jammed], before[jammed], before_side[jammed]).normal
    two = s.contact(who[jammed], obstacle[jammed], side[jammed]).normal
    jammed[jammed] = np.abs(one[0] * two[1] - one[1] * two[0]) > OPPOSED
    _into_corner(
        s, who[jammed], (before[jammed], before_side[jammed]), (obstacle[jammed], side[jammed])
    )
    return np.asarray(jammed)


def _into_corner(s: Swarm, who: Ints, on: tuple[Ints, Floats], other: tuple[Ints, Floats]) -> None:
    """Bring particles to rest between two obstacles, or onto the other one, if it alone holds."""
    onto = hold(s, who, on, other)
    rest_on(s, who[onto], other[0][onto], other[1][onto], np.zeros(np.count_nonzero(onto)))


def _touched_before(s: Swarm, who: Ints) -> tuple[Ints, Floats]:
    """Return obstacle and face that particles are on, or came from at the stretch's beginning."""
    on = s.on[who]
    free = on == NONE
    return np.where(free, s.left[who], on), np.where(free, s.left_side[who], s.side[who])


def _blow(
    s: Swarm, who: Ints, c: Contact, before: Floats, approach: Floats, rebound: Floats,
    landing: Bools | None,
) -> None:  # fmt: skip
    """Change the velocities (`before` so far), book the energies, write events and knots.

    `landing` tells who lands with it; None for nobody.
    """
    omega_before = s.omega(who)
    along = dot(before, c.tangent)
    slip = s.slip_of(who, c, along)
    normal, tangential = impulses(approach, slip, c.restitution, c.friction, s.share)
    # The normal speed is set, not added to: ε |v_n| to the last bit.
    s.v[:, s.at(who)] = bare(rebound) * c.normal + bare(along + tangential) * c.tangent
    if s.spins:
        s.z[who] += 2.0 * tangential
    after, mass = slip + tangential / s.share, s.mass[who]
    s.book(
        who,
        c.surface,
        mass * tangential * c.belt,
        0.5 * mass * (approach - rebound) * (approach + rebound),
        -0.5 * mass * tangential * (slip + after),
    )
    state = s.now(who)
    s.journal.knots(who, state)
    told = approach > NEGLIGIBLE
    if landing is not None:
        told |= landing
    surface, push, rub = c.surface, mass * normal, mass * tangential
    count = int(np.count_nonzero(told))
    if count < len(told):
        told |= tangential != 0.0
        count = int(np.count_nonzero(told))
    s.journal.contacts += count
    if count < len(told):
        who, surface, state = who[told], surface[told], state[:, told]
        landing = None if landing is None else landing[told]
        before, omega_before = before[:, told], omega_before[told]
        push, rub = push[told], rub[told]
    hit = int(Kind.IMPACT)
    s.journal.events(
        hit if landing is None else np.where(landing, int(Kind.LANDING), hit),
        who,
        surface,
        state,
        velocity=before,
        omega=omega_before,
        normal=push,
        tangential=rub,
    )


def _still_on(s: Swarm, who: Ints) -> Bools:
    """Tell which sliding or riding particles a blow from elsewhere leaves where they are."""
    c = s.contact(who, s.on[who], s.side[who])
    leaving = np.abs(dot(s.v.take(who, axis=1), c.normal)) > NEGLIGIBLE
    return ~leaving & (load_on(s, who, s.on[who], c) > 0.0)


def _slide_past(s: Swarm, who: Ints, obstacle: Ints, side: Floats, rebound: Floats) -> None:
    """Go on sliding after a blow from another obstacle, or stay in the corner of the two."""
    if not len(who):
        return
    s.left[who], s.left_side[who] = obstacle, side
    s.order[who] = np.where(rebound > 0.0, 1, 2)
    settle_law(s, who)
    kept = s.mode[who] == Mode.FACE
    who, other, other_side = who[kept], obstacle[kept], side[kept]
    pull, _ = face_force(s, who, s.contact(who, s.on[who], s.side[who]))
    against = s.contact(who, other, other_side)
    pressed = dot(pull, against.normal) < -OPPOSED * length_of(pull)
    stuck = (rebound[kept] <= REST) & pressed
    on = (s.on[who[stuck]], s.side[who[stuck]])
    _into_corner(s, who[stuck], on, (other[stuck], other_side[stuck]))


def rest_on(s: Swarm, who: Ints, obstacle: Ints, side: Floats, rebound: Floats) -> None:
    """Begin sliding, gripping or riding on an obstacle."""
    if not len(who):
        return
    _last_bounces(s, who, obstacle, side, rebound)
    flat = obstacle < s.obstacles.segments
    s.mode[who] = np.where(flat, Mode.FACE, Mode.ARC)
    s.on[who], s.side[who] = obstacle, side
    s.left[who], s.left_side[who], s.order[who] = NONE, 0.0, 0
    _ride(s, who[~flat])
    settle_law(s, who)


def _last_bounces(s: Swarm, who: Ints, obstacle: Ints, side: Floats, rebound: Floats) -> None:
    """Sum the bounces after a rebound slower than `REST`, geometric in time and impulse."""
    hops = (rebound > 0.0) & (obstacle < s.obstacles.segments)
    who, u, obstacle = who[hops], rebound[hops], obstacle[hops]
    if not len(who):
        return
    c = s.contact(who, obstacle, side[hops])
    weight, pull = s.weight_on(who, c.normal), s.weight_along(who, c.normal)
    # Without loss the series never ends; its motion is below what is resolved, so it is dropped.
    lost = np.where(c.restitution < 1.0, 1.0 - c.restitution, np.inf)
    time = np.minimum(2.0 * u / (weight * lost), s.stop[who] - s.age[who])
    # Straight from another obstacle: it is in the way.
    before, _ = _touched_before(s, who)
    time[(before != NONE) & (before != obstacle)] = 0.0
    w = dot(s.v.take(who, axis=1), c.tangent)
    s.age[who] += time
    s.p[:, who] += (time * (w + 0.5 * pull * time)) * c.tangent
    w = w + pull * time
    slip = s.slip_of(who, c, w)
    tangential = limited(slip, np.maximum(weight * time - u, 0.0), c.friction, s.share)
    s.v[:, who] = (w + tangential) * c.tangent
    if s.spins:
        s.z[who] += 2.0 * tangential
    mass = s.mass[who]
    s.book(
        who,
        c.surface,
        mass * tangential * c.belt,
        0.5 * mass * u * u,
        -0.5 * mass * tangential * (2.0 * slip + tangential / s.share),
    )
    s.knots(who)


def _ride(s: Swarm, who: Ints) -> None:
    """Begin a ride round a circle, or round its other half: find where that ends."""
    if not len(who):
        return
    o, on, side = s.obstacles, s.on[who], s.side[who]
    normal = o.normal_at(who, on, side, s.p)
    side = np.where(side == 0.0, o.rim_side(who, on, normal), side)
    s.side[who] = side
    phi = np.arctan2(normal[0], normal[1])
    rho = pick(o.rho, who, on - o.segments)
    found = bounds(o, who, on - o.segments, side, rho, phi, s.radius[who])
    for field in fields(found):
        getattr(s.bounds, field.name)[who] = getattr(found, field.name)
