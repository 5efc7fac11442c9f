"""The laws that every run must keep, and what single cases ask for besides, one function each.

A law takes `Evidence` and answers with a `Verdict`, or with None where it says nothing. Bounds are
argued, not fitted: for the exact engine rounding, for the others also what can happen within a
step.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from math import isfinite

import numpy as np

from chutelab.checks.stress.barriers import (
    closest,
    depth,
    gaps,
    no_one_through,
    no_one_through_another,
    on_something,
    overlap,
    pressed,
    released_free,
    settled_to_stay,
)
from chutelab.checks.stress.case import Case, Ladder, Twin
from chutelab.checks.stress.conservation import energy, momentum, residual, spin
from chutelab.checks.stress.evidence import EPS, ROUNDINGS, Evidence, Verdict
from chutelab.results import REASONS
from chutelab.results.ledger import ledger

Law = Callable[[Evidence], Verdict | None]

SUNK = 0.02
"""Share of the radius that a disk at rest may lie in another or in a surface: what a stream may
overlap at worst while it moves."""

STILL = 1e-2
"""m/s that a disk in a pile at rest may still move at: ten times the speed below which a run that
waits for rest calls itself settled."""

AMPLIFIED = 10.0
"""Factor by which a contact may magnify what rounding did before: the reach of a flight over the
radius of what it met, for flights of a few times that radius."""


def ended(e: Evidence, reasons: Sequence[str]) -> Verdict:
    """Particles end as they must; the figure counts the others."""
    wrong = [i for i, k in enumerate(e.recording.ended) if REASONS[k] not in reasons]
    detail = "particles"
    if wrong:
        detail += f": {wrong[0]} ended with {REASONS[e.recording.ended[wrong[0]]]}"
    return Verdict(len(wrong), 0.0, detail)


def inside(e: Evidence, box: tuple[float, float, float, float]) -> Verdict:
    """Nobody leaves a box (left, right, bottom, top, m); the figure counts those who do."""
    left, right, bottom, top = box
    x, y = e.samples.position.T
    out = (x < left) | (x > right) | (y < bottom) | (y > top)
    gone = np.unique(e.samples.particle[out])
    return Verdict(len(gone), 0.0, f"particles: {gone[0]}" if len(gone) else "particles")


def sunk(e: Evidence) -> Verdict:
    """At rest nobody lies deeper in anything than `SUNK`; the figure is a share of the radius."""
    r = e.machine.particle.radius
    _, last = e.recording.ends()
    position = last["position"]
    deepest, of = 0.0, "r"
    for name, gap in gaps(e.machine, position):
        i = int(np.argmin(gap))
        if -gap[i] > deepest:
            deepest, of = -float(gap[i]), f"r, particle {i} in {name}"
    found, i, j = closest(position, r)
    if found > deepest:
        deepest, of = found, f"r, particles {i} and {j}"
    return Verdict(deepest / r, SUNK, of)


def still(e: Evidence) -> Verdict:
    """At the end nobody moves; the figure is the largest speed, m/s."""
    _, last = e.recording.ends()
    speed = np.hypot(*last["velocity"].T) + e.machine.particle.radius * np.abs(last["omega"])
    i = int(np.argmax(speed))
    return Verdict(float(speed[i]), STILL, f"m/s, particle {i}")


def symmetric(e: Evidence, other: Evidence, twin: Twin) -> Verdict:
    """Judge whether a run and its twin's, moved back, are one; the figure is the distance, m."""
    one, two = e.recording, other.recording
    worst, where = 0.0, "m"
    pairs = [(0, twin.particle)] if twin.particle >= 0 else [(i, i) for i in range(one.count)]
    for i, j in pairs:
        mine, its = one.track(i), two.track(j)
        span = min(np.ptp(mine["t"]), np.ptp(its["t"]))
        ages = np.unique(np.concatenate([mine["t"] - mine["t"][0], np.linspace(0.0, span, 200)]))
        ages = ages[ages <= span]
        late = np.minimum(its["t"][0] + ages, its["t"][-1])
        p = one.at(np.minimum(mine["t"][0] + ages, mine["t"][-1]))[0][:, i]
        q = twin.back(two.at(late)[0][:, j])
        apart = np.hypot(*(p - q).T)
        at = int(np.argmax(apart))
        if not apart[at] <= worst:
            worst = float(apart[at])
            where = f"m, particle {i} at t = {mine['t'][0] + ages[at]:.6g} s"
        # One that lasts longer than the other has done something else, unless it is rounding.
        lasted = abs(np.ptp(mine["t"]) - np.ptp(its["t"])) * e.speed
        if lasted > worst:
            worst, where = lasted, f"m, the way of what particle {i} lasts longer"
    bound = twin.bound
    if bound is None:
        bound = EPS * max(e.length, other.length) * AMPLIFIED ** min(e.recording.contacts + 1, 6)
    return Verdict(worst, bound, where)


def order(ladder: Ladder, errors: Sequence[float]) -> Verdict:
    """Errors fall with the step until rounding takes over; the figure is the fitted order.

    An error depends on where a step happens to fall, so what is fitted is the largest error at this
    step or any finer one. The first at the floor is the last one counted; a method that is at the
    floor from the first step on has nothing to converge: its figure is the order asked for.
    """
    if not np.isfinite(errors).all():
        return Verdict(np.nan, ladder.order, "not every run got there", least=True)
    worst = np.maximum(np.maximum.accumulate(np.array(errors)[::-1])[::-1], ladder.floor)
    said = "errors " + ", ".join(f"{error:.1e}" for error in errors)
    if worst[0] == ladder.floor:
        return Verdict(ladder.order, ladder.order, f"{said}: all rounding", least=True)
    count = np.count_nonzero(worst > ladder.floor) + 1
    slope = np.polyfit(np.log2(ladder.steps[:count]), np.log2(worst[:count]), 1)[0]
    return Verdict(float(slope), ladder.order, said, least=True)


def demands(case: Case, e: Evidence) -> dict[str, Verdict]:
    """Judge a run by all that its case asks for and that needs no second run."""
    out: dict[str, Verdict] = {}
    if case.ends:
        out["ends as it must"] = ended(e, case.ends)
    if case.inside is not None:
        out["nobody leaves"] = inside(e, case.inside)
    if case.at_rest:
        out["nobody sinks"], out["lies still"] = sunk(e), still(e)
    if case.formula is not None and (verdict := case.formula(e)) is not None:
        out["closed formula"] = verdict
    return out


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
