"""Answers from outside, to hold engines against: brute force, no code of any engine.

- `first_impacts`: which disks meet and when in a box; after each event all is predicted anew.
- `henderson`, `virial`, `wall_pressure`, `maxwell_boltzmann`: a gas of hard disks.
- `overlaps`, `inside_surfaces`: how deep disks of a recording are in each other and in surfaces.

They take the arrays of a machine, or a recording. ω is positive counter-clockwise; the tangent at a
contact of normal n is (n_y, -n_x). Everything is in SI units.
"""

from __future__ import annotations

from itertools import zip_longest
from math import hypot, inf, sqrt
from typing import NamedTuple

import numpy as np

from chutelab.results import Kind

# First impacts


class Impact(NamedTuple):
    """One impact of a particle: when, with which particle or surface, how fast they approach."""

    t: float
    partner: int | str
    approach: float


SAME = 1e-12
"""m; what is this near to a face touches it."""


def first_impacts(machine, t_end):
    """Follow disks in a convex box from event to event, and return the impacts of each.

    After each event all times of the two that had it are predicted anew: with every other disk,
    which falls alike, and with every face. Each is the root of a quadratic at which a gap closes.
    Blows are Newton's and Coulomb's.

    Parameters
    ----------
    machine : Machine
        Of equal disks (r > 0) that start at 0 s; its faces are the sides of a box, and do not move.
    t_end : float
        s; before any of them comes to rest.
    """
    p, r, s, g = machine.particle, machine.particle.radius, machine.segments, machine.gravity
    turning = 2.0 if p.inertia > 0.0 else 0.0  # m r²/I
    fall = np.array([0.0, -g])
    x, v = machine.releases.position.copy(), machine.releases.velocity.copy()
    count = len(x)
    spin, since, found = np.zeros(count), np.zeros(count), [[] for _ in range(count)]
    left = np.stack([-s.tangent[:, 1], s.tangent[:, 0]], axis=1)
    inward = np.sign(((x[0] - s.start) * left).sum(axis=1))[:, None] * left
    pair, face = np.full((count, count), inf), np.full((count, len(left)), inf)

    def move(i, t):
        h = t - since[i]
        x[i] += h * v[i] + 0.5 * h * h * fall
        v[i] += h * fall
        since[i] = t

    def predict(i):
        gap = ((x[i] - s.start) * inward).sum(axis=1) - r
        face[i] = since[i] + closes(np.where(gap <= SAME, 0.0, gap), inward @ v[i], inward @ fall)
        others = np.flatnonzero(np.arange(count) != i)
        h = (since[i] - since[others])[:, None]
        d = x[i] - (x[others] + h * v[others] + 0.5 * h * h * fall)
        u = v[i] - (v[others] + h * fall)
        # |d + u t| = 2 r, over 2 |d|: what is left of the square is a quadratic's.
        c = 0.5 * (np.hypot(*d.T) - 2.0 * r) * (np.hypot(*d.T) + 2.0 * r)
        met = closes(np.maximum(c, 0.0), (d * u).sum(axis=1), (u * u).sum(axis=1))
        pair[i, others] = pair[others, i] = since[i] + met

    def blow(along, normal, slip, friction, share):
        """Return the impulse along a tangent that stops the slip, or what friction allows."""
        return np.clip(-share * slip / (1.0 + turning), -friction * normal, friction * normal)

    for i in range(count):
        predict(i)
    while True:
        i, j = divmod(int(pair.argmin()), count)
        k, side = divmod(int(face.argmin()), len(left))
        t = min(pair[i, j], face[k, side])
        if t >= t_end:
            return found
        if pair[i, j] <= face[k, side]:
            move(i, t)
            move(j, t)
            n = (x[i] - x[j]) / hypot(*(x[i] - x[j]))
            along, approach = np.array([n[1], -n[0]]), -(v[i] - v[j]) @ n
            slip = (v[i] - v[j]) @ along + r * (spin[i] + spin[j])
            # Per mass; each takes half of what changes.
            normal = 0.5 * (1.0 + machine.pair_restitution[0, 0]) * approach
            rub = blow(along, normal, slip, machine.pair_friction[0, 0], 0.5)
            v[i] += normal * n + rub * along
            v[j] -= normal * n + rub * along
            spin[[i, j]] += turning * rub / r
            found[i].append(Impact(t, j, approach))
            found[j].append(Impact(t, i, approach))
            predict(j)
        else:
            i, n = k, inward[side]
            move(i, t)
            along, approach = np.array([n[1], -n[0]]), -v[i] @ n
            normal = (1.0 + s.restitution[side]) * approach
            rub = blow(along, normal, v[i] @ along + r * spin[i], s.friction[side], 1.0)
            v[i] += normal * n + rub * along
            spin[i] += turning * rub / r
            found[i].append(Impact(t, machine.surfaces[s.surface[side]], approach))
        predict(i)


def closes(gap, rate, pull):
    """Return when gap + rate t + pull t²/2, of gaps >= 0, comes to 0 while it falls; inf if never.

    What touches comes back where it is pulled back.
    """
    square = rate * rate - 2.0 * pull * gap
    root = np.sqrt(np.maximum(square, 0.0))
    with np.errstate(divide="ignore", invalid="ignore"):
        away = np.where(pull < 0.0, -2.0 * rate / pull, inf)
        later = np.where(root - rate > 0.0, 2.0 * gap / (root - rate), inf)
    touching = (gap == 0.0) & (rate >= 0.0)
    return np.where(square <= 0.0, inf, np.where(touching, away, later))


class Likeness(NamedTuple):
    """A recording beside `first_impacts`: how many impacts were alike, what was not."""

    alike: int
    off: float
    """Largest difference of times, in the way that the gap closes meanwhile, m."""
    approach: float
    """Largest difference of approach speeds, m/s; of impacts with surfaces."""
    unlike: list[tuple[int, Impact | None, Impact | None]]
    """Particle, what was expected, what came: the first difference of each particle."""


def likeness(found, recording, most=3, tolerance=1e-10):
    """Lay the first impacts of each particle beside a recording's.

    An impact is alike if its partner is the same and its time within `tolerance`, s.
    """
    alike, offs, approaches, unlike = 0, [0.0], [0.0], []
    for i, pairs in enumerate(zip(found, _impacts_of(recording), strict=True)):
        for expected, one in zip_longest(*(each[:most] for each in pairs)):
            both = expected is not None and one is not None and expected.partner == one.partner
            if not both or abs(expected.t - one.t) > tolerance:
                unlike.append((i, expected, one))
                break
            alike += 1
            offs.append(abs(expected.t - one.t) * expected.approach)
            if isinstance(one.partner, str):
                approaches.append(abs(expected.approach - one.approach))
    return Likeness(alike, max(offs), max(approaches), unlike)


def _impacts_of(recording):
    """Return the impacts of each particle in a recording."""
    own, pairs = [[] for _ in range(recording.count)], set()
    for event in recording.select(Kind.IMPACT, Kind.LANDING, Kind.COLLISION):
        i, j, t = int(event["particle"]), int(event["other"]), float(event["t"])
        if j < 0:
            approach = -float(event["velocity_before"] @ normal_of(recording, event))
            own[i].append(Impact(t, recording.surfaces[event["surface"]], approach))
        elif (t, min(i, j), max(i, j)) not in pairs:
            pairs.add((t, min(i, j), max(i, j)))
            own[i].append(Impact(t, j, np.nan))
            own[j].append(Impact(t, i, np.nan))
    return own


def normal_of(recording, blow):
    """Return the normal of a blow: m Δv = J_n n + J_t (n_y, -n_x), solved for n."""
    change = recording.particle.mass * (blow["velocity_after"] - blow["velocity_before"])
    n, rub = blow["normal_impulse"], blow["tangential_impulse"]
    if n == 0.0:
        return change
    return (n * change + rub * np.array([-change[1], change[0]])) / (n * n + rub * rub)


# A gas of hard disks


def henderson(packing):
    """Return Z = p A/(N k T) of hard disks that cover a share η of the area.

    Z = (1 + η²/8)/(1 - η)², D. Henderson, Mol. Phys. 30, 971 (1975); within 0.2 % of simulations
    for η < 0.5.
    """
    return (1.0 + packing**2 / 8.0) / (1.0 - packing) ** 2


def virial(impulses, *, diameter, time, kinetic):
    """Return Z of hard disks from their collisions, without walls or far from them.

    The virial theorem: Z = 1 + Σ σ J/(2 N k T t), and in two dimensions N k T is the kinetic energy
    of translation.

    Parameters
    ----------
    impulses : array_like
        Normal impulse J of each collision, once a pair, N s.
    diameter, time, kinetic : float
        σ (m), time in which they happened (s), kinetic energy of all (J).
    """
    return 1.0 + diameter * np.sum(impulses) / (2.0 * kinetic * time)


def wall_pressure(impulses, *, perimeter, time):
    """Return the pressure (N/m) on walls that took normal impulses (N s) in a time (s)."""
    return np.sum(impulses) / (perimeter * time)


def maxwell_boltzmann(velocity):
    """Return the p-value for velocities (N, 2) to be Maxwell-Boltzmann's (Kolmogorov-Smirnov).

    Each component is normal with variance kT/m = <v²>/2. Samples of one run have to be some
    collisions of each disk apart to be independent.
    """
    # Here, as to import it takes a second.
    from scipy.stats import kstest

    sigma = sqrt((velocity**2).sum(axis=1).mean() / 2.0)
    return kstest(velocity.ravel() / sigma, "norm").pvalue


# What a recording shows


class Depth(NamedTuple):
    """Overlaps in radii: the largest, the 99th percentile of all there are, and their number.

    Of two disks it is the radius of the smaller.
    """

    worst: float
    percentile_99: float
    count: int

    @classmethod
    def of(cls, found):
        depth = np.concatenate([np.zeros(0), *found])
        depth = depth[depth > 0.0]
        if not len(depth):
            return cls(0.0, 0.0, 0)
        return cls(float(depth.max()), float(np.percentile(depth, 99)), len(depth))


def overlaps(recording, times):
    """Return how deep disks are in each other at times (T,), s, as `Depth`.

    Of all pairs of free disks that touch then; disks carried by adhesion do not count, as nothing
    can push them.
    """
    return Depth.of(pair_overlaps(x, r) for _, x, r in _free(recording, times))


def pair_overlaps(x, r):
    """Return the overlaps, in the smaller's radii, of all disks (k, 2), (k,) that touch."""
    from scipy.spatial import cKDTree

    if not len(x):
        return np.zeros(0)
    i, j = cKDTree(x).query_pairs(2.0 * np.max(r), output_type="ndarray").T
    r = np.broadcast_to(r, len(x))
    deep = r[i] + r[j] - np.hypot(*(x[i] - x[j]).T)
    return deep / np.minimum(r[i], r[j])


def inside_surfaces(recording, machine, times):
    """Return how deep free disks are in surfaces at times (T,), s, as `Depth`."""
    return Depth.of(
        depth / r
        for t, x, r in _free(recording, times)
        for depth in surface_depths(machine, x, r, t)
    )


def surface_depths(machine, x, r, t):
    """Return how deep (m) disks (k, 2), (k,) are in each piece that is there at a time (s)."""
    return [-gap for piece, _, gap in surface_gaps(machine, x, r) if piece.there(t)]


def surface_gaps(machine, x, r):
    """Yield each piece of a machine, its name, and how far disks (k, 2), (k,) are from it, m.

    By its shape, in which the engines have no part. A wheel is full: its inside is no place to be.
    """
    for piece, name in zip(machine.pieces, machine.names, strict=True):
        wheel = name == "pulley"
        yield piece, name, np.hypot(*x.T) - machine.pulley.radius - r if wheel else piece.gap(x, r)


def free_from(recording, carried):
    """Return the time (s) from which each disk is not carried by adhesion, inf if always."""
    free = np.where(carried, inf, -inf)
    for event in recording.select(Kind.SEPARATION)[::-1]:
        if carried[event["particle"]]:
            free[event["particle"]] = event["t"]
    return free


def _free(recording, times):
    """Yield each time, and places (k, 2) and radii (k,) of what is there then, and not carried."""
    free = free_from(recording, recording.machine.releases.carried)
    times, r = np.atleast_1d(times), np.broadcast_to(recording.particle.radius, recording.count)
    for some in np.array_split(times, max(1, len(times) // 100)):
        for t, x in zip(some, recording.at(some)[0], strict=True):
            there = np.isfinite(x[:, 0]) & (free <= t)
            yield t, x[there], r[there]
