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
        # Per step: change of velocity and ω; belt work, friction loss and what that changes by.
        self._change, self._turn = np.zeros((count, 2)), np.zeros(count)
        self._dues = np.zeros((count, 3))
        self._slides = np.zeros(count, dtype=bool)
        # What a belt pays on a slope it pays for good.
        solids = run.solids
        self._slope = (solids.speed != 0.0) & (np.abs(solids.tangent[:, 1]) > 0.0)
        self._length = np.hypot(*(solids.b - solids.a).T)

    def settle(self, contacts: Contacts, who: Ints, deeds: Deeds) -> None:
        """Put to sleep what was the same for some steps.

        Parameters
        ----------
        contacts : Contacts
            Of the step.
        who : ndarray, (k,)
            Particles in them, not carried.
        deeds : Deeds
            What the contacts did.
        """
        run, k = self._run, self._run.tracks
        i, j = contacts.first, contacts.other
        pairs = j < run.count
        flat = (~pairs & (deeds.uses[i] == 1)).nonzero()[0]
        flat = flat[~deeds.rounded[flat]]
        change, turn = deeds.change[who], deeds.turn[who]
        off = np.abs(change - self._change[who]).max(axis=1)
        off = np.maximum(off, run.radius * np.abs(turn - self._turn[who]))
        self._change[who], self._turn[who] = change, turn
        restless = np.zeros(run.count, dtype=bool)
        restless[who] = np.maximum(np.abs(change).max(axis=1), run.radius * np.abs(turn)) > QUIET
        loud = np.maximum(np.abs(deeds.after_n), np.abs(deeds.after_t)) > QUIET
        loud[~pairs] |= self._slope[j[~pairs] - run.count] | deeds.rounded[~pairs]
        loud[pairs] |= k.mode[j[pairs]] == CARRIED
        restless[i[loud]] = True
        restless[j[loud & pairs]] = True
        alone = np.zeros(run.count, dtype=bool)
        alone[i[flat]] = True
        restless[i[flat]] = np.abs(deeds.after_n[flat]) > QUIET
        restless[who[alone[who] & (off > ALIKE)]] = True
        self._alike[who] = np.where(restless[who], 0, self._alike[who] + 1)
        awake = self._alike < STEPS
        spread(awake, i[pairs], j[pairs])
        new = who[~awake[who]]
        if not len(new):
            return
        self.asleep[new], self._slides[new] = True, False
        self._until[new] = np.inf
        self._dues[new] = 0.0
        crowd = new[~alone[new]]
        self._change[crowd], self._turn[crowd] = 0.0, 0.0
        supported = (~pairs & ~awake[i]).nonzero()[0]
        left = self._way_left(i[supported], j[supported] - run.count)
        np.minimum.at(self._until, i[supported], left)
        self._slide(contacts, flat[~awake[i[flat]]], deeds)

    def _slide(self, contacts: Contacts, rows: Ints, deeds: Deeds) -> None:
        """Note what sliding costs, and when it ends."""
        run = self._run
        who, slip, push = contacts.first[rows], deeds.after_t[rows], deeds.j_t[rows]
        brakes = deeds.after_t[rows] - deeds.before_t[rows]
        moving = np.abs(slip) > QUIET
        self._slides[who] = moving
        with np.errstate(divide="ignore", invalid="ignore"):
            steps = np.where(moving & (slip * brakes < 0.0), np.floor(-slip / brakes) - 1.0, np.inf)
        self._until[who] = np.minimum(self._until[who], run.now + steps * run.dt)
        self._dues[who, 0] = push * deeds.belt[rows]
        self._dues[who, 1] = -push * (slip + 0.5 * brakes)
        self._dues[who, 2] = -push * brakes

    def _way_left(self, who: Ints, solid: Ints) -> Floats:
        """Return when particles will come to the ends of what they lie on, s."""
        k, s = self._run.tracks, self._run.solids
        line = (s.b[solid] - s.a[solid]) / self._length[solid, None]
        foot = np.einsum("md,md->m", k.at[who] - s.a[solid], line)
        pace = np.einsum("md,md->m", k.w[who], line)
        push = np.einsum("md,md->m", self._change[who], line) / self._run.dt
        # The speed it will have at most on the way, if it gains any.
        way = np.where(pace > 0.0, self._length[solid] - foot, foot)
        fastest = np.sqrt(pace**2 + 2.0 * np.abs(push) * self._length[solid])
        with np.errstate(divide="ignore"):
            return np.asarray(self._run.now + way / fastest)

    def move(self, t: float, tick: float) -> None:
        """Move sleepers on to t; wake those who need the step that ends at `tick`."""
        who = self.asleep.nonzero()[0]
        if not len(who):
            return
        run, k = self._run, self._run.tracks
        resumed = who[k.from_t[who] < t]
        k.at[resumed] = k.from_x[resumed] + run.dt * k.w[resumed]
        k.w[resumed] += self._change[resumed]
        k.aim[resumed] = k.w[resumed]
        k.spin[resumed] += self._turn[resumed]
        k.go_on(resumed, t, run.dt)
        run.version[resumed] += 1
        run.calm[resumed[~self._slides[resumed]]] += 1
        pays = resumed[self._dues[resumed].any(axis=1)]
        if len(pays):
            dues = self._dues[pays]
            run.recorder.book(run.ids[pays], run.stays.on[pays], dues[:, 0], 0.0, dues[:, 1])
            self._dues[pays, 1] += dues[:, 2]
        self.wake(who[self._until[who] <= tick])

    def wake(self, who: Ints) -> None:
        """Have pymunk step particles again, from where they are."""
        who = who[self.asleep[who]]
        if len(who):
            run, k = self._run, self._run.tracks
            self.asleep[who] = False
            self._alike[who] = 0
            run.moved[who] = True
            # Seen from halfway between two steps, as what is stepped.
            w = k.w[who] - 0.5 * self._change[who]
            k.hold(who, k.from_t[who], k.from_x[who], w, k.spin[who] - 0.5 * self._turn[who])

    def disturb(self, i: int) -> None:
        """Wake a particle that is hit, and what touches it."""
        if self.asleep[i]:
            k = self._run.tracks
            who = self.asleep.nonzero()[0]
            apart = k.from_x[who] - k.from_x[i]
            reach = 2.0 * self._run.radius * (1.0 + CONTACT)
            self.wake(who[np.hypot(apart[:, 0], apart[:, 1]) <= reach])

    def stir(self, first: Ints, second: Ints, approach: Floats) -> None:
        """Wake whoever touches somebody awake, or approaches somebody, of pairs in contact (k,)."""
        run = self._run
        if not self.asleep.any():
            return
        awake = run.crowd.stepped | ((run.tracks.mode == RESTING) & ~self.asleep)
        awake[first[approach > QUIET]] = True
        spread(awake, first, second)
        self.wake((awake & self.asleep).nonzero()[0])


def spread(mark: NDArray[np.bool_], first: Ints, second: Ints) -> None:
    """Spread a mark along pairs until nobody new is marked."""
    while len(news := (mark[first] != mark[second]).nonzero()[0]):
        mark[first[news]] = mark[second[news]] = True
