"""The evidence and the verdict of a law; the laws on places and on impacts.

No particle is beyond a surface or inside another particle; impacts obey friction and restitution.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from functools import cached_property
from math import inf
from operator import itemgetter
from typing import Any

import numpy as np
from numpy.typing import NDArray

from chutelab.core import number
from chutelab.machine import Machine, Mover, Pieces, apart, placed
from chutelab.results import Kind, Recording
from chutelab.results.laws import Findings, alike, examine, inner_radius
from chutelab.util.arrays import Bools, Floats, Ints

EPS: float = number("EPS")

PRESSED: float = number("PRESSED")
"""Share of the radius by which disks of a crowd may overlap each other or a surface; the contact
engine promises this. An iterative solver leaves some overlap."""

A_CONTACT: int = number("A_CONTACT")
"""Rounding of an energy in one contact, in eps: half an ulp for each of two velocity components, a
height and a sum."""

ROUNDINGS: int = number("ROUNDINGS")
"""Roundings of one number between two contacts: some ten operations on numbers up to ten times as
large as the result."""

ON_ARCS: float = number("ON_ARCS")
"""Share of its radius by which a cubic between two knots may leave a circle: the recording's
contract."""


@dataclass(frozen=True, eq=False)
class Evidence:
    """One run: the scene, resolved, and what an engine made of it."""

    recording: Recording

    @property
    def machine(self) -> Machine:
        """What was run."""
        return self.recording.machine

    @property
    def dt(self) -> float | None:
        """Its step, s; None for the exact engine."""
        return self.machine.step_of(self.recording.engine) or None

    @property
    def alike(self) -> bool:
        """Whether Chipmunk finds and solves all contacts, in steps of equal length."""
        return alike(self.recording)

    @cached_property
    def radii(self) -> Floats:
        """Radius of each particle, (N,), m; for one with corners that of the inner circle."""
        return self._of_each(inner_radius(self.machine))

    @cached_property
    def masses(self) -> Floats:
        """Mass of each particle, (N,), kg."""
        return self._of_each(self.machine.particle.mass)

    @cached_property
    def inertias(self) -> Floats:
        """Moment of inertia of each particle, (N,), kg m²."""
        return self._of_each(self.machine.particle.inertia)

    def _of_each(self, value: Any) -> Floats:
        return np.broadcast_to(np.asarray(value, dtype=float), self.recording.count)

    @cached_property
    def radius(self) -> float:
        """Radius of the largest particle, m."""
        return float(np.max(self.machine.particle.radius))

    @cached_property
    def cornered(self) -> Bools:
        """Which particles have corners, (N,)."""
        kinds = np.array([outline is not None for outline in self.machine.outlines])
        return kinds[self.machine.releases.kind]

    def meet(self, i: Any, j: Any) -> Bools:
        """Whether particles i and j, numbers or (k,), do not pass through each other."""
        kind = self.machine.releases.kind
        return np.asarray(self.machine.pair_restitution[kind[i], kind[j]] >= 0.0)

    @cached_property
    def movers(self) -> dict[int, Mover]:
        """What moves, by the index of its surface."""
        return {mover.surface: mover for mover in self.machine.movers}

    def outline(self, particle: int, t: float, place: Floats) -> tuple[Floats, float]:
        """Return the corners of a particle, (n, 2), m, and 0; of a disk the centre and radius."""
        corners = self.machine.outlines[self.machine.releases.kind[particle]]
        if corners is None:
            return place[None], float(self.radii[particle])
        return placed(corners, place, self.recording.at([t]).angle[0, particle]), 0.0

    def seen_from(self, piece: Pieces, times: Any, places: Floats) -> Floats:
        """Return places (..., 2), m, at times (...,), s, where a piece is as written.

        Of a piece that moves these are the places that turn and travel with it.
        """
        mover = self.movers.get(int(piece.surface))
        return places if mover is None else mover.at_rest(places, times)

    @cached_property
    def energies(self) -> tuple[Floats, Floats]:
        """Kinetic and potential energy at each knot, (K,), J."""
        return self.recording.energies(self.recording.knots, self.recording.owner)

    @cached_property
    def found(self) -> Findings:
        """Findings of the laws of every run, see `results.laws`."""
        return examine(self.recording)

    @property
    def bounds(self) -> Any:
        """Sizes of numbers in the run, and bounds, by the names of the core's `Laws` (layout.h)."""
        return self.found.figures


@dataclass(frozen=True)
class Verdict:
    """What a law found."""

    figure: float  # the worst value
    bound: float  # its upper bound
    detail: str = ""  # unit, and where it was
    law: str = ""
    unpromised: str = ""  # why the engine does not promise a law that is not kept; "" if it does

    @property
    def holds(self) -> bool:
        """Whether the law is kept; NaN never keeps it."""
        return self.figure <= self.bound

    @property
    def broken(self) -> bool:
        """Whether a promised law is not kept."""
        return not self.holds and not self.unpromised


def worst(found: Iterable[tuple[float, str]], bound: float, unit: str) -> Verdict:
    """Return the verdict on the largest of some figures, each with where it was; at least 0."""
    figure, where = max([(0.0, ""), *found], key=itemgetter(0))
    return Verdict(float(figure), bound, f"{unit}, {where}" if where else unit)


AT_SURFACES = (Kind.IMPACT, Kind.LANDING, Kind.STICK, Kind.SLIP, Kind.SETTLE)
"""Kinds of events at a surface, if one is named."""

INSTANTS, PLACES = 1000, 200_000
"""Most times at which pairs of particles are checked, and most places of all particles together."""

COLLISIONS = 300
"""Most collisions and releases at which this is done, too."""


def nothing_through(e: Evidence) -> Verdict | None:
    """No centre passes a surface between its ends; the figure counts the passages."""
    if not e.machine.pieces or not len(e.recording.knots):
        return None
    once = e.found.hits["passes"] == 1
    found = e.found.hits[once]
    return Verdict(len(found), 0.0, _first(e, "particle {} through {} at t = {:.6g} s", found))


def depth(e: Evidence) -> Verdict | None:
    """No disk overlaps a surface by more than rounding, or a step, allows; the figure is in m.

    It is 0 if all are proven to stay within that. Overlaps at the release are allowed to stay.
    """
    if not e.machine.pieces or not len(e.recording.knots):
        return None
    found = e.found.hits[np.argsort(-e.found.hits["depth"], kind="stable")]
    deepest = float(found["depth"].max(initial=0.0))
    return Verdict(
        deepest, e.bounds.allowed, f"m, {_first(e, 'particle {} in {} at t = {:.6g} s', found)}"
    )


def _first(e: Evidence, said: str, found: NDArray[Any]) -> str:
    if not len(found):
        return "none"
    one = found[0]
    return said.format(one["particle"], e.machine.names[one["piece"]], one["t"])


def overlap(e: Evidence) -> Verdict | None:
    """No two disks overlap by more than they approach in a step; the figure is in m."""
    if not e.machine.interact:
        return None
    found = []
    for now in np.concatenate([_instants(e), _few(e.recording.select(Kind.COLLISION))["t"]]):
        (position,), _ = e.recording.at([now])
        there = np.flatnonzero(np.isfinite(position[:, 0]))
        pairs = there[_neighbours(position[there, 0], 2.0 * e.radius)]
        deep, i, j = closest(position, e.radii, pairs[:, e.meet(*pairs)])
        if deep > 0.0:
            found.append((deep, f"particles {i} and {j} at t = {now:.6g} s"))
    return worst(found, e.bounds.rounding + 2.0 * e.bounds.late, "m")


def pressed(e: Evidence) -> Verdict | None:
    """No two disks overlap for longer than a step; the figure is a share of the radius.

    It is the least overlap of a pair at two times a step apart. Chipmunk removes overlaps over
    several steps, a fifth in a millisecond, so it promises no duration: there the bound is that of
    `overlap`.
    """
    if not e.machine.interact or e.dt is None:
        return None
    found = []
    for now, (i, j), before, after in _pairs(e, e.dt):
        apart = np.maximum(np.hypot(*before.T), np.hypot(*after.T))
        deep = (e.radii[i] + e.radii[j] - apart) / np.minimum(e.radii[i], e.radii[j])
        at = int(np.argmax(deep))
        found.append((deep[at], f"particles {i[at]} and {j[at]} at t = {now:.6g} s"))
    bound = PRESSED if e.recording.engine == "contact" else 2.0 * e.bounds.late / e.radii.min()
    return worst(found, bound, "r")


def nothing_through_another(e: Evidence) -> Verdict | None:
    """Slow disks do not pass through each other; the figure counts the pairs.

    Slow means that they approach by less than the smaller radius per step, so that an engine
    detects contact before one is inside the other. They pass if the centre of the smaller gets into
    the other.
    """
    if not e.machine.interact or e.dt is None:
        return None
    passed: dict[tuple[int, int], str] = {}
    for now, pairs, before, after in _pairs(e, e.dt):
        along = after - before
        way = np.hypot(*along.T)
        # Closest approach on the straight way of a step.
        share = -(before * along).sum(axis=1) / np.where(way > 0.0, way, 1.0) ** 2
        nearest = np.hypot(*(before + np.clip(share, 0.0, 1.0)[:, None] * along).T)
        small, large = np.sort(e.radii[pairs], axis=0)
        for a, b in np.sort(pairs.T[(way < small) & (nearest < large)]).tolist():
            passed.setdefault((a, b), f"pairs: {a} and {b} at t = {now:.6g} s")
    return Verdict(len(passed), 0.0, next(iter(passed.values()), "pairs"))


def _instants(e: Evidence) -> Floats:
    """Return times at which pairs are looked at, s: every step, or as many as are allowed."""
    t = e.recording.knots["t"]
    step = e.dt or np.ptp(t)
    most = min(INSTANTS, PLACES // max(1, e.recording.count))
    count = min(most, int(np.ptp(t) / step) + 1)
    return np.linspace(t.min(), t.max(), max(2, count))


def _few(events: NDArray[Any]) -> NDArray[Any]:
    return events[:: 1 + len(events) // COLLISIONS]


def _pairs(e: Evidence, dt: float) -> Iterator[tuple[float, Ints, Floats, Floats]]:
    """Yield times, pairs (2, k) in contact then or a step later, and b - a (k, 2) at both, m."""
    reach = 2.0 * e.radius
    for now in _instants(e):
        (first, last), _ = e.recording.at([now, now + dt])
        there = np.flatnonzero(np.isfinite(first[:, 0]) & np.isfinite(last[:, 0]))
        room = reach + 2.0 * np.abs(last[there] - first[there]).max(initial=0.0)
        i, j = pairs = there[_neighbours(first[there, 0], room)]
        before, after = first[j] - first[i], last[j] - last[i]
        touch = np.minimum(np.hypot(*before.T), np.hypot(*after.T)) < e.radii[i] + e.radii[j]
        touch &= e.meet(i, j)
        if touch.any():
            yield float(now), pairs[:, touch], before[touch], after[touch]


def _neighbours(x: Floats, room: float) -> Ints:
    """Return all pairs (2, k) whose x differ by less than `room`, m."""
    order = np.argsort(x, kind="stable")
    index = np.arange(len(x))
    ends = np.searchsorted(x[order], x[order] + room)
    left = np.repeat(index, np.maximum(ends - index - 1, 0))
    right = left + 1 + np.arange(len(left)) - np.searchsorted(left, left)
    return order[np.stack([left, right])]


def closest(position: Floats, radius: Floats, pairs: Ints | None = None) -> tuple[float, int, int]:
    """Deepest overlap of disks (n, 2) and (n,), m, and of which two; negative if there is none.

    `pairs`, (2, k), are those that are looked at; default: all.
    """
    i, j = _neighbours(position[:, 0], 2.0 * radius.max(initial=0.0)) if pairs is None else pairs
    if not len(i):
        return -inf, 0, 0
    deep = radius[i] + radius[j] - np.hypot(*(position[j] - position[i]).T)
    at = int(np.argmax(deep))
    return float(deep[at]), int(i[at]), int(j[at])


def on_something(e: Evidence) -> Verdict | None:
    """Each impact lies on the surface, or the particle, that it names.

    The figure is the largest distance of the particle in an event from what the event names, m.
    Where many particles meet, or have corners, only some of their impacts are looked at.
    """
    surfaces, found, late = e.machine.surfaces, [], e.dt or 0.0
    events = e.recording.select(*AT_SURFACES)
    surface = events["surface"]
    events = events[(surface >= 0) & (surface < len(surfaces))]
    angular = e.cornered[events["particle"]]
    events = np.concatenate([events[~angular], _few(events[angular])])
    if len(events):
        off = np.full((len(surfaces), len(events)), inf)
        whose, when, where = events["particle"], events["t"], events["position"]
        outlines = {
            n: e.outline(whose[n], when[n], where[n])[0] for n in np.flatnonzero(e.cornered[whose])
        }
        for piece in e.machine.pieces:
            gap = np.abs(piece.gap(e.seen_from(piece, when, where), e.radii[whose]))
            for n, outline in outlines.items():
                gap[n] = piece.apart(e.seen_from(piece, when[n], outline))
            there = piece.there(when, late)
            row = off[piece.surface]
            row[there] = np.minimum(row, gap)[there]
        surface = events["surface"]
        far = off[surface, np.arange(len(events))]
        hit = events[np.argmax(far)]
        said = f"particle {hit['particle']} off {surfaces[hit['surface']]}"
        found.append((far.max(), f"{said} at t = {hit['t']:.6g} s"))
    for hit in _few(e.recording.select(Kind.COLLISION)):
        i, j, t = int(hit["particle"]), int(hit["other"]), float(hit["t"])
        (place,), _ = e.recording.at([t])
        (one, r), (other, s) = e.outline(i, t, hit["position"]), e.outline(j, t, place[j])
        # Without the partner it is NaN.
        far = np.nan_to_num(abs(apart(one, other) - r - s), nan=inf)
        found.append((far, f"particles {i} and {j} at t = {t:.6g} s"))
    if not found:
        return None
    b = e.bounds
    return worst(found, b.rounding + b.arcs + (2.0 if e.machine.interact else 1.0) * b.late, "m")


def released_free(e: Evidence) -> Verdict | None:
    """No particle is released inside another or a surface; the figure is how deep, m."""
    releases = e.recording.select(Kind.RELEASE)
    if not (e.machine.interact or len(e.machine.surfaces)) or not len(releases):
        return None
    found = []
    for piece, name in zip(e.machine.pieces, e.machine.names, strict=True):
        there = releases[piece.there(releases["t"])]
        if len(there):
            place = e.seen_from(piece, there["t"], there["position"])
            gap = piece.gap(place, e.radii[there["particle"]])
            at = int(np.argmin(gap))
            found.append((-gap[at], f"particle {there['particle'][at]} in {name}"))
    for event in _few(releases) if e.machine.interact else ():
        (place,), _ = e.recording.at([event["t"]])
        apart = np.nan_to_num(np.hypot(*(place - event["position"]).T), nan=inf)
        deep = e.radii[event["particle"]] + e.radii - apart
        deep[~e.meet(event["particle"], np.arange(len(deep)))] = -inf
        deep[event["particle"]] = -inf
        other = int(np.argmax(deep))
        where = f"particle {event['particle']} in {other} at t = {event['t']:.6g} s"
        found.append((deep[other], where))
    # A particle released in contact just behind another may overlap it by rounding.
    return worst(found, e.bounds.rounding, "m")


def settled_to_stay(e: Evidence) -> Verdict | None:
    """No particle counts as settled on a surface that will throw it off; the figure counts them.

    That is any moving surface except the outgoing belt.
    """
    m = e.machine
    settled = np.flatnonzero(e.recording.ended_by("settled"))
    settled = settled[np.diff(e.recording.offsets)[settled] > 0]
    if not len(settled):
        return None
    last = e.recording.knots[e.recording.offsets[settled + 1] - 1]
    near = e.bounds.rounding + ON_ARCS * e.radius + e.bounds.late
    thrown: dict[int, str] = {}
    for piece, name in zip(e.machine.pieces, e.machine.names, strict=True):
        if piece.speed != 0.0 and piece.surface != m.landing:
            place = e.seen_from(piece, last["t"], last["position"])
            on = piece.gap(place, e.radii[settled]) < near
            for i in settled[on & piece.there(last["t"])].tolist():
                thrown.setdefault(i, f"particles: {i} on {name}")
    return Verdict(len(thrown), 0.0, next(iter(thrown.values()), "particles"))


LEAST = 1e-12
"""Friction of two particles in the pymunk engine where the scene says 0: Chipmunk multiplies the
values of both shapes, and a factor 0 would be 0 against surfaces too."""


def cone(e: Evidence) -> Verdict | None:
    """No impact pulls; its tangential impulse is at most friction times its normal impulse.

    The figure is the excess as a share of the largest momentum m v. With corners an event is the
    sum of impulses with several normals, which only must not pull.
    """
    events = e.recording.select(Kind.IMPACT, Kind.LANDING, Kind.COLLISION)
    if not len(events):
        return None
    kinds, own, other = e.machine.releases.kind, events["particle"], events["other"]
    friction = e.machine.pair_friction[kinds[own], kinds[other]]
    if e.recording.engine == "pymunk":
        friction = np.maximum(friction, LEAST)
    alone = np.flatnonzero(other < 0)
    struck, _, _ = _struck(e, events[alone])
    friction[alone] = _of_pieces(e, events[alone], struck, "friction")
    rough = np.isinf(friction)
    rough |= e.cornered[own] | (e.cornered[other] & (other >= 0))
    normal, along = events["normal_impulse"], events["tangential_impulse"]
    along = np.abs(along)
    excess = np.where(rough, 0.0, along - np.where(rough, 0.0, friction) * normal)
    momentum = e.masses.max() * e.bounds.speed
    return _verdict(events, np.maximum(excess, -normal) / momentum, "of m v")


def rebound(e: Evidence) -> Verdict | None:
    """Judge whether speeds after impacts are the restitution times the speeds before.

    This applies to single impacts on surfaces at rest, so not to crowds and corners. With steps,
    an impact slower than the change of speed by gravity in a step may have any restitution up to 1,
    and the pymunk engine knows speeds only to that change. A mass point has no contact normal. The
    figure is the deviation as a share of the largest speed.
    """
    events = e.recording.select(Kind.IMPACT, Kind.LANDING)
    if e.alike or e.machine.interact or not e.radii.all():
        return None
    struck, away, touched = _struck(e, events)
    still = ~np.isin(events["surface"], list(e.movers)) & ~e.cornered[events["particle"]]
    events, struck, away = (of[(touched == 1) & still] for of in (events, struck, away))
    if not len(events):
        return None
    normal = away / np.hypot(*away.T)[:, None]
    before = (events["velocity_before"] * normal).sum(axis=1)
    after = (events["velocity_after"] * normal).sum(axis=1)
    due = -before * _of_pieces(e, events, struck, "restitution")
    rounding, pull = ROUNDINGS * EPS, e.machine.gravity * (e.dt or 0.0) / e.bounds.speed
    slow = (due <= pull * e.bounds.speed) & (after >= -rounding * e.bounds.speed)
    slow &= after <= np.maximum(-before, rounding * e.bounds.speed)
    off = np.where(slow, 0.0, np.abs(after - due)) / e.bounds.speed
    return _verdict(events, off, "of v", pull if e.recording.engine == "pymunk" else 0.0)


def _verdict(events: NDArray[Any], off: Floats, unit: str, more: float = 0.0) -> Verdict:
    off = np.nan_to_num(off, nan=inf)
    hit = events[int(np.argmax(off))]
    where = f"particle {hit['particle']} at t = {hit['t']:.6g} s"
    return worst([(float(off.max()), where)], ROUNDINGS * EPS + more, unit)


def _struck(e: Evidence, events: NDArray[Any]) -> tuple[Ints, Floats, Ints]:
    """Find the pieces that were struck in impacts on surfaces (c,).

    Return the number of the nearest piece of the named surface, (c,); the vector from there to the
    centre, m, (c, 2); and how many pieces of any surface were near enough to be touched, (c,).
    """
    best, touched = np.full(len(events), inf), np.zeros(len(events), dtype=int)
    struck, away = np.zeros(len(events), dtype=int), np.zeros((len(events), 2))
    near = e.bounds.rounding + e.bounds.arcs + e.bounds.late
    t, where, surface = events["t"], events["position"], events["surface"]
    radius = e.radii[events["particle"]]
    for n, piece in enumerate(e.machine.pieces):
        place = e.seen_from(piece, t, where)
        out, face = piece.away(place), piece.normal(place)
        # Beside a face the vector is along its normal; for small disks positions give it only
        # roughly.
        high = (out * face).sum(axis=1)[:, None] * face
        out = np.where((np.hypot(*(out - high).T) <= e.bounds.rounding)[:, None], high, out)
        off = np.abs(np.hypot(*out.T) - radius)
        off[~piece.there(t, e.dt or 0.0)] = inf
        touched += off <= near
        nearer = (surface == piece.surface) & (off < best)
        best[nearer], struck[nearer], away[nearer] = off[nearer], n, out[nearer]
    return struck, away, touched


def _of_pieces(e: Evidence, events: NDArray[Any], struck: Ints, name: str) -> Floats:
    """Return what pieces have with the particles that strike them, (c,)."""
    count = len(e.machine.pair_friction)
    # A row for each piece, a column for each kind of particles.
    values = np.array([np.broadcast_to(getattr(piece, name), count) for piece in e.machine.pieces])
    kinds = e.machine.releases.kind[events["particle"]]
    return np.asarray(values.reshape(-1, count)[struck, kinds])
