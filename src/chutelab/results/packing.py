"""Large crowds on disk: differences from a prediction, rounded to whole units.

Tracks may be off by a share ε of the radius r of the smallest particle. A velocity is stored as its
change from knot to knot less that of a flight, in units of 2.5 ε r / dt, or smaller ones if kinetic
energies require it. Next to intervals longer than a step dt the units are finer, since an error of
the velocities bulges the cubic by a quarter of it times the interval: 0.44 ε r, if they are off by
half a unit along both axes at both ends. The mean of two velocities predicts the displacement
between them, exactly on a parabola. The rest of a place is stored in units of 0.28 times the unit
of velocity times dt, with an error of at most 0.5 ε r. After an interval much shorter than a step
these units are finer, or the velocity *between* two knots would be far off. So a track is off by
less than ε r at any time. Entries of the ledger have units with which the error of all particles
together is less than ε of the energy turned over. The states of events are predicted from the
tracks, or from the event before if a particle has several at an instant, and the impulses from
these states.

Times, the ends of tracks, and all sums such as the ledger's are kept to the last bit.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass
from functools import cached_property
from math import prod, sqrt
from typing import Any

import numpy as np
from numpy.typing import NDArray

from chutelab.machine import Particle
from chutelab.results.ledger import ledger
from chutelab.results.record import Record, hermite
from chutelab.results.rows import EVENT, KNOT
from chutelab.util.arrays import Bools, Floats, Ints

COLUMNS = {
    "units": np.dtype("f8"),
    "ends": KNOT,
    "times": np.dtype("u1"),
    "when": np.dtype("u1"),
    "whose": np.dtype("u1"),
    "sizes": np.dtype("u1"),
    "bits": np.dtype("u1"),
}
"""Arrays that `pack` makes from knots, angles and events, and their types."""

LONG = 0.25
"""After an interval of at least so many steps a place is stored by itself, not as a change."""

FINEST = 20
"""Most halvings of the units of places, for intervals of a millionth of a step."""

MOST = 2.0**52
"""Bound on all rounded whole numbers."""

LEAST = 2.0**-30
"""A change of an entry by less than a unit is stored as a change if it is at least this share of
one."""

WHOLE = ("particle", "other", "kind", "surface")
"""Fields of an event that are whole numbers."""

STATE: tuple[tuple[str, Any], ...] = (
    ("position", (..., 0)), ("position", (..., 1)),
    ("velocity_before", (..., 0)), ("velocity_before", (..., 1)), ("omega_before", ...),
    ("velocity_after", (..., 0)), ("velocity_after", (..., 1)), ("omega_after", ...),
    ("normal_impulse", ...), ("tangential_impulse", ...),
)  # fmt: skip
"""The other fields of an event except the time, with the component of each."""

SPLIT = (5, 8)
"""Rows of these at which a new array of whole numbers begins."""

ROWS = (0, 0, 1, 1, 2, 1, 1, 2, 4, 4)
"""Index of the unit of each row."""


def rounded(values: Floats) -> Ints:
    """Return the nearest whole numbers; `OverflowError` if there are none."""
    if not np.all(np.abs(values) < MOST):
        raise OverflowError("numbers are too far apart")
    return np.rint(values).astype(np.int64)


def fold(numbers: Ints) -> NDArray[np.uint8]:
    """Return the differences of numbers (c, n) along n as bytes (k, c, n), the lowest first."""
    change = np.diff(numbers, prepend=0)
    told = ((change << 1) ^ (change >> 63)).view(np.uint8).reshape(*numbers.shape, 8)
    few = max((n + 1 for n in range(8) if told[..., n].any()), default=1)
    return np.ascontiguousarray(np.moveaxis(told[..., :few], -1, 0))


def unfold(told: NDArray[np.uint8]) -> Ints:
    """Return the input of `fold`."""
    found = np.zeros((*told.shape[1:], 8), dtype=np.uint8)
    found[..., : len(told)] = np.moveaxis(told, 0, -1)
    bits = found.view(np.int64)[..., 0]
    return np.cumsum((bits >> 1 & np.iinfo(np.int64).max) ^ -(bits & 1), axis=-1)


class Orders:
    """The order in which sizes of numbers are written: that of the rows before.

    Rows of one length belong to the same knots, or events. If a number is small, so are others of
    its knot. Sorted by the largest size so far, and then by that of the last row, sizes compress
    better.
    """

    def __init__(self) -> None:
        self.keys: dict[int, NDArray[np.uint16]] = {}

    def of(self, count: int) -> Ints:
        """Return the order of the next row of so many numbers."""
        key = self.keys.setdefault(count, np.zeros(count, dtype=np.uint16))
        return np.argsort(key, kind="stable")

    def add(self, sizes: NDArray[np.uint8]) -> None:
        """Take the sizes of that row into account."""
        most = np.maximum(self.keys[len(sizes)] >> 8, sizes)
        self.keys[len(sizes)] = (most << 8) + sizes


def planes(sizes: NDArray[np.uint8]) -> tuple[Ints, Ints]:
    """Return indices of numbers, most digits first, and how many have over 0, 1, ... digits."""
    many = np.bincount(sizes, minlength=1)[:0:-1].cumsum()[::-1]
    return np.argsort(~sizes, kind="stable"), many


def write(arrays: Iterable[Ints]) -> dict[str, NDArray[np.uint8]]:
    """Return whole numbers as their numbers of binary digits, and all digits but the first."""
    sizes, bits, orders = [], [np.zeros(0, dtype=np.uint8)], Orders()
    for numbers in arrays:
        digits = np.frexp(np.abs(numbers).astype(np.float64))[1].astype(np.uint8)
        for row in np.atleast_2d(digits):
            sizes.append(row[orders.of(len(row))])
            orders.add(row)
        order, many = planes(digits.ravel())
        told = numbers.ravel()[order]
        size = np.abs(told)
        for n, count in enumerate(many.tolist()):
            bits.append(np.packbits(size[:count] >> (n - 1) & 1 if n else told[:count] < 0))
    return {"sizes": np.concatenate(sizes), "bits": np.concatenate(bits)}


class Reader:
    """Returns the numbers given to `write`, in the same order.

    In files of an `earlier` version neither sizes nor digits are sorted.
    """

    def __init__(
        self, sizes: NDArray[np.uint8], bits: NDArray[np.uint8], *, earlier: bool = False
    ) -> None:
        self.sizes, self.bits = sizes, bits
        self.orders = None if earlier else Orders()

    def digits(self, at: Ints) -> Ints:
        """Return the next binary digit of the numbers with these indices."""
        many = (len(at) + 7) // 8
        bits, self.bits = self.bits[:many], self.bits[many:]
        told = np.unpackbits(bits)[: len(at)].astype(np.int64)
        if not self.orders and len(at):
            there = np.zeros(at.max() + 1, dtype=bool)
            there[at] = True
            told = told[np.cumsum(there)[at] - 1]
        return told

    def read(self, *shape: int) -> Ints:
        """Return the next numbers."""
        sizes, self.sizes = np.split(self.sizes, [prod(shape)])
        if len(sizes) < prod(shape):
            raise ValueError("too few numbers")
        if self.orders:
            sizes = sizes.copy()
            for row in sizes.reshape(-1, shape[-1]):
                row[self.orders.of(len(row))] = row.copy()
                self.orders.add(row)
        order, many = planes(sizes)
        numbers = np.zeros(len(sizes), dtype=np.int64)
        if len(many):
            some = order[: many[0]]
            signs = 1 - 2 * self.digits(some)
            found = 1 << (sizes[some].astype(np.int64) - 1)
            for n, count in enumerate(many[1:].tolist()):
                found[:count] |= self.digits(some[:count]) << n
            numbers[some] = signs * found
        return numbers.reshape(shape)


class Intervals:
    """The interval before each knot, from times of knots (K,), offsets of tracks, and units.

    Attributes
    ----------
    first, last : ndarray, shape (n,)
        The first and last knot of each track.
    h : ndarray, shape (K,)
        Time since the knot before, s; 0 at the first one.
    long : ndarray, shape (K,)
        Whether this is `LONG`, or the knot is the first one: there a chain begins.
    chain : ndarray, shape (K,)
        The knot where the chain of this knot begins.
    share : ndarray, shape (K,)
        Share of their unit in which places are stored along a chain.
    finer : ndarray, shape (K,)
        How often units of velocities are halved.
    """

    def __init__(self, t: Floats, offsets: Ints, units: Floats) -> None:
        released = offsets[1:] > offsets[:-1]
        self.first, self.last = offsets[:-1][released], offsets[1:][released] - 1
        self.h = np.diff(t, prepend=t[:1])
        self.h[self.first] = 0.0
        # A step may be rounded up; k is the exponent for lengths from 2^(k - 1) to 2^k steps.
        steps = self.h / (1.001 * units[6])
        self.long = steps >= LONG
        self.long[self.first] = True
        begin = np.flatnonzero(self.long)
        self.chain = begin[np.cumsum(self.long) - 1]
        exponent = np.where(steps > 0.0, np.frexp(steps)[1], -FINEST)
        # Chains are usually short; errors that add up along a long one have to stay small.
        self.share = np.ldexp(0.25, exponent.clip(-FINEST, 0))
        self.finer = np.maximum(exponent, np.append(exponent[1:], 0)).clip(0)
        self.some, self.speeds = self.finer > 0, units[[1, 1, 2], None]
        self.fall = rounded(np.outer(np.append(units[7:9], 0.0), self.h) / self.speeds)

    def rates(self, motion: Ints, more: Ints) -> Floats:
        """Return velocities and spins, (3, K), from stored numbers, some corrected."""
        rates = self.speeds * np.cumsum(motion + self.fall, axis=1)
        rates[:, self.some] += np.ldexp(self.speeds * more, -self.finer[self.some])
        return np.asarray(rates)

    def tell_rates(self, rates: Floats) -> tuple[Ints, Ints]:
        """Return the numbers that `rates` decodes."""
        motion = rounded(rates / self.speeds)
        more = np.ldexp((rates / self.speeds - motion)[:, self.some], self.finer[self.some])
        return np.diff(motion, prepend=0, axis=1) - self.fall, rounded(more)

    def passed(self, rate: Floats) -> Floats:
        """Return the integral of a rate from the first knot on, by means of knots, (K,)."""
        return np.cumsum(0.5 * self.h * (np.append(rate[:1], rate[:-1]) + rate))

    def places(self, told: Ints, rate: Floats, unit: float) -> Floats:
        """Return places, or angles, (K,), from numbers at starts of chains and along them."""
        begin = unit * np.cumsum(np.where(self.long, told, 0))
        along = np.cumsum(np.where(self.long, 0.0, unit * self.share * told))
        return np.asarray(begin + (along - along[self.chain]) + self.passed(rate))

    def tell_places(self, places: Floats, rate: Floats, unit: float) -> Ints:
        """Return the numbers that `places` decodes."""
        left = places - self.passed(rate)
        along = np.where(self.long, 0.0, np.diff(left, prepend=0.0))
        told = rounded(along / (unit * self.share))
        told[self.long] = np.diff(rounded(left[self.long] / unit), prepend=0)
        return told

    def entries(self, told: Ints, unit: float, ends: Floats) -> Floats:
        """Return entries, (3, K), from those of `tell_entries` and the `ends`, (2, n, 3).

        An entry that does not change next to an end equals that of the end; otherwise the last
        interval would seem to change it.
        """
        change = told - (told > 0) + LEAST * (told == 1)
        entries, changes = unit * np.cumsum(change, axis=1), np.cumsum(told != 0, axis=1)
        track = np.repeat(np.arange(len(self.first)), self.last - self.first + 1)
        for place, end in zip((self.first, self.last), ends, strict=True):
            same = changes == changes[:, place[track]]
            entries = np.where(same, end[track].T, entries)
        return np.asarray(entries)

    def end_at(self, places: Floats, ends: Floats) -> None:
        """Move the first and last chain of each track such that its ends are (2, n)."""
        moved = np.zeros(len(places))
        moved[self.chain[self.last]] = ends[1] - places[self.last]
        moved[self.first] = ends[0] - places[self.first]
        places += moved[self.chain]


def tell_entries(entries: Floats, unit: float) -> Ints:
    """Return changes of entries (3, K) in units; above 0 plus 1, as 1 is less than a unit.

    Which entries change at all shows what goes on between two knots.
    """
    change = np.diff(rounded(entries / unit), prepend=0)
    changes = np.diff(entries, prepend=0.0) != 0.0
    return np.asarray(change + (change > 0) + (changes & (change == 0)))


@dataclass
class Tracks:
    """The content of `COLUMNS` except the states of events.

    `still` (E,) marks events that change nothing; `keys` (K,) of knots and `when` (E,) of events
    are in the order of particles and times. `first` (E,) is the first event of the particle at
    that instant, of those in a row; in files of an `earlier` version the event itself.
    """

    knots: NDArray[Any]
    angle: Floats
    events: NDArray[Any]
    still: Bools
    keys: Ints
    when: Ints
    first: Ints
    steps: Floats

    @classmethod
    def of(
        cls,
        packed: dict[str, NDArray[Any]],
        offsets: Ints,
        read: Callable[..., Ints],
        *,
        earlier: bool = False,
    ) -> Tracks:
        """Return the content; `ValueError` or `IndexError` if the columns do not fit together.

        `read` returns the next whole numbers, in a given shape.
        """
        units, ends = packed["units"], packed["ends"]
        times = unfold(packed["times"])[0].view(np.float64)
        at, (when, still, *whole) = unfold(packed["when"])[0], unfold(packed["whose"])
        if min(at.min(), when.min(initial=0)) < 0:
            raise ValueError("a time is out of range")
        knots, events = np.zeros(len(at), KNOT), np.zeros(len(when), EVENT)
        knots["t"], events["t"] = times[at], times[when]
        for name, told in zip(WHOLE, whole, strict=True):
            events[name] = told
        intervals = Intervals(knots["t"], offsets, units)
        motion = read(3, len(knots))
        rates = intervals.rates(motion, read(3, int(intervals.some.sum())))
        knots["velocity"], knots["omega"] = rates[:2].T, rates[2]
        for axis in (0, 1):
            place = intervals.places(read(len(knots)), rates[axis], units[0])
            intervals.end_at(place, ends["position"][..., axis])
            knots["position"][:, axis] = place
        angle = np.zeros(0)
        if units[9]:
            angle = intervals.places(read(len(knots)), rates[2], units[5])
        told = read(3, len(knots))
        knots["entries"] = intervals.entries(told, units[3], ends["entries"]).T
        knots[[intervals.first, intervals.last]] = ends
        owner = np.repeat(np.arange(len(offsets) - 1), np.diff(offsets))
        keys, when = at + len(times) * owner, when + len(times) * whole[0]
        first = np.arange(len(when))
        if not earlier:
            first[1:][np.diff(when) == 0] = 0
            first = np.maximum.accumulate(first)
        return cls(knots, angle, events, still > 0, keys, when, first, units[ROWS, None])

    @cached_property
    def foretold(self) -> tuple[Floats, Bools]:
        """The first eight rows of `STATE` from the tracks, and where the last three are used.

        These are states after an event; they are used where a track has them as a knot.
        """
        knots, events = self.knots, self.events
        begin, end = (np.searchsorted(self.keys, self.when, side) for side in ("left", "right"))
        # If the track has knots at that time, they are the states; otherwise use the track between
        # knots.
        there, left = end > begin, np.clip(begin - 1, 0, len(knots) - 2)
        a, b = knots[np.where(there, begin, left)], knots[np.where(there, end - 1, left)]
        t, when = knots["t"], events["t"]
        t, h = t[left], t[left + 1] - t[left]
        share = np.divide(when - t, h, out=np.ones(len(t)), where=h > 0.0).clip(0.0, 1.0)
        (x, y), (vx, vy), spin = a["position"].T, a["velocity"].T, a["omega"]
        before = np.stack([x, y, vx, vy, spin])
        before[:4] = np.where(there, before[:4], np.hstack(hermite(knots, left, share)).T)
        last = np.append(np.diff(self.first), 1) > 0
        (vx, vy), spin = b["velocity"].T, b["omega"]
        after = np.stack([vx, vy, spin])
        return np.concatenate([before, after]), there & ~self.still & last

    def states(self, told: Ints, particle: Particle) -> Floats:
        """Return all rows of `STATE` from stored numbers.

        Numbers of the `first` event of a particle at an instant are added to what its track tells,
        those of the others to the state before. `particle` has radii, masses and inertias.
        """
        foretold, known = self.foretold
        both = told[2:5] + told[5:8]
        passed = np.cumsum(both, axis=1) - both
        before = told[2:5] + passed - passed[:, self.first]
        state = foretold + self.steps[:8] * told[:8]
        state[2:5] = foretold[2:5] + self.steps[2:5] * before
        follows = foretold[2:5] + self.steps[2:5] * (before + told[5:8])
        state[5:8] = np.where(known, state[5:8], follows)
        # An impulse is the change of momentum; its tangential part changes the spin.
        change = state[5:8] - state[2:5]
        body = particle.of(self.events["particle"])
        along = body.inertia / body.radius * change[2]
        square = body.mass**2 * (change[:2] ** 2).sum(axis=0) - along**2
        impulse = np.stack([np.sqrt(np.maximum(square, 0.0)), along])
        return np.concatenate([state, impulse + self.steps[8:] * told[8:]])

    def tell_states(self, exact: Floats, particle: Particle) -> Ints:
        """Return the numbers that `states` decodes."""
        foretold, known = self.foretold
        told = np.zeros(exact.shape, dtype=np.int64)
        told[:8] = rounded((exact[:8] - foretold) / self.steps[:8])
        follows = rounded((exact[5:8] - foretold[2:5]) / self.steps[2:5])
        told[5:8] = np.where(known, told[5:8], follows - told[2:5])
        later = np.flatnonzero(self.first < np.arange(len(known)))
        told[2:5, later] -= follows[:, later - 1]
        told[8:] = rounded((exact - self.states(told, particle))[8:] / self.steps[8:])
        return told


def units_of(record: Record, tolerance: float) -> Floats:
    """Return units of places, speeds, spins, energies, impulses and angles, and three numbers.

    The numbers are dt, the acceleration of gravity, and 1 if there are angles.
    """
    machine, dt = record.machine, float(record.machine.dt)
    radius, mass = float(record.radius.min()), float(record.mass.min())
    turned = ledger(record).turned_over
    velocity = record.knots["velocity"]
    fastest = sqrt((velocity**2).sum(axis=1).max())
    speed = 2.5 * tolerance * radius / dt
    # Half a unit changes kinetic energies by at most the tolerance times the energy turned over.
    if turned * fastest > 0.0:
        speed = min(speed, 2.0 * tolerance * turned / (record.mass.sum() * fastest))
    energy = tolerance * turned / sqrt(record.count)
    return np.array([
        0.28 * speed * dt, speed, 2.0 * speed / radius, energy or 1.0, mass * speed,
        tolerance, dt, *(-machine.gravity * machine.up), len(record.angle) > 0,
    ])  # fmt: skip


def pack(record: Record, tolerance: float) -> dict[str, NDArray[Any]]:
    """Return `COLUMNS` of a crowd of a stepped engine, within a tolerance, in radii.

    Raises
    ------
    OverflowError
        If the places of particles are too large for whole numbers of units.
    """
    knots, events, units = record.knots, record.events, units_of(record, tolerance)
    intervals = Intervals(knots["t"], record.offsets, units)
    told = [*intervals.tell_rates(np.stack([*knots["velocity"].T, knots["omega"]]))]
    rates = intervals.rates(*told)
    places = [*knots["position"].T, *([record.angle] if units[9] else [])]
    told += map(intervals.tell_places, places, rates, units[[0, 0, 5]])
    told.append(tell_entries(knots["entries"].T, units[3]))
    exact = np.stack([events[name][part] for name, part in STATE])
    still = ~exact[8:].any(axis=0) & np.all(exact[2:5] == exact[5:8], axis=0)
    of_knots, of_events = knots["t"], events["t"]
    times, index = np.unique(np.append(of_knots, of_events), return_inverse=True)
    when = index[len(knots) :]
    packed = {
        "units": units,
        "ends": knots[[intervals.first, intervals.last]],
        "times": fold(times.view(np.int64)[None]),
        "when": fold(index[None, : len(knots)]),
        "whose": fold(np.stack([when, still, *(events[name] for name in WHOLE)])),
    }
    later = iter(told)
    tracks = Tracks.of(packed, record.offsets, lambda *_shape: next(later))
    told += np.split(tracks.tell_states(exact, record.particle), SPLIT)
    return packed | write(told)


def unpack(
    packed: dict[str, NDArray[Any]], offsets: Ints, particle: Particle, *, earlier: bool = False
) -> dict[str, Any]:
    """Return the knots, angles and events given to `pack`, within its tolerance, and the `unit`.

    `earlier` is whether an earlier version packed them.
    """
    reader = Reader(packed["sizes"], packed["bits"], earlier=earlier)
    tracks = Tracks.of(packed, offsets, reader.read, earlier=earlier)
    many = len(tracks.events)
    told = np.concatenate([reader.read(rows, many) for rows in np.diff([0, *SPLIT, len(STATE)])])
    for (name, part), values in zip(STATE, tracks.states(told, particle), strict=True):
        tracks.events[name][part] = values
    if len(reader.sizes) or len(reader.bits):
        raise ValueError("too many numbers")
    unit = float(packed["units"][3])
    return {"knots": tracks.knots, "angle": tracks.angle, "events": tracks.events, "unit": unit}
