"""Wear: impacts and sliding along a surface, in pieces of equal length.

Impacts are taken from the events, with the velocity relative to the surface. The loss of lasting
contacts is the ledger's entry of the surface less that of its impacts. It is distributed along the
tracks that touch the surface, in proportion to the loss of each and its slip there. So the sums
over the pieces equal the ledger's; of several impacts at one instant, one may seem to give what
another takes. If a particle leans on several surfaces or rubs on others, its share is an estimate.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from math import inf, isfinite, nan
from typing import Final, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from chutelab.results.ledger import ledger
from chutelab.results.record import Record, hermite, kept
from chutelab.results.rows import Kind
from chutelab.util.arrays import Floats, Ints
from chutelab.util.errors import InputError, did_you_mean
from chutelab.util.tables import Sheet, Shown, number

PIECES: Final = 50
"""Default number of pieces of a surface, of equal length."""

MOST_PIECES: Final = 10_000
"""Most pieces of a surface, and most parts of an interval between two knots."""

BLOWS: Final = (Kind.IMPACT, Kind.LANDING)

TOUCH: Final = 0.05
"""Share of the radius; a particle that loses energy at a smaller gap counts as touching."""


def finnie(angle: ArrayLike) -> Floats:
    """Return f(γ) of Finnie's erosion, m k v² f(γ); γ between velocity and face, rad.

    sin 2γ - 3 sin² γ below tan γ = 1/3, and cos² γ / 3 above (I. Finnie, Wear 3 (1960) 87-103, with
    a ratio of 2 of the normal to the tangential force).
    """
    angle = np.asarray(angle, dtype=np.float64)
    flat = np.sin(2.0 * angle) - 3.0 * np.sin(angle) ** 2
    return np.asarray(np.where(np.tan(angle) < 1.0 / 3.0, flat, np.cos(angle) ** 2 / 3.0))


@dataclass(frozen=True, eq=False, repr=False)
class Wear(Shown):
    """Wear of a surface, piece by piece, until the end of the run.

    Attributes
    ----------
    name : str
        Of the surface.
    edges : ndarray, shape (P + 1,)
        Edges of the pieces, along the surface as in the scene, m; the drive pulley comes last,
        clockwise from its foremost point.
    places : ndarray, shape (P, 3, 2)
        First point, middle and last point of each, m; for moving surfaces as written in the scene.
    impact : ndarray, shape (P,)
        Energy lost along the normal, the ledger's restitution loss, J.
    sliding : ndarray, shape (P,)
        Slip heat of impacts and lasting contacts, the ledger's friction loss, J.
    erosion : ndarray, shape (P,)
        Finnie's: the sum of m v² f(γ) over impacts, J, with `finnie`; m³ with a coefficient k.
    abrasion : ndarray, shape (P,)
        Archard's: the sum of load times sliding distance, slip heat over µ, J; m³ with a
        coefficient. NaN if the surface has no friction: then the sliding distance is not recorded.
    unplaced : float
        Losses of lasting contacts for which no track was found on the surface, J.
    """

    name: str
    edges: Floats
    places: Floats
    impact: Floats
    sliding: Floats
    erosion: Floats
    abrasion: Floats
    unplaced: float

    def sheet(self, *, details: bool = False) -> Sheet:
        """Return the sums, and the places of the largest values."""
        rows = []
        for key in KEYS:
            values = getattr(self, key)
            most = int(np.argmax(values)) if values.any() and isfinite(values.sum()) else -1
            at = number(float(self.edges[most : most + 2].mean())) if most >= 0 else "-"
            rows.append((key, number(float(values.sum())), number(float(values.max())), at))
        return Sheet(f"Wear of {self.name}", ("", "sum", "largest", "at, m"), tuple(rows))


KEYS: Final = ("impact", "sliding", "erosion", "abrasion")


def worn(
    recording: Record,
    name: str,
    pieces: int = PIECES,
    *,
    erosion: float | None = None,
    abrasion: float | None = None,
) -> Wear:
    """Return the wear of a surface; see `Wear`.

    Parameters
    ----------
    recording : Record
        A run of one scene, not of a family.
    name : str
        Of the surface.
    pieces : int
        Number of pieces, of equal length.
    erosion, abrasion : float, optional
        Finnie's k, m³/J, and Archard's K/H, 1/Pa: volumes instead of relative numbers.

    Raises
    ------
    InputError
        If there is no such surface, or a number is out of its range.
    """
    if name not in recording.machine.surfaces:
        there = f"the scene has {', '.join(recording.machine.surfaces)}"
        raise InputError(did_you_mean(name, recording.machine.surfaces, there), "surface", name)
    if recording.family is not None:
        raise InputError("one of a single scene, not of a family", "recording", recording)
    if not 1 <= pieces <= MOST_PIECES:
        raise InputError(f"a whole number from 1 to {MOST_PIECES}", "pieces", pieces)
    given = (("erosion", erosion), ("abrasion", abrasion))
    check_coefficients({key: value for key, value in given if value is not None})
    found = _Face(recording, name, pieces)
    sums = found.blows()
    unplaced = found.rubs(sums)
    _, _, eroded, rubbed = sums
    return Wear(
        name=name,
        edges=found.edges,
        places=found.places,
        impact=sums[0],
        sliding=sums[1],
        erosion=eroded if erosion is None else erosion * eroded,
        abrasion=rubbed if abrasion is None else abrasion * rubbed,
        unplaced=unplaced,
    )


def check_coefficients(given: Mapping[str, float]) -> None:
    """Raise an `InputError` if one of them is not positive, or its name is unknown."""
    for key, value in given.items():
        if key not in KEYS[2:]:
            raise InputError(f"one of {', '.join(KEYS[2:])}", "coefficients", key)
        if not 0.0 < value < inf:
            raise InputError("a finite number above 0", key, value)


class _Face:
    """A surface, its pieces of equal length, and the particles that touch it."""

    def __init__(self, recording: Record, name: str, count: int) -> None:
        self.recording, self.machine, self.count = recording, recording.machine, count
        self.surface = self.machine.surfaces.index(name)
        self.mover = self.machine.mover(self.surface)
        self.own = [p for p in self.machine.pieces if int(p.surface) == self.surface]
        self.starts = np.cumsum([0.0, *(float(piece.way) for piece in self.own)])
        self.edges = np.linspace(0.0, self.starts[-1], count + 1)
        middle = 0.5 * (self.edges[1:] + self.edges[:-1])
        # Ends beyond a joint are left out.
        ways = np.stack([self.edges[:-1], middle, self.edges[1:]], axis=1)
        which = np.searchsorted(self.starts, middle, side="right") - 1
        self.places = np.stack(
            [
                self.own[k].at((way - self.starts[k]).clip(0.0, float(self.own[k].way)))
                for k, way in zip(which.tolist(), ways, strict=True)
            ]
        )

    def at_rest(self, places: Floats, times: Floats) -> Floats:
        """Return places (c, 2), m, relative to the surface as written."""
        return places if self.mover is None else self.mover.at_rest(places, times)

    def along(self, places: Floats, which: Ints) -> Floats:
        """Return the distances along the surface of places (c, 2) at its parts, m."""
        found = np.zeros(len(places))
        for k, piece in enumerate(self.own):
            found[which == k] = self.starts[k] + piece.along(places[which == k])
        return found

    def nearest(self, places: Floats) -> tuple[Floats, Ints]:
        """Return the distances of places (c, 2), m, from the surface, and its nearest parts."""
        near, which = np.full(len(places), inf), np.zeros(len(places), dtype=np.int64)
        for k, piece in enumerate(self.own):
            gap = piece.gap(places)
            which[gap < near], near = k, np.minimum(near, gap)
        return near, which

    def velocity(self, places: Floats, times: Floats, normal: Floats, which: Ints) -> Floats:
        """Return the surface's velocity (c, 2), m/s, at contact points with normals."""
        speed = np.zeros(len(places))
        rest = self.at_rest(places, times)
        for k, piece in enumerate(self.own):
            own = which == k
            if own.any() and piece.speed:
                side = (self._turned(normal[own], times[own]) * piece.normal(rest[own])).sum(-1)
                speed[own] = float(piece.speed) * np.where(side < 0.0, -1.0, 1.0)
        moved = speed[:, None] * np.stack([normal[:, 1], -normal[:, 0]], axis=-1)
        if self.mover is not None:
            pose, rate = self.mover.pose(times), self.mover.velocity(times)
            arm = places - pose[:, :2]
            moved += rate[:, :2] + rate[:, 2:] * np.stack([-arm[:, 1], arm[:, 0]], axis=-1)
        return moved

    def _turned(self, ways: Floats, times: Floats) -> Floats:
        """Return directions (c, 2) relative to the surface as written."""
        if self.mover is None:
            return ways
        c, s = np.cos(self.mover.turn * times), np.sin(self.mover.turn * times)
        return np.stack([c * ways[:, 0] + s * ways[:, 1], c * ways[:, 1] - s * ways[:, 0]], axis=-1)

    def friction(self, which: Ints, particle: Ints) -> Floats:
        """Return µ of particles with parts of the surface, (c,)."""
        kind = self.machine.releases.kind[particle]
        rows = [np.broadcast_to(p.friction, len(self.machine.rolling)) for p in self.own]
        return np.stack(rows)[which, kind]

    def blows(self) -> list[Floats]:
        """Return the four sums of `KEYS` over blows, (P,) each."""
        some, recording = self.recording.select(*BLOWS), self.recording
        some = some[(some["surface"] == self.surface) & (some["normal_impulse"] > 0.0)]
        particle = some["particle"]
        mass, radius = recording.mass[particle], recording.radius[particle]
        push, drag = some["normal_impulse"], some["tangential_impulse"]
        before, after = some["velocity_before"], some["velocity_after"]
        # m Δv = J_n n + J_t (n_y, -n_x): as complex numbers n (J_n - i J_t).
        change = mass[:, None] * (after - before)
        turned = (change[:, 0] + 1j * change[:, 1]) / (push - 1j * drag)
        normal = np.stack([turned.real, turned.imag], axis=-1)
        normal /= np.hypot(*normal.T)[:, None]
        places = some["position"] - radius[:, None] * normal
        rest = self.at_rest(places, some["t"])
        _, which = self.nearest(rest)
        moved = self.velocity(places, some["t"], normal, which)
        along = np.stack([normal[:, 1], -normal[:, 0]], axis=-1)
        into = [((v - moved) * normal).sum(-1) for v in (before, after)]
        slips = [
            ((v - moved) * along).sum(-1) + radius * some[f"omega_{when}"]
            for v, when in ((before, "before"), (after, "after"))
        ]
        lost = -0.5 * push * (into[0] + into[1])
        heat = -0.5 * drag * (slips[0] + slips[1])
        # Finnie's law has the velocity of the centre relative to the face.
        past = np.abs(((before - moved) * along).sum(-1))
        angle = np.arctan2(-into[0].clip(max=0.0), past)
        eroded = mass * (into[0] ** 2 + past**2) * finnie(angle)
        rubbed = over(heat, self.friction(which, particle))
        way = self.along(rest, which)
        return [self.summed(way, way, of) for of in (lost, heat, eroded, rubbed)]

    def summed(self, begin: Floats, end: Floats, values: Floats) -> Floats:
        """Return sums by piece, (P,), of values (c,) spread between two distances (m)."""
        low, high = np.minimum(begin, end), np.maximum(begin, end)
        # Across the seam of a whole circle the value is put at one place.
        high = np.where(high - low > 0.5 * self.edges[-1], low, high)
        first, last = (
            np.searchsorted(self.edges, way, side="right").clip(1, self.count) - 1
            for way in (low, high)
        )
        within = first == last
        found = np.bincount(first[within], values[within], self.count).astype(np.float64)
        low, high, values = low[~within], high[~within], values[~within]
        for part in range(self.count) if len(low) else ():
            begin, end = self.edges[part], self.edges[part + 1]
            inside = (np.minimum(high, end) - np.maximum(low, begin)).clip(min=0.0)
            found[part] += float((values * inside / (high - low)).sum())
        return found

    def rubs(self, sums: list[Floats]) -> float:
        """Add the loss of lasting contacts to the sums; return the part without a place, J."""
        entries = ledger(self.recording).by_surface[self.machine.surfaces[self.surface]]
        told = entries["restitution_loss"], entries["friction_loss"]
        touching, unplaced = self._touching(), 0.0
        for row, whole in enumerate(told):
            lost, weight = whole - float(sums[row].sum()), touching.weights[row]
            if abs(lost) <= 1e-12 * sum(map(abs, told)):
                continue
            if lost < 0.0 < whole:
                # For impacts at one instant the ledger has their joint loss.
                sums[row] *= whole / sums[row].sum()
            elif weight.any():
                share = lost * weight / weight.sum()
                sums[row] += self.summed(touching.begin, touching.end, share)
                if row == 1:
                    rubbed = over(share, touching.friction)
                    sums[3] += self.summed(touching.begin, touching.end, rubbed)
            else:
                unplaced += lost
        return unplaced

    def _touching(self) -> _Touching:
        """Find the particles that touch the surface while they lose energy."""
        knots, owner = self.recording.knots, self.recording.owner
        t, spot, spin, booked = (knots[name] for name in ("t", "position", "omega", "entries"))
        h = np.diff(t)
        losses = np.diff(booked[:, 1:], axis=0).clip(min=0.0)
        left = np.flatnonzero((owner[1:] == owner[:-1]) & (h > 0.0) & losses.any(axis=1))
        way = np.hypot(*(spot[left + 1] - spot[left]).T)
        looks = np.ceil(way / self.edges[1]).clip(1, MOST_PIECES).astype(np.int64)
        left, looks = np.repeat(left, looks), np.repeat(looks, looks)
        nth = np.arange(len(left)) - np.searchsorted(left, left)
        radius = self.recording.radius[owner[left]]
        gap, which = self.nearest(self._center(left, (nth + 0.5) / looks)[2])
        near = gap <= (1.0 + TOUCH) * radius + 1e-9
        left, looks, nth = left[near], looks[near], nth[near]
        radius, which = radius[near], which[near]
        share = (nth + 0.5) / looks
        velocity, times, rest = self._center(left, share)
        foot = np.zeros_like(rest)
        for k, piece in enumerate(self.own):
            foot[which == k] = piece.nearest(rest[which == k])
        out = rest - foot
        far = np.hypot(*out.T)[:, None]
        normal = np.divide(out, far, out=np.zeros_like(out), where=far > 0.0)
        place = foot
        if self.mover is not None:
            place, normal = self.mover.carried(foot, times), self._turned(normal, -times)
        moved = self.velocity(place, times, normal, which)
        omega = spin[left] + share * (spin[left + 1] - spin[left])
        along = np.stack([normal[:, 1], -normal[:, 0]], axis=-1)
        slip = np.abs(((velocity - moved) * along).sum(axis=-1) + radius * omega)
        # If it slips at one speed, or not at all, weight by time.
        mean = np.bincount(left, slip / looks, len(knots))[left]
        by_slip = np.divide(slip, mean, out=np.ones_like(slip), where=mean > 0.0)
        begin, end = (
            self.along(self._center(left, (nth + n) / looks)[2], which) for n in (0.0, 1.0)
        )
        return _Touching(
            begin, end, self.friction(which, owner[left]),
            (losses[left, 0] / looks, losses[left, 1] * by_slip / looks),
        )  # fmt: skip

    def _center(self, left: Ints, share: Floats) -> tuple[Floats, Floats, Floats]:
        """Return velocity (c, 2), m/s, times, s, and places (c, 2), m, as the surface is written.

        For centres at shares of the intervals after knots.
        """
        knots = self.recording.knots
        places, velocity = hermite(knots, left, share)
        t = knots["t"]
        times = t[left] + share * (t[left + 1] - t[left])
        return velocity, times, self.at_rest(places, times)


class _Touching(NamedTuple):
    """Samples (c,) of particles that touch a surface while they lose energy."""

    begin: Floats  # start along the surface, m
    end: Floats  # end along the surface, m
    friction: Floats
    weights: tuple[Floats, Floats]  # restitution and friction losses, J


def over(heat: Floats, friction: Floats) -> Floats:
    """Return load times sliding distance, J, of slip heat (J) at friction µ; NaN where µ is 0."""
    quotient = np.divide(heat, friction, out=np.full_like(heat, nan), where=friction > 0.0)
    return np.where(np.isinf(friction), 0.0, quotient)


@kept
def wear(recording: Record, name: str) -> Wear:
    """Return the wear of a surface, in 50 pieces, without coefficients."""
    return worn(recording, name)


def touched(recording: Record) -> dict[str, Wear]:
    """Return the wear of all surfaces that have any, by their names."""
    every = {name: wear(recording, name) for name in recording.machine.surfaces}
    return {
        name: one for name, one in every.items() if any(getattr(one, key).any() for key in KEYS[:3])
    }
