"""Rest in the corner of two obstacles."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from chutelab.exact.obstacles import dot
from chutelab.many import Value, of
from chutelab.recording import Kind

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from chutelab.exact.obstacles import Floats, Ints
    from chutelab.exact.swarm import Contact, Swarm


WEIGHTLESS = 1e-9
"""Share of the weight that a surface may seem to pull with, by rounding, where it holds nothing."""


class CornerError(RuntimeError):
    """A spinning disk held between moving surfaces: beyond the exact engine."""


def hold(
    s: Swarm, who: Ints, on: tuple[Ints, Floats], other: tuple[Ints, Floats]
) -> NDArray[np.bool_]:
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
    v, mass = s.v.take(who, axis=1), of(s.mass, who)
    kinetic = 0.5 * mass * (dot(v, v) + 0.5 * s.z[who] ** 2)
    s.v[:, who], s.z[who] = 0.0, 0.0
    s.book(who, b.surface, 0.0, kinetic, 0.0)
    s.knots(who)
    loads, locked = _corner_loads(of(s.gravity, who), a, b)
    stays = locked | np.all(loads >= -WEIGHTLESS * of(s.gravity, who), axis=0)
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


def _corner_loads(gravity: Value, a: Contact, b: Contact) -> tuple[Floats, NDArray[np.bool_]]:
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
