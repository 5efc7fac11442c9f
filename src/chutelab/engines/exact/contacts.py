"""What a contact does: a blow, coming to rest, gripping or slipping, rest in a corner."""

from __future__ import annotations

import numpy as np

from chutelab.engines.exact.detect import bounds
from chutelab.engines.exact.obstacles import NONE, dot, length_of, pick
from chutelab.engines.exact.particle_state import COLLAPSE, NO_SLIP, Contact, Mode, State
from chutelab.mechanics.contact import grip_limit, impulses, limited, shared
from chutelab.results.record import Kind
from chutelab.util.arrays import Bools, Floats, Ints

WEIGHTLESS = 1e-9
"""Share of the weight that a surface may seem to pull with, by rounding, where it holds nothing."""


class CornerError(RuntimeError):
    """A spinning disk held between moving surfaces: beyond the exact engine."""


def _hold(s: State, index: Ints, on: tuple[Ints, Floats], other: tuple[Ints, Floats]) -> None:
    """Bring particles to rest in the corner of two obstacles, each given with its side.

    A moving surface under them goes on doing work, all of it heat. Where a surface is at rest its
    friction is taken as zero: it dissipates nothing, and the balance of the two normal forces needs
    none. Where friction pulls the particle in harder than any load can hold it (self-locking, as
    with adhesion) a real drive would stall: the particle stays, and nothing more is booked. Where
    gravity pulls out of the corner it falls, from rest, or rests on the other obstacle alone.
    """
    if not len(index):
        return
    a, b = s.contact(index, *on), s.contact(index, *other)
    moving = (a.belt != 0.0) | (b.belt != 0.0)
    beyond = (moving & s.turns[index]).nonzero()[0]
    if len(beyond):
        n, names = beyond[0], s.machine.surfaces
        raise CornerError(
            f"particle {s.first + index[n]}, a spinning disk, is held between"
            f" {names[a.surface[n]]!r} and {names[b.surface[n]]!r}, of which one moves; the exact"
            ' engine cannot follow that: run it with engine = "contact"'
        )
    v, mass = s.v.take(index, axis=1), s.mass[index]
    turning = s.z[index] ** 2 / np.where(s.turns[index], s.lever[index], 1.0)
    kinetic = 0.5 * mass * (dot(v, v) + turning)
    s.v[:, index], s.z[index] = 0.0, 0.0
    s.book(index, b.surface, 0.0, kinetic, 0.0)
    s.knots(index)
    loads, locked = _corner_loads(s.gravity[index], a, b)
    stays = locked | np.all(loads >= -WEIGHTLESS * s.gravity[index], axis=0)
    onto = ~stays & (loads[0] < 0.0) & (s.weight_on(index, b.normal) > 0.0)
    falls = ~stays & ~onto
    s.fly(index[falls], other[0][falls], other[1][falls], 2)
    # A gate lets it out of the corner when it opens, and that is at the end of the wait.
    gone = np.stack([s.obstacles.vanishes[k] - s.released[index] for k, _ in (on, other)])
    opens = stays & (gone.min(axis=0) < s.stop[index])
    rest = stays & ~moving & (s.machine.until == "settled") & np.isinf(gone).all(axis=0)
    s.event(int(Kind.SETTLE), index[rest], a.surface[rest])
    s.finish(index[rest], "settled")
    waits = stays & ~rest
    until = np.where(opens, gone.min(axis=0), s.stop[index])
    time = until - s.age[index]
    for c, load in zip((a, b), loads, strict=True):
        heat = np.where(
            waits & ~locked, mass * _grip(c) * np.abs(c.belt) * np.maximum(load, 0.0) * time, 0.0
        )
        s.book(index, c.surface, heat, 0.0, heat)
    s.age[index[waits]] = until[waits]
    s.knots(index[waits])
    s.finish(index[waits & ~opens], "time")
    rest_on(s, index[onto], other[0][onto], other[1][onto], np.zeros(np.count_nonzero(onto)))
    for n, (kept, normal) in enumerate(((other, b.normal), (on, a.normal))):
        out = opens & (gone[n] <= until) & (gone[1 - n] > until)
        s.fly(index[out], NONE, 0.0, 0)
        lies = out & (s.weight_on(index, normal) > 0.0)
        rest_on(s, index[lies], kept[0][lies], kept[1][lies], np.zeros(np.count_nonzero(lies)))
    both = opens & (gone <= until).all(axis=0)
    s.fly(index[both], NONE, 0.0, 0)


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


def load_on(s: State, index: Ints, obstacle: Ints, c: Contact) -> Floats:
    """Return the normal force per mass that would keep a particle on an obstacle, m/s²."""
    load = s.weight_on(index, c.normal)
    curved = (obstacle >= s.obstacles.segments).nonzero()[0]
    if len(curved):
        rho = pick(s.obstacles.rho, index[curved], obstacle[curved] - s.obstacles.segments)
        load[curved] -= dot(s.v[:, index[curved]], c.tangent[:, curved]) ** 2 / rho
    return load


def pressed(s: State, index: Ints, obstacle: Ints, c: Contact) -> Bools:
    """Tell which particles an obstacle bears: by a positive load, or one that is about to be.

    Where a path round a circle gets steeper towards the weight, the hops of a particle shrink
    towards the point of zero load, and by rounding its load there is never above 0.
    """
    load = load_on(s, index, obstacle, c)
    bears = load > 0.0
    if np.count_nonzero(bears) < len(index):
        near = ~bears & (load >= -WEIGHTLESS * s.gravity[index])
        near &= obstacle >= s.obstacles.segments
        if np.count_nonzero(near):
            rho = pick(s.obstacles.rho, index, np.maximum(obstacle - s.obstacles.segments, 0))
            w = dot(s.v.take(index, axis=1), c.tangent)
            bears |= near & (w * s.weight_along(index, c.normal) / rho < 0.0)
    return bears


def settle_law(s: State, index: Ints) -> None:
    """Choose between gripping and slipping, and end tracks that have settled.

    Without slip, friction must hold against gravity: m*/m |g_t| <= µ N. Where it cannot, slip
    starts the way gravity pulls.
    """
    if not len(index):
        return
    c = s.contact(index)
    arc = s.mode[index] == Mode.ARC
    w = dot(s.v.take(index, axis=1), c.tangent)
    slip = s.slip_of(index, c, w)
    drags = index[np.isinf(c.friction) & (slip != 0.0)]
    if len(drags):
        # Friction without bound stops a slip without a normal impulse.
        none = np.zeros(len(drags))
        _blow(s, drags, s.contact(drags), s.v.take(drags, axis=1), none, none, None)
        w = dot(s.v.take(index, axis=1), c.tangent)
        slip = s.slip_of(index, c, w)
    still = slip == 0.0
    halted = index[still]
    if len(halted):
        w[still] = s.stop_slip(halted, c.belt[still], w[still])
    s.v[:, index] = w * c.tangent
    pull, load = s.weight_along(index, c.normal), load_on(s, index, s.on[index], c)
    # What makes the contact point slip if nothing holds it, and that makes the rim turn.
    tends, grip, share = pull, grip_limit(c.friction, load), s.share[index]
    rests = ~s.turns[index] | (pull == 0.0)
    if s.rolls:
        tends, share, rests = _roll(s, index, c, slip, pull, load, grip)
    grips = still & (share * np.abs(tends) <= grip)
    begins = grips & (s.slip[index] != 0.0)
    s.slip[index] = np.where(grips, 0.0, np.where(still, np.sign(tends), np.sign(slip)))
    s.event(int(Kind.STICK), index[begins], c.surface[begins])
    if s.machine.until == "settled":
        # Rolling down a slope is not lying on it.
        steady = grips & rests & ~(arc & (w != 0.0))
        lies = steady & ((c.belt == 0.0) | (c.surface == s.machine.landing))
        if len(s.changes):
            lies &= np.isinf(s.obstacles.vanishes[s.on[index]])
        s.event(int(Kind.SETTLE), index[lies], c.surface[lies])
        s.finish(index[lies], "settled")


def _roll(
    s: State, index: Ints, c: Contact, slip: Floats, pull: Floats, load: Floats, grip: Floats
) -> tuple[Floats, Floats, Bools]:
    """Choose between turning and not where rolling friction acts; of the others nothing changes.

    Returns what makes the contact point slip, m/s², the share of it that friction must take up to
    hold it, and which particles can rest there.
    """
    o, lever, most = s.on[index], s.lever[index], s.rolling[index] * load
    acts, share = s.rolling[index] > 0.0, s.share[index]
    spin = s.z[index] - s.surface_spin(index, o)
    turns = np.abs(spin) > NO_SLIP * (np.abs(s.z[index]) + np.abs(c.belt))
    s.z[index] -= np.where(acts & ~turns, spin, 0.0)
    still = slip == 0.0
    # Without slip the pull must turn it, with slip friction does.
    holds = np.where(still, (np.abs(pull) <= most) & (np.abs(pull) <= grip), grip <= most)
    # It starts to turn as the force at the rim has it; sliding wins where friction gives way.
    slides = still & (grip <= most)
    begins = -np.sign(np.where(still, pull, slip))
    roll = np.where(turns, np.sign(spin), np.where(holds | slides, 0.0, begins))
    s.roll[index] = np.where(acts, roll, 0.0)
    held = acts & (roll == 0.0)
    tends = np.where(acts & ~held, pull - lever * roll * most, pull)
    rests = np.where(acts, held, ~s.turns[index] | (pull == 0.0))
    return tends, np.where(held, 1.0, share), rests


def end_roll(s: State, index: Ints) -> None:
    """Make a spin that is used up exactly that of the surface, then see what goes on."""
    if not len(index):
        return
    c, spin = s.contact(index), s.surface_spin(index, s.on[index])
    s.z[index] = spin
    grips = s.slip[index] == 0.0
    s.v[:, index[grips]] = ((c.belt - spin) * c.tangent)[:, grips]
    settle_law(s, index)


def end_slip(s: State, index: Ints) -> None:
    """Make a slip that is used up exactly zero, then see whether friction holds."""
    if not len(index):
        return
    c = s.contact(index)
    w = s.stop_slip(index, c.belt, dot(s.v.take(index, axis=1), c.tangent))
    slides = ~s.turns[index]
    s.v[:, index[slides]] = (w * c.tangent)[:, slides]
    settle_law(s, index)


def face_force(s: State, index: Ints, c: Contact) -> tuple[Floats, Floats, Floats]:
    """Return what acts on a face, per mass.

    That is: acceleration (2, k), friction along the tangent and, over r, the couple of rolling
    friction, (k,).
    """
    pull, load = s.weight_along(index, c.normal), s.weight_on(index, c.normal)
    slip = s.slip[index]
    gripping = slip == 0.0
    finite = np.where(gripping, 0.0, c.friction)
    couple, tends, share = np.zeros(len(index)), pull, s.share[index]
    if s.rolls:
        held = (s.rolling[index] > 0.0) & (s.roll[index] == 0.0)
        couple = -s.roll[index] * s.rolling[index] * load
        tends, share = pull + s.lever[index] * couple, np.where(held, 1.0, share)
    force = np.where(gripping, -share * tends, -slip * finite * load)
    if s.rolls:
        couple = np.where(held, -force, couple)
    return (pull + force) * c.tangent, force, couple


NEGLIGIBLE = 1e-12
"""m/s times `Machine.pace`, as the following; an approach this slow is a touch, not a blow."""

REST = 1e-9
"""m/s; a rebound this slow is summed with all that would follow it: u_n (1 + ε)/(1 - ε) of normal
impulse in the time 2 u_n/(g_n (1 - ε)). At ε = 0.999 some 20,000 bounces come before.
At ε = 1 such a rebound, 1e-19 m high, is taken for rest."""


CRAWL = 1000.0 * REST
"""m/s; a particle this slow that goes to and fro between two obstacles is coming to rest there."""

OPPOSED = 1e-9
"""Sine of the angle at which two surfaces must meet to hold a particle between them."""


def strike(s: State, index: Ints, obstacle: Ints, side: Floats) -> None:
    """Resolve the contacts of particles that have just reached an obstacle."""
    carried = s.mode[index] == Mode.CARRIED
    if np.count_nonzero(carried):
        s.part(index[carried], 0)
    s.snap(index, obstacle, side)
    c = s.contact(index, obstacle, side)
    before = s.v.take(index, axis=1)
    approach = np.maximum(-dot(before, c.normal), 0.0)
    soft = approach <= NEGLIGIBLE * s.pace[index]
    if np.count_nonzero(soft):
        c = c._replace(restitution=np.where(soft, 0.0, c.restitution))
    rebound = c.restitution * approach
    landing = (c.surface == s.machine.landing) & ~s.landed[index]
    lands = np.count_nonzero(landing) > 0
    _blow(s, index, c, before, approach, rebound, landing if lands else None)
    if lands:
        s.landed[index] |= landing
        if s.machine.until == "landed":
            s.finish(index[landing], "landed")
            if np.count_nonzero(landing) == len(index):
                return
    _after(s, index, obstacle, side, c, rebound)


def _after(
    s: State, index: Ints, obstacle: Ints, side: Floats, c: Contact, rebound: Floats
) -> None:
    """Decide whether particles fly on, slide on or come to rest after a blow."""
    if s.past is not None:
        before, before_side = _touched_before(s, index)
        other = before != obstacle
        s.past.obstacle[index[other]], s.past.side[index[other]] = before[other], before_side[other]
    jammed = _stop_jammed(s, index, obstacle, side, rebound)
    mode = s.mode[index]
    live = mode != Mode.DONE
    if jammed is not None:
        live &= ~jammed
    held = mode >= Mode.FACE
    on_surface = np.count_nonzero(held) > 0
    if on_surface:
        # A blow from elsewhere may leave those that slide or ride where they are.
        on = index[held]
        under = s.contact(on)
        leaving = np.abs(dot(s.v.take(on, axis=1), under.normal)) > NEGLIGIBLE * s.pace[on]
        held[held] = ~leaving & pressed(s, on, s.on[on], under)
        slides = held & live
        _slide_past(s, index[slides], obstacle[slides], side[slides], rebound[slides])
        live &= ~held
    rests = live & (rebound <= REST * s.pace[index])
    if np.count_nonzero(rests):
        rests &= pressed(s, index, obstacle, c)
        rest_on(s, index[rests], obstacle[rests], side[rests], rebound[rests])
        live &= ~rests
    if np.count_nonzero(live) < len(live):
        index, obstacle, side, rebound = index[live], obstacle[live], side[live], rebound[live]
    if on_surface:
        leaves = index[s.on[index] != NONE]
        s.part(leaves, s.obstacles.surface[s.on[leaves]])
    s.fly(index, obstacle, side, 2 - (rebound > 0.0))


def _stop_jammed(
    s: State, index: Ints, obstacle: Ints, side: Floats, rebound: Floats
) -> Bools | None:
    """Stop particles that go to and fro between two obstacles without progress; tell which."""
    if not (s.idling or s.crawling or np.count_nonzero(rebound <= 2.0 * CRAWL * s.pace[index])):
        return None
    slow = length_of(s.v.take(index, axis=1)) <= CRAWL * s.pace[index]
    if not (s.idling or s.crawling or np.count_nonzero(slow)):
        return None
    before, before_side = _touched_before(s, index)
    between = (before != NONE) & (before != obstacle) & (s.mode[index] != Mode.DONE)
    s.crawls[index] = np.where(slow, s.crawls[index] + between, 0)
    s.crawling = bool(s.crawls.any())
    jammed = between & ((s.idle[index] > COLLAPSE) | (s.crawls[index] > COLLAPSE))
    if not np.count_nonzero(jammed):
        return None
    # Faces that lie on each other make no corner.
    one = s.contact(index[jammed], before[jammed], before_side[jammed]).normal
    two = s.contact(index[jammed], obstacle[jammed], side[jammed]).normal
    jammed[jammed] = np.abs(one[0] * two[1] - one[1] * two[0]) > OPPOSED
    _hold(s, index[jammed], (before[jammed], before_side[jammed]), (obstacle[jammed], side[jammed]))
    return np.asarray(jammed)


def _touched_before(s: State, index: Ints) -> tuple[Ints, Floats]:
    """Return obstacle and face that particles are on, or came from at the stretch's beginning."""
    on = s.on[index]
    free = on == NONE
    return np.where(free, s.left[index], on), np.where(free, s.left_side[index], s.side[index])


def _blow(
    s: State, index: Ints, c: Contact, before: Floats, approach: Floats, rebound: Floats,
    landing: Bools | None,
) -> None:  # fmt: skip
    """Change the velocities (`before` so far), book the energies, write events and knots.

    `landing` tells which particles land with it; None if none does.
    """
    omega_before = s.omega(index)
    along = dot(before, c.tangent)
    slip = s.slip_of(index, c, along)
    share = s.share[index]
    normal, tangential = impulses(approach, slip, c.restitution, c.friction, share)
    tangential, change, work, heat = _rub(s, index, c, slip, normal, tangential)
    # The normal speed is set, not added to: ε |v_n| to the last bit.
    s.v[:, s.at(index)] = rebound * c.normal + (along + tangential) * c.tangent
    after, mass = slip + change, s.mass[index]
    s.book(
        index,
        c.surface,
        mass * tangential * c.belt + work,
        0.5 * mass * (approach - rebound) * (approach + rebound),
        -0.5 * mass * tangential * (slip + after) + heat,
    )
    s.knots(index)
    told = (approach > NEGLIGIBLE * s.pace[index]) | (tangential != 0.0)
    if landing is not None:
        told |= landing
    kind: int | Ints = int(Kind.IMPACT)
    if landing is not None:
        kind = np.where(landing[told], int(Kind.LANDING), kind)
    push, rub = (mass * normal)[told], (mass * tangential)[told]
    s.contacts += len(push)
    s.event(kind, index[told], c.surface[told], (before[:, told], omega_before[told], push, rub))


def _slide_past(s: State, index: Ints, obstacle: Ints, side: Floats, rebound: Floats) -> None:
    """Go on sliding after a blow from another obstacle, or stay in the corner of the two."""
    if not len(index):
        return
    s.left[index], s.left_side[index] = obstacle, side
    s.order[index] = np.where(rebound > 0.0, 1, 2)
    settle_law(s, index)
    kept = s.mode[index] == Mode.FACE
    index, other, other_side = index[kept], obstacle[kept], side[kept]
    pull, _, _ = face_force(s, index, s.contact(index))
    against = s.contact(index, other, other_side)
    pressed = dot(pull, against.normal) < -OPPOSED * length_of(pull)
    stuck = (rebound[kept] <= REST * s.pace[index]) & pressed
    on = (s.on[index[stuck]], s.side[index[stuck]])
    _hold(s, index[stuck], on, (other[stuck], other_side[stuck]))


def rest_on(s: State, index: Ints, obstacle: Ints, side: Floats, rebound: Floats) -> None:
    """Begin sliding, gripping or riding on an obstacle."""
    if not len(index):
        return
    _last_bounces(s, index, obstacle, side, rebound)
    flat = obstacle < s.obstacles.segments
    s.mode[index] = np.where(flat, Mode.FACE, Mode.ARC)
    s.on[index], s.side[index] = obstacle, side
    s.left[index], s.left_side[index], s.order[index] = NONE, 0.0, 0
    look_round(s, index[~flat])
    settle_law(s, index)


def _last_bounces(s: State, index: Ints, obstacle: Ints, side: Floats, rebound: Floats) -> None:
    """Sum the bounces after a rebound slower than `REST`, geometric in time and impulse."""
    hops = (rebound > 0.0) & (obstacle < s.obstacles.segments)
    index, u, obstacle = index[hops], rebound[hops], obstacle[hops]
    if not len(index):
        return
    c = s.contact(index, obstacle, side[hops])
    weight, pull = s.weight_on(index, c.normal), s.weight_along(index, c.normal)
    # Without loss the series never ends; its motion is below what is resolved, so it is dropped.
    lost = np.where(c.restitution < 1.0, 1.0 - c.restitution, np.inf)
    time = np.minimum(2.0 * u / (weight * lost), s.stop[index] - s.age[index])
    # Straight from another obstacle: it is in the way.
    before, _ = _touched_before(s, index)
    time[(before != NONE) & (before != obstacle)] = 0.0
    w = dot(s.v.take(index, axis=1), c.tangent)
    s.age[index] += time
    s.p[:, index] += (time * (w + 0.5 * pull * time)) * c.tangent
    w = w + pull * time
    slip = s.slip_of(index, c, w)
    normal = np.maximum(weight * time - u, 0.0)
    tangential = limited(slip, normal, c.friction, s.share[index])
    tangential, change, work, heat = _rub(s, index, c, slip, normal, tangential)
    s.v[:, index] = (w + tangential) * c.tangent
    mass = s.mass[index]
    s.book(
        index,
        c.surface,
        mass * tangential * c.belt + work,
        0.5 * mass * u * u,
        -0.5 * mass * tangential * (2.0 * slip + change) + heat,
    )
    s.knots(index)


def _rub(
    s: State, index: Ints, c: Contact, slip: Floats, normal: Floats, tangential: Floats
) -> tuple[Floats, Floats, Floats, Floats]:
    """Change the spin by the tangential impulse that goes with a normal one, per mass.

    Rolling friction has its share in that. Returns tangential impulse per mass and change of the
    slip (m/s), and the work and heat of rolling friction (J), (k,).
    """
    share, lever, mass, none = s.share[index], s.lever[index], s.mass[index], np.zeros(len(index))
    if not s.rolls:
        if s.spins:
            s.z[index] += lever * tangential
        return tangential, tangential / share, none, none
    turn = s.surface_spin(index, c.obstacle)
    spin = s.z[index] - turn
    tangential, couple = shared(slip, spin, normal, c.friction, s.rolling[index], share)
    gain = lever * (tangential + couple)
    s.z[index] += gain
    heat = -0.5 * mass * couple * (2.0 * spin + gain)
    return tangential, tangential + gain, mass * couple * turn, heat


def look_round(s: State, index: Ints) -> None:
    """Find where a ride round a circle, or round its other half, ends."""
    if not len(index):
        return
    o, on, side = s.obstacles, s.on[index], s.side[index]
    normal = o.normal_at(index, on, side, s.p)
    side = np.where(side == 0.0, o.rim_side(index, on, normal), side)
    s.side[index] = side
    phi = np.arctan2(normal[0], normal[1])
    rho, s.angle[index] = pick(o.rho, index, on - o.segments), phi
    s.bounds[:, index] = bounds(
        o, index, on - o.segments, side, rho, phi, s.radius[index], s.epoch(index)
    )
