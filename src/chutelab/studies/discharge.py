"""The stream by engineers' methods, beside the simulated one.

>>> from chutelab.studies.discharge import side_by_side
>>> found = side_by_side("low-speed", heights=[-0.5])
>>> round(float(found.lines["booth"][0, 0]), 3)  # its lower edge: adhesion is no slip
0.824
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from math import inf, isnan, nan, radians, sqrt
from typing import Any

import numpy as np

from chutelab.engines.simulation import simulate
from chutelab.results import Recording
from chutelab.results.sensors import QUANTILES
from chutelab.scene import AnyScene, Scene, from_dict, load, to_dict
from chutelab.theory.discharge import LEFT_OUT, METHODS, Discharge, DischargeError, discharge
from chutelab.util.arrays import Floats, Progress
from chutelab.util.tables import Sheet, plain

HEIGHTS = (0.0, -0.2, -0.4, -0.6, -0.8, -1.0)
"""Heights above the pulley's axis at which streams are compared, m."""

DEEPEST = 100.0
"""Lowest height, below the axis, m."""

LOOK = 1e-3
"""Time between two samples of the simulated paths, s; taken straight between, to 1e-6 m."""

EDGES = ("lower", "centre", "upper")


@dataclass(frozen=True, eq=False)
class SideBySide:
    """Streams by all methods and by simulation."""

    # the simulated scene: only belt, particles and air of the given one
    scene: Scene
    heights: Floats  # (H,), above the pulley's axis, m
    methods: dict[str, Discharge]  # the stream of each method that has an answer
    # x (m) of lower edge, centre and upper edge at the heights, (3, H), for each of them and for
    # "simulated"; NaN without one. Edges of the simulated stream are half a particle outside the 2,
    # 50 and 98 % quantiles of the centres
    lines: dict[str, Floats]
    refused: dict[str, str]  # why another method has no answer
    recording: Recording  # the run

    def sheet(self) -> Sheet:
        """Return a table of the streams at the heights."""
        rows: list[tuple[str, ...]] = []
        for name, lines in self.lines.items():
            rows += [
                (f"{name}, {edge}", *("-" if isnan(x) else f"{x:.3f}" for x in row))
                for edge, row in zip(EDGES, lines.tolist(), strict=True)
                if np.isfinite(row).any()
            ]
        heads = ("at y, m", *(f"{height:g}" for height in self.heights))
        notes = [f"{name}: no answer, {why}" for name, why in self.refused.items()]
        for name in self.methods:
            off = 1000.0 * (self.lines[name] - self.lines["simulated"])[:, -1]
            told = [f"{edge} {x:+.1f}" for edge, x in zip(EDGES, off, strict=True) if not isnan(x)]
            at = f"{name} less simulated, at y = {self.heights[-1]:g} m"
            notes += [f"{at}: {', '.join(told)} mm"] if told else []
        bed, belt = self.scene.stream, self.scene.incoming
        if bed.bed_height and not bed.interact and belt and belt.friction != "adhesion":
            notes.append(
                "The simulated bed has no depth: its particles ignore each other, so all lie on the"
                " belt. stream.interact = true keeps them apart."
            )
        notes.append(f"Left out, as their rules are not known well enough: {', '.join(LEFT_OUT)}.")
        return Sheet("The stream's x, m", heads, tuple(rows), notes=tuple(notes))

    def as_dict(self) -> dict[str, object]:
        """Return plain data for JSON."""
        told = {
            "heights": self.heights,
            "methods": {
                name: {
                    "high_speed": found.high_speed,
                    **{
                        edge: path
                        and {
                            "angle_deg": np.degrees(path.angle),
                            "speed": path.speed,
                            "radius": path.radius,
                        }
                        for edge in EDGES
                        for path in [getattr(found, edge)]
                    },
                }
                for name, found in self.methods.items()
            },
            "x": {name: dict(zip(EDGES, rows, strict=True)) for name, rows in self.lines.items()},
            "refused": self.refused,
        }
        return dict(plain(told))


def side_by_side(
    scene: AnyScene, heights: Sequence[float] = HEIGHTS, *, progress: Progress | None = None
) -> SideBySide:
    """Compare all methods with a simulation of the stream from the incoming belt, in free flight.

    Plate, surfaces and the outgoing belt are left out. The depth of the bed is that of the layers
    of the first stream plus half a particle below and above.

    Raises a `DischargeError` for a scene without an incoming belt, or whose first stream is not
    released on it, and for heights (m) that are not numbers, all above the pulley or below
    `DEEPEST`.
    """
    whole = load(scene)
    if (belt := whole.incoming) is None:
        raise DischargeError("is needed: it is the pulley that the bed leaves", "incoming")
    if not belt.speed > 0.0:
        raise DischargeError(
            "must be > 0 m/s: a belt at rest throws nothing off", "incoming.speed", belt.speed
        )
    stream, own = whole.streams[0], whole.particle
    if stream.at is not None or own.shape not in ("disk", "sphere"):
        raise DischargeError("must release disks or spheres on the incoming belt", "stream")
    wanted = np.array(heights, dtype=np.float64)
    if not (np.isfinite(wanted).all() and -DEEPEST <= wanted.min() < belt.pulley_radius):
        allowed = f"must be numbers, the least from -{DEEPEST:g} m to the pulley's top"
        raise DischargeError(f"{allowed} at {belt.pulley_radius:g} m", "heights", list(heights))
    tables = to_dict(whole)
    streams = tables.get("stream", {})
    fall = sqrt(2.0 * (belt.pulley_radius - float(wanted.min())) / whole.gravity)
    kept = ("title", "gravity", "air_density", "material", "incoming", "particle")
    free: dict[str, Any] = {key: tables[key] for key in kept if key in tables}
    there = {"incoming", *(kind.name for kind in whole.particles)}
    free["pair"] = [pair for pair in tables.get("pair", ()) if there.issuperset(pair["between"])]
    rides = (belt.length + 4.0 * belt.pulley_radius) / belt.speed
    last = stream.start + stream.count / whole.rate + rides + 3.0 * fall
    free["stream"] = streams[0] if isinstance(streams, tuple) else streams
    free["run"] = {"until": last, "dt": whole.run.dt}
    if (low := float(wanted.min())) < -1.0:
        # A run ends 1 m below its lowest surface, so this one is put behind the whole stream.
        behind = -belt.length - 10.0 * belt.pulley_radius
        free["surface"] = [{"name": "low", "from": [behind - 1.0, low], "to": [behind, low]}]
    alone = from_dict(free)
    radius = float(np.max(own.radius))
    mass = own.mass if own.mass is not None else nan
    friction = inf if belt.friction == "adhesion" else whole.met(whole.kinds[0], "incoming")[1]
    heavy = radius > 0.0 and mass > 0.0
    methods: dict[str, Discharge] = {}
    lines: dict[str, Floats] = {}
    refused: dict[str, str] = {}
    for method in METHODS:
        try:
            methods[method] = found = discharge(
                method,
                speed=belt.speed,
                radius=belt.pulley_radius,
                depth=stream.bed_height + 2.0 * radius,
                incline=radians(belt.incline_deg),
                friction=friction,
                gravity=whole.gravity,
                sphere=(radius, mass) if heavy else None,
            )
        except DischargeError as error:
            refused[method] = str(error)
            continue
        paths = [getattr(found, edge) for edge in EDGES]
        lines[method] = np.array(
            [[nan if path is None else path.across(y) for y in heights] for path in paths]
        )
    recording = simulate(alone, progress=progress)
    lines["simulated"] = stream_at(recording, heights)
    return SideBySide(alone, np.array(heights), methods, lines, refused, recording)


def stream_at(recording: Recording, heights: Sequence[float] | Floats) -> Floats:
    """Return x (m) of lower edge, middle and upper edge of a stream that falls, (3, H)."""
    begin, end = float(recording.knots["t"].min()), float(recording.knots["t"].max())
    times = np.arange(begin, end, LOOK)
    places = np.asarray(recording.at(times)[0])
    found = np.full((3, len(heights)), nan)
    for h, height in enumerate(heights):
        above, below = places[:-1, :, 1] > height, places[1:, :, 1] <= height
        row, column = np.nonzero(above & below)
        (x, y), (to, down) = places[row, column].T, places[row + 1, column].T
        if not len(x):
            continue
        across = x + (to - x) * (y - height) / (y - down)
        half = recording.radius[column] * np.hypot(to - x, y - down) / (y - down)
        for edge, (side, share) in enumerate(zip((-1.0, 0.0, 1.0), QUANTILES, strict=True)):
            found[edge, h] = np.quantile(across + side * half, share)
    return found
