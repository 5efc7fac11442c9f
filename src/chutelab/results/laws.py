"""The laws by which every run is judged at its end: those that cost little.

They use the recording and the places of the machine's surfaces, and share nothing with the engines.
The core finds broken laws (laws.c and what it calls); the words are here. `Recording.laws` is the
result; `chutelab stress` has more laws, which take longer.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from math import hypot, isfinite, nan, sqrt
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from chutelab import core
from chutelab.machine import Machine, hand_over
from chutelab.results.record import Record
from chutelab.results.rows import EVENT, balance
from chutelab.util.arrays import Floats
from chutelab.util.tables import number

FINITE, THROUGH, INSIDE = "finite numbers", "nothing through a surface", "nothing inside a surface"
APART = "nothing inside another particle"
ENERGY, LOSSES, LEDGER = "energy rises only by drives", "no loss is negative", "the ledger closes"
SOLVED, STEP = "each step is solved", "speed times step below the radius"

LAWS = (FINITE, THROUGH, INSIDE, APART, ENERGY, LOSSES, LEDGER, SOLVED, STEP)
"""Their names, in the order of reports and of the core's enum Law."""

UNITS = {FINITE: "", THROUGH: "", INSIDE: "m", APART: "radii", SOLVED: "radii", STEP: "m"}
"""Units of the amounts found; of the others J."""

INTEGER = np.dtype("<i4")

_NUMBERS = np.dtype(
    {"names": ["t", "rest"], "formats": ["f8", ("f8", 10)],
     "offsets": [0, EVENT.itemsize - 80], "itemsize": EVENT.itemsize}
)  # fmt: skip
"""All floats of an event: its time, and the last ten."""


@dataclass(frozen=True)
class Broken:
    """A law that a run broke, at the first place.

    Attributes
    ----------
    law : str
        One of `LAWS`.
    particles : int
        How many particles broke it; 0 if it concerns all of them together.
    particle : int
        The first of them; -1 if it concerns all together.
    t : float
        Time, s; the end of the run if the law concerns the whole run.
    position : tuple of float
        Place of its centre, m; NaN if it concerns all together.
    surface : str
        The surface concerned; "" if none.
    amount, bound : float
        The amount found and its upper bound, in `unit`.
    unit : str
        m, J, radii, or "" for a count.
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
        """The law, the particle, place, time and amount in words."""
        more = f" and {self.particles - 1:,} more" if self.particles > 1 else ""
        which = f"particle {self.particle}{more}" if self.particles else "all together"
        where = f", {self.surface}" if self.surface else ""
        place = f", x = {self.position[0]:.6g} m, y = {self.position[1]:.6g} m"
        at = f"t = {self.t:.6g} s{place if self.particles else ''}"
        found = f"{number(self.amount)} {self.unit}".strip()
        allowed = f"{number(self.bound)} {self.unit}".strip()
        return f"{self.law}: {which}{where} at {at}: {found}, allowed {allowed}"

    def __str__(self) -> str:
        return f"LAW BROKEN, {self.told}; do not trust these numbers; {self.advice}"


class Findings(NamedTuple):
    """The core's findings on a run.

    Attributes
    ----------
    breaches : ndarray, (B,)
        The laws that are broken, in the order of `LAWS`: rows of the core's `Breach`.
    hits : ndarray, (H,)
        Places where particles overlap surfaces by more than `allowed`, or pass them, by particle
        and time: rows of the core's `Hit`.
    figures : object
        Bounds and the numbers behind them: the core's `Laws`, without its arrays.
    """

    breaches: NDArray[Any]
    hits: NDArray[Any]
    figures: Any


def judge(recording: Record) -> tuple[Broken, ...]:
    """Judge a run: return the laws that it breaks, each once, in the order of `LAWS`."""
    if _TOLD not in recording.found and not len(recording.knots):
        recording.found[_TOLD] = ()
    if _TOLD in recording.found:
        known: tuple[Broken, ...] = recording.found[_TOLD]
        return known
    found, machine = examine(recording), recording.machine
    pulley = sum(part.surface.shape[-1] for part in machine.parts)
    told = []
    for row in found.breaches.tolist():
        t, x, y, amount, bound, which, particles, particle, surface, piece, _ = row
        name, law = recording.surfaces[surface] if surface >= 0 else "", LAWS[which]
        if machine.pulley is not None and piece == pulley:
            name = "pulley"
        advice, unit = _advice(recording, law, found.figures), UNITS.get(law, "J")
        told.append(Broken(law, particles, particle, t, (x, y), name, amount, bound, unit, advice))
    told += _hinges(recording, found.figures)
    recording.found[_TOLD] = tuple(told)
    return tuple(told)


def _hinges(recording: Record, figures: Any) -> list[Broken]:
    """Judge hinges by their states and the numbers of the scene.

    E is its energy, ΔE = worked + pushed - given - stopped - damped; damped = ∫ damper rate² dt;
    no stop is passed; a motor's work is at most its torque times the angle. Pymunk, with errors of
    the order of its step, is judged only roughly, by ΔE.
    """
    told = list[Broken]()
    if not recording.machine.movers:
        return told

    def must(law: str, surface: int, amount: float, bound: float, unit: str = "J") -> None:
        if not amount <= bound:
            name, t = recording.surfaces[surface], float(recording.swings["t"].max())
            advice = _advice(recording, law, figures)
            told.append(Broken(law, 0, -1, t, (nan, nan), name, amount, bound, unit, advice))

    load = float(np.broadcast_to(recording.machine.particle.mass, recording.count).sum())
    for mover in recording.machine.movers:
        hinge, surface = mover.hinge, mover.surface
        if hinge is None or hinge.steered:
            continue
        t, angle, rate = (hinge.states[name] for name in ("t", "angle", "rate"))
        worked, stopped, damped, pushed = recording.hinge_work[surface].tolist()
        parts = np.stack(hinge.energies(angle, rate, recording.gravity, recording.machine.up))
        energy = parts.sum(axis=0)
        given = float(recording.drives[surface])
        play = float(np.abs(parts).sum(axis=0).max())
        play += sum(map(abs, (worked, given, stopped, damped, pushed)))
        off = energy[-1] - energy[0] - (worked + pushed - given - stopped - damped)
        if recording.engine == "pymunk":
            must(LEDGER, surface, abs(off), ROUGHLY * play + EPS)
            continue
        must(LEDGER, surface, abs(off), CLOSES * play + EPS)
        # Cubics between states, squared, by Gauss's rule of three points.
        h = np.diff(t)[:, None]
        share = np.array([0.5 - sqrt(0.15), 0.5, 0.5 + sqrt(0.15)])
        rates = hinge.at(t[:-1, None] + h * share)[1]
        lost = hinge.damper * float((h * rates**2 @ np.array([5.0, 8.0, 5.0]) / 18.0).sum())
        torque = max(hinge.motor[1], recording.torque)
        way = torque * float(np.abs(np.diff(angle)).sum())
        # rad/s; change in a step by the hop of a hinge with the particles on it.
        moments = torque + hinge.spring * np.abs(angle - hinge.rest).max()
        moments += recording.gravity * (hypot(*hinge.moment) + 2.0 * hinge.gyration * load)
        moments += hinge.damper * np.abs(rate).max()
        hop = 2.0 * float(moments) * recording.machine.dt / hinge.inertia
        lasts = float(t[-1] - t[0])
        must(
            LOSSES, surface, -min(stopped, damped),
            0.5 * hinge.inertia * hop**2 + CLOSES * play + EPS,
        )  # fmt: skip
        must(
            ENERGY, surface, abs(damped - lost),
            HOPS * max(damped, lost) + hinge.damper * hop**2 * lasts + CLOSES * play + EPS,
        )  # fmt: skip
        must(
            ENERGY, surface, abs(worked) - way,
            HOPS * way + torque * hop * lasts + CLOSES * play + EPS,
        )  # fmt: skip
        low, high = hinge.stops
        beyond = max(low - float(angle.min()), float(angle.max()) - high)
        must(INSIDE, surface, beyond, BEYOND, "rad")
    return told


CLOSES, ROUGHLY, EPS = 1e-9, 0.2, 1e-15
"""Allowed residual of a hinge's ledger, as shares of its energies (the second in Pymunk), and in
J."""

HOPS = 0.05
"""Allowed deviation of a damper's loss and a motor's work from the values computed from the states:
a pressed hinge hops between its states."""

BEYOND = 1e-3
"""rad; by which a hinge may be beyond its stops."""


def examine(recording: Record) -> Findings:
    """Have the core look at a run, of one knot or more, unless it did so as the run ended."""
    if _FOUND not in recording.found:
        module = core.borrow()
        try:
            if not _judged_as_told(module, recording):
                _lay_out(module, recording)
                module.work("judge")
            take(module, recording)
        finally:
            core.give_back(module)
    found: Findings = recording.found[_FOUND]
    return found


def opened(recording: Record, times: Iterable[float]) -> Floats:
    """Return the energy (J) that removing overlaps may give in a step at each time (s).

    The recording is one of a crowd of the contact engine.
    """
    module = core.borrow()
    try:
        _lay_out(module, recording)
        module.work("judge")
        return np.array([module.call("opened", t) for t in times])
    finally:
        core.give_back(module)


_NO_BREACHES, _NO_HITS = np.empty(0, core.dtype("Breach")), np.empty(0, core.dtype("Hit"))

_FOUND, _TOLD = "findings", "laws"
"""Names under which a recording caches the core's findings and the broken laws."""


def take(module: core.Module, recording: Record) -> None:
    """Keep the core's findings with a recording, if it has judged the run in memory."""
    figures: Any = module.structs["Laws"]
    if not figures.breaches:
        return
    figures = type(figures).from_buffer_copy(figures)
    breaches, hits = _NO_BREACHES, _NO_HITS
    if not figures.breach_count:
        recording.found[_TOLD] = ()
    if figures.breach_count or figures.hit_count:
        breaches = module.array("breaches", breaches.dtype, figures.breach_count, of="Laws").copy()
        hits = module.array("hits", hits.dtype, figures.hit_count, of="Laws").copy()
        hits.sort(order=("particle", "t"))
    recording.found[_FOUND] = Findings(breaches, hits, figures)


def _judged_as_told(module: core.Module, recording: Record) -> bool:
    """Have the core judge the run of a lone particle by its scene, if that tells the machine.

    It takes half as long as passing all parts of the machine.
    """
    machine, scene = recording.machine, recording.scene
    plain = machine.is_told and recording.count == 1 and not (machine.interact or scene.movers)
    if not plain or scene.joints or scene.cornered or len(recording.totals):
        return False
    _tell_run(module.structs["Laws"], recording)
    hand_over(module, scene, recording.knots.tobytes() + recording.by_surface.tobytes())
    try:
        module.run("judge_plan", 0, 0)
    except core.AsideError:
        module.forget()
        return False
    return True


def _tell_run(laws: Any, recording: Record) -> None:
    """Tell the core the numbers of a run."""
    events = recording.events.view(_NUMBERS)
    if not isfinite(events["t"].sum() + events["rest"].sum()):
        laws.unreal = sum(int((~np.isfinite(events[name])).sum()) for name in ("t", "rest"))
    laws.knot_count, laws.engine = len(recording.knots), _ENGINES.index(recording.engine)
    laws.contacts, laws.steps = recording.contacts, recording.steps
    laws.alike, laws.dt = alike(recording), recording.machine.step_of(recording.engine)
    laws.gained, laws.unit = recording.gained, recording.unit
    laws.hastened = recording.hastened


def _lay_out(module: core.Module, recording: Record) -> None:
    """Pass a run to the core."""
    machine, count = recording.machine, recording.count
    bodies = np.empty(count, core.dtype("Body"))
    bodies["radius"], bodies["mass"] = inner_radius(machine), machine.particle.mass
    bodies["inertia"], bodies["gravity"] = machine.particle.inertia, machine.gravity
    bodies["corners"], outlines = 0, np.empty((0, 2))
    if not _round(machine):
        every = [np.empty((0, 2)) if one is None else one for one in machine.outlines]
        sizes, outlines = np.array([len(one) for one in every]), np.concatenate(every)
        bodies["corners"] = sizes[machine.releases.kind]
        bodies["outline"] = (np.cumsum(sizes) - sizes)[machine.releases.kind]
    bodies["kind"], bodies["group"] = machine.releases.kind, _groups(machine)
    rows = barriers(machine)
    books = recording.by_surface.reshape(-1)
    interact = machine.interact or len(recording.swings) + len(recording.totals) > 0
    # Particles that do not meet may have run together: then all of them pass each other.
    passing = (machine.pair_restitution[: None if interact else 0] < 0.0) | (not machine.interact)
    laws: Any = module.structs["Laws"]
    _tell_run(laws, recording)
    laws.particle_count, laws.piece_count = count, rows.shape[-1]
    laws.row = recording.knots.dtype.itemsize // 8
    laws.book_rows, laws.surface_count = len(books) // 3, len(recording.surfaces)
    laws.joined, laws.interact = len(machine.joints) > 0, interact
    laws.each, laws.pulley = rows.ndim > 1, machine.pulley is not None
    laws.regained, laws.risen, laws.tilt = _regained(recording), _risen(recording), machine.tilt
    laws.mover_count, laws.swing_count = len(machine.movers), len(recording.swings)
    laws.unsolved = recording.unsolved.max(initial=0.0) if len(recording.unsolved) else 0.0
    laws.largest, laws.loose = machine.particle.largest, machine.loose
    laws.outline_count, laws.kind_count = len(outlines), len(passing)
    laws.cohesion = machine.cohesion.max(initial=0.0)
    module.work("lay_out_laws")
    if machine.movers:
        movers = module.array("movers", core.dtype("Mover"), len(machine.movers), of="Laws")
        for row, mover in zip(movers, machine.movers, strict=True):
            mover.tell(row)
            own = np.flatnonzero(recording.swings["surface"] == mover.surface)
            row["first"], row["last"] = (own[0], own[-1]) if len(own) else (0, 0)
    if len(recording.swings):
        module.fill("Laws", swings=recording.swings)
    if len(outlines):
        module.fill("Laws", angles=recording.angle, outlines=outlines.ravel())
    module.fill(
        "Laws", knots=recording.knots, offsets=recording.offsets.astype(INTEGER), bodies=bodies,
        passing=passing.astype(INTEGER).ravel(), barriers=rows.reshape(-1), books=books,
    )  # fmt: skip


def _regained(recording: Record) -> float:
    """Return the greatest fall of all losses below their maxima before, both together, J."""
    losses = recording.totals["entries"][:, 1:] if len(recording.totals) else np.zeros((1, 2))
    return float((np.maximum.accumulate(losses) - losses).sum(axis=1).max())


def _risen(recording: Record) -> float:
    """Return the most that all have had at a step beyond what the ledger explains, J."""
    totals = recording.totals
    if not len(totals):
        return 0.0
    (first, _), released = recording.ends(), np.flatnonzero(recording.released)
    order = np.argsort(first["t"], kind="stable")
    brought = np.sum(recording.energies(first, released), axis=0)[order].cumsum()
    left = totals["kinetic"] + totals["potential"] - balance(totals["entries"])
    # Of those released at a step it is not told whether they are in its sums.
    sides = (np.searchsorted(first["t"][order], totals["t"], side) for side in ("left", "right"))
    rises = [left - np.append(0.0, brought)[side] for side in sides]
    return float(np.minimum(*rises).max(initial=0.0))


_ENGINES = ("exact", "contact", "pymunk")
"""Engines in the order of the core's enum Engine."""


def alike(recording: Record) -> bool:
    """Whether Chipmunk finds and solves all contacts, in steps of equal length."""
    m = recording.machine
    return recording.engine == "pymunk" and (
        m.interact
        or not m.align
        or len(m.joints) + len(m.movers) > 0
        or not _round(m)
        or bool(m.scene.one_sided)
    )


def _round(machine: Machine) -> bool:
    return all(outline is None for outline in machine.outlines)


def inner_radius(machine: Machine) -> Any:
    """Return the radius of the particles, m, or of each, (N,): the circle inside their corners."""
    if _round(machine):
        return machine.particle.radius
    found = np.broadcast_to(np.asarray(machine.particle.radius, dtype=float), machine.count).copy()
    for kind, corners in enumerate(machine.outlines):
        if corners is not None:
            edge = np.roll(corners, -1, axis=0) - corners
            off = corners[:, 0] * edge[:, 1] - corners[:, 1] * edge[:, 0]
            found[machine.releases.kind == kind] = (off / np.hypot(*edge.T)).min()
    return found


def barriers(machine: Machine) -> NDArray[Any]:
    """Return all pieces of surfaces as rows of the core's `Barrier`.

    Straight ones, bent ones, and the drive pulley last; (P,), in a family (N, P).
    """
    ahead = () if machine.segments.length.ndim == 1 else (machine.count,)
    rims = [] if machine.pulley is None else [machine.pulley.rim]
    parts = [part for part in (*machine.parts, *rims) if part.surface.size]
    rows = np.zeros((*ahead, sum(part.surface.size for part in parts)), core.dtype("Barrier"))
    first = 0
    for part in parts:
        own = rows[..., first : (first := first + part.surface.size)]
        own["speed"], own["surface"] = part.speed, part.surface
        own["appears"], own["vanishes"] = part.appears, part.vanishes
        own["one_sided"] = part.one_sided
        for name, values in part.told().items():
            own[name] = values
        for n, mover in enumerate(machine.movers, 1):
            own["mover"][part.surface == mover.surface] = n
    return rows


def _groups(machine: Machine) -> NDArray[Any]:
    """Return numbers, from 1 on, of groups of particles that nothing holds apart, (N,); else 0.

    Those that rods and pins join, and those that the incoming belt carries by adhesion.
    """
    group = np.where(machine.releases.carried, machine.count + 1, 0)
    for joint in machine.joints:
        if joint.kind in ("rod", "pin") and joint.other >= 0:
            ends = [joint.particle, joint.other]
            own = group[ends].max() or joint.particle + 1
            group[np.isin(group, [one for one in group[ends] if one])] = own
            group[ends] = own
    return group


def _advice(recording: Record, law: str, figures: Any) -> str:
    """Return advice."""
    report, machine = "if it stays so, report it with the scene", recording.machine
    if recording.engine == "exact":
        return f"run it with --engine contact, and {report}"
    step = f"a step of less than {number(machine.dt)} s (--dt)"
    if law == STEP or (alike(recording) and law in (THROUGH, INSIDE)):
        fastest = float(np.min(inner_radius(machine))) / figures.speed
        only = alike(recording) and (machine.joints or not _round(machine))
        other = "" if only else ", or --engine contact"
        return f"take a step of less than {number(min(fastest, machine.dt))} s (--dt){other}"
    return f"take {step}; {report}"
