"""Particles in one Space, in steps that are all alike.

Chipmunk moves first and then changes velocities, so bodies in the Space stand half a step ahead of
their velocities: with x the place at the velocity's time, the Space holds x - v h/2. Read so, free
flight is exact, and gravity's work is.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from math import inf, sqrt
from typing import TYPE_CHECKING, Any

import pymunk
from pymunk import Vec2d

from chutelab.engines.pymunk.carriage import Carriage
from chutelab.engines.pymunk.world import PARTICLE, SURFACE, Contact, Track, World
from chutelab.recording import REASONS, Kind

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from chutelab.machine import Machine
    from chutelab.recorder import Recorder

FAR = 0.5
"""Share of the radius that the fastest particle may move in a step, so that none is seen first on
the far side of a surface."""

SLOP = 1e-3
"""Share of the radius by which disks in contact overlap, so that they stay in contact."""

PUSH = 0.2
"""Share of an overlap beyond it that Chipmunk takes back in a step."""

FASTER = 2**10
"""Steps into which `dt` is divided at most."""

STAY = 5
"""Soft contacts in a row with one surface that make a lasting one. It ends with the last of them:
a ride round the pulley hops, and more so near its end."""

CALM, STILL = 0.1, 1e-3
"""s and m/s: who slips and moves less for that long has settled."""


@dataclass(eq=False)
class Disk:
    """A particle between its release and its end."""

    number: int
    track: Track
    body: pymunk.Body
    circle: pymunk.Circle
    ride: Carriage | None
    x: Vec2d
    v: Vec2d
    omega: float = 0.0
    met: set[object] = field(default_factory=set)
    meets: set[object] = field(default_factory=set)
    fastest: float = 0.0
    loose: bool = False
    landed: bool = False
    calm: float = 0.0
    on: int = -1
    stays: int = 0
    left: tuple[float, Vec2d, tuple[Vec2d, float]] | None = None

    @property
    def state(self) -> tuple[Vec2d, float]:
        """Velocity (m/s) and angular velocity (rad/s)."""
        return self.v, self.omega


class Shared:
    """Runs some particles together.

    Parameters
    ----------
    machine, world, recorder
        The world's Space is used up.
    particles : sequence of int
        In the order of their releases.
    """

    def __init__(
        self, machine: Machine, world: World, recorder: Recorder, particles: Sequence[int]
    ) -> None:
        self.machine, self.world, self.recorder = machine, world, recorder
        self.waiting = list(particles)
        self.live: dict[pymunk.Shape, Disk] = {}
        self.r, self.g = machine.particle.radius, machine.gravity
        self.pull = Vec2d(0.0, -self.g)
        self.t = float(machine.releases.t[self.waiting[0]])
        self.h, self.steps = machine.dt, 0
        everywhere = (-inf, inf, -inf, inf)
        self.box = everywhere if machine.until == "time" else machine.exit_box
        space = world.space
        space.gravity, space.collision_slop = self.pull, SLOP * self.r + world.hair
        # Who was in contact in this step, with impulses: with a surface, with another.
        self.touched: list[tuple[Disk, Contact, bool]] = []
        self.pairs: list[tuple[Disk, Disk, Vec2d, Vec2d, bool]] = []
        space.on_collision(PARTICLE, SURFACE, pre_solve=self._before, post_solve=self._after)
        space.on_collision(PARTICLE, PARTICLE, post_solve=self._collided)

    def run(self, report: Callable[[float], None]) -> None:
        """Run to the end."""
        begin, end = self.t, self.machine.end_time
        while self.t < end and (self.waiting or self.live):
            self._release()
            self._set_step(min(self._step_length(), end - self.t))
            self._step()
            if self.steps % 64 == 0:
                report((self.t - begin) / (end - begin))
        self._stop()

    # What Chipmunk asks and tells

    def _before(self, arbiter: pymunk.Arbiter, _space: pymunk.Space, _data: Any) -> None:
        face, normal = self.world.by_shape[arbiter.shapes[1]], -arbiter.normal
        arbiter.restitution, arbiter.friction = face.restitution, face.friction
        if face.tangent is not None and face.speed != 0.0:
            arbiter.surface_velocity = face.belt(normal) * Vec2d(normal.y, -normal.x)

    def _after(self, arbiter: pymunk.Arbiter, _space: pymunk.Space, _data: Any) -> None:
        one, other = arbiter.shapes
        contact = Contact(self.world.by_shape[other], -arbiter.normal, arbiter.total_impulse)
        self.touched.append((self.live[one], contact, arbiter.is_first_contact))

    def _collided(self, arbiter: pymunk.Arbiter, _space: pymunk.Space, _data: Any) -> None:
        one, other = arbiter.shapes
        self.pairs.append(
            (self.live[one], self.live[other], -arbiter.normal, arbiter.total_impulse,
             arbiter.is_first_contact)
        )  # fmt: skip

    # Releases

    def _release(self) -> None:
        """Release whose time comes within half a step, if nobody is in the place."""
        starts = self.machine.releases
        for i in list(self.waiting):
            if starts.t[i] > self.t + 1e-9 * self.h:
                break
            x, v = Vec2d(*starts.position[i].tolist()), Vec2d(*starts.velocity[i].tolist())
            if any((d.x - x).length < 2.0 * self.r for d in self.live.values()):
                continue
            self.waiting.remove(i)
            self._add(i, x, v, bool(starts.carried[i]))

    def _add(self, i: int, x: Vec2d, v: Vec2d, carried: bool) -> None:
        track = Track(self.machine, self.recorder, i)
        body, circle = self.world.disk()
        m = self.machine
        circle.elasticity, circle.friction = sqrt(m.pair_restitution), sqrt(m.pair_friction)
        ride = None
        if carried:
            ride = Carriage(m, self.world, i)
            ride.delay(self.t)
            body.body_type = pymunk.Body.KINEMATIC
        disk = Disk(i, track, body, circle, ride, x, v)
        self.live[circle] = disk
        body.position, body.velocity = x - 0.5 * self.h * v, v
        self.world.space.add(body, circle)
        track.knot(self.t, x, v, 0.0)
        track.event(Kind.RELEASE, self.t, x, (v, 0.0))

    # Steps

    def _step_length(self) -> float:
        """Return the next step (s): `dt`, or halves of it as long as particles are fast."""
        dt = self.machine.dt
        if not self.machine.interact:
            return dt
        fastest = max((d.v.length for d in self.live.values()), default=0.0) + self.g * dt
        parts = 1
        while fastest * dt > FAR * self.r * parts and parts < FASTER:
            parts *= 2
        h = dt / parts
        # Not to and fro: a new step costs the solver what it knows.
        return self.h if self.h == 0.5 * h else h

    def _set_step(self, h: float) -> None:
        """Change the step: bodies stand half a step ahead, and cached impulses are void."""
        self.world.space.collision_bias = (1.0 - PUSH) ** (1.0 / h)
        if h == self.h:
            return
        self.h = h
        for circle, disk in self.live.items():
            disk.body.position = disk.x - 0.5 * h * disk.v
            self.world.space.remove(circle)
            self.world.space.add(circle)

    def _step(self) -> None:
        """Step all by h, book what happened, and end who has ended."""
        h, then = self.h, self.t + self.h
        self.touched.clear()
        self.pairs.clear()
        for disk in self.live.values():
            if disk.ride is not None:
                # Half a step behind and half a step ahead, as all others.
                last, ahead = (disk.ride.state(self.t + s * h)[0] for s in (-0.5, 0.5))
                disk.body.position, disk.body.velocity = last, (ahead - last) / h
        self.world.space.step(h)
        self.steps += 1
        before = {disk: (disk.x, disk.v, disk.omega) for disk in self.live.values()}
        for disk in self.live.values():
            disk.met, disk.meets, disk.fastest, disk.loose = disk.meets, set(), 0.0, False
            if disk.ride is not None:
                disk.x, disk.v = disk.ride.state(then)
            else:
                disk.v, disk.omega = disk.body.velocity, disk.body.angular_velocity
                disk.x = disk.body.position + 0.5 * h * disk.v
        self._knots_before(before)
        self.t = then
        for disk, contact, first in self.touched:
            if disk.ride is None:
                self._touch(disk, before[disk], contact, first)
        for one, other, normal, impulse, first in self.pairs:
            self._collide(one, other, before, (normal, impulse), first)
        self._after_step()

    def _knots_before(self, before: dict[Disk, tuple[Vec2d, Vec2d, float]]) -> None:
        """Write the states from which contacts begin and end; flight needs no others."""
        for disk, contact, _ in self.touched:
            disk.meets.add(contact.face)
        for one, other, *_ in self.pairs:
            one.meets.add(other)
            other.meets.add(one)
        for disk in self.live.values():
            if disk.ride is None and bool(disk.meets) != bool(disk.met):
                disk.track.knot(self.t, *before[disk])

    def _touch(
        self, disk: Disk, before: tuple[Vec2d, Vec2d, float], contact: Contact, first: bool
    ) -> None:
        """Book a contact with a surface."""
        face, normal, impulse = contact
        disk.track.book(contact, before[1:], disk.state)
        tangent = Vec2d(normal.y, -normal.x)
        slip = disk.v.dot(tangent) + self.r * disk.omega - face.belt(normal)
        disk.fastest = max(disk.fastest, abs(slip), abs(disk.v.dot(normal)))
        approach = -before[1].dot(normal)
        if impulse.dot(normal) > 0.0 and approach <= 2.0 * self.g * self.h:
            if disk.on != face.surface:
                self._part(disk)
            disk.on, disk.stays = face.surface, disk.stays + 1
            disk.left = self.t, disk.x, disk.state
        lands = face.surface == self.machine.landing
        disk.loose |= face.speed != 0.0 and not lands
        if approach > 2.0 * self.g * self.h and disk.on != face.surface:
            self._part(disk)
        if lands and not disk.landed and impulse.dot(normal) > 0.0:
            disk.landed, kind = True, Kind.LANDING
        elif first and approach > self.g * self.h:
            kind = Kind.IMPACT
        else:
            return
        self.recorder.contacts += 1
        disk.track.event(kind, self.t, disk.x, disk.state, before[1:], contact)

    def _collide(
        self,
        one: Disk,
        other: Disk,
        before: dict[Disk, tuple[Vec2d, Vec2d, float]],
        push: tuple[Vec2d, Vec2d],
        first: bool,
    ) -> None:
        """Book a contact of two: half of the loss each; a belt holds whom it carries."""
        normal, impulse = push
        tangent = Vec2d(normal.y, -normal.x)
        (u, w), (a, b) = ((0.5 * (before[d][1] + d.v), 0.5 * (before[d][2] + d.omega))
                          for d in (one, other))  # fmt: skip
        closing, slip = (u - a).dot(normal), (u - a).dot(tangent) + self.r * (w + b)
        lost = -impulse.dot(normal) * closing, -impulse.dot(tangent) * slip
        for disk, mean, sign in ((one, u, -1.0), (other, a, 1.0)):
            disk.track.pay(-1, 0.0, 0.5 * lost[0], 0.5 * lost[1])
            if disk.ride is not None:
                disk.track.pay(disk.ride.surface, sign * impulse.dot(mean), 0.0, 0.0)
        relative = one.v - other.v
        slips = relative.dot(tangent) + self.r * (one.omega + other.omega)
        for disk in (one, other):
            disk.fastest = max(disk.fastest, abs(slips), abs(relative.dot(normal)))
        approach = -(before[one][1] - before[other][1]).dot(normal)
        if first and approach > self.g * self.h:
            self.recorder.contacts += 1
            self.recorder.events(
                Kind.COLLISION, one.number, self.t, tuple(one.x), tuple(one.v), one.omega,
                velocity_before=tuple(before[one][1]), omega_before=before[one][2],
                surface=len(self.machine.surfaces), other=other.number,
                normal_impulse=impulse.dot(normal), tangential_impulse=impulse.dot(tangent),
            )  # fmt: skip

    def _after_step(self) -> None:
        """Write knots; end rides, landings, exits and, when all are still, the run."""
        left, right, bottom, top = self.box
        for disk in list(self.live.values()):
            if disk.ride is not None:
                self._carried(disk)
                continue
            if disk.meets:
                disk.track.sample(self.t, disk.x, disk.v, disk.omega)
            still = disk.meets and not disk.loose and disk.fastest <= STILL
            disk.calm = disk.calm + self.h if still else 0.0
            if disk.landed and self.machine.until == "landed":
                self._end(disk, "landed")
            elif not (left <= disk.x.x <= right and bottom <= disk.x.y <= top):
                disk.track.knot(self.t, disk.x, disk.v, disk.omega)
                disk.track.event(Kind.EXIT, self.t, disk.x, disk.state)
                self._end(disk, "exit")
        calm = not self.waiting and all(disk.calm >= CALM for disk in self.live.values())
        if calm and self.machine.until == "settled":
            for disk in list(self.live.values()):
                disk.track.event(Kind.SETTLE, self.t, disk.x, disk.state, surface=disk.on)
                self._end(disk, "settled")

    def _part(self, disk: Disk) -> None:
        """End a contact; one that lasted with an event where the surface pushed last."""
        if disk.left is not None and disk.stays >= STAY:
            t, x, state = disk.left
            disk.track.event(Kind.SEPARATION, t, x, state, surface=disk.on)
        disk.on, disk.stays, disk.left = -1, 0, None

    def _carried(self, disk: Disk) -> None:
        """Let a carried particle go when its time comes, else note where it is."""
        ride = disk.ride
        assert ride is not None
        if self.t < ride.until:
            return
        ride.write(disk.track, ride.until)
        x, v = ride.state(ride.until)
        disk.track.event(Kind.SEPARATION, ride.until, x, (v, 0.0), surface=ride.surface)
        late = self.t - ride.until
        disk.ride, disk.v = None, v + late * self.pull
        disk.x = x + 0.5 * late * (v + disk.v)
        self.world.space.remove(disk.body, disk.circle)
        del self.live[disk.circle]
        old = disk.circle
        disk.body, disk.circle = self.world.disk()
        disk.circle.elasticity, disk.circle.friction = old.elasticity, old.friction
        disk.body.position, disk.body.velocity = disk.x - 0.5 * self.h * disk.v, disk.v
        self.live[disk.circle] = disk
        self.world.space.add(disk.body, disk.circle)
        disk.meets = set()

    # The end

    def _end(self, disk: Disk, reason: str) -> None:
        disk.track.finish(REASONS.index(reason))
        self.world.space.remove(disk.body, disk.circle)
        del self.live[disk.circle]

    def _stop(self) -> None:
        """End what is left."""
        for disk in list(self.live.values()):
            if disk.ride is not None:
                disk.ride.write(disk.track, self.t)
            else:
                disk.track.knot(self.t, disk.x, disk.v, disk.omega)
            self._end(disk, "time")
