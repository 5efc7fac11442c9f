"""Answers from outside, to hold engines against: brute force, no code of any engine.

- `first_impacts`: who meets whom and when in a dilute stream; after each event all is predicted.
- `henderson`, `virial`, `wall_pressure`, `maxwell_boltzmann`: a gas of hard disks.
- `overlaps`, `inside_surfaces`: how deep disks of a recording are in each other and in surfaces.

They take the arrays of a machine, or a recording. ω is positive counter-clockwise; the tangent at a
contact of normal n is (n_y, -n_x). Everything is in SI units.
"""

from __future__ import annotations

from math import acos, copysign, cos, hypot, inf, sin, sqrt
from typing import NamedTuple

import numpy as np
from numpy.polynomial import polynomial
from scipy.spatial import cKDTree
from scipy.stats import kstest

from chutelab.results import Kind

# First impacts


class Impact(NamedTuple):
    """One impact of a particle: when, with which particle or surface, how fast they approach."""

    t: float
    partner: int | str
    approach: float


class Impacts(NamedTuple):
    """What `first_impacts` finds: each particle's impacts, and until when it is followed (s)."""

    of: list[list[Impact]]
    followed: np.ndarray


class _Round(NamedTuple):
    """A circle that a centre can meet: the end of a segment, or the pulley."""

    center: np.ndarray
    reach: float
    left: np.ndarray  # of the belt that ends there; 0 for the pulley
    speed: float
    restitution: float
    friction: float
    surface: int
    segment: int  # whose end it is, -1 for the pulley
    outward: np.ndarray


class _Face(NamedTuple):
    start: np.ndarray
    tangent: np.ndarray
    length: float
    left: np.ndarray
    speed: float
    restitution: float
    friction: float
    surface: int


SAME = 1e-12
"""m; ends of segments this close together are one joint."""

REAL = 1e-7
"""Imaginary share of a root below which it may be real: of a double root half the digits are lost.
Newton's rounds afterwards decide."""


def first_impacts(machine, t_end):
    """Follow the disks of a dilute stream from event to event.

    After each event all times of the two that had it are predicted anew: with every other disk (a
    quadratic, as both fall alike), every face (a quadratic), every end and the pulley (a quartic).
    Blows are Newton's and Coulomb's. Disks carried by adhesion appear where they leave the pulley.

    A disk is followed until it comes to rest on a surface (its rebound would last less than two
    steps `machine.dt`). Then it is taken away: what would meet it later flies on.

    Parameters
    ----------
    machine : Machine
        Of disks (r > 0), released by adhesion or in free flight; no surface is in the way of those
        that are carried.
    t_end : float
        s.

    Raises
    ------
    ValueError
        If a free disk gets in the way of a carried one, or one is released inside another.
    """
    p, r, g = machine.particle, machine.particle.radius, machine.gravity
    faces, rounds = _solids(machine, r)
    solids = [*faces, *rounds]
    turning = 2.0 if p.inertia > 0.0 else 0.0  # m r²/I
    fall = np.array([0.0, -g])
    entry, place, course, rides = _entries(machine)
    count = len(entry)
    x, v, spin = np.zeros((count, 2)), np.zeros((count, 2)), np.zeros(count)
    since, here = np.full(count, inf), np.zeros(count, dtype=bool)
    pair, solid = np.full((count, count), inf), np.full((count, len(solids)), inf)
    found, followed = [[] for _ in range(count)], np.full(count, float(t_end))

    def move(i, t):
        h = t - since[i]
        x[i] += h * v[i] + 0.5 * h * h * fall
        v[i] += h * fall
        since[i] = t

    def predict(i, touched, order):
        """Find the next times of particle i; it touches a solid, left in that order of time."""
        for k, one in enumerate(solids):
            left = order if k in touched else 0
            meet = _meet_face if k < len(faces) else _meet_round
            solid[i, k] = since[i] + meet(one, x[i], v[i], fall, r, left)
        pair[i], pair[:, i] = inf, inf
        others = np.flatnonzero(here & (np.arange(count) != i))
        if machine.interact and len(others):
            h = (since[i] - since[others])[:, None]
            d = x[i] - (x[others] + h * v[others] + 0.5 * h * h * fall)
            u = v[i] - (v[others] + h * fall)
            a, b = (u * u).sum(1), (d * u).sum(1)
            c = (np.hypot(*d.T) - 2.0 * r) * (np.hypot(*d.T) + 2.0 * r)
            square = b * b - a * c
            meets = (b < 0.0) & (square > 0.0)
            root = np.sqrt(np.where(meets, square, 1.0))
            t = np.where(meets, np.maximum(c, 0.0) / (root - b), inf)
            pair[i, others] = pair[others, i] = since[i] + t

    def leave(i, t):
        here[i] = False
        followed[i] = t
        pair[i], pair[:, i], solid[i] = inf, inf, inf

    waiting = sorted(range(count), key=lambda i: -entry[i])
    while True:
        i, j = divmod(int(pair.argmin()), count)
        k, surface = divmod(int(solid.argmin()), len(solids))
        release = entry[waiting[-1]] if waiting else inf
        t = min(pair[i, j], solid[k, surface], release)
        if t >= t_end:
            return Impacts(found, followed)
        if t == release:
            i = waiting.pop()
            x[i], v[i], since[i], here[i] = place[i], course[i], t, True
            others = np.flatnonzero(here & (np.arange(count) != i))
            away = x[others] + (t - since[others])[:, None] * v[others]
            away += 0.5 * (t - since[others])[:, None] ** 2 * fall - x[i]
            if machine.interact and (np.hypot(*away.T) < 2.0 * r * (1.0 - SAME)).any():
                raise ValueError(f"particle {i} is released inside another")
            predict(i, *_touched(faces, rounds, x[i], v[i], r, rides[i]))
        elif pair[i, j] <= solid[k, surface]:
            move(i, t)
            move(j, t)
            n = (x[i] - x[j]) / hypot(*(x[i] - x[j]))
            along = np.array([n[1], -n[0]])
            approach = -(v[i] - v[j]) @ n
            slip = (v[i] - v[j]) @ along + r * (spin[i] + spin[j])
            # Per mass; each takes half of what changes.
            normal = 0.5 * (1.0 + machine.pair_restitution[0, 0]) * approach
            most = machine.pair_friction[0, 0] * normal
            rub = np.clip(-0.5 * slip / (1.0 + turning), -most, most)
            v[i] += normal * n + rub * along
            v[j] -= normal * n + rub * along
            spin[[i, j]] += turning * rub / r
            found[i].append(Impact(t, j, approach))
            found[j].append(Impact(t, i, approach))
            predict(i, (), 0)
            predict(j, (), 0)
        else:
            i, one = k, solids[surface]
            move(i, t)
            n, belt = _contact(one, x[i])
            along = np.array([n[1], -n[0]])
            approach, pace = -v[i] @ n, v[i] @ along
            normal = (1.0 + one.restitution) * approach
            slip = pace + r * spin[i] - belt
            # µ may be infinite, and the blow nothing.
            most = one.friction * normal if normal > 0.0 else 0.0
            rub = np.clip(-slip / (1.0 + turning), -most, most)
            v[i] = one.restitution * approach * n + (pace + rub) * along
            spin[i] += turning * rub / r
            found[i].append(Impact(t, machine.surfaces[one.surface], approach))
            rebound, load = one.restitution * approach, g * n[1]
            if isinstance(one, _Round):
                load -= (v[i] @ along) ** 2 / one.reach
            if rebound < load * machine.dt:
                leave(i, t)
            else:
                predict(i, (surface,), 1 if rebound > 0.0 else 2)
        _look_out(machine, t, x, v, since, here, entry, fall)


class Likeness(NamedTuple):
    """A recording beside `first_impacts`: how many impacts were alike, what was not."""

    alike: int
    time: float
    """Largest difference of times, s."""
    approach: float
    """Largest difference of approach speeds, m/s; of impacts with surfaces."""
    unlike: list[tuple[int, Impact | None, Impact | None]]
    """Particle, what was expected, what came: the first difference of each particle."""
    unknown: int
    """Particles that met one that the reference did not follow any more."""


def likeness(found, recording, most=3, tolerance=1e-10):
    """Lay the first impacts of each particle beside a recording's.

    An impact is alike if its partner is the same and its time within `tolerance`, s. A particle
    counts up to where the reference stops following it, or it meets one that is followed no more.
    """
    own = _impacts_of(recording)
    known, places = found.followed.copy(), [0] * len(own)
    alike, times, approaches, unlike, unknown = 0, [0.0], [0.0], [], 0
    # All of them: what a particle does after its first ones, others may feel.
    for t, i in sorted((one.t, i) for i, each in enumerate(own) for one in each):
        if t > known[i] + tolerance:
            continue
        k = places[i]
        places[i] += 1
        one, expected = own[i][k], found.of[i][k] if k < len(found.of[i]) else None
        if isinstance(one.partner, int) and t > known[one.partner] + tolerance:
            known[i] = t
            unknown += k < most
        elif expected is None or expected.partner != one.partner or abs(expected.t - t) > tolerance:
            known[i] = t
            if k < most:
                unlike.append((i, expected, one))
        elif k < most:
            alike += 1
            times.append(abs(expected.t - t))
            if isinstance(one.partner, str):
                approaches.append(abs(expected.approach - one.approach))
    for i, expected in enumerate(found.of):
        # What was expected and never came.
        if places[i] < min(most, len(expected)) and expected[places[i]].t < known[i] - tolerance:
            unlike.append((i, expected[places[i]], None))
    return Likeness(alike, max(times), max(approaches), unlike, unknown)


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


def _solids(machine, r):
    s, wheel = machine.segments, machine.pulley
    faces, rounds = [], []
    lefts = np.stack([-s.tangent[:, 1], s.tangent[:, 0]], axis=1)
    ends = (s.start, s.start + s.length[:, None] * s.tangent)
    for k in range(len(s.length)):
        material = float(s.restitution[k]), float(s.friction[k]), int(s.surface[k])
        speed = float(s.speed[k])
        faces.append(_Face(s.start[k], s.tangent[k], s.length[k], lefts[k], speed, *material))
        for end, sign in zip(ends, (-1.0, 1.0), strict=True):
            if wheel is not None and k == 0 and sign > 0.0:
                continue  # inside the pulley
            # At a joint of one surface the rim joins both faces: their left normals' sum.
            near = [
                m for m in range(len(s.length)) if s.surface[m] == s.surface[k]
                and any(hypot(*(other[m] - end[k])) <= SAME for other in ends)
            ]  # fmt: skip
            left = lefts[near].sum(axis=0)
            outward = sign * s.tangent[k]
            rounds.append(_Round(end[k], r, left, speed, *material, k, outward))
    if wheel is not None:
        material = wheel.restitution, wheel.friction, wheel.surface
        nothing = np.zeros(2)
        reach = wheel.radius + r
        rounds.append(_Round(nothing, reach, nothing, wheel.speed, *material, -1, nothing))
    return faces, rounds


def _entries(machine):
    """Return when and where each disk is free, how fast, and whether it was carried until then."""
    start, g = machine.releases, machine.gravity
    t, place, course = start.t.copy(), start.position.copy(), start.velocity.copy()
    for i in np.flatnonzero(start.carried):
        (along, rho), speed = start.position[i], start.velocity[i, 0]
        angle = acos(min(1.0, speed**2 / (g * rho))) if g > 0.0 else 0.0
        t[i] += (rho * angle - along) / speed
        place[i] = rho * sin(angle), rho * cos(angle)
        course[i] = speed * cos(angle), -speed * sin(angle)
    return t, place, course, start.carried


def _look_out(machine, t, x, v, since, here, entry, fall):
    """Raise if a free disk is where a carried one is now."""
    start, r = machine.releases, machine.particle.radius
    on = np.flatnonzero(start.carried & (start.t <= t) & (entry > t))
    free = np.flatnonzero(here)
    if not machine.interact or not len(on) or not len(free):
        return
    way = start.position[on, 0] + start.velocity[on, 0] * (t - start.t[on])
    rho = start.position[on, 1]
    angle = np.maximum(way, 0.0) / rho
    held = np.stack([np.minimum(way, 0.0) + rho * np.sin(angle), rho * np.cos(angle)], axis=1)
    h = (t - since[free])[:, None]
    loose = x[free] + h * v[free] + 0.5 * h * h * fall
    if (np.hypot(*(held[:, None] - loose).transpose(2, 0, 1)) < 2.0 * r * (1.0 - SAME)).any():
        raise ValueError(f"a free disk is in the way of a carried one at {t} s")


def _touched(faces, rounds, x, v, r, carried):
    """Return the solids that a disk touches at its release, and the order in which it leaves them.

    Off the pulley the gap begins with t² at its top and with t³ beyond: g v sin φ t³ + g² t⁴/4.
    """
    touched = [
        k for k, one in enumerate(faces) if abs(abs((x - one.start) @ one.left) - r) <= SAME
        and -SAME <= (x - one.start) @ one.tangent <= one.length + SAME
    ]  # fmt: skip
    touched += [
        len(faces) + k
        for k, one in enumerate(rounds)
        if abs(hypot(*(x - one.center)) - one.reach) <= SAME
    ]
    return touched, (3 if carried and v[1] < 0.0 else 2)


def _first(coefficients, order, gap, rate, inside):
    """Return the first root of a gap that closes there, polished on the gap itself; inf if none."""
    roots = polynomial.polyroots(np.trim_zeros(coefficients[order:], "b"))
    near = roots[np.abs(roots.imag) <= REAL * (1.0 + np.abs(roots.real))].real
    for t in np.sort(near[near > 0.0]):
        for _ in range(4):
            if rate(t) < 0.0 and t > 0.0:
                t -= gap(t) / rate(t)
        if t > 0.0 and rate(t) < 0.0 and abs(gap(t)) <= 1e-11 and inside(t):
            return t
    return inf


def _meet_face(face, x, v, a, r, order):
    height, rate, pull = ((vector @ face.left) for vector in (x - face.start, v, a))
    best = inf
    for side in (1.0, -1.0):
        c = [side * height - r, side * rate, 0.5 * side * pull]
        # Never twice at once: the face that it touches is left, or slid along.
        touching = order if order and abs(c[0]) <= SAME else 0
        c[:touching] = [0.0] * touching

        def gap(t, c=c):
            return c[0] + t * (c[1] + t * c[2])

        def rate_(t, c=c):
            return c[1] + 2.0 * t * c[2]

        def beside(t):
            foot = (x + t * v + 0.5 * t * t * a - face.start) @ face.tangent
            return 0.0 <= foot <= face.length

        if len(np.trim_zeros(c[touching:], "b")) > 1:
            best = min(best, _first(np.array(c), touching, gap, rate_, beside))
    return best


def _meet_round(one, x, v, a, r, order):
    d = x - one.center
    distance = hypot(*d)
    c = np.array(
        [
            (distance - one.reach) * (distance + one.reach),
            2.0 * d @ v, v @ v + d @ a, v @ a, 0.25 * a @ a,
        ]
    )  # fmt: skip
    c[:order] = 0.0
    if len(np.trim_zeros(c[order:], "b")) < 2:
        return inf

    def gap(t):
        if order:
            # What is left is too small to be told from the distance.
            return polynomial.polyval(t, c) / (2.0 * one.reach)
        return hypot(*(d + t * v + 0.5 * t * t * a)) - one.reach

    def rate(t):
        if order:
            return polynomial.polyval(t, polynomial.polyder(c)) / (2.0 * one.reach)
        there = d + t * v + 0.5 * t * t * a
        return there @ (v + t * a) / hypot(*there)

    def beyond(t):
        return one.segment < 0 or (d + t * v + 0.5 * t * t * a) @ one.outward > 0.0

    return _first(c, order, gap, rate, beyond)


def _contact(one, x):
    """Return normal and speed of the surface along the tangent; round an end v s, see there."""
    if isinstance(one, _Face):
        side = copysign(1.0, (x - one.start) @ one.left)
        return side * one.left, side * one.speed
    n = (x - one.center) / hypot(*(x - one.center))
    return n, one.speed if n @ one.left >= 0.0 else -one.speed


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
        for depth in surface_depths(machine, x, r, t).values()
    )


def surface_depths(machine, x, r, t):
    """Return how deep (m) disks (k, 2), (k,) are in what is there at a time (s).

    By numbers of segments and, from there on, of arcs; and in the pulley.
    """
    s, found = machine.segments, {}
    for k in np.flatnonzero((s.appears <= t) & (t < s.vanishes)).tolist():
        d = x - s.start[k]
        d = d - np.clip(d @ s.tangent[k], 0.0, s.length[k])[:, None] * s.tangent[k]
        found[k] = r - np.hypot(*d.T)
    a = machine.arcs
    for k in np.flatnonzero((a.appears <= t) & (t < a.vanishes)).tolist():
        # The nearest point is where the ray from the centre meets the arc, or else an end: the
        # angle from the arc's middle, 0 to pi, clipped to half of its extent.
        d, middle = x - a.center[k], a.begin[k] + 0.5 * a.extent[k]
        angle = np.angle((d[:, 0] + 1j * d[:, 1]) * np.exp(-1j * middle))
        angle = middle + np.clip(angle, -0.5 * a.extent[k], 0.5 * a.extent[k])
        nearest = a.radius[k] * np.stack([np.cos(angle), np.sin(angle)], axis=-1)
        found[len(s.length) + k] = r - np.hypot(*(d - nearest).T)
    if machine.pulley is not None:
        found["pulley"] = machine.pulley.radius + r - np.hypot(*x.T)
    return found


def free_from(recording, carried):
    """Return the time (s) from which each disk is not carried by adhesion, inf if always."""
    free = np.where(carried, inf, -inf)
    for event in recording.select(Kind.SEPARATION)[::-1]:
        if carried[event["particle"]]:
            free[event["particle"]] = event["t"]
    return free


def _free(recording, times):
    """Yield each time, and places (k, 2) and radii (k,) of who is there then, and not carried."""
    free = free_from(recording, recording.machine.releases.carried)
    times, r = np.atleast_1d(times), np.broadcast_to(recording.particle.radius, recording.count)
    for some in np.array_split(times, max(1, len(times) // 100)):
        for t, x in zip(some, recording.at(some)[0], strict=True):
            there = np.isfinite(x[:, 0]) & (free <= t)
            yield t, x[there], r[there]
