"""A stream as a whole: flow, fates, the power that it needs, the envelope of its paths.

A scene is a slice of the material on a belt, as thick as a particle. A stream that is
``stream.width`` wide consists of width / (2 r) such slices side by side, and has so many times the
mass flow and power of the simulated one. Without a width, rates are those of the slice.
"""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass
from math import isnan, nan, sqrt
from typing import Any

import numpy as np

from chutelab.results.arrival import CARRIED, Places, arrivals, fates
from chutelab.results.quantities import each, measure
from chutelab.results.record import Record
from chutelab.results.rows import ENTRIES
from chutelab.results.sensors import QUANTILES
from chutelab.scene.quantities import REGISTRY
from chutelab.scene.units import with_unit
from chutelab.util.arrays import Bools, Floats, Ints
from chutelab.util.tables import Sheet, Shown, number, sentence

FEWEST = 20
"""Least number of particles whose paths have an envelope."""

MOST_PATHS = 400
"""Most paths for the envelope of a stream; from more, some are chosen evenly."""

JUMP = 5.0
"""Largest jump of an edge from one place to the next, in distances between places."""

LATE = 2.0 / 3.0
"""Beyond this share of the places, lines end where an edge turns back."""

AHEAD = 1.0 / 60.0
"""Share of the way, ahead and back, that defines the direction of a cut."""

INSTANTS = 400
"""Times along the way at which paths are sampled."""


@dataclass(frozen=True, eq=False)
class Envelope:
    """Quantiles (2, 50, 98 %) of the paths of a stream on cuts across its way at S places.

    Attributes
    ----------
    middle : ndarray, (S, 2)
        The way: medians of both coordinates of the stream's particles at equal times after their
        release, m. Places are equally spaced.
    normal : ndarray, (S, 2)
        Unit vector across the way at each place, to its left.
    offset : ndarray, (3, S)
        `QUANTILES` of the distances to the left of the way at which paths cross, m.
    """

    middle: Floats
    normal: Floats
    offset: Floats

    @property
    def lines(self) -> Floats:
        """Edge to the right, middle and edge to the left as lines, (3, S, 2), m."""
        return np.asarray(self.middle + self.offset[..., None] * self.normal)


def envelopes(recording: Record, places: int = 60) -> dict[str, Envelope]:
    """Return the envelopes of the streams of a recording, by name, each cut at so many places.

    A path is that of a particle from its release to its arrival on the outgoing belt, or to its
    end. The way goes on as long as half of the paths do, and its lines do not jump. A stream has no
    envelope if it is released all at once, has fewer than `FEWEST` paths, or they lead nowhere. Not
    for a family.
    """
    found = {}
    due = recording.machine.releases
    end = np.full(recording.count, np.nan)
    end[recording.released] = recording.ends()[1]["t"]
    end = np.fmin(end, arrivals(recording)["t"])
    for index, (name, stream) in enumerate(
        zip(recording.machine.streams, recording.scene.streams, strict=True)
    ):
        own = np.flatnonzero((due.stream == index) & np.isfinite(end))
        if stream.at_once or len(own) < FEWEST:
            continue
        own = own[np.linspace(0, len(own) - 1, min(len(own), MOST_PATHS)).astype(np.int64)]
        if (one := _envelope(recording, own, end[own], places)) is not None:
            found[name] = one
    return found


def _envelope(recording: Record, own: Ints, end: Floats, places: int) -> Envelope | None:
    """Return the envelope of the paths of some particles up to their ends (s)."""
    begin = recording.knots["t"][recording.offsets[own]]
    since = np.linspace(0.0, float(np.median(end - begin)), INSTANTS)
    times = begin + since[:, None]
    under_way = times <= end
    row, column = np.nonzero(under_way)
    paths = np.full((*under_way.shape, 2), np.nan)
    paths[row, column] = Places(recording).on(own[column], times[row, column])
    way = np.nanmedian(paths, axis=1)
    length = np.concatenate([[0.0], np.hypot(*np.diff(way, axis=0).T).cumsum()])
    if not length[-1] > 0.0:
        return None
    at = np.linspace(0.0, length[-1], places)
    clock = np.interp(at, length, since)
    behind, middle, ahead = (
        np.stack([np.interp(at + by, length, way[:, axis]) for axis in (0, 1)], axis=-1)
        for by in (-AHEAD * length[-1], 0.0, AHEAD * length[-1])
    )
    tangent = ahead - behind
    tangent /= np.hypot(*tangent.T)[:, None]
    normal = np.stack([-tangent[:, 1], tangent[:, 0]], axis=-1)
    offset = np.full((len(QUANTILES), places), np.nan)
    for s in range(places):
        # A path crosses where it goes from behind the cut to ahead of it; of several crossings the
        # one nearest in time to the way's counts.
        along = paths @ tangent[s]
        along -= middle[s] @ tangent[s]
        passes = (along[:-1] <= 0.0) & (along[1:] > 0.0)
        late = np.where(passes, np.abs(since[:-1] - clock[s])[:, None], np.inf)
        row, column = late.argmin(axis=0), np.arange(len(own))
        through = np.isfinite(late[row, column])
        row, column = row[through], column[through]
        if not 2 * len(row) >= len(own):
            continue
        last, next_ = along[row, column], along[row + 1, column]
        share = (-last / (next_ - last))[:, None]
        crossed = paths[row, column] * (1.0 - share) + paths[row + 1, column] * share - middle[s]
        offset[:, s] = np.quantile(crossed @ normal[s], QUANTILES)
    found = Envelope(middle, normal, offset)
    jumps = np.hypot(*np.moveaxis(np.diff(found.lines, axis=1), 2, 0)).max(axis=0)
    # Where half of the particles lie, cuts go through them and lines jump, or the way turns round
    # and an edge runs back.
    back = np.sum(np.diff(found.lines, axis=1) * tangent[1:], axis=2).min(axis=0) < 0.0
    late = np.arange(1, places) > LATE * places
    broken = np.flatnonzero((jumps > JUMP * at[1]) | (back & late))
    offset[:, broken[0] + 1 if len(broken) else places :] = np.nan
    return found


BLOCKS = 10
"""Blocks of particles in the order of arrival, whose spread gives the standard error."""

PER_BLOCK = 2
"""Particles in a block, at least."""

BELT_WORK = ENTRIES.index("belt_work")


@dataclass(frozen=True)
class Steady:
    """The outgoing belt's power for steady streams, if it carries what arrives.

    `rate` (t/h) is that of the streams whose rate was given as a mass per time. `power` (W) brings
    them to the belt's speed, slip heat included: the work on settled particles, per mass, times the
    rate. It is None if nothing has settled. `error` is its standard error (W), from blocks of
    particles; None without enough of them. `width` (m) is that of the material for rate and power,
    None if they belong to the simulated slice.
    """

    rate: float
    power: float | None
    error: float | None
    width: float | None

    def __str__(self) -> str:
        of = "of the simulated slice" if self.width is None else f"{self.width:g} m wide"
        said = f"at {number(self.rate)} t/h, {of}"
        if self.power is None:
            return (
                f"outgoing belt, steady {said}: the power is not known, as nothing settles on it in"
                " this run; --set run.until=settled tells it"
            )
        power = number(self.power)
        if self.error is not None:
            power = f"{self.power:.4g} ± {self.error:.2g}"
        return f"outgoing belt, steady: P = {power} W {said}"


def works(recording: Record) -> Floats:
    """Return the outgoing belt's work on each particle that settled on it, J, (N,).

    NaN for the others. If particles neither meet nor rotate, it is m v_b (v_b - v_x) for each that
    has landed, whatever its bounces. Otherwise it is the ledger's entry since arrival, for
    particles that have settled, that have the belt's speed at the end, or that were carried off.
    """
    scene, machine = recording.scene, recording.machine
    found = np.full(recording.count, nan)
    belt = scene.outgoing
    came = arrivals(recording)
    there = np.flatnonzero(np.isfinite(came["t"]) & recording.released)
    if belt is None or belt.speed is None or not len(there):
        return found
    speed: float = belt.speed
    mass = recording.mass
    alone = not machine.interact and np.all(recording.particle.inertia == 0.0)
    if alone and machine.until != "settled":
        found[there] = mass[there] * speed * (speed - came["velocity_before"][there, 0])
        return found
    last = recording.knots[recording.offsets[there + 1] - 1]
    settled = recording.ended_by("settled")[there]
    if machine.until != "landed":
        fate = fates(recording)[there]
        slip = np.abs(last["velocity"][:, 0] - speed)
        rides = (fate == "on outgoing") & (slip <= CARRIED)
        settled |= rides | np.char.startswith(fate.astype(str), "off outgoing")
    there, booked = there[settled], last["entries"][settled, BELT_WORK]
    found[there] = booked - Places(recording).belt_work(there, came["t"][there])
    return found


def steady(recording: Record) -> Steady | None:
    """Return the power for streams in t/h on the outgoing belt; None if none has arrived."""
    scene = recording.scene
    fed = [stream.mass_rate for stream in scene.streams]
    came = np.isfinite(arrivals(recording)["t"]) if scene.outgoing is not None else np.zeros(0)
    if not came.any() or all(rate is None for rate in fed):
        return None
    paid = works(recording)
    rate = power = variance = 0.0
    widths = {stream.width for stream in scene.streams if stream.mass_rate is not None}
    for index, stream in enumerate(scene.streams):
        own = came & (recording.machine.releases.stream == index)
        if stream.mass_rate is None or not own.any():
            continue
        each_kg, error = _per_mass(recording, paid, own)
        rate += 3.6 * stream.mass_rate
        power += stream.mass_rate * each_kg
        variance += (stream.mass_rate * error) ** 2
    width = widths.pop() if len(widths) == 1 else None
    return Steady(
        rate, None if isnan(power) else power, None if isnan(variance) else sqrt(variance), width
    )


def _per_mass(recording: Record, paid: Floats, own: Bools) -> tuple[float, float]:
    """Return the work per mass of some particles, J/kg, and its standard error; NaN unless known.

    The error is that of the mean of blocks. If particles do not meet, a block is a group of
    particles in the order of arrival. If they meet, the belt's work on one goes in part to those
    that it pushes: there a block is the work on all from one arrival to a later one. The first and
    the last of these blocks, in which the stream begins and runs out, do not count.
    """
    came = arrivals(recording)["t"]
    order = np.argsort(came, kind="stable")
    order = order[(own & np.isfinite(paid))[order]]
    mass = recording.mass
    if not len(order):
        return nan, nan
    mean = float(paid[order].sum() / mass[order].sum())
    if len(order) < BLOCKS * PER_BLOCK:
        return mean, nan
    blocks = np.array_split(order, BLOCKS)
    works = [float(paid[block].sum()) for block in blocks]
    if recording.machine.interact:
        there, until = Places(recording), [float(came[block[-1]]) for block in blocks]
        begun = there.belt_work(order, came[order])
        sums = [
            float((there.belt_work(order, np.maximum(t, came[order])) - begun).sum()) for t in until
        ]
        works, blocks = np.diff(sums).tolist()[:-1], blocks[1:-1]
    ratios = [work / float(mass[block].sum()) for work, block in zip(works, blocks, strict=True)]
    return mean, float(np.std(ratios, ddof=1) / sqrt(len(ratios)))


FLOW = 8
"""Least number of arrivals for a flow."""


@dataclass(frozen=True, repr=False)
class Crowd(Shown):
    """A run of several particles, as a whole.

    Attributes
    ----------
    particles : int
        How many there are.
    fates : dict of int
        Number of particles by fate, see `arrival.fates`.
    arrival, landing : dict of dict of float, or None
        For t (s), x (m), vx and vy (m/s), of particles that came to the outgoing belt, or touched
        the belt itself: ``mean``, ``spread`` (standard deviation), ``q02``, ``q50``, ``q98``, and
        ``count``, their number. None without an outgoing belt.
    flow : float or None
        Rate at which the middle half of the particles arrives in the simulated slice, t/h; None for
        fewer than `FLOW`.
    whole_flow : float or None
        The same for the material's whole width; None without a width.
    width : float or None
        Of the material, m.
    thick : dict of float
        By stream, the width of its envelope half-way along, m: 96 % of the paths lie within it.
        Only streams that have an envelope there.
    """

    particles: int
    fates: dict[str, int]
    arrival: dict[str, Any] | None
    landing: dict[str, Any] | None
    flow: float | None
    whole_flow: float | None
    width: float | None
    thick: dict[str, float]

    def sheet(self, *, details: bool = False) -> Sheet:
        """Return arrivals, landings, speeds and fates.

        Without `details` a spread by rounding is shown as 0.
        """
        rows: list[tuple[str, ...]] = []
        notes = [f"where they ended: {told_fates(self.fates)}"]
        if self.arrival is not None and self.landing is not None:
            came, landed = self.arrival["count"], self.landing["count"]
            notes.insert(
                0,
                f"{came} of {self.particles} arrived on the outgoing belt: touched it, or what lies"
                f" on it; {landed} landed: touched the belt itself",
            )
            for what, told, shown in (
                ("arrival", self.arrival, ("t", "x", "vx", "vy")), ("landing", self.landing, ("x",))
            ):  # fmt: skip
                for key in shown if told["count"] else ():
                    values = dict(told[key])
                    if not details and values["spread"] < 1e-9 * abs(values["mean"]):
                        values["spread"] = 0.0
                    cells = (number(values[name]) for name in COLUMNS)
                    rows.append(
                        (with_unit(f"{what}.{key}", REGISTRY[f"{what}.{key}"].unit), *cells)
                    )
        if self.flow is not None:
            said = f"{number(self.flow)} t/h in the simulated slice, one particle thick"
            if self.whole_flow is not None:
                said = f"{number(self.whole_flow)} t/h, {self.width:g} m wide ({said})"
            notes.append(f"flow onto the belt: {said}")
        notes += [
            f"{name}: half-way along, 96 % of its paths lie within {1e3 * round(size, 9):.3g} mm"
            for name, size in self.thick.items()
        ]
        heads = ("", *COLUMNS.values()) if rows else ()
        written = tuple(map(sentence, notes))
        return Sheet("All particles" if rows else "", heads, tuple(rows), notes=written)


COLUMNS = {"mean": "mean", "spread": "spread", "q02": "2 %", "q50": "50 %", "q98": "98 %"}
"""Statistics of a crowd, and the heads of their columns."""


def told_fates(counts: dict[str, int]) -> str:
    """Return fates in words, the most frequent first.

    >>> told_fates({"on outgoing": 197, "fell left": 3})
    '197 on outgoing, 3 fell left'
    """
    return ", ".join(f"{n} {fate}" for fate, n in sorted(counts.items(), key=lambda one: -one[1]))


def crowd(recording: Record) -> Crowd | None:
    """Return a run of several particles as a whole; None for one."""
    scene = recording.scene
    if recording.count < 2:
        return None
    told: dict[str, Any] = {"arrival": None, "landing": None}
    for event in told if scene.outgoing is not None else ():
        told[event] = {"count": int(measure(recording, f"{event}.count"))} | {
            key: {name: measure(recording, f"{event}.{key}.{name}") for name in COLUMNS}
            for key in ("t", "x", "vx", "vy")
        }
    flow = flows(recording)
    ways = {name: np.ptp(one.offset[[0, 2], 1]) for name, one in envelopes(recording, 3).items()}
    return Crowd(
        particles=recording.count,
        fates=dict(Counter(fates(recording).tolist())),
        arrival=told["arrival"],
        landing=told["landing"],
        flow=flow[0],
        whole_flow=flow[1],
        width=scene.stream.width,
        thick={name: float(size) for name, size in ways.items() if np.isfinite(size)},
    )


def flows(recording: Record) -> tuple[float | None, float | None]:
    """Return the flow onto the outgoing belt in t/h, of the slice and of the whole width.

    Both are None if too few arrive, the second one also without ``stream.width``.
    """
    scene = recording.scene
    if scene.outgoing is None:
        return None, None
    t = each(recording, "arrival.t")
    order = np.argsort(t, kind="stable")[: int(np.isfinite(t).sum())]
    if len(order) < FLOW:
        return None, None
    first, last = (int(share * (len(order) - 1)) for share in (0.25, 0.75))
    span = float(t[order[last]] - t[order[first]])
    if not span > 0.0:
        return None, None
    mass = recording.mass
    middle = order[first + 1 : last + 1]
    slices = np.array([scene.slices(number) for number in range(len(scene.streams))])
    slices = slices[recording.machine.releases.stream[middle]]
    flow, whole = (
        3.6 * float(brought.sum()) / span for brought in (mass[middle], mass[middle] * slices)
    )
    return flow, None if scene.stream.width is None else whole
