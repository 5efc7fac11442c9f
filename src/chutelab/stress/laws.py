"""The laws that every run must keep, one function each.

A law takes `Evidence` and answers with a `Verdict`, or with None where it says nothing. Bounds are
argued, not fitted: for the exact engine rounding, for the others also what can happen within a
step.
"""

from __future__ import annotations

from math import isfinite
from typing import TYPE_CHECKING

import numpy as np

from chutelab.ledger import ledger
from chutelab.stress.barriers import (
    depth,
    no_one_through,
    no_one_through_another,
    on_something,
    overlap,
    pressed,
    released_free,
    settled_to_stay,
)
from chutelab.stress.conservation import energy, momentum, residual, spin
from chutelab.stress.evidence import EPS, ROUNDINGS, Verdict

if TYPE_CHECKING:
    from collections.abc import Callable

    from chutelab.stress.evidence import Evidence

    Law = Callable[[Evidence], Verdict | None]


def finite(e: Evidence) -> Verdict:
    """Every number of a recording is finite; the figure counts those that are not."""
    bad, where = 0, ""
    for array, names in (
        (e.recording.knots, ("t", "position", "velocity", "omega", "entries")),
        (e.recording.events, ("t", "position", "velocity_before", "velocity_after",
                              "omega_before", "omega_after", "normal_impulse",
                              "tangential_impulse")),
    ):  # fmt: skip
        for name in names:
            found = int(np.count_nonzero(~np.isfinite(array[name])))
            bad, where = bad + found, where or (name if found else "")
    bad += int(np.count_nonzero(~np.isfinite(e.recording.by_surface)))
    bad += not isfinite(ledger(e.recording).residual)
    return Verdict(bad, 0.0, where or "numbers")


def ordered(e: Evidence) -> Verdict:
    """No track and no list of events goes back in time; the figure is the longest way back, s."""
    back = -np.diff(e.recording.events["t"]).min(initial=0.0)
    for i in range(e.recording.count):
        back = max(back, -np.diff(e.recording.track(i)["t"]).min(initial=0.0))
    return Verdict(float(back), 0.0, "s")


def released(e: Evidence) -> Verdict:
    """Every particle whose time comes has a track; the figure counts the lost ones."""
    due = e.machine.releases.t < e.machine.end_time
    lost = due & (np.diff(e.recording.offsets) < 2)
    return Verdict(int(np.count_nonzero(lost)), 0.0, "particles")


def lasting(e: Evidence) -> Verdict:
    """Tracks that only the clock ends last until the end of the run; the figure is in s."""
    end, offsets = e.machine.end_time, e.recording.offsets
    there = np.flatnonzero((e.recording.ended == 0) & (np.diff(offsets) > 0))
    short = np.abs(end - e.recording.knots["t"][offsets[there + 1] - 1])
    return Verdict(float(short.max(initial=0.0)), ROUNDINGS * EPS * end, "s")


UNSEEN = (
    "no one through", "no one through another", "nobody leaves", "nobody sinks", "lies still",
)  # fmt: skip
"""What is lost once a disk is on the wrong side of another or of a surface."""


def unpromised(e: Evidence, law: str) -> str:
    """Return why an engine does not promise a law in this run, empty if it does.

    Where steps are all alike Chipmunk looks for contacts at their ends only. A disk that goes
    farther than its radius in one may have its centre on the other side then, to which it is
    pushed.
    """
    velocity, r = e.recording.knots["velocity"], e.machine.particle.radius
    if law not in UNSEEN or not e.alike or not len(velocity):
        return ""
    assert e.dt is not None
    radii = float(np.hypot(*velocity.T).max()) * e.dt / r
    if radii <= 1.0:
        return ""
    return f"up to {radii:.2g} radii in a step, and contacts are looked for at its end only"


LAWS: dict[str, Law] = {
    "finite numbers": finite,
    "time goes forward": ordered,
    "nobody lost": released,
    "lasts to the end": lasting,
    "no one through": no_one_through,
    "no one inside": depth,
    "bounces off something": on_something,
    "released into room": released_free,
    "settled to stay": settled_to_stay,
    "no overlap": overlap,
    "pressed for a step": pressed,
    "no one through another": no_one_through_another,
    "energy never rises": energy,
    "ledger closes": residual,
    "momentum": momentum,
    "angular momentum": spin,
}
"""Every law by its name in the table."""
