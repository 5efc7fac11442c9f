"""A study as what the page reads: binary columns in base64, and JSON for the rest."""

from __future__ import annotations

from base64 import b64encode
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from chutelab.animate.words import sentence
from chutelab.page.figures import figures
from chutelab.plots import style
from chutelab.plots.sampling import STRUCK, action, strobe_step
from chutelab.recording import ENTRIES, REASONS, Kind
from chutelab.scene.paths import value_at
from chutelab.scene.units import symbol

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from chutelab.page.runs import Outcome, Run, Study
    from chutelab.recording import Recording

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


def _columns(knots: NDArray[Any]) -> dict[str, NDArray[np.float64]]:
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


def _base64(values: NDArray[np.float64]) -> str:
    return b64encode(np.ascontiguousarray(values, dtype="<f8").tobytes()).decode("ascii")


def _segments(run: Run) -> NDArray[np.float64]:
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
