"""What every particle is doing, the path it is on, and the knots of its track.

Between impulses every path is a parabola: of a flight from its last knot, of a particle in contact
from pymunk's last step to the next. In contact it gets a knot only where its track leaves the
parabola that the last ones foretold, so memory grows with what happens, not with steps.
"""

from __future__ import annotations

from math import inf
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from chutelab.recording import KNOT, REASONS
from chutelab.stepper.outline import closing_time

if TYPE_CHECKING:
    from chutelab.machine import Machine
    from chutelab.recorder import Recorder

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]

KNOT_POSITION = 1e-3
"""Share of the radius by which a track in contact may deviate from the curve between its knots."""

KNOT_SPEED = 1e-3
"""m/s; the same for its velocity, and for that of its rim."""


WAITING, CARRIED, FLYING, RESTING, DONE = range(5)
"""What a particle is doing; RESTING means in contact at the last step, moving or not. Plain
numbers: Python 3.11 looks up a member of an enumeration twenty times slower than a name."""


class Tracks:
    """State arrays of the particles in one world.

    Attributes
    ----------
    mode : ndarray, (N,)
        WAITING, CARRIED, FLYING, RESTING or DONE.
    t, x, v, omega : ndarray, (N,) or (N, 2)
        Last knot, s, m, m/s, rad/s.
    from_t, from_x, from_v : ndarray, (N,) or (N, 2)
        Where the present path begins, s, m, m/s.
    at, w, spin : ndarray, (N, 2) or (N,)
        Of particles in contact: position, velocity and ω as pymunk left them at the last step.
    aim : ndarray, (N, 2)
        Velocity that moves particles in contact in the next step: w, or, round a curve, the chord.
    upon : ndarray, (N, 2)
        Normal of the surface that a particle in contact lies on; 0 with another particle, or in a
        corner.
    face : ndarray, (N,)
        Solid on whose flat face alone a particle in contact lies, or -1.
    exit : ndarray, (N,)
        s; when a flight leaves the scene, inf if it never does.
    """

    def __init__(self, machine: Machine, recorder: Recorder, ids: Ints) -> None:
        count = len(ids)
        self.ids = ids
        self._machine = machine
        self._recorder = recorder
        self._g = np.array([0.0, -machine.gravity])
        self.mode = np.full(count, WAITING, dtype=np.int8)
        self.t, self.omega, self.spin = np.zeros((3, count))
        self.x, self.v, self.at, self.w, self.aim = np.zeros((5, count, 2))
        self.from_t, self.from_x, self.from_v = np.zeros(count), *np.zeros((2, count, 2))
        self.upon = np.zeros((count, 2))
        self.face = np.full(count, -1)
        self.exit = np.full(count, np.inf)
        self._held = np.zeros(count, dtype=bool)
        self._held_t, self._held_omega = np.zeros((2, count))
        self._held_x, self._held_v = np.zeros((2, count, 2))
        self._box = machine.exit_box
        self._marks: list[tuple[int, tuple[Any, ...]]] = []
        self._bend = np.zeros((count, 2))
        self._bend_omega = np.zeros(count)
        self._bend_known = np.zeros(count, dtype=bool)

    def knot(self, who: Ints, t: ArrayLike, x: ArrayLike, v: ArrayLike, omega: ArrayLike) -> None:
        """Write a knot for each of some particles; it becomes their last."""
        if len(who):
            self.flush()
            self.t[who], self.x[who], self.v[who], self.omega[who] = t, x, v, omega
            self._recorder.knots(
                self.ids[who], self.t[who], self.x[who], self.v[who], self.omega[who]
            )

    def mark(
        self, i: int, t: float, x: float, y: float, vx: float, vy: float, omega: float
    ) -> None:
        """Write a knot for one particle."""
        self.t[i], self.omega[i] = t, omega
        self.x[i], self.v[i] = (x, y), (vx, vy)
        n = int(self.ids[i])
        entries = tuple(self._recorder.entries[n].tolist())
        self._marks.append((n, (t, (x, y), (vx, vy), omega, entries)))

    def flush(self) -> None:
        """Hand over the knots written one by one."""
        if self._marks:
            owners, knots = zip(*self._marks, strict=True)
            self._recorder.add(np.array(owners), np.array(list(knots), dtype=KNOT))
            self._marks.clear()

    def flight(self, who: Ints | slice, t: float) -> tuple[Floats, Floats]:
        """Return positions and velocities, (k, 2), on the present paths at a time."""
        s = (t - self.from_t[who])[:, None]
        v = self.from_v[who]
        return self.from_x[who] + s * (v + 0.5 * s * self._g), v + s * self._g

    def all_at(self, t: float) -> tuple[Floats, Floats, Floats, Floats]:
        """Return x, y and velocities, each (N,), of all particles on their present paths."""
        s, g = t - self.from_t, self._machine.gravity
        u, v = self.from_v[:, 0], self.from_v[:, 1]
        fall = s * g
        return (
            self.from_x[:, 0] + s * u,
            self.from_x[:, 1] + s * (v - 0.5 * fall),
            u,
            v - fall,
        )

    def state(self, i: int, t: float) -> tuple[float, float, float, float]:
        """Return position and velocity of one particle on its present path at a time."""
        s = t - float(self.from_t[i])
        (x, y), (vx, vy) = self.from_x[i].tolist(), self.from_v[i].tolist()
        g = self._machine.gravity
        return x + s * vx, y + s * (vy - 0.5 * s * g), vx, vy - s * g

    def turn(self, i: int) -> float:
        """Return ω of a particle, rad/s."""
        return float(self.spin[i] if self.mode[i] == RESTING else self.omega[i])

    def fly(self, who: Ints) -> None:
        """Let particles go from their last knots."""
        self.mode[who] = FLYING
        self.from_t[who], self.from_x[who], self.from_v[who] = self.t[who], self.x[who], self.v[who]
        for i in who.tolist():
            self.exit[i] = self.t[i] + self._way_out(*self.x[i].tolist(), *self.v[i].tolist())

    def _way_out(self, x: float, y: float, vx: float, vy: float) -> float:
        """Return when a flight leaves the scene, s; at once if it is beyond the edge already."""
        if self._machine.until == "time":
            return inf
        left, right, bottom, top = self._box
        if self._machine.gravity > 0.0:
            return closing_time(max(y - bottom, 0.0), vy, -self._machine.gravity)
        return min(
            closing_time(max(gap, 0.0), rate, 0.0)
            for gap, rate in ((x - left, vx), (right - x, -vx), (y - bottom, vy), (top - y, -vy))
        )

    def rest(self, who: Ints) -> None:
        """Keep particles in contact from their last knots on."""
        self.mode[who], self.exit[who] = RESTING, np.inf
        self._held[who] = self._bend_known[who] = False

    def leave(self, who: Ints, x: ArrayLike, w: ArrayLike, omega: ArrayLike) -> None:
        """Note the states in which pymunk leaves particles in contact."""
        self.at[who], self.w[who], self.aim[who], self.spin[who] = x, w, w, omega
        self.upon[who], self.face[who] = 0.0, -1

    def go_on(self, who: Ints, t: float, dt: float) -> None:
        """Put particles in contact on the paths to the next step, dt later, from where they are.

        Half a step of gravity is given back at once, the other half is lost until then: a hop.
        """
        self.from_t[who], self.from_x[who] = t, self.at[who]
        self.from_v[who] = self.aim[who] - 0.5 * dt * self._g

    def lift(self, who: Ints, t: float, dt: float) -> None:
        """Let particles go that were in contact a step ago, at t, and are no more.

        Off a surface they go along the tangent; only along it is w half a step of gravity ahead.
        """
        fresh = self.from_t[who] > t
        self.fly(who[fresh])
        who = who[~fresh]
        n = self.upon[who]
        lead = 0.5 * dt * (self._g - (n @ self._g)[:, None] * n)
        self._write_held(who)
        self.knot(who, t, self.at[who], self.w[who] - lead, self.spin[who])
        self.fly(who)

    def foretold(self, who: Ints, t: float, x: Floats, v: Floats, omega: Floats) -> None:
        """Note a step in smooth contact; write the state before it where the curve deviates."""
        if not len(who):
            return
        s = t - self.t[who]
        new = who[~self._bend_known[who]]
        if len(new):
            self._bend[new] = ((v - self.v[who]) / s[:, None])[~self._bend_known[who]]
            self._bend_omega[new] = ((omega - self.omega[who]) / s)[~self._bend_known[who]]
            self._bend_known[new] = True
        speed = s[:, None] * self._bend[who]
        off_x = x - self.x[who] - s[:, None] * (self.v[who] + 0.5 * speed)
        off_v = v - self.v[who] - speed
        r = self._machine.particle.radius
        off_rim = r * np.abs(omega - self.omega[who] - s * self._bend_omega[who])
        off = (np.abs(off_x).max(axis=1) > KNOT_POSITION * r) | (
            np.maximum(np.abs(off_v).max(axis=1), off_rim) > KNOT_SPEED
        )
        turn = (off & self._held[who]).nonzero()[0]
        if len(turn):
            them = who[turn]
            self._write_held(them)
            step = t - self.t[them]
            self._bend[them] = (v[turn] - self.v[them]) / step[:, None]
            self._bend_omega[them] = (omega[turn] - self.omega[them]) / step

    def hold(self, who: Ints, t: ArrayLike, x: Floats, v: Floats, omega: Floats) -> None:
        """Remember states as knots that may not be needed."""
        self._held[who], self._held_t[who] = True, t
        self._held_x[who], self._held_v[who], self._held_omega[who] = x, v, omega

    def give_up(self, i: int, t: float) -> None:
        """Write the last state of a particle in contact if it is from before t, else forget it."""
        if self._held_t[i] < t:
            self._write_held(np.array([i]))
        self._held[i] = False

    def close(self, who: Ints) -> None:
        """Write the last states of particles in contact, if they are not knots yet."""
        self._write_held(who)

    def finish(self, who: Ints, reason: str) -> None:
        """End tracks at their last knots."""
        self.mode[who], self.exit[who] = DONE, np.inf
        self._recorder.ended[self.ids[who]] = REASONS.index(reason)

    def _write_held(self, who: Ints) -> None:
        them = who[self._held[who]]
        self._held[them] = False
        self.knot(
            them, self._held_t[them], self._held_x[them], self._held_v[them], self._held_omega[them]
        )
