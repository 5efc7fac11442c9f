"""The energy ledger of a recording, at the end or at any time.

(K + U) at the end - (K + U) at the start
= belt_work + drive_work - restitution_loss - friction_loss + residual,
with hinges, U includes the energy in springs, and the losses include those of dampers. Every entry
is accumulated from impulses and contact-point velocities; none is a remainder. So the residual is
the numerical error, and is shown as such.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import chain
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from chutelab.results.record import Record, hermite, kept
from chutelab.results.rows import ENTRIES, PARTICLES, balance
from chutelab.util.arrays import Floats, Ints
from chutelab.util.tables import Sheet, Shown, number

ROUNDING = 1e-12
"""Share of the energy turned over up to which an entry is shown as 0, unless in detail."""

UNSEEN = 5e-6
"""Share of the energy turned over that is shown as 0.000 %; a heap at rest trembles with less."""

LOSSES = "restitution_loss", "friction_loss"
"""Entries that every ledger has."""

AIR = "still air"
"""Its row among the surfaces of a ledger; no surface may have a name with a space."""


@dataclass(frozen=True, repr=False)
class Ledger(Shown):
    """Energies of all particles together, and of hinges, J.

    Attributes
    ----------
    kinetic, potential : tuple of float
        At the start and at the end: each particle's release, and its own end. Rotation is part of
        the kinetic energy; y = 0 is the zero of the potential energy.
    belt_work : float
        Tangential impulse times belt speed: what the drives pay.
    drive_work : float
        Impulse times the velocity of the moving surface at the contact: the work of its drive; for
        hinges the work of motors. In the tracks and in `by_stream` it is part of the belt work,
        which there includes all work of hinges on particles.
    spring : tuple of float
        Energies in springs at the start and at the end. Kinetic and potential energies of hinges
        are counted in those of the particles, the latter with y = 0 at the hinge.
    damper_loss : float
        Energy that dampers take.
    push_work : float
        Work of forces by hand, see `chutelab.start`. In the tracks and in `by_stream` the work on
        particles is part of the belt work.
    restitution_loss : float
        Normal part of the losses in impacts.
    friction_loss : float
        Slip heat, and the loss to air.
    air_loss : float
        The part of it that is lost to air.
    residual : float
        Remainder of the balance: the numerical error.
    turned_over : float
        Kinetic energy at the start + the sizes of the three entries + the size of the change of
        potential energy. Where surfaces move, the greatest belt work on each particle's way counts.
    by_surface : dict of dict of float
        The three entries of each surface, of ``"particles"``, and with air of ``"still air"``;
        where surfaces move also ``drive_work``.
    by_stream : dict of dict
        ``kinetic``, ``potential``, the three entries, and ``from_others`` of each stream; empty if
        there is only one. ``from_others`` is the remainder of a stream's balance: the energy that
        it got from particles of other streams in contacts. Its sum over all streams is the
        residual.
    """

    kinetic: tuple[float, float]
    potential: tuple[float, float]
    belt_work: float
    restitution_loss: float
    friction_loss: float
    residual: float
    turned_over: float
    by_surface: dict[str, dict[str, float]]
    by_stream: dict[str, dict[str, Any]]
    drive_work: float = 0.0
    spring: tuple[float, float] = (0.0, 0.0)
    damper_loss: float = 0.0
    air_loss: float = 0.0
    push_work: float = 0.0

    @property
    def relative_residual(self) -> float:
        """|residual| as a share of the energy turned over (0 if nothing was)."""
        return abs(self.residual) / self.turned_over if self.turned_over > 0.0 else 0.0

    def sheet(self, *, details: bool = False) -> Sheet:
        """Return the entries of each surface that has any, their sum, its parts, and the residual.

        Works that are all 0 have no column. With `details` the residual is shown down to rounding.
        """
        share = self.relative_residual
        left = (
            f"residual {self.residual:.1e} J, {share:.1e} of the {number(self.turned_over)} J"
            " turned over"
            if details
            else f"energy that the ledger cannot explain: {100.0 * share:.3f} %"
        )

        def told(entry: float, share: float = ROUNDING) -> str:
            rounding = abs(entry) <= share * self.turned_over and not details
            return number(0.0 if rounding else entry)

        every = [*dict.fromkeys(chain.from_iterable(self.by_surface.values()))]
        names = [
            name
            for name in every
            if name in LOSSES or any(entries.get(name) for entries in self.by_surface.values())
        ]
        heads = [name.replace("_", " ") for name in names]

        def row(name: str, entries: dict[str, Any]) -> list[str]:
            return [name, *(told(entries[one]) if one in entries else "" for one in names)]

        rows = [
            row(name, dict.fromkeys(names, 0.0) | entries)
            for name, entries in self.by_surface.items()
        ]
        rows = [one for one in rows if {*one[1:]} - {"", "0"}]
        foot = [row("total", {name: getattr(self, name) for name in names})]
        if len(every) > len(ENTRIES) and self.by_stream:
            # What moving surfaces and springs give a stream is not the work of belts.
            heads = [*heads, "work on it"]
            rows, foot = ([[*one, ""] for one in part] for part in (rows, foot))
            for name, own in self.by_stream.items():
                losses = {one: own[one] for one in LOSSES}
                foot.append([*row(f"of {name}", losses), told(own["belt_work"])])
        else:
            foot += [row(f"of {name}", own) for name, own in self.by_stream.items()]
        kept = {"kinetic": self.kinetic, "potential above the origin": self.potential}
        kept |= {"spring": self.spring} if any(self.spring) else {}
        moved = [
            f"{name} {told(before, UNSEEN)} -> {told(after, UNSEEN)} J"
            for name, (before, after) in kept.items()
        ]
        return Sheet(
            "Energy ledger, J",
            ("", *heads),
            tuple(map(tuple, rows)),
            foot=tuple(map(tuple, foot)),
            notes=(*moved, left),
        )


def ledger_of_each(recording: Record) -> dict[str, Floats]:
    """Return the ledger of each released particle, (n,), J; its three `ENTRIES` together, (n, 3).

    The other names are those of the registry, without "ledger.".
    """
    (first, last), index = recording.ends(), np.flatnonzero(recording.released)
    (k0, p0), (k1, p1) = recording.energies(first, index), recording.energies(last, index)
    entries = last["entries"]
    return {
        "kinetic.start": k0, "kinetic.end": k1, "potential.start": p0, "potential.end": p1,
        "entries": entries, "residual": (k1 - k0) + (p1 - p0) - balance(entries),
    }  # fmt: skip


def worked(recording: Record) -> Floats:
    """Return the size of the belt work of each released particle, (n,), J.

    Where surfaces move, the greatest on its way: a drive that starts and stops takes back what it
    gave.
    """
    work: Floats = np.abs(recording.knots["entries"][:, 0])
    first, end = recording.offsets[:-1][recording.released], recording.offsets[1:]
    if recording.machine.movers and len(work):
        return np.asarray(np.maximum.reduceat(work, first))
    return work[end[recording.released] - 1]


@kept
def ledger_of_variants(recording: Record) -> dict[str, Floats]:
    """Return the ledger of each scene of a family, (V,), J; names as in the registry."""
    found, count = ledger_of_each(recording), recording.variants
    own = np.flatnonzero(recording.released) // (recording.count // count)
    entries = dict(zip(ENTRIES, found.pop("entries").T, strict=True))
    sums = {n: np.bincount(own, one, count) for n, one in (found | entries).items()}
    sizes = [np.abs(sums[entry]) for entry in ENTRIES]
    fall = np.abs(sums["potential.end"] - sums["potential.start"])
    return sums | {"turned_over": sums["kinetic.start"] + sum(sizes) + fall}


@kept
def ledger(recording: Record) -> Ledger:
    """Return the energy ledger of a recording."""
    found, names = ledger_of_each(recording), recording.machine.streams
    stream = recording.machine.releases.stream[recording.released]
    by_stream: dict[str, dict[str, Any]] = {}
    for n, name in enumerate(names if len(names) > 1 else ()):
        share = _closed({entry: values[stream == n] for entry, values in found.items()})
        del share["turned_over"]
        share["from_others"] = share.pop("residual")
        by_stream[name] = share
    by_surface = {
        name: dict(zip(ENTRIES, row, strict=True))
        for name, row in zip(recording.surfaces, recording.by_surface.tolist(), strict=True)
    }
    for entries, work in zip(by_surface.values(), recording.drives.tolist(), strict=False):
        entries["belt_work"] -= work
        entries["drive_work"] = work
    if recording.scene.air_density:
        by_surface[AIR] = dict(zip(ENTRIES, (0.0, 0.0, recording.air_loss), strict=True))
    closed, work = _closed(found), float(recording.drives.sum())
    if recording.machine.movers:
        closed["turned_over"] += float(worked(recording).sum()) - abs(closed["belt_work"])
    closed["belt_work"] -= work
    pushed = by_surface[PARTICLES]["belt_work"]
    if len(springs := recording.springs):
        # Show the work of springs as the energy that they store and the loss of their dampers.
        before, after, damped, given = springs.sum(axis=0).tolist()
        pushed = pushed - given if abs(pushed - given) > ROUNDING * abs(springs).sum() else 0.0
        by_surface[PARTICLES] |= {"belt_work": pushed, "damper_loss": damped}
        closed |= {
            "belt_work": closed["belt_work"] - given,
            "spring": (before, after),
            "damper_loss": damped,
            "residual": closed["residual"] + after - before + given + damped,
            "turned_over": closed["turned_over"] + abs(after - before) + damped,
        }
    if pushed:
        by_surface[PARTICLES] |= {"belt_work": 0.0, "push_work": pushed}
        closed |= {"belt_work": closed["belt_work"] - pushed, "push_work": pushed}
    return Ledger(
        **_hung(recording, by_surface, closed | {"drive_work": work}),
        by_surface=by_surface, by_stream=by_stream, air_loss=recording.air_loss,
    )  # fmt: skip


def _hung(
    recording: Record, by_surface: dict[str, dict[str, float]], closed: dict[str, Any]
) -> dict[str, Any]:
    """Add hinges to a ledger: energies, work of motors, and losses."""
    for mover in recording.machine.movers:
        if mover.hinge is None:
            continue
        entries = by_surface[recording.surfaces[mover.surface]]
        worked, stopped, damped, pushed = recording.hinge_work[mover.surface].tolist()
        states, given = mover.hinge.states[[0, -1]], entries["drive_work"]
        kinetic, lifted, spring = mover.hinge.energies(
            states["angle"], states["rate"], recording.gravity, recording.machine.up
        )
        energies = {"kinetic": kinetic, "potential": lifted, "spring": spring}
        for name, ends in energies.items():
            before = closed.get(name, (0.0, 0.0))
            closed[name] = (before[0] + float(ends[0]), before[1] + float(ends[1]))
        entries |= {"drive_work": worked} | ({} if mover.hinge.steered else {"damper_loss": damped})
        entries["restitution_loss"] += stopped
        if pushed:
            entries["push_work"] = pushed
            closed["push_work"] = closed.get("push_work", 0.0) + pushed
        closed["drive_work"] += worked - given
        closed["restitution_loss"] += stopped
        closed["damper_loss"] = closed.get("damper_loss", 0.0) + damped
        gained = float(sum(ends[1] - ends[0] for ends in energies.values()))
        closed["residual"] += gained + given - worked - pushed + stopped + damped
        sizes = worked, stopped, damped, pushed, lifted[1] - lifted[0], spring[1] - spring[0]
        closed["turned_over"] += float(sum(map(abs, sizes)) + kinetic[0])
    return closed


def _closed(found: dict[str, Floats]) -> dict[str, Any]:
    """Sum `ledger_of_each` over some particles."""
    kinetic, potential = (
        (float(found[f"{energy}.start"].sum()), float(found[f"{energy}.end"].sum()))
        for energy in ("kinetic", "potential")
    )
    entries = found["entries"].sum(axis=0).tolist()
    sizes = map(abs, (*entries, potential[1] - potential[0]))
    return {
        "kinetic": kinetic,
        "potential": potential,
        **dict(zip(ENTRIES, entries, strict=True)),
        "residual": float(found["residual"].sum()),
        "turned_over": sum(sizes, kinetic[0]),
    }


def energy_at(recording: Record, times: ArrayLike) -> dict[str, Floats]:
    """Return the energy ledger of all released particles up to each time.

    A particle that has ended keeps its last state. Between two knots the entries and the residual
    are interpolated linearly. The rest of the energy balance is booked on the process that goes on
    there: on the friction loss while a particle slips, since the force and so the power of the belt
    is constant on a flat face; else on the belt work while it is driven; else on the restitution
    loss, which changes between knots only in lasting contacts of a crowd. In flight nothing is
    booked, and the rest is the residual. With `totals` the sums are theirs at the steps; the same
    holds between two steps.

    Parameters
    ----------
    times : array_like, shape (T,)
        s, in any order.

    Returns
    -------
    dict of ndarray, shape (T,)
        ``kinetic``, ``potential`` (y = 0 is the zero), the three `ENTRIES`, and ``residual``:
        remainder of the balance since each release. J.
    """
    times = np.atleast_1d(np.asarray(times, dtype=np.float64))
    found = _on_tracks(recording, times)
    # A lone particle's tracks have everything; an impact on a hinge ends the step.
    if len(recording.totals) > 1 and recording.count > 1:
        within = (times >= recording.totals["t"][0]) & (times < recording.totals["t"][-1])
        found[:, within] = _as_totals(recording, times[within], found[:, within])
    return dict(zip(("kinetic", "potential", *ENTRIES, "residual"), found, strict=True))


def _on_tracks(recording: Record, times: Floats) -> Floats:
    """Return `energy_at` from the tracks, (6, T), J."""
    firsts, lasts = recording.ends()
    at_release = np.zeros(recording.count)
    particles = np.flatnonzero(recording.released)
    at_release[particles] = sum(recording.energies(firsts, particles))

    final = np.empty((6, len(lasts)))
    final[:2] = recording.energies(lasts, particles)
    final[2:5] = lasts["entries"].T
    final[5] = final[:2].sum(axis=0) - at_release[particles] - balance(lasts["entries"])
    order = np.argsort(lasts["t"], kind="stable")
    sums = np.concatenate([np.zeros((6, 1)), final[:, order].cumsum(axis=1)], axis=1)
    out = sums[:, np.searchsorted(lasts["t"][order], times, side="left")]

    for row, particle, left, share in recording.blocks(times):
        values = _under_way(recording, particle, left, share, at_release[particle])
        for total, value in zip(out, values, strict=True):
            np.add.at(total, row, value)
    return out


def _as_totals(recording: Record, times: Floats, found: Floats) -> Floats:
    """Return the sums of tracks (6, T), J, corrected to the totals of all steps.

    The correction is linear from just after one step to just before the next. The rest of the
    balance within a step is booked on the process that goes on there.
    """
    t, particles, firsts = (
        recording.totals["t"],
        np.flatnonzero(recording.released),
        recording.ends()[0],
    )
    order = np.argsort(firsts["t"], kind="stable")
    begun, at_release = (
        firsts["t"][order],
        np.stack(recording.energies(firsts, particles))[:, order],
    )
    sums = np.concatenate([np.zeros((2, 1)), at_release.cumsum(axis=1)], axis=1)
    before, after = (sums[:, np.searchsorted(begun, t, side=side)] for side in ("left", "right"))
    # After a step of no length, which has released particles, totals are noted again.
    before[:, 1:] = np.where(t[1:] > t[:-1], before[:, 1:], after[:, 1:])
    totals = recording.totals
    kinetic, potential, entries = totals["kinetic"], totals["potential"], totals["entries"]
    told = np.stack([kinetic, potential, *entries.T])
    residual = told[:2].sum(axis=0) - before.sum(axis=0) - balance(entries)
    told = np.concatenate([told, residual[None]])

    late = np.searchsorted(t, times, side="right") - 1
    step, own = np.unique(np.clip(late, 0, len(t) - 2), return_inverse=True)
    first = told[:, step] - _on_tracks(recording, t[step])
    # A particle released at the beginning of a step is in the tracks, but not yet in the totals.
    first[:2] += (after - before)[:, step]
    last = told[:, step + 1] - _on_tracks(recording, np.nextafter(t[step + 1], -np.inf))
    share = ((times - t[step][own]) / (t[step + 1] - t[step])[own]).clip(0.0, 1.0)
    found = found + first[:, own] + share * (last - first)[:, own]

    belt, restitution, friction = told[2:5, step + 1][:, own] != told[2:5, step][:, own]
    goes_on = belt | restitution | friction
    straight = residual[step][own] + share * (residual[step + 1] - residual[step])[own]
    missing = np.where(goes_on, found[5] - straight, 0.0)
    found[5] -= missing
    found[4] -= np.where(friction, missing, 0.0)
    found[2] += np.where(belt & ~friction, missing, 0.0)
    found[3] -= np.where(~belt & ~friction, missing, 0.0)
    return found


def _under_way(
    recording: Record, particle: Ints, left: Ints, share: Floats, at_release: Floats
) -> tuple[Floats, ...]:
    """Return `energy_at` for each cell, (c,)."""
    a, b = recording.knots[left], recording.knots[left + 1]
    where, pace = hermite(recording.knots, left, share)
    omega, then = a["omega"], b["omega"]
    omega = omega + share * (then - omega)
    body = recording.particle.of(particle)
    kinetic = body.kinetic(pace[:, 0], pace[:, 1], omega)
    potential = body.mass * recording.gravity * recording.machine.height(where)
    gain = kinetic + potential - at_release

    entries_a, entries_b = a["entries"].T, b["entries"].T
    residual_a, residual_b = (
        sum(recording.energies(knot, particle)) - at_release - balance(knot["entries"])
        for knot in (a, b)
    )
    belt, restitution, friction = entries_a + share * (entries_b - entries_a)
    residual = residual_a + share * (residual_b - residual_a)
    # Linear totals leave a rest, which is booked on the process that goes on.
    missing = gain - (belt - restitution - friction) - residual
    driven, struck, slips = entries_a != entries_b
    friction -= np.where(slips, missing, 0.0)
    belt += np.where(driven & ~slips, missing, 0.0)
    restitution -= np.where(struck & ~slips & ~driven, missing, 0.0)
    residual += np.where(slips | driven | struck, 0.0, missing)
    return kinetic, potential, belt, restitution, friction, residual
