"""A judge of one particle's run that shares nothing with the engines: places, pieces, laws.

It reads the tables of a scene file, as they are written, and where and how fast the particle is at
many times (`Recording.at`). Everything else is worked out here, from the numbers of the file.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise
from math import cos, radians, sin
from typing import Any

import numpy as np

BETWEEN = 6
"""Places between two knots that are looked at."""

STRIDE = 0.25
"""Radii that the particle moves between two places, at most."""

MOST = 40_000
"""Places along a track, at most."""


@dataclass(frozen=True)
class Straight:
    """A face from one end to the other, m."""

    name: str
    speed: float
    a: np.ndarray
    b: np.ndarray

    def distance(self, places):
        """Return how far places (M, 2) are from it, (M,), m."""
        along = self.b - self.a
        share = np.clip((places - self.a) @ along / (along @ along), 0.0, 1.0)
        return np.hypot(*(places - self.a - share[:, None] * along).T)

    def crossed(self, start, end):
        """Tell which straight steps (M, 2) to (M, 2) go from one side of it to the other, (M,)."""
        sides = cross(self.b - self.a, start - self.a), cross(self.b - self.a, end - self.a)
        ends = cross(end - start, self.a - start), cross(end - start, self.b - start)
        return (sides[0] * sides[1] <= 0.0) & (ends[0] * ends[1] <= 0.0) & (sides[0] != sides[1])


@dataclass(frozen=True)
class Round:
    """An arc: centre and radius, m, where it begins and how far it reaches, rad."""

    name: str
    speed: float
    center: np.ndarray
    radius: float
    begin: float
    extent: float

    def holds(self, places):
        """Tell which places (M, 2) are in its sector, (M,)."""
        x, y = (places - self.center).T
        return np.mod(np.arctan2(y, x) - self.begin, 2.0 * np.pi) <= self.extent

    def distance(self, places):
        """Return how far places (M, 2) are from it, (M,), m."""
        ends = [
            self.center + self.radius * np.array([cos(turn), sin(turn)])
            for turn in (self.begin, self.begin + self.extent)
        ]
        corner = np.minimum(*(np.hypot(*(places - end).T) for end in ends))
        rim = np.abs(np.hypot(*(places - self.center).T) - self.radius)
        return np.where(self.holds(places), rim, corner)

    def crossed(self, start, end):
        """Tell which straight steps (M, 2) to (M, 2) go through it, (M,)."""
        step, away = end - start, start - self.center
        a, b = (step * step).sum(axis=1), (step * away).sum(axis=1)
        c = (away * away).sum(axis=1) - self.radius**2
        found = np.zeros(len(start), dtype=bool)
        with np.errstate(invalid="ignore", divide="ignore"):
            for sign in (-1.0, 1.0):
                share = (-b + sign * np.sqrt(b * b - a * c)) / a
                met = np.abs(share - 0.5) <= 0.5 + 1e-9
                found |= met & self.holds(start + np.where(met, share, 0.0)[:, None] * step)
        return found


def cross(one, other):
    return one[..., 0] * other[..., 1] - one[..., 1] * other[..., 0]


def pieces(tables: dict[str, Any]) -> list[Straight | Round]:
    """Return what the surfaces of a scene file are, from their numbers."""
    found: list[Straight | Round] = []
    for row in tables["surface"]:
        name, speed = row["name"], row.get("speed", 0.0)
        if "center" in row:
            low, high = sorted([row.get("from_deg", 0.0), row.get("to_deg", 360.0)])
            extent = min(radians(high - low), 2.0 * np.pi)
            found.append(
                Round(name, speed, np.array(row["center"]), row["radius"], radians(low), extent)
            )
            continue
        points = row.get("points") or [row["from"], row["to"]]
        ends = np.array(points, dtype=float)
        found += [Straight(name, speed, a, b) for a, b in pairwise(ends)]
    return found


def times(recording) -> np.ndarray:
    """Return times (M,), s, at which a track is looked at: its knots, and many between."""
    track = recording.track(0)
    knots = np.unique(track["t"])
    fast = np.hypot(*track["velocity"].T).max()
    steps = np.diff(knots)
    reach = STRIDE * recording.machine.particle.radius
    count = np.maximum(BETWEEN, np.ceil(steps * fast / reach)).astype(int)
    count = np.maximum(1, count * min(1.0, MOST / max(1, count.sum()))).astype(int)
    inner = [t + step * np.arange(n) / n for t, step, n in zip(knots, steps, count, strict=False)]
    return np.concatenate([*inner, knots[-1:]])


def tightest(tables: dict[str, Any]) -> float:
    """Return the radius of the tightest curve of a centre, m: in an arc, round it or an end."""
    r = tables["particle"]["radius"]
    return min([r, *(abs(wall.radius - r) for wall in pieces(tables) if isinstance(wall, Round))])


def turn_in_a_step(recording, tables: dict[str, Any]) -> float:
    """Return by how much the way turns in a step, rad, at most: v dt / ρ; 0 without steps."""
    if recording.engine == "exact":
        return 0.0
    dt = recording.machine.dt
    fast = np.hypot(*recording.track(0)["velocity"].T).max() + tables["gravity"] * dt
    return fast * dt / tightest(tables)


def faults(recording, tables: dict[str, Any]) -> list[str]:
    """Return what a run did that it may not."""
    turn, r = turn_in_a_step(recording, tables), tables["particle"]["radius"]
    # The chord of a step's turn is so far inside the curve.
    inside = 1e-3 * r + min(turn * turn / 8.0, 2.0) * tightest(tables)
    return findings(recording, tables, inside, max(1e-9, turn * turn))


def findings(recording, tables: dict[str, Any], inside: float, energy: float) -> list[str]:
    """Return what a run did that it may not.

    Parameters
    ----------
    recording : Recording
        Of one particle.
    tables : dict
        The scene file that it is of.
    inside : float
        How deep the particle may be in a piece, m.
    energy : float
        Share of what is turned over by which energy may rise where nothing drives.
    """
    walls, t = pieces(tables), times(recording)
    (place, velocity) = (values[:, 0] for values in recording.at(t))
    if not (np.isfinite(place).all() and np.isfinite(velocity).all()):
        return ["not a number"]
    r, g = tables["particle"]["radius"], tables["gravity"]
    gaps = np.array([wall.distance(place) for wall in walls]) - r
    found = []
    for wall, gap in zip(walls, gaps, strict=True):
        at = int(np.argmin(gap))
        if gap[at] < -inside:
            found.append(f"in {wall.name} by {-gap[at]:.2g} m at {t[at]:.9g} s")
        through = np.flatnonzero(wall.crossed(place[:-1], place[1:]))
        if len(through):
            found.append(f"through {wall.name} at {t[through[0]]:.9g} s")
    return [
        *found,
        *in_energy(recording, tables, energy),
        *in_the_air(t, place, velocity, gaps.min(axis=0), g, max(inside, 1e-6 * r)),
    ]


def in_energy(recording, tables: dict[str, Any], share: float) -> list[str]:
    """Return where the energy of the particle rises though no piece moves.

    Of a mass of 1 kg: v²/2 + g y, and of a solid disk that turns (r ω)²/4.
    """
    if any(wall.speed != 0.0 for wall in pieces(tables)):
        return []
    track = recording.track(0)
    turning = 0.25 * (tables["particle"]["radius"] * track["omega"]) ** 2
    moving = 0.5 * (track["velocity"] ** 2).sum(axis=1) + turning
    lifted = tables["gravity"] * track["position"][:, 1]
    total = moving + lifted
    scale = moving.max() + np.ptp(lifted) + tables["gravity"] * tables["particle"]["radius"]
    least = np.minimum.accumulate(total)
    at = int(np.argmax(total - least))
    if total[at] - least[at] > share * scale:
        rise = (total[at] - least[at]) / scale
        return [f"energy rises by {rise:.2g} of it up to {track['t'][at]:.9g} s"]
    return []


def in_the_air(t, place, velocity, gap, gravity: float, near: float) -> list[str]:
    """Return where the particle does not fall freely though it is further than `near` from all."""
    free = (gap[:-1] > near) & (gap[1:] > near)
    step = np.diff(t)
    bent = np.diff(velocity, axis=0)
    bent[:, 1] += gravity * step
    fast = np.hypot(*velocity.T).max() + gravity * np.ptp(t)
    off = np.where(free, np.hypot(*bent.T), 0.0)
    at = int(np.argmax(off)) if len(off) else 0
    if len(off) and off[at] > 1e-9 * fast:
        return [f"pushed by nothing, {off[at]:.2g} m/s, at {t[at]:.9g} s"]
    return []
