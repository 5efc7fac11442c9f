"""The state of all particles of an exact run, and the way it is written down."""

from __future__ import annotations

from dataclasses import dataclass
from enum import IntEnum
from typing import TYPE_CHECKING

import numpy as np

from chutelab.exact.arcs import Bounds
from chutelab.exact.layout import obstacles
from chutelab.exact.obstacles import NONE, Floats, Ints, Obstacles, dot
from chutelab.impact import DISK_SHARE
from chutelab.recorder import Recorder
from chutelab.recording import REASONS, Kind

if TYPE_CHECKING:
    from numpy.typing import ArrayLike, NDArray

    from chutelab.machine import Machine


class Mode(IntEnum):
    """How a particle moves now; from `FACE` on it touches something."""

    DONE = 0
    FLIGHT = 1
    CARRIED = 2
    FACE = 3
    ARC = 4


@dataclass(frozen=True, eq=False)
class Contact:
    """A contact seen from the particles, arrays (k,) and (k, 2).

    Attributes
    ----------
    normal, tangent : ndarray, (k, 2)
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


class Swarm:
    """State arrays of N particles; times are counted from each particle's own release.

    Attributes
    ----------
    age, p, v, z : ndarray, (N,) or (N, 2)
        Time since release (s), position (m), velocity and r ω (m/s).
    mode : ndarray, (N,)
        See `Mode`.
    on, side, slip : ndarray, (N,)
        Obstacle touched while sliding or riding and its face (±1, 0 for circles); sign of the slip,
        0 without (and 1 in flight, where there is nothing to grip).
    left, left_side, order : ndarray, (N,)
        See `detect.Motion`.
    belt : ndarray, (N,)
        Speed of the surface under a ride round a circle, fixed when the ride begins: the end of a
        belt carries like a roller turning as fast as the belt does there.
    bounds : Bounds
        Where rides round circles end.
    stop : ndarray, (N,)
        Age at which the run is over.
    idle, crawls : ndarray, (N,)
        Events in a row that took no time, and that went slowly to and fro between two obstacles.
    """

    def __init__(self, machine: Machine) -> None:
        count = machine.count
        self.machine = machine
        self.obstacles: Obstacles = obstacles(machine)
        self.recorder = Recorder(count, machine.surfaces)
        self.radius, self.mass = machine.particle.radius, machine.particle.mass
        self.gravity = machine.gravity
        self.spins = machine.particle.inertia > 0.0
        self.share = DISK_SHARE if self.spins else 1.0
        start = machine.releases
        self.released = start.t
        self.age = np.zeros(count)
        self.p, self.v, self.z = start.position.copy(), start.velocity.copy(), np.zeros(count)
        self.mode = np.where(start.carried, Mode.CARRIED, Mode.FLIGHT).astype(np.int8)
        self.on, self.left = np.full((2, count), NONE, dtype=np.int64)
        self.side, self.left_side, self.order = np.zeros((3, count), dtype=np.int64)
        self.slip, self.belt = np.ones(count), np.zeros(count)
        self.bounds = Bounds.free(count)
        self.stop = machine.end_time - start.t
        self.landed = np.zeros(count, dtype=bool)
        self.idle, self.crawls = np.zeros((2, count), dtype=np.int64)

    def count_idle(self, who: Ints, dt: Floats) -> None:
        """Count events in a row that take no time, and raise rather than hang if they never end."""
        rounding = 4.0 * np.finfo(np.float64).eps * self.age[who]
        self.idle[who] = np.where(dt > rounding, 0, self.idle[who] + 1)
        if self.idle[who].max(initial=0) > 2 * COLLAPSE:
            stuck = int(who[np.argmax(self.idle[who])])
            raise RuntimeError(
                f"exact engine: particle {stuck} makes no progress at t ="
                f" {self.released[stuck] + self.age[stuck]:.6g} s, at {self.p[stuck].tolist()} m"
            )

    def active(self, first: Mode, last: Mode) -> Ints:
        """Return the particles in one of the modes from `first` to `last`."""
        return np.flatnonzero((self.mode >= first) & (self.mode <= last))

    def omega(self, who: Ints) -> Floats:
        """Angular velocities, rad/s."""
        return self.z[who] / self.radius if self.spins else np.zeros(len(who))

    def contact(self, who: Ints, obstacle: Ints, side: Ints) -> Contact:
        """Return what a contact with an obstacle is like where the particles are now."""
        o = self.obstacles
        normal = o.normal_at(who, obstacle, side, self.p[who])
        row = np.zeros_like(who) if len(o.friction) == 1 else who
        return Contact(
            normal,
            np.stack([normal[:, 1], -normal[:, 0]], axis=-1),
            o.belt_speed(who, obstacle, normal),
            o.friction[row, obstacle],
            o.restitution[row, obstacle],
            o.surface[obstacle],
        )

    def knots(self, who: Ints) -> None:
        """Write a knot for each of the particles as they are now."""
        if len(who):
            t = self.released[who] + self.age[who]
            self.recorder.knots(who, t, self.p[who], self.v[who], self.omega(who))

    def event(
        self,
        kind: Kind | ArrayLike,
        who: Ints,
        surface: ArrayLike = NONE,
        *,
        velocity_before: Floats | None = None,
        omega_before: Floats | None = None,
        normal_impulse: ArrayLike = 0.0,
        tangential_impulse: ArrayLike = 0.0,
    ) -> None:
        """Write an event for each of the particles as they are now."""
        if len(who):
            self.recorder.events(
                kind,
                who,
                self.released[who] + self.age[who],
                self.p[who],
                self.v[who],
                self.omega(who),
                velocity_before=velocity_before,
                omega_before=omega_before,
                surface=surface,
                normal_impulse=normal_impulse,
                tangential_impulse=tangential_impulse,
            )

    def finish(self, who: Ints, reason: str) -> None:
        """End the tracks of the particles."""
        self.mode[who] = Mode.DONE
        self.recorder.ended[who] = REASONS.index(reason)

    def fly(self, who: Ints, left: ArrayLike, side: ArrayLike, order: ArrayLike) -> None:
        """Let the particles go, away from the obstacle they touched."""
        self.mode[who] = Mode.FLIGHT
        self.on[who], self.side[who], self.slip[who] = NONE, 0, 1.0
        self.left[who], self.left_side[who], self.order[who] = left, side, order

    def weight_on(self, normal: Floats) -> Floats:
        """Component of gravity into a surface of that normal, m/s²."""
        return np.asarray(self.gravity * normal[:, 1])

    def weight_along(self, normal: Floats) -> Floats:
        """Component of gravity along (n_y, -n_x), m/s²."""
        return np.asarray(self.gravity * normal[:, 0])

    def slip_of(self, who: Ints, contact: Contact) -> Floats:
        """Slip of the contact point against the surface, (k,), m/s; exactly 0 below rounding."""
        w = dot(self.v[who], contact.tangent)
        slip = w + self.z[who] - contact.belt
        scale = np.abs(w) + np.abs(self.z[who]) + np.abs(contact.belt)
        return np.where(np.abs(slip) <= NO_SLIP * scale, 0.0, slip)


COLLAPSE = 200
"""Contacts in a row that take no time after which a particle has come to rest in its corner. An
elastic particle leaves a wedge of angle β after π/β of them."""

NO_SLIP = 1e-13
"""Share of the speeds involved below which a slip is rounding."""


def below(limit: Floats, friction: Floats, load: Floats) -> NDArray[np.bool_]:
    """Tell whether a force is within Coulomb's limit; friction may be inf."""
    finite = np.where(np.isinf(friction), 0.0, friction)
    return np.isinf(friction) | (limit <= finite * load)
