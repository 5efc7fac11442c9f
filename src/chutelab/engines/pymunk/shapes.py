"""All bodies and shapes of a machine in one Space, and the values of contacts for Chipmunk."""

from __future__ import annotations

from itertools import pairwise
from math import acos, ceil, inf, pi, sqrt
from typing import Any

import numpy as np
import pymunk
from pymunk import Vec2d

from chutelab.engines.pymunk.faces import Bend, Face
from chutelab.engines.pymunk.world import GRIP, PARTICLE, SURFACE, World
from chutelab.machine import Machine
from chutelab.util.arrays import Floats

SLOP, BIAS = 1e-3, 1e-97
"""Overlap that Chipmunk tolerates, as a share of the radius, and the share of the rest that is left
after 1 s: a fifth is removed in 1 ms. Its defaults are meant for pixels and 60 steps a second: 0.1
(m here) and 0.9^60, 0.6 % in 1 ms. With those, disks that land without a rebound, detected a step
late, stay where they sank: in `stream` at 1 ms, 1 % of all contacts overlap by 46 % of the radius,
with these values by 1.4 %. The residual is 3e-4 either way, as all overlaps are removed in the end:
that work belongs to no contact's impulse, so it is in the residual. Without slop, disks at rest
lose contact every few steps."""

ROUND = 3e-3
"""Share of its smallest half-width by which a polygon's corners are rounded, more than `SLOP`.
Chipmunk finds the normal of two faces from a positive distance of the unrounded shapes; at 0 it is
undefined."""

FACES, JOINED = 30, 100
"""Iterations of Chipmunk's solver for particles with corners, and with joints. The two points of a
face then share an impact to 1e-11; the default of 10, which is right for disks, leaves 1e-4. An
impact of two bodies on pins is right to 1e-2 with 30, and to rounding with 100."""

ROLLER = 3
"""Collision type of the ends of moving segments."""

SMALLEST = 1e-12
"""Stands for a pair value of 0, because Chipmunk's product of two shapes' values is divided by
it."""

SAGITTA = 1e-5
"""Distance of a chain of segments from its arc of radius R, as a share of the smallest radius r.
Its links turn by δ = 2 √(2 SAGITTA r/R); without restitution a disk that slides inside the arc
loses δ/4 of its speed per rad: 0.03 % if R is 50 r."""


class Shapes:
    """Bodies and shapes of all particles and surfaces; particles are put into the Space by others.

    Attributes
    ----------
    smallest : float
        Radius of the smallest particle, or a polygon's smallest half-width, m.
    corners : bool
        Whether some particles are not disks.
    bodies : list
        Body and shape of each particle.
    rank : dict
        Row of each body, by its id: particles, then faces.
    gates : dict
        Shapes of the surfaces that do not always exist.
    points : list
        If there are corners, each point of each contact in the last step: rows of bodies A and B,
        whether the contact is new, impulse on A (N s), normal from A to B, and the levers of A and
        B (m), each x and y.
    """

    def __init__(self, machine: Machine, world: World) -> None:
        self.machine, self.world = machine, world
        m, space = machine, world.space
        sizes = np.broadcast_to(m.particle.radius, m.count).astype(float)
        for kind, outline in enumerate(m.outlines):
            if outline is not None:
                sizes[m.releases.kind == kind] = self._faces(outline)[0]
        self.smallest = float(sizes.min())
        self.corners = any(outline is not None for outline in m.outlines)
        space.gravity, space.collision_bias = Vec2d(*(-m.gravity * m.up)), BIAS
        space.collision_slop = SLOP * self.smallest + world.hair
        # If Chipmunk remembered contacts longer, it would report old impulses, not applied, when
        # two meet again.
        space.collision_persistence = 1
        # All are made now, so that none gets the id of a deleted one.
        self.bodies = [self._body(i) for i in range(m.count)]
        shapes = (shape for _, shape in self.bodies)
        self.kind = dict(zip(shapes, m.releases.kind.tolist(), strict=True))
        self._pairs()
        # Ends of belts, with the direction outward.
        self.out: dict[pymunk.Shape, Vec2d] = {}
        self.gates: dict[Face, list[pymunk.Shape]] = {}
        # Gates that exist now; particles on which a gate closed, with the gate.
        self.up, self.shut = set[Face](), set[tuple[pymunk.Shape, Face]]()
        # Chains of faces that are solid from one side. For each particle that touches one: the
        # number of shapes touched, and whether it came from the side that lets it through.
        self.chains = self._one_sided()
        self.touching: dict[tuple[pymunk.Shape, tuple[Face, ...]], tuple[int, bool]] = {}
        waits = {one.surface for one in machine.triggers if one.doing != "starts"}
        for face in world.faces:
            parts = self._shapes(face)
            for shape in parts:
                world.by_shape[shape] = face
                shape.elasticity = face.restitution / self.own
                shape.friction = face.friction / self.grip
            new = [shape for shape in parts if shape is not face.touched]
            if face.surface in waits or face.appears > -inf or face.vanishes < inf:
                self.gates[face] = parts
                if len(new) < len(parts):
                    space.remove(face.touched)
            else:
                space.add(*new)
        bodies = [body for body, _ in self.bodies]
        bodies += [face.shape.body for face in world.faces if face.shape.body]
        self.rank = {body.id: row for row, body in enumerate(bodies)}
        self.points: list[tuple[float, ...]] = []
        space.on_collision(PARTICLE, ROLLER, pre_solve=self._met)
        if self.table is not None or self.gates or self.chains:
            space.on_collision(PARTICLE, SURFACE, pre_solve=self._met)
        for kind in (SURFACE, ROLLER) if self.chains else ():
            space.on_collision(PARTICLE, kind, begin=self._comes, separate=self._goes)
        if self.table is not None:
            space.on_collision(PARTICLE, PARTICLE, pre_solve=self._met)
        if self.corners:
            space.iterations = JOINED if machine.joints else FACES
        for kind in (PARTICLE, SURFACE, ROLLER) if self.corners else ():
            space.on_collision(PARTICLE, kind, post_solve=self._note)

    def _body(self, i: int) -> tuple[pymunk.Body, pymunk.Shape]:
        """Return a particle's body with its shape, not yet in the Space."""
        shape: pymunk.Shape
        body, shape = self.world.disk(i)
        outline = self.machine.outlines[self.machine.releases.kind[i]]
        if outline is not None:
            body.angle = float(self.machine.releases.angle[i])
            width, out = self._faces(outline)
            by = ROUND * width
            # Corners of the polygon with its faces moved in by the rounding.
            back = np.roll(out, 1, axis=0)
            share = 1.0 + (out * back).sum(axis=1, keepdims=True)
            inner = outline - by * (out + back) / share
            shape = pymunk.Poly(body, inner.tolist(), radius=by + self.world.hair)
            shape.collision_type = PARTICLE
        if not self.machine.interact:
            shape.filter = pymunk.ShapeFilter(group=1)
        elif (self.machine.pair_restitution < 0.0).any():
            # Bit 0 belongs to all kinds that meet every other kind; surfaces have all bits.
            through = self.machine.pair_restitution < 0.0
            bits = {kind: n for n, kind in enumerate(np.flatnonzero(through.any(axis=0)), 1)}
            kind = self.machine.releases.kind[i]
            apart = sum(1 << bits[other] for other in np.flatnonzero(through[kind]))
            shape.filter = pymunk.ShapeFilter(
                categories=1 << bits.get(kind, 0), mask=pymunk.ShapeFilter.ALL_MASKS() ^ apart
            )
        return body, shape

    @staticmethod
    def _faces(outline: Floats) -> tuple[float, Floats]:
        """Return a polygon's smallest distance from centre to face (m), and its faces' normals."""
        along = np.roll(outline, -1, axis=0) - outline
        out = np.stack([along[:, 1], -along[:, 0]], axis=1) / np.hypot(*along.T)[:, None]
        distance = (outline * out).sum(axis=1)
        # Corners may go round either way.
        out *= np.sign(distance)[:, None]
        return float(np.abs(distance).min()), out

    def _pairs(self) -> None:
        """Give particles values whose products by Chipmunk are the values of pairs.

        If there are none such, each contact gets the pair's values from `table`, (2, K, K + F).
        """
        m, kinds = self.machine, self.machine.releases.kind
        values = np.array([m.pair_restitution.clip(0.0), np.minimum(m.pair_friction, GRIP)])
        own, self.grip = (sqrt(max(value, SMALLEST)) for value in values[:, 0, 0].tolist())
        self.own, self.table = own, None
        for _, shape in self.bodies:
            shape.elasticity, shape.friction = own, self.grip
        if len(values[0]) == 1:
            return
        worlds = [World(m, int(np.argmax(kinds == k))) for k in range(len(values[0]))]
        met = [[(f.restitution, f.friction) for f in world.faces] for world in worlds]
        table = np.concatenate(
            [values, np.moveaxis(np.reshape(met, (len(worlds), -1, 2)), -1, 0)], axis=2
        )
        if (table != table[:, :1]).any():
            self.table = table
            self.column = {face: k for k, face in enumerate(self.world.faces, len(values[0]))}

    def _shapes(self, face: Face) -> list[pymunk.Shape]:
        """Return the shapes of a surface: an arc is a chain of segments, belts have end rollers."""
        shape, space = face.shape, self.world.space
        assert shape.body is not None
        if isinstance(face, Bend):
            assert face.foot.body is not None
            # Chipmunk frees the body with its shape, which must not be used again.
            del self.world.by_shape[face.foot]
            space.remove(face.foot, face.foot.body)
            return self._chain(face)
        if not isinstance(shape, pymunk.Segment):
            if not face.turns and face.speed == 0.0:
                # The chain ends there by itself.
                space.remove(shape)
                return []
            if not face.turns:
                shape.collision_type = ROLLER
                assert face.tangent is not None
                self.out[shape] = face.tangent
            return [shape]
        if face.speed == 0.0:
            return [shape]
        if not self.corners:
            # With neighbours in line Chipmunk finds no contact beyond the segment's ends, nor,
            # depending on rounding, of an edge that lies flat on the segment.
            a, b = face.ends
            shape.set_neighbors(a - (b - a), b + (b - a))
        assert face.tangent is not None
        shape.surface_velocity = face.speed * face.tangent
        rollers = [pymunk.Circle(shape.body, 0.0, end) for end in face.ends]
        for roller, out in zip(rollers, (-face.tangent, face.tangent), strict=True):
            roller.collision_type = ROLLER
            self.out[roller] = out
        return [shape, *rollers]

    def _chain(self, face: Bend) -> list[pymunk.Shape]:
        """Return the shapes for an arc: a circle if it is one and all are outside."""
        body, circle = face.shape.body, face.shape
        assert body is not None
        assert isinstance(circle, pymunk.Circle)
        starts = self.machine.releases.position - np.array(face.center)
        if face.extent == inf and (np.hypot(*starts.T) >= circle.radius).all():
            circle.collision_type = SURFACE
            body.body_type, body.angular_velocity = pymunk.Body.KINEMATIC, face.spin
            return [circle]
        begin, extent = face.begin, min(face.extent, 2.0 * pi)
        bow = min(SAGITTA * self.smallest / circle.radius, 1.0)
        angles = np.linspace(
            begin, begin + extent, max(ceil(extent / (2.0 * acos(1.0 - bow))), 3) + 1
        )
        points = [Vec2d.from_polar(circle.radius, angle) for angle in angles.tolist()]
        # A belt continues straight at both ends, where its rollers are met; a fixed arc ends there.
        a, b = points[0], points[-1]
        if face.extent == inf:
            before, after = points[-2], points[1]
        else:
            goes = float(face.speed != 0.0)
            before, after = a + goes * (a - points[1]), b + goes * (b - points[-2])
        chain = list[pymunk.Shape]()
        for k, (start, end) in enumerate(pairwise(points)):
            link = pymunk.Segment(body, start, end, 0.0)
            link.set_neighbors(points[k - 1] if k else before, (*points, after)[k + 2])
            link.surface_velocity = face.speed * (start - end).normalized()
            link.collision_type = SURFACE
            chain.append(link)
        return chain

    def _met(self, arbiter: pymunk.Arbiter, _space: pymunk.Space, _data: Any) -> None:
        """Set the values of a contact that its shapes lack: of two kinds of particles.

        The end of a belt moves along its rim, and is not met beside the face. A gate does not touch
        a particle on which it closed, nor a surface that is solid from one side a particle that it
        lets through.
        """
        shape, met = arbiter.shapes
        face = self.world.by_shape.get(met)
        if face is not None and met in self.out:
            assert shape.body is not None
            assert isinstance(met, pymunk.Circle)
            normal = -arbiter.normal
            assert met.body is not None
            end, out = met.body.local_to_world(met.offset), self.out[met].rotated(met.body.angle)
            beyond = out.dot(shape.body.position - end) > 0.0
            arbiter.process_collision = beyond
            speed = face.belt(normal.rotated(-met.body.angle))
            arbiter.surface_velocity = speed * Vec2d(normal.y, -normal.x)
        _, passes = self.touching.get((shape, self.chains.get(face, ())), (0, False))
        if passes or (shape, face) in self.shut:
            arbiter.process_collision = False
        if self.table is not None:
            column = self.kind[met] if face is None else self.column[face]
            pair = self.table[:, self.kind[shape], column]
            arbiter.restitution, arbiter.friction = pair.tolist()

    def _one_sided(self) -> dict[Face | None, tuple[Face, ...]]:
        """Return the chain of each face that is solid from one side: faces that follow each other.

        The ends of an arc follow it.
        """
        chains, last = dict[Face | None, tuple[Face, ...]](), tuple[Face, ...]()
        for face in (face for face in self.world.faces if face.one_sided):
            follows = last and (last[0].surface, last[0].appears) == (face.surface, face.appears)
            if follows and face.ends:
                gaps = [(a - b).length for a in face.ends for b in last[-1].ends]
                follows = min(gaps) <= self.world.hair
            last = (*last, face) if follows and not isinstance(face, Bend) else (face,)
            chains |= dict.fromkeys(last, last)
        return chains

    def _comes(self, arbiter: pymunk.Arbiter, space: pymunk.Space, _data: Any) -> None:
        """Note from which side of a chain a particle comes that touches the first of its shapes.

        Its place of a step ago counts: it may have moved by up to its radius since.
        """
        shape, met = arbiter.shapes
        if (chain := self.chains.get(self.world.by_shape[met])) is None:
            return
        count, passes = self.touching.get((shape, chain), (0, False))
        if not count:
            assert shape.body is not None
            x = shape.body.position - space.current_time_step * shape.body.velocity
            gaps = [(face.gap(x)[0], face.side(x)) for face in chain]
            least = min(gap for gap, _ in gaps) + self.world.hair
            # At a corner, where two faces are equally near, the sum of their normals counts.
            passes = sum(side for gap, side in gaps if gap <= least) < 0.0
        self.touching[shape, chain] = count + 1, passes

    def _goes(self, arbiter: pymunk.Arbiter, _space: pymunk.Space, _data: Any) -> None:
        """Note that a particle no longer touches a shape; clear of a chain, it meets it again."""
        # When its Space is deleted, the two may come in the other order.
        shape, met = sorted(arbiter.shapes, key=self.world.by_shape.__contains__)
        chain = self.chains.get(self.world.by_shape[met], ())
        count, passes = self.touching.pop((shape, chain), (0, False))
        if count > 1:
            self.touching[shape, chain] = count - 1, passes

    def _note(self, arbiter: pymunk.Arbiter, _space: pymunk.Space, _data: Any) -> None:
        """Note the impulse at each point of a contact; Pymunk itself reports only sums."""
        raw = arbiter._arbiter
        a, b = reversed(arbiter.bodies) if raw.swapped else arbiter.bodies
        rows, first, n = (self.rank[a.id], self.rank[b.id]), arbiter.is_first_contact, raw.n
        for k in range(raw.count):
            c = raw.contacts[k]
            jx, jy = n.x * c.jnAcc - n.y * c.jtAcc, n.x * c.jtAcc + n.y * c.jnAcc
            self.points.append((*rows, first, -jx, -jy, n.x, n.y, c.r1.x, c.r1.y, c.r2.x, c.r2.y))

    def open_and_shut(self, now: float) -> bool:
        """Add gates that exist at a time (s), remove others; note particles on which they close.

        Return whether a gate was added or removed.
        """
        space, changed = self.world.space, False
        for face, shapes in self.gates.items():
            if (face.appears <= now < face.vanishes) == (face in self.up):
                continue
            changed = True
            if face in self.up:
                self.up.remove(face)
                space.remove(*shapes)
                continue
            self.up.add(face)
            space.add(*shapes)
            self.shut |= {(shape, face) for shape in self._in(shapes)}
        for face in {face for _, face in self.shut}:
            inside = self._in(self.gates[face]) if face in self.up else set()
            self.shut -= {(s, f) for s, f in self.shut if f is face and s not in inside}
        return changed

    def _in(self, shapes: list[pymunk.Shape]) -> set[pymunk.Shape]:
        """Return the particles that overlap shapes of a surface."""
        hits = {info.shape for shape in shapes for info in self.world.space.shape_query(shape)}
        return {shape for shape in hits if shape is not None and shape.collision_type == PARTICLE}

    def taken(self, i: int, place: Vec2d, by: int) -> bool:
        """Whether a particle that is not in the Space yet would overlap something there.

        Another one, or a surface that moves: `by` is their collision type.
        """
        moving = {mover.surface for mover in self.machine.movers}
        body, shape = self.bodies[i]
        body.position = place
        touch = SLOP * self.smallest + 2.0 * self.world.hair
        return any(
            # Of what overlaps; the sign is wrong where Chipmunk has swapped the two shapes, as it
            # does for a polygon that meets a disk or a segment.
            abs(point.distance) > touch
            for hit in self.world.space.shape_query(shape)
            if hit.shape is not None
            and hit.shape.collision_type == by
            and (by == PARTICLE or self.world.by_shape[hit.shape].surface in moving)
            for point in hit.contact_point_set.points
        )
