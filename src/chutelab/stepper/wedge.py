"""Lone disks that surfaces drive into each other: no rigid disk could move on."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from chutelab.stepper.state import Run
    from chutelab.stepper.world import Contacts


def squeezed(run: Run, contacts: Contacts) -> bool:
    """Tell whether a step left a lone disk on its way into one of several solids it touches.

    Solved, no contact approaches. Where belts grip in a wedge there is no solution: whatever speed
    one surface imposes leads into another.
    """
    if len(contacts) < 2:
        return False
    _, after = run.world.states()
    approach = -(after[contacts.first, :2] * contacts.normal).sum(axis=1)
    return bool(approach.max() > run.slow)


def hold_fast(run: Run, i: int, solid: int) -> None:
    """Let a disk rest for good where its path began, its energy turned to heat by a solid.

    A real drive would stall there; nothing more is booked (as in the exact engine).
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
    run.idle.hold(np.array([i]))
