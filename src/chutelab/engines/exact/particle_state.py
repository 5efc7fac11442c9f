"""The state of a block of particles of an exact run."""

from __future__ import annotations

from functools import cached_property
from sys import float_info
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from chutelab.engines.exact.detect import Bounds, Past
from chutelab.engines.exact.event_log import STATE, EventLog
from chutelab.engines.exact.obstacles import NONE, Obstacles, along, pick
from chutelab.machine import Machine
from chutelab.mechanics.contact import DISK_SHARE
from chutelab.results import REASONS, Kind
from chutelab.results.recorder import StalledError
from chutelab.util.arrays import Floats, Ints


class Mode:
    """How a particle moves now; from `FACE` on it touches something. Plain numbers, for speed."""

    DONE = 0
    FLIGHT = 1
    CARRIED = 2
    FACE = 3
    ARC = 4


class Contact(NamedTuple):
    """A contact seen from the particles, arrays (k,) and (2, k).

    Attributes
    ----------
    normal, tangent : ndarray, (2, k)
        Unit vectors: from the obstacle to the particle, and (n_y, -n_x).
    belt, friction, restitution : ndarray, (k,)
        Speed of the surface along the tangent (m/s), pair values.
    surface : ndarray, (k,)
        Index of the surface.
    """

    normal: Floats
    tangent: Floats
    belt: Floats
    friction: Floats
    restitution: Floats
    surface: Ints


class State:
    """State arrays of the particles from `first` up to `last`; age counts from their release.

    Attributes
    ----------
    state : ndarray, (9, k)
        Age (s), position (m), velocity and r ω (m/s), ledger entries (J): a knot, but for the time.
    age, p, v, z, entries : ndarray, (k,), (2, k) or (3, k)
        Views of it.
    radius, mass, gravity : ndarray, (k,)
        m, kg, m/s².
    falls, spins, staggered : bool
        Whether there is gravity, whether the particles are free disks, and whether they are
        released at other times than 0.
    past : Past or None
        See `detect.Motion`.
    mode : ndarray, (k,)
        See `Mode`.
    on, side, slip : ndarray, (k,)
        Obstacle touched while sliding or riding and its face (±1; see `Obstacles.rim_side` for
        circles), 0 in flight; sign of the slip, 0 without (and 1 in flight, where there is nothing
        to grip).
    left, left_side, order : ndarray, (k,)
        See `detect.Motion`.
    everyone : ndarray, (k,)
        Their numbers.
    stop : ndarray, (k,)
        Age at which the run is over.
    idle, crawls : ndarray, (k,)
        Events in a row that took no time, and that went slowly to and fro between two obstacles.
    rounds : int
        Rounds so far.
    ended : ndarray, (k,)
        Why each ended, an index into `REASONS`.
    """

    def __init__(
        self,
        machine: Machine,
        surfaces: Obstacles,
        origin: tuple[float, float],
        first: int,
        last: int,
    ) -> None:
        count = last - first
        self.machine, self.obstacles = machine, surfaces.of(first, last)
        self.origin = np.reshape(origin, (2, 1)) if any(origin) else None
        self.log = EventLog(first, count)
        mine, particle = slice(first, last), machine.particle
        self.radius, self.mass, self.gravity, inertia, end = (
            np.broadcast_to(value, machine.count)[mine]
            for value in (
                particle.radius, particle.mass, machine.gravity, particle.inertia, machine.end_time,
            )
        )  # fmt: skip
        self.fall = np.stack([np.zeros(count), -self.gravity])
        self.falls, self.spins = bool(self.gravity[0] != 0.0), bool(inertia[0] > 0.0)
        self.share = DISK_SHARE if self.spins else 1.0
        start = machine.releases
        self.released = start.t[first:last]
        self.staggered = np.count_nonzero(self.released) > 0
        self.state = np.zeros((STATE, count))
        self.age, self.p, self.v = self.state[0], self.state[1:3], self.state[3:5]
        self.z, self.entries = self.state[5], self.state[6:]
        self.everyone = np.arange(count)
        self.p[:], self.v[:] = start.position[first:last].T, start.velocity[first:last].T
        if self.origin is not None:
            self.p -= self.origin
        self.mode, self.ended = np.zeros((2, count), dtype=np.int8)
        self.mode[:] = Mode.FLIGHT
        self.mode[start.carried[first:last]] = Mode.CARRIED
        integers = np.zeros((5, count), dtype=np.int64)
        integers[3:] = NONE
        self.order, self.idle, self.crawls, self.on, self.left = integers
        self.side, self.left_side, self.slip = np.zeros((3, count))
        self.slip[:] = 1.0
        self.stop = end - self.released
        self.landed = np.zeros(count, dtype=bool)
        self.past: Past | None = None
        if self.radius[0] <= self.obstacles.touch[0]:
            self.past = Past(np.full(count, NONE), np.zeros(count), self.p.copy())
        self.idling = self.crawling = False
        self.first, self.rounds = first, 0

    @cached_property
    def exit_box(self) -> Floats:
        """Left, right, bottom and top beyond which each particle has left the scene, (4, k), m."""
        mine = slice(self.first, self.first + len(self.mode))
        each = [np.broadcast_to(side, self.machine.count)[mine] for side in self.machine.exit_box]
        return np.stack(each) - (0.0 if self.origin is None else np.repeat(self.origin, 2, axis=0))

    @cached_property
    def bounds(self) -> Bounds:
        """Where rides round circles end."""
        return Bounds.free(len(self.mode))

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
        """Say that a particle, numbered within the block, does not get on."""
        t, x, y = self.now(np.array([particle]))[:3, 0].tolist()
        return StalledError(self.first + particle, t, (x, y), reason)

    def parties(self) -> list[tuple[int, Ints]]:
        """Return the modes (but `DONE`) that particles are in now, and who is in each."""
        count, mode = len(self.mode), int(self.mode[0])
        if count == 1 or np.count_nonzero(self.mode == mode) == count:
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

    def contact(
        self,
        index: Ints,
        obstacle: Ints | None = None,
        side: Floats | None = None,
        normal: Floats | None = None,
    ) -> Contact:
        """Return what a contact with an obstacle is like where the particles are now.

        By default with the one they are on. The side of a circle may be left open, 0: it is that
        where they are.
        """
        o = self.obstacles
        obstacle = self.on[index] if obstacle is None else obstacle
        side = self.side[index] if side is None else side
        if normal is None:
            normal = o.normal_at(index, obstacle, side, self.p)
        tangent, material = along(normal), pick(o.material, index, obstacle)
        open_ = (side == 0.0).nonzero()[0]
        if len(open_):
            side = side.copy()
            side[open_] = o.rim_side(index[open_], obstacle[open_], normal[:, open_])
        speed, restitution, friction = material
        return Contact(normal, tangent, side * speed, friction, restitution, o.surface[obstacle])

    def at(self, index: Ints) -> Ints | slice:
        """Return what to assign by: a slice is several times as fast where it is everyone."""
        return slice(None) if len(index) == len(self.mode) else index

    def now(self, index: Ints) -> Floats:
        """Return the particles as rows of a knot, (9, k)."""
        everyone = len(index) == len(self.mode)
        state = self.state.copy() if everyone else self.state.take(index, axis=1)
        if self.staggered:
            state[0] += self.released if everyone else self.released[index]
        if self.origin is not None:
            state[1:3] += self.origin
        if self.spins:
            state[5] /= self.radius if everyone else self.radius[index]
        return state

    def knots(self, index: Ints) -> None:
        """Write a knot for each of the particles as they are now."""
        if len(index):
            self.log.knots(index, self.now(index))

    def event(self, kind: int | Ints, index: Ints, surface: int | Ints = NONE) -> None:
        """Write an event for each of the particles as they are now, without an impulse."""
        if len(index):
            state = self.now(index)
            self.log.events(kind, index, surface, state)

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
        rows = np.empty((3, len(index)))
        rows[0], rows[1], rows[2] = belt_work, restitution_loss, friction_loss
        self.entries[:, self.at(index)] += rows
        self.log.book(index, surface, rows)

    def finish(self, index: Ints, reason: str) -> None:
        """End the tracks of the particles."""
        if not len(index):
            return
        self.mode[index] = Mode.DONE
        self.ended[index] = REASONS.index(reason)

    def fly(self, index: Ints, left: ArrayLike, side: ArrayLike, order: ArrayLike) -> None:
        """Let the particles go, away from the obstacle they touched."""
        at = self.at(index)
        self.mode[at] = Mode.FLIGHT
        self.on[at], self.side[at], self.slip[at] = NONE, 0.0, 1.0
        self.left[at], self.left_side[at], self.order[at] = left, side, order

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


COLLAPSE = 200
"""Contacts in a row that take no time after which a particle has come to rest in its corner. An
elastic particle leaves a wedge of angle β after π/β of them."""

ROUNDING = 4.0 * float_info.epsilon
"""Share of its age that an event of a particle must take to count as progress."""

NO_SLIP = 1e-13
"""Share of the speeds involved below which a slip is rounding."""
