"""How the pieces of a machine join: what goes on where one ends, and what touches unmet."""

from __future__ import annotations

from collections import defaultdict
from functools import cached_property
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from chutelab.util.arrays import Bools, Floats, Ints

if TYPE_CHECKING:
    from chutelab.engines.exact.obstacles import Obstacles

NONE = -1

FOLDED = 1e-9
"""Difference of two directions below which one piece lies on the other where they meet."""

COLLINEAR = 1e-12
"""Sine of the angle at a joint below which one piece simply goes on as the next."""

FACES = (1, -1)
"""The left and the right face of a piece."""


class Handover(NamedTuple):
    """A place on a circle where a ride goes over into another piece, without a blow."""

    piece: int  # at which end of which piece, and its face there
    end: int
    face: int
    onto: bool  # whether it is the piece that is gone over to; else the one that ends


class Joints:
    """Where pieces end; arrays over their two ends, and over their left and right faces.

    Parameters
    ----------
    obstacles : Obstacles
        Directions are compared in its first row.
    """

    def __init__(self, obstacles: Obstacles) -> None:
        self._o = obstacles

    @cached_property
    def tips(self) -> tuple[Floats, Floats, Floats]:
        """Places of ends (m), directions out of the piece, left normals there; (2, P, 2, n)."""
        o = self._o
        first, last = o.start, o.start + o.length * o.tangent
        place, ahead, left = (
            np.stack(pair, axis=2)
            for pair in ((first, last), (-o.tangent, o.tangent), (o.normal, o.normal))
        )
        bent = len(o.spots) - o.segments
        if not bent:
            return place, ahead, left
        radius, begin, extent = o.bend[:, :bent]
        center = o.center[:, o.first_arc - o.segments :][:, :bent]
        angle = np.stack([begin + extent, begin], axis=1)
        out = np.stack([np.cos(angle), np.sin(angle)])
        clockwise = np.stack([out[1], -out[0]]) * np.array([-1.0, 1.0])[:, None]
        there = center[:, :, None] + radius[:, None] * out
        pairs = ((place, there), (ahead, clockwise), (left, out))
        one, two, three = (np.concatenate(pair, axis=1) for pair in pairs)
        return one, two, three

    def obstacle(self, piece: int, face: int) -> int:
        """Return the obstacle number of a face of a piece."""
        o = self._o
        if piece < o.segments:
            return piece
        if piece == o.segments + o.arcs:
            return o.pulley if face > 0 else NONE
        return piece - o.segments + o.first_arc + (0 if face > 0 else o.arcs)

    def _follow(self, present: Bools) -> Ints:
        """Return which piece goes on where another ends, and at which of its ends, (2, P, 2).

        Of the pieces that are there, (S + C,); -1 if none does; the first one wins. Pieces that
        fold back onto each other do not go on from each other.
        """
        spots, ahead = self._o.spots, self.tips[1][..., 0]
        follow = np.full((2, len(spots), 2), NONE, dtype=np.int64)
        meeting: dict[int, list[tuple[int, int]]] = defaultdict(list)
        for piece, pair in enumerate(spots):
            if present[self.obstacle(piece, 1)]:
                for end, spot in enumerate(pair):
                    meeting[spot].append((piece, end))
        for ends in meeting.values():
            for n, (s, e) in enumerate(ends):
                for other, f in ends[n + 1 :]:
                    if other == s or follow[0, s, e] != NONE or follow[0, other, f] != NONE:
                        continue
                    if np.abs(ahead[:, s, e] - ahead[:, other, f]).max() > FOLDED:
                        follow[:, s, e], follow[:, other, f] = (other, f), (s, e)
        return follow

    @cached_property
    def onward(self) -> tuple[Ints, Floats]:
        """Return what faces go over into at their ends, and its side, (T + 1, P, 2, 2).

        Another face if that is flush, else the circle round the end, whose side is left open, 0;
        -1 for nothing. Before the first change of what is there, and after each.
        """
        found = [self._onward(self._follow(present)) for present in self._o.present]
        obstacle, side = zip(*found, strict=True)
        return np.stack(obstacle), np.stack(side)

    def _onward(self, follow: Ints) -> tuple[Ints, Floats]:
        o = self._o
        place, _, left = (array[..., 0] for array in self.tips)
        obstacle = np.repeat(o.end_circle[: len(o.spots), :, None], 2, axis=2)
        side = np.zeros(obstacle.shape)
        for piece, end in np.ndindex(len(o.spots), 2):
            normal, (other, there) = left[:, piece, end], follow[:, piece, end]
            arc = o.rests[piece, end]
            if other != NONE:
                against = left[:, other, there]
            elif arc == o.arcs:
                other, against = o.segments + arc, normal
            elif arc != NONE:
                other = o.segments + arc
                against = place[:, piece, end] - o.center[:, o.first_arc - o.segments + arc, 0]
                against = against / np.hypot(*against)
            else:
                continue
            if abs(normal[0] * against[1] - normal[1] * against[0]) > COLLINEAR:
                continue
            turn = 1 if normal @ against > 0.0 else -1
            for n, face in enumerate(FACES):
                obstacle[piece, end, n] = self.obstacle(other, turn * face)
                side[piece, end, n] = turn * face
        return obstacle, side

    @cached_property
    def meeting(self) -> Ints:
        """Numbers of the ends that lie on a circle, 2 piece + end, (M, C); -1 if there is none."""
        o = self._o
        found: list[list[int]] = [[] for _ in range(len(o.rho))]
        for piece, end in np.argwhere(o.end_circle != NONE).tolist():
            found[o.end_circle[piece, end] - o.segments].append(2 * piece + end)
        most = max(map(len, found), default=0)
        rows = [ends + [NONE] * (most - len(ends)) for ends in found]
        return np.array(rows, dtype=np.int64).reshape(len(found), most).T

    @cached_property
    def owns(self) -> Bools:
        """Tell of which segments a circle is an end, (C, S)."""
        o = self._o
        circle = np.arange(o.segments, len(o.surface))[:, None]
        ends = o.end_circle[: o.segments]
        return np.asarray((ends[:, 0] == circle) | (ends[:, 1] == circle))

    @cached_property
    def crown(self) -> Floats:
        """Vectors, (2, C, n), to the middle of the half that joins the left face of a piece.

        At an end that is the piece's left normal, at a joint the sum of both. Arcs and the pulley,
        which turn clockwise all round, have 0.
        """
        o, left = self._o, self.tips[2]
        follow = self._follow(np.ones(len(o.surface), dtype=bool))
        crown = np.zeros((2, len(o.rho), left.shape[-1]))
        for piece, end in reversed(list(np.ndindex(len(o.spots), 2))):
            circle, (other, there) = o.end_circle[piece, end], follow[:, piece, end]
            if circle == NONE:
                continue
            crown[:, circle - o.segments] = left[:, piece, end]
            if other != NONE:
                sign = 1 if there != end else -1
                crown[:, circle - o.segments] += sign * left[:, other, there]
        return crown

    @cached_property
    def handovers(self) -> dict[int, list[Handover]]:
        """Where rides round a circle, by its obstacle number, go over into another piece."""
        o, (onward, _) = self._o, self.onward
        found: dict[int, list[Handover]] = defaultdict(list)
        for piece, end in np.ndindex(len(o.spots), 2):
            # Left and then right of the direction out of the piece.
            for face in FACES if end else FACES[::-1]:
                circle, n = int(o.end_circle[piece, end]), FACES.index(face)
                if circle != NONE:
                    found[circle].append(Handover(piece, end, face, True))
                next_ = int(onward[0, piece, end, n])
                if o.rests[piece, end] != NONE and next_ != NONE:
                    found[next_].append(Handover(piece, end, face, True))
                if piece >= o.segments:
                    found[self.obstacle(piece, face)].append(Handover(piece, end, face, False))
        return found

    @cached_property
    def beside(self) -> Bools:
        """Tell what touches a circle without being met, as it goes over into it, (C, S + C, 2).

        The last axis is the face of a segment; both are the same for a circle.
        """
        o, (onward, _) = self._o, self.onward
        beside = np.zeros((len(o.rho), len(o.surface), 2), dtype=bool)

        def touch(one: int, face: int, other: int) -> None:
            """Note that an obstacle, or this face of a segment, and a circle touch."""
            if one < o.segments:
                beside[other - o.segments, one, FACES.index(face)] = True
            else:
                beside[other - o.segments, one] = beside[one - o.segments, other] = True

        for piece, end, n in np.ndindex(len(o.spots), 2, 2):
            own, circle = self.obstacle(piece, FACES[n]), o.end_circle[piece, end]
            for other in (int(circle), *onward[:, piece, end, n].tolist()):
                if other >= o.segments:
                    touch(own, FACES[n], other)
        return beside
