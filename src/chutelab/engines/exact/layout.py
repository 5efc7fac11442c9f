"""The surfaces of a machine laid out as `Obstacles`."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
from sys import float_info
from typing import Any

import numpy as np

from chutelab.engines.exact.obstacles import (
    COLLINEAR,
    FOOT,
    NONE,
    Obstacles,
    dot,
)
from chutelab.machine import Machine
from chutelab.util.arrays import Bools, Floats, Ints

JOINT = 1e-12
"""Share of the scene's size within which two ends are one joint."""

TOUCH_ULPS = 256.0
"""Rounding of a coordinate, in units of the last place of the scene's size: closer is touching."""

NEVER = np.empty(0)
"""Changes of a machine without gates."""

BOX_TOUCHES = 64.0
"""Width, in `Obstacles.touch`, by which the boxes of faces are larger than they need be."""


@dataclass(frozen=True, eq=False)
class Bends:
    """The A arcs of a machine, the O with ends first; n is 1 or the number of particles."""

    center: Floats  # (2, A, n), m
    shape: Floats  # (3, A, n): radius (m), first angle and extent counterclockwise (rad)
    order: Ints  # (A,), their numbers in the machine
    open: int  # O

    @classmethod
    def of(cls, machine: Machine) -> Bends:
        """Sort the arcs of a machine."""
        arcs = machine.arcs
        if not len(arcs.surface):
            return STRAIGHT
        whole = np.atleast_2d(arcs.whole)[0]
        order = np.argsort(whole, kind="stable")
        shape = np.stack([_scalars(array) for array in (arcs.radius, arcs.begin, arcs.extent)])
        shape[2] = np.minimum(shape[2], 2.0 * np.pi)
        open_ = len(whole) - int(np.count_nonzero(whole))
        return cls(_vectors(arcs.center)[:, order], shape[:, order], order, open_)

    @property
    def ends(self) -> tuple[Floats, Floats]:
        """First and second ends, seen clockwise, of those that have any, (2, O, n) each, m."""
        radius, begin, extent = self.shape[:, : self.open]
        center = self.center[:, : self.open]
        first, second = (center + radius * _out(angle) for angle in (begin + extent, begin))
        return first, second


STRAIGHT = Bends(np.empty((2, 0, 1)), np.empty((3, 0, 1)), np.empty(0, dtype=np.int64), 0)
"""No arcs."""


def _out(angle: Floats) -> Floats:
    """Return directions at angles (...) from the x axis, (2, ...)."""
    return np.stack([np.cos(angle), np.sin(angle)])


def obstacles(machine: Machine, far: float = 0.0) -> Obstacles:
    """Resolve the surfaces of a machine, moved here from that far away (m), into obstacles.

    How pieces join, and whether particles are points, is read off the first row where each
    particle has its own: see `chutelab.engines.exact.kinds`. Of segments that
    lie on each other the first one counts, as it does when two are met at once.
    """
    seg, wheel = machine.segments, machine.pulley
    radius = np.atleast_1d(machine.particle.radius)
    tangent, length = _vectors(seg.tangent), _scalars(seg.length)
    bends = Bends.of(machine)
    corners = corners_of(machine, bends)
    size = size_of(corners, bends, machine.releases.position)
    touch = touch_of(size, far)
    near = JOINT * size
    widest = touch if touch.shape[-1] == corners.shape[-1] else touch.max()
    on = beginnings(machine, bends, corners[..., :1], near[:1])
    if on:
        return obstacles(_cut(machine, corners, list(on), near[0].item()), far)
    spots = spots_of(corners[..., 0], near[0].item())
    came, went, changes = seg.appears, seg.vanishes, NEVER
    if len(bends.order):
        came = np.concatenate([came, machine.arcs.appears])
        went = np.concatenate([went, machine.arcs.vanishes])
    if np.count_nonzero(np.isinf(came)) + np.count_nonzero(np.isinf(went)) < 2 * len(came):
        times = np.concatenate([came, went])
        changes = np.unique(times[np.isfinite(times)])
    seen: dict[tuple[object, ...], int] = {}
    for s, pair in enumerate(spots[: len(length)]):
        # A gate that shuts again is there twice, at different times.
        window = (came[s], went[s]) if len(changes) else ()
        seen.setdefault((frozenset(pair), *window), s)
    kept = list(seen.values())
    if len(kept) < len(length):
        pieces = [*kept, *range(len(length), len(spots))]
        corners = corners[:, [*pieces, *(s + len(spots) for s in pieces)]]
        spots, tangent, length = [spots[s] for s in pieces], tangent[:, kept], length[kept]
    flat, arcs = len(length), len(bends.order)

    owner = [*kept, *(len(seg.surface) + bends.order).tolist()]
    first_to_stay = list(range(len(spots)))
    if len(changes):
        stays = (np.isinf(came) & np.isinf(went))[owner]
        first_to_stay.sort(key=lambda s: not stays[s])
    # Each place where pieces of disks end is a circle; a point meets it with probability zero. An
    # end that lies on an arc, or that of the belt on the pulley, cannot be met.
    rests = np.full((len(spots), 2), NONE)
    if arcs:
        for arc, lie in enumerate(resting(corners, bends, near)):
            if not len(changes) or stays[flat + arc]:
                rests[lie[..., 0].reshape(2, -1).T] = arc
    if wheel is not None:
        rests[0, 1] = arcs
    known: dict[int, int] = {}
    ends: list[tuple[int, int]] = []
    end_circle = np.full((flat + arcs, 2), NONE)
    for s in first_to_stay if radius[0] > 0.0 else ():
        for e, spot in enumerate(spots[s]):
            if rests[s, e] != NONE:
                continue
            if spot not in known:
                known[spot] = flat + len(ends)
                ends.append((s, e))
            end_circle[s, e] = known[spot]
    where = [s + e * len(spots) for s, e in ends]
    own = [*owner[:flat], *(owner[s] for s, _ in ends), *owner[flat:], *owner[flat:]]
    center = [corners.take(np.array(where, dtype=np.int64), axis=1)]
    rho = [radius[None].repeat(len(ends), axis=0)]
    if arcs:
        room = bends.shape[0] - radius
        center += [bends.center, bends.center]
        rho += [bends.shape[0] + radius, np.where(room > widest, -room, np.nan)]
    if wheel is not None:
        center.append(np.zeros((2, 1, 1)))
        rho.append(np.asarray(wheel.radius + radius).reshape(1, -1))
        # It takes the first segment's values until its own are put in.
        own.append(0)
    centers, rhos, which = joined(center, 1), joined(rho, 0), np.array(own, dtype=np.int64)
    material = _materials(machine).take(which, axis=1)
    surface = np.concatenate([seg.surface, machine.arcs.surface]).take(which)
    first, pulley = flat + len(ends), NONE
    if wheel is not None:
        pulley, surface[-1] = first + 2 * arcs, wheel.surface
        for row, value in enumerate((wheel.speed, wheel.restitution, wheel.friction)):
            several = isinstance(value, np.ndarray)
            material[row, -1] = _of_kind(machine, value) if several else value
    start, stop = corners[:, :flat], corners[:, len(spots) : len(spots) + flat]
    faces = np.empty((2, 4, flat, 1, length.shape[1]))
    faces[0, 0], faces[1, 0] = -tangent[1][:, None], tangent[0][:, None]
    faces[:, 1, :, 0], faces[:, 2, :, 0] = tangent, start
    over = FOOT * length[:, None]
    faces[0, 3], faces[1, 3] = -over, over + length[:, None]
    # A circle's box is smaller, met from outside: what only touches it does not meet it.
    beside, inner = radius + BOX_TOUCHES * widest, np.abs(rhos - widest)
    low = [np.minimum(start, stop) - beside, centers - inner]
    high = [np.maximum(start, stop) + beside, centers + inner]
    if arcs:
        # A particle does not fit inside such a narrow arc.
        low[1] = np.where(np.isnan(low[1]), np.inf, low[1])
        high[1] = np.where(np.isnan(high[1]), -np.inf, high[1])
    present, vanishes = np.ones((len(changes) + 1, len(which)), dtype=bool), went.take(which)
    if len(changes):
        since = np.concatenate([[-np.inf], changes])[:, None]
        there = (came <= since) & (went > since)
        present = there[:, which]
        # A shared end exists while any of its pieces exists.
        for s, e in np.argwhere(end_circle != NONE).tolist():
            present[:, end_circle[s, e]] |= there[:, owner[s]]
    span = np.empty((2, 0, 1))
    if bends.open:
        span = np.zeros((2, *centers.shape[1:]))
        span[1] = 2.0 * np.pi
        span[:, first - flat : first - flat + 2 * arcs] = np.tile(bends.shape[1:], (1, 2, 1))
    return Obstacles(
        faces=faces,
        length=length,
        center=centers,
        rho=rhos,
        span=span,
        bend=bends.shape,
        material=material,
        low=joined(low, 1),
        high=joined(high, 1),
        surface=surface,
        spots=tuple(spots),
        rests=rests,
        end_circle=end_circle,
        first_arc=first,
        pulley=pulley,
        touch=touch,
        changes=changes,
        present=present,
        vanishes=vanishes,
    )


def joined(parts: Sequence[Floats], axis: int) -> Floats:
    """Join arrays along an axis; along the last one, one column stands for all."""
    try:
        return np.concatenate(parts, axis)
    except ValueError:
        most = max(part.shape[-1] for part in parts)
        alike = [part if part.shape[-1] == most else part.repeat(most, axis=-1) for part in parts]
        return np.concatenate(alike, axis)


def _of_kind(machine: Machine, values: Floats) -> Floats:
    """Return values of each particle, (N, ...), from those of each kind, (K, ...)."""
    return values if machine.segments.start.ndim == 3 else values[machine.releases.kind]


def _materials(machine: Machine) -> Floats:
    """Return `Obstacles.material` of all segments and then all arcs, (3, S + A, n)."""
    parts = []
    for part in (
        (machine.segments, machine.arcs) if len(machine.arcs.surface) else (machine.segments,)
    ):
        rows = part.speed, part.restitution, part.friction
        each = (row if row.ndim == 1 else _of_kind(machine, row) for row in rows)
        parts.append(joined([_scalars(row)[None] for row in each], 0))
    return joined(parts, 1)


def corners_of(machine: Machine, bends: Bends) -> Floats:
    """Return all first ends of the P pieces that have any, then all second ones, (2, 2 P, n), m."""
    segments = machine.segments
    ends = [_vectors(segments.start), _vectors(segments.end)]
    if bends.open:
        first, second = bends.ends
        ends = [ends[0], first, ends[1], second]
    return np.concatenate(ends, axis=1)


def size_of(corners: Floats, bends: Bends, places: Floats) -> Floats:
    """Return the largest coordinate that each particle meets, m, (n,); n is 1 if all have one.

    It is that of the surfaces and of the particle's own release: of no other particle's.
    """
    # Not their methods, which take twice as long.
    size = np.maximum.reduce(np.abs(corners), axis=(0, 1), initial=0.0)
    if len(bends.order):
        size = np.maximum(size, (np.abs(bends.center) + bends.shape[0]).max(axis=(0, 1)))
    size = np.maximum(size, np.maximum.reduce(np.abs(places), axis=1))
    several = corners.shape[-1] > 1 or np.count_nonzero(size != size[0])
    return np.asarray(size if several else size[:1])


def touch_of(size: Floats, far: float = 0.0) -> Floats:
    """Return `Obstacles.touch` of a scene of a size, counted from a point that far away, m."""
    # Far away the scene's own numbers are rounded, each by half a last place.
    return float_info.epsilon * (TOUCH_ULPS * size + far)


def _vectors(array: Floats) -> Floats:
    """(S, 2) or (N, S, 2) to (2, S, n)."""
    return np.array(array, ndmin=3).T.copy()


def _scalars(array: Floats) -> Floats:
    """(S,) or (N, S) to (S, n)."""
    return np.array(array, ndmin=2).T.copy()


def ahead_of(machine: Machine, bends: Bends) -> Floats:
    """Return the directions out of the pieces at those ends, (2, 2 P, n)."""
    along = _vectors(machine.segments.tangent)
    if bends.open:
        _, begin, extent = bends.shape[:, : bends.open]
        (x, y), (u, v) = _out(begin + extent), _out(begin)
        return np.concatenate([-along, np.stack([-y, x]), along, np.stack([v, -u])], axis=1)
    return np.concatenate([-along, along], axis=1)


def curvatures_of(machine: Machine, bends: Bends) -> Floats:
    """Return the curvatures of the pieces at those ends, seen from there, to the left, (2 P, n)."""
    straight = np.zeros((len(machine.segments.surface), 1))
    bent = 1.0 / bends.shape[0, : bends.open]
    return joined([straight, -bent, straight, bent], 0)


def beginnings(
    machine: Machine, bends: Bends, ends: Floats, near: Floats
) -> dict[tuple[int, int], Bools]:
    """Tell which of the ends (2 P, n) lie inside a segment and are tangent to it, each (n,).

    By the numbers of segment and end; those that none of the rows has are left out. What the
    incoming belt carries comes to nothing that begins on it.
    """
    pieces, segments = ends.shape[1] // 2, len(machine.segments.surface)
    found: dict[tuple[int, int], Bools] = {}
    starts, stops = ends[:, :segments], ends[:, pieces : pieces + segments]
    low, high, least, most = np.minimum(starts, stops), np.maximum(starts, stops), ends, ends
    if ends.shape[-1] > 1:
        low, high = low.min(axis=-1)[:, :, None], high.max(axis=-1)[:, :, None]
        least, most = ends.min(axis=-1), ends.max(axis=-1)
    reach = near.max()
    inside = (most.reshape(2, 1, -1) >= low - reach) & (least.reshape(2, 1, -1) <= high + reach)
    inside = inside[0] & inside[1]
    # Most have none but their own two ends inside.
    if np.count_nonzero(inside) == 2 * segments:
        return found
    own = np.arange(segments)
    inside[own, own] = inside[own, pieces + own] = False
    if machine.pulley is not None:
        inside[0] = False
    ahead = ahead_of(machine, bends)[..., : ends.shape[-1]]
    for s, end in zip(*(number.tolist() for number in inside.nonzero()), strict=True):
        away, tangent, outward = ends[:, end] - starts[:, s], ahead[:, pieces + s], ahead[:, end]
        foot, length = dot(away, tangent), dot(stops[:, s] - starts[:, s], tangent)
        on = np.abs(tangent[0] * away[1] - tangent[1] * away[0]) <= near
        on &= (foot > near) & (foot < length - near)
        on &= np.abs(tangent[0] * outward[1] - tangent[1] * outward[0]) <= COLLINEAR
        if on.any():
            found[s, end] = on
    return found


def _cut(machine: Machine, ends: Floats, places: Sequence[tuple[int, int]], near: float) -> Machine:
    """Cut segments where other pieces begin on them: there three join."""
    segments = machine.segments
    starts, tangents = _vectors(segments.start), _vectors(segments.tangent)
    which: list[int] = []
    feet: list[tuple[Floats, Floats]] = []
    for s, length in enumerate(_scalars(segments.length)):
        at = [dot(ends[:, end] - starts[:, s], tangents[:, s]) for on, end in places if on == s]
        at = [np.zeros(1), *sorted(at, key=lambda foot: float(foot[0])), length]
        for low, high in pairwise(at):
            if (high - low)[0] > near:
                which.append(s)
                feet.append((low, high))
    low, high = (joined([pair[n][None] for pair in feet], 0) for n in (0, 1))
    start = starts[:, which] + low * tangents[:, which]
    own: dict[str, Any] = {
        name: array.take(which, axis=-1)
        for name, array in vars(segments).items()
        if name not in ("start", "tangent", "length")
    }
    several = segments.start.ndim == 3
    own["start"], own["length"] = start.T, (high - low).T
    own["tangent"] = segments.tangent.take(which, axis=-2)
    if not several:
        own["start"], own["length"] = own["start"][0], own["length"][0]
    return replace(machine, segments=replace(segments, **own))


def resting(corners: Floats, bends: Bends, near: Floats) -> Iterator[Bools]:
    """Yield of each arc which ends (2 P, n) lie on it, but not where it ends."""
    arcs = zip(bends.center.swapaxes(0, 1), bends.shape.swapaxes(0, 1), strict=True)
    for center, (radius, begin, extent) in arcs:
        x, y = corners - center[:, None]
        on = np.abs(np.hypot(x, y) - radius) <= near
        if on.any():
            turn = np.mod(np.arctan2(y, x) - begin, 2.0 * np.pi)
            edge = np.where(extent < 2.0 * np.pi, near / radius, 0.0)
            on &= (turn >= edge) & (turn <= extent - edge)
        yield on


def spots_of(ends: Floats, tolerance: float) -> list[tuple[int, int]]:
    """Return numbers of the places where segments begin and end; within the tolerance one place.

    `ends` is (2, 2 S): all the first ones, then all the second ones.
    """
    x, y = ends.tolist()
    count = len(x) // 2
    number = list(range(2 * count))
    window: list[int] = []
    for n in sorted(number, key=x.__getitem__):
        while window and x[n] - x[window[0]] > tolerance:
            del window[0]
        for m in window:
            if abs(y[n] - y[m]) <= tolerance:
                number[n] = number[m]
                break
        window.append(n)
    return list(zip(number[:count], number[count:], strict=True))
