"""One step of pymunk: what touches is solved together, and leaves on new paths."""

from __future__ import annotations

from math import hypot
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from chutelab.stepper.books import settle_books
from chutelab.stepper.tracks import CARRIED, FLYING, RESTING
from chutelab.stepper.wedge import hold_fast, squeezed

if TYPE_CHECKING:
    from chutelab.stepper.state import Run
    from chutelab.stepper.world import Contacts

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]
Mask = NDArray[np.bool_]


def kick(run: Run, carried: Mask, t0: float, t: float) -> None:
    """Step the particles in contact from t0 to t.

    Parameters
    ----------
    carried : ndarray of bool, (N,)
        Carried particles that may push others.
    """
    k = run.tracks
    resting, flying = (k.mode == RESTING) & ~run.idle.asleep, k.mode == FLYING
    if run.machine.align:
        flying &= run.crowd.stepped
    run.now = t
    _enter(run, resting | flying, carried, t)
    run.world.step(run.dt)
    contacts = run.world.contacts()
    if contacts is None:
        run.lift(resting.nonzero()[0], t0)
        run.touching = np.empty(0, dtype=np.int64)
        return
    if run.count == 1 and run.machine.align and squeezed(run, contacts):
        hold_fast(run, 0, int(contacts.other[0]) - run.count)
        return
    run.lift((resting & (contacts.uses[: run.count] == 0)).nonzero()[0], t0)
    _resolve(run, contacts, flying, t)
    who = ((k.mode == RESTING) & run.inside).nonzero()[0]
    k.go_on(who, t, run.dt)
    run.version[who] += 1


def _enter(run: Run, free: Mask, carried: Mask, t: float) -> None:
    """Have pymunk's own move bring every body to where its path is at t."""
    world, want = run.world, free | carried
    for n in (run.inside & ~want).nonzero()[0].tolist():
        world.remove(n)
    new = (want & ~run.inside).nonzero()[0]
    for n in new.tolist():
        world.add(n, carried=bool(carried[n]))
    run.inside = want
    run.moved[new] = True
    for n in (free & run.moved).nonzero()[0].tolist():
        _place(run, n, t)
    run.moved &= ~want
    for n in carried.nonzero()[0].tolist():
        x0, y0, _, _ = run.tracks.state(n, t - run.dt)
        x1, y1, _, _ = run.tracks.state(n, t)
        world.place(n, (x0, y0), ((x1 - x0) / run.dt, (y1 - y0) / run.dt))


def _place(run: Run, n: int, t: float) -> None:
    """Put the body of a particle a step before the point where its path is at t."""
    k, dt = run.tracks, run.dt
    x, y, vx, vy = k.state(n, t)
    wx, wy = vx, vy + 0.5 * dt * run.machine.gravity
    if k.mode[n] == RESTING:
        (nx, ny), (deep_x, deep_y) = k.upon[n].tolist(), run.sunk[n].tolist()
        x, y = x + deep_x, y + deep_y
        if run.bend[n] > 0.0:
            # Round a curve the normal turns with the way gone.
            (x0, y0), bend = k.from_x[n].tolist(), float(run.bend[n])
            nx, ny = nx + bend * (x - x0), ny + bend * (y - y0)
            size = hypot(nx, ny)
            nx, ny = nx / size, ny / size
        off = wx * nx + wy * ny
        wx, wy = wx - off * nx, wy - off * ny
    run.sunk[n] = 0.0
    k.send(n, wx, wy)
    run.world.place(n, (x - dt * wx, y - dt * wy), (wx, wy), k.turn(n))


def _resolve(run: Run, contacts: Contacts, flying: Mask, t: float) -> None:
    """Book what a step did, and remember who touches whom."""
    k = run.tracks
    x, after = run.world.states()
    motion = np.zeros((2, *after.shape))
    before = motion[0]
    before[: run.count], motion[1] = k.sent, after
    if np.count_nonzero(flying):
        who = flying.nonzero()[0]
        before[who, :2] = k.flight(who, t)[1] - 0.5 * run.dt * run.gravity
        before[who, 2] = k.omega[who]
    carried = (k.mode == CARRIED).nonzero()[0]
    if len(carried):
        before[carried, :2], before[carried, 2] = after[carried, :2], 0.0
        rows = k.mode[contacts.first] == CARRIED
        if np.count_nonzero(rows):
            contacts = contacts.turned(rows)
    settle_books(run, contacts, x, motion, t)
    run.touching = contacts.keys
