"""Moving surfaces, joints, rolling friction and air drag, in addition to Chipmunk's contacts.

Surfaces with a prescribed motion are kinematic bodies; hinged ones hang on joints.

Strings, rods, springs and pins are joints of a Space. A tight string, a rod or a pin takes energy
only in the order of the step; this is a restitution loss of the particles. What a spring gives to
particles is booked as their work.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from math import exp
from typing import Any, Final

import numpy as np
import pymunk
from pymunk import Vec2d

from chutelab.engines.pymunk.faces import Face
from chutelab.engines.pymunk.world import DIGITS, World
from chutelab.machine import VISCOSITY, Joint, Machine, Mover
from chutelab.util.arrays import Bools, Floats, Ints

COMES_BACK: Final = 0.02
"""s; in this time an angle beyond a stop, or a stretched joint, is brought back to 1/e of its
error."""

SWEEPS: Final = 10
"""Iterations of Chipmunk per face of a hinged surface. Each face is joined only to the first one,
so an impact on one takes as many iterations as there are faces to reach them all."""


class Hanging:
    """A hinged surface: one body per face, pivoted at the hinge; all of them turn together.

    Like a particle's place its angle in the Space is half a step behind, and is read accordingly.
    Chipmunk reports only the size of a joint's impulse: a stop pushes inwards; the sign for a
    motor, which drives or brakes, follows from the change of momentum and the other impulses.
    """

    def __init__(self, space: pymunk.Space, mover: Mover, bodies: list[pymunk.Body]) -> None:
        hinge, still, many = mover.hinge, space.static_body, len(bodies)
        assert hinge is not None
        self.hinge, self.surface, self.body, self.bodies = hinge, mover.surface, bodies[0], bodies
        x, y = hinge.moment
        pivot, weighs = Vec2d(*mover.pivot), hinge.mass > 0.0
        self.pivot, self.gravity = pivot, space.gravity
        # Without weight the mass is at the hinge, where it has no effect.
        mass = hinge.mass if weighs else hinge.inertia / hinge.gyration**2
        middle = Vec2d(x, y) / mass if weighs else Vec2d.zero()
        space.iterations = max(space.iterations, SWEEPS * many)
        for body in bodies:
            body.body_type = pymunk.Body.DYNAMIC
            body.mass = mass / many
            body.moment = (hinge.inertia - mass * middle.dot(middle) * weighs) / many
            place = body.position
            body.center_of_gravity = pivot + middle - place
            body.position = place
            joints: list[pymunk.Constraint] = [pymunk.PivotJoint(still, body, pivot)]
            if body is not self.body:
                joints.append(pymunk.GearJoint(self.body, body, 0.0, 1.0))
            for joint in joints:
                joint.error_bias = 0.0
                space.add(joint)
        self.stop = pymunk.RotaryLimitJoint(still, self.body, *np.clip(hinge.stops, -1e9, 1e9))
        # An angle beyond a stop is corrected slowly; at once, the stop would throw the surface
        # back.
        self.stop.error_bias = exp(-1.0 / COMES_BACK)
        self.motor = pymunk.SimpleMotor(self.body, still, hinge.motor[0])
        self.motor.max_force = hinge.motor[1] if mover.begins == 0.0 else 0.0
        spring = pymunk.DampedRotarySpring(self.body, still, hinge.rest, hinge.spring, hinge.damper)
        space.add(self.stop, spring, *[self.motor] * (hinge.motor[1] > 0.0))
        self.before, self.work = 0.0, np.zeros(4)
        self.states = [(0.0, 0.0, 0.0, mover.surface, 0)]

    @property
    def rate(self) -> float:
        """Its angular velocity, rad/s."""
        return float(self.body.angular_velocity)

    def step(self, t: float, h: float) -> None:
        """Note its state after a step that ended at a time (s), and the work done on it."""
        rate, mean = self.rate, 0.5 * (self.rate + self.before)
        inwards = -1.0 if self.body.angle > 0.5 * sum(np.clip(self.hinge.stops, -1e9, 1e9)) else 1.0
        stopped = inwards * self.stop.impulse
        if self.hinge.motor[1] > 0.0:
            # Angular impulse of weight, spring and contacts about the pivot, N m s.
            sprung = self.hinge.spring * (self.hinge.rest - self.body.angle)
            given = [h * (sprung - self.hinge.damper * mean)]

            def touched(arbiter: pymunk.Arbiter) -> None:
                for point in arbiter.contact_point_set.points:
                    off, impulse = point.point_a - self.pivot, arbiter.total_impulse
                    given.append(off.cross(impulse) / len(arbiter.contact_point_set.points))

            for body in self.bodies:
                arm, weight = body.local_to_world(body.center_of_gravity) - self.pivot, body.mass
                given.append(arm.cross(weight * self.gravity * h))
                body.each_arbiter(touched)
            asked = self.hinge.inertia * (rate - self.before) - stopped - sum(given)
            self.work[0] += np.sign(asked) * self.motor.impulse * mean
        self.work[1] -= stopped * mean
        self.work[2] += self.hinge.damper * h * mean * mean
        self.states.append((t, self.body.angle + 0.5 * h * rate, rate, self.surface, 0))


class Moving:
    """The moving faces of a world; `rows` are their rows among all bodies.

    `center`, (2, bodies), is updated as they move.

    Chipmunk looks for contacts half-way through a step, and solves with the velocities at its end.
    So a body is placed such that the step moves it to its surface's place half-way, at the
    surface's velocity at the end.
    """

    def __init__(self, machine: Machine, world: World, first: int, center: Floats) -> None:
        movers = {mover.surface: mover for mover in machine.movers}
        self.faces: list[tuple[Face, pymunk.Body, Mover, Vec2d, list[pymunk.Segment]]] = []
        rows = []
        for row, face in enumerate(world.faces, first):
            body, mover = face.shape.body, movers.get(face.surface)
            if mover is None or body is None:
                continue
            if mover.hinge is None:
                body.body_type = pymunk.Body.KINEMATIC
            # Its place as written; its shapes are relative to it.
            shapes = [shape for shape, its in world.by_shape.items() if its is face]
            links = [shape for shape in shapes if isinstance(shape, pymunk.Segment)]
            self.faces.append((face, body, mover, body.position, links))
            rows.append(row)
        self.rows = np.array(rows, dtype=np.int64)
        self.hanging: dict[int, Hanging] = {}
        # Bodies that are not static would collide with each other.
        for shape in world.by_shape if machine.scene.hinges else ():
            shape.filter = pymunk.ShapeFilter(group=2)
        for surface, mover in movers.items():
            if mover.hinge is not None:
                bodies = [body for face, body, *_ in self.faces if face.surface == surface]
                self.hanging[surface] = Hanging(world.space, mover, bodies)
        size = first + len(world.faces)
        self.place, self.velocity = np.zeros((2, 2, size))
        # Before a step and after it.
        self.turn = np.zeros((2, size))
        self.turn[:, self.rows] = [mover.velocity(0.0)[2] for _, _, mover, _, _ in self.faces]
        self.angle, self.center = np.zeros(size), center

    def start(self, surface: int, t: float) -> None:
        """Start the motion of a surface, or its motor, at a time (s)."""
        for k, (face, body, mover, written, links) in enumerate(self.faces):
            if face.surface == surface:
                self.faces[k] = face, body, replace(mover, begins=t), written, links
                self.turn[:, self.rows[k]] = mover.turn
        if surface in self.hanging:
            hanging = self.hanging[surface]
            hanging.motor.max_force = hanging.hinge.motor[1]

    def put(self, t: float, h: float) -> None:
        """Place all for a step that begins at a time (s)."""
        motion: dict[int, tuple[list[float], ...]] = {}
        for row, one in zip(self.rows, self.faces, strict=True):
            face, body, mover, written, links = one
            if mover.hinge is not None:
                self.hanging[face.surface].before = self.turn[0, row] = body.angular_velocity
                continue
            if face.surface not in motion:
                poses = mover.pose([t + 0.5 * h, t + h]).tolist()
                turned = ([*pose, np.cos(pose[2]), np.sin(pose[2])] for pose in poses)
                motion[face.surface] = *turned, mover.velocity(t + h).tolist()
            (x, y, angle, c, s), end, (vx, vy, turn) = motion[face.surface]
            ox, oy = written[0] - mover.pivot[0], written[1] - mover.pivot[1]
            place = Vec2d(x + c * ox - s * oy, y + s * ox + c * oy)
            x1, y1, _, c, s = end
            off = x1 + c * ox - s * oy - x1, y1 + s * ox + c * oy - y1
            velocity = Vec2d(vx - turn * off[1], vy + turn * off[0])
            body.position, body.angle = place - h * velocity, angle - h * turn
            body.velocity = velocity
            wheel = isinstance(face.shape, pymunk.Circle) and face.shape.radius > 0.0
            body.angular_velocity = turn + (face.spin if wheel else 0.0)
            self.place[:, row], self.velocity[:, row] = (x, y), (vx, vy)
            self.center[:, row] = place
            self.angle[row] = angle
            self._run(face, links, angle)

    def _run(self, face: Face, links: list[pymunk.Segment], angle: float) -> None:
        """Set the direction of a belt whose surface is at an angle (rad)."""
        for link in links if face.speed else ():
            along = (link.b - link.a).normalized().rotated(angle)
            back = -1.0 if face.tangent is None else 1.0
            link.surface_velocity = back * face.speed * along

    def swing(self, t: float, h: float) -> None:
        """Note the states of hinges after a step that ended at a time (s)."""
        for one in self.hanging.values():
            one.step(t, h)
        for row, (face, body, mover, written, links) in zip(self.rows, self.faces, strict=True):
            if mover.hinge is None:
                continue
            turned = Vec2d(*(written - mover.pivot)).rotated(body.angle)
            self.place[:, row], self.center[:, row] = mover.pivot, mover.pivot + turned
            self.angle[row], self.turn[1, row] = body.angle, body.angular_velocity
            self._run(face, links, body.angle)

    def back(self, rows: Ints, x: Floats, y: Floats) -> tuple[Floats, Floats]:
        """Return directions (k,) on bodies (rows), turned back to the bodies' angles as written."""
        c, s = np.cos(self.angle[rows]), np.sin(self.angle[rows])
        return c * x + s * y, c * y - s * x

    def at(self, rows: Ints, places: Floats) -> Floats:
        """Return velocities (m/s) at places (2, k), m, of bodies (k,) by their rows.

        Before the step and after it, (2, 2, k).
        """
        x, y = places - self.place[:, rows]
        turn = self.turn[:, rows]
        return np.asarray(self.velocity[:, rows] + np.stack([-turn * y, turn * x], axis=1))


@dataclass
class Tie:
    """A joint of the Space; `over` (m) is its extension, None before its first step."""

    joint: Joint
    held: Any
    spring: Floats  # a row of `Record.springs`
    over: Any = None
    tied: bool = False

    def ends(self, positions: Floats) -> tuple[Vec2d, Vec2d]:
        """Return its far end and its particle's end for particles at positions (2, N)."""
        far, own = self.joint.ends(positions.T)
        return Vec2d(*far.tolist()), Vec2d(*own.tolist())


class Ties:
    """All joints of a machine.

    Parameters
    ----------
    machine : Machine
    world : World
    bodies : list of pymunk.Body
        Of each particle.
    """

    def __init__(self, machine: Machine, world: World, bodies: list[pymunk.Body]) -> None:
        self.space, self.rounding, self.all = world.space, world.rounding, list[Tie]()
        self.free = np.zeros(machine.count, dtype=bool)
        for joint in machine.joints:
            held = self._held(joint, bodies, machine)
            held.error_bias = 0.0
            held.collide_bodies = joint.kind not in ("rod", "pin")
            self.all.append(Tie(joint, held, np.zeros(4)))
        self.springs = [tie.spring for tie in self.all if tie.joint.kind == "spring"]

    def _held(self, joint: Joint, bodies: list[pymunk.Body], machine: Machine) -> Any:
        far = self.space.static_body if joint.other < 0 else bodies[joint.other]
        own, anchor = bodies[joint.particle], joint.anchor or (0.0, 0.0)
        if joint.kind == "string":
            return pymunk.SlideJoint(far, own, anchor, (0.0, 0.0), 0.0, joint.length)
        if joint.kind == "spring":
            rest = joint.length, joint.stiffness, joint.damper
            return pymunk.DampedSpring(far, own, anchor, (0.0, 0.0), *rest)
        if joint.kind == "rod":
            rod = pymunk.PinJoint(far, own, anchor, (0.0, 0.0))
            rod.distance = joint.length
            return rod

        def on(i: int) -> Vec2d:
            """Return the pinned place in the frame of a particle, which may be turned."""
            off = np.array(anchor) - machine.releases.position[i]
            return Vec2d(*off.tolist()).rotated(-float(machine.releases.angle[i]))

        there = on(joint.other) if joint.other >= 0 else anchor
        return pymunk.PivotJoint(far, own, there, on(joint.particle))

    def put(self, i: int, *, free: bool) -> None:
        """Add or remove the joints of a particle; a joint of two is added once both fly."""
        self.free[i] = free
        for tie in self.all:
            joint = tie.joint
            if i not in (joint.particle, joint.other):
                continue
            flies = bool(self.free[joint.particle] and (joint.other < 0 or self.free[joint.other]))
            if flies != tie.tied:
                (self.space.add if flies else self.space.remove)(tie.held)
                tie.over = None
            tie.tied = flies

    def tighten(self, h: float) -> None:
        """Set the lengths of joints for the next step.

        A new joint, or a string that is pulled tight, is longer than its length by up to a step's
        way. That is corrected slowly; at once it would throw the particle back.

        Chipmunk releases a string that is not longer than its length, so one that pulls is kept
        longer by rounding.
        """
        left = exp(-h / COMES_BACK)
        for tie in self.all:
            held, kind, whole = tie.held, tie.joint.kind, tie.joint.length
            if not tie.tied or kind == "spring":
                continue
            far, own = (
                body.position + h * body.velocity
                + anchor.rotated(body.angle + h * body.angular_velocity)
                for body, anchor in ((held.a, held.anchor_a), (held.b, held.anchor_b))
            )  # fmt: skip
            length = (own - far).length
            if kind == "pin":
                if tie.over is None:
                    more = (own - far).rotated(-held.a.angle - h * held.a.angular_velocity)
                    tie.over = Vec2d.zero()
                else:
                    more = (left - 1.0) * tie.over
                tie.over += more
                held.anchor_a += more
            elif kind == "rod":
                tie.over = length - whole if tie.over is None else left * tie.over
                held.distance = whole + tie.over
            else:
                tie.over = left * tie.over if held.impulse > 0.0 else max(length - whole, 0.0)
                held.max = whole + tie.over
                rounding = max(self.rounding, DIGITS * whole)
                if length > whole - rounding:
                    held.max = min(held.max, length - rounding)

    def pulled(self, state: Floats, pull: Vec2d, h: float) -> list[tuple[Tie, Floats]]:
        """Return the effect of each joint on the ledger in the last step: entries of particles, J.

        `state` (2, 5, N) is that before and after it: x, y, vx, vy and angular velocity; `pull` is
        gravity.
        """
        done = []
        for tie in self.all:
            if not tie.tied:
                continue
            joint, own = tie.joint, state[..., tie.joint.particle]
            far = state[..., joint.other] if joint.other >= 0 else np.zeros((2, 5))
            mean, entries = 0.5 * (own + far * -1.0).sum(axis=0)[2:4], np.zeros(3)
            # The joint acts at the places of the bodies in the Space.
            held = tie.held
            middle = (held.anchor_a if joint.other < 0 else held.a.position) - held.b.position
            towards = np.array(middle.normalized())
            impulse = float(tie.held.impulse)
            if joint.kind == "spring":
                kept = [0.5 * joint.stiffness * ((a - b).length - joint.length) ** 2
                        for a, b in (tie.ends(state[k, :2]) for k in (0, 1))]  # fmt: skip
                entries[0] = -impulse * float(towards @ mean)
                damping = impulse - joint.stiffness * (joint.length - middle.length) * h
                if not tie.spring.any():
                    tie.spring[0] = kept[0]
                tie.spring[1] = kept[1]
                tie.spring[2:] += damping * float(towards @ mean), entries[0]
            elif joint.kind == "string":
                entries[1] = -impulse * float(towards @ mean)
            elif joint.kind == "rod":
                change = (own - far)[1, 2:4] - (own - far)[0, 2:4]
                change -= h * np.array(pull) if joint.other < 0 else 0.0
                entries[1] = -impulse * float(np.sign(towards @ change) * (towards @ mean))
            done.append((tie, entries))
        return done


class Rolling:
    """Couples of rolling friction between rows of bodies: two (k,) of rows, and N m s.

    They are applied before a step, so that friction balances them, and grow from step to step until
    the rotation stops, up to what the normal impulses of the step before allow.

    Parameters
    ----------
    machine : Machine
    radius : ndarray, (rows,)
        Radii of particles, then 0 for faces, m.
    """

    def __init__(self, machine: Machine, radius: Floats) -> None:
        self.count = machine.count
        # Of particles that rotate: 1/I, the arm of rolling friction over the radius, if any has it;
        # of round ones also 1 over the radius.
        self.ease, self.arm, self.bend = np.zeros((3, len(radius)))
        outlines = [machine.outlines[kind] for kind in machine.releases.kind]
        is_round = [outline is None for outline in outlines]
        np.divide(1.0, radius[: self.count], out=self.bend[: self.count], where=is_round)
        inertia = np.broadcast_to(machine.particle.inertia, self.count)
        np.divide(1.0, inertia, out=self.ease[: self.count], where=inertia > 0.0)
        self.arm[: self.count] = machine.rolling[machine.releases.kind]
        self.acts = bool(self.arm.any())
        self.couples: tuple[Any, ...] = (*np.zeros((2, 0), dtype=np.int64), np.zeros(0))

    def turn(self, bodies: list[tuple[pymunk.Body, pymunk.Shape]], free: Bools) -> None:
        """Apply the couples at contacts that last from the step before."""
        one, other, couple = self.couples
        kept = free[one] & ((other >= self.count) | free[np.minimum(other, self.count - 1)])
        one, other, couple = self.couples = one[kept], other[kept], couple[kept]
        turned = self.ease * np.bincount(
            np.concatenate((one, other)), np.concatenate((couple, -couple)), len(self.ease)
        )
        for i in np.flatnonzero(turned).tolist():
            bodies[i][0].angular_velocity += float(turned[i])

    def book(self, entries: Floats, turning: Floats, spin: Floats) -> float:
        """Add the work of a step's couples to entries, (3, rows); return the heat of particles, J.

        `turning` is ω before and after it, (2, rows), less the `spin` of surfaces.
        """
        last, mate, couple = self.couples
        heat = -0.5 * couple * (turning[:, last] - turning[:, mate]).sum(axis=0)
        rows, pair = len(self.bend), mate < self.count
        for entry, part in ((0, couple * spin[mate]), (2, np.where(pair, 0.5 * heat, heat))):
            for row in (last, mate):
                entries[entry] += np.bincount(row, part, rows)
        return float(heat[pair].sum())

    def brake(self, one: Ints, other: Ints, push: Floats, turning: Floats) -> None:
        """Find the couples of the next step from the normal impulses (k,) of this one."""
        rows, (last, mate, couple) = len(self.bend), self.couples
        before = dict(
            zip(zip(last.tolist(), mate.tolist(), strict=True), couple.tolist(), strict=True)
        )
        held = [before.get(key, 0.0) for key in zip(one.tolist(), other.tolist(), strict=True)]
        # The larger coefficient of two kinds counts; between two disks with their common radius.
        # Edges are flat.
        share = np.maximum(self.arm[one], self.arm[other])
        bends = self.bend[one] + self.bend[other]
        most = np.divide(share * push, bends, out=np.zeros(len(one)), where=bends > 0.0)
        contacts = np.bincount(np.concatenate((one, other)), minlength=rows)
        contacts[self.count :] = 1
        ease = (self.ease[one] + self.ease[other]) * np.maximum(contacts[one], contacts[other])
        rolls = (most > 0.0) & (ease > 0.0)
        one, other, most = one[rolls], other[rolls], most[rolls]
        change = (turning[1, one] - turning[1, other]) / ease[rolls]
        self.couples = one, other, np.clip(np.array(held)[rolls] - change, -most, most)


def relief(machine: Machine, speed: Floats) -> Any:
    """Return deceleration by air over speed, 1/s (Schiller and Naumann, 1933)."""
    reynolds = 2.0 * machine.broad * speed * machine.air / VISCOSITY
    coefficient = np.where(
        reynolds < 1000.0, 24.0 * (1.0 + 0.15 * reynolds**0.687), 0.44 * reynolds
    )
    return coefficient * np.pi * machine.broad * VISCOSITY / (4.0 * machine.particle.mass)
