"""Ledger entries of steps, and of halves of steps.

In a step pymunk changes a body's velocity from w to w', half a step ahead of the time on the clock.
Seen as a jump of the true velocity at the end of the step, from v to v', the sum v + v' is w + w'
whatever gravity does: J·(w + w')/2 is the work of an impulse to the last bit, at rest as in a blow.

The velocity at the end of the step is the mean of both, halfway through the jump. What its second
half does, J·(w + 3 w')/8, is ahead of a knot that has this velocity, and of a track that ends
there; but for a hop's m (g dt)²/8, which does not add up.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

if TYPE_CHECKING:
    from chutelab.stepper.books import Deeds
    from chutelab.stepper.state import Run
    from chutelab.stepper.world import Contacts

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]

_ROWS = np.arange(6)[:, None]


def book(run: Run, contacts: Contacts, deeds: Deeds, after: Floats) -> None:
    """Book contacts; what two particles lose is shared, what a carried one gives is belt work.

    Parameters
    ----------
    contacts, deeds : Contacts, Deeds
        Of the step.
    after : ndarray, (N + K, 3)
        vx, vy and ω after it.
    """
    i, j, free, held = contacts.first, contacts.other, deeds.free, deeds.held
    partners, count = run.world.partners, len(contacts)
    share = partners.share[j]
    share[held] = -0.5
    # In the first three rows all of the step, in the others the second half of its impulses.
    # Behind its contacts what the other one of two particles gets.
    entries = np.empty((6, count + len(free)))
    own = entries[:, :count]
    own[0] = contacts.impulse[1] * deeds.belt
    own[3] = 0.5 * own[0]
    push = share * contacts.impulse
    own[1:3] = push * (deeds.before + deeds.after)
    own[4:] = 0.25 * push * (deeds.before + 3.0 * deeds.after)
    surface = partners.surface[j]
    if len(free):
        i, surface = np.concatenate((i, j[free])), np.concatenate((surface, surface[free]))
        entries[:, count:] = own.take(free, axis=1)
    if len(held):
        (nx, ny), (u, v, _) = contacts.normal[held].T, after[j[held]].T
        (j_n, j_t), given = contacts.impulse[:, held], np.zeros((6, len(held)))
        given[0] = j_n * (u * nx + v * ny) + j_t * (u * ny - v * nx)
        given[3] = 0.5 * given[0]
        i, surface = np.concatenate((i, i[held])), np.concatenate((surface, np.zeros_like(held)))
        entries = np.concatenate((entries, given), axis=1)
    totals, by_surface = _totals(i, entries, run.count), run.recorder.by_surface
    run.entries += totals[:, :3]
    run.tracks.ahead[:] = totals[:, 3:]
    by_surface += _totals(surface, entries[:3], len(by_surface))
    run.ahead = i, surface, entries[3:].T
    run.idle.woken[:] = False


def _totals(where: Ints, entries: Floats, count: int) -> Floats:
    """Return the sums (count, n) of entries (n, M), n up to 6."""
    n = len(entries)
    cells = (where + count * _ROWS[:n]).ravel()
    return np.asarray(np.bincount(cells, entries.ravel(), n * count).reshape(n, count).T)


def end_contacts(run: Run, who: Ints) -> None:
    """Close the tracks of particles in contact, and take back what is booked beyond their ends."""
    k, books = run.tracks, run.recorder
    run.idle.wake(who)
    who = who[k.held[who]]
    k.close(who)
    # Who slept since the last step of pymunk had no part in it.
    slept = run.idle.woken[who]
    woken = who[slept]
    books.book(run.ids[woken], run.stays.on[woken], *-k.ahead[woken].T)
    stepped = np.zeros(run.count, dtype=bool)
    stepped[who[~slept]] = True
    owner, surface, ahead = run.ahead
    rows = stepped[owner].nonzero()[0]
    np.subtract.at(run.entries, owner[rows], ahead[rows])
    np.subtract.at(books.by_surface, surface[rows], ahead[rows])
