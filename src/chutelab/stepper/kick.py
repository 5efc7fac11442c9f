"""One step of pymunk: what touches is solved together, and leaves on new paths."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from chutelab.stepper.books import Motion, settle_books
from chutelab.stepper.tracks import CARRIED, FLYING, RESTING

if TYPE_CHECKING:
    from chutelab.stepper.state import Run
    from chutelab.stepper.world import Contacts

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]


def kick(run: Run, carried: NDArray[np.bool_], t0: float, t: float) -> None:
    """Step the particles in contact from t0 to t.

    Parameters
    ----------
    carried : ndarray of bool, (N,)
        Carried particles that may push others.
    """
    k = run.tracks
    free = (k.mode == RESTING) & ~run.idle.asleep
    free |= (k.mode == FLYING) & (run.crowd.stepped if run.machine.align else True)
    run.now = t
    _enter(run, free, carried, t)
    run.world.step(run.dt)
    contacts = run.world.contacts()
    touched = np.zeros(run.count, dtype=bool)
    if contacts is not None:
        touched[contacts.first] = True
        touched[contacts.other[contacts.other < run.count]] = True
    run.lift((free & (k.mode == RESTING) & ~touched).nonzero()[0], t0)
    if contacts is None:
        run.touching = np.empty(0, dtype=np.int64)
        return
    _resolve(run, contacts, t)
    resting = ((k.mode == RESTING) & free).nonzero()[0]
    k.go_on(resting, t, run.dt)
    run.version[resting] += 1


def _enter(run: Run, free: NDArray[np.bool_], carried: NDArray[np.bool_], t: float) -> None:
    """Have pymunk's own move bring every body to where its path is at t."""
    k, world = run.tracks, run.world
    want = free | carried
    for n in (run.inside & ~want).nonzero()[0].tolist():
        world.remove(n)
    new = (want & ~run.inside).nonzero()[0]
    for n in new.tolist():
        world.add(n, carried=bool(carried[n]))
    run.inside = want
    run.moved[new] = True
    who = (want & run.moved).nonzero()[0]
    run.moved[who] = False
    pushed = carried.nonzero()[0]
    if not len(who) and not len(pushed):
        return
    x, v = k.flight(who, t)
    x[k.mode[who] == RESTING] += run.sunk[who][k.mode[who] == RESTING]
    run.sunk[who] = 0.0
    w = v - 0.5 * run.dt * run.gravity
    laid = k.upon[who].any(axis=1) & (k.mode[who] == RESTING)
    normal = k.upon[who]
    turns = (laid & (run.bend[who] > 0.0)).nonzero()[0]
    if len(turns):
        # Round a curve the normal turns with the way gone.
        them = who[turns]
        turned = normal[turns] + run.bend[them, None] * (x[turns] - k.from_x[them])
        normal[turns] = turned / np.hypot(turned[:, 0], turned[:, 1])[:, None]
    w -= np.where(laid, (w * normal).sum(axis=1), 0.0)[:, None] * normal
    k.aim[who] = k.w[who] = w
    turn = np.where(k.mode[who] == RESTING, k.spin[who], k.omega[who])
    for n, a, b, c in zip(
        who.tolist(), (x - run.dt * w).tolist(), w.tolist(), turn.tolist(), strict=True
    ):
        world.place(n, tuple(a), tuple(b), c)
    x0, x1 = k.flight(pushed, t - run.dt)[0], k.flight(pushed, t)[0]
    for n, a, b in zip(pushed.tolist(), x0.tolist(), ((x1 - x0) / run.dt).tolist(), strict=True):
        world.place(n, tuple(a), tuple(b))


def _resolve(run: Run, contacts: Contacts, t: float) -> None:
    """Book what a step did, and remember who touches whom."""
    k = run.tracks
    x, v, spin = run.world.states()
    carried = k.mode == CARRIED
    first_carried = carried[contacts.first]
    if first_carried.any():
        contacts = contacts.turned(first_carried)
    flying = ((k.mode == FLYING) & run.inside).nonzero()[0]
    before, spin_before = k.aim.copy(), k.spin.copy()
    before[flying] = k.flight(flying, t)[1] - 0.5 * run.dt * run.gravity
    before[carried], spin_before[flying] = v[carried], k.omega[flying]
    spin_before[carried] = 0.0
    settle_books(run, contacts, x, Motion(before, v, spin_before, spin), t)
    run.touching = np.sort(run.keys(contacts.first, contacts.other))
