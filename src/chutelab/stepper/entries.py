"""Ledger entries of steps, and of halves of steps.

In a step pymunk changes a body's velocity from w to w', half a step ahead of the time on the clock.
Seen as a jump of the true velocity at the end of the step, from v to v', the sum v + v' is w + w'
whatever gravity does: J·(w + w')/2 is the work of an impulse to the last bit, at rest as in a blow.

The velocity at the end of the step is the mean of both, halfway through the jump. What its second
half does is ahead of a knot that has this velocity, and of a track that ends there.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from chutelab.stepper.tracks import CARRIED

if TYPE_CHECKING:
    from chutelab.stepper.books import Deeds
    from chutelab.stepper.state import Run
    from chutelab.stepper.world import Contacts

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]


def book(run: Run, contacts: Contacts, deeds: Deeds, after: Floats) -> None:
    """Book contacts; what two particles lose is shared, what a carried one gives is belt work.

    Parameters
    ----------
    contacts, deeds : Contacts, Deeds
        Of the step.
    after : ndarray, (N + K, 3)
        vx, vy and ω after it.
    """
    i, j, pairs, fixed = contacts.first, contacts.other, contacts.pairs, contacts.fixed
    carried = run.tracks.mode[j[pairs]] == CARRIED
    free, held = pairs[~carried], pairs[carried]
    share = np.full(len(i), -0.5)
    share[free] = -0.25
    # In the first three columns all of the step, in the others the second half of its impulses.
    entries = np.empty((len(i), 6))
    entries[:, 0] = contacts.j_t * deeds.belt
    entries[:, 1] = share * contacts.j_n * (deeds.before_n + deeds.after_n)
    entries[:, 2] = share * contacts.j_t * (deeds.before_t + deeds.after_t)
    entries[:, 3] = 0.5 * entries[:, 0]
    entries[:, 4] = 0.25 * share * contacts.j_n * (deeds.before_n + 3.0 * deeds.after_n)
    entries[:, 5] = 0.25 * share * contacts.j_t * (deeds.before_t + 3.0 * deeds.after_t)
    surface = np.full(len(i), run.particles)
    surface[fixed] = run.solids.surface[j[fixed] - run.count]
    if len(free):
        i, surface = np.concatenate([i, j[free]]), np.concatenate([surface, surface[free]])
        entries = np.concatenate([entries, entries[free]])
    if len(held):
        (nx, ny), (u, v, _) = contacts.normal[held].T, after[j[held]].T
        given = np.zeros((len(held), 6))
        given[:, 0] = contacts.j_n[held] * (u * nx + v * ny) + contacts.j_t[held] * (
            u * ny - v * nx
        )
        given[:, 3] = 0.5 * given[:, 0]
        i, surface = np.concatenate([i, i[held]]), np.concatenate([surface, 0 * held])
        entries = np.concatenate([entries, given])
    books, totals = run.recorder, _totals(i, entries, run.count)
    books.entries[run.ids] += totals[:, :3]
    books.by_surface += _totals(surface, entries, len(books.by_surface))[:, :3]
    run.tracks.ahead[:] = totals[:, 3:]
    run.ahead = i, surface, entries[:, 3:]


def _totals(where: Ints, entries: Floats, count: int) -> Floats:
    """Return the sums (count, 6) of entries (M, 6)."""
    cells = (6 * where[:, None] + np.arange(6)).ravel()
    return np.asarray(np.bincount(cells, entries.ravel(), 6 * count).reshape(-1, 6))


def end_contacts(run: Run, who: Ints) -> None:
    """Close the tracks of particles in contact, and take back what is booked beyond their ends."""
    k, books = run.tracks, run.recorder
    slept = who[run.idle.asleep[who]]
    stepped = np.zeros(run.count, dtype=bool)
    stepped[who] = k.held[who]
    stepped[slept] = False
    run.idle.wake(who)
    k.close(who)
    books.book(run.ids[slept], run.stays.on[slept], *-k.ahead[slept].T)
    owner, surface, ahead = run.ahead
    rows = stepped[owner].nonzero()[0]
    np.subtract.at(books.entries, run.ids[owner[rows]], ahead[rows])
    np.subtract.at(books.by_surface, surface[rows], ahead[rows])
