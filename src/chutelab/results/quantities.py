"""Quantities of a recording, by the registry, and particle 0 beside the theory.

`measure` gives a quantity of a run by its name, such as ``landing.x.mean``, `each` that of each
particle, such as ``landing.x``, and `measured` that of each variant of a family. A quantity's row
is in `chutelab.scene.quantities`. `compare` compares the paper's symbols of particle 0 with the
theory.

The error is defined as |simulated - theory| / max(|theory|, scale), with the scale of the quantity
in its scene: d1 for lengths, v2 for speeds, t2 + t3 for times, 1 rad for angles, ½ m v2² for
energies.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from math import degrees, isfinite, nan
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from chutelab.results.arrival import arrivals, first_of, firsts, never
from chutelab.results.ledger import ledger, ledger_of_each, ledger_of_variants, worked
from chutelab.results.loads import load
from chutelab.results.record import Record, kept
from chutelab.results.rows import ENTRIES, REASONS, Kind
from chutelab.results.sensors import first_passages, reading
from chutelab.results.wear import wear
from chutelab.scene import Scene
from chutelab.scene.quantities import FIRST, NEEDED, THEORY, Quantity, lookup, suggestion, whose
from chutelab.scene.units import with_unit
from chutelab.scene.variants import Family
from chutelab.theory import Transfer, predict, unbounded
from chutelab.theory.prediction import outside
from chutelab.util.arrays import Bools, Floats, Ints, Numbers, begins, put, sorted_by
from chutelab.util.tables import Sheet, Shown, number

ALONG = 1e-14
"""Share of the rebound speed below which its part away from the plate is rounding."""


@kept
def first(recording: Record, event: str, surface: str | None = None) -> NDArray[Any]:
    """Return the first "separation", "impact" or "landing" of each particle, (N,), dtype `EVENT`.

    From the incoming belt, on the plate and on the outgoing belt, unless another surface is given.
    All NaN if it did not happen. Read-only.
    """
    surface = surface or NEEDED[event]
    if surface not in recording.surfaces:
        return never(recording.count)
    return firsts(recording, recording.which(event, surface=surface))


@kept
def _first_of(recording: Record, event: str, surface: str) -> Ints:
    """Return the numbers of the events of `first`, or of arrivals, (N,); -1 without one."""
    if surface not in recording.surfaces:
        return np.full(recording.count, -1)
    kinds = () if event == "arrival" else (event,)
    return first_of(recording, recording.which(*kinds, surface=surface))


@kept
def at_first(recording: Record, event: str, name: str, surface: str | None = None) -> Floats:
    """Return a `column` of `first`, or of arrivals, (N,): rows of all columns are long."""
    if event == "arrival" and recording.machine.interact:
        return column(arrivals(recording), name)
    index = _first_of(recording, event, surface or NEEDED.get(event, "outgoing"))
    found = np.full(recording.count, nan)
    if len(recording.events):
        values = column(recording.events, name)[index]
        found = np.where(index < 0, nan, values)
    return found


def column(events: NDArray[Any], name: str) -> Floats:
    """Return ``t``, ``x``, ``y``, ``vx``, ``vy``, ``vx_after`` or ``vy_after`` of events, SI."""
    if name == "t":
        return np.asarray(events["t"])
    if name in ("x", "y"):
        return np.asarray(events["position"][:, "xy".index(name)])
    when = "after" if name.endswith("_after") else "before"
    return np.asarray(events[f"velocity_{when}"][:, "xy".index(name[1])])


def paid(recording: Record, surface: str, entry: str) -> Floats:
    """Return an entry of a surface of each of V variants, (V,), J."""
    shape = recording.variants, -1, len(recording.surfaces), len(ENTRIES)
    books = recording.by_surface.reshape(shape)
    at = recording.surface_index(surface), ENTRIES.index(entry)
    return np.asarray(books[:, :, *at].sum(axis=1))


def symbols(recording: Record) -> dict[str, Floats]:
    """Return `THEORY` of each particle, (N,), SI units and radians; NaN without one."""
    left, hit, down = (first(recording, event).copy() for event in NEEDED)
    # In the paper's frame an impact is relative to the separation, a landing to the impact.
    hit[np.isnan(left["t"])] = never(1)
    down[np.isnan(hit["t"])] = never(1)
    own = recording.particle
    found = from_events(recording.machine.scenes, left, hit, down, own.radius, own.mass)
    return found | until_no_slip(recording, down["t"])


def until_no_slip(recording: Record, landed: Floats) -> dict[str, Floats]:
    """Return belt work and slip heat of each particle that landed at a time (s), J.

    Known for a lone particle that no longer slips and met only the belt since its landing.
    """
    found = np.full((2, len(landed)), nan)
    if recording.count == recording.variants and "outgoing" in recording.surfaces:
        events = recording.events
        there = np.isfinite(landed) & recording.ended_by("settled")
        away = events["surface"] != recording.surface_index("outgoing")
        away &= events["t"] > landed[events["particle"]]
        there[events["particle"][away]] = False
        for row, entry in zip(found, ("belt_work", "friction_loss"), strict=True):
            row[there] = paid(recording, "outgoing", entry)[there]
    return dict(zip(("belt_work", "slip_heat"), found, strict=True))


def from_events(
    scenes: Scene | Family,
    left: NDArray[Any],
    hit: NDArray[Any],
    down: NDArray[Any],
    radius: Numbers,
    mass: Numbers,
) -> dict[str, Floats]:
    """Return the part of `THEORY` that follows from separation, impact and landing.

    In the paper's frame: x2, y2 from the separation point, y down; x3 and v3x back from the plate.
    The events are (N,), of one scene or a family of N, and NaN, as in `never`, if one did not
    happen; radius (m) and mass (kg) are the particles'.
    """
    value, scene = scenes.value, scenes.scene
    plate = scene.plate
    top = nan if scene.incoming is None else value(scene.incoming, "pulley_radius")
    belt = nan if scene.outgoing is None else value(scene.outgoing, "speed")
    alpha = np.radians(nan if plate is None else value(plate, "angle_deg"))
    (x1, y1), (x2, y2), (x3, y3) = (event["position"].T for event in (left, hit, down))
    t1, t2, t3 = (event["t"] for event in (left, hit, down))
    (ux, uy), (wx, wy) = hit["velocity_before"].T, hit["velocity_after"].T
    (sx, sy), (vx, vy) = left["velocity_after"].T, down["velocity_before"].T
    sine, cosine = np.sin(alpha), np.cos(alpha)
    away, along = -(wx * cosine + wy * sine), wx * sine - wy * cosine
    # Rounding must not choose between π and -π for a rebound up along the plate.
    away = np.where(np.abs(away) <= ALONG * np.hypot(wx, wy), 0.0, away)
    energy = 0.5 * mass * (vx * vx + belt * belt)
    return {
        "phi1": np.arctan2(x1, y1),
        "v1": np.hypot(sx, sy),
        "t2": t2 - t1,
        "x2": x2 - x1,
        "y2": y1 - y2,
        "v2": np.hypot(ux, uy),
        "v2r": np.hypot(wx, wy),
        "phi2": np.arctan2(ux * cosine + uy * sine, ux * sine - uy * cosine),
        "phi2r": np.arctan2(away, along + 0.0),  # + 0.0: the angle of no rebound is 0, not -π
        "t3": t3 - t2,
        "x3": x2 - x3,
        "y3": y2 - y3,
        "v3x": -vx,
        "v3y": -vy,
        "v3": np.hypot(vx, vy),
        "d3": top + radius - y3,
        "dEk": energy,
        "P": energy * scenes.rate,
    }


@dataclass(frozen=True, repr=False)
class Comparison(Shown):
    """Particle 0 of a recording beside the theory, SI units and radians.

    Attributes
    ----------
    simulated, theory : dict of float
        All of `THEORY`; NaN if the particle, or the theory, does not get so far.
    errors : dict of float
        Relative errors of the quantities that both have.
    reason : str
        Why the theory stops, "" if it does not.
    """

    simulated: dict[str, float]
    theory: dict[str, float]
    errors: dict[str, float]
    reason: str

    @property
    def max(self) -> float | None:
        """Largest of the errors; None if nothing could be compared."""
        return max(self.errors.values(), default=None)

    def sheet(self, *, details: bool = False) -> Sheet:
        """Return every quantity that either has, and the largest error.

        Without theory its columns are left out; without rows, the title too. Beside the paper's
        power is the true one, the belt work at the same rate of particles. Errors are in percent;
        with `details` they are shown down to rounding.
        """

        def written(error: float) -> str:
            return f"{error:.1e}" if details else f"{100.0 * error:.3f}"

        rows = list[tuple[str, ...]]()
        energy, power = self.theory["dEk"], self.theory["P"]
        rate = power / energy if energy > 0.0 else nan
        for name, row in THEORY.items():
            simulated, theory = self.simulated[name], self.theory[name]
            if row.unit == "degrees":
                simulated, theory = degrees(simulated), degrees(theory)
            if isfinite(simulated) or isfinite(theory):
                error = written(self.errors[name]) if name in self.errors else ""
                what = with_unit(row.meaning, row.unit)
                rows.append((name, what, number(simulated), number(theory), error))
                if name == "belt_work" and isfinite(rate):
                    true = (number(rate * simulated), number(rate * theory))
                    rows.append(("", "its power, to compare with P, W", *true, ""))
        foot: list[tuple[str, ...]] = []
        if self.max is not None:
            foot = [("max", "largest relative error", "", "", written(self.max))]
        begun = any(isfinite(value) for value in self.theory.values())
        ends = "No closed form from here on" if begun else "No closed form"
        heads = ("", "", "simulated", "theory", "error" if details else "error, %")
        shown = len(heads) if begun else 3
        return Sheet(
            "Particle 0" if rows else "",
            heads[:shown],
            tuple(row[:shown] for row in rows),
            foot=tuple(foot),
            texts=2,
            notes=(f"{ends}; {self.reason}",) if self.reason else (),
        )


def predicted(prediction: Transfer, row: Quantity) -> float:
    """Return the theory's value of a quantity, in its unit; NaN if it has none."""
    value = float(getattr(prediction, row.field)) if row.theory else nan
    return degrees(value) if row.unit == "degrees" else value


@kept
def prediction(recording: Record) -> Transfer:
    """Return the theory's prediction for the scene of a recording, see `chutelab.theory`."""
    return predict(recording.scene)


def need_recording(given: object) -> None:
    """Raise a `TypeError` if something is not a recording, such as the name of a scene."""
    if not isinstance(given, Record):
        raise TypeError(f"{given!r} is no recording; give what chutelab.simulate(...) returns")


def compare(recording: Record) -> Comparison:
    """Compare particle 0 with the theory's prediction for its scene."""
    need_recording(recording)
    answer = prediction(recording)
    theory = {name: float(getattr(answer, name)) for name in THEORY}
    found = {name: float(values[0]) for name, values in symbols(recording).items()}
    sizes = scales(recording.scene, answer)
    return Comparison(
        simulated=found,
        theory=theory,
        errors={
            name: float(relative_error(found[name], theory[name], sizes[row.kind]))
            for name, row in THEORY.items()
            if isfinite(theory[name]) and isfinite(found[name])
        },
        reason=str(answer.reason),
    )


def relative_error(simulated: ArrayLike, theory: ArrayLike, scale: ArrayLike) -> Floats:
    """Return |simulated - theory| / max(|theory|, scale), of numbers or arrays.

    A scale of NaN counts as 0; where the theory is 0 as well, the difference itself is returned.
    """
    off = np.abs(np.subtract(simulated, theory))
    size = np.fmax(np.abs(theory), np.where(np.isfinite(scale), scale, 0.0))
    return np.asarray(off / np.where(size > 0.0, size, 1.0))


def scales(scenes: Scene | Family, prediction: Transfer) -> dict[str, Any]:
    """Return the scale of each kind of quantity in a scene; NaN where the theory has none.

    Floats, or arrays (N,) where scene and prediction have such.
    """
    scene = scenes.scene
    v2, t2, t3 = prediction.v2, prediction.t2, prediction.t3
    energy = 0.5 * scenes.value(scene.particle, "mass") * (v2 * v2)
    d1: Any = nan
    if scene.incoming is not None and scene.plate is not None:
        d1 = scenes.value(scene.incoming, "pulley_radius") + scenes.value(scene.plate, "distance")
    found = {
        "length": d1,
        "speed": v2,
        "time": np.where(np.isfinite(t3), t2 + t3, t2),
        "angle": 1.0,
        "energy": energy,
        "power": energy * scenes.rate,
    }
    return {kind: float(size) if np.ndim(size) == 0 else size for kind, size in found.items()}


OTHER = (Kind.COLLISION, Kind.STICK, Kind.SETTLE)
"""Events outside the theory's equations, before the landing or on another surface."""


def worst(recording: Record) -> Floats:
    """Return the largest relative error of particle 0 of each of V variants, (V,); NaN without one.

    `predict` takes one scene at a time, so for a family the events show how far the equations hold.
    """
    scene, count = recording.scene, recording.variants
    if recording.family is None:
        found = compare(recording).max
        return np.array([nan if found is None else found])
    if scene.incoming is None or scene.plate is None:
        return np.full(count, nan)
    family, each = recording.family.firsts, recording.family.each
    begins = recording.released[::each]
    for other, _ in outside(family):
        begins = begins & np.logical_not(other)
    radius, mass = recording.radius[::each], recording.mass[::each]
    left, hit, down = _described(recording, begins)
    simulated = from_events(family, left, hit, down, radius, mass)
    simulated |= until_no_slip(recording, down["t"])
    theory = unbounded(family)
    sizes = scales(family, theory)
    largest = np.full(count, nan)
    for name, values in simulated.items():
        errors = relative_error(values, getattr(theory, name), sizes[THEORY[name].kind])
        largest = np.fmax(largest, np.where(np.isfinite(errors), errors, nan))
    return largest


def _described(recording: Record, holds: Bools) -> list[NDArray[Any]]:
    """Return separation, impact and landing of particle 0 of each of V variants.

    The equations hold if these are its first three events, in this order. From the first other
    event on they count as not happened, as in variants whose `holds`, (V,), is false.
    """
    events, each = recording.events, recording.count // len(holds)
    kinds = [int(kind) for kind in (Kind.SEPARATION, Kind.IMPACT, Kind.LANDING, *OTHER)]
    if each > 1:
        own = np.arange(recording.count) % each == 0
        events = events.take(own[recording.labels[2]].nonzero()[0])
    # Grip and slip on the belt and the pulley are in the equations.
    known = events["kind"] == Kind.STICK
    known &= events["surface"] == recording.surface_index("incoming")
    order = (np.isin(events["kind"], kinds) & ~known).nonzero()[0]
    own = events.take(order[sorted_by(events["particle"][order], recording.count)])
    own["particle"] //= each
    place = np.arange(len(own)) - begins(own["particle"], len(holds))
    found = []
    for n in range(len(NEEDED)):
        at, one = place == n, never(len(holds), own.dtype)
        put(one, own["particle"][at], own.take(at.nonzero()[0]))
        found.append(one)
    # An impact that throws a carried particle off the belt is not the theory's separation.
    t1, t2 = (one["t"] for one in found[:2])
    holds = holds & ~(t1 >= t2)
    for one, (event, surface) in zip(found, NEEDED.items(), strict=True):
        holds = holds & (one["kind"] == Kind[event.upper()])
        holds &= one["surface"] == recording.surface_index(surface)
        one[~holds] = never(1)
    return found


_STATISTICS: dict[str, Callable[..., Any]] = {
    "mean": np.mean, "spread": np.std, "min": np.min, "max": np.max,
    "q50": np.median,
    **{f"q{percent:02}": partial(np.quantile, q=percent / 100) for percent in (2, 25, 75, 98)},
}  # fmt: skip


def each(recording: Record, name: str) -> Floats:
    """Return a quantity of each particle, (N,), in its unit; NaN without one.

    Names are such as ``x2``, ``landing.x``, ``flight.t``, ``impact.hood.t``, ``ended.t`` or
    ``ledger.belt_work``.

    Raises
    ------
    KeyError
        If particles have no such quantity.
    """
    match name.split("."):
        case ["ended", "t"]:
            return _at_end(recording, recording.ends()[1]["t"])
        case ["ended", "x" | "y" as axis]:
            return _at_end(recording, recording.ends()[1]["position"][:, "xy".index(axis)])
        case ["track", "t"]:
            begin, end = recording.ends()
            return _at_end(recording, end["t"] - begin["t"])
        case ["ledger", *rest]:
            found, entry = ledger_of_each(recording), ".".join(rest)
            entries, fall = found["entries"], found["potential.end"] - found["potential.start"]
            found |= dict(zip(ENTRIES, entries.T, strict=True))
            found["turned_over"] = (
                found["kinetic.start"]
                + worked(recording)
                + np.abs(entries[:, 1:]).sum(axis=1)
                + np.abs(fall)
            )
            return _at_end(recording, found[entry])
        case ["flight", "t"]:
            # From the incoming belt to the next surface.
            left = at_first(recording, "separation", "t")
            met = (at_first(recording, event, "t") for event in ("impact", "landing"))
            return np.asarray(np.fmin(*met) - left)
        case ["impact", surface, key]:
            return at_first(recording, "impact", key, surface)
        case ["sensor", sensor, key]:
            return first_passages(recording, sensor)[key]
        case ["separation" | "impact" | "landing" | "arrival" as event, key]:
            return at_first(recording, event, key)
        case ["belt_work" | "slip_heat" | "power" as what]:
            # What the belt pays until a lone particle does not slip.
            work = np.full(recording.count, nan)
            if recording.count == recording.variants:
                entry = "friction_loss" if what == "slip_heat" else "belt_work"
                settled = recording.ended_by("settled")
                work = np.where(settled, paid(recording, "outgoing", entry), nan)
            return np.asarray(work * (recording.machine.scenes.rate if what == "power" else 1.0))
    values = symbols(recording)[name.removesuffix("_deg")]
    return np.degrees(values) if name.endswith("_deg") else values


def _at_end(recording: Record, values: Any) -> Floats:
    """Return values of the released particles, (n,), as values of all, (N,)."""
    found = np.full(recording.count, nan)
    found[recording.released] = values
    return found


PASSED = ("count", "back", "rate", "mass_rate", "whole_rate", "depth")
"""Quantities of a sensor, by their names in `results.sensors.Reading`."""


def measured(recording: Record, name: str) -> Floats:
    """Return a quantity of the scene for each of V variants, (V,); NaN without one."""
    many = recording.variants
    shape = many, recording.count // many
    parts, own = name.split("."), np.ones(recording.count, dtype=bool)
    if name.startswith(FIRST):
        return each(recording, name.removeprefix(FIRST))[:: shape[1]]
    if parts[0] == "by_stream":
        stream = recording.machine.streams.index(parts[1])
        parts, own = parts[2:], recording.machine.releases.stream == stream

    def count(which: Bools) -> Floats:
        return np.asarray((which & own).reshape(shape).sum(axis=1), dtype=np.float64)

    match parts:
        case ["contacts"]:
            # In a family they are counted together.
            return np.full(many, nan if recording.family else float(recording.contacts))
        case ["ended", reason] if reason in REASONS:
            return count(recording.ended_by(reason))
        case ["misses"]:
            return count(np.isnan(each(recording, "arrival.t")))
        case ["error", "max"]:
            return worst(recording)
        case ["sensor", sensor, key] if key in PASSED:
            return np.array([float(getattr(reading(recording, sensor), key))])
        case ["loads", surface, part, statistic]:
            return np.array([getattr(load(recording, surface).part(part), statistic)])
        case ["wear", *_] if recording.family:
            return np.full(many, nan)
        case ["wear", surface, part, which]:
            values = getattr(wear(recording, surface), part)
            return np.array([float(values.sum() if which == "sum" else values.max())])
        case ["ledger", "by_surface", surface, entry] if not recording.family:
            return np.array([ledger(recording).by_surface[surface].get(entry, 0.0)])
        case ["ledger", "spring", _] if recording.family:
            return np.zeros(many)
        case ["ledger", *_, "drive_work" | "push_work" | "damper_loss" | "air_loss"] if (
            recording.family
        ):
            return np.zeros(many)
        case ["ledger", "by_surface", surface, entry]:
            return paid(recording, surface, entry)
        case ["ledger", "power"]:
            work = paid(recording, "outgoing", "belt_work")
            scenes = recording.family.firsts if recording.family else recording.scene
            return np.asarray(work / shape[1] * scenes.rate)
        case ["ledger", *rest] if recording.family:
            return ledger_of_variants(recording)[".".join(rest)]
        case ["ledger", stored, end]:
            return np.array([getattr(ledger(recording), stored)[("start", "end").index(end)]])
        case ["ledger", entry]:
            return np.array([getattr(ledger(recording), entry)])
        case [*event, "count"]:
            return count(np.isfinite(each(recording, ".".join([*event, "t"]))))
        case [*event, "share"]:
            return count(np.isfinite(each(recording, ".".join([*event, "t"])))) / count(own)
        case [*quantity, statistic] if statistic in _STATISTICS:
            values = each(recording, ".".join(quantity))
            if shape[1] == 1:
                # With one particle all statistics but the spread are its value.
                return values - values if statistic == "spread" else values
            table, known = values.reshape(shape), (own & np.isfinite(values)).reshape(shape)
            if known.all():
                return np.asarray(_STATISTICS[statistic](np.ascontiguousarray(table), axis=1))
            found, counts = np.full(many, nan), known.sum(axis=1)
            # Variants in which as many particles have a value are rows of one table.
            for n in np.unique(counts[counts > 0]).tolist():
                some = counts == n
                alike = table[some][known[some]].reshape(-1, n)
                found[some] = _STATISTICS[statistic](alike, axis=1)
            return found
    return each(recording, name)[:: shape[1]]


def measure(recording: Record, name: str) -> float:
    """Return a quantity of a recording, in its unit; NaN if it did not happen.

    Names are those of `chutelab.scene.quantities`, such as ``x2``, ``landing.x.mean`` or
    ``ledger.by_surface.plate.restitution_loss``. With one particle a quantity of particles has its
    bare name; with several, ``particles[0].landing.x`` belongs to the first one. ``spread`` is the
    standard deviation, ``q02`` the value below which 2 % of the particles lie. With the prefix
    ``by_stream.NAME.`` it is that of one stream.

    Raises
    ------
    KeyError
        If the scene has no quantity of that name, or the name does not say of which particle.
    """
    need_recording(recording)
    surfaces = recording.scene.places
    row = lookup(name, surfaces, recording.machine.streams)
    if row is None:
        raise KeyError(f"no quantity {name!r}; {suggestion(name, surfaces)}")
    if which := whose(row, recording.count):
        raise KeyError(f"{name!r}: {which}")
    return float(measured(recording, name)[0])
