"""The machine as the exact engine sees it: faces and circles to meet, and how they join.

A disk of radius r touches a segment's face when its centre is r away, and its end when the centre
is on a circle of radius r about it. An arc of radius R is met from outside on a circle of radius
R + r, and from inside on one of radius R - r, which counts as negative: then one formula serves
both, with normals that point at the particle. The pulley is one more circle, of radius R + r.

Obstacles are numbered: segments, then circles: ends, arcs from outside, arcs from inside, and the
pulley. *Pieces* are the segments and then the arcs, those with ends first. A piece has a left and a
right face, seen along it; along an arc is clockwise, so that its left face is its outside.

Arrays have the particles last, and the two components of vectors first, so that what one operation
reads lies together.
"""

from __future__ import annotations

from collections import defaultdict
from dataclasses import dataclass, replace
from functools import cached_property
from typing import NamedTuple

import numpy as np

from chutelab.util.arrays import Bools, Floats, Ints

NONE = -1
"""No obstacle, no piece."""

PER_PARTICLE = (
    "faces", "length", "center", "rho", "span", "bend", "material", "low", "high", "touch",
)  # fmt: skip
"""Arrays of `Obstacles` whose last axis may be the particles."""


@dataclass(frozen=True, eq=False)
class Obstacles:
    """S segments, A arcs and C circles; n is 1 or the number of particles."""

    # Of the segments, (2, 4, S, 1, n), components first: unit normal, unit tangent to the right of
    # it, first end (m), and from where to where along a segment a place counts as beside it (m).
    faces: Floats
    length: Floats  # (S, n), m
    center: Floats  # (2, C, n), of the circles, m
    # (C, n), distance of a particle's centre from the circle's at contact, m; negative from inside,
    # NaN where the particle is too large for that.
    rho: Floats
    span: Floats  # (2, C, n), first angle of contacts and how far they reach, rad; or no circle
    bend: Floats  # (3, A, n), of the arcs: radius (m), first angle, extent (rad)
    # (3, S + C, n): speed of the surface (m/s), of segments and their ends along the segment, of
    # arcs and the pulley clockwise; restitution and friction of the pair.
    material: Floats
    low: Floats  # (2, S + C, n), box that a particle's centre is in when it touches, m
    high: Floats
    surface: Ints  # (S + C,), index into `Machine.surfaces`
    spots: tuple[tuple[int, int], ...]  # (P, 2), numbers of places where pieces begin and end
    rests: Ints  # (P, 2), arc on which an end lies, or number of arcs for the pulley, or -1
    end_circle: Ints  # (S + A, 2), obstacle number of the circle at each end, or -1
    first_arc: int  # obstacle number of the first arc's outside
    pulley: int  # obstacle number of the pulley, or -1
    touch: Floats  # (n,), m; gaps smaller than this are rounding
    changes: Floats  # (T,), when gates open or shut, ascending, s
    present: Bools  # (T + 1, S + C), what is there before the first change, and after each
    vanishes: Floats  # (S + C,), when an obstacle goes, s

    @property
    def segments(self) -> int:
        """Number of segments S."""
        return int(self.length.shape[0])

    @property
    def arcs(self) -> int:
        """Number of arcs A."""
        return int(self.bend.shape[1])

    @property
    def normal(self) -> Floats:
        """Unit vectors to the left of the segments, (2, S, n)."""
        return self.faces[:, 0, :, 0]

    @property
    def tangent(self) -> Floats:
        """Unit vectors along the segments, (2, S, n)."""
        return self.faces[:, 1, :, 0]

    @property
    def start(self) -> Floats:
        """First ends of the segments, (2, S, n), m."""
        return self.faces[:, 2, :, 0]

    @cached_property
    def bound(self) -> tuple[Floats, Floats]:
        """Lower and upper sides of boxes that hold those of all particles, (2, S + C) each, m."""
        return self.low.min(axis=-1), self.high.max(axis=-1)

    @cached_property
    def under_belt(self) -> Bools:
        """Return what particles held on the incoming belt cannot meet at any height, (S + C,)."""
        held = np.zeros(len(self.surface), dtype=bool)
        held[0] = held[self.pulley] = True
        held[self.end_circle[0][self.end_circle[0] != NONE]] = True
        return held

    @cached_property
    def turning(self) -> Floats:
        """Angular velocities of arcs and their ends, 0 of all else, (S + C, n), rad/s."""
        turning = np.zeros((len(self.surface), max(self.rho.shape[-1], self.material.shape[-1])))
        arcs = slice(self.first_arc, self.first_arc + 2 * self.arcs)
        turning[arcs] = -self.material[0, arcs] / np.concatenate([self.bend[0], self.bend[0]])
        # Of several pieces that end there the first one counts.
        for piece in reversed(range(len(self.spots))):
            ends = [circle for circle in self.end_circle[piece] if circle != NONE]
            arc = piece - self.segments
            turning[ends] = turning[self.first_arc + arc] if arc >= 0 else 0.0
        return turning

    @cached_property
    def joints(self) -> Joints:
        """How the pieces join."""
        return Joints(self)

    def back(self, circle: Ints) -> Ints:
        """Return the obstacle number of the other face of arcs, of circles (k,); else -2."""
        arc = circle + self.segments - self.first_arc
        bent = (arc >= 0) & (arc < 2 * self.arcs)
        other = np.where(arc < self.arcs, arc + self.arcs, arc - self.arcs)
        return np.where(bent, other + self.first_arc, -2)

    def spanned(self, rows: Ints, circle: Ints, away: Floats) -> Bools:
        """Tell whether directions from the centres of circles (k,) are those of the arc, (2, k)."""
        begin, extent = pick(self.span, rows, circle)
        turn = np.mod(np.arctan2(away[1], away[0]) - begin + FOOT, 2.0 * np.pi)
        return np.asarray(turn <= extent + 2.0 * FOOT)

    def reached(self, rows: Ints, circle: Ints, away: Floats, epoch: Ints) -> Bools:
        """Tell which circles (k,) are met from directions (2, k), as far as gates are concerned.

        Not those that are not there after so many changes as `epoch` tells. A gate that appears in
        a disk does not act on it until the disk is clear of it; so neither does its end, where the
        disk comes to it along the gate, which goes on into the disk there.
        """
        met = self.present[epoch, circle + self.segments]
        ends = self.joints.meeting[:, circle]
        ahead = self.joints.tips[1]
        ahead = ahead.reshape(2, -1, ahead.shape[-1])
        clear = (ends == NONE).all(axis=0)
        for number in ends:
            piece = number // 2
            face = np.where(piece < self.segments, piece, piece - self.segments + self.first_arc)
            beyond = dot(pick(ahead, rows, number), away) >= -rows_of(self.touch, rows)
            clear |= (number != NONE) & beyond & self.present[epoch, face]
        return np.asarray(met & clear)

    def of(self, first: int, last: int) -> Obstacles:
        """Return the obstacles of the particles from `first` up to `last`."""
        shared = self.length, self.rho, self.material, self.touch
        if all(array.shape[-1] == 1 for array in shared):
            return self
        own = {name: getattr(self, name) for name in PER_PARTICLE}
        own = {name: array[..., first:last] for name, array in own.items() if array.shape[-1] > 1}
        return replace(self, **own)

    def normal_at(self, rows: Ints, obstacle: Ints, side: Floats, position: Floats) -> Floats:
        """Contact normals, (2, k), of particles touching an obstacle, pointing at the particle.

        `position` (2, n) is that of all particles.
        """
        normal = side * pick(self.normal, rows, obstacle)
        round_ = (obstacle >= self.segments).nonzero()[0]
        if len(round_):
            circle = obstacle[round_] - self.segments
            away = position[:, rows[round_]] - pick(self.center, rows[round_], circle)
            distance = np.hypot(away[0], away[1])
            if self.arcs:
                distance = np.copysign(distance, pick(self.rho, rows[round_], circle))
            normal[:, round_] = away / distance
        return np.asarray(normal)

    def rim_side(self, rows: Ints, obstacle: Ints, normal: Floats) -> Floats:
        """Return which half of circles (k,) normals (2, k) are on: 1, or -1 away from the crown.

        Round the end of a segment of speed v the surface moves with ±v along (n_y, -n_x), which is
        v along the segment on both its faces. The inside of an arc is -1.
        """
        crown = pick(self.joints.crown, rows, obstacle - self.segments)
        half = np.where(dot(normal, crown) >= 0.0, 1.0, -1.0)
        return np.asarray(half * np.sign(pick(self.rho, rows, obstacle - self.segments)))


def dot(a: Floats, b: Floats) -> Floats:
    """Scalar product along the first axis; exact zeros stay exact."""
    product: Floats = a * b
    return np.asarray(product[0] + product[1])


def along(normal: Floats) -> Floats:
    """Tangential direction (n_y, -n_x) of a contact: clockwise round a circle."""
    out = np.empty_like(normal)
    out[0] = normal[1]
    np.negative(normal[0], out=out[1])
    return out


def length_of(vector: Floats) -> Floats:
    """Length of vectors, (2, k) to (k,), without care for overflow."""
    return np.sqrt(dot(vector, vector))


def rows_of(array: Floats, rows: Ints) -> Floats:
    """Columns of a per-particle array, or the one column that all particles share.

    `rows` ascend: as many as there are columns are all of them.
    """
    return array if array.shape[-1] in (1, len(rows)) else array.take(rows, axis=-1)


def pick(array: Floats, rows: Ints, which: Ints) -> Floats:
    """Obstacle `which` for each particle, shape (..., k); numbers too large mean the last one."""
    if not array.shape[-2]:
        return np.zeros((*array.shape[:-2], len(which)))
    if array.shape[-1] == 1:
        return array[..., 0].take(which, axis=-1, mode="clip")
    return np.asarray(array[..., np.minimum(which, array.shape[-2] - 1), rows])


FOOT = 1e-12
"""Share of a segment's length by which its face reaches past its ends, so that no particle slips
through the joint of two segments by rounding."""

TURN = 2.0 * np.pi

FOLDED = 1e-9
"""Difference of two directions below which one piece lies on the other where they meet."""

COLLINEAR = 1e-12
"""Sine of the angle at a joint below which one piece simply goes on as the next."""

FACES = (1, -1)
"""The left and the right face of a piece."""


CIRCULAR = 1e-9
"""Share of a curvature by which two pieces that leave a place in one direction differ at least."""

THROUGH = 2
"""In place of an end: a piece that goes on through a place, first along it, then (3) back."""


class Handover(NamedTuple):
    """A place on a circle where a ride goes over into another piece, without a blow."""

    piece: int  # at which end of which piece, and its face there
    end: int
    face: int
    onto: bool  # whether it is the piece that is gone over to; else the one that ends


class Ray(NamedTuple):
    """A piece seen from a place where it ends, or which it passes."""

    piece: int
    end: int  # or `THROUGH`, where the way out is along the piece, and `THROUGH` + 1
    angle: float  # of the way out, rad, 0 to 2 π
    bend: float  # curvature of the way out, 1/m, positive counterclockwise

    @property
    def left(self) -> int:
        """Face of the piece on the left of the way out; the right one has the other sign."""
        return 1 if self.end in (0, THROUGH) else -1


class Joints:
    """Where pieces end; arrays over their two ends, and over their left and right faces.

    The pieces that share a place, sorted by the angles at which they leave it, divide its
    surroundings into sectors. A disk is in one of them and can touch only the two faces that bound
    that. Where the angle between these is π they are *flush*, and a ride on one goes on on the
    other; where it is more, round the place; where it is less, the ride is stopped before.

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

    @cached_property
    def _places(self) -> list[list[Ray]]:
        """The rays of each place where pieces end, counterclockwise; of two alike the first."""
        o, ahead = self._o, self.tips[1][..., 0]
        places: dict[int, list[Ray]] = defaultdict(list)
        for piece, pair in enumerate(o.spots):
            arc = piece - o.segments
            curvature = 1.0 / o.bend[0, arc, 0] if arc >= 0 else 0.0
            for end, spot in enumerate(pair):
                x, y = -ahead[:, piece, end]
                bend = curvature if end else -curvature
                places[spot].append(Ray(piece, end, _angle(x, y), bend))
        for piece, end in np.argwhere(o.rests != NONE).tolist():
            rays, arc = places[o.spots[piece][end]], o.rests[piece, end]
            through = o.segments + arc
            if any(ray.piece == through for ray in rays):
                continue
            if arc == o.arcs:
                # By rounding the place is not quite on top of the pulley, but the belt is flush.
                (x, y), radius = self.tips[2][:, piece, end, 0], o.rho[-1, 0]
            else:
                x, y = (
                    self.tips[0][:, piece, end, 0] - o.center[:, o.first_arc - o.segments + arc, 0]
                )
                radius = o.bend[0, arc, 0]
            bend = 1.0 / radius
            rays.append(Ray(through, THROUGH, _angle(y, -x), -bend))
            rays.append(Ray(through, THROUGH + 1, _angle(-y, x), bend))
        return list(places.values())

    def _sectors(self, present: Bools) -> list[tuple[Ray, Ray, float]]:
        """Return the two rays of each sector, the right one first, and its angle, rad.

        Of the pieces that are there, (S + C,). What lies on another piece has no sector.
        """
        found = []
        for rays in self._places:
            ring: list[list[Ray]] = []
            for ray in sorted(rays, key=lambda ray: ray.angle):
                if not present[self.obstacle(ray.piece, 1)]:
                    continue
                if ring and ray.angle - ring[-1][0].angle <= COLLINEAR:
                    ring[-1].append(ray)
                else:
                    ring.append([ray])
            if len(ring) > 1 and ring[0][0].angle + TURN - ring[-1][0].angle <= COLLINEAR:
                ring[0] += ring.pop()
            flat = [ray for alike in ring for ray in _by_bend(alike)]
            for n, ray in enumerate(flat):
                after = flat[(n + 1) % len(flat)]
                angle = (after.angle - ray.angle) % TURN
                if TURN - angle <= COLLINEAR:
                    angle = 0.0
                if len(flat) == 1 or (len(ring) == 1 and n == len(flat) - 1):
                    angle = TURN
                found.append((ray, after, angle))
        return found

    @cached_property
    def onward(self) -> tuple[Ints, Floats]:
        """Return what faces go over into at their ends, and its side, (T + 1, P, 2, 2).

        Another face if that is flush, else the circle round the end, whose side is left open, 0;
        -1 for nothing. Before the first change of what is there, and after each.
        """
        o, found = self._o, []
        for present in o.present:
            obstacle = np.repeat(o.end_circle[: len(o.spots), :, None], 2, axis=2)
            side = np.zeros(obstacle.shape)
            for right, left, angle in self._sectors(present):
                if abs(angle - np.pi) > COLLINEAR:
                    continue
                faces = (right, right.left, left, -left.left), (left, -left.left, right, right.left)
                for ray, face, other, onto in faces:
                    if ray.end < THROUGH:
                        n = FACES.index(face)
                        obstacle[ray.piece, ray.end, n] = self.obstacle(other.piece, onto)
                        side[ray.piece, ray.end, n] = onto
            found.append((obstacle, side))
        obstacles, sides = zip(*found, strict=True)
        return np.stack(obstacles), np.stack(sides)

    @cached_property
    def groups(self) -> tuple[Ints, Bools, Bools]:
        """What a disk touches at once where faces end: number of each set, (P, 2, 2), and the sets.

        Faces that share a place and the normal there, and the circle round it; which obstacles, and
        which faces of segments, are in a set: (G, S + C, 2). Last, which ends of the circles that
        are arcs are there, (G, C, 2).
        """
        o, left = self._o, self.tips[2][..., 0]
        number = np.full((len(o.spots), 2, 2), NONE, dtype=np.int64)
        sets: list[Bools] = []
        edges: list[Bools] = []
        for rays in self._places:
            known: list[tuple[Floats, int]] = []
            for ray in rays:
                for n, face in enumerate(FACES):
                    if ray.end < THROUGH:
                        normal = face * left[:, ray.piece, ray.end]
                    elif ray.end == THROUGH:
                        normal = face * np.array([-np.sin(ray.angle), np.cos(ray.angle)])
                    else:
                        continue
                    same = [g for m, g in known if np.abs(normal - m).max() <= COLLINEAR]
                    group = same[0] if same else len(sets)
                    if not same:
                        known.append((normal, group))
                        sets.append(np.zeros((len(o.surface), 2), dtype=bool))
                        edges.append(np.zeros((len(o.rho), 2), dtype=bool))
                    own = self.obstacle(ray.piece, face)
                    if own != NONE:
                        sets[group][own, n if own < o.segments else slice(None)] = True
                    if ray.end < THROUGH:
                        if own >= o.segments:
                            edges[group][own - o.segments, ray.end] = True
                        number[ray.piece, ray.end, n] = group
                        circle = o.end_circle[ray.piece, ray.end]
                        if circle != NONE:
                            sets[group][circle] = True
        if not sets:
            none = np.zeros((0, len(o.surface), 2), dtype=bool)
            return number, none, none
        return number, np.stack(sets), np.stack(edges)

    def shares(self, group: Ints, obstacle: Ints, face: Ints | int) -> Bools:
        """Tell which obstacles, by the index of the face of a segment, are in sets `groups`."""
        sets = self.groups[1]
        return np.asarray((group != NONE) & sets[group, obstacle, face])

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
    def alike(self) -> Ints:
        """Return a number for each circle that those with its centre and radius share, (C,)."""
        o = self._o
        shape = np.stack(np.broadcast_arrays(*o.center, o.rho), axis=1)
        rows = np.round(np.nan_to_num(shape) / (4.0 * o.touch.max())).reshape(len(o.rho), -1)
        return np.asarray(np.unique(rows, axis=0, return_inverse=True)[1].reshape(-1))

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
        follow = np.full((2, len(o.spots), 2), NONE, dtype=np.int64)
        for right, other, angle in self._sectors(np.ones(len(o.surface), dtype=bool)):
            if angle >= np.pi - COLLINEAR and right is not other:
                for one, two in ((right, other), (other, right)):
                    if one.end < THROUGH and two.end < THROUGH:
                        follow[:, one.piece, one.end] = two.piece, two.end
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
        """Tell what touches a circle without being met, as both share a place, (C, S + C, 2).

        The last axis is the face of a segment; both are the same for a circle. Such a circle and
        such a face are tangent to each other there, and have no other point in common.
        """
        o, (_, sets, _) = self._o, self.groups
        beside = np.zeros((len(o.rho), len(o.surface), 2), dtype=bool)
        arcs = np.arange(o.first_arc, o.first_arc + o.arcs)
        # To a point both faces of a piece are in one place.
        points = o.arcs > 0 and o.rho[arcs[0] - o.segments, 0] <= o.bend[0, 0, 0] + o.touch[0]
        for members in sets:
            if points:
                members = members | members[:, ::-1]
                members[arcs] = members[arcs + o.arcs] = members[arcs] | members[arcs + o.arcs]
            beside[members[o.segments :, 0]] |= members
        return beside


def _angle(x: float, y: float) -> float:
    return float(np.arctan2(y, x) % TURN)


def _by_bend(rays: list[Ray]) -> list[Ray]:
    """Sort rays of one angle counterclockwise; of those that lie on each other keep the first."""
    kept: list[Ray] = []
    for ray in rays:
        if all(abs(ray.bend - o.bend) > CIRCULAR * abs(o.bend) for o in kept):
            kept.append(ray)
    return sorted(kept, key=lambda ray: ray.bend)
