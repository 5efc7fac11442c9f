"""Contacts in which nothing new happens: nobody needs to step those.

Who lies alone on a straight surface and changed by the same amount in the last steps will do so in
the next, at rest or sliding. A cluster in which no velocity changes and nothing slips moves on as
it is. Both are taken out of pymunk, and their books are written on, until something hits them,
comes to lie on them, or their support or their slip ends.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from chutelab.stepper.tracks import CARRIED, RESTING

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


class Idle:
    """Who goes on as before.

    Attributes
    ----------
    asleep : ndarray of bool, (N,)
        Particles in contact that are not stepped.
    """

    def __init__(self, run: Run) -> None:
        self._run = run
        count = run.count
        self.asleep = np.zeros(count, dtype=bool)
        self._alike = np.zeros(count, dtype=np.int64)
        self._until = np.full(count, np.inf)
        # Per step: change of vx, vy and ω; belt work, friction loss and what that changes by.
        self._change = np.zeros((3, count)).T
        self._lever = np.array([1.0, 1.0, run.radius])
        self._dues = np.zeros((count, 3))
        self._slides, self._pays = np.zeros((2, count), dtype=bool)
        # What a belt pays on a slope it pays for good.
        solids = run.solids
        self._slope = (solids.speed != 0.0) & (np.abs(solids.tangent[:, 1]) > 0.0)
        self._length = np.hypot(*(solids.b - solids.a).T)

    def settle(self, contacts: Contacts, deeds: Deeds) -> None:
        """Put to sleep what was the same for some steps.

        Parameters
        ----------
        contacts : Contacts
            Of the step.
        deeds : Deeds
            What the contacts did.
        """
        run, k, who = self._run, self._run.tracks, deeds.who
        i, j, pairs, fixed = contacts.first, contacts.other, contacts.pairs, contacts.fixed
        lone = (deeds.uses[i[fixed]] == 1) & ~deeds.rounded[fixed]
        flat = fixed[lone]
        alone = np.zeros(len(deeds.uses), dtype=bool)
        alone[i[flat]] = True
        # Who lies alone may slide, but always alike; of the others none may move.
        loud = deeds.pace > QUIET
        loud[fixed] |= deeds.rounded[fixed] | self._slope[j[fixed] - run.count]
        loud[pairs] |= k.mode[j[pairs]] == CARRIED
        loud[flat] = np.abs(deeds.after_n[flat]) > QUIET
        single = alone[who]
        before = self._change[who] * single[:, None]
        news = (np.abs(deeds.change - before) * self._lever).max(axis=1)
        self._change[who] = deeds.change
        restless = np.zeros(len(deeds.uses), dtype=bool)
        restless[who] = news > np.where(single, ALIKE, QUIET)
        restless[i[loud]] = True
        restless[j[loud]] = True
        self._alike[who] = np.where(restless[who], 0, self._alike[who] + 1)
        awake = self._alike < STEPS
        if np.count_nonzero(awake[who]) == len(who):
            return
        spread(awake, i[pairs], j[pairs])
        new = who[~awake[who]]
        if not len(new):
            return
        kept = self._change[new] * alone[new, None]
        self.hold(new)
        self._change[new] = kept
        supported = fixed[~awake[i[fixed]]]
        left = self._way_left(i[supported], j[supported] - run.count)
        np.minimum.at(self._until, i[supported], left)
        self._slide(contacts, flat[~awake[i[flat]]], deeds)

    def hold(self, who: Ints) -> None:
        """Put particles to sleep as they move, for good, and at no cost."""
        self.asleep[who], self._slides[who], self._pays[who] = True, False, False
        self._until[who], self._change[who] = np.inf, 0.0

    def _slide(self, contacts: Contacts, rows: Ints, deeds: Deeds) -> None:
        """Note what sliding costs, and when it ends."""
        run = self._run
        who, slip, push = contacts.first[rows], deeds.after_t[rows], contacts.j_t[rows]
        brakes = deeds.after_t[rows] - deeds.before_t[rows]
        moving = np.abs(slip) > QUIET
        self._slides[who] = moving
        with np.errstate(divide="ignore", invalid="ignore"):
            steps = np.where(moving & (slip * brakes < 0.0), np.floor(-slip / brakes) - 1.0, np.inf)
        self._until[who] = np.minimum(self._until[who], run.now + steps * run.dt)
        self._dues[who, 0] = push * deeds.belt[rows]
        self._dues[who, 1] = -push * (slip + 0.5 * brakes)
        self._dues[who, 2] = -push * brakes
        self._pays[who] = self._dues[who].any(axis=1)

    def _way_left(self, who: Ints, solid: Ints) -> Floats:
        """Return when particles will come to the ends of what they lie on, s."""
        k, s = self._run.tracks, self._run.solids
        line = (s.b[solid] - s.a[solid]) / self._length[solid, None]
        foot = np.einsum("md,md->m", k.at[who] - s.a[solid], line)
        pace = np.einsum("md,md->m", k.w[who], line)
        push = np.einsum("md,md->m", self._change[who, :2], line) / self._run.dt
        # The speed it will have at most on the way, if it gains any.
        way = np.where(pace > 0.0, self._length[solid] - foot, foot)
        fastest = np.sqrt(pace**2 + 2.0 * np.abs(push) * self._length[solid])
        with np.errstate(divide="ignore"):
            return np.asarray(self._run.now + way / fastest)

    def move(self, t: float, tick: float) -> None:
        """Move sleepers on to t; wake those who need the step that ends at `tick`."""
        if not np.count_nonzero(self.asleep):
            return
        run, k = self._run, self._run.tracks
        resumed = self.asleep & (k.from_t < t)
        both = resumed[:, None]
        np.copyto(k.at, k.from_x + run.dt * k.w, where=both)
        np.add(k.w, self._change[:, :2], out=k.w, where=both)
        np.copyto(k.aim, k.w, where=both)
        np.add(k.spin, self._change[:, 2], out=k.spin, where=resumed)
        run.go_on(resumed, t)
        run.calm += resumed & ~self._slides
        pays = (resumed & self._pays).nonzero()[0]
        if len(pays):
            dues = self._dues.take(pays, axis=0)
            entries = np.zeros((len(pays), 3))
            entries[:, ::2] = dues[:, :2]
            run.recorder.enter(run.ids.take(pays), run.stays.on.take(pays), entries)
            self._dues[pays, 1] += dues[:, 2]
        self.wake((self.asleep & (self._until <= tick)).nonzero()[0])

    def acceleration(self, i: int) -> tuple[float, float]:
        """Return by how much the velocity of a sleeper changes, m/s²."""
        x, y = (self._change[i, :2] / self._run.dt).tolist()
        return x, y

    def wake(self, who: Ints) -> None:
        """Have pymunk step particles again, from where they are."""
        who = who[self.asleep[who]]
        if len(who):
            run, k = self._run, self._run.tracks
            self.asleep[who] = False
            self._alike[who] = 0
            run.moved[who] = True
            # Seen from halfway between two steps, as what is stepped.
            motion = np.column_stack([k.w[who], k.spin[who]]) - 0.5 * self._change[who]
            k.hold(who, k.from_t[who], k.from_x[who], motion)
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
            return
        spread(awake, first, second)
        self.wake((awake & self.asleep).nonzero()[0])


def spread(mark: NDArray[np.bool_], first: Ints, second: Ints) -> None:
    """Spread a mark along pairs until nobody new is marked."""
    while len(news := (mark[first] != mark[second]).nonzero()[0]):
        mark[first[news]] = mark[second[news]] = True
