"""What single cases ask for besides the laws: endings, boxes, rest, twins."""

import numpy as np

from chutelab.checks.stress import EPS, Verdict
from chutelab.checks.stress.barriers import closest
from chutelab.results import REASONS

UNSEEN = ("none leaves", "none sinks", "lies still")
"""Demands that are lost, as some laws are, once a disk is on the wrong side of something."""

SUNK = 0.02
"""Share of the radius that a disk at rest may lie in another or in a surface: what a stream may
overlap at worst while it moves."""

STILL = 1e-2
"""m/s that a disk in a pile at rest may still move at: ten times the speed below which a run that
waits for rest calls itself settled."""

LOOKS, PLACES = 2000, 100_000
"""Times at which places are looked at, besides those of each one's knots; and places at a time."""

AMPLIFIED = 10.0
"""Factor by which a contact may magnify what rounding did before: the reach of a flight over the
radius of what it met, for flights of a few times that radius."""


def ended(e, reasons):
    """Particles end as they must; the figure counts the others."""
    wrong = [i for i, k in enumerate(e.recording.ended) if REASONS[k] not in reasons]
    detail = "particles"
    if wrong:
        detail += f": {wrong[0]} ended with {REASONS[e.recording.ended[wrong[0]]]}"
    return Verdict(len(wrong), 0.0, detail)


def inside(e, box):
    """No particle leaves a box (left, right, bottom, top, m); the figure counts those that do."""
    left, right, bottom, top = box

    def outside(position):
        x, y = np.moveaxis(position, -1, 0)
        return (x < left) | (x > right) | (y < bottom) | (y > top)

    knots, count = e.recording.knots, e.recording.count
    away = np.zeros(count, dtype=bool)
    away[e.recording.owner[outside(knots["position"])]] = True
    looks = np.linspace(knots["t"].min(), knots["t"].max(), LOOKS)
    for some in np.array_split(looks, 1 + LOOKS * count // PLACES):
        away |= outside(e.recording.at(some)[0]).any(axis=0)
    gone = np.flatnonzero(away)
    return Verdict(len(gone), 0.0, f"particles: {gone[0]}" if len(gone) else "particles")


def sunk(e):
    """At rest no disk lies deeper in anything than `SUNK`; the figure is a share of the radius."""
    r = e.machine.particle.radius
    _, last = e.recording.ends()
    position = last["position"]
    deepest, of = 0.0, "r"
    for piece, name in zip(e.machine.pieces, e.machine.names, strict=True):
        gap = piece.gap(position, r)
        i = int(np.argmin(gap))
        if -gap[i] > deepest:
            deepest, of = -float(gap[i]), f"r, particle {i} in {name}"
    found, i, j = closest(position, np.full(len(position), r))
    if found > deepest:
        deepest, of = found, f"r, particles {i} and {j}"
    return Verdict(deepest / r, SUNK, of)


def still(e):
    """At the end no particle moves; the figure is the largest speed, m/s."""
    _, last = e.recording.ends()
    speed = np.hypot(*last["velocity"].T) + e.machine.particle.radius * np.abs(last["omega"])
    i = int(np.argmax(speed))
    return Verdict(float(speed[i]), STILL, f"m/s, particle {i}")


def symmetric(e, other, twin):
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
        lasted = abs(np.ptp(mine["t"]) - np.ptp(its["t"])) * e.bounds.speed
        if lasted > worst:
            worst, where = lasted, f"m, the way of what particle {i} lasts longer"
    bound = twin.bound
    if bound is None:
        length = max(e.bounds.length, other.bounds.length)
        bound = EPS * length * AMPLIFIED ** min(e.recording.contacts + 1, 6)
    return Verdict(worst, bound, where)


def demands(case, e):
    """Judge a run by all that its case asks for and that needs no second run."""
    out = {}
    if case.ends:
        out["ends as it must"] = ended(e, case.ends)
    if case.inside is not None:
        out["none leaves"] = inside(e, case.inside)
    if case.at_rest:
        out["none sinks"], out["lies still"] = sunk(e), still(e)
    if case.formula is not None and (verdict := case.formula(e)) is not None:
        out["closed formula"] = verdict
    return out
