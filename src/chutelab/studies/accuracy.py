"""`reach`: run a scene until it is accurate enough, and say how that is known.

An accuracy is a relative error or a length, `Wanted`. An engine's own error estimate is no
evidence: two runs of one engine may agree on a wrong answer. So a run is compared with a *witness*:
the theory if it covers the whole run, else another engine, which shares no formula with the first
(see `chutelab.checks.agreement`). For a crowd that meets, only totals are compared with another
engine. Without a witness nothing is promised.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from itertools import combinations
from math import inf, isfinite
from time import perf_counter
from typing import Literal

import numpy as np

from chutelab.engines import reference
from chutelab.engines.simulation import judged
from chutelab.machine import build
from chutelab.results import ENTRIES, Kind, Recording
from chutelab.results.ledger import ledger
from chutelab.results.quantities import compare, first, prediction, scales
from chutelab.results.recorder import StalledError
from chutelab.scene import AnyScene, Scene, SceneError, load
from chutelab.scene.quantities import NEEDED, THEORY
from chutelab.scene.units import read_size, write_size
from chutelab.util.arrays import Floats, Progress
from chutelab.util.errors import InputError

SMALLEST, LARGEST_SHARE, LARGEST_LENGTH = 1e-15, 0.5, 1e3
"""Bounds of an accuracy: relative, between the rounding of a double and a half; as a length, at
most a kilometre."""

ALLOWED = (
    "a relative error from 1e-15 to 0.5, such as 1e-6 or 0.1%, or a length from 1e-15 to 1000 m"
    " with its unit, such as 1mm (m, cm, mm, µm or um, nm)"
)


@dataclass(frozen=True)
class Wanted:
    """An accuracy."""

    size: float  # the largest error that is good enough
    # "relative": of every answer of a run, see `chutelab.studies.accuracy`; "m": of places only
    unit: Literal["relative", "m"]

    def __post_init__(self) -> None:
        most = LARGEST_SHARE if self.unit == "relative" else LARGEST_LENGTH
        if not SMALLEST <= self.size <= most:
            raise InputError(f"{self}: must be {ALLOWED}")

    def __str__(self) -> str:
        return written(self.size, self.unit)


def written(size: float, unit: str) -> str:
    """Write an error, relative or in m."""
    return f"{size:.2g}" if unit == "relative" else write_size(size, unit, 2)


def parse(text: str) -> Wanted:
    """Read an accuracy.

    Raises
    ------
    InputError
        If it cannot be asked for.

    Examples
    --------
    >>> parse("1e-6"), parse("1mm")
    (Wanted(size=1e-06, unit='relative'), Wanted(size=0.001, unit='m'))
    """
    # An InputError is a ValueError, like those of `read_size`.
    with suppress(ValueError):
        size, unit = read_size(text)
        if unit in ("", "%", "m"):
            return Wanted(size, "m" if unit == "m" else "relative")
    raise InputError(f"{text!r}: must be {ALLOWED}")


@dataclass(frozen=True, eq=False)
class Answer:
    """One answer of a run: its name, what kind of quantity it is, and its values.

    Values are (N,) or (N, 2), one per particle or one for all, SI; NaN if it did not happen.
    """

    name: str
    kind: Literal["place", "time", "speed", "energy", "number"]
    values: Floats


def each(recording: Recording) -> Iterator[Answer]:
    """Yield the events of each particle, and the ledger."""
    for event in NEEDED:
        for surface in recording.surfaces[:-1]:
            found = first(recording, event, surface)
            if np.isnan(found["t"]).all():
                continue
            where = f"{event} on {surface}" if event == "impact" else event
            yield Answer(f"place of the {where}", "place", found["position"])
            yield Answer(f"time of the {where}", "time", found["t"])
            yield Answer(f"velocity at the {where}", "speed", found["velocity_before"])
            if event != "separation":
                pushed = np.stack([found["normal_impulse"], found["tangential_impulse"]], axis=1)
                what = f"impulse per mass of the {where}"
                yield Answer(what, "speed", pushed / np.asarray(recording.particle.mass)[..., None])
    # Ends count only at rest, or at the end of a run of given length; others are arbitrary.
    segments = recording.machine.segments
    still = segments.surface[segments.speed == 0.0]
    settled = recording.select(Kind.SETTLE)
    told = recording.ended_by("time")
    told[settled["particle"][np.isin(settled["surface"], still)]] = True
    told &= recording.released
    places = np.full((recording.count, 2), np.nan)
    places[told] = recording.knots["position"][recording.offsets[1:][told] - 1]
    yield Answer("place of the end", "place", places)
    yield Answer("number of particles that end so", "number", recording.ended.astype(np.float64))
    yield from _booked(recording)


def _booked(recording: Recording) -> Iterator[Answer]:
    balance = ledger(recording)
    for entry in ENTRIES:
        yield Answer(entry.replace("_", " "), "energy", np.array([getattr(balance, entry)]))


def together(recording: Recording) -> Iterator[Answer]:
    """Yield the quantities of a crowd as a whole."""
    landed = recording.first(recording.select(Kind.LANDING))
    if len(landed):
        yield Answer("mean landing point", "place", landed["position"][:, :1].mean(axis=0))
    else:
        last = recording.ends()[1]["position"]
        yield Answer("mean end point", "place", last.mean(axis=0, keepdims=True))
    yield from _booked(recording)


def sizes(recording: Recording) -> dict[str, float]:
    """Return the scale of each kind of answer, if possible as in `results.quantities`.

    Otherwise the scales are the extent of the path, its duration and the highest speed; for
    energies always the energy turned over. For particles that hardly move they are the radius, and
    the weight times it.
    """
    known, knots = scales(recording.scene, prediction(recording)), recording.knots
    own = {"length": 0.0, "time": 0.0, "speed": 0.0}
    if len(knots):
        own["length"] = float(np.hypot(*np.ptp(knots["position"], axis=0)))
        own["time"] = float(np.ptp(knots["t"]))
        own["speed"] = float(np.hypot(*knots["velocity"].T).max())
    place, time, speed = (known[k] if isfinite(known[k]) else own[k] for k in own)
    radius = np.asarray(recording.particle.radius)
    place = max(place, float(radius.min()))
    lift = recording.gravity * float((recording.particle.mass * radius).min())
    energy = max(ledger(recording).turned_over, lift)
    return {"place": place, "time": time, "speed": speed, "energy": energy, "number": 1.0}


def apart(
    one: Sequence[Answer], other: Sequence[Answer], measured: dict[str, float], unit: str
) -> tuple[float, str]:
    """Return the largest difference between answers of two runs, and which answer it is.

    In the unit "m" only places count, m. Otherwise differences are relative to `measured`, from
    `sizes`, or to the value if it is larger. inf if the events differ.
    """
    if [a.name for a in one] != [a.name for a in other]:
        return inf, "what happens at all"
    worst, which = 0.0, "every answer"
    for a, b in zip(one, other, strict=True):
        if not np.array_equal(np.isnan(a.values), np.isnan(b.values)):
            return inf, a.name
        if a.kind == "number":
            if not np.array_equal(a.values, b.values):
                return inf, a.name
            continue
        if unit == "m" and a.kind != "place":
            continue
        error, value = (
            np.linalg.norm(values.reshape(len(values), -1), axis=1)
            for values in (a.values - b.values, b.values)
        )
        if unit != "m":
            size = np.fmax(value, measured[a.kind])
            error = error / np.where(size > 0.0, size, 1.0)
        largest = float(np.nanmax(error, initial=0.0))
        if largest > worst:
            worst, which = largest, a.name
    return worst, which


def distance(one: Recording, other: Recording, unit: str = "relative") -> tuple[float, str]:
    """Return `apart` for `each` answer of two runs."""
    return apart(list(each(one)), list(each(other)), sizes(other), unit)


def whole_distance(one: Recording, other: Recording) -> tuple[float, str]:
    """Return `apart` for two runs `together`: ends and ledger."""
    return apart(list(together(one)), list(together(other)), sizes(other), "relative")


class LateError(RuntimeError):
    """An answer takes longer than allowed."""


UNABLE = (SceneError, StalledError, reference.UnableError, LateError)
"""Errors of `answer` if an engine, or SciPy, cannot run a scene, or not in time."""


def answer(
    scene: Scene,
    engine: str | None,
    progress: Progress | None = None,
    *,
    max_seconds: float | None = None,
) -> Recording:
    """Run a scene with an engine, or with "dop853"; one of `UNABLE` if it cannot.

    After `max_seconds` of wall time it is given up.
    """
    begin = perf_counter()

    def bounded(share: float) -> None:
        if progress is not None:
            progress(share)
        if max_seconds is not None and perf_counter() - begin > max_seconds:
            raise LateError(f"it takes longer than {max_seconds:g} s")

    if engine == "dop853":
        return Recording.of(reference.run(build(scene), bounded))
    return judged(scene, engine=engine, progress=progress if max_seconds is None else bounded)


def because(error: Exception) -> str:
    """Return why a scene was not run, from one of `UNABLE`."""
    return error.faults[0].allowed if isinstance(error, SceneError) else str(error)


WITNESSES = {
    "exact": ("dop853", "contact", "pymunk"),
    "contact": ("exact", "dop853", "pymunk"),
    "pymunk": ("exact", "dop853", "contact"),
}
"""Witnesses, the most exact first; engines that cannot run the scene are skipped."""

STEPPED = ("contact", "pymunk")
"""Engines whose error depends on run.dt."""

FLOOR = 1e-14
"""Relative; a smaller difference is chance: each answer has tens of roundings of 1e-16, the closed
form of slip round the pulley also a quadrature."""

STIR = 1e-9
"""Share by which inputs are changed to see the effect on a crowd."""

SHORTEST = 1e-7
"""s; the shortest step a scene may have."""

MOST_STEPS = 50_000
"""Most steps of one run; all earlier ones together take as many."""

STALE, PATIENCE = 0.9, 3
"""A halved step helps only if the error falls below this share of the least so far; after so many
steps without help the search ends."""


@dataclass(frozen=True)
class Accuracy:
    """What accuracy was asked for, and what was reached."""

    # as in `Wanted`
    asked: float
    unit: str
    # largest difference from the witness, in the same unit; None if it is not known
    reached: float | None
    method: str  # how it was found; begins with "none" if it was not
    met: bool  # whether `reached` is at most `asked`
    worst: str  # the least accurate answer
    # whether it is about the crowd as a whole only, not about single particles
    chaotic: bool
    dt: float | None  # run.dt of the run, s; None for the exact engine
    runs: int  # how many runs it took
    against: str | None  # the witness: "theory", "dop853" or an engine

    @property
    def size(self) -> float:
        """The error reached; inf if it is not known."""
        return inf if self.reached is None else self.reached


def reach(
    scene: AnyScene, wanted: Wanted | str | float, progress: Progress | None = None
) -> tuple[Recording, Accuracy]:
    """Run a scene until it is accurate enough, or cannot be made so.

    The scene's ``run.engine`` is used; ``run.dt`` is the longest step that is tried.

    Parameters
    ----------
    scene : Scene, str, path or mapping
        What `chutelab.load` takes.
    wanted : Wanted, str or float
        Such as ``"1mm"`` or ``1e-6``.
    progress : callable, optional
        Called now and then with the share that is done; how many runs it takes is not known
        beforehand.

    Returns
    -------
    Recording, Accuracy
        The most accurate run, and how accurate it is.

    Raises
    ------
    InputError
        If that cannot be asked for.
    SceneError
        As `chutelab.simulate`.

    Notes
    -----
    The error reached is the difference between two independent answers. If the witness is stepped,
    too, it contains the errors of both.
    """
    if not isinstance(wanted, Wanted):
        wanted = parse(wanted if isinstance(wanted, str) else repr(float(wanted)))
    return Search(load(scene), wanted, progress).result()


class Search:
    """Runs a scene and its witness, counts the runs, and passes the progress on."""

    def __init__(self, scene: Scene, wanted: Wanted, progress: Progress | None = None) -> None:
        self.scene, self.wanted, self.progress = scene, wanted, progress
        self.runs = 0
        self.witnesses: dict[str, tuple[Recording | None, str]] = {}

    def result(self) -> tuple[Recording, Accuracy]:
        """Return the result of `reach`: halve steps until run and witness are near enough."""
        found, dt, stale = self.run(self.scene), self.scene.run.dt, 0
        best: tuple[Recording, Accuracy] | None = None
        while True:
            now = self.judged(found)
            other = self.witnesses.get(found.engine, (None, ""))[0]
            final = now.met or now.chaotic or now.against is None
            if final or (now.against == "theory" and found.engine == "exact"):
                return found, now
            least = inf if best is None else best[1].size
            stale = 0 if now.size < STALE * least else stale + 1
            if best is None or now.size <= least:
                best = found, now
            moving = [one for one in (found, other) if one is not None and one.engine in STEPPED]
            why = ""
            if not moving:
                why = "neither has a step to shorten"
            elif stale >= PATIENCE:
                why = "a shorter step helps no more"
            elif 0.5 * dt < SHORTEST:
                why = f"a step may not be shorter than {SHORTEST:g} s"
            elif 2.0 * max(one.steps for one in moving) > MOST_STEPS:
                why = f"half the step would take more than {MOST_STEPS:,} steps"
            if why:
                last = replace(best[1], runs=self.runs, method=f"{best[1].method}; {why}")
                return best[0], last
            dt *= 0.5
            finer = self.scene.with_values({"run.dt": dt, "expect": None})
            if found.engine in STEPPED:
                found = self.run(finer, found.engine)
            if other is not None and other.engine in STEPPED:
                self.witnesses[found.engine] = self.run(finer, other.engine), ""

    def judged(self, found: Recording) -> Accuracy:
        """Return the error of a run of the scene with any engine and step.

        A witness runs once for each engine, with the step of `scene`.
        """
        known = self.by_theory(found)
        if known is not None:
            return known
        if self.scene.crowded:
            return self.crowd(found)
        if found.engine not in self.witnesses:
            self.witnesses[found.engine] = self.witness(found)
        other, none = self.witnesses[found.engine]
        if other is None:
            return self.said(found, inf, "every answer", none, None)
        error, which = distance(found, other, self.wanted.unit)
        at = f" at dt = {other.scene.run.dt:.3g} s" if other.engine in STEPPED else ""
        name = "SciPy's DOP853" if other.engine == "dop853" else f"the {other.engine} engine"
        how = f"difference from {name}{at}"
        if not isfinite(error):
            how = f"none: {found.engine} and {other.engine} differ in {which}"
        return self.said(found, error, which, how, other.engine)

    def run(self, scene: Scene, engine: str | None = None) -> Recording:
        """Run a scene once more."""

        def share(share: float) -> None:
            # Each run gets half of the remaining progress, since their number is not known.
            if self.progress is not None:
                self.progress(1.0 - 0.5**self.runs * (1.0 - 0.5 * share))

        found = answer(scene, engine, None if self.progress is None else share)
        self.runs += 1
        return found

    def said(self, found: Recording, error: float, which: str, how: str, against: str | None,
             *, chaotic: bool = False) -> Accuracy:  # fmt: skip
        """Return an error as an `Accuracy`; inf if it is not known."""
        floor = FLOOR * (sizes(found)["place"] if self.wanted.unit == "m" else 1.0)
        reached = max(error, floor)
        return Accuracy(
            asked=self.wanted.size,
            unit=self.wanted.unit,
            reached=reached if isfinite(reached) else None,
            method=how,
            met=reached <= self.wanted.size,
            worst=which,
            chaotic=chaotic,
            dt=found.machine.step_of(found.engine) or None,
            runs=self.runs,
            against=against,
        )

    def by_theory(self, found: Recording) -> Accuracy | None:
        """Compare a run with the closed form; None if that does not cover all of it."""
        compared = compare(found)
        if compared.reason or found.count > 1 or self.scene.run.until != "landed":
            return None
        errors = dict(compared.errors)
        # All but belt_work and slip_heat happen up to the landing.
        missing = len(errors) < sum(map(isfinite, compared.theory.values())) - 2
        if self.wanted.unit == "m":
            errors = {
                name: abs(compared.simulated[name] - compared.theory[name])
                for name in errors
                if THEORY[name].kind == "length"
            }
        else:
            errors["energy ledger"] = ledger(found).relative_residual
        if missing or not errors:
            how = f"none: {found.engine} and the theory differ in what happens"
            return self.said(found, inf, "what happens at all", how, "theory")
        worst = max(errors, key=lambda name: errors[name])
        return self.said(found, errors[worst], worst, "difference from the closed form", "theory")

    def witness(self, found: Recording) -> tuple[Recording | None, str]:
        """Run the first engine that can; return why others could not."""
        passed = []
        for engine in WITNESSES[found.engine]:
            try:
                return self.run(self.scene, engine), ""
            except UNABLE as error:
                passed.append(f"{engine} ({because(error)})")
        return None, f"none: no other answer; not {', nor '.join(passed)}"

    def crowd(self, found: Recording) -> Accuracy:
        """Compare the totals of a crowd with another engine's, and with runs of changed inputs.

        A tiny change of the inputs changes every particle's path after a few collisions and so,
        less, the mean. Smaller differences than that are chance.
        """
        engine = "pymunk" if found.engine == "contact" else "contact"
        scene = found.scene
        moved = stirred(scene, STIR)
        others = ((moved, found.engine), (scene, engine), (moved, engine))
        runs = [found, *(self.run(*one) for one in others)]
        tables = [list(together(one)) for one in runs]
        error, which = max(
            apart(one, two, sizes(found), self.wanted.unit) for one, two in combinations(tables, 2)
        )
        what = "mean landing point" + ("" if self.wanted.unit == "m" else " and ledger")
        dt = found.machine.step_of(found.engine)
        how = (
            f"a crowd as a whole: the {what} of {found.engine} and {engine} at dt = {dt:.3g} s,"
            f" each with and without a change of the inputs by {STIR:g}"
        )
        return self.said(found, error, which, how, engine, chaotic=True)


def stirred(scene: Scene, share: float) -> Scene:
    """Return a scene with gravity and speeds lower by a share, a tiny one.

    Lower, because many keys have an upper bound, but these no lower one except 0. The belt and
    particles released on it keep equal speeds. A particle released from rest would take the same
    path with less gravity, only later, so it is moved aside by that share of its radius.
    """
    less = 1.0 - share
    values: dict[str, object] = {"gravity": scene.gravity * less, "expect": None}
    if scene.incoming is not None:
        values["incoming.speed"] = scene.incoming.speed * less
    if scene.stream.velocity is not None:
        values["stream.velocity"] = [part * less for part in scene.stream.velocity]
    if scene.stream.at is not None and not any(scene.stream.velocity or ()):
        x, y = scene.stream.at
        values["stream.at"] = [x + share * scene.particle.radius, y]
    return scene.with_values(values)
