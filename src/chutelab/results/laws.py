"""The laws that every run is judged by as it ends: those that cost little.

They look at what is recorded, and at where the machine's surfaces are, and share nothing with the
engines. `Recording.laws` is what they find; `chutelab stress` has more of them, which take longer.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np

from chutelab.results.evidence import Evidence
from chutelab.results.recording import EVENT, Recording, blocks
from chutelab.util.arrays import Floats, Ints
from chutelab.util.tables import number

FINITE, THROUGH, INSIDE = "finite numbers", "nothing through a surface", "nothing inside a surface"
ENERGY, LOSSES, LEDGER = "energy rises only by drives", "no loss is negative", "the ledger closes"
STEP = "speed times step below the radius"

LAWS = (FINITE, THROUGH, INSIDE, ENERGY, LOSSES, LEDGER, STEP)
"""Their names, in the order in which they are told."""

INSTANTS = 24
"""Times at which the energy of all particles together is summed."""

_NUMBERS = np.dtype(
    {"names": ["t", "rest"], "formats": ["f8", ("f8", 10)],
     "offsets": [0, EVENT.itemsize - 80], "itemsize": EVENT.itemsize}
)  # fmt: skip
"""All numbers of an event that are not whole: its time, and the last ten."""


@dataclass(frozen=True)
class Broken:
    """A law that a run did not keep, where it did so first.

    Attributes
    ----------
    law : str
        One of `LAWS`.
    particles : int
        How many particles broke it; 0 if it is about all of them together.
    particle : int
        The first of them, -1 if it is about all together.
    t : float
        When, s; of what is about the whole run its end.
    position : tuple of float
        Where its centre was, m; NaN if it is about all together.
    surface : str
        Which surface it is about; "" if none.
    amount, bound : float
        What was found, and what it must not exceed, in `unit`.
    unit : str
        m, J, or "" of a count.
    advice : str
        What to do.
    """

    law: str
    particles: int
    particle: int
    t: float
    position: tuple[float, float]
    surface: str
    amount: float
    bound: float
    unit: str
    advice: str

    @property
    def told(self) -> str:
        """What was broken, by which particle, where, when, and by how much."""
        more = f" and {self.particles - 1:,} more" if self.particles > 1 else ""
        who = f"particle {self.particle}{more}" if self.particles else "all together"
        where = f", {self.surface}" if self.surface else ""
        place = f", x = {self.position[0]:.6g} m, y = {self.position[1]:.6g} m"
        at = f"t = {self.t:.6g} s{place if self.particles else ''}"
        found = f"{number(self.amount)} {self.unit}".strip()
        allowed = f"{number(self.bound)} {self.unit}".strip()
        return f"{self.law}: {who}{where} at {at}: {found}, allowed {allowed}"

    def __str__(self) -> str:
        return f"LAW BROKEN, {self.told}; do not trust these numbers; {self.advice}"


def judge(recording: Recording) -> tuple[Broken, ...]:
    """Judge a run: return the laws that it breaks, each once, in the order of `LAWS`."""
    e = Evidence(recording.machine, recording)
    if not len(recording.knots):
        return ()
    if (found := _unreal(e)) is not None:
        # The other laws say nothing about what is no number.
        return (found,)
    found_all = [*_barriers(e), *_books(e), *_steps(e)]
    return tuple(sorted(found_all, key=lambda one: LAWS.index(one.law))) if found_all else ()


def _told(
    e: Evidence, law: str, rows: Ints, amount: float, bound: float, unit: str = "J"
) -> Broken:
    """Return a law that is broken at some knots (k,), in the order in which they are held."""
    knots, offsets = e.recording.knots, e.recording.offsets
    owners = np.searchsorted(offsets, rows, side="right") - 1
    first = rows[np.argmin(knots["t"][rows])]
    x, y = knots["position"][first].tolist()
    return Broken(
        law, len(np.unique(owners)), int(np.searchsorted(offsets, first, side="right")) - 1,
        float(knots["t"][first]), (x, y), "", float(amount), float(bound), unit, _advice(e, law),
    )  # fmt: skip


def _of_all(e: Evidence, law: str, surface: str, amount: float, bound: float) -> Broken:
    end, nowhere = float(e.recording.knots["t"].max()), (np.nan, np.nan)
    advice = _advice(e, law)
    return Broken(law, 0, -1, end, nowhere, surface, float(amount), float(bound), "J", advice)


def _advice(e: Evidence, law: str) -> str:
    """Return what may help."""
    report = "if it stays so, report it with the scene"
    if e.engine == "exact":
        return f"run it with --engine contact, and {report}"
    step = f"a step of less than {number(e.machine.dt)} s (--dt)"
    if law == STEP or (e.alike and law in (THROUGH, INSIDE)):
        fastest = float(np.min(e.radii) / e.speed)
        other = "" if e.alike and (e.machine.threads or not _round(e)) else ", or --engine contact"
        return f"take a step of less than {number(min(fastest, e.machine.dt))} s (--dt){other}"
    return f"take {step}; {report}"


def _round(e: Evidence) -> bool:
    return all(outline is None for outline in e.machine.outlines)


def _unreal(e: Evidence) -> Broken | None:
    events = e.recording.events.view(_NUMBERS)
    parts = e.recording.by_surface, events["t"], events["rest"]
    if all(np.isfinite(part).all() for part in (e.sizes, *parts)):
        return None
    bad = np.flatnonzero(~np.isfinite(e.columns).all(axis=0))
    count = float(sum((~np.isfinite(part)).sum() for part in (e.columns, *parts)))
    if len(bad):
        return _told(e, FINITE, bad, count, 0.0, "")
    return _of_all(e, FINITE, "", count, 0.0)


def _barriers(e: Evidence) -> Iterator[Broken]:
    passed = {(hit.particle, hit.piece) for hit in e.hits if hit.passes}
    for law, passes in ((THROUGH, True), (INSIDE, False)) if e.hits else ():
        some = [
            hit
            for hit in e.hits
            if hit.passes == passes and (passes or (hit.particle, hit.piece) not in passed)
        ]
        if some:
            one = min(some, key=lambda hit: hit.t)
            deepest = max(hit.depth for hit in some)
            amount, bound = (len(some), 0.0) if passes else (deepest, e.allowed)
            yield Broken(
                law, len({hit.particle for hit in some}), one.particle, one.t, one.position,
                e.pieces_of(one.particle)[one.piece].name, float(amount), float(bound),
                "" if passes else "m", _advice(e, law),
            )  # fmt: skip


def _books(e: Evidence) -> Iterator[Broken]:
    """Judge energy and ledger.

    Of lone particles what is unexplained may not change from knot to knot; particles that meet give
    energy to each other, so of them it is the sum of all at some times, and what the solves of the
    contact engine gained. Losses that are booked are never less than before but by what parting
    overlaps gives: where many do so at one instant, those that overlap there. Where the contact
    engine holds a particle by itself in a nip, impulses of any size hold each other, and along
    normals seems to be given what friction takes: only the sum is known.
    """
    recording, gain, within = e.recording, e.gain, e.within
    bound = e.energy_bound * e.energy
    booked, most = e.columns[7:], bound + e.parted
    losses = booked[:, 1:] - booked[:, :-1]
    if losses.min(initial=0.0) < -most:
        together = e.engine == "contact" and not e.crowd
        back = np.where(within, losses.sum(axis=0) if together else losses.min(axis=0), 0.0)
        rows = (back < -most).nonzero()[0]
        rows, least = _beyond_overlaps(e, rows, back[rows], most)
        if len(rows):
            yield _told(e, LOSSES, rows + 1, back[rows].min(), -least)
    total = recording.by_surface[..., 1:]
    if total.min(initial=0.0) < -most:
        low = total.reshape(-1, *total.shape[-2:]).min(axis=(0, 2))
        name = recording.surfaces[int(low.argmin())]
        yield _of_all(e, LOSSES, name, low.min(), -most)
    first, last = e.ends
    residual = float((gain[last] - gain[first]).sum())
    if abs(residual) > bound:
        yield _of_all(e, LEDGER, "", abs(residual), bound)
    if not e.crowd:
        rises = gain[1:] - gain[:-1]
        if len(rises) and max(rises.max(), -rises.min()) > most:
            rises = np.abs(np.where(within, rises, 0.0))
            rows = (rises > most).nonzero()[0]
            if len(rows):
                yield _told(e, ENERGY, rows + 1, rises[rows].max(), most)
        return
    if recording.gained > bound:
        yield _of_all(e, ENERGY, "", recording.gained, bound)
    elif (rise := _rise(e).max(initial=0.0)) > most + e.untold:
        yield _of_all(e, ENERGY, "", rise, most + e.untold)


def _rise(e: Evidence) -> Floats:
    """Return what all together have at some times (T,) that is unexplained, J: the least it may be.

    When between its knots one got energy from another is not told, only how much: at any time
    between them it has at least the lesser of what is unexplained at the two.
    """
    recording, gain, t = e.recording, e.gain, e.columns[0]
    times = np.sort(t[:: max(1, len(t) // INSTANTS)])
    first, last = e.ends
    at_release = np.zeros(recording.count)
    at_release[recording.released] = gain[first]
    found = ((gain[last] - gain[first]) * (t[last] < times[:, None])).sum(axis=1)
    for row, particle, left, _ in blocks(recording.knots, recording.offsets, times):
        least = np.minimum(gain[left], gain[left + 1]) - at_release[particle]
        np.add.at(found, row, least)
    return np.asarray(found)


def _beyond_overlaps(e: Evidence, rows: Ints, back: Floats, most: float) -> tuple[Ints, float]:
    """Return which of some intervals (k,) give back more than overlaps may, and what these may, J.

    In a crowd of the contact engine all that ends at an instant is one sum, and of the instants
    those are judged at which most is given back.
    """
    if not (e.crowd and e.engine == "contact" and len(rows)):
        return rows, most
    times, which = np.unique(e.columns[0][rows + 1], return_inverse=True)
    given = np.bincount(which, back)
    worst = np.argsort(given)[:INSTANTS]
    allowed = most + np.maximum(e.opened(times[worst]), e.opened(times[worst] - e.machine.dt))
    bad = (given[worst] < -allowed).nonzero()[0]
    if not len(bad):
        return rows[:0], most
    return rows[np.isin(which, worst[bad])], float(allowed[bad].min())


def _steps(e: Evidence) -> Iterator[Broken]:
    """Where Chipmunk looks for contacts at the ends of steps only, none may go past one in a step.

    What flies where nothing is does no harm: judged is what may reach a surface or another in it.
    """
    if not e.alike or e.dt is None:
        return
    if e.speed * e.dt < e.radii.min():
        return
    knots = e.recording.knots
    way = np.hypot(*knots["velocity"].T) * e.dt
    radii = e.radii[e.recording.owner]
    fast = way >= radii
    corners = _corners(e)
    if len(corners):
        low, high = corners.min(axis=0), corners.max(axis=0)
        reach = (radii + way)[:, None]
        places = knots["position"]
        fast &= ((places >= low - reach) & (places <= high + reach)).all(axis=1)
    elif not e.crowd:
        return
    rows = fast.nonzero()[0]
    if len(rows):
        worst = rows[(way[rows] / radii[rows]).argmax()]
        yield _told(e, STEP, rows, way[worst], radii[worst], "m")


def _corners(e: Evidence) -> Floats:
    """Return points round which the box of all surfaces goes, (C, 2), m."""
    wheel: Any = e.machine.pulley
    found = e.machine.corners
    if wheel is not None:
        found = np.concatenate([found, [[wheel.radius] * 2, [-wheel.radius] * 2]])
    return np.asarray(found)
