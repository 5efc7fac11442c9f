"""The state of a block of particles of an exact run, and what the block leaves behind."""

from __future__ import annotations

from functools import cached_property
from sys import float_info
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from chutelab.engines.exact.detect import BOUND, Past
from chutelab.engines.exact.obstacles import NONE, Obstacles, along, dot, pick
from chutelab.machine import Machine
from chutelab.mechanics.contact import rim_share
from chutelab.results.record import EVENT, KNOT, REASONS, Kind
from chutelab.results.recorder import Recorder, StalledError
from chutelab.util.arrays import Floats, Ints, Numbers

COLLAPSE = 200
"""Contacts in a row that take no time after which a particle has come to rest in its corner. An
elastic particle leaves a wedge of angle β after π/β of them."""

ROUNDING = 4.0 * float_info.epsilon
"""Share of its age that an event of a particle must take to count as progress."""

NO_SLIP = 1e-13
"""Share of the speeds involved below which a slip is rounding."""

MANY = 1000
"""Chunks of rows that are joined into one: a long run of one particle consists of small ones."""

NUMBERS = np.dtype([("head", f"V{EVENT.itemsize - 80}"), ("numbers", "f8", 10)])
"""What `EVENT` holds from the position on, in one piece: position, velocity before and after, ω
before and after, normal and tangential impulse."""

OF_STATE = np.array([0, 0, 0, 1, 2, 3, 4, 3, 4, 5, 5, 0, 0])
"""Rows of a knot that kind, surface, time and these numbers are where nothing changes; kind,
surface and impulses are put in afterwards."""


class Mode:
    """How a particle moves now; from `FACE` on it touches something. Plain numbers, for speed."""

    DONE = 0
    FLIGHT = 1
    CARRIED = 2
    FACE = 3
    ARC = 4


class Contact(NamedTuple):
    """A contact seen from the particles, arrays (k,) and (2, k)."""

    normal: Floats  # unit vector from the obstacle to the particle
    tangent: Floats  # (n_y, -n_x)
    belt: Floats  # speed of the surface along the tangent, m/s
    friction: Floats
    restitution: Floats
    surface: Ints
    obstacle: Ints


Blow = tuple[Floats, Floats, Floats, Floats]
"""Velocity (2, k) and ω before a blow, normal and tangential impulse."""


class Rows:
    """Rows of n numbers of particles, in the order in which they came."""

    def __init__(self) -> None:
        self._chunks: list[tuple[Ints, Floats]] = []
        self._long: list[tuple[Ints, Floats]] = []

    def add(self, index: Ints, rows: Floats) -> None:
        """Add a row for each of the particles (k,); `rows` (n, k) is kept, not copied."""
        self._chunks.append((index, rows.T))
        if len(self._chunks) == MANY:
            self._long.append(_joined(self._chunks))
            self._chunks.clear()

    def __bool__(self) -> bool:
        return bool(self._long or self._chunks)

    def all(self) -> tuple[Ints, Floats]:
        """Return whose each row is, (K,), and the rows, (K, n)."""
        return _joined(self._long + self._chunks)

    def by_particle(self) -> tuple[Ints, Floats]:
        """Return the same, particle by particle."""
        owner, rows = self.all()
        if not np.count_nonzero(owner):
            return owner, rows  # all of particle 0
        # 16-bit integers are sorted by radix, in linear time.
        order = np.argsort(owner.astype(np.int16), kind="stable")
        return owner[order], rows.take(order, axis=0)


def _joined(chunks: list[tuple[Ints, Floats]]) -> tuple[Ints, Floats]:
    owners, rows = zip(*chunks, strict=True)
    return np.concatenate(owners), np.concatenate(rows)


class State:
    """State of the particles from `first` up to `last` of a machine.

    All arrays go by particle along their last axis, k of them, numbered from 0 here. Ages count
    from a particle's release.
    """

    def __init__(self, machine: Machine, surfaces: Obstacles, first: int, last: int) -> None:
        count = self.count = last - first
        self.machine, self.obstacles = machine, surfaces.of(first, last)
        self.first, self.rounds = first, 0
        mine, particle = slice(first, last), machine.particle
        self.radius, self.mass = self.each(particle.radius), self.each(particle.mass)
        self.gravity, inertia = self.each(machine.gravity), self.each(particle.inertia)
        self.pace, self.fall = self.each(machine.pace), np.zeros((2, count))
        self.fall[1] = -self.gravity
        self.falls = bool(self.gravity[0] != 0.0)
        # Which particles turn, and whether any does; m*/m and m r²/I (or 0), see `rim_share`.
        self.turns = inertia > 0.0
        self.spins = np.count_nonzero(self.turns) > 0
        # Rolling friction, of those that turn; the sign of the spin it opposes, 0 while it holds.
        self.share, self.lever = np.ones(count), np.zeros(count)
        self.rolling, self.roll = np.zeros((2, count))
        if self.spins:
            self.share = rim_share(self.radius, self.mass, inertia)
            self.lever = 1.0 / self.share - 1.0
            arms = machine.rolling
            arm = arms[machine.releases.kind[mine]] if len(arms) > 1 else arms[0]
            self.rolling = np.where(self.turns, arm, 0.0)
        self.rolls = np.count_nonzero(self.rolling) > 0
        start = machine.releases
        self.released = start.t[mine]
        self.staggered = np.count_nonzero(self.released) > 0
        self.stop = self.each(machine.end_time) - self.released  # age at which the run is over
        self.everyone = np.arange(count)
        # Whether the incoming belt rises or falls.
        self.tilted = machine.pulley is not None and np.count_nonzero(machine.pulley.incline) > 0
        # Ages at which gates open or shut, (T, k).
        self.changes = self.obstacles.changes[:, None] - self.released

        # Rows of a knot: age (s), position (m), velocity and r ω (m/s), ledger entries (J).
        self.state = np.zeros((9, count))
        self.age, self.p, self.v = self.state[0], self.state[1:3], self.state[3:5]
        self.z, self.entries = self.state[5], self.state[6:]
        self.p[:], self.v[:] = start.position[mine].T, start.velocity[mine].T
        # How each moves, a `Mode`; why it ended, an index into `REASONS`.
        self.mode, self.ended = np.zeros((2, count), dtype=np.int8)
        self.mode[:] = np.where(start.carried[mine], Mode.CARRIED, Mode.FLIGHT)
        self.landed = np.zeros(count, dtype=bool)
        # Obstacle touched while sliding or riding, and its face (±1; of a circle see
        # `Obstacles.rim_side`), 0 in flight. Sign of the slip there, 0 without; 1 in flight, where
        # there is nothing to grip.
        self.on, self.side, self.slip = np.full(count, NONE), np.zeros(count), np.ones(count)
        # What is being left, see `detect.Motion`.
        self.left, self.left_side = np.full(count, NONE), np.zeros(count)
        self.order = np.zeros(count, dtype=np.int64)
        self.joint = np.full(count, NONE)
        # Events in a row that took no time, and that went slowly to and fro between two obstacles;
        # whether any particle has some.
        self.idle, self.crawls = np.zeros((2, count), dtype=np.int64)
        self.idling = self.crawling = False
        # Angle of a ride round a circle, and where it ends.
        self.angle = np.zeros(count)
        self.bounds = np.zeros((2, count), dtype=BOUND)
        self.past: Past | None = None
        if self.radius[0] <= self.obstacles.touch[0]:
            self.past = Past(np.full(count, NONE), np.zeros(count), self.p.copy())
        # Knots; events: kind, surface, time and `NUMBERS`; ledger entries: surface, entries.
        self.log, self.events, self.books = Rows(), Rows(), Rows()
        self.contacts = 0

    def each(self, value: Numbers) -> Floats:
        """Return a number of the machine for each of the particles, (k,)."""
        if isinstance(value, np.ndarray):
            return value[self.first : self.first + self.count]
        return np.full(self.count, value)

    @cached_property
    def exit_box(self) -> Floats:
        """Left, bottom, right and top beyond which each particle has left the scene, (4, k), m."""
        return self.machine.releases.exit_box[self.first : self.first + self.count].T

    @cached_property
    def up_belt(self) -> Floats:
        """Direction in which the incoming belt runs, (2, k)."""
        assert self.machine.pulley is not None
        incline = self.each(self.machine.pulley.incline)
        return np.stack([np.cos(incline), np.sin(incline)])

    def epoch(self, index: Ints) -> Ints:
        """Return how many of the changes of what is there have been, (k,)."""
        return np.asarray((self.changes[:, index] <= self.age[index]).sum(axis=0))

    def next_change(self, index: Ints) -> Floats:
        """Return the ages at which the next gate opens or shuts, or the run is over, (k,), s."""
        if not len(self.changes):
            return np.asarray(self.stop[index])
        later = self.changes[:, index]
        later = np.where(later > self.age[index], later, np.inf).min(axis=0)
        return np.asarray(np.minimum(self.stop[index], later))

    def vanish(self, index: Ints) -> Floats:
        """Return the ages at which what the particles are on vanishes, (k,), s."""
        return np.asarray(self.obstacles.vanishes[self.on[index]] - self.released[index])

    def drop(self, index: Ints) -> None:
        """Let particles go from what vanishes under them now."""
        self.part(index, self.obstacles.surface[self.on[index]])
        self.fly(index, NONE, 0.0, 0)

    def count_idle(self, index: Ints, dt: Floats) -> None:
        """Count events in a row that take no time, and raise rather than hang if they never end."""
        moved = dt > ROUNDING * self.age[index]
        still = int(np.count_nonzero(moved)) < len(index)
        self.idling = still or (self.idling and bool(self.idle.any()))
        if not self.idling:
            return
        self.idle[index] = np.where(moved, 0, self.idle[index] + 1)
        if self.idle[index].max() > 2 * COLLAPSE:
            reason = (
                f"{2 * COLLAPSE} events in a row took no time; look for surfaces that nearly"
                " touch where it is, and join their ends or move them apart"
            )
            raise self.stalled(int(index[np.argmax(self.idle[index])]), reason)

    def stalled(self, particle: int, reason: str) -> StalledError:
        """Say that a particle, numbered within the block, makes no progress."""
        t, x, y = self.now(np.array([particle]))[:3, 0].tolist()
        return StalledError(self.first + particle, t, (x, y), reason)

    def parties(self) -> list[tuple[int, Ints]]:
        """Return the modes (but `DONE`) that particles are in now, and which are in each."""
        mode = int(self.mode[0])
        if self.count == 1 or np.count_nonzero(self.mode == mode) == self.count:
            return [(mode, self.everyone)] if mode != Mode.DONE else []
        counts = np.bincount(self.mode).tolist()
        return [
            (mode, (self.mode == mode).nonzero()[0])
            for mode, count in enumerate(counts)
            if count and mode != Mode.DONE
        ]

    def omega(self, index: Ints) -> Floats:
        """Angular velocities, rad/s."""
        return self.z[index] / self.radius[index] if self.spins else np.zeros(len(index))

    def surface_spin(self, index: Ints, obstacle: Ints) -> Floats:
        """Return r times the angular velocity of surfaces, (k,), m/s."""
        o = self.obstacles
        spin = self.radius[index] * pick(o.turning, index, obstacle)
        on_pulley = obstacle == o.pulley
        if o.pulley != NONE and np.count_nonzero(on_pulley):
            pulley = np.full(len(index), o.pulley)
            wheel = pick(o.rho, index, pulley - o.segments) - self.radius[index]
            speed = pick(o.material, index, pulley)[0]
            spin = np.where(on_pulley, -self.radius[index] * speed / wheel, spin)
        return np.asarray(spin)

    def stop_slip(self, index: Ints, belt: Floats, w: Floats) -> Floats:
        """Take a slip that is used up to exactly zero: off the spin, else off the pace returned."""
        if not self.spins:
            return belt
        turns = self.turns[index]
        self.z[index] = np.where(turns, belt - w, self.z[index])
        return np.where(turns, w, belt)

    def contact(
        self, index: Ints, obstacle: Ints | None = None, side: Floats | None = None
    ) -> Contact:
        """Return what a contact with an obstacle is like where the particles are now.

        By default with the one they are on. The side of a circle may be left open, 0: it is that
        where they are.
        """
        o = self.obstacles
        obstacle = self.on[index] if obstacle is None else obstacle
        side = self.side[index] if side is None else side
        normal = o.normal_at(index, obstacle, side, self.p)
        open_ = (side == 0.0).nonzero()[0]
        if len(open_):
            side = side.copy()
            side[open_] = o.rim_side(index[open_], obstacle[open_], normal[:, open_])
        speed, restitution, friction = pick(o.material, index, obstacle)
        surface = o.surface[obstacle]
        return Contact(
            normal, along(normal), side * speed, friction, restitution, surface, obstacle
        )

    def snap(self, index: Ints, obstacle: Ints, side: Floats) -> None:
        """Put particles exactly at contact distance, so that rounding cannot add up."""
        o, place = self.obstacles, self.p.take(index, axis=1)
        normal, _, start, _ = pick(o.faces[:, :, :, 0], index, obstacle).swapaxes(0, 1)
        normal = side * normal
        snapped = place - (dot(place - start, normal) - self.radius[index]) * normal
        round_ = (obstacle >= o.segments).nonzero()[0]
        if len(round_):
            rows, circle = index[round_], obstacle[round_] - o.segments
            center = pick(o.center, rows, circle)
            away = place[:, round_] - center
            distance = np.hypot(away[0], away[1])
            snapped[:, round_] = center + (np.abs(pick(o.rho, rows, circle)) / distance) * away
        self.p[:, self.at(index)] = snapped

    def at(self, index: Ints) -> Ints | slice:
        """Return what to assign by: a slice is several times as fast where it is everyone."""
        return slice(None) if len(index) == self.count else index

    def now(self, index: Ints) -> Floats:
        """Return the particles as rows of a knot, (9, k)."""
        everyone = len(index) == self.count
        state = self.state.copy() if everyone else self.state.take(index, axis=1)
        if self.staggered:
            state[0] += self.released if everyone else self.released[index]
        if self.spins:
            state[5] /= self.radius if everyone else self.radius[index]
        return state

    def knots(self, index: Ints) -> None:
        """Write a knot for each of the particles as they are now."""
        if len(index):
            self.log.add(index, self.now(index))

    def event(
        self, kind: int | Ints, index: Ints, surface: int | Ints = NONE, blow: Blow | None = None
    ) -> None:
        """Write an event for each of the particles as they are now; without a blow no change."""
        if not len(index):
            return
        rows = self.now(index).take(OF_STATE, axis=0)
        rows[0], rows[1] = kind, surface
        if blow is None:
            rows[11:] = 0.0
        else:
            rows[5:7], rows[9], rows[11], rows[12] = blow
        self.events.add(index, rows)

    def book(
        self,
        index: Ints,
        surface: Ints,
        belt_work: ArrayLike = 0.0,
        restitution_loss: ArrayLike = 0.0,
        friction_loss: ArrayLike = 0.0,
    ) -> None:
        """Book ledger entries (J) on particles (k,), each once, and on the surfaces they met."""
        if not len(index):
            return
        rows = np.empty((4, len(index)))
        rows[0], rows[1], rows[2], rows[3] = surface, belt_work, restitution_loss, friction_loss
        self.entries[:, self.at(index)] += rows[1:]
        self.books.add(index, rows)

    def close(self, recorder: Recorder) -> None:
        """Hand over everything, in the order of the particles: blocks do not show."""
        recorder.contacts += self.contacts
        recorder.ended[self.first : self.first + len(self.ended)] = self.ended
        if self.log:
            owner, rows = self.log.by_particle()
            recorder.add(self.first + owner, rows.view(KNOT)[:, 0])
        if self.events:
            owner, rows = self.events.all()
            events = np.empty(len(owner), dtype=EVENT)
            events["particle"], events["other"] = owner + self.first, NONE
            events["kind"], events["surface"], events["t"] = rows[:, :3].T
            events.view(NUMBERS)["numbers"] = rows[:, 3:]
            recorder.tell(events)
        if self.books:
            owner, rows = self.books.by_particle()
            surface = rows[:, 0].astype(np.int64)
            place = (owner + self.first, surface) if recorder.apart else surface
            for column in range(3):
                # One after the other, not pairwise: the sum does not depend on the blocks.
                np.add.at(recorder.by_surface[..., column], place, rows[:, 1 + column])

    def finish(self, index: Ints, reason: str) -> None:
        """End the tracks of the particles."""
        if not len(index):
            return
        self.mode[index] = Mode.DONE
        self.ended[index] = REASONS.index(reason)

    def fly(
        self, index: Ints, left: ArrayLike, side: ArrayLike, order: ArrayLike,
        joint: ArrayLike = NONE,
    ) -> None:  # fmt: skip
        """Let the particles go, away from the obstacle they touched, or all those of a joint."""
        at = self.at(index)
        self.mode[at] = Mode.FLIGHT
        self.on[at], self.side[at], self.slip[at] = NONE, 0.0, 1.0
        self.left[at], self.left_side[at], self.order[at] = left, side, order
        self.joint[at] = joint

    def part(self, index: Ints, surface: int | Ints) -> None:
        """Tell that particles leave a surface."""
        self.event(int(Kind.SEPARATION), index, surface)

    def weight_on(self, index: Ints, normal: Floats) -> Floats:
        """Component of gravity into a surface of that normal, m/s²."""
        return np.asarray(self.gravity[index] * normal[1])

    def weight_along(self, index: Ints, normal: Floats) -> Floats:
        """Component of gravity along (n_y, -n_x), m/s²."""
        return np.asarray(self.gravity[index] * normal[0])

    def slip_of(self, index: Ints, contact: Contact, w: Floats) -> Floats:
        """Slip of the contact point against the surface at a pace w, (k,), m/s.

        Exactly 0 below rounding.
        """
        slip, scale = w - contact.belt, np.abs(w) + np.abs(contact.belt)
        if self.spins:
            z = self.z[index]
            slip, scale = w + z - contact.belt, scale + np.abs(z)
        slip[np.abs(slip) <= NO_SLIP * scale] = 0.0
        return slip
