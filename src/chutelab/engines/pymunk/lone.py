"""One particle whose steps end at its contacts (``align = true``).

Flight is stepped with the velocity half a step ahead, which makes Chipmunk's integrator exact. When
a flight ends is asked of Chipmunk's own distance queries along its parabola; what the contact does,
of `Space.step`. A lasting contact is stepped by the midpoint rule: the contact is solved half-way
through the step, with the velocities at its ends.

Not resolved, whatever the step: bounces lower than two hairs, h = 2 `World.hair`, some 1e-13 m. The
particle lies by 2 √(2 h/g)/(1 - ε) too early, some 1e-6 s.
"""

from __future__ import annotations

from collections.abc import Callable, Collection
from math import ceil, inf, sqrt
from operator import itemgetter
from typing import Any, NamedTuple

import numpy as np
import pymunk
from pymunk import Vec2d

from chutelab.engines.pymunk.world import (
    PARTICLE,
    SURFACE,
    Carriage,
    Face,
    Tracks,
    World,
    longest,
    time_out,
)
from chutelab.machine import Machine
from chutelab.results import REASONS, Kind
from chutelab.results.recorder import Recorder, StalledError

# Of a surface and its normal: its restitution, None where it is to be passed.
Law = Callable[[Face, Vec2d], float | None]

WEDGED = 1000
"""Iterations of Chipmunk's solver for a disk held by several surfaces, each of which takes off a
share: a wedge of 5° needs 200. One is exact for one contact."""

INSTANT = 1e-30
"""s; the step that resolves a blow: nothing moves in it."""

TINY = 1e-12
"""Share of 1 m/s plus the particle's speed; an approach this slow is a touch, no blow."""

SEAM = 1e-6
"""The same in a lasting contact, where a surface goes on in the next one."""

STRIDE = 0.5
"""Share of the radius that a step of a lasting contact may always be long: it meets every end."""

STILL = 1e-6
"""Share of a free fall's gain; a step that changes the velocity by less changes nothing."""

LEVERS = 2.0
"""Share of hair over radius by which levers, and with them the speed of a rim, may be off."""

SLACK = 1e-9
"""Share of the friction limit below which a contact is held to grip."""

FIRST = 1e-3
"""Share of a step after which a surface just left is looked at again."""

SHORT = 1e-5
"""Share of a step; a contact that lasts less has ended."""

WINDOW = 10_000
"""Blows at one instant of a particle that does not get on; queries on one flight, at most."""

TICK = 1e-12
"""s; blows closer to each other are at one instant."""

LOW = 2.0
"""Hairs; bounces lower than this cannot be told from lying on the surface."""

TURNS = 200
"""Blows at one instant, one surface after the other, before all are solved together."""


class Contact(NamedTuple):
    """What Chipmunk did at one contact in one step.

    Impulses (N s) act on the particle, `push` along the normal n, `rub` along (n_y, -n_x).
    """

    face: Face
    normal: Vec2d
    push: float
    rub: float


class Ridden(NamedTuple):
    """End of a trial step in a lasting contact."""

    x: Vec2d
    v: Vec2d
    omega: float
    pushed: list[Contact]
    middle: Vec2d

    @property
    def slips(self) -> int:
        """Which way friction acts where it is used up, 0 if it is nowhere."""
        for c in self.pushed:
            if abs(c.rub) >= c.face.friction * c.push * (1.0 - SLACK):
                return 1 if c.rub >= 0.0 else -1
        return 0


class Lone:
    """Runs one particle from its release to its end."""

    def __init__(self, machine: Machine, world: World, recorder: Recorder, particle: int) -> None:
        self.machine, self.world = machine, world
        self.tracks = Tracks(recorder, machine.particle.radius, range(particle, particle + 1))
        self.entries = recorder.entries[particle]
        self.recorder, self.particle = recorder, particle
        p, start = machine.particle, machine.releases
        self.r, self.g, self.dt = p.radius, machine.gravity, machine.dt
        self.pull = Vec2d(0.0, -self.g)
        self.t = float(start.t[particle])
        self.x = Vec2d(*start.position[particle].tolist())
        self.v = Vec2d(*start.velocity[particle].tolist())
        self.omega = 0.0
        self.body, self.circle = world.disk()
        world.space.add(self.body, self.circle)
        world.space.on_collision(PARTICLE, SURFACE, pre_solve=self._before, post_solve=self._after)
        # Rounding tilts normals, and a speed along a surface is then one into it.
        self.tiny = max(TINY, world.rounding / self.r)
        self.law: Law = _ignore
        self.contacts: list[Contact] = []
        self.on = -1
        self.slipping: int | None = None
        self.ended = self.landed = False
        self.steps, self.last = 0, 0.0
        self.blows, self.struck = 0, -inf

    def run(self) -> None:
        """Run to the end."""
        if self.t >= self.machine.end_time:
            return
        self.tracks.knot(0, self.t, self.x, self.v, self.omega)
        self._tell(Kind.RELEASE)
        if self.machine.releases.carried[self.particle]:
            self._carry()
            if not (self.ended or self._approached(self._touching())):
                self._fly(self._touching())
        while not self.ended:
            touching = self._touching()
            if self._approached(touching):
                self._blow(touching)
            elif not self._ride(touching):
                self._fly(touching)
        self.world.space.remove(self.body, self.circle)

    # What Chipmunk asks and tells

    def _before(self, arbiter: pymunk.Arbiter, _space: pymunk.Space, _data: Any) -> None:
        face = self.world.by_shape[arbiter.shapes[1]]
        normal = -arbiter.normal
        restitution = self.law(face, normal)
        arbiter.process_collision = restitution is not None
        if restitution is None:
            return
        arbiter.restitution, arbiter.friction = restitution, face.friction
        if face.tangent is not None and face.speed != 0.0:
            arbiter.surface_velocity = face.belt(normal) * Vec2d(normal.y, -normal.x)

    def _after(self, arbiter: pymunk.Arbiter, _space: pymunk.Space, _data: Any) -> None:
        face, normal = self.world.by_shape[arbiter.shapes[1]], -arbiter.normal
        j = arbiter.total_impulse
        if (push := float(j.dot(normal))) > 0.0:
            self.contacts.append(Contact(face, normal, push, float(j.cross(normal))))

    def _step(
        self, x: Vec2d, v: Vec2d, h: float, pull: Vec2d, law: Law, wedged: bool = False
    ) -> list[Contact]:
        """Let Chipmunk step by h (s); return the contacts that pushed."""
        body, space = self.body, self.world.space
        if h != self.last:
            # Chipmunk keeps impulses for the next step, but right ones only if it is as long.
            space.remove(self.circle)
            space.add(self.circle)
            self.last = h
        body.position, body.velocity, body.angular_velocity = x, v, self.omega
        self.law, space.gravity, self.contacts = law, pull, []
        space.iterations = WEDGED if wedged else 1
        space.step(h)
        self.steps += 1
        return self.contacts

    # Distances

    def _curved(self, face: Face, x: Vec2d) -> bool:
        """Tell whether what is nearest is the pulley or the end of a segment."""
        point = face.shape.point_query(x).point
        return not face.ends or min((point - e).length for e in face.ends) <= self.world.hair

    def _touching(self) -> dict[Face, Vec2d]:
        """Return the surfaces in touch and their normals."""
        found = ((face, *face.gap(self.x)) for face in self.world.faces)
        return {face: normal for face, gap, normal in found if gap <= 0.5 * self.world.hair}

    def _approached(self, touching: dict[Face, Vec2d]) -> bool:
        """Tell whether the particle moves into a surface in touch."""
        slow = (self.tiny if self.on < 0 else max(SEAM, self.tiny)) * (1.0 + self.v.length)
        return any(self.v.dot(normal) < -slow for normal in touching.values())

    # Flight

    def _fly(self, touching: dict[Face, Vec2d]) -> None:
        """Fly to the next contact, the exit or the end."""
        if self.on >= 0:
            self.tracks.knot(0, self.t, self.x, self.v, self.omega)
            self._tell(Kind.SEPARATION, self.on)
        self.on, self.slipping = -1, None
        span, reason = self.machine.end_time - self.t, "time"
        out = time_out(self.machine, self.x, self.v)
        if out < span and self.machine.until != "time":
            span, reason = out, "exit"
        for face in self.world.faces:
            found = self._meets(face, span, face in touching)
            if found < span:
                span, reason = found, ""
        self._soar(span)
        if reason == "exit":
            self._tell(Kind.EXIT)
        if reason:
            self._end(reason)
        else:
            self.tracks.knot(0, self.t, self.x, self.v, self.omega)

    def _soar(self, span: float) -> None:
        """Step freely for a time (s), by `dt` at most."""
        count = ceil(span / self.dt)
        x, v = self.x, self.v + 0.5 * self.dt * self.pull
        for n in range(count):
            h = self.dt if n < count - 1 else span - (count - 1) * self.dt
            if n == count - 1:
                v += 0.5 * (h - self.dt) * self.pull
            self._step(x, v, h, self.pull, _ignore)
            x, v = self.body.position, self.body.velocity
        self.t += span
        self.x, self.v = x, self.v + span * self.pull

    def _meets(self, face: Face, span: float, leaving: bool) -> float:
        """Return when (s from now) the parabola meets a surface, inf if not within `span`.

        All surfaces are convex, and so lie behind the plane through their nearest point: the gap
        stays above gap + rate τ + a τ²/2, a the part of gravity along the normal there. Stepping
        from root to root of that bound never passes a contact, and converges like Newton's method.
        A surface that the flight is leaving along its tangent gives no bound; it is looked at after
        times that grow by half.
        """
        t = last = 0.0
        g, hair = self.g, self.world.hair
        if g == 0.0 and self.v.length == 0.0:
            return inf

        def place(t: float) -> Vec2d:
            return self.x + t * (self.v + 0.5 * t * self.pull)

        for _ in range(WINDOW):
            v = self.v + t * self.pull
            gap, normal = face.gap(place(t))
            rate = v.dot(normal)
            slow = self.tiny * (1.0 + v.length)
            if leaving:
                if gap < -hair and t > 0.0:
                    return longest(lambda t: face.gap(place(t))[0] >= -0.5 * hair, t, last)
                leaving = gap <= hair and (rate <= slow or rate * rate <= 2.0 * LOW * g * hair)
            elif gap <= self.world.rounding:
                # A hair deep or less a curve is grazed, not met.
                graze = v.length * sqrt(2.0 * hair / self.r)
                if rate < -slow and (rate < -graze or not self._curved(face, place(t))):
                    return t
                leaving = True
            ahead, pull = max(gap, 0.0), self.pull.dot(normal)
            square = rate * rate - 2.0 * pull * ahead
            tau = inf
            if square >= 0.0 and rate < 0.0:
                tau = 2.0 * ahead / (sqrt(square) - rate)
            elif pull < 0.0:
                tau = (rate + sqrt(square)) / -pull
            if leaving:
                tau = max(tau, min(0.5 * t + FIRST * self.dt, self.r / (v.length + g * self.dt)))
            if t + tau == t:
                return t
            if t == span:
                return inf
            last, t = t, min(t + tau, span)
        raise self._stalled("it slides past a surface without touching it; lower run.max_time")

    # Blows

    def _blow(self, touching: dict[Face, Vec2d]) -> None:
        """Let Chipmunk resolve the blow from the surface that the particle moves into fastest."""
        before = self.v, self.omega
        if self.on >= 0:
            self.tracks.knot(0, self.t, self.x, self.v, self.omega)
        struck = min(touching, key=lambda face: self.v.dot(touching[face]))
        gap, normal = struck.gap(self.x)
        self.x -= gap * normal
        self.blows = self.blows + 1 if self.t - self.struck < TICK else 0
        self.struck = self.t
        together = self.blows > TURNS

        def law(face: Face, normal: Vec2d) -> float | None:
            return self._restitution(face, normal) if together or face is struck else None

        pushed = self._step(self.x, self.v, INSTANT, Vec2d(0, 0), law, together)
        self.v, self.omega = self.body.velocity, self.body.angular_velocity
        for contact in pushed:
            self._book(contact, before)
            lands = contact.face.surface == self.machine.landing and not self.landed
            self.landed |= lands
            kind = Kind.LANDING if lands else Kind.IMPACT
            self._tell(kind, contact.face.surface, before, contact)
            self.recorder.contacts += 1
        self.tracks.knot(0, self.t, self.x, self.v, self.omega)
        if self.landed and self.machine.until == "landed":
            self._end("landed")
        elif self.blows > WINDOW:
            raise self._stalled(
                f"{WINDOW} blows in no time: it is driven to and fro in a narrow place; move"
                " the surfaces there apart, or lower their restitution"
            )

    def _restitution(self, face: Face, normal: Vec2d) -> float:
        """Return ε, or 0 where a rebound would be too slow or too low."""
        approach, weight = -self.v.dot(normal), -self.pull.dot(normal)
        rebound = face.restitution * approach
        touch = approach <= self.tiny * (1.0 + self.v.length)
        low = rebound * rebound < 2.0 * LOW * self.world.hair * weight
        return 0.0 if touch or low else face.restitution

    # Lasting contact

    def _ride(self, touching: dict[Face, Vec2d]) -> bool:
        """Step on in contact; False if no surface pushes."""
        slow = SEAM * (1.0 + self.v.length)
        if all(self.v.dot(normal) > slow for normal in touching.values()):
            return False
        h = min(self.dt, self.machine.end_time - self.t)
        speed = self.v.length + self.g * self.dt
        rims = {face for face in touching if self._curved(face, self.x)}
        h = min(h, self._room(touching, rims) / speed) if speed > 0.0 else h

        def trial(span: float) -> Ridden:
            return self._ridden(span, touching)

        def holds(span: float) -> bool:
            end = trial(span)
            faces = {c.face for c in end.pushed}
            return bool(faces) and not any(self._curved(f, end.middle) for f in faces - rims)

        def clear(end: Ridden) -> bool:
            others = set(self.world.faces).difference(c.face for c in end.pushed)
            return all(face.gap(end.x)[0] >= -0.25 * self.world.hair for face in others)

        # What half of a step twice as long finds goes for the end of this one.
        floor = SHORT * h
        if not holds(2.0 * h):
            h = 0.5 * longest(holds, 2.0 * h, floor) if holds(floor) else 0.0
            if h <= floor:
                return False
        end = trial(h)
        if not clear(end):
            h = longest(lambda span: clear(trial(span)), h, 0.0)
            end = trial(h)
        if self.slipping and end.slips != self.slipping:
            # It grips, or turns back.
            h = longest(lambda span: trial(span).slips == self.slipping, h, floor, upper=True)
            end = trial(h)
        if self.machine.until == "settled" and self._lies(end, h):
            surface = end.pushed[0].face.surface
            if self.slipping != 0:
                self._tell(Kind.STICK, surface)
            self._tell(Kind.SETTLE, surface)
            self._end("settled")
        else:
            self._accept(end, h)
        return True

    def _room(self, touching: Collection[Face], rims: Collection[Face]) -> float:
        """Return the way (m) of a step on which it meets every end and every other surface."""
        room = STRIDE * self.r
        if rims:
            return room
        ends = [(self.x - end).length - self.r for face in touching for end in face.ends]
        others = [face.gap(self.x)[0] for face in self.world.faces if face not in touching]
        return max(room, min(ends + others))

    def _ridden(self, h: float, touching: dict[Face, Vec2d]) -> Ridden:
        """Return where a step in contact leads, without taking it.

        The contact is solved half-way. There ε turns round the normal velocity that a curved
        surface gives the particle: v_n goes out as -v_n (v1/v0)², which keeps it on the circle, and
        gives the normal impulse of the speed half-way. On a face v_n is 0.
        """
        middle = self.x + 0.5 * h * self.v
        gap, normal = min((face.gap(middle) for face in touching), key=itemgetter(0))
        middle -= gap * normal
        turn, wedged = 1.0, len(touching) > 1

        def law(face: Face, normal: Vec2d) -> float | None:
            if face not in touching:
                return None
            return turn if self.v.dot(normal) > 0.0 else 0.0

        contacts = self._step(middle - h * self.v, self.v, h, self.pull, law, wedged)
        if self.v.dot(normal) > SEAM * (1.0 + self.v.length):
            turn = (self.body.velocity.length / self.v.length) ** 2
            contacts = self._step(middle - h * self.v, self.v, h, self.pull, law, wedged)
        v, omega = self.body.velocity, self.body.angular_velocity
        x = middle + 0.5 * h * v
        for contact in contacts:
            gap, normal = contact.face.gap(x)
            x -= gap * normal
            if len(contacts) == 1 and self._curved(contact.face, middle):
                v -= v.dot(normal) * normal
        return Ridden(x, v, omega, contacts, middle)

    def _accept(self, end: Ridden, h: float) -> None:
        """Take a step that was tried."""
        before, entries = (*self.x, *self.v, self.omega), self.entries[:, None].copy()
        motion = self.v, self.omega
        pushed = end.pushed
        slips, on = end.slips, pushed[0].face.surface if pushed else self.on
        began, changed = self.slipping is None, bool(slips) != bool(self.slipping)
        self.on, self.slipping = on, slips
        if began and not slips:
            self._tell(Kind.STICK, on)
        self.x, self.v, self.omega = end.x, end.v, end.omega
        self.t += h
        if changed and not began:
            self._tell(Kind.SLIP if slips else Kind.STICK, on)
        for contact in pushed:
            self._book(contact, motion)
        state = np.array([before, (*self.x, *self.v, self.omega)])[:, :, None]
        self.tracks.step(np.array([True]), (self.t - h, self.t), state, entries)
        if self.t >= self.machine.end_time:
            self._end("time")

    def _lies(self, end: Ridden, h: float) -> bool:
        """Tell whether a step without slip changed nothing, on a surface to settle on.

        In a wedge friction may be used up where nothing slips: it is the motion that counts.
        """
        rim = max(self.v.length, self.r * abs(self.omega))
        still = STILL * self.g * h + LEVERS * self.world.hair / self.r * rim
        return (
            bool(end.pushed)
            and (end.v - self.v).length <= still
            and self.r * abs(end.omega - self.omega) <= still
            and all(
                abs(end.v.cross(c.normal) + self.r * end.omega - c.face.belt(c.normal)) <= still
                and (c.face.speed == 0.0 or c.face.surface == self.machine.landing)
                for c in end.pushed
            )
        )

    def _carry(self) -> None:
        """Ride by adhesion, see `Carriage`."""
        belt = self.machine.pulley
        assert belt is not None
        if self.v.x == 0.0 and self.machine.until == "settled":
            self._tell(Kind.SETTLE, belt.surface)
            self._end("settled")
            return
        ride = Carriage(self.machine, self.world, self.particle, self.t)
        self.t, (self.x, self.v) = ride.until, ride.state(ride.until)
        ride.write(self.recorder, self.t)
        if self.t >= self.machine.end_time:
            self._end("time")
        else:
            self._tell(Kind.SEPARATION, belt.surface)

    # The end

    def _end(self, reason: str) -> None:
        self.ended = True
        self.tracks.knot(0, self.t, self.x, self.v, self.omega)
        self.recorder.ended[self.particle] = REASONS.index(reason)

    def _tell(
        self, kind: Kind, surface: int = -1, before: tuple[Vec2d, float] | None = None,
        contact: Contact | None = None,
    ) -> None:  # fmt: skip
        """Write an event; of a blow with its impulses."""
        v, omega = before or (self.v, self.omega)
        self.recorder.events(
            kind, self.particle, self.t, self.x, self.v, self.omega, velocity_before=v,
            omega_before=omega, surface=surface, normal_impulse=contact.push if contact else 0.0,
            tangential_impulse=contact.rub if contact else 0.0,
        )  # fmt: skip

    def _book(self, contact: Contact, before: tuple[Vec2d, float]) -> None:
        """Book an impulse J: J·(u before + u now)/2, u the relative velocity at the contact."""
        v, omega = 0.5 * (before[0] + self.v), 0.5 * (before[1] + self.omega)
        belt = contact.face.belt(contact.normal)
        slip = v.cross(contact.normal) + self.r * omega - belt
        self.recorder.book(
            self.particle, contact.face.surface, contact.rub * belt,
            -contact.push * v.dot(contact.normal), -contact.rub * slip,
        )  # fmt: skip

    def _stalled(self, reason: str) -> StalledError:
        self._end("time")
        return StalledError(self.particle, self.t, (self.x.x, self.x.y), reason)


def _ignore(_face: Face, _normal: Vec2d) -> None:
    """Let nothing collide: when a flight ends is known before it is stepped."""
