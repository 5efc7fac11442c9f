"""All particles in one Space, stepped by `run.dt`: Pymunk as it is.

Chipmunk moves bodies first and then changes velocities. So positions in the Space belong to a time
half a step before that of the velocities: with x the place at the velocity's time, the Space holds
x - v h/2. Read this way, free flight and the work of gravity are exact. Contacts are seen up to a
step late, at an overlap of up to v dt: keep v dt below the radius, or disks pass through surfaces.

Releases, separations of carried particles and exits have their own times, contacts that of their
step's end. A ride that friction drives hops, longer and longer towards its end; the end is taken to
be at the surface's last push. A disk rises from a rim like a t³/6, with a some 50 m/s³, so a place
that is off by δ shifts the last push by (6 δ/a)^(1/3): in `slip` it is 21, 12, 5 and 4 ms early at
2, 1, 0.5 and 0.25 ms, and no less at shorter steps, as `SLOP`, 4 µm there, stays.

A pendulum's string keeps its length to v² h²/(2 L), and its period is of order 2. A tight string
takes no energy; the loss in a jerk is a restitution loss of the particles. Balls that hang side by
side pass an impact on one by one only if there are gaps of 1e-4 r or more between them: Chipmunk
solves contacts that touch all at once, and all balls move.
"""

from __future__ import annotations

from math import ceil, inf
from typing import Any

import numpy as np
import pymunk
from pymunk import Vec2d, batch

from chutelab.engines.pymunk.faces import Bend, Flight, no_rims
from chutelab.engines.pymunk.moving import Moving, Rolling, Ties, relief
from chutelab.engines.pymunk.shapes import Shapes
from chutelab.engines.pymunk.world import PARTICLE, SURFACE, Carriage, World, balance
from chutelab.machine import SWING, Machine
from chutelab.results.loads import Bins
from chutelab.results.recorder import EnoughError, Recorder, Tracks
from chutelab.results.rows import REASONS, Kind
from chutelab.util.arrays import Floats, Ints, Progress

SOON = 1e-9
"""A time ahead by up to this share of a step counts as now."""

TOUCHING = 1e-9
"""Radii by which disks that just touch may overlap when they are released."""

STAY, HOP = 5, 50
"""Number of pushes of one surface that make a ride, and of steps without a push that end it. With
large friction a ride hops for some steps at a time; it ends with the last push."""

CALM, STILL = 0.1, 1e-3
"""s divided by `Machine.pace`, and m/s times it: a particle that is slower for so long has
settled."""

TAKES = 0.05
"""Greatest share of its speed that drag takes from a particle in a step."""

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
"""Direction of Chipmunk's normal, but not of its impulse."""


class Shared:
    """Runs all particles together.

    `state` is (2, 5, N + F): before and after the last step; x, y, vx, vy, ω; of N particles, then
    of F faces, whose motion is 0 (belt speeds are separate). `entries` is (3, N + F).

    Parameters
    ----------
    machine, world, recorder
        The world's Space is used up.
    """

    def __init__(self, machine: Machine, world: World, recorder: Recorder) -> None:
        self.machine, self.world, self.recorder = machine, world, recorder
        count = self.count = machine.count
        p, starts, faces = machine.particle, machine.releases, world.faces
        rows = count + len(faces)
        self.radius = np.zeros(rows)
        self.light = np.zeros(rows)  # 1/kg; 0 of a surface
        self.light[:count] = 1.0 / machine.particle.mass
        self.radius[:count] = p.radius
        self.shapes = Shapes(machine, world)
        self.bodies, self.corners = self.shapes.bodies, self.shapes.corners
        # One value for all, or one each.
        self.r: Any = p.radius if not np.ndim(p.radius) else self.radius
        self.alike = len(machine.pair_restitution) == 1 and not np.ndim(p.radius)
        self.tracks = Tracks(recorder, self.shapes.smallest, range(count), turning=self.corners)
        # Angle of each, if some are not round.
        self.fields = _BODY | batch.BodyFields.ANGLE if self.corners else _BODY
        self.angle = np.zeros(rows) if self.corners else None
        self.g, pace = machine.gravity, world.pace
        self.lasts, self.still = CALM / pace, STILL * pace
        self.last_gate = machine.last_gate
        self.pull = Vec2d(*(-self.g * machine.up))
        # The run ends after a whole number of steps.
        self.t = self.begin = float(starts.t.min())
        if any(mover.hinge for mover in machine.movers):
            self.t = self.begin = min(self.begin, 0.0)
        span = machine.end_time - self.begin
        longest = machine.step_of("pymunk")
        if machine.air:
            longest = min(longest, TAKES / relief(machine, np.hypot(*starts.velocity.T)).max())
        self.most = ceil(span / longest - 1e-9)
        self.h, self.steps, self.clock = span / max(self.most, 1), 0, 0
        self.waiting = [
            i for i in starts.t.argsort(kind="stable").tolist() if starts.t[i] < machine.end_time
        ]
        self.rides: dict[int, Carriage] = {}
        self.state, self.entries = np.zeros((2, 5, rows)), np.zeros((3, rows))
        recorder.entries = self.entries[:, :count].T
        self.free, self.inside, self.landed = np.zeros((3, count), dtype=bool)
        self.calm = np.zeros(count)
        # The last surface that pushed a particle, how often in a row, the time and the state then.
        self.on, self.pushes = np.full(count, -1), np.zeros(count, dtype=np.int64)
        self.left = np.zeros((6, count))
        about = [(len(machine.surfaces), 0.0, 0.0, 0.0)] * count
        about += [(face.surface, face.speed, *(face.tangent or (0.0, 0.0))) for face in faces]
        surface, self.speed, self.tx, self.ty = np.array(about).T
        self.surface = surface.astype(np.int64)
        self._find_crowns()
        self.throws = (self.speed != 0.0) & (self.surface != machine.landing)
        self.spin = np.zeros(rows)
        self.spin[count:] = [face.spin for face in faces]
        self.bent = np.array([False] * count + [isinstance(face, Bend) for face in faces])
        self.bends = bool(self.bent.any())
        self.before = np.zeros(0, dtype=np.int64)
        self.center = np.zeros((2, rows))
        for row, face in enumerate(faces, count):
            if isinstance(face, Bend):
                self.center[:, row] = face.center
        self.moving: Moving | None = None
        if machine.movers:
            self.moving = Moving(machine, world, count, self.center)
            self.throws[self.moving.rows] = True
            self.spin += self.moving.turn[1]
        self.rolling = Rolling(machine, self.radius)
        self.ties = Ties(machine, world, [body for body, _ in self.bodies[:count]])
        # Rows by sorted id of the bodies; the Space's static body belongs to surfaces.
        self.surfaces_body = world.space.static_body.id
        self.buffer, ids = batch.Buffer(), np.array(list(self.shapes.rank), dtype=np.uintp)
        self.row = ids.argsort()
        self.ids = ids[self.row]

    def _find_crowns(self) -> None:
        """Set the directions of all rows at the first end and at the last, x and y, as of now."""
        self.world.set_clock(self.t + SOON * self.h)
        crowns = [face.crowns for face in self.world.faces]
        self.crowns = np.array([no_rims()] * self.count + crowns)

    def run(self, report: Progress) -> None:
        """Run to the end."""
        reason, enough = "time", None
        # With hinges, a run to a given time goes on to that time.
        on = bool(self.moving and self.moving.hanging) and self.machine.until == "time"
        while self.clock < self.most and (on or self.waiting or self.inside.any()):
            if not self.inside.any() and not (self.moving and self.moving.hanging):
                # Nothing to step until the next release.
                due = float(self.machine.releases.t[self.waiting[0]])
                clock = min(int((due - self.begin) / self.h), self.most - 1)
                self.clock = max(self.clock, clock)
                self.t = self.begin + self.clock * self.h
            if self.shapes.gates and self.shapes.open_and_shut(self.t + SOON * self.h):
                self._find_crowns()
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
        for one in self.moving.hanging.values() if self.moving else ():
            states = np.array(one.states, SWING)
            self.recorder.swings = np.concatenate([self.recorder.swings, states])
            self.recorder.hinge_work[one.surface] = one.work
        faces = slice(self.count, None)
        np.add.at(self.recorder.by_surface, self.surface[faces], self.entries.T[faces])
        if enough is not None:
            raise enough

    # Releases and rides

    def _release(self) -> None:
        """Release particles that are due, at a time up to now, where the place is free."""
        starts = self.machine.releases
        for i in list(self.waiting):
            due = float(starts.t[i])
            if due > self.t + SOON * self.h:
                break
            t = due if self.t - due < self.h else self.t
            x, v = Vec2d(*starts.position[i].tolist()), Vec2d(*starts.velocity[i].tolist())
            if self.moving and self.shapes.taken(i, x, SURFACE):
                continue
            if self.machine.interact and self._taken(i, x, v, max(self.t - t, 0.0)):
                continue
            self.waiting.remove(i)
            self.inside[i] = True
            omega = float(starts.omega[i])
            self.recorder.events(Kind.RELEASE, i, t, tuple(x), tuple(v), omega)
            body = self.bodies[i][0]
            self.world.space.add(*self.bodies[i])
            if starts.carried[i]:
                world = self.world if self.alike else World(self.machine, i)
                ride = self.rides[i] = Carriage(self.machine, world, i, t)
                body.body_type = pymunk.Body.KINEMATIC
                body.position, body.velocity = ride.at(self.t - 0.5 * self.h - t)
                self.state[1, :2, i], self.state[1, 2:4, i] = ride.at(self.t - t)
                # A belt at rest holds it for good.
                self.calm[i] = -inf if ride.speed else inf
            else:
                self._free(i, t, x, v, omega)
            if self.corners:
                # Up to the next step Chipmunk looks for it at the place where it was added.
                self.world.space.reindex_shapes_for_body(body)

    def _taken(self, i: int, x: Vec2d, v: Vec2d, late: float) -> bool:
        """Whether the place where a particle starts is taken, now or when it was due."""
        kinds = self.machine.releases.kind
        others = np.flatnonzero(self.inside & (self.machine.pair_restitution[kinds[i]][kinds] >= 0))
        if not len(others):
            return False
        if self.corners:
            return self.shapes.taken(i, x + late * v, PARTICLE)
        now = self.state[1, :2, others] - (x + late * v)
        apart = now, now - late * (self.state[1, 2:4, others] - v)
        near = (self.radius[i] * (1.0 - TOUCHING) + self.radius[others]) ** 2
        return any(bool(((d * d).sum(axis=1) < near).any()) for d in apart)

    def _free(self, i: int, t: float, x: Vec2d, v: Vec2d, omega: float = 0.0) -> None:
        """Let a particle fly from where it is at a time (s) up to now."""
        body = self.bodies[i][0]
        late, angle = self.t - t, float(self.machine.releases.angle[i])
        self.tracks.knot(i, t, x, v, omega, angle)
        now = v + late * self.pull
        x += 0.5 * late * (v + now)
        if late > 0.0:
            # A blow in the next step begins at its start.
            self.tracks.knot(i, self.t, x, now, omega, angle + late * omega)
        body.position, body.velocity = x - 0.5 * self.h * now, now
        body.angular_velocity, body.angle = omega, angle + (late - 0.5 * self.h) * omega
        self.state[1, :, i] = *x, *now, omega
        if self.angle is not None:
            self.angle[i] = angle + late * omega
        self.free[i], self.calm[i] = True, 0.0
        self.ties.put(i, free=True)

    def _ride(self) -> None:
        """Steer carried particles round the pulley in this step; release those at its end."""
        ahead = self.t + 0.5 * self.h
        for i, ride in list(self.rides.items()):
            body, shape = self.bodies[i]
            if ride.until <= self.t:
                ride.write(self.recorder, ride.until)
                x, v = ride.at(ride.until - ride.t)
                self.recorder.events(
                    Kind.SEPARATION, i, ride.until, tuple(x), tuple(v), surface=ride.surface
                )
                del self.rides[i]
                # A body that is added again makes new contacts with what it touches.
                self.world.space.remove(body, shape)
                body.body_type = pymunk.Body.DYNAMIC
                body.mass, body.moment = self.world.heft(i)
                self.world.space.add(body, shape)
                self._free(i, ride.until, x, v)
            elif ahead > ride.top:
                body.velocity = (ride.at(ahead - ride.t)[0] - body.position) / self.h

    # Steps

    def _step(self) -> None:
        """Step all, book what happened, and end the tracks that end."""
        space = self.world.space
        if self.rides:
            self._ride()
        self.ties.tighten(self.h)
        if self.rolling.acts:
            self.rolling.turn(self.bodies, self.free)
        if self.moving is not None:
            self.moving.put(self.t, self.h)
        if self.machine.air:
            self._slow_down()
            for i in np.flatnonzero(self.free).tolist():
                body, v = self.bodies[i][0], Vec2d(*self.state[1, 2:4, i].tolist())
                body.position += 0.5 * self.h * (body.velocity - v)
                body.velocity = v
        space.step(self.h)
        self.steps += 1
        self.clock += 1
        t, self.t = self.t, self.begin + self.clock * self.h
        entries = self.entries[:, : self.count].copy()
        self.buffer.clear()
        batch.get_space_bodies(space, self.fields, self.buffer)
        ids = np.frombuffer(self.buffer.int_buf(), dtype=np.uintp)
        self.state[0], after = self.state[1], self.state[1]
        known = ids != self.surfaces_body
        rows = self.row[self.ids.searchsorted(ids[known])]
        told = np.frombuffer(self.buffer.float_buf()).reshape(len(ids), -1)[known].T
        turned = self.angle
        if turned is not None:
            # Like its place, a body's angle (third) is half a step behind.
            self.angle = turned.copy()
            self.angle[rows] = told[2] + (0.5 * self.h) * told[5]
            told = told[[0, 1, 3, 4, 5]]
        after[:, rows] = told
        after[:2] += (0.5 * self.h) * after[2:4]
        after[:, self.count :] = 0.0
        if self.moving is not None:
            self.moving.swing(self.t, self.h)
        self._contacts()
        if self.ties.all:
            for tie, told in self.ties.pulled(self.state[..., : self.count], self.pull, self.h):
                ends = [n for n in (tie.joint.particle, tie.joint.other) if n >= 0]
                for i in ends:
                    self.entries[:, i] += told / len(ends)
                self.recorder.by_surface[-1] += told
            self.recorder.springs = np.array(self.ties.springs).reshape(-1, 4)
        if self.machine.air:
            self._slow_down()
        self.tracks.step(self.free, (t, self.t), self.state[..., : self.count], entries, turned)
        self._endings(t, entries)

    def _touched(self, surfaces: set[int]) -> None:
        """Run the triggers of surfaces that were touched in a step."""
        for k, (surface, doing, by) in enumerate(self.machine.triggers):
            if by not in surfaces or self.recorder.triggered[k] < inf:
                continue
            self.recorder.triggered[k] = self.t
            if doing == "starts":
                assert self.moving is not None
                self.moving.start(surface, self.t)
            for face in self.shapes.gates if doing != "starts" else ():
                if face.surface == surface:
                    clock = "vanishes" if doing == "opens" else "appears"
                    setattr(face, clock, self.t)

    def _contacts(self) -> None:
        """Book contacts; record impacts, landings and which particle rides which surface."""
        a, b, first, values = self._touches()
        # The impulse acts on A, the normal points from A to B.
        push = -values[0] * values[2] - values[1] * values[3]
        order = np.flatnonzero(push > 0.0)
        if not len(order) and not self.rolling.acts:
            # Nothing pushed.
            self.before, self.calm = order, np.where(self.free, 0.0, self.calm + self.h)
            self._riding(order, order)
            return
        one, other = np.minimum(a, b), np.maximum(a, b)
        if len(order) > 1:
            # Sort them: they come in the order of a hash of addresses, on which no sum may depend.
            keys = (*values[4:], push, other, one)
            order = order[np.lexsort([key.take(order) for key in keys])]
        a, one, other, push, first = (part.take(order) for part in (a, one, other, push, first))
        values, straight = values.take(order, axis=1), a == one
        jx, jy, nx, ny = np.where(straight, 1.0, -1.0) * values[:4] * TOWARDS
        rub = jx * ny - jy * nx
        speed = self.speed[other]
        # The normal in the frame of the surface as written.
        bx, by = (nx, ny) if self.moving is None else self.moving.back(other, nx, ny)
        last = (self.tx[other] * bx + self.ty[other] * by > 0.0).astype(int)
        crown = self.crowns[other, last].T
        side = crown[0] * bx + crown[1] * by
        if self.bends:
            away = self.state[1, :2].take(one, axis=1) - self.center.take(other, axis=1)
            side = np.where(self.bent[other], away[0] * nx + away[1] * ny, side)
        belt = np.where(side < 0.0, -speed, speed)
        # Relative velocities of the contact points, before and after: (2, k).
        mine, others = (self.state[:, 2:].take(row, axis=2) for row in (one, other))
        arms = -self.radius[one] * np.stack((nx, ny))
        if self.corners:
            # Both levers, from the centres to the point.
            arms = np.where(straight, values[4:], values[[6, 7, 4, 5]])
        work = self._carry(one, other, arms[:2], np.stack([jx, jy]), others)
        u, v = mine[:, 0] - others[:, 0], mine[:, 1] - others[:, 1]
        rate = u * nx + v * ny
        slip = u * ny - v * nx
        if self.corners:
            # The relative velocity from spin: r × n times ω.
            for (x, y), spin in ((arms[:2], mine[:, 2]), (arms[2:], -others[:, 2])):
                rate = rate + spin * (x * ny - y * nx)
                slip = slip - spin * (x * nx + y * ny)
        elif np.ndim(self.r):
            slip = slip + self.radius[one] * mine[:, 2] + self.radius[other] * others[:, 2]
        else:
            slip = slip + self.r * (mine[:, 2] + others[:, 2])
        slip = slip - belt
        # J (u before + u after)/2; then whether the contact is at rest, and a 1 to count contacts.
        sums = np.ones((5, len(one)))
        sums[0], sums[1] = rub * belt + work, -0.5 * push * (rate[0] + rate[1])
        sums[2] = -0.5 * rub * (slip[0] + slip[1])
        sums[3] = (
            (np.abs(rate[1]) < self.still) & (np.abs(slip[1]) < self.still) & ~self.throws[other]
        )
        if self.rolling.acts:
            rolls = self.radius[one] * np.abs(mine[1, 2] - others[1, 2] - self.spin[other])
            sums[3] *= (self.rolling.arm[one] == 0.0) | (rolls < self.still)
        pair = other < self.count
        if self.machine.triggers:
            self._touched({*self.surface[other[~pair]].tolist()})
        energy = (push**2 + rub**2) * (self.light[one] + self.light[other])
        balance(sums[1:3], energy, one, other, self.count)
        self.recorder.by_surface[-1] += sums[:3] @ pair
        for k in np.flatnonzero(pair) if self.rides else ():
            for row, motion, sign in ((one, mine, -0.5), (other, others, 0.5)):
                if (i := int(row[k])) in self.rides:
                    # The belt's work on a particle that hits one that it carries.
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
        if self.recorder.bins is not None:
            self._bear(self.recorder.bins, one, other, (jx, jy), (nx, ny), arms)
        if self.rolling.acts:
            turning = self.state[:, 4] - self.spin
            heat = self.rolling.book(self.entries, turning, self.spin)
            self.recorder.by_surface[-1, 2] += heat
            self.rolling.brake(one, other, push, turning)
        calm = (added[4] > 0.0) & (added[3] == added[4])
        self.calm = np.where(calm[: self.count] | ~self.free, self.calm + self.h, 0.0)
        surface = self.surface[other]
        self._riding(one[~pair], surface[~pair])
        lands = (surface == self.machine.landing) & ~self.landed[one]
        if self.bends:
            # Going from one link of a chain to the next is not an impact.
            contact = one * rows + other
            first &= np.append(self.before, -1)[self.before.searchsorted(contact)] != contact
            self.before = contact  # sorted, as `order` has them
        told = np.flatnonzero(lands | first & (rate[0] < -self.g * self.h))
        if self.corners and len(told):
            # One event for all points of a contact.
            _, which = np.unique(one * rows + other, return_inverse=True)
            push, rub = (np.bincount(which, part)[which] for part in (push, rub))
            told = told[np.unique(which[told], return_index=True)[1]]
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

    def _slow_down(self) -> None:
        """Apply half a step of air drag to all free particles, as spheres; book the loss."""
        v = self.state[1, 2:4, : self.count]
        speed = np.hypot(*v)
        middle = speed * np.exp(-0.25 * self.h * relief(self.machine, speed))
        left = np.where(self.free, np.exp(-0.5 * self.h * relief(self.machine, middle)), 1.0)
        lost = 0.5 * self.machine.particle.mass * (v**2 * (1.0 - left**2)).sum(axis=0)
        v *= left
        self.entries[2, : self.count] += lost
        self.recorder.air_loss += float(lost.sum())

    def _carry(self, one: Ints, other: Ints, arms: Floats, push: Floats, others: Floats) -> Any:
        """Put the motion of surfaces into `others`, (2, 3, k); book and return their work, J."""
        if self.moving is None:
            return 0.0
        place = 0.5 * (self.state[0, :2] + self.state[1, :2]).take(one, axis=1)
        velocity = self.moving.at(other, place + arms)
        others[:, :2] += velocity
        work = np.asarray((push * velocity.mean(axis=0)).sum(axis=0))
        np.add.at(self.recorder.drives, self.surface[other], work)
        return work

    def _bear(self, bins: Bins, one: Ints, other: Ints, push: Any, normal: Any, arms: Any) -> None:
        """Count this step's impulses on surfaces, and of carried particles, as loads."""
        begin, end = self.t - self.h, self.t
        middle = 0.5 * (self.state[0, :2] + self.state[1, :2])
        alone = other >= self.count
        place = middle[:, one] + arms[:2]
        (x, y), (nx, ny), (px, py) = (np.asarray(of)[:, alone] for of in (place, normal, push))
        bins.bear(self.surface[other[alone]], begin, end, (x, y), (nx, ny), (px, py))
        couples = self.rolling.couples
        last, mate, couple = (of[couples[1] >= self.count] for of in couples)
        if len(couple):
            none = np.zeros(2)
            bins.bear(self.surface[mate], begin, end, middle[:, last], none, none, couple)
        for k in np.flatnonzero(~alone) if self.rides else ():
            for row, its, sign in ((one, other, -1.0), (other, one, 1.0)):
                if (ride := self.rides.get(int(row[k]))) and int(its[k]) not in self.rides:
                    below, up = ride.foot(end)
                    pushed = sign * push[0][k], sign * push[1][k]
                    bins.bear(ride.surface, begin, end, below, up, pushed)

    def _touches(self) -> tuple[Any, ...]:
        """Return rows of both bodies, whether they are new, impulse on A, normal, levers."""
        if self.corners:
            points = np.array(self.shapes.points).reshape(-1, 11).T
            self.shapes.points.clear()
            rows = points[:2].astype(np.int64)
            return *rows, points[2] != 0.0, points[3:]
        self.buffer.clear()
        batch.get_space_arbiters(self.world.space, _ARBITER, self.buffer)
        values = np.frombuffer(self.buffer.float_buf()).reshape(-1, 4).T
        ids = np.frombuffer(self.buffer.int_buf(), dtype=np.uintp).reshape(-1, 3).T
        return *self.row[self.ids.searchsorted(ids[:2])], ids[2] != 0, values

    def _riding(self, particles: Ints, surface: Ints) -> None:
        """Count consecutive pushes of surfaces; record separations at the time of the last one."""
        if not len(particles) and not self.pushes.any():
            return
        over = self.left[0] < self.t - HOP * self.h
        over[particles[self.on[particles] != surface]] = True
        for i in np.flatnonzero(over & (self.pushes >= STAY)):
            t, x, y, vx, vy, omega = self.left[:, i].tolist()
            self.recorder.events(Kind.SEPARATION, i, t, (x, y), (vx, vy), omega, surface=self.on[i])
        self.pushes[over], self.on[over] = 0, -1
        self.pushes[particles] += 1
        self.on[particles] = surface
        self.left[0, particles], self.left[1:, particles] = self.t, self.state[1][:, particles]

    # The end

    def _endings(self, t: float, entries: Floats) -> None:
        """End particles that left, landed or settled."""
        until, (left, bottom, right, top) = self.machine.until, self.machine.releases.exit_box.T
        x, y = self.state[1, :2, : self.count]
        out = (y < bottom) | (y > top) | (x < left) | (x > right)
        for i in np.flatnonzero(out & self.free).tolist():
            begin = Vec2d(*self.state[0, :2, i].tolist())
            v = Vec2d(*self.state[0, 2:4, i].tolist())
            late = Flight(begin, v, self.pull).leaves(self.machine.releases.exit_box[i])
            if late < self.h and (entries[:, i] == self.entries[:, i]).all():
                # It was in flight, and left within the step.
                after = v + late * self.pull
                self.state[1, :4, i] = *(begin + 0.5 * late * (v + after)), *after
            else:
                late = self.h
            self._end(i, "exit", t + late, Kind.EXIT)
        if until == "landed":
            for i in np.flatnonzero(self.landed & self.free).tolist():
                self._end(i, "landed")
        calm = self.inside & (self.calm >= self.lasts)
        # Nothing counts as settled before, or just after, the last gate has opened or closed.
        gated = self.t < self.last_gate + self.lasts
        under_way = gated or bool(self.waiting) or bool((self.inside & ~calm).any())
        together = self.machine.interact and under_way
        together |= gated and self.moving is not None
        if until == "settled" and not together:
            for i in np.flatnonzero(calm).tolist():
                self._tell_calm(i)
                self._end(i, "settled", self.t, Kind.SETTLE)

    def _tell_calm(self, i: int) -> None:
        """Record that a particle is at rest, if it is: from the end of that step on."""
        if i not in self.rides and self.calm[i] >= self.lasts:
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
            angle = 0.0 if self.angle is None else self.angle[i] + (t - self.t) * omega
            self.tracks.knot(i, t, x, v, omega, angle)
            # Joints are tied once the ride is over.
            self.ties.put(i, free=False)
        if kind is not None:
            surface = self.on[i] if kind == Kind.SETTLE else -1
            self.recorder.events(kind, i, t, x, v, omega, surface=surface)
        self.recorder.ended[i] = REASONS.index(reason)
        self.world.space.remove(*self.bodies[i])
        self.inside[i] = self.free[i] = False
