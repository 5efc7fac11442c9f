"""Contacts in which nothing new happens: nobody needs to step those.

Who lies alone on a straight surface and changed by the same amount in the last steps will do so in
the next, at rest or sliding. A cluster in which no velocity changes and nothing slips moves on as
it is. Both are taken out of pymunk, and their books are written on, until something hits them,
comes to lie on them, or their support or their slip ends.
"""

from __future__ import annotations

from math import floor, inf, sqrt
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from chutelab.stepper.tracks import RESTING

if TYPE_CHECKING:
    from chutelab.stepper.books import Deeds
    from chutelab.stepper.state import Run
    from chutelab.stepper.world import Contacts

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]

QUIET = 1e-6
"""m/s; what moves more slowly relative to each other, or changes less in a step, is at rest."""

ALIKE = 1e-9
"""m/s; two changes of velocity that differ less are the same."""

STEPS = 3
"""Steps in a row after which what was the same will stay the same."""

CONTACT = 1e-3
"""Share of the radius: what is closer touches."""

_LIMITS = np.array([QUIET, ALIKE])


class Idle:
    """Who goes on as before.

    Attributes
    ----------
    asleep : ndarray of bool, (N,)
        Particles in contact that are not stepped.
    woken : ndarray of bool, (N,)
        Who woke after the last step.
    """

    def __init__(self, run: Run) -> None:
        self._run = run
        count = run.count
        self.asleep, self.woken = np.zeros((2, count), dtype=bool)
        self._alike = np.zeros(count, dtype=np.int64)
        self._until = np.full(count, np.inf)
        # None of them is sooner than this.
        self._soonest = inf
        # Per step: change of vx, vy and ω; belt work, friction loss and what that changes by.
        self._change = np.zeros((count, 3))
        self._dues = np.zeros((3, count)).T
        self._slides, self._pays = np.zeros((2, count), dtype=bool)

    def settle(self, contacts: Contacts, deeds: Deeds) -> None:
        """Put to sleep what was the same for some steps.

        Parameters
        ----------
        contacts : Contacts
            Of the step.
        deeds : Deeds
            What the contacts did.
        """
        run, who = self._run, deeds.who
        i, j, flat = contacts.first, contacts.other, deeds.flat
        alone = np.zeros(len(contacts.uses), dtype=bool)
        alone[i[flat]] = True
        # Who lies alone may slide, but always alike; of the others none may move.
        loud = (deeds.pace > QUIET) | deeds.rounded | run.world.partners.slope[j]
        loud[deeds.held] = True
        loud[flat] = np.abs(deeds.after[0][flat]) > QUIET
        restless = np.zeros(len(alone), dtype=bool)
        restless[i[loud]] = True
        restless[j[loud]] = True
        single = alone[who]
        before = self._change.take(who, axis=0) * single[:, None]
        u, v, turn = np.abs(deeds.change - before).T
        self._change[who] = deeds.change
        news = np.maximum(np.maximum(u, v), turn * run.radius)
        restless = restless[who] | (news > _LIMITS.take(single))
        alike = self._alike[who] + 1
        alike[restless] = 0
        self._alike[who] = alike
        if np.count_nonzero(alike < STEPS) == len(who):
            return
        awake = self._alike < STEPS
        pairs, fixed = contacts.pairs, contacts.fixed
        spread(awake, i[pairs], j[pairs])
        new = who[~awake[who]]
        if not len(new):
            return
        kept = self._change[new] * alone[new, None]
        self.hold(new)
        self._change[new] = kept
        for row in fixed[~awake[i[fixed]]].tolist():
            n, solid = int(i[row]), int(j[row]) - run.count
            self._until[n] = min(self._until[n], self._end(n, solid))
        for row in flat[~awake[i[flat]]].tolist():
            slip, push = float(deeds.after[1, row]), float(contacts.impulse[1, row])
            brakes = slip - float(deeds.before[1, row])
            self._slide(int(i[row]), slip, brakes, push, float(deeds.belt[row]))
        self._soonest = min(self._soonest, float(self._until[new].min()))

    def hold(self, who: Ints, *, calm: bool = True) -> None:
        """Put particles to sleep as they move, for good and at no cost; calm ones may settle."""
        self.asleep[who], self._slides[who], self._pays[who] = True, not calm, False
        self._until[who], self._change[who] = np.inf, 0.0

    def _slide(self, i: int, slip: float, brakes: float, push: float, belt: float) -> None:
        """Note what sliding on, by how much it slows down in a step, costs, and when it ends."""
        run, moving = self._run, abs(slip) > QUIET
        self._slides[i] = moving
        if moving and slip * brakes < 0.0:
            end = run.now + (floor(-slip / brakes) - 1.0) * run.dt
            self._until[i] = min(self._until[i], end)
        dues = push * belt, -push * (slip + 0.5 * brakes), -push * brakes
        self._dues[i], self._pays[i] = dues, any(dues)

    def _end(self, i: int, solid: int) -> float:
        """Return when a particle will come to the end of what it lies on, s."""
        run = self._run
        ax, ay, lx, ly, length = run.solids.lines[solid]
        x, y, u, v = run.tracks.left(i)
        du, dv, _ = self._change[i].tolist()
        foot, pace = (x - ax) * lx + (y - ay) * ly, u * lx + v * ly
        push = (du * lx + dv * ly) / run.dt
        # The speed it will have at most on the way, if it gains any.
        way = length - foot if pace > 0.0 else foot
        fastest = sqrt(pace * pace + 2.0 * abs(push) * length)
        return run.now + way / fastest if fastest > 0.0 else inf

    def move(self, t: float, tick: float) -> None:
        """Move sleepers on to t; wake those who need the step that ends at `tick`."""
        if not np.count_nonzero(self.asleep):
            return
        run, k = self._run, self._run.tracks
        resumed = self.asleep & (k.from_t < t)
        those = resumed.nonzero()[0]
        k.move_on(those, self._change.take(those, axis=0), t, run.dt)
        run.version += resumed
        run.calm += resumed & ~self._slides
        pays = resumed & self._pays
        if np.count_nonzero(pays):
            belt, friction, slower = self._dues.T
            on, books = run.stays.on.compress(pays), run.recorder.by_surface
            for entry, due in ((0, belt), (2, friction)):
                np.add(run.entries[:, entry], due, out=run.entries[:, entry], where=pays)
                np.add.at(books[:, entry], on, due.compress(pays))
            np.add(friction, slower, out=friction, where=pays)
        if self._soonest <= tick:
            self.wake((self.asleep & (self._until <= tick)).nonzero()[0])
            self._soonest = float(self._until[self.asleep].min(initial=inf))

    def acceleration(self, i: int) -> tuple[float, float]:
        """Return by how much the velocity of a sleeper changes, m/s²."""
        x, y = (self._change[i, :2] / self._run.dt).tolist()
        return x, y

    def wake(self, who: Ints) -> None:
        """Have pymunk step particles again, from where they are."""
        who = who[self.asleep[who]]
        if len(who):
            run, k = self._run, self._run.tracks
            self.asleep[who], self.woken[who] = False, True
            self._alike[who] = 0
            run.moved[who] = True
            # Seen from halfway between two steps, as what is stepped.
            states = np.empty((len(who), 6))
            states[:, 0], states[:, 1:3], states[:, 3:5] = k.from_t[who], k.from_x[who], k.w[who]
            states[:, 5] = k.spin[who]
            states[:, 3:] -= 0.5 * self._change[who]
            k.hold(who, states)
            # Half of what the last step paid: slip and what it pays change evenly.
            dues = self._dues[who] * self._pays[who, None]
            k.ahead[who] = 0.0
            k.ahead[who, 0] = 0.5 * dues[:, 0]
            k.ahead[who, 2] = 0.5 * dues[:, 1] - 0.375 * dues[:, 2]

    def disturb(self, i: int) -> None:
        """Wake a particle that is hit, and what touches it."""
        if self.asleep[i]:
            k = self._run.tracks
            x, y = (k.from_x - k.from_x[i]).T
            reach = 2.0 * self._run.radius * (1.0 + CONTACT)
            self.wake((self.asleep & (np.hypot(x, y) <= reach)).nonzero()[0])

    def stir(self, first: Ints, second: Ints, approach: Floats) -> None:
        """Wake whoever touches somebody awake, or approaches somebody, of pairs in contact (k,)."""
        run = self._run
        if not np.count_nonzero(self.asleep):
            return
        awake = run.crowd.stepped | ((run.tracks.mode == RESTING) & ~self.asleep)
        loud = approach > QUIET
        if np.count_nonzero(loud):
            awake[first.compress(loud)] = True
        elif not np.count_nonzero(awake.take(first) != awake.take(second)):
            first = second = first[:0]
        spread(awake, first, second)
        self.wake((awake & self.asleep).nonzero()[0])


def spread(mark: NDArray[np.bool_], first: Ints, second: Ints) -> None:
    """Spread a mark along pairs until nobody new is marked."""
    while len(news := (mark[first] != mark[second]).nonzero()[0]):
        mark[first[news]] = mark[second[news]] = True
