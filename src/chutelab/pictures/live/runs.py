"""Every variant of a scene simulated and packed for a page, and how much a page can hold.

The page reads binary columns in base64, and JSON for the rest: knots, surfaces, and the numbers of
each variant, simulated and from the analytic parabola.
"""

from __future__ import annotations

from base64 import b64encode
from collections.abc import Callable, Sequence
from contextlib import suppress
from dataclasses import dataclass
from itertools import product
from math import atan2, degrees, hypot, isfinite, nan
from typing import Any, Final

import numpy as np

from chutelab.engines.simulation import simulate
from chutelab.pictures.animation.moments import sentence
from chutelab.pictures.live.picture import UNSHOWN
from chutelab.pictures.plots import analytic_of, style, window_of
from chutelab.pictures.plots.scenery import STRUCK, action, strobe_step
from chutelab.results import ENTRIES, REASONS, Kind, Recording
from chutelab.results.quantities import measure
from chutelab.results.recorder import StalledError
from chutelab.scene import Scene, SceneError, need_plain
from chutelab.scene.overrides import value_at
from chutelab.scene.rules import unit_of
from chutelab.scene.units import symbol
from chutelab.scene.variants import Quantity, Vary, count_of, parse, quantities, reason
from chutelab.util.arrays import Floats
from chutelab.util.errors import InputError

MOST_VARIANTS: Final = 1_000
"""Variants on one page: two sliders of some 30 positions each."""

MOST_VARIED: Final = 2
"""Keys varied at once: a slider each."""

MOST_STEPPED: Final = 24
"""Variants on one page of a scene that is stepped, because each may take seconds."""

MOST_PARTICLES: Final = 200
"""Particles on one page: a phone draws all of them 60 times a second."""

MOST_KNOTS: Final = 100_000
"""Knots of all variants together: a page of about 10 MB."""


@dataclass(frozen=True, eq=False)
class Outcome:
    """A variant: what became of it, or why nothing did.

    Attributes
    ----------
    values : tuple of float
        One for each slider.
    recording : Recording or None
        None if these values make no scene, or it cannot be run. With a fault it is the run of the
        scene without its outgoing belt, which shows why that has no place.
    fault : str
        What is wrong with these values, "" if nothing is.
    """

    values: tuple[float, ...]
    recording: Recording | None
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
    def sound(self) -> list[Recording]:
        """Runs of the variants that have no fault."""
        return [o.recording for o in self.outcomes if o.recording is not None and not o.fault]


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
    InputError
        If what is to be varied cannot be, there is too much for a page, or no variant runs.
    """
    varied = tuple(parse(vary) if isinstance(vary, str) else vary for vary in varies)
    if len(varied) > MOST_VARIED:
        raise InputError(f"at most {MOST_VARIED} keys can be varied", varied[MOST_VARIED].typed)
    about = quantities(scene, varied)
    total = count_of(varied, MOST_VARIANTS)
    keys, combinations = [v.key for v in varied], list(product(*(v.values for v in varied)))
    found: list[Scene | SceneError] = []
    for values in combinations:
        try:
            found.append(scene.with_values(dict(zip(keys, values, strict=True))))
        except SceneError as error:
            found.append(error)
    _check([one for one in found if isinstance(one, Scene)])
    outcomes: list[Outcome] = []
    knots = 0
    for number, (values, one) in enumerate(zip(combinations, found, strict=True)):
        if isinstance(one, SceneError):
            outcomes.append(Outcome(values, None, reason(one)))
        else:
            outcomes.append(_outcome(values, one))
        recording = outcomes[-1].recording
        knots += 0 if recording is None else len(recording.knots)
        if knots > MOST_KNOTS:
            raise InputError(
                f"{number + 1} of {total} variants have {knots} knots already, at most"
                f" {MOST_KNOTS} fit on a page: vary in fewer steps, or take fewer particles with"
                " --set stream.count=..."
            )
        if progress is not None:
            progress((number + 1) / total)
    result = Study(scene, varied, about, tuple(outcomes))
    if not result.sound:
        raise InputError(f"{scene.source}: no variant can be run; the first: {outcomes[0].fault}")
    return result


def _check(scenes: Sequence[Scene]) -> None:
    """Refuse, before anything runs, what a page cannot show, or is too much for who waits."""
    for scene in scenes:
        need_plain(scene, UNSHOWN)
    most = max((scene.count for scene in scenes), default=0)
    if most > MOST_PARTICLES:
        raise InputError(
            f"stream.count = {most}: a page shows at most {MOST_PARTICLES} particles; add"
            f" --set stream.count={MOST_PARTICLES}"
        )
    stepped = sum(scene.run.engine == "pymunk" or scene.crowded for scene in scenes)
    if stepped > MOST_STEPPED:
        raise InputError(
            f"{stepped} variants are stepped, at most {MOST_STEPPED} are allowed,"
            " because each may take seconds: vary in fewer steps, or add"
            " --set stream.interact=false --set run.engine=exact"
        )


def _outcome(values: tuple[float, ...], scene: Scene) -> Outcome:
    try:
        return Outcome(values, simulate(scene))
    except StalledError as error:
        return Outcome(values, None, f"the run got stuck: {error}")
    except SceneError as error:
        fault = reason(error)
    recording = None
    if scene.outgoing is not None:
        # Its belt has no place, because the flight misses the plate: shown without it.
        with suppress(SceneError, StalledError):
            bare = scene.with_values(dict.fromkeys(("outgoing", "run", "expect")))
            recording = simulate(bare)
    return Outcome(values, recording, fault)


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


def figures(study: Study) -> list[dict[str, Any]]:
    """Return the rows of numbers of a study that have a number in any variant.

    Each has its group (whose number it is, where there are several particles), its name as in
    `chutelab.scene.rules`, label and unit for people, and a number for each variant, simulated and
    analytic: None where it did not happen, or nothing is known.
    """
    surfaces = study.sound[0].surfaces[:-1]
    free = [name for name in surfaces if name not in ("incoming", "plate", "outgoing")]
    labels = dict(LABELS)
    for name in free[:MOST_FREE]:
        labels[f"impact.{name}.t"] = f"Strikes “{name}” at"
        labels[f"impact.{name}.x"] = f"Strikes “{name}” at x"
    crowd = max(recording.count for recording in study.sound) > 1
    rows = [("First particle" if crowd else "", *row) for row in labels.items()]
    books = [("All particles" if crowd else "", *row) for row in BOOKS.items()]
    if crowd:
        rows = [("All particles", *row) for row in CROWD.items()] + books + rows
    else:
        rows += books
    # Without its outgoing belt a scene has other books, and no landing.
    runs = [None if outcome.fault else outcome.recording for outcome in study.outcomes]
    known = [{} if run is None else _analytic(run) for run in runs]
    found = []
    for group, name, label in rows:
        unit = unit_of(name, surfaces)
        if unit is None:
            continue
        values = [nan if run is None else measure(run, name) for run in runs]
        if not any(map(isfinite, values)):
            continue
        analytic = [numbers.get(name) for numbers in known]
        found.append(
            {
                "group": group,
                "name": name,
                "label": label,
                "unit": symbol(unit),
                "simulated": [value if isfinite(value) else None for value in values],
                "analytic": analytic if any(value is not None for value in analytic) else [],
            }
        )
    return found


def _analytic(run: Recording) -> dict[str, float]:
    """Return what the arcs say: where and how fast each of them begins and ends."""
    arcs, began = analytic_of(run, run.prediction)
    if not arcs:
        return {}
    known = {"separation.t": began, "phi1_deg": degrees(atan2(*arcs[0].position))}
    ends = []
    for arc in arcs:
        (where,), (pace,) = (values.tolist() for values in arc.at([arc.end]))
        ends.append((began + arc.end, *where, *pace))
    t, _, y, vx, vy = ends[0]
    known |= {"impact.t": t, "impact.y": y, "v2": hypot(vx, vy)}
    if len(ends) > 1:
        t, x, _, vx, vy = ends[1]
        known |= {"landing.t": t, "landing.x": x, "landing.vx": vx, "landing.vy": vy}
        known["v2r"] = hypot(*arcs[1].velocity)
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
    runs = [one.recording for one in study.outcomes if one.recording is not None]
    knots = np.concatenate([run.knots for run in runs])
    columns = {
        "t": knots["t"],
        "x": knots["position"][:, 0],
        "y": knots["position"][:, 1],
        "vx": knots["velocity"][:, 0],
        "vy": knots["velocity"][:, 1],
        "omega": knots["omega"],
        **{name: knots["entries"][:, i] for i, name in enumerate(ENTRIES)},
    }
    segments = [run.machine.segments for run in runs]
    # A row for each straight surface: ends (m), speed (m/s), restitution, friction.
    rows = [np.column_stack([s.start, s.end, s.speed, s.restitution, s.friction]) for s in segments]
    return {
        "format": FORMAT,
        "engine": sorted({run.engine for run in runs}),
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
        # A column of zeros only is left out.
        "columns": {name: _base64(values) for name, values in columns.items() if values.any()},
        "knots": len(knots),
        "segments": _base64(np.concatenate(rows)),
        "window": _window(study),
        "energies": [{"name": name, "label": label} for name, label in style.ENERGY_LABEL.items()],
        "figures": figures(study),
        "variants": [_variant(outcome) for outcome in study.outcomes],
    }


def _nearest(study: Study, axis: int) -> int:
    """Return where a slider begins: near the scene's own value, if any is known, else at 0."""
    found = value_at(study.scene, study.quantities[axis].path)
    if not isinstance(found, int | float):
        return 0
    return int(np.argmin(np.abs(np.array(study.varies[axis].values) - found)))


def _base64(values: Floats) -> str:
    return b64encode(np.ascontiguousarray(values, dtype="<f8").tobytes()).decode("ascii")


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


def _sides(run: Recording) -> list[float]:
    window = window_of(run)
    return [window.left, window.right, window.bottom, window.top]


def _variant(outcome: Outcome) -> dict[str, Any]:
    run = outcome.recording
    if run is None:
        return {"fault": outcome.fault}
    arcs, began = analytic_of(run, run.prediction)
    # Between these times (s) there is something to see.
    begin, end = action(run)
    begin = max(float(run.track(0)["t"][0]), begin - LEAD * (end - begin))
    end = max(end, float(run.knots["t"].max()))
    particle, pulley = run.particle, run.machine.pulley
    return {
        "fault": outcome.fault,
        "surfaces": list(run.surfaces),
        "owner": run.machine.segments.surface.tolist(),
        "offsets": run.offsets.tolist(),
        "ended": [REASONS[i] for i in run.ended.tolist()],
        "body": [particle.radius, particle.mass, particle.inertia, run.gravity],
        "pulley": None if pulley is None else [pulley.radius, pulley.speed],
        "arcs": [[arc.begin, arc.end, *arc.position, *arc.velocity, arc.gravity] for arc in arcs],
        "began": began,
        "zero": float(run.knots["position"][:, 1].min()),
        "window": _sides(run),
        "reason": str(run.prediction.reason),
        "span": [begin, end],
        "strobe": strobe_step(run),
        "events": _events(run),
    }


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
