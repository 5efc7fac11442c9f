"""Chains and bowls drawn at random: one particle, and pieces that share points, straight and round.

What it draws: tangent, kinked and T-joints (two or three pieces begin where one ends), hollow and
round arcs after each other, arcs that end on their horizontal or vertical diameter, half-circles,
cups, rings with a slit and whole circles whose rim is left and met again, split arcs, rims with a
wall, a table or a round lip, bowls beside bowls. Particles of 0.05 to 0.999 of an arc's radius, and
larger ones; on either side of a piece, touching or above it. Friction none, some and large; spin;
moving pieces; restitution up to 0.9; duplicates; ends that are typed to few digits; no gravity.

What it never draws: gates, pulleys, belts and plates, pegs in rows, conveyors, mixtures, drag,
rolling friction, mass points, several particles, arcs that equal the particle to less than a
thousandth, restitution above 0.9. Pieces cross in their middles by chance only.
"""

from __future__ import annotations

from math import cos, hypot, radians, sin
from typing import Any

import numpy as np

from chutelab.machine import build
from chutelab.scene import Scene, SceneError, from_dict
from sandbox import Dice

FAMILIES = ("chain", "joint", "bowl", "waves")

QUARTERS = {0: (1.0, 0.0), 1: (0.0, 1.0), 2: (-1.0, 0.0), 3: (0.0, -1.0)}
"""Directions of whole quarter turns, without the rounding of π."""


def draw(seed: int) -> Scene:
    """Return the scene of a seed."""
    return from_dict(tables(seed), f"chain-{seed}")


def tables(seed: int) -> dict[str, Any]:
    """Return a scene that can be built, as its file has it; the same seed gives the same scene.

    Radii are 3 to 60 mm, arcs 3 mm to 1.2 m, straight pieces 0.02 to 0.6 m, speeds up to 4 m/s.
    """
    rng = np.random.default_rng([25, seed])
    while True:
        drawn = Drawing(rng, FAMILIES[seed % len(FAMILIES)]).tables
        try:
            build(from_dict(drawn))
        except SceneError:
            # The release overlaps a surface, or an end falls on the other one.
            continue
        return drawn


def heading(degrees: float) -> tuple[float, float]:
    """Return a unit vector; that of whole quarter turns is exact."""
    quarters, rest = divmod(degrees, 90.0)
    if rest == 0.0:
        return QUARTERS[int(quarters) % 4]
    return cos(radians(degrees)), sin(radians(degrees))


class Drawing(Dice):
    """One attempt at a scene."""

    def __init__(self, rng: np.random.Generator, family: str) -> None:
        super().__init__(rng)
        self.rows: list[dict[str, Any]] = []
        self.r = float(10.0 ** self.number(-2.5, -1.2))
        self.usual = self.values()
        self.starts: list[dict[str, Any]] = []
        getattr(self, f"_{family}")()
        if self.chance(0.1):
            twin = dict(self.one_of(*self.rows))
            self.rows.append(twin | {"name": f"p{len(self.rows)}"})
        if self.chance(0.2):
            for row in self.rows:
                if self.chance(0.5):
                    row["speed"] = self.one_of(self.number(-1.5, 1.5), self.number(-0.3, 0.3))
        if self.chance(0.15):
            self._typed(self.whole(3, 6))
        self.tables = {
            "gravity": self.one_of(*[9.81] * 12, self.number(1.0, 20.0), 0.0),
            "particle": {"radius": self.r, "mass": 0.01, "spin": self.chance(0.5)},
            "surface": self.rows,
            "stream": self.one_of(*self.starts),
            "run": {"until": round(self.number(0.8, 2.5), 3)},
        }

    def values(self) -> dict[str, float]:
        return {
            "restitution": self.one_of(0.0, 0.0, 0.3, self.number(0.0, 0.9)),
            "friction": self.one_of(0.0, 0.0, 0.4, self.number(0.0, 1.0), self.number(2.0, 10.0)),
        }

    def share(self) -> float:
        """Draw the particle's radius as a share of an arc's."""
        return self.one_of(
            self.number(0.05, 0.999),
            self.number(0.05, 0.5),
            1.0 - float(10.0 ** self.number(-3.0, -1.0)),
            self.one_of(0.1, 0.25, 0.5, 0.75, 0.9, 0.999),
        )

    def size(self) -> float:
        """Draw the radius of an arc: most hold the particle, some are smaller than it."""
        return self.r / (self.number(1.05, 4.0) if self.chance(0.07) else self.share())

    def length(self) -> float:
        return self.number(1.0, 12.0) * self.r if self.chance(0.7) else self.number(0.05, 0.6)

    def _piece(self, **row: Any) -> None:
        values = self.usual if self.chance(0.7) else self.values()
        self.rows.append({"name": f"p{len(self.rows)}", **row, **values})

    def line(self, start: tuple[float, float], degrees: float, length: float) -> Any:
        """Add a straight piece; return where it ends and its direction there."""
        dx, dy = heading(degrees)
        end = (start[0] + length * dx, start[1] + length * dy)
        ends = (start, end) if self.chance(0.8) else (end, start)
        self._piece(**{"from": list(ends[0]), "to": list(ends[1])})
        return end, degrees

    def arc(self, start: tuple[float, float], degrees: float, size: float, turn: float) -> Any:
        """Add an arc that begins in a direction and turns by degrees, > 0 to the left."""
        side = 90.0 if turn > 0.0 else -90.0
        dx, dy = heading(degrees + side)
        center = (start[0] + size * dx, start[1] + size * dy)
        begin = (degrees - side) % 360.0
        ends = (begin, begin + turn) if self.chance(0.8) else (begin + turn, begin)
        self._piece(center=list(center), radius=size, from_deg=ends[0], to_deg=ends[1])
        dx, dy = heading(begin + turn)
        return (center[0] + size * dx, center[1] + size * dy), degrees + turn

    def _turn(self, degrees: float) -> float:
        """Draw how far an arc turns; often up to its horizontal or vertical diameter."""
        way = self.one_of(-1.0, 1.0)
        if self.chance(0.4):
            rest = (-way * degrees) % 90.0
            return way * (rest + 90.0 * self.whole(int(rest == 0.0), 2))
        return way * self.number(5.0, 260.0)

    def _kink(self) -> float:
        return self.one_of(
            0.0, 0.0, self.number(-100.0, 100.0), self.one_of(-90.0, -45.0, 45.0, 90.0),
            self.number(-5.0, 5.0),
        )  # fmt: skip

    def _next(self, end: tuple[float, float], degrees: float) -> Any:
        if self.chance(0.5):
            return self.line(end, degrees, self.length())
        return self.arc(end, degrees, self.size(), self._turn(degrees))

    def _first(self) -> float:
        return self.one_of(
            0.0, 0.0, -90.0, 180.0, 90.0, self.number(-60.0, 60.0), self.number(0.0, 360.0)
        )

    def _chain(self) -> None:
        """Piece after piece; where some end, two begin."""
        end, degrees = (0.0, 0.0), self._first()
        for _ in range(self.whole(2, 6)):
            before = len(self.rows)
            for _ in range(self.one_of(1, 1, 1, 2)):
                last = self._next(end, degrees + self._kink())
            self._along(before)
            end, degrees = last
            if self.chance(0.05):
                dx, dy = heading(degrees)
                gap = self.number(0.05, 1.5) * self.r
                end = (end[0] + gap * dx, end[1] + gap * dy)

    def _joint(self) -> None:
        """A face that the particle comes along, and two or three pieces that begin at its end."""
        degrees = self.one_of(0.0, 0.0, 180.0, self.number(-60.0, 60.0))
        # An arc that cannot be tangential from below is a wall: that is what a kink draws.
        if self.chance(0.7):
            end, degrees = self.line((0.0, 0.0), degrees, self.length())
        else:
            end, degrees = self.arc((0.0, 0.0), degrees, self.size(), self._turn(degrees))
        self._along(0)
        self.arc(end, degrees, self.size(), self._turn(degrees))
        self.line(end, degrees + self._kink(), self.length())
        if self.chance(0.3):
            self._next(end, degrees + self._kink())
        if self.chance(0.3):
            self._next(end, degrees + self._kink())

    def _waves(self) -> None:
        """Arcs that are hollow and round by turns, tangential."""
        degrees = self.one_of(0.0, -90.0, self.number(-90.0, 90.0), 180.0)
        end, way = (0.0, 0.0), self.one_of(-1.0, 1.0)
        for _ in range(self.whole(2, 5)):
            before = len(self.rows)
            turn = abs(self._turn(degrees)) if self.chance(0.5) else self.number(5.0, 120.0)
            end, degrees = self.arc(end, degrees, self.size(), way * turn)
            self._along(before)
            way = -way if self.chance(0.8) else way
        if self.chance(0.5):
            self._next(end, degrees + self._kink())

    def _bowl(self) -> None:
        """Part of a circle, in one piece or two, with something or nothing at its rims."""
        for n in range(self.one_of(1, 1, 1, 2)):
            size = self.r / (self.share() if self.chance(0.95) else self.number(1.05, 3.0))
            begin, extent = self.one_of(
                (180.0, 180.0), (180.0, 180.0), (180.0, 90.0), (270.0, 90.0), (90.0, 270.0),
                (180.0, 270.0), (0.0, 360.0), (self.number(90.0, 270.0), self.number(90.0, 350.0)),
                (180.0 + self.number(-30.0, 30.0), 180.0), (200.0, 140.0), (0.0, 180.0),
            )  # fmt: skip
            at = (0.0, 0.0) if n == 0 else (self.number(-3.0, 3.0) * size, -self.number(0, 2.0))
            cut = self.number(0.2, 0.8) if self.chance(0.3) else 1.0
            if cut < 1.0 and extent == 180.0 and self.chance(0.5):
                cut = 0.5
            x, y = heading(begin)
            end, degrees = (at[0] + size * x, at[1] + size * y), begin + 90.0
            rims = [(end, degrees + 180.0)]
            end, degrees = self.arc(end, degrees, size, cut * extent)
            if cut < 1.0:
                end, degrees = self.arc(end, degrees, size, begin + extent + 90.0 - degrees)
            rims.append((end, degrees))
            if extent < 360.0:
                for rim, way in rims:
                    if self.chance(0.3):
                        self._next(rim, way + self._kink())
            self._into(at, size)

    def _along(self, first: int) -> None:
        """Let the particle start at a piece from the `first`, on a side of it, touching or not."""
        row = self.one_of(*self.rows[first:])
        share = self.number(0.0, 1.0)
        if "from" in row:
            a, b = np.array(row["from"]), np.array(row["to"])
            foot, along = a + share * (b - a), (b - a) / hypot(*(b - a))
        else:
            turned = row["from_deg"] + share * (row["to_deg"] - row["from_deg"])
            away = np.array(heading(turned))
            foot = np.array(row["center"]) + row["radius"] * away
            along = np.array([-away[1], away[0]])
        normal = self.one_of(-1.0, 1.0) * np.array([-along[1], along[0]])
        if normal[1] < 0.0 and self.chance(0.7):
            normal = -normal
        gap = self.one_of(0.0, 1e-3, 0.02, self.number(0.0, 1.0), self.number(0.0, 10.0))
        place = foot + normal * self.r * (1.0 + gap)
        speed = self.one_of(0.0, self.number(0.0, 1.0), self.number(0.0, 4.0))
        velocity = speed * self.one_of(-1.0, 1.0) * along - self.one_of(0.0, 0.3) * speed * normal
        self.starts.append({"at": place.tolist(), "velocity": velocity.tolist()})

    def _into(self, center: tuple[float, float], size: float) -> None:
        """Let the particle start in a circle, or above its rim."""
        x, y = center
        free = max(size - self.r, 0.0)
        inside = self.number(0.0, 1.0) ** 0.5 * free, self.number(-180.0, 0.0)
        dx, dy = heading(inside[1])
        above = self.number(0.0, 2.0) * size + self.r
        rim = self.one_of(-1.0, 1.0) * self.one_of(free, self.number(0.5, 1.0) * free)
        touching = self.number(200.0, 340.0)
        self.starts += [
            {"at": [x + inside[0] * dx, y + inside[0] * dy], "velocity": self._thrown()},
            {"at": [x + rim, y + above], "velocity": [0.0, 0.0]},
            {
                "at": [x + self.number(-1.5, 1.5) * size, y + size + above],
                "velocity": [0.0, -self.number(0.0, 1.0)],
            },
            {"at": [x + free * p for p in heading(touching)], "velocity": [0.0, 0.0]},
        ]  # fmt: skip

    def _thrown(self) -> list[float]:
        speed = self.one_of(0.0, self.number(0.0, 1.0), self.number(0.0, 4.0))
        return [speed * part for part in heading(self.number(0.0, 360.0))]

    def _typed(self, digits: int) -> None:
        """Round all places to so many digits, as people type them: joints are not exact then."""
        for row in self.rows:
            for key in ("from", "to", "center"):
                if key in row:
                    row[key] = [round(value, digits) for value in row[key]]
