"""Sensors: lines across a stream that count what passes, when, where, which way and how fast.

A passage is where the track of a centre crosses the line between a sensor's ends, found on the
curves between knots to rounding. Its direction (`way`) is 1 from the left of the line, seen from
its first end, and -1 from the right: through a sensor drawn upward, 1 is to the right.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise
from math import hypot, nan

import numpy as np
from numpy.typing import NDArray

from chutelab.results.record import Record, hermite, kept
from chutelab.scene import Scene
from chutelab.util.arrays import Floats, Ints
from chutelab.util.errors import InputError
from chutelab.util.tables import Sheet, number

QUANTILES = (0.02, 0.5, 0.98)
"""Quantiles of a stream at one edge, in the middle and at the other edge."""

PASSAGE = np.dtype(
    [("t", "f8"), ("particle", "i4"), ("way", "i1"), ("along", "f8"), ("position", "f8", 2),
     ("velocity", "f8", 2)]
)  # fmt: skip
"""Time (s), particle, direction, distance from the first end (m), position (m), velocity (m/s)."""

HALVINGS = 60
"""Bisections of an interval, enough for all digits of a double."""

Place = Sequence[float]


def need_sensors(scene: Scene) -> None:
    """Raise an `InputError` if a scene has no sensor."""
    if not scene.sensor:
        allowed = "one [[sensor]] or more, each with name, from and to: the scene has none"
        raise InputError(allowed, "sensor", None)


def passages(recording: Record, begin: Place, end: Place) -> NDArray[np.void]:
    """Return the passages of all particles through the line between two places (m), by time.

    Their dtype is `PASSAGE`. Whether a track that only just touches the line counts as two passages
    depends on the last digit.
    """
    knots = recording.knots
    x, y = knots["position"].T
    vx, vy = knots["velocity"].T
    long = hypot(end[0] - begin[0], end[1] - begin[1])
    ux, uy = (end[0] - begin[0]) / long, (end[1] - begin[1]) / long
    # Distance to the left of the line, and its rate; a cubic over each interval h.
    off, rate = (y - begin[1]) * ux - (x - begin[0]) * uy, vy * ux - vx * uy
    last = np.zeros(len(knots), dtype=bool)
    last[recording.offsets[1:][recording.released] - 1] = True
    h = np.diff(knots["t"], append=0.0)
    # Also between two knots at one time: an impact on the line may move a centre by rounding.
    left = np.flatnonzero(~last)
    # If a cubic crosses, its control points are on both sides.
    third = h[left] / 3.0
    points = [off[left], off[left] + third * rate[left], off[left + 1] - third * rate[left + 1],
              off[left + 1]]  # fmt: skip
    left = left[(np.min(points, axis=0) < 0.0) & (np.max(points, axis=0) >= 0.0)]
    h, p, q = h[left], off[left], off[left + 1]
    v, w = h * rate[left], h * rate[left + 1]
    b, c = 3.0 * (q - p) - 2.0 * v - w, v + w - 2.0 * (q - p)

    def height(s: Floats, i: Ints | slice = slice(None)) -> Floats:
        return np.asarray(p[i] + s * (v[i] + s * (b[i] + s * c[i])))

    # Its slope v + 2 b s + 3 c s² is zero at the cuts; between them it is monotone.
    with np.errstate(invalid="ignore", divide="ignore"):
        far = -b - np.where(b < 0.0, -1.0, 1.0) * np.sqrt(b * b - 3.0 * c * v)
        turns = np.stack([far / (3.0 * c), v / far])
    turns = np.sort(np.where((turns > 0.0) & (turns < 1.0), turns, 1.0), axis=0)
    cuts = np.stack([np.zeros(len(left)), *turns, np.ones(len(left))])
    heights = np.stack([height(s) for s in cuts])
    heights[0], heights[-1] = p, q
    part, i = np.nonzero((heights[:-1] < 0.0) != (heights[1:] < 0.0))
    low, high, below = cuts[part, i], cuts[part + 1, i], heights[part, i] < 0.0
    for _ in range(HALVINGS):
        middle = 0.5 * (low + high)
        before = (height(middle, i) < 0.0) == below
        low, high = np.where(before, middle, low), np.where(before, high, middle)
    found = np.zeros(len(i), dtype=PASSAGE)
    at = left[i]
    found["t"] = knots["t"][at] + high * h[i]
    found["particle"] = np.searchsorted(recording.offsets, at, side="right") - 1
    found["way"] = np.where(below, -1, 1)
    found["position"], found["velocity"] = hermite(knots, at, high)
    reach = found["position"] - begin
    found["along"] = reach[:, 0] * ux + reach[:, 1] * uy
    found = found[(found["along"] >= 0.0) & (found["along"] <= long)]
    return found[np.lexsort((found["particle"], found["t"]))]


@dataclass(frozen=True)
class Reading:
    """The reading of a sensor in a run.

    Attributes
    ----------
    name : str
        Of the sensor.
    count, back : int
        Passages with way 1, and with way -1.
    mass : float
        Mass of the former less that of the latter, kg.
    rate, mass_rate : float
        Particles (1/s) and mass (kg/s) per time between the first and the last passage of way 1;
        NaN for fewer than two.
    whole_rate : float
        t/h of the material's whole width; NaN unless ``stream.width`` is given.
    speed : dict of float
        ``mean``, ``q02``, ``q50`` and ``q98`` of the speeds of way 1, m/s.
    depth : float
        Distance along the line between the 2 % and 98 % quantiles of passages, plus a particle's
        diameter: the depth of the stream, m.
    kinds : dict of int
        Passages of way 1 by kind of particle, where there are several.
    segregation : float
        Correlation of radius and place along the line, -1 to 1; NaN if all have one size.
    """

    name: str
    count: int
    back: int
    mass: float
    rate: float
    mass_rate: float
    whole_rate: float
    speed: dict[str, float]
    depth: float
    kinds: dict[str, int]
    segregation: float


@kept
def sensed(recording: Record, name: str) -> NDArray[np.void]:
    """Return the passages through a sensor of the scene, by its name, see `passages`."""
    sensor = next(one for one in recording.scene.sensor if one.name == name)
    return passages(recording, sensor.from_, sensor.to)


def reading(recording: Record, name: str) -> Reading:
    """Return the reading of a sensor of the scene."""
    found = sensed(recording, name)
    on = found[found["way"] > 0]
    mass, radius = recording.mass, recording.radius
    span = float(on["t"][-1] - on["t"][0]) if len(on) > 1 else 0.0
    whose, along = on["particle"], on["along"]
    brought = mass[whose]
    # The first passage opens the time span; the others pass within it.
    rate, flow = ((len(on) - 1) / span, float(brought[1:].sum()) / span) if span else (nan, nan)
    speeds = np.hypot(*on["velocity"].T)
    told = {"mean": nan} | {f"q{round(100 * share):02}": nan for share in QUANTILES}
    depth = alike = nan
    if len(on):
        edges = np.quantile(speeds, QUANTILES).tolist()
        told = dict(zip(told, [float(speeds.mean()), *edges], strict=True))
        low, _, high = np.quantile(along, QUANTILES)
        sizes = radius[whose]
        depth = float(high - low + 2.0 * np.median(sizes))
        if np.ptp(sizes) > 0.0 and np.ptp(along) > 0.0:
            alike = float(np.corrcoef(sizes, along)[0, 1])
    scene = recording.scene
    of = recording.machine.releases.kind[whose]
    names = [kind.name or f"particle[{n}]" for n, kind in enumerate(scene.particles)]
    return Reading(
        name=name,
        count=len(on),
        back=len(found) - len(on),
        mass=float((found["way"] * mass[found["particle"]]).sum()),
        rate=rate,
        mass_rate=flow,
        whole_rate=3.6 * flow * scene.slices() if scene.streams[0].width is not None else nan,
        speed=told,
        depth=depth,
        kinds={kind: int((of == n).sum()) for n, kind in enumerate(names)} if names[1:] else {},
        segregation=alike,
    )


@kept
def first_passages(recording: Record, name: str) -> dict[str, Floats]:
    """Return t, x, y, vx, vy, speed of each particle's first passage of way 1, (N,); or NaN."""
    found = sensed(recording, name)
    found = found[found["way"] > 0]
    particles, rows = np.unique(found["particle"], return_index=True)
    some = found[rows]
    told = np.full((6, recording.count), nan)
    told[0, particles] = some["t"]
    told[1:3, particles] = some["position"].T
    told[3:5, particles] = some["velocity"].T
    told[5, particles] = np.hypot(*told[3:5, particles])
    return dict(zip(("t", "x", "y", "vx", "vy", "speed"), told, strict=True))


def readings(recording: Record) -> dict[str, Reading]:
    """Return the readings of all sensors of the scene, by name; none for a family."""
    if recording.family is not None:
        return {}
    return {one.name: reading(recording, one.name) for one in recording.scene.sensor}


def residence(recording: Record, begin: str, end: str) -> Floats:
    """Return the time from the first passage of a sensor to the next one of another, (N,), s.

    NaN for particles that do not pass both in this order.
    """
    found = np.full(recording.count, nan)
    later, enters = sensed(recording, end), first_passages(recording, begin)["t"]
    whose, t = later["particle"], later["t"]
    for particle in np.flatnonzero(np.isfinite(enters)).tolist():
        entered = float(enters[particle])
        leaves = t[(whose == particle) & (t >= entered)]
        found[particle] = leaves[0] - entered if len(leaves) else nan
    return found


def flow(found: NDArray[np.void], every: float, until: float) -> tuple[Floats, Ints]:
    """Return edges of bins of a time (s) from 0 to the end of a run, and the passages in each.

    Those of way -1 count as -1.
    """
    edges = every * np.arange(int(np.ceil(until / every)) + 1)
    counted, _ = np.histogram(found["t"], edges, weights=found["way"].astype(np.float64))
    return np.asarray(edges, dtype=np.float64), counted.astype(np.int64)


def sheet(recording: Record) -> Sheet | None:
    """Return a table of all sensors; None without one."""
    told = readings(recording)
    if not told:
        return None
    heads = ("sensor", "passed", "back", "1/s", "kg/s", "speed, m/s", "depth, m")
    rows = tuple(
        (name, str(one.count), str(one.back), *map(number, (one.rate, one.mass_rate)),
         number(one.speed["mean"]), number(one.depth))
        for name, one in told.items()
    )  # fmt: skip
    notes = [
        f"{name}: {number(one.whole_rate)} t/h in all the width"
        for name, one in told.items()
        if np.isfinite(one.whole_rate)
    ]
    for name, one in told.items():
        if one.kinds:
            parts = ", ".join(f"{count} {kind}" for kind, count in one.kinds.items())
            notes.append(f"{name}: {parts} passed")
    names = list(told)
    for begin, end in pairwise(names):
        times = residence(recording, begin, end)
        times = times[np.isfinite(times)]
        if len(times):
            low, middle, high = np.quantile(times, QUANTILES)
            notes.append(
                f"from {begin} to {end}: {number(float(middle))} s, of 96 %"
                f" {number(float(low))} to {number(float(high))} s"
            )
    return Sheet("Sensors", heads, rows, notes=tuple(notes))
