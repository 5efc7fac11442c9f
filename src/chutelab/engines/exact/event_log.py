"""What a block of particles leaves behind while it runs: knots, events, bookings.

Everything is kept in the order in which it came, and put into the order of the particles once, when
the block is through. So nothing depends on which particles share a block.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from chutelab.results import EVENT, KNOT
from chutelab.results.recorder import Recorder
from chutelab.util.arrays import Floats, Ints

STATE = 9
"""Rows of a state: the columns of a knot, namely time, position, velocity, ω, ledger entries."""

NUMBERS = np.dtype([("head", f"V{EVENT.itemsize - 80}"), ("numbers", "f8", 10)])
"""What `EVENT` holds from the position on, in one piece: position, velocity before and after, ω
before and after, normal and tangential impulse."""

OF_STATE = np.array([1, 2, 3, 4, 3, 4, 5, 5, 0, 0])
"""Rows of a state that these numbers are where nothing changes; without impulse, see below."""

MANY = 1000
"""Chunks that are joined into one: a long run of one particle consists of small ones."""


class EventLog:
    """Grows by chunks, whose last axis is the particles.

    Parameters
    ----------
    first, count : int
        The block's particles: numbered from 0 here, from `first` on in the recording.
    """

    def __init__(self, first: int, count: int) -> None:
        self.first, self.count = first, count
        self.contacts = 0
        self._knots: list[tuple[Ints, Floats]] = []
        self._events: list[tuple[Ints, int | Ints, int | Ints, Floats, Floats]] = []
        self._books: list[tuple[Ints, Floats, Ints]] = []
        # The same, joined, `MANY` at a time.
        self._old_knots: list[tuple[Ints, Floats]] = []
        self._old_events: list[NDArray[Any]] = []
        self._old_books: list[tuple[Ints, Floats, Ints]] = []

    def knots(self, index: Ints, state: Floats) -> None:
        """Add a knot for each of the particles; `state` (9, k) is kept, not copied."""
        self._knots.append((index, state))
        _join(self._knots, self._old_knots)

    def events(
        self,
        kind: int | Ints,
        index: Ints,
        surface: int | Ints,
        state: Floats,
        *,
        velocity: Floats | None = None,
        omega: Floats | None = None,
        normal: ArrayLike = 0.0,
        tangential: ArrayLike = 0.0,
    ) -> None:
        """Add an event for each of the particles, with velocity (2, k) and ω before it.

        Where they are left out nothing changes.
        """
        if not len(index):
            return
        numbers = state.take(OF_STATE, axis=0)
        if velocity is not None:
            numbers[2:4], numbers[6] = velocity, omega
        numbers[8], numbers[9] = normal, tangential
        self._events.append((index, kind, surface, state[0], numbers))
        if len(self._events) >= MANY:
            self._old_events.append(self._laid_out())
            self._events.clear()

    def book(self, index: Ints, surface: Ints, entries: Floats) -> None:
        """Note ledger entries (3, k), J, on surfaces."""
        self._books.append((index, entries, surface))
        _join(self._books, self._old_books)

    def close(self, recorder: Recorder) -> None:
        """Hand everything over."""
        recorder.contacts += self.contacts
        knots, books = self._old_knots + self._knots, self._old_books + self._books
        if knots:
            rows, sizes = self._tracks(knots)
            recorder.tracks(self.first, sizes, rows.view(KNOT)[:, 0])
        for events in self._old_events:
            recorder.tell(events)
        if self._events:
            recorder.tell(self._laid_out())
        if books:
            owner, entries, surface = _joined(books)
            if self.count > 1:
                order = _by_particle(owner)
                owner, surface, entries = owner[order], surface[order], entries[:, order]
            place = (owner + self.first, surface) if recorder.apart else surface
            for column, row in enumerate(entries):
                # One after the other, not pairwise: the sum does not depend on the blocks.
                np.add.at(recorder.by_surface[..., column], place, row)

    def _laid_out(self) -> NDArray[Any]:
        """Return the events, chunk by chunk, (E,)."""
        events, begin = np.empty(sum(len(chunk[0]) for chunk in self._events), dtype=EVENT), 0
        events["other"] = -1
        names = ("particle", "kind", "surface", "t")
        particles, kinds, surfaces, times = (events[name] for name in names)
        rows = events.view(NUMBERS)["numbers"]
        for index, kind, surface, t, numbers in self._events:
            chunk = slice(begin, begin + len(index))
            particles[chunk], kinds[chunk], surfaces[chunk] = index, kind, surface
            times[chunk], rows[chunk] = t, numbers.T
            begin += len(index)
        particles += self.first
        return events

    def _tracks(self, knots: list[tuple[Ints, Floats]]) -> tuple[Floats, Ints]:
        """Return knots, particle by particle, (K, 9), and how many each has, (count,)."""
        owner = np.concatenate([index for index, _ in knots])
        place = np.empty(len(owner), dtype=np.int64)
        place[_by_particle(owner)] = np.arange(len(owner))
        rows, begin = np.empty((len(owner), STATE)), 0
        for index, state in knots:
            rows[place[begin : begin + len(index)]] = state.T
            begin += len(index)
        return rows, np.bincount(owner, minlength=self.count)


def _joined(chunks: list[Any]) -> Any:
    """Join each part of the chunks, a tuple each, along the particles."""
    return tuple(np.concatenate(part, axis=-1) for part in zip(*chunks, strict=True))


def _join(chunks: list[Any], old: list[Any]) -> None:
    if len(chunks) >= MANY:
        old.append(_joined(chunks))
        chunks.clear()


def _by_particle(owner: Ints) -> Ints:
    """Return the order of the particles, and for each one that in which its entries came."""
    # 16-bit integers are sorted by radix, in linear time.
    return np.argsort(owner.astype(np.int16), kind="stable")
