"""One particle whose steps end at its contacts (``align = true``).

Each step drifts for its first half, has Chipmunk change the velocity there, and drifts on: exact in
free flight, of order 2 in lasting contact. The time at which a flight meets a surface comes from
Chipmunk's distance queries along its parabola; an impact is a step that takes no time.

Not resolved, whatever the step: bounces lower than h = 2 `World.hair`, some 1e-13 m. The particle
comes to rest by 2 √(2 h/g)/(1 - ε) too early, some 1e-6 s.
"""

from __future__ import annotations

from functools import cache, cached_property
from math import copysign, inf
from operator import itemgetter
from typing import Any, NamedTuple

import numpy as np
import pymunk
from pymunk import Vec2d

from chutelab.engines.pymunk.faces import Face, Flight
from chutelab.engines.pymunk.world import LOW, PARTICLE, SHORT, SURFACE, Carriage, World
from chutelab.machine import Machine
from chutelab.results.recorder import EnoughError, Recorder, StalledError, Tracks
from chutelab.results.rows import REASONS, Kind
from chutelab.util.arrays import Progress, bisected

WEDGED = 1000
"""Iterations of Chipmunk's solver for a disk held by several surfaces; a wedge of 5° needs 200. For
one contact a single iteration is exact."""

INSTANT = 1e-30
"""s; step that resolves an impact: nothing moves in it."""

SEAM = 1e-6
"""Share of the sum of `Machine.pace` (m/s) and the particle's speed. In a lasting contact, at the
joint of two surfaces, a slower approach is not an impact."""

STRIDE = 0.5
"""Share of the radius by which a step of a lasting contact may move: no end is passed unnoticed."""

STILL = 1e-6
"""Share of the speed gained in free fall; a step that changes the velocity by less changes
nothing."""

LEVERS = 2.0
"""Error of levers, and so of rim speeds, in units of hair over radius."""

SLACK = 1e-9
"""A load below this share of the weight is none; friction below the limit by more than this share
grips."""

TILT = 2e-13
"""Without gravity, an impulse below this share of the momentum is no load: rounding tilts normals
by so much."""

ROLLS = 20
"""Most tries for the couple that stops the rotation: three suffice unless friction slips."""

WINDOW, GAINED = 30_000, 100
"""In so many steps of Chipmunk's a particle must advance by so many `run.dt`, else it is stuck.
They take 2 to 8 s. A ride round 1/1000 of the radius at 1 m/s needs a third of them."""

TURNS = 200
"""Impacts at one instant, one surface after the other, before all are solved together."""


NOTHING, EVERYTHING = pymunk.ShapeFilter(mask=0), pymunk.ShapeFilter()
"""What a disk collides with in flight, and else."""


class Contact(NamedTuple):
    """The impulses of one contact in one step.

    Impulses (N s) act on the particle, `push` along the normal n, `rub` along (n_y, -n_x); `belt`
    (m/s) is the surface's speed there, and `couple` (N m s) that of rolling friction.
    """

    face: Face
    normal: Vec2d
    push: float
    rub: float
    belt: float
    couple: float = 0.0


class Step(NamedTuple):
    """A trial step in lasting contact: the state at its end, the place half-way."""

    x: Vec2d
    v: Vec2d
    omega: float
    contacts: list[Contact]
    middle: Vec2d

    @property
    def slips(self) -> int:
        """Sign of the friction where it reaches its limit, 0 if it does nowhere."""
        for c in self.contacts:
            if abs(c.rub) >= c.face.friction * c.push * (1.0 - SLACK):
                # Without friction its sign is rounding.
                return 1 if c.rub >= 0.0 or not c.face.friction else -1
        return 0


class Lone:
    """Runs one particle from its release to its end."""

    def __init__(
        self, machine: Machine, world: World, recorder: Recorder, particle: int, report: Progress
    ) -> None:
        self.machine, self.world = machine, world
        self.entries = recorder.entries[particle]
        self.recorder, self.particle, self.report = recorder, particle, report
        start = machine.releases
        self.r, self.g, self.dt = world.radius, machine.gravity, machine.dt
        self.pull, self.pace = Vec2d(*(-self.g * machine.up).tolist()), world.pace
        self.t = self.begin = float(start.t[particle])
        self.x = Vec2d(*start.position[particle].tolist())
        self.v = Vec2d(*start.velocity[particle].tolist())
        self.omega = float(start.omega[particle])
        self.body, self.circle = world.disk(particle)
        self.weight = self.body.mass * self.g
        # Arm of rolling friction, m; 0 without rotation.
        turns = self.body.moment < inf
        self.arm = float(machine.rolling[start.kind[particle]]) * self.r if turns else 0.0
        world.space.add(self.body, self.circle)
        world.space.on_collision(PARTICLE, SURFACE, pre_solve=self._before, post_solve=self._after)
        # The restitution of each surface that may be met in a step; its contacts.
        self.restitution: dict[Face, float] = {}
        self.contacts: list[Contact] = []
        # The last knot, unless `tracks` knows it.
        self.known: tuple[float, ...] = ()
        # The surface that it lies on, -1 for none; `Step.slips` there, None at the beginning.
        self.on = -1
        self.slipping: int | None = None
        self.ended = self.landed = False
        # The surfaces that exist now, until when that holds, and gates that closed on the particle.
        self.faces, self.changes, self.shut = world.faces, inf, set[Face]()
        if world.gates:
            self.faces = [face for face in world.faces if face.appears <= self.t < face.vanishes]
        # The length of the last step, and whether Chipmunk keeps impulses of a contact.
        self.steps, self.last, self.solved = 0, 0.0, False
        self.blows, self.struck = 0, -inf

    def run(self) -> None:
        """Run to the end."""
        if self.t >= self.machine.end_time:
            return
        self._knot()
        self._tell(Kind.RELEASE)
        # A carried particle is released where no surface holds it.
        released = bool(self.machine.releases.carried[self.particle])
        if released:
            self._carry()
        begin, done, rounds = self.t, self.steps, 0
        while not self.ended:
            self._look()
            if self.world.gates and not released:
                every = self.world.faces
                self.world.set_clock(self.t)
                there = [face for face in every if face.appears <= self.t < face.vanishes]
                # A gate that closed on the particle acts once the particle is clear of it.
                inside = {face for face in there if face.gap(self.x)[0] < -self.world.hair}
                self.shut = inside.difference(self.faces)
                self.faces = [face for face in there if face not in self.shut]
                ahead = (t for face in every for t in (face.appears, face.vanishes))
                self.changes = min(t for t in (*ahead, inf) if t > self.t)
            touching, room = {}, inf
            near = {face: face.gap(self.x) for face in self.faces}
            for face, (gap, normal) in near.items():
                if gap <= 0.5 * self.world.hair:
                    touching[face] = normal
                else:
                    room = min(room, gap)
            slow = max(self.world.tiny, SEAM if self.on >= 0 else 0.0) * (self.pace + self.v.length)
            if any(self.v.dot(normal) < -slow for normal in touching.values()):
                self._blow(touching, near)
            elif released or not self._ride(touching, room):
                self._fly(touching, near)
            released = False
            rounds += 1
            if self.t - begin >= GAINED * self.dt:
                begin, done, rounds = self.t, self.steps, 0
            elif self.blows > 2 * TURNS:
                self._stall("its blows never end")
            elif self.steps - done + rounds > WINDOW:
                self._stall(f"{WINDOW} steps gain less than {GAINED} times run.dt")
        space, none = self.world.space, pymunk.empty_callback
        space.remove(self.body, self.circle)
        # Else its arrays would wait for the garbage collector, as the Space and its shapes do.
        space.on_collision(PARTICLE, SURFACE, pre_solve=none, post_solve=none)
        self._look()

    def _look(self) -> None:
        """Report the progress; end the track here if the caller asks for it."""
        end = self.machine.end_time
        left = 0.0 if self.ended else (end - self.t) / (end - self.begin)
        try:
            self.report((self.particle + 1.0 - left) / self.machine.count)
        except EnoughError:
            if not self.ended:
                self._end("stopped")
            raise

    def _stall(self, why: str) -> None:
        """Raise a `StalledError`, unless the track has ended."""
        if self.ended:
            return
        self._end("time")
        raise StalledError(
            self.particle, self.t, (self.x.x, self.x.y),
            f"{why}: it goes to and fro, or round, in a narrow place; move the surfaces there"
            " apart, lower their restitution, or take another engine",
        )  # fmt: skip

    # Chipmunk

    def _step(self, x: Vec2d, v: Vec2d, omega: float, h: float, g: Vec2d) -> list[Contact]:
        """Have Chipmunk move the particle by v h, then change its velocity; return the contacts."""
        body, space = self.body, self.world.space
        for face in self.restitution:
            face.put(x + h * v)
        if h != self.last and self.solved:
            # Chipmunk starts from the impulses that it keeps, which is right only for a step of
            # equal length.
            space.remove(self.circle)
            space.add(self.circle)
            self.solved = False
        self.last = h
        body.position, body.velocity, body.angular_velocity = x, v, omega
        space.gravity, self.contacts = g, []
        space.iterations = WEDGED if len(self.restitution) > 1 else 1
        space.step(h)
        self.steps += 1
        return self.contacts

    def _rolled(self, x: Vec2d, v: Vec2d, h: float, g: Vec2d) -> list[Contact]:
        """Step, with the couple by which rolling friction opposes the spin.

        It is applied before the step, so that friction balances it. It is the largest that the
        normal impulses allow, or what stops the rotation, found between 0 and that.
        """
        contacts = self._step(x, v, self.omega, h, g)
        if not self.arm or not contacts:
            return contacts
        couple, spin, moment = 0.0, contacts[0].face.spin, self.body.moment
        ends = [(couple, self.body.angular_velocity - spin)]
        least = self.world.tiny * (self.pace + v.length) / self.r
        while abs(after := ends[-1][1]) > max(SLACK * abs(couple) / moment, least):
            if len(ends) == ROLLS:
                break
            opposite = [end for end in ends if end[1] * after < 0.0]
            if opposite:
                low, one = opposite[-1]
                couple = (low * after - couple * one) / (after - one)
            elif len(ends) == 1:
                couple = -copysign(self.arm * sum(c.push for c in contacts), after)
            else:
                break
            contacts = self._step(x, v, self.omega + couple / moment, h, g)
            ends.append((couple, self.body.angular_velocity - spin))
        pushes = sum(contact.push for contact in contacts)
        return [c._replace(couple=couple * c.push / pushes) for c in contacts]

    def _before(self, arbiter: pymunk.Arbiter, _space: pymunk.Space, _data: Any) -> None:
        face, normal = self.world.by_shape[arbiter.shapes[1]], -arbiter.normal
        restitution = self.restitution.get(face)
        arbiter.process_collision = restitution is not None
        if restitution is not None:
            self.solved = True
            arbiter.restitution, arbiter.friction = restitution, face.friction
            if not face.turns and face.speed != 0.0:
                arbiter.surface_velocity = face.belt(normal) * Vec2d(normal.y, -normal.x)

    def _after(self, arbiter: pymunk.Arbiter, _space: pymunk.Space, _data: Any) -> None:
        face, normal = self.world.by_shape[arbiter.shapes[1]], -arbiter.normal
        j, least = arbiter.total_impulse, SLACK * self.weight * self.last
        if self.weight == 0.0:
            least = TILT * self.body.mass * self.v.length
        if (push := float(j.dot(normal))) > least:
            rub = float(j.cross(normal))
            self.contacts.append(Contact(face, normal, push, rub, face.belt(normal)))

    # Flight and blows

    def _fly(self, touching: dict[Face, Vec2d], near: dict[Face, tuple[float, Vec2d]]) -> None:
        """Fly to the next contact, the exit or the end."""
        if self.on >= 0:
            self._knot()
            self._tell(Kind.SEPARATION, self.on)
        self.on, self.slipping = -1, None
        path = Flight(self.x, self.v, self.pull)
        span, reason = self.machine.end_time - self.t, "time"
        if (out := path.leaves(self.machine.releases.exit_box[self.particle])) < span:
            span, reason = out, "exit"
        if self.changes - self.t < span:
            span, reason = self.changes - self.t, ""
        for face in self.shut:
            if (clear := self.world.clear(path, face, span)) < span:
                span, reason = clear, ""
        for face in self.faces:
            met = self.world.meets(path, face, span, face in touching, near=near[face])
            if met < span:
                span, reason = met, ""
        if span > 0.0:
            # Exact, so one step is enough.
            self.restitution, self.circle.filter = {}, NOTHING
            self._step(self.x, Vec2d(*path.at(0.5 * span)[1]), self.omega, span, self.pull)
            self.circle.filter = EVERYTHING
            self.t += span
            self.x, self.v = self.body.position, Vec2d(*path.at(span)[1])
        if reason:
            self._end(reason, Kind.EXIT if reason == "exit" else None)
        else:
            self._knot()

    def _blow(self, touching: dict[Face, Vec2d], near: dict[Face, tuple[float, Vec2d]]) -> None:
        """Have Chipmunk resolve the impact on the surface that the particle approaches fastest."""
        before = self.v, self.omega
        if self.on >= 0:
            self._knot()
        struck = min(touching, key=lambda face: self.v.dot(touching[face]))
        gap, normal = near[struck]
        self.x -= gap * normal
        self.blows = self.blows + 1 if self.t == self.struck else 0
        self.struck = self.t
        self.restitution = {struck: self._rebound(struck, normal)}
        if self.blows > TURNS:
            self.restitution = {face: self._rebound(face, n) for face, n in touching.items()}
        pushed = self._rolled(self.x, self.v, INSTANT, Vec2d(0, 0))
        self.v, self.omega = self.body.velocity, self.body.angular_velocity
        for contact in pushed:
            self._book(contact, before)
            self._bear(contact, self.x)
            lands = contact.face.surface == self.machine.landing and not self.landed
            self.landed |= lands
            kind = Kind.LANDING if lands else Kind.IMPACT
            self._tell(kind, contact.face.surface, before, contact.push, contact.rub)
            self.recorder.contacts += 1
        self._knot()
        if self.landed and self.machine.until == "landed":
            self._end("landed")

    def _rebound(self, face: Face, normal: Vec2d) -> float:
        """Return ε, or 0 where a rebound would be too slow or too low."""
        approach, weight = -self.v.dot(normal), -self.pull.dot(normal)
        # Sliding inside an arc, it is also pressed on by the curvature.
        weight += face.hollow(self.x) * self.v.cross(normal) ** 2
        rebound = face.restitution * approach
        touch = approach <= self.world.tiny * (self.pace + self.v.length)
        low = rebound * rebound < 2.0 * LOW * self.world.hair * weight
        return 0.0 if touch or low else face.restitution

    # Lasting contact

    def _ride(self, touching: dict[Face, Vec2d], room: float) -> bool:
        """Step on in contact, `room` (m) away from all else; False if no surface pushes."""
        slow = SEAM * (self.pace + self.v.length)
        if all(self.v.dot(normal) > slow for normal in touching.values()):
            return False
        # The step is so short that no end and no other surface is passed unnoticed.
        rims = {face for face in touching if self.world.curved(face, self.x)}
        if rims:
            room = 0.0
        for face in touching:
            room = min([room, *((self.x - end).length - self.r for end in face.ends)])
        sharpest = max(face.hollow(self.x) for face in touching)
        room = max(room, STRIDE * (1.0 / sharpest if sharpest * self.r > 1.0 else self.r))
        h = min(self.dt, self.machine.end_time - self.t, self.changes - self.t)
        if (speed := self.v.length + self.g * self.dt) > 0.0:
            h = min(h, room / speed)

        @cache
        def trial(h: float) -> Step:
            return self._trial(h, touching)

        def change(h: float) -> str:
            """Return what changes within a step; empty if the step can be taken as it is."""
            # Use the middle of a step twice as long for the end of this one.
            ahead = trial(2.0 * h)
            pushing = {c.face for c in ahead.contacts}
            if not pushing or any(self.world.curved(f, ahead.middle) for f in pushing - rims):
                return "leaves"
            end = trial(h)
            if any(c.face.gap(end.x)[0] == inf for c in end.contacts):
                return "leaves"
            beside = set(self.faces).difference(c.face for c in end.contacts)
            if any(face.gap(end.x)[0] < -0.25 * self.world.hair for face in beside):
                return "meets"
            # It begins to grip, or reverses.
            return "slips" if self.slipping and end.slips != self.slipping else ""

        if change(h):
            least = SHORT * h
            # A belt that grips may at once drive it into another surface that it touches.
            low, high = (0.0, least) if change(least) == "meets" else (least, h)
            before, after = bisected(change, low, high)
            what = change(after)
            if what == "leaves" and before == least:
                return False
            h = after if what == "slips" else before
        end = trial(h)
        pushing = [c.face.surface for c in end.contacts]
        surface = self.on if self.on in pushing or not pushing else pushing[0]
        if self.on >= 0 and surface != self.on:
            # It goes over to another surface without an impact.
            if surface == self.machine.landing and not self.landed:
                self.landed = True
                self._tell(Kind.LANDING, surface)
                if self.machine.until == "landed":
                    self._end("landed")
                    return True
            elif end.slips:
                self._tell(Kind.SLIP, surface)
            self.slipping = end.slips or None
        if self.machine.until == "settled" and self._lies(end, h):
            if self.slipping != 0:
                self._tell(Kind.STICK, surface)
            self._end("settled", Kind.SETTLE, surface)
        else:
            self._take(end, h, surface)
        return True

    def _trial(self, h: float, touching: dict[Face, Vec2d]) -> Step:
        """Return a trial step in contact.

        On a curved surface the particle has a normal velocity v_n at the midpoint (into the surface
        inside an arc). It leaves with -v_n (v1/v0)², which keeps it on the circle and gives the
        normal impulse of the speed half-way. This is Chipmunk's restitution, known after a first
        try. On a flat face v_n is 0.
        """
        middle = self.x + 0.5 * h * self.v
        gaps = {face: face.gap(middle) for face in touching}
        gap, normal = min(gaps.values(), key=itemgetter(0))
        if gap < inf:
            middle -= gap * normal
        self.restitution = {}
        for face, (_, n) in gaps.items():
            into, before = self.v.dot(n), min(self.v.dot(touching[face]), 0.0)
            # Inside an arc the overlap at the start of the step is not due to the curvature.
            bends = into > 0.0 or (into < before and face.hollow(middle) > 0.0)
            self.restitution[face] = 1.0 - max(before / into, 0.0) if bends else 0.0
        contacts = self._rolled(middle - h * self.v, self.v, h, self.pull)
        if abs(self.v.dot(normal)) > SEAM * (self.pace + self.v.length):
            turn = (self.body.velocity.length / self.v.length) ** 2
            self.restitution = {face: turn * one for face, one in self.restitution.items()}
            contacts = self._rolled(middle - h * self.v, self.v, h, self.pull)
        v, omega = self.body.velocity, self.body.angular_velocity
        x = middle + 0.5 * h * v
        for contact in contacts:
            gap, normal = contact.face.gap(x)
            if gap < inf:
                x -= gap * normal
            if len(contacts) == 1 and self.world.curved(contact.face, middle):
                v -= v.dot(normal) * normal
        return Step(x, v, omega, contacts, middle)

    def _take(self, end: Step, h: float, surface: int) -> None:
        """Take a step that was tried."""
        before, entries = (*self.x, *self.v, self.omega), self.entries[:, None].copy()
        motion = self.v, self.omega
        was = self.slipping
        slips = end.slips if end.contacts or was is None else was
        self.on, self.slipping = surface, slips
        if was is None and not slips:
            self._tell(Kind.STICK, surface)
        self.t += h
        self.x, self.v, self.omega = end.x, end.v, end.omega
        if was is not None and bool(slips) != bool(was):
            self._tell(Kind.SLIP if slips else Kind.STICK, surface)
        for contact in end.contacts:
            self._book(contact, motion)
            # On a curved surface its velocity is also turned.
            alone = len(end.contacts) == 1
            gained = end.v - motion[0] - h * self.pull if alone else None
            self._bear(contact, end.middle, h, gained)
        if self.known:
            self.tracks.note(0, self.known)
            self.known = ()
        if self.t > self.tracks.t[0]:
            state = np.array([before, (*self.x, *self.v, self.omega)])[:, :, None]
            self.tracks.step(np.array([True]), (self.t - h, self.t), state, entries)
        if self.t >= self.machine.end_time:
            self._end("time")

    def _lies(self, end: Step, h: float) -> bool:
        """Whether a step without slip changed nothing, on a surface to settle on.

        In a wedge friction may reach its limit without slip, so the motion decides.
        """
        rim = max(self.v.length, self.r * abs(self.omega))
        still = STILL * self.g * h + LEVERS * self.world.hair / self.r * rim
        return (
            bool(end.contacts)
            and (end.v - self.v).length <= still
            and self.r * abs(end.omega - self.omega) <= still
            and all(
                abs(end.v.cross(c.normal) + self.r * end.omega - c.belt) <= still
                and (c.face.speed == 0.0 or c.face.surface == self.machine.landing)
                for c in end.contacts
            )
        )

    def _carry(self) -> None:
        """Ride by adhesion, see `Carriage`."""
        belt = self.machine.pulley
        assert belt is not None
        if self.v.x == 0.0 and self.machine.until == "settled":
            self._end("settled", Kind.SETTLE, belt.surface)
            return
        ride = Carriage(self.machine, self.world, self.particle, self.t)
        self.x, self.v = ride.at(ride.until - ride.t)
        self.t = ride.until
        ride.write(self.recorder, self.t)
        if self.t >= self.machine.end_time:
            self._end("time")
        else:
            self._tell(Kind.SEPARATION, belt.surface)

    # What is written down

    @cached_property
    def tracks(self) -> Tracks:
        """Its knots in lasting contact."""
        return Tracks(self.recorder, self.r, range(self.particle, self.particle + 1))

    def _knot(self) -> None:
        self.recorder.knot(self.particle, self.t, self.x, self.v, self.omega)
        self.known = self.t, *self.x, *self.v, self.omega

    def _end(self, reason: str, kind: Kind | None = None, surface: int = -1) -> None:
        """End the track, with an event of some kinds."""
        if kind is not None:
            self._tell(kind, surface)
        self.ended = True
        self._knot()
        self.recorder.ended[self.particle] = REASONS.index(reason)

    def _tell(
        self, kind: Kind, surface: int = -1, before: tuple[Vec2d, float] | None = None,
        push: float = 0.0, rub: float = 0.0,
    ) -> None:  # fmt: skip
        """Write an event; an impact with its impulses."""
        v, omega = before or (self.v, self.omega)
        self.recorder.event(
            kind, self.particle, self.t, self.x, self.v, self.omega, velocity_before=v,
            omega_before=omega, surface=surface, normal_impulse=push, tangential_impulse=rub,
        )  # fmt: skip

    def _bear(
        self, contact: Contact, x: Vec2d, span: float = 0.0, gained: Vec2d | None = None
    ) -> None:
        """Count an impulse as a load, of a time (s) up to now; `gained` is the whole change of v.

        Without `gained` it is what Chipmunk solved.
        """
        if self.recorder.bins is not None:
            normal = contact.normal
            push = contact.push * normal + contact.rub * Vec2d(normal.y, -normal.x)
            if gained is not None:
                push = self.body.mass * gained
            self.recorder.bins.bear(
                contact.face.surface, self.t - span, self.t, x - self.r * normal, normal, push,
                contact.couple,
            )  # fmt: skip

    def _book(self, contact: Contact, before: tuple[Vec2d, float]) -> None:
        """Book an impulse J: J·(u before + u now)/2, u the relative velocity at the contact."""
        v, omega = 0.5 * (before[0] + self.v), 0.5 * (before[1] + self.omega)
        slip = v.cross(contact.normal) + self.r * omega - contact.belt
        work, heat = contact.rub * contact.belt, -contact.rub * slip
        if contact.couple:
            spin = contact.face.spin
            work, heat = work + contact.couple * spin, heat - contact.couple * (omega - spin)
        loss = -contact.push * v.dot(contact.normal)
        self.recorder.book(self.particle, contact.face.surface, work, loss, heat)
