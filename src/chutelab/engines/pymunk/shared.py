"""All particles in one Space, stepped by `run.dt`: Pymunk as it is.

Chipmunk moves first and then changes velocities, so bodies in the Space stand half a step ahead of
their velocities: with x the place at the velocity's time, the Space holds x - v h/2. Read so, free
flight is exact, and gravity's work is. Contacts are seen up to a step late, at an overlap of up to
v dt: keep v dt below the radius, or disks pass through surfaces.

Releases, separations of carried particles and exits have their own times, contacts that of their
step's end. A ride that friction drives hops, ever longer towards its end, which is put where the
surface pushed last. A disk rises from a rim like a t³/6, with a some 50 m/s³, so a place that is
off by δ shifts the last push by (6 δ/a)^(1/3): in `slip` it is 21, 12, 5 and 4 ms early at 2, 1,
0.5 and 0.25 ms, and no less at shorter steps, as `SLOP`, 4 µm there, stays.
"""

from __future__ import annotations

from math import ceil, inf, sqrt
from typing import Any

import numpy as np
import pymunk
from pymunk import Vec2d, batch

from chutelab.engines.pymunk.world import PARTICLE, Carriage, Flight, Tracks, World
from chutelab.machine import Machine
from chutelab.results import REASONS, Kind
from chutelab.results.recorder import EnoughError, Recorder
from chutelab.util.arrays import Floats, Ints, Progress

SLOP, BIAS = 1e-3, 1e-97
"""Overlap that Chipmunk leaves alone, as a share of the radius, and the share of what is beyond it
that it leaves after 1 s: it takes back a fifth in 1 ms. Its defaults are meant for pixels and 60
steps a second: 0.1 (m here) and 0.9^60, 0.6 % in 1 ms. With those, disks that land without a
rebound, a step late, stay where they sank: in `stream` at 1 ms 1 % of all contacts overlap by
46 % of the radius, with these by 1.4 %. The residual is 3e-4 either way, as all of it is pushed out
at last: that work is no contact's impulse, and the ledger shows it as residual. Without any slop
disks that lie still lose contact every few steps."""

ROLLER = 3
"""Collision type of the ends of moving segments."""

SMALLEST = 1e-12
"""Pair value that stands for 0 where Chipmunk's product of two shapes' values is divided by it."""

STAY, HOP = 5, 50
"""Pushes of one surface that make a ride, and steps without one that end it. A grip of large
friction hops for some steps at a time; the ride ends with its last push."""

CALM, STILL = 0.1, 1e-3
"""s and m/s: who slips and moves less for that long has settled."""

_BODY = (
    batch.BodyFields.BODY_ID
    | batch.BodyFields.POSITION
    | batch.BodyFields.VELOCITY
    | batch.BodyFields.ANGULAR_VELOCITY
)
_ARBITER = (
    batch.ArbiterFields.BODY_A_ID
    | batch.ArbiterFields.BODY_B_ID
    | batch.ArbiterFields.TOTAL_IMPULSE
    | batch.ArbiterFields.IS_FIRST_CONTACT
    | batch.ArbiterFields.NORMAL
)

TOWARDS = np.array([[1.0], [1.0], [-1.0], [-1.0]])
"""Turns Chipmunk's normal, but not its impulse."""


class Shared:
    """Runs all particles together.

    `state` is (2, 5, N + F): before and after the last step; x, y, vx, vy, ω; of N particles, then
    of F faces, which have motion 0: a belt's speed is counted apart. `entries` is (3, N + F).

    Parameters
    ----------
    machine, world, recorder
        The world's Space is used up.
    """

    def __init__(self, machine: Machine, world: World, recorder: Recorder) -> None:
        self.machine, self.world, self.recorder = machine, world, recorder
        self.tracks = Tracks(recorder, machine.particle.radius, range(machine.count))
        self.r, self.g = machine.particle.radius, machine.gravity
        self.pull = Vec2d(0.0, -self.g)
        count = self.count = machine.count
        # A whole number of steps ends the run.
        self.t = self.begin = float(machine.releases.t[0])
        span = machine.end_time - self.begin
        self.most = ceil(span / machine.dt - 1e-9)
        self.h, self.steps, self.clock = span / max(self.most, 1), 0, 0
        self.waiting = np.flatnonzero(machine.releases.t < machine.end_time).tolist()
        self.rides: dict[int, Carriage] = {}
        faces, rows = world.faces, count + len(world.faces)
        self.state, self.entries = np.zeros((2, 5, rows)), np.zeros((3, rows))
        recorder.entries = self.entries[:, :count].T
        self.free, self.inside, self.landed = np.zeros((3, count), dtype=bool)
        self.calm = np.zeros(count)
        self.box = machine.exit_box if machine.until != "time" else (-inf, inf, -inf, inf)
        # The last surface that pushed a particle, how often in a row, the time and the state then.
        self.on, self.pushes = np.full(count, -1), np.zeros(count, dtype=np.int64)
        self.left = np.zeros((6, count))
        about = [(len(machine.surfaces), 0.0, 0.0, 0.0)] * count
        about += [(face.surface, face.speed, *(face.tangent or (0.0, 0.0))) for face in faces]
        surface, self.speed, self.tx, self.ty = np.array(about).T
        self.surface = surface.astype(np.int64)
        self.throws = (self.speed != 0.0) & (self.surface != machine.landing)
        self._fill()

    def _fill(self) -> None:
        """Set up the Space, and make all bodies, so that none gets the id of one that is gone."""
        m, space = self.machine, self.world.space
        space.gravity, space.collision_bias = self.pull, BIAS
        space.collision_slop = SLOP * self.r + self.world.hair
        # What Chipmunk remembers longer it reports in the impulse when two meet again, unapplied.
        space.collision_persistence = 1
        pairs = m.pair_restitution[0, 0], m.pair_friction[0, 0]
        own, grip = (sqrt(max(value, SMALLEST)) for value in pairs)
        space.on_collision(PARTICLE, ROLLER, pre_solve=self._round_end)
        for face in self.world.faces:
            shapes = [face.shape]
            if isinstance(face.shape, pymunk.Segment) and face.speed != 0.0:
                # Neighbours in line keep the segment from what is beyond its ends.
                a, b = face.ends
                face.shape.set_neighbors(a - (b - a), b + (b - a))
                assert face.tangent is not None
                face.shape.surface_velocity = face.speed * face.tangent
                for end in face.ends:
                    shapes.append(pymunk.Circle(face.shape.body, 0.0, end))
                    shapes[-1].collision_type = ROLLER
                    self.world.by_shape[shapes[-1]] = face
                space.add(*shapes[1:])
            for shape in shapes:
                shape.elasticity, shape.friction = face.restitution / own, face.friction / grip
        self.disks = [self.world.disk() for _ in range(self.count)]
        for _, circle in self.disks:
            circle.elasticity, circle.friction = own, grip
            if not m.interact:
                circle.filter = pymunk.ShapeFilter(group=1)
        self.buffer = batch.Buffer()
        # Rows by sorted id of their bodies; the one of the Space itself is nobody's.
        bodies = [body for body, _ in self.disks]
        bodies += [face.shape.body for face in self.world.faces if face.shape.body]
        ids = np.array([body.id for body in bodies], dtype=np.uintp)
        self.row = ids.argsort()
        self.ids = ids[self.row]

    def _round_end(self, arbiter: pymunk.Arbiter, _space: pymunk.Space, _data: Any) -> None:
        """Have the end of a belt move along its rim; beside the face it is not met."""
        disk, end = arbiter.shapes
        assert isinstance(end, pymunk.Circle)
        assert disk.body is not None
        face, normal = self.world.by_shape[end], -arbiter.normal
        out = sum(face.ends, Vec2d(0.0, 0.0)) * -0.5 + end.offset
        arbiter.process_collision = out.dot(disk.body.position - end.offset) > 0.0
        arbiter.surface_velocity = face.belt(normal) * Vec2d(normal.y, -normal.x)

    def run(self, report: Progress) -> None:
        """Run to the end."""
        reason, enough = "time", None
        while self.clock < self.most and (self.waiting or self.inside.any()):
            if not self.inside.any():
                # Nothing to step until the next release.
                due = float(self.machine.releases.t[self.waiting[0]])
                clock = min(int((due - self.begin) / self.h), self.most - 1)
                self.clock = max(self.clock, clock)
                self.t = self.begin + self.clock * self.h
            self._release()
            self._step()
            try:
                report(self.clock / self.most)
            except EnoughError as error:
                enough = error
                self.recorder.ended[self.waiting] = REASONS.index("stopped")
                reason = "stopped"
                break
        for i in np.flatnonzero(self.inside).tolist():
            self._tell_calm(i)
            self._end(i, reason)
        faces = slice(self.count, None)
        np.add.at(self.recorder.by_surface, self.surface[faces], self.entries.T[faces])
        if enough is not None:
            raise enough

    # Releases and rides

    def _release(self) -> None:
        """Release who is due, at a time up to now, if nobody is in the place."""
        starts = self.machine.releases
        for i in list(self.waiting):
            due = float(starts.t[i])
            if due > self.t + 1e-9 * self.h:
                break
            t = due if self.t - due < self.h else self.t
            x, v = Vec2d(*starts.position[i].tolist()), Vec2d(*starts.velocity[i].tolist())
            others = np.flatnonzero(self.inside)
            if self.machine.interact and len(others):
                # Apart now, and when it was due.
                late = max(self.t - t, 0.0)
                now = self.state[1, :2, others] - (x + late * v)
                apart = now, now - late * (self.state[1, 2:4, others] - v)
                if min(float((d * d).sum(axis=1).min()) for d in apart) < 4.0 * self.r**2:
                    continue
            self.waiting.remove(i)
            self.inside[i] = True
            self.recorder.events(Kind.RELEASE, i, t, tuple(x), tuple(v))
            body, circle = self.disks[i]
            self.world.space.add(body, circle)
            if starts.carried[i]:
                ride = self.rides[i] = Carriage(self.machine, self.world, i, t)
                body.body_type = pymunk.Body.KINEMATIC
                body.position, body.velocity = ride.at(self.t - 0.5 * self.h - t)
                self.state[1, :2, i], self.state[1, 2:4, i] = ride.at(self.t - t)
                # A belt that stands holds it for good.
                self.calm[i] = -inf if ride.speed else inf
            else:
                self._free(i, t, x, v)

    def _free(self, i: int, t: float, x: Vec2d, v: Vec2d) -> None:
        """Let a particle fly from where it is at a time (s) up to now."""
        body = self.disks[i][0]
        self.tracks.knot(i, t, x, v)
        late = self.t - t
        now = v + late * self.pull
        x += 0.5 * late * (v + now)
        if late > 0.0:
            # A blow in the next step begins at its start.
            self.tracks.knot(i, self.t, x, now)
        body.position, body.velocity = x - 0.5 * self.h * now, now
        self.state[1, :, i] = *x, *now, 0.0
        self.free[i], self.calm[i] = True, 0.0

    def _ride(self) -> None:
        """Steer who is carried round the pulley through this step; let go whose ride is over."""
        ahead = self.t + 0.5 * self.h
        for i, ride in list(self.rides.items()):
            body, circle = self.disks[i]
            if ride.until <= self.t:
                ride.write(self.recorder, ride.until)
                x, v = ride.at(ride.until - ride.t)
                self.recorder.events(
                    Kind.SEPARATION, i, ride.until, tuple(x), tuple(v), surface=ride.surface
                )
                del self.rides[i]
                p = self.machine.particle
                # Put in anew, what it is in touch with counts as met for the first time.
                self.world.space.remove(body, circle)
                body.body_type = pymunk.Body.DYNAMIC
                body.mass, body.moment = p.mass, p.inertia or inf
                self.world.space.add(body, circle)
                self._free(i, ride.until, x, v)
            elif ahead > ride.top:
                body.velocity = (ride.at(ahead - ride.t)[0] - body.position) / self.h

    # Steps

    def _step(self) -> None:
        """Step all, book what happened, and end who has ended."""
        space = self.world.space
        if self.rides:
            self._ride()
        space.step(self.h)
        self.steps += 1
        self.clock += 1
        t, self.t = self.t, self.begin + self.clock * self.h
        entries = self.entries[:, : self.count].copy()
        self.buffer.clear()
        batch.get_space_bodies(space, _BODY, self.buffer)
        ids = np.frombuffer(self.buffer.int_buf(), dtype=np.uintp)
        self.state[0], after = self.state[1], self.state[1]
        rows = self.row[self.ids.searchsorted(ids)]
        after[:, rows] = np.frombuffer(self.buffer.float_buf()).reshape(-1, 5).T
        after[:2] += (0.5 * self.h) * after[2:4]
        after[:, self.count :] = 0.0
        self._contacts()
        self.tracks.step(self.free, (t, self.t), self.state[..., : self.count], entries)
        self._endings(t, entries)

    def _contacts(self) -> None:
        """Book what pushes, and tell blows, landings and who rides what."""
        self.buffer.clear()
        batch.get_space_arbiters(self.world.space, _ARBITER, self.buffer)
        values = np.frombuffer(self.buffer.float_buf()).reshape(-1, 4).T
        ids = np.frombuffer(self.buffer.int_buf(), dtype=np.uintp).reshape(-1, 3).T
        # The impulse acts on A, the normal points from A to B.
        push = -values[0] * values[2] - values[1] * values[3]
        pushing = push > 0.0
        push, values, ids = push[pushing], values[:, pushing], ids[:, pushing]
        a, b = self.row[self.ids.searchsorted(ids[:2])]
        one, other = np.minimum(a, b), np.maximum(a, b)
        # They come in the order of a hash of addresses, on which no sum may depend.
        order = np.lexsort((push, other, one))
        a, one, other, push = a[order], one[order], other[order], push[order]
        values, ids = values[:, order], ids[:, order]
        jx, jy, nx, ny = np.where(a == one, 1.0, -1.0) * values * TOWARDS
        rub = jx * ny - jy * nx
        speed = self.speed[other]
        belt = np.where(self.tx[other] * ny - self.ty[other] * nx < 0.0, -speed, speed)
        # Of the contact points to each other, before and after: (2, k).
        mine, others = (self.state[:, 2:].take(row, axis=2) for row in (one, other))
        u, v = mine[:, 0] - others[:, 0], mine[:, 1] - others[:, 1]
        rate = u * nx + v * ny
        slip = u * ny - v * nx + self.r * (mine[:, 2] + others[:, 2]) - belt
        # J (u before + u after)/2; then whether the contact is still, and that it is one.
        sums = np.ones((5, len(one)))
        sums[0], sums[1] = rub * belt, -0.5 * push * (rate[0] + rate[1])
        sums[2] = -0.5 * rub * (slip[0] + slip[1])
        sums[3] = (np.abs(rate[1]) < STILL) & (np.abs(slip[1]) < STILL) & ~self.throws[other]
        pair = other < self.count
        self.recorder.by_surface[-1] += sums[:3] @ pair
        for k in np.flatnonzero(pair) if self.rides else ():
            for row, motion, sign in ((one, mine, -0.5), (other, others, 0.5)):
                if (i := int(row[k])) in self.rides:
                    # The belt's work on who hits a particle that it carries.
                    ride = self.rides[i]
                    ride.write(self.recorder, self.t - self.h)
                    mean = motion[0, :2, k] + motion[1, :2, k]
                    work = sign * float(jx[k] * mean[0] + jy[k] * mean[1])
                    self.recorder.book(i, ride.surface, work)
        sums[:3, pair] *= 0.5
        rows = len(self.surface)
        places = np.concatenate((one, other)) + rows * np.arange(5)[:, None]
        weights = np.concatenate((sums, sums), axis=1)
        added = np.bincount(places.ravel(), weights.ravel(), 5 * rows).reshape(5, rows)
        self.entries += added[:3]
        calm = (added[4] > 0.0) & (added[3] == added[4])
        self.calm = np.where(calm[: self.count] | ~self.free, self.calm + self.h, 0.0)
        surface = self.surface[other]
        self._riding(one[~pair], surface[~pair])
        lands = (surface == self.machine.landing) & ~self.landed[one]
        told = np.flatnonzero(lands | (ids[2] != 0) & (rate[0] < -self.g * self.h))
        if len(told):
            self.landed[one[lands]] = True
            self.recorder.contacts += len(told)
            before, after = self.state[:, :, one[told]]
            self.recorder.events(
                np.where(lands, Kind.LANDING, np.where(pair, Kind.COLLISION, Kind.IMPACT))[told],
                one[told], self.t, after[:2].T, after[2:4].T, after[4],
                velocity_before=before[2:4].T, omega_before=before[4], surface=surface[told],
                other=np.where(pair, other, -1)[told],
                normal_impulse=push[told], tangential_impulse=rub[told],
            )  # fmt: skip

    def _riding(self, who: Ints, surface: Ints) -> None:
        """Count pushes of surfaces in a row; tell separations at the last one's time."""
        over = self.left[0] < self.t - HOP * self.h
        over[who[self.on[who] != surface]] = True
        for i in np.flatnonzero(over & (self.pushes >= STAY)):
            t, x, y, vx, vy, omega = self.left[:, i].tolist()
            self.recorder.events(Kind.SEPARATION, i, t, (x, y), (vx, vy), omega, surface=self.on[i])
        self.pushes[over] = 0
        self.pushes[who] += 1
        self.on[who] = surface
        self.left[0, who], self.left[1:, who] = self.t, self.state[1][:, who]

    # The end

    def _endings(self, t: float, entries: Floats) -> None:
        """End who left, landed or settled."""
        until, (left, right, bottom, top) = self.machine.until, self.box
        x, y = self.state[1, :2, : self.count]
        out = (y < bottom) | (y > top) | (x < left) | (x > right)
        for i in np.flatnonzero(out & self.free).tolist():
            begin = Vec2d(*self.state[0, :2, i].tolist())
            v = Vec2d(*self.state[0, 2:4, i].tolist())
            late = Flight(begin, v, self.pull).leaves(self.machine.exit_box)
            if late < self.h and (entries[:, i] == self.entries[:, i]).all():
                # It flew, and left within the step.
                after = v + late * self.pull
                self.state[1, :4, i] = *(begin + 0.5 * late * (v + after)), *after
            else:
                late = self.h
            self._end(i, "exit", t + late, Kind.EXIT)
        if until == "landed":
            for i in np.flatnonzero(self.landed & self.free).tolist():
                self._end(i, "landed")
        calm = self.inside & (self.calm >= CALM)
        together = self.machine.interact and (self.waiting or (self.inside & ~calm).any())
        if until == "settled" and not together:
            for i in np.flatnonzero(calm).tolist():
                self._tell_calm(i)
                self._end(i, "settled", self.t, Kind.SETTLE)

    def _tell_calm(self, i: int) -> None:
        """Tell since when a particle lies calm, if it does: since the end of that step."""
        if i not in self.rides and self.calm[i] >= CALM:
            late, place, speed = self.calm[i] - self.h, *self.state[1, :4, i].reshape(2, 2)
            self.recorder.events(
                Kind.STICK, i, self.t - late, place - late * speed, speed, surface=self.on[i]
            )

    def _end(self, i: int, reason: str, t: float | None = None, kind: Kind | None = None) -> None:
        """End a track, by default now."""
        t = self.t if t is None else t
        x, v, omega = self.state[1, :2, i], self.state[1, 2:4, i], self.state[1, 4, i]
        if i in self.rides:
            self.rides.pop(i).write(self.recorder, t)
        else:
            self.tracks.knot(i, t, x, v, omega)
        if kind is not None:
            surface = self.on[i] if kind == Kind.SETTLE else -1
            self.recorder.events(kind, i, t, x, v, omega, surface=surface)
        self.recorder.ended[i] = REASONS.index(reason)
        self.world.space.remove(*self.disks[i])
        self.inside[i] = self.free[i] = False
