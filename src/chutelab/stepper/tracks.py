"""What every particle is doing, the path it is on, and the knots of its track.

Between impulses every path is a parabola: of a flight from its last knot, of a particle in contact
from pymunk's last step to the next. In contact it gets a knot only where its track leaves the
parabola that the last ones foretold, so memory grows with what happens, not with steps.
"""

from __future__ import annotations

from array import array
from math import inf
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike, NDArray

from chutelab.ballistics import crossing
from chutelab.recording import KNOT, REASONS

if TYPE_CHECKING:
    from chutelab.machine import Machine
    from chutelab.recorder import Recorder

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]
Mask = NDArray[np.bool_]

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
    sent : ndarray, (N, 3)
        The same, and `spin`: the motion with which the next step begins.
    upon : ndarray, (N, 2)
        Normal of the surface that a particle in contact lies on; 0 with another particle, or in a
        corner.
    face : ndarray, (N,)
        Solid on whose flat face alone a particle in contact lies, or -1.
    exit : ndarray, (N,)
        s; when a flight leaves the scene, inf if it never does.
    held : ndarray of bool, (N,)
        In contact, with a last state that is no knot (yet).
    ahead : ndarray, (N, 3)
        Entries (J) booked beyond that state: it is halfway through a step's impulses.
    """

    def __init__(self, machine: Machine, recorder: Recorder, ids: Ints) -> None:
        count = len(ids)
        self.ids, self._names = ids, ids.tolist()
        self._machine = machine
        self._recorder = recorder
        self._g = np.array([0.0, -machine.gravity])
        self.mode = np.full(count, WAITING, dtype=np.int8)
        rim = KNOT_SPEED / machine.particle.radius
        place = KNOT_POSITION * machine.particle.radius
        self._limits = np.tile([inf, place, place, KNOT_SPEED, KNOT_SPEED, rim], (count, 1))
        self._knot = np.zeros((count, 6))
        self.t, self.omega = self._knot[:, 0], self._knot[:, 5]
        self.x, self.v = self._knot[:, 1:3], self._knot[:, 3:5]
        self._left = np.zeros((count, 9))
        self.at, self.w, self.upon = self._left[:, :2], self._left[:, 5:7], self._left[:, 7:]
        self.sent = self._left[:, 2:5]
        self.aim, self.spin = self.sent[:, :2], self.sent[:, 2]
        # Column by column: what concerns all is done in runs of N, not of 2.
        self.from_t, self._path = np.zeros(count), np.zeros((4, count))
        self.from_x, self.from_v = self._path.reshape(2, 2, count).transpose(0, 2, 1)
        self.face = np.full(count, -1)
        self.exit = np.full(count, np.inf)
        self.held, self.ahead = np.zeros(count, dtype=bool), np.zeros((count, 3))
        self._held = np.zeros((count, 6))
        self._box = machine.exit_box
        self._owners, self._knots = array("q"), array("d")
        # Of the state that a track in contact is to have: s (rate + s curve) later than its knot.
        self._rate, self._curve = np.zeros((2, count, 6))
        self._rate[:, 0] = 1.0
        self._bend_known = np.zeros(count, dtype=bool)

    def knot(self, who: Ints, t: ArrayLike, x: ArrayLike, v: ArrayLike, omega: ArrayLike) -> None:
        """Write a knot for each of some particles; it becomes their last."""
        rows = np.empty((len(who), 6))
        rows[:, 0], rows[:, 1:3], rows[:, 3:5], rows[:, 5] = t, x, v, omega
        for i, row in zip(who.tolist(), rows.tolist(), strict=True):
            self.mark(i, *row)

    def mark(
        self, i: int, t: float, x: float, y: float, vx: float, vy: float, omega: float
    ) -> None:
        """Write a knot for one particle."""
        self._knot[i] = t, x, y, vx, vy, omega
        n = self._names[i]
        self._write(i, n, self._recorder.entries[n])

    def _write(self, i: int, n: int, entries: Floats) -> None:
        self._owners.append(n)
        self._knots.frombytes(self._knot[i].tobytes() + entries.tobytes())

    def flush(self) -> None:
        """Hand over the knots written."""
        owners = np.array(self._owners, dtype=np.int64)
        self._recorder.add(owners, np.array(self._knots).view(KNOT))
        self._owners, self._knots = array("q"), array("d")

    def flight(self, who: Ints | slice, t: float) -> tuple[Floats, Floats]:
        """Return positions and velocities, (k, 2), on the present paths at a time."""
        s = (t - self.from_t[who])[:, None]
        v = self.from_v[who]
        return self.from_x[who] + s * (v + 0.5 * s * self._g), v + s * self._g

    def all_at(self, t: float) -> Floats:
        """Return x, y and velocities, (4, N), of all particles on their present paths."""
        s, out = t - self.from_t, self._path.copy()
        fall = s * self._machine.gravity
        out[3] -= 0.5 * fall
        out[:2] += s * out[2:]
        np.subtract(self._path[3], fall, out=out[3])
        return out

    def state(self, i: int, t: float) -> tuple[float, float, float, float]:
        """Return position and velocity of one particle on its present path at a time."""
        s = t - float(self.from_t[i])
        x, y, vx, vy = self._path[:, i].tolist()
        g = self._machine.gravity
        return x + s * vx, y + s * (vy - 0.5 * s * g), vx, vy - s * g

    def turn(self, i: int) -> float:
        """Return ω of a particle, rad/s."""
        return float(self.spin[i] if self.mode[i] == RESTING else self.omega[i])

    def fly(self, i: int) -> None:
        """Let a particle go from its last knot."""
        self.mode[i] = FLYING
        t, x, y, vx, vy, _ = self._knot[i].tolist()
        self.from_t[i], self._path[:, i] = t, (x, y, vx, vy)
        self.exit[i] = t + self._way_out(x, y, vx, vy)

    def _way_out(self, x: float, y: float, vx: float, vy: float) -> float:
        """Return when a flight leaves the scene, s; at once if it is beyond the edge already."""
        if self._machine.until == "time":
            return inf
        left, right, bottom, top = self._box
        if self._machine.gravity > 0.0:
            return crossing(max(y - bottom, 0.0), vy, -self._machine.gravity)
        return min(
            crossing(max(gap, 0.0), rate, 0.0)
            for gap, rate in ((x - left, vx), (right - x, -vx), (y - bottom, vy), (top - y, -vy))
        )

    def rest(self, who: Ints) -> None:
        """Keep particles in contact from their last knots on."""
        self.mode[who], self.exit[who] = RESTING, np.inf
        self.held[who] = self._bend_known[who] = False

    def stay(self, i: int, normal: tuple[float, float], face: int) -> None:
        """Keep one particle in contact, as its last knot has it, upon a normal and a face."""
        self.mode[i], self.exit[i], self.face[i] = RESTING, inf, face
        self.held[i] = self._bend_known[i] = False
        t, x, y, vx, vy, omega = self._knot[i].tolist()
        self._left[i] = x, y, vx, vy, omega, vx, vy, *normal
        self.from_t[i], self.from_x[i], self.from_v[i] = t, (x, y), (vx, vy)

    def leave(self, who: Ints, x: Floats, motion: Floats) -> None:
        """Note the states (k, 2) and (k, 3) in which pymunk leaves particles in contact."""
        rows = np.zeros((len(who), 9))
        rows[:, :2], rows[:, 2:5], rows[:, 5:7] = x, motion, motion[:, :2]
        self._left[who], self.face[who] = rows, -1

    def send(self, i: int, wx: float, wy: float) -> None:
        """Have pymunk move a particle in contact with a velocity."""
        row = self._left[i]
        row[2:4] = row[5:7] = wx, wy

    def left(self, i: int) -> tuple[float, ...]:
        """Return position and velocity in which pymunk left a particle in contact."""
        return (*self.at[i].tolist(), *self.w[i].tolist())

    def move_on(self, who: Ints, change: Floats, t: float, dt: float) -> None:
        """Move particles in contact to t as pymunk would, by changes (k, 3) of vx, vy and ω."""
        rows = self._left.take(who, axis=0)
        w = rows[:, 5:7]
        rows[:, :2] = self._path[:2].take(who, axis=1).T + dt * w
        w += change[:, :2]
        rows[:, 2:4] = w
        rows[:, 4] += change[:, 2]
        self._left[who] = rows
        self._hop(who, rows, t, dt)

    def go_on(self, who: Ints, t: float, dt: float) -> None:
        """Put particles in contact on the paths to the next step, dt later.

        Half a step of gravity is given back at once, the other half is lost until then: a hop.
        """
        self._hop(who, self._left.take(who, axis=0), t, dt)

    def _hop(self, who: Ints, left: Floats, t: float, dt: float) -> None:
        left[:, 3] += 0.5 * dt * self._machine.gravity
        self.from_t[who], self._path[:, who] = t, left.T[:4]

    def lift(self, i: int, t: float, dt: float) -> None:
        """Let a particle go that was in contact a step ago, at t, and is no more.

        Off a surface it goes along the tangent; only along it is w half a step of gravity ahead.
        """
        if self.from_t[i] <= t:
            self.close_one(i)
            x, y, _, _, spin, wx, wy, nx, ny = self._left[i].tolist()
            lead, g = 0.5 * dt, -self._machine.gravity
            off = ny * g
            self.mark(i, t, x, y, wx + lead * off * nx, wy - lead * (g - off * ny), spin)
        self.fly(i)

    def go_smoothly(self, who: Ints, states: Floats) -> None:
        """Note the states (k, 6), as those of knots, after a step in contact.

        Where the curve deviates from the one foretold, the state before is written.
        """
        if not len(who):
            return
        last = self._knot.take(who, axis=0)
        gone = states - last
        known = self._bend_known[who]
        if np.count_nonzero(known) < len(known):
            new = (~known).nonzero()[0]
            self._bend(who[new], gone[new])
            self._bend_known[who[new]] = True
        s = gone[:, 0].repeat(6).reshape(-1, 6)
        rate = self._rate.take(who, axis=0)
        rate[:, 1:3] = last[:, 3:5]
        off = np.abs(gone - s * (rate + s * self._curve.take(who, axis=0)))
        beyond = off > self._limits[: len(who)]
        if np.count_nonzero(beyond):
            turn = (beyond.any(axis=1) & self.held[who]).nonzero()[0]
            them = who[turn]
            for i in them.tolist():
                self.close_one(i)
            self._bend(them, states[turn] - self._held[them])
        self.hold(who, states)

    def _bend(self, who: Ints, gone: Floats) -> None:
        """Foretell curves by what changed (k, 6) since the last knots."""
        rate = gone[:, 3:] / gone[:, :1]
        self._rate[who, 3:], self._curve[who, 1:3] = rate, 0.5 * rate[:, :2]

    def hold(self, who: Ints, states: Floats) -> None:
        """Remember states (k, 6), as those of knots, that may not be needed as knots."""
        self.held[who], self._held[who] = True, states

    def give_up(self, i: int, t: float) -> None:
        """Write the last state of a particle in contact if it is from before t, else forget it."""
        if self._held[i, 0] < t:
            self.close_one(i)
        self.held[i] = False

    def close(self, who: Ints) -> None:
        """Write the last states of particles in contact, if they are not knots yet."""
        for i in who[self.held[who]].tolist():
            self.close_one(i)

    def close_one(self, i: int) -> None:
        """Write the last state of one particle in contact, if it is not a knot yet."""
        if self.held[i]:
            self.held[i] = False
            self._knot[i], n = self._held[i], self._names[i]
            self._write(i, n, self._recorder.entries[n] - self.ahead[i])

    def finish(self, who: Ints, reason: str) -> None:
        """End tracks at their last knots."""
        self.mode[who], self.exit[who] = DONE, np.inf
        self._recorder.ended[self.ids[who]] = REASONS.index(reason)
