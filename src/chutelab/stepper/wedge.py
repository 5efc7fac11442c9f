"""Lone disks that surfaces drive into each other: no rigid disk could move on."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from chutelab.stepper.state import Run
    from chutelab.stepper.world import Contacts

SQUEEZED = 4e-3
"""Share of the radius; what a step leaves in contact it leaves less deep in a solid, see `HAIR` and
`SLOP`."""

REMAINDER = 10.0, 1e-3
"""Shares of what gravity gives in a step, and of the speed of a belt: what approaches more slowly
after the step may do so because the solver is iterative."""


def squeezed(run: Run, contacts: Contacts) -> bool:
    """Tell whether a step left a lone disk on its way into one of several solids it touches.

    Where surfaces that move or grip form a wedge a step has no solution: whatever speed one of them
    imposes leads into another.
    """
    if len(contacts) < 2:
        return False
    solids = contacts.other - run.count
    places, after = run.world.states()
    belts = float(np.abs(run.solids.speed[solids]).max())
    limit = max(REMAINDER[0] * run.soft, REMAINDER[1] * belts)
    approach = -float((contacts.normal @ after[0, :2]).min())
    if 0.0 < limit < approach:
        return True
    now, then = run.solids.gaps(np.array([places[0], run.tracks.from_x[0]]), run.radius)[:, solids]
    return bool(((now < then) & (now < -SQUEEZED * run.radius)).any())


def hold_fast(run: Run, i: int, solid: int) -> None:
    """Let a disk rest for good where its path began, its energy turned to heat by a solid.

    A real drive would stall there; nothing more is booked, and on what moves nothing settles (as in
    the exact engine).
    """
    k = run.tracks
    t, (x, y), (vx, vy), omega = (
        float(k.from_t[i]), k.from_x[i].tolist(), k.from_v[i].tolist(), k.turn(i)
    )  # fmt: skip
    k.close_one(i)
    k.mark(i, t, x, y, vx, vy, omega)
    p = run.machine.particle
    kinetic = 0.5 * p.mass * (vx * vx + vy * vy) + 0.5 * p.inertia * omega**2
    run.book(i, int(run.solids.surface[solid]), 0.0, kinetic, 0.0)
    k.mark(i, t, x, y, 0.0, 0.0, 0.0)
    run.rest(i)
    touched = run.solids.gaps(np.array([[x, y]]), run.radius)[0] < SQUEEZED * run.radius
    run.idle.hold(np.array([i]), calm=not run.solids.speed[touched].any())
