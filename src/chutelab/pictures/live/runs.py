"""Every variant of a scene simulated and packed for a page, and how much a page can hold.

The page reads binary columns in base64, and JSON for the rest: knots, surfaces, and the numbers of
each variant, simulated and from the analytic parabola.
"""

from __future__ import annotations

from base64 import b64encode
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from math import atan2, degrees, hypot, isfinite, nan
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from chutelab.engines.simulation import simulate
from chutelab.machine import Machine, build
from chutelab.pictures.animation.moments import sentence
from chutelab.pictures.plots import Arc, Window, analytic_of, style, window_of
from chutelab.pictures.plots.scenery import STRUCK, action, strobe_step
from chutelab.results import ENTRIES, REASONS, Kind, Recording
from chutelab.results.quantities import measure
from chutelab.results.recorder import StalledError
from chutelab.scene import Scene, SceneError
from chutelab.scene.overrides import value_at
from chutelab.scene.rules import unit_of
from chutelab.scene.units import symbol
from chutelab.scene.variants import Quantity, Variant, Vary, parse, quantities, reason, variants
from chutelab.theory import predict
from chutelab.util.arrays import Floats

MOST_VARIANTS: Final = 1_000
"""Variants on one page: two sliders of some 30 positions each."""

MOST_STEPPED: Final = 24
"""Variants on one page of a scene that is stepped, because each may take seconds."""

MOST_PARTICLES: Final = 200
"""Particles on one page: a phone draws all of them 60 times a second."""

MOST_KNOTS: Final = 100_000
"""Knots of all variants together: a page of about 10 MB."""


class PageError(ValueError):
    """What cannot be made a page of; the text says why, and what can."""


@dataclass(frozen=True, eq=False)
class Run:
    """One variant that ran.

    Attributes
    ----------
    scene, machine, recording : Scene, Machine, Recording
        What was run, and what came of it.
    arcs, began : tuple of Arc, float
        The analytic parabola, and the time (s) of the recording at which it begins.
    reason : str
        Why the analytic parabola ends early, or is not there; "" if it goes to the landing.
    window : Window
        Where something happens.
    """

    scene: Scene
    machine: Machine
    recording: Recording
    arcs: tuple[Arc, ...]
    began: float
    reason: str
    window: Window


@dataclass(frozen=True, eq=False)
class Outcome:
    """A variant: what became of it, or why nothing did.

    Attributes
    ----------
    values : tuple of float
        One for each slider.
    run : Run or None
        None if these values make no scene, or it cannot be run. With a fault it is the run of the
        scene without its outgoing belt, which shows why that has no place.
    fault : str
        What is wrong with these values, "" if nothing is.
    """

    values: tuple[float, ...]
    run: Run | None
    fault: str = ""


@dataclass(frozen=True, eq=False)
class Study:
    """A scene and all its variants, run.

    Attributes
    ----------
    scene : Scene
        As it was before it was varied.
    varies, quantities : tuple
        The sliders: their values, and what they are.
    outcomes : tuple of Outcome
        Of all combinations; the last slider runs fastest.
    """

    scene: Scene
    varies: tuple[Vary, ...]
    quantities: tuple[Quantity, ...]
    outcomes: tuple[Outcome, ...]

    @property
    def runs(self) -> tuple[Run, ...]:
        """What there is to draw."""
        return tuple(outcome.run for outcome in self.outcomes if outcome.run is not None)

    @property
    def sound(self) -> tuple[Run, ...]:
        """Runs of the variants that have no fault."""
        return tuple(o.run for o in self.outcomes if o.run is not None and not o.fault)


def study(
    scene: Scene,
    varies: Sequence[Vary | str] = (),
    progress: Callable[[float], None] | None = None,
) -> Study:
    """Run all variants of a scene.

    Parameters
    ----------
    scene : Scene
        From `chutelab.load`.
    varies : sequence of Vary or str
        Up to two; a text as ``--vary`` takes it.
    progress : callable, optional
        Called with the share that is done, 0 to 1.

    Raises
    ------
    VaryError
        If what is to be varied cannot be.
    PageError
        If there is too much for a page, or no variant runs.
    """
    varied = tuple(parse(vary) if isinstance(vary, str) else vary for vary in varies)
    found = variants(scene, varied, MOST_VARIANTS)
    _check(found)
    outcomes: list[Outcome] = []
    knots = 0
    for number, variant in enumerate(found):
        outcomes.append(_outcome(variant))
        run = outcomes[-1].run
        knots += 0 if run is None else len(run.recording.knots)
        if knots > MOST_KNOTS:
            raise PageError(
                f"{number + 1} of {len(found)} variants have {knots} knots already, at most"
                f" {MOST_KNOTS} fit on a page: vary in fewer steps, or take fewer particles with"
                " --set stream.count=..."
            )
        if progress is not None:
            progress((number + 1) / len(found))
    result = Study(scene, varied, quantities(scene, varied), tuple(outcomes))
    if not result.sound:
        raise PageError(f"{scene.source}: no variant can be run; the first: {outcomes[0].fault}")
    return result


def _check(found: Sequence[Variant]) -> None:
    """Refuse, before anything runs, what would be too much for a page or for the one who waits."""
    scenes = [variant.scene for variant in found if variant.scene is not None]
    most = max((scene.stream.count for scene in scenes), default=0)
    if most > MOST_PARTICLES:
        raise PageError(
            f"stream.count = {most}: a page shows at most {MOST_PARTICLES} particles; add"
            f" --set stream.count={MOST_PARTICLES}"
        )
    stepped = sum(
        scene.run.engine == "pymunk" or (scene.stream.interact and scene.stream.count > 1)
        for scene in scenes
    )
    if stepped > MOST_STEPPED:
        raise PageError(
            f"{stepped} variants are stepped, at most {MOST_STEPPED} are allowed,"
            " because each may take seconds: vary in fewer steps, or add"
            " --set stream.interact=false --set run.engine=exact"
        )


def _outcome(variant: Variant) -> Outcome:
    if variant.scene is None:
        return Outcome(variant.values, None, variant.fault)
    try:
        return Outcome(variant.values, _run(variant.scene))
    except SceneError as error:
        return Outcome(variant.values, _without_belt(variant.scene), reason(error))
    except StalledError as error:
        return Outcome(variant.values, None, f"the run got stuck: {error}")


def _without_belt(scene: Scene) -> Run | None:
    """Run a scene whose outgoing belt has no place, because the flight misses the plate."""
    if scene.outgoing is None:
        return None
    try:
        return _run(scene.with_values(dict.fromkeys(("outgoing", "run", "expect"))))
    except (SceneError, StalledError):
        return None


def _run(scene: Scene) -> Run:
    machine = build(scene)
    recording = simulate(scene)
    prediction = predict(scene)
    arcs, began = analytic_of(recording, prediction)
    return Run(
        scene=scene,
        machine=machine,
        recording=recording,
        arcs=arcs,
        began=began,
        reason=str(prediction.reason),
        window=window_of(recording, machine),
    )


LABELS = {
    "separation.t": "Leaves pulley at",
    "phi1_deg": "Angle past the top",
    "impact.t": "Strikes the plate at",
    "impact.y": "Height of that",
    "v2": "Speed before",
    "v2r": "Speed after",
    "landing.t": "Lands at time",
    "landing.x": "Lands at x",
    "landing.vx": "Landing, forward",
    "landing.vy": "Landing, upward",
}
"""Of particle 0, under the names of `chutelab.scene.rules`."""

CROWD = {
    "landing.count": "Particles landed",
    "landing.t.mean": "Lands at time, mean",
    "landing.x.mean": "Lands at x, mean",
    "landing.x.spread": "Lands at x, spread",
    "landing.vx.mean": "Landing, forward, mean",
}
"""Of a stream."""

BOOKS = {
    "contacts": "Contacts",
    "ledger.belt_work": "Belt work in the run",
    "ledger.restitution_loss": "Lost in rebounds",
    "ledger.friction_loss": "Slip heat",
    "ledger.residual": "Residual",
}
"""Of all particles together."""

MOST_FREE = 3
"""Free surfaces whose first impact is listed."""


@dataclass(frozen=True)
class Figure:
    """One row of numbers.

    Attributes
    ----------
    group : str
        Whose number it is, where there are several particles.
    name : str
        As `chutelab.scene.rules` has it.
    label, unit : str
        For people; "degrees" for angles.
    simulated, analytic : tuple of float or None
        One for each variant of the study; None where it did not happen, or nothing is known.
    """

    group: str
    name: str
    label: str
    unit: str
    simulated: tuple[float | None, ...]
    analytic: tuple[float | None, ...]


def figures(study: Study) -> tuple[Figure, ...]:
    """Return the rows of a study that have a number in any variant."""
    first = study.sound[0]
    surfaces = first.recording.surfaces[:-1]
    labels = dict(LABELS)
    for name in _free(surfaces):
        labels[f"impact.{name}.t"] = f"Strikes “{name}” at"
        labels[f"impact.{name}.x"] = f"Strikes “{name}” at x"
    crowd = max(run.recording.count for run in study.sound) > 1
    rows = [("First particle" if crowd else "", *row) for row in labels.items()]
    books = [("All particles" if crowd else "", *row) for row in BOOKS.items()]
    if crowd:
        rows = [("All particles", *row) for row in CROWD.items()] + books + rows
    else:
        rows += books
    found = []
    for group, name, label in rows:
        unit = unit_of(name, surfaces)
        if unit is None:
            continue
        # Without its outgoing belt a scene has other books, and no landing.
        runs = [None if outcome.fault else outcome.run for outcome in study.outcomes]
        simulated = tuple(_simulated(run, name) for run in runs)
        analytic = tuple(_analytic(run).get(name) for run in runs)
        if any(value is not None for value in simulated):
            found.append(Figure(group, name, label, unit, simulated, analytic))
    return tuple(found)


def _free(surfaces: Sequence[str]) -> list[str]:
    return [s for s in surfaces if s not in ("incoming", "plate", "outgoing")][:MOST_FREE]


def _simulated(run: Run | None, name: str) -> float | None:
    value = nan if run is None else measure(run.recording, name, run.scene)
    return value if isfinite(value) else None


def _analytic(run: Run | None) -> dict[str, float]:
    """Return what the arcs say: where and how fast each of them begins and ends."""
    if run is None or not run.arcs:
        return {}
    known = {"separation.t": run.began, "phi1_deg": degrees(atan2(*run.arcs[0].position))}
    ends = []
    for arc in run.arcs:
        (where,), (pace,) = (values.tolist() for values in arc.at([arc.end]))
        ends.append((run.began + arc.end, *where, *pace))
    t, _, y, vx, vy = ends[0]
    known |= {"impact.t": t, "impact.y": y, "v2": hypot(vx, vy)}
    if len(ends) > 1:
        t, x, _, vx, vy = ends[1]
        known |= {"landing.t": t, "landing.x": x, "landing.vx": vx, "landing.vy": vy}
        known["v2r"] = hypot(*run.arcs[1].velocity)
    return known


FORMAT: Final = 1

MOST_WORDS: Final = 60
"""Events of particle 0 that are told in each variant, the first ones."""

MOST: Final = 0.9
"""Share of the runs whose windows reach no farther, on each side, than what is shown at first."""

SPREAD: Final = 0.4
"""Share of its larger side by which that may be larger than the median window, on each side."""

WORTH: Final = 0.01
"""Share of the largest impulse that an impact needs to be told: the last of the bounces to rest
come too fast to be read."""

LEAD: Final = 0.25
"""Share of the action's length that is shown before it begins: the particle comes riding."""


def pack(study: Study) -> dict[str, Any]:
    """Return the data of a page, ready for JSON.

    Numbers are little-endian doubles, so that nothing is lost: what the page draws is what the
    engine computed, to the rounding of the curve's evaluation.
    """
    runs = study.runs
    knots = np.concatenate([run.recording.knots for run in runs])
    return {
        "format": FORMAT,
        "engine": sorted({run.recording.engine for run in runs}),
        "sliders": [
            {
                "key": vary.key,
                "label": quantity.label,
                "unit": symbol(quantity.unit),
                "values": list(vary.values),
                "start": _nearest(study, axis),
            }
            for axis, (vary, quantity) in enumerate(
                zip(study.varies, study.quantities, strict=True)
            )
        ],
        "columns": {name: _base64(values) for name, values in _columns(knots).items()},
        "knots": len(knots),
        "segments": _base64(np.concatenate([_segments(run) for run in runs])),
        "window": _window(study),
        "energies": [
            {"name": name, "label": label} for name, label in style.ENERGY_LABEL.items()
        ],
        "figures": [
            {
                "group": figure.group,
                "name": figure.name,
                "label": figure.label,
                "unit": symbol(figure.unit),
                "simulated": list(figure.simulated),
                "analytic": list(figure.analytic) if any(
                    value is not None for value in figure.analytic
                ) else [],
            }
            for figure in figures(study)
        ],
        "variants": [_variant(outcome) for outcome in study.outcomes],
    }  # fmt: skip


def _nearest(study: Study, axis: int) -> int:
    """Return where a slider begins: near the scene's own value, if any is known, else at 0."""
    found = value_at(study.scene, study.quantities[axis].path)
    if not isinstance(found, int | float):
        return 0
    return int(np.argmin(np.abs(np.array(study.varies[axis].values) - found)))


def _columns(knots: NDArray[Any]) -> dict[str, Floats]:
    """Return the knots by column; one that holds zeros only is left out."""
    columns = {
        "t": knots["t"],
        "x": knots["position"][:, 0],
        "y": knots["position"][:, 1],
        "vx": knots["velocity"][:, 0],
        "vy": knots["velocity"][:, 1],
        "omega": knots["omega"],
        **{name: knots["entries"][:, i] for i, name in enumerate(ENTRIES)},
    }
    return {name: values for name, values in columns.items() if values.any()}


def _base64(values: Floats) -> str:
    return b64encode(np.ascontiguousarray(values, dtype="<f8").tobytes()).decode("ascii")


def _segments(run: Run) -> Floats:
    """Return a row for each straight surface: ends (m), speed (m/s), restitution, friction."""
    s = run.machine.segments
    return np.column_stack([s.start, s.end, s.speed, s.restitution, s.friction])


def _window(study: Study) -> list[float]:
    """Return left, right, bottom and top (m) of what holds the windows of most runs.

    The page zooms out for the others, so that one that flies far does not make all else small.
    """
    sides = np.array([_sides(run) for run in study.sound])
    usual = np.median(sides, axis=0)
    room = SPREAD * max(usual[1] - usual[0], usual[3] - usual[2])
    shares = (1.0 - MOST, MOST, 1.0 - MOST, MOST)
    reach = [float(np.quantile(side, share)) for side, share in zip(sides.T, shares, strict=True)]
    return [float(side) for side in np.clip(reach, usual - room, usual + room)]


def _sides(run: Run) -> list[float]:
    return [run.window.left, run.window.right, run.window.bottom, run.window.top]


def _variant(outcome: Outcome) -> dict[str, Any]:
    run = outcome.run
    if run is None:
        return {"fault": outcome.fault}
    segments = run.machine.segments
    recording = run.recording
    begin, end = _span(recording)
    particle, pulley = recording.particle, run.machine.pulley
    return {
        "fault": outcome.fault,
        "surfaces": list(recording.surfaces),
        "owner": segments.surface.tolist(),
        "offsets": recording.offsets.tolist(),
        "ended": [REASONS[i] for i in recording.ended.tolist()],
        "body": [particle.radius, particle.mass, particle.inertia, recording.gravity],
        "pulley": None if pulley is None else [pulley.radius, pulley.speed],
        "arcs": [
            [arc.begin, arc.end, *arc.position, *arc.velocity, arc.gravity] for arc in run.arcs
        ],
        "began": run.began,
        "zero": float(recording.knots["position"][:, 1].min()),
        "window": _sides(run),
        "reason": run.reason,
        "span": [begin, end],
        "strobe": strobe_step(recording),
        "events": _events(recording),
    }


def _span(recording: Recording) -> tuple[float, float]:
    """Return the times (s) between which there is something to see."""
    begin, end = action(recording)
    begin = max(float(recording.track(0)["t"][0]), begin - LEAD * (end - begin))
    return begin, max(end, float(recording.knots["t"].max()))


def _events(recording: Recording) -> list[list[Any]]:
    """Return what happened to particle 0: time, kind, words."""
    events = recording.events
    mine = events[(events["particle"] == 0) | (events["other"] == 0)]
    released = mine["t"][0] if len(mine) else 0.0
    told = mine["kind"] != Kind.RELEASE
    # On a belt of its own speed it sticks at once, which is no news.
    told &= ~((mine["kind"] == Kind.STICK) & (mine["t"] == released))
    impulse = np.abs(mine["normal_impulse"])
    told &= ~np.isin(mine["kind"], STRUCK) | (impulse >= WORTH * impulse.max(initial=0.0))
    return [
        [float(event["t"]), Kind(int(event["kind"])).name.lower(), sentence(recording, event)]
        for event in mine[told][:MOST_WORDS]
    ]
