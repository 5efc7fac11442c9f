"""Numerical stability: the laws that a run must keep, whatever the scene.

Here are the laws on energy, ledger, momentum and the record, all laws by name, and `judge`. A law
takes `Evidence` and returns a `Verdict`, or None if it does not apply. Bounds are derived, not
fitted: from rounding for the exact engine, for the others also from what may happen in a step.

- `barriers`: the evidence and the verdict of a law; laws on places and on impacts.

The places of surfaces come from `machine.shapes`, which no engine uses to find a contact. The laws
of every run are in `results.laws`, which also finds particles inside a surface. Scenes that are
hard for an engine, with further requirements of each, are in ``tests/stress``.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from math import ceil, isfinite
from typing import Any

import numpy as np
from numpy.typing import NDArray

from chutelab.checks.stress.barriers import (
    A_CONTACT,
    EPS,
    ROUNDINGS,
    Evidence,
    Verdict,
    cone,
    depth,
    nothing_through,
    nothing_through_another,
    on_something,
    overlap,
    pressed,
    rebound,
    released_free,
    settled_to_stay,
    worst,
)
from chutelab.machine import Segments
from chutelab.results import laws
from chutelab.results.ledger import energy_at, ledger
from chutelab.util.arrays import Floats

__all__ = ["A_CONTACT", "EPS", "LAWS", "ROUNDINGS", "Evidence", "Verdict", "judge"]

Law = Callable[[Evidence], Verdict | None]

BALANCES = 2000
"""Times at which the energy of a crowd is summed."""


def finite(e: Evidence) -> Verdict:
    """Every number of a recording is finite; the figure counts those that are not."""
    bad, where = 0, ""
    for array in (e.recording.knots, e.recording.events):
        for name in array.dtype.names or ():
            found = int(np.count_nonzero(~np.isfinite(array[name])))
            bad, where = bad + found, where or (name if found else "")
    bad += int(np.count_nonzero(~np.isfinite(e.recording.by_surface)))
    bad += not isfinite(ledger(e.recording).residual)
    return Verdict(bad, 0.0, where or "numbers")


def ordered(e: Evidence) -> Verdict:
    """No track and no list of events goes back in time; the figure is the longest way back, s."""
    back = max(0.0, -np.diff(e.recording.events["t"]).min(initial=0.0))
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


def energy(e: Evidence) -> Verdict | None:
    """Kinetic and potential energy rise only by a belt's work.

    The figure is the largest rise above any earlier value, as a share of the energy in play; in a
    crowd without gravity of the contact engine without what the removal of overlaps may give in
    each step.
    """
    if not e.bounds.energy:
        return None
    if e.machine.interact:
        return _energy_of_crowd(e)
    knots, offsets = e.recording.knots, e.recording.offsets
    total = np.sum(e.energies, axis=0) - knots["entries"][:, 0]
    rises = []
    for i in range(e.recording.count):
        own = total[offsets[i] : offsets[i + 1]]
        if len(own):
            rise = own - np.minimum.accumulate(own)
            at = int(np.argmax(rise))
            t = knots["t"][offsets[i] + at]
            rises.append((rise[at] / e.bounds.energy, f"particle {i} at t = {t:.6g} s"))
    b = e.bounds
    return worst(rises, b.energy_bound + b.parted / b.energy, f"of {b.energy:.3g} J")


def _energy_of_crowd(e: Evidence) -> Verdict:
    recording = e.recording
    # The contact engine sums energies at steps; between them tracks leave out smaller changes.
    times, stepped = np.unique(recording.totals["t"]), len(recording.totals) > 1
    if not stepped:
        times = _instants_of_tracks(e)
    balance = energy_at(recording, times)
    first, _ = recording.ends()
    index = np.flatnonzero(recording.released)
    brought = np.sum(recording.energies(first, index), axis=0)
    brought = brought[np.argsort(first["t"], kind="stable")]
    entered = np.searchsorted(np.sort(first["t"]), times, side="right")
    start = np.concatenate([[0.0], np.cumsum(brought)])[entered]
    gain = balance["kinetic"] + balance["potential"] - start - balance["belt_work"]
    if stepped and not e.machine.gravity:
        # The removal of overlaps may give energy: in each step so much and no more. With gravity
        # only `held` is allowed in the whole run, as a pile must not live on its overlaps.
        change = np.diff(gain)
        up = np.flatnonzero(change > 0.0)
        given = laws.opened(recording, np.concatenate([times[up], times[up + 1]]))
        change[up] -= np.minimum(change[up], given.reshape(2, -1).max(axis=0))
        gain = np.append(0.0, np.cumsum(change))
    rise = gain - np.minimum.accumulate(gain)
    at = int(np.argmax(rise))
    b = e.bounds
    where = f"of {b.energy:.3g} J, at t = {times[at]:.6g} s"
    allowed = b.held if stepped and e.machine.gravity else b.parted
    return Verdict(float(rise[at]) / b.energy, b.energy_bound + allowed / b.energy, where)


def _instants_of_tracks(e: Evidence) -> Floats:
    """Return times of knots of a crowd at which energies are summed, s."""
    times = np.unique(e.recording.knots["t"])
    # Times that differ only by rounding are one instant: if two particles meet repeatedly within
    # it, one track may have each contact and the other only the last.
    times = times[np.diff(times, append=np.inf) > ROUNDINGS * EPS * np.abs(times).max()]
    if e.alike:
        # Chipmunk has velocities only at steps; in between the track is a cubic.
        span = e.machine.end_time - e.machine.releases.t[0]
        share = (times - e.machine.releases.t[0]) / span * ceil(span / e.dt - 1e-9)
        times = times[np.abs(share - np.rint(share)) < 1e-6]
    few = np.linspace(0, len(times) - 1, min(len(times), BALANCES)).astype(int)
    return np.asarray(times[few])


def residual(e: Evidence) -> Verdict | None:
    """Ledgers close; the figure is a share of the energy in play."""
    if not e.bounds.energy:
        return None
    figure = abs(ledger(e.recording).residual) / e.bounds.energy
    return Verdict(figure, e.bounds.energy_bound, f"of {e.bounds.energy:.3g} J")


def momentum(e: Evidence) -> Verdict | None:
    """Contacts between particles conserve their total momentum.

    Without surfaces only gravity changes it, also after particles have left. On frictionless
    surfaces with one normal, its part along them is conserved. The figure is a share of the sum of
    all m |v|.
    """
    m = e.machine
    straight = all(isinstance(piece, Segments) for piece in m.pieces)
    if not m.interact or not straight or m.movers or _tied_to_points(e):
        return None
    along = np.eye(2)
    if len(m.segments.length):
        if (e.recording.ended != 0).any():
            return None
        tangent = m.segments.tangent[0]
        turned = np.abs(m.segments.tangent @ [-tangent[1], tangent[0]])
        if (turned > EPS).any() or (m.segments.friction > 0.0).any():
            return None
        along = tangent[None]
    first, last = e.recording.ends()
    mass = e.masses[e.recording.released, None]
    begin, end, before, after = first["t"], last["t"], first["velocity"], last["velocity"]
    fall = -m.gravity * (end - begin)[:, None] * m.up
    change = (mass * (after - before - fall) @ along.T).sum(axis=0)
    size = (mass[:, 0] * (np.hypot(*before.T) + np.hypot(*fall.T))).sum()
    figure = float(np.abs(change).max() / size)
    rounding = EPS * (ROUNDINGS + A_CONTACT * max(e.recording.contacts, e.recording.steps))
    return Verdict(figure, rounding, "of the sum of m |v|")


def _tied_to_points(e: Evidence) -> bool:
    return any(joint.other < 0 or joint.over is not None for joint in e.machine.joints)


BORNE = 1e-9
"""Share of all impulses by which loads may differ from the change of momentum: rounding, and
impulses that are booked at the end of a step instead of within it."""


def loads(e: Evidence) -> Verdict | None:
    """Compare the loads on surfaces with the change of momentum less the weight.

    The figure is a share of all impulses on surfaces and all sizes m |v|.
    """
    if not e.machine.loads or _tied_to_points(e):
        return None
    borne = e.recording.impulses["force"]
    first, last = e.recording.ends()
    mass = e.masses[e.recording.released, None]
    begin, end, before, after = first["t"], last["t"], first["velocity"], last["velocity"]
    given = mass * (after - before)
    given += mass * e.machine.gravity * (end - begin)[:, None] * e.machine.up
    size = float(np.abs(borne).sum() + (mass * np.abs(before)).sum())
    off = float(np.abs(given.sum(axis=0) + borne.sum(axis=(0, 1))).max())
    return Verdict(off / size if size else off, BORNE, "of all impulses")


def spin(e: Evidence) -> Verdict | None:
    """Without surfaces and gravity contacts conserve the total angular momentum.

    For two disks that overlap by δ the arms of the impulse differ from r by δ/2. So the figure, a
    share of the sum of all m (|x - x0| + r) |v|, may be as large as the deepest overlap found, in
    radii.
    """
    m = e.machine
    if not m.interact or m.pieces or m.gravity > 0.0 or _tied_to_points(e):
        return None
    first, last = e.recording.ends()
    middle = last["position"].mean(axis=0)
    mass, inertia, radius = (of[e.recording.released] for of in (e.masses, e.inertias, e.radii))
    if (inertia == 0.0).any():
        return None

    def total(knots: NDArray[Any]) -> float:
        x, v = knots["position"] - middle, knots["velocity"]
        turning = mass * (x[:, 0] * v[:, 1] - x[:, 1] * v[:, 0])
        return float((turning + inertia * knots["omega"]).sum())

    arms = np.hypot(*(last["position"] - middle).T) + radius
    size = float((mass * arms * np.hypot(*last["velocity"].T)).sum())
    sunk = overlap(e)
    assert sunk is not None
    rounding = EPS * (ROUNDINGS + A_CONTACT * e.recording.steps)
    bound = rounding + sunk.figure / float(radius.min())
    return Verdict(abs(total(last) - total(first)) / size, bound, "of the sum of m |x| |v|")


def of_every_run(e: Evidence) -> Verdict:
    """Laws by which every run is judged at its end; the figure counts those that are broken.

    Among them are those of hinges, of particles with corners, and of each step's solution.
    """
    broken = laws.judge(e.recording)
    return Verdict(len(broken), 0.0, next((one.told for one in broken), "laws"))


UNSEEN = ("laws of every run", "nothing through", "nothing through another")
"""Laws that fail once a disk is on the wrong side of another or of a surface."""


def unseen(e: Evidence) -> str:
    """Return the reason why a disk may get to the wrong side in this run; empty if it cannot.

    With steps of equal length Chipmunk looks for contacts only at their ends. If a disk moves by
    more than its radius in a step, its centre may then be on the other side, and it is pushed
    there. So the pymunk engine does not promise the laws in `UNSEEN` there.
    """
    velocity, r = e.recording.knots["velocity"], e.radii[e.recording.owner]
    if not e.alike or not len(velocity):
        return ""
    assert e.dt is not None
    radii = float((np.hypot(*velocity.T) * e.dt / r).max())
    if radii <= 1.0:
        return ""
    return f"up to {radii:.2g} radii in a step, and contacts are looked for at its end only"


LAWS: dict[str, Law] = {
    "finite numbers": finite,
    "time goes forward": ordered,
    "none lost": released,
    "lasts to the end": lasting,
    "nothing through": nothing_through,
    "nothing inside": depth,
    "bounces off something": on_something,
    "released into room": released_free,
    "friction of the pair": cone,
    "rebound of the pair": rebound,
    "settled to stay": settled_to_stay,
    "no overlap": overlap,
    "pressed for a step": pressed,
    "nothing through another": nothing_through_another,
    "energy never rises": energy,
    "ledger closes": residual,
    "momentum": momentum,
    "loads": loads,
    "angular momentum": spin,
    "laws of every run": of_every_run,
}
"""Every law by its name in the table."""


def judge(e: Evidence) -> list[Verdict]:
    """Judge a run by every law that applies to it."""
    found = []
    for name, law in LAWS.items():
        if (verdict := law(e)) is not None:
            excused = name in UNSEEN and not verdict.holds
            found.append(replace(verdict, law=name, unpromised=unseen(e) if excused else ""))
    return found
