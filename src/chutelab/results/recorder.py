"""Collecting knots, events and ledger entries while an engine runs.

Engines hand over whole arrays in the order of time *per particle*; sorting happens once, at the
end. Their positions are relative to a point near the machine, since coordinates far from the
world's origin have few digits left.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import replace
from math import ceil, log2
from struct import Struct
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from chutelab.machine import SWING, Machine
from chutelab.results.loads import Bins
from chutelab.results.record import Record
from chutelab.results.rows import EVENT, KNOT, LASTING, LOAD, REASONS, TOTAL, Kind
from chutelab.util.arrays import Bools, Floats, Ints, put, sorted_by


class StalledError(RuntimeError):
    """A loop reached its bound: a particle makes no progress.

    It has the particle, the time (s) and the place of its centre (m); the reason says what happened
    too often, and what to do about it. The recording has everything before: tracks that were under
    way end at their last knots, with reason ``"time"``.
    """

    def __init__(
        self,
        particle: int,
        t: float,
        position: tuple[float, float],
        reason: str,
        recording: Record | None = None,
    ) -> None:
        super().__init__(particle, t, position, reason)
        self.particle = particle
        self.t = t
        self.position = position
        self.reason = reason
        self.recording = recording

    def __str__(self) -> str:
        x, y = self.position
        place = f"t = {self.t:.6g} s, x = {x:.6g} m, y = {y:.6g} m"
        return f"particle {self.particle} is stuck at {place}: {self.reason}"


class EnoughError(Exception):
    """Raised by the observer of a run's progress to end the run.

    An engine closes the tracks that are under way with reason ``"stopped"``, which is also that of
    particles not yet released, and returns the recording.
    """


WAYS = frozenset(("position", "velocity", "velocity_before", "velocity_after", "force", "at"))
"""Names of vectors in knots, events and loads."""


def upright(machine: Machine) -> Machine:
    """Return a machine at its place, turned so that gravity points straight down."""
    frame = machine.frame.T
    segments, arcs, releases = machine.segments, machine.arcs, machine.releases
    return replace(
        machine,
        segments=replace(segments, start=segments.start @ frame, tangent=segments.tangent @ frame),
        arcs=replace(arcs, center=arcs.center @ frame, begin=arcs.begin - machine.tilt),
        releases=replace(
            releases,
            position=releases.position @ frame,
            velocity=releases.velocity @ frame,
        ),
    )


REMOTE = 8.0
"""Distance from the world's origin, in machine sizes, beyond which a local origin is used."""


def origin(machine: Machine) -> tuple[float, float]:
    """Return the world point near the machine that the engine uses as origin, m.

    It is (0, 0) unless the machine is many times its own size away from there. It is a round
    number, so that subtracting it loses no digit.
    """
    if machine.pulley is not None or not (corners := machine.corners).size:
        return 0.0, 0.0
    axes = tuple(range(corners.ndim - 1))
    low, high = corners.min(axis=axes), corners.max(axis=axes)
    extent = float((high - low).max())
    middle = 0.5 * (low + high)
    if np.abs(middle).max() <= REMOTE * extent:
        return 0.0, 0.0
    unit = 2.0 ** ceil(log2(extent))
    x, y = (round(float(c) / unit) * unit for c in middle)
    return x, y


def moved(machine: Machine, x: float, y: float) -> Machine:
    """Return a machine without a pulley, moved by (x, y), m."""
    if not (x or y):
        return machine
    by = np.array([x, y])
    segments, releases = machine.segments, machine.releases
    return replace(
        machine,
        segments=replace(segments, start=segments.start + by),
        arcs=replace(machine.arcs, center=machine.arcs.center + by),
        releases=replace(
            releases,
            position=releases.position + by,
            exit_box=releases.exit_box + np.tile(by, 2),
        ),
        joints=tuple(
            replace(joint, anchor=joint.anchor and (joint.anchor[0] + x, joint.anchor[1] + y))
            for joint in machine.joints
        ),
        movers=tuple(
            replace(mover, pivot=(mover.pivot[0] + x, mover.pivot[1] + y))
            for mover in machine.movers
        ),
    )


NOTHING = np.zeros(0)
"""Empty arrays for numbers that a run does not have."""


class Recorder:
    """Grows by chunks; `finish` turns it into a frozen `Record` of the machine's run.

    With `apart`, `by_surface` is kept for each particle, (N, S, 3). Recorded positions are relative
    to `origin`, m, see the function: engines run `near`, the machine moved there, and `turned` so
    that gravity points straight down if they need that.
    """

    # Data that few runs have; never changed in place.
    swings, springs = np.empty(0, SWING), np.zeros((0, 4))
    stopped = unsolved = triggered = NOTHING
    totals, lasting = np.empty(0, TOTAL), np.empty(0, LASTING)
    impulses = np.empty((0, 0), LOAD)
    _taken = False  # whether events came from the core

    def __init__(
        self, machine: Machine, *, apart: bool = False, turned: bool = False, lent: bool = False
    ) -> None:
        self.lent = lent
        self.machine, self.origin, self.near = machine, (0.0, 0.0), machine
        self._angular, self._turned = False, turned
        if not machine.is_ahead:
            self.origin = origin(machine)
            self.near = moved(machine, -self.origin[0], -self.origin[1])
            self.near = upright(self.near) if turned else self.near
            self._angular = any(outline is not None for outline in machine.outlines)
        count, owners = machine.count, len(machine.surfaces) + 1  # and one for the particles
        self.entries = np.zeros((count, 3))
        self.by_surface = np.zeros((*((count,) if apart else ()), owners, 3))
        self.ended = np.zeros(count, dtype=np.int8)
        self.drives, self.hinge_work = np.zeros(owners), np.zeros((owners, 4))
        self.contacts = 0
        self.gained = self.hastened = self.torque = self.air_loss = 0.0
        if machine.triggers:
            self.triggered = np.full(len(machine.triggers), np.inf)
        # For engines that count loads in Python, if loads are asked for.
        self.bins = Bins(machine) if machine.loads else None
        self._knots: list[NDArray[Any]] = []
        self._owners: list[Ints] = []
        self._angles: list[Floats] = []
        self._events: list[NDArray[Any]] = []
        # Numbers of single knots, of `KNOT`, and their particles and angles; bytes of events.
        self._numbers: list[float] = []
        self._singles: list[tuple[int, float]] = []
        self._bytes: list[bytes] = []

    def knot(
        self,
        particle: int,
        t: float,
        position: Iterable[float],
        velocity: Iterable[float],
        omega: float,
        angle: float = 0.0,
    ) -> None:
        """Add one knot, as `knots` does, in a tenth of the time."""
        self._numbers += t, *position, *velocity, omega, *self.entries[particle].tolist()
        self._singles.append((particle, angle))

    def _gather(self) -> None:
        """Put single knots and events to the others."""
        if self._singles:
            owners, angles = zip(*self._singles, strict=True)
            knots = np.array(self._numbers, dtype=float).view(KNOT)
            self._numbers, self._singles = [], []
            self.add(np.array(owners), knots, np.array(angles))
        if self._bytes:
            self._events.append(np.frombuffer(b"".join(self._bytes), EVENT))
            self._bytes = []

    def knots(
        self,
        particle: ArrayLike,
        t: ArrayLike,
        position: ArrayLike,
        velocity: ArrayLike,
        omega: ArrayLike,
        angle: ArrayLike = 0.0,
    ) -> None:
        """Add one knot for each of some particles, with the entries booked so far.

        `particle` has shape (k,), and may name a particle more than once only in the order of time;
        the other arguments broadcast against it.
        """
        owner = np.atleast_1d(np.asarray(particle, dtype=np.int64))
        chunk = np.empty(len(owner), dtype=KNOT)
        chunk["t"], chunk["position"], chunk["velocity"] = t, position, velocity
        chunk["omega"], chunk["entries"] = omega, self.entries[owner]
        self.add(owner, chunk, angle)

    def add(self, particle: Ints, knots: NDArray[Any], angle: ArrayLike = 0.0) -> None:
        """Add finished knots (k,) of particles (k,), each particle's in the order of time.

        Angles (rad) are kept if some are boxes or polygons.
        """
        self._gather()
        self._knots.append(knots)
        self._owners.append(particle)
        if self._angular:
            self._angles.append(np.broadcast_to(np.asarray(angle, dtype=float), len(knots)).copy())

    def take_events(self, rows: NDArray[Any]) -> None:
        """Add events from the core: rows with the fields of `EVENT`, or bytes of its rows."""
        self._events.append(np.frombuffer(rows, EVENT) if rows.dtype == np.uint8 else rows)
        self._taken = True

    def take_totals(self, rows: NDArray[Any]) -> None:
        """Take the core's totals of all steps, dtype ``Total``."""
        self.totals = np.frombuffer(bytearray(rows.getfield(f"V{TOTAL.itemsize}").tobytes()), TOTAL)
        self.unsolved = rows["unsolved"].copy()

    def book(
        self,
        particle: int,
        surface: int,
        belt_work: float = 0.0,
        restitution_loss: float = 0.0,
        friction_loss: float = 0.0,
    ) -> None:
        """Book ledger entries (J) on a particle and on the surface it met."""
        # A tuple would have to become an array, which takes three times as long.
        for row in (self.entries[particle], self.by_surface[surface]):
            row[0] += belt_work
            row[1] += restitution_loss
            row[2] += friction_loss

    def events(
        self,
        kind: Kind | ArrayLike,
        particle: ArrayLike,
        t: ArrayLike,
        position: ArrayLike,
        velocity: ArrayLike,
        omega: ArrayLike = 0.0,
        *,
        velocity_before: ArrayLike | None = None,
        omega_before: ArrayLike | None = None,
        surface: ArrayLike = -1,
        other: ArrayLike = -1,
        normal_impulse: ArrayLike = 0.0,
        tangential_impulse: ArrayLike = 0.0,
    ) -> None:
        """Add one event for each of some particles (k,); the state is the one after the event."""
        owner = np.atleast_1d(np.asarray(particle))
        chunk = np.empty(len(owner), dtype=EVENT)
        chunk["particle"], chunk["kind"], chunk["t"] = owner, kind, t
        chunk["position"], chunk["velocity_after"], chunk["omega_after"] = position, velocity, omega
        chunk["velocity_before"] = velocity if velocity_before is None else velocity_before
        chunk["omega_before"] = omega if omega_before is None else omega_before
        chunk["surface"], chunk["other"] = surface, other
        chunk["normal_impulse"], chunk["tangential_impulse"] = normal_impulse, tangential_impulse
        self._events.append(chunk)

    def event(
        self,
        kind: Kind,
        particle: int,
        t: float,
        position: Iterable[float],
        velocity: Iterable[float],
        omega: float,
        *,
        velocity_before: Iterable[float],
        omega_before: float,
        surface: int = -1,
        normal_impulse: float = 0.0,
        tangential_impulse: float = 0.0,
    ) -> None:
        """Add one event of one particle, as `events` does, in a tenth of the time."""
        self._bytes.append(_PACKED.pack(
            t, particle, -1, kind, surface, *position, *velocity_before, *velocity,
            omega_before, omega, normal_impulse, tangential_impulse,
        ))  # fmt: skip

    def whole(self, record: Record, stalled: StalledError | None) -> Record:
        """Return a run's record; if a particle got stuck, raise the error with the record."""
        if stalled is None:
            return record
        frame = self.machine.frame if self._turned else np.eye(2)
        x, y = (stalled.position @ frame + self.origin).tolist()
        raise StalledError(stalled.particle, stalled.t, (x, y), stalled.reason, record)

    def finish(self, *, engine: str, steps: int) -> Record:
        """Sort what was collected, and freeze it."""
        self._gather()
        count = len(self.ended)
        owners = _joined(self._owners, np.dtype(np.int64))
        place = None
        if count > 1 and np.count_nonzero(owners[1:] < owners[:-1]):
            order = sorted_by(owners, count)
            place, owners = np.empty_like(order), owners.take(order)
            place[order] = np.arange(len(order))
        knots = _joined(self._knots, KNOT, place)
        angle = _joined(self._angles, np.dtype(float), place) if self._angular else NOTHING
        if self.machine.interact:
            # Of several blows at one instant the states between them are dropped.
            same = (np.diff(knots["t"]) == 0.0) & (np.diff(owners) == 0)
            if np.any(between := same[:-1] & same[1:]):
                kept = ~np.concatenate([[False], between, [False]])
                knots, owners = knots[kept], owners[kept]
                angle = angle[kept] if self._angular else angle
        offsets, ended = np.array([0, len(knots)]), self.ended
        if count > 1 or len(knots) < 2:
            sizes = np.bincount(owners, minlength=count)
            offsets = np.append(0, sizes.cumsum())
            ended[(sizes == 0) & (ended == REASONS.index("time"))] = REASONS.index("unreleased")
            # A track needs two knots: a single one is doubled.
            if len(lonely := (sizes == 1).nonzero()[0]):
                if self._angular:
                    angle = np.insert(angle, offsets[lonely], angle[offsets[lonely]])
                knots = np.insert(knots, offsets[lonely], knots[offsets[lonely]])
                np.cumsum(np.where(sizes == 1, 2, sizes), out=offsets[1:])
        lies_there = len(self._events) == 1 and self._taken
        events = _joined(self._events, EVENT)
        t = events["t"]
        # The exact engine has those of a family particle by particle, and there they stay.
        if self.machine.family is None and (count > 1 or (times := t.tolist()) != sorted(times)):
            # At one time by particle, then as they came.
            t, particle = t.copy(), events["particle"].copy()
            in_turn = not np.count_nonzero(particle[1:] < particle[:-1])
            order = t.argsort(kind="stable") if in_turn else np.lexsort((particle, t))
            events = events.take(order)
        elif lies_there and not self.lent:
            # It may lie in the core's memory, so copy it, as bytes.
            events = np.array(events.view(np.uint8)).view(EVENT)
        if self._turned or any(self.origin):
            # They may be the engine's own.
            knots, events = knots.copy(), events.copy()
        if self._turned:
            frame = self.machine.frame
            for rows in (knots, events, *[self.impulses][: self.impulses.size]):
                for name in WAYS.intersection(rows.dtype.names or ()):
                    rows[name] = rows[name] @ frame
        if any(self.origin):
            for rows in (knots, events):
                rows["position"] += self.origin
        if any(self.origin) and len(self.totals):
            released = offsets[1:] > offsets[:-1]
            begun = knots["t"][offsets[:-1][released]]
            order = np.argsort(begun, kind="stable")
            mass = np.broadcast_to(self.machine.particle.mass, count)[released][order]
            weight = np.concatenate([[0.0], mass.cumsum()]) * self.machine.gravity
            lifted = weight * self.machine.height(np.array(self.origin))
            # A row that repeats a time comes after the releases of that time.
            again = np.append(False, np.diff(self.totals["t"]) == 0.0)
            first, then = (
                np.searchsorted(begun[order], self.totals["t"], s) for s in ("left", "right")
            )
            self.totals["potential"] += lifted[np.where(again, then, first)]
        if self.impulses.size:
            if any(self.origin):
                (x, y), force = self.origin, self.impulses["force"]
                self.impulses["moment"] += x * force[..., 1] - y * force[..., 0]
                self.impulses["at"] += self.impulses["normal"][..., None] * self.origin
            # By rounding something may lie just after the end of the last track.
            bins = max(1, ceil(knots["t"].max() / self.machine.loads - 1e-9))
            self.impulses, beyond = self.impulses[:bins], self.impulses[bins:]
            for name in LOAD.names or () if len(beyond) else ():
                self.impulses[name][-1] += beyond[name].sum(axis=0)
        return Record(
            machine=self.machine,
            engine=engine,
            knots=knots,
            offsets=offsets,
            ended=ended,
            events=events,
            by_surface=self.by_surface,
            drives=self.drives if self.machine.movers or len(self.swings) else NOTHING,
            swings=self.swings,
            triggered=self.triggered,
            stopped=self.stopped,
            springs=self.springs,
            hinge_work=self.hinge_work if len(self.swings) else np.zeros((0, 4)),
            steps=steps,
            contacts=self.contacts,
            angle=angle,
            gained=self.gained,
            hastened=self.hastened,
            torque=self.torque,
            air_loss=self.air_loss,
            totals=self.totals,
            unsolved=self.unsolved,
            impulses=self.impulses,
            lasting=self.lasting,
        )


_PACKED = Struct("=diibh10d")
"""A row of `EVENT` as bytes."""

_ITEM = np.dtype(f"V{KNOT.itemsize}")
"""A knot as bytes, which are copied whole."""


def read_knots(rows: NDArray[Any]) -> tuple[Ints, NDArray[Any]]:
    """Return copies of the core's knots, dtype ``Knot``: their particles, and the knots.

    A row of ``Knot`` begins with one of `KNOT`.
    """
    return rows["disk"].astype(np.int64), np.frombuffer(rows.getfield(_ITEM).tobytes(), KNOT)


def _joined(
    chunks: list[NDArray[Any]], dtype: np.dtype[Any], place: Ints | None = None
) -> NDArray[Any]:
    """Join arrays and forget them; items go to the given places, if any, else in order.

    They are copied as bytes, which is several times as fast.
    """
    if len(chunks) == 1 and place is None:
        return chunks.pop()
    whole = np.empty(sum(map(len, chunks)), dtype=dtype)
    if place is not None:
        begin = 0
        for chunk in chunks:
            put(whole, place[begin : begin + len(chunk)], chunk)
            begin += len(chunk)
    elif len(whole):
        np.concatenate([chunk.view(np.uint8) for chunk in chunks], out=whole.view(np.uint8))
    chunks.clear()
    return whole


_X, _V = slice(1, 3), slice(3, 5)
"""Rows of places and velocities in `Tracks.last`."""

ROUGH = 1e-4
"""Largest error of a track between two knots, as a share of the radius."""


class Tracks:
    """Knots of stepped particles, only as many as the curve through them needs.

    Between knots a track is a cubic, which a constant acceleration makes exact: a new knot is due
    when the cubic of the first step since the last knot no longer leads to the particle's place.
    With `turning` this holds for the angle too, the integral of ω, which is linear between knots.
    """

    def __init__(
        self, recorder: Recorder, radius: float, particles: range, *, turning: bool = False
    ) -> None:
        self.recorder, self.first, count = recorder, particles.start, len(particles)
        self.turning, self.radius, self.tolerance = turning, radius, ROUGH * radius
        # The last knots: t, x, v and ω.
        self.last = np.zeros((6, count))
        self.t, self.x, self.v, self.omega = (self.last[rows] for rows in (0, _X, _V, 5))
        self.pull, self.fresh = np.zeros((2, count)), np.ones(count, dtype=bool)
        self.twist = np.zeros(count)

    def knot(
        self,
        i: int,
        t: float,
        x: Sequence[float] | Floats,
        v: Sequence[float] | Floats,
        omega: float = 0.0,
        angle: float = 0.0,
    ) -> None:
        """Write a knot of the particle in a row, with the entries booked so far."""
        self.recorder.knot(self.first + i, t, x, v, omega, angle)
        self.note(i, (t, *x, *v, omega))

    def note(self, i: int, state: tuple[float, ...]) -> None:
        """Note the last knot of the particle in a row: t, x, v and ω."""
        self.last[:, i], self.fresh[i] = state, True

    def step(
        self,
        rows: Bools,
        times: tuple[float, float],
        state: Floats,
        entries: Floats,
        angle: Floats | None = None,
    ) -> None:
        """Note a step of the particles in some rows; write knots of the states before where due.

        `times` (s) and `state` (2, 5, N), of x, y, vx, vy and ω, are those at both ends; `entries`
        (3, N) and `angle` (N,), how far all have turned (rad), are those before.
        """
        tau = times[1] - self.t
        x, v = state[1, :2], state[1, 2:4]
        new = self.fresh & rows
        if new.any():
            self.pull[:, new] = (v[:, new] - self.v[:, new]) / tau[new]
        gain = tau * self.pull
        off = np.abs(x - self.x - tau * (self.v + 0.5 * gain))
        # An error of an end velocity shifts a cubic by up to 4/27 τ times it.
        off += 4.0 / 27.0 * tau * np.abs(v - self.v - gain)
        apart = off[0] + off[1]
        if self.turning:
            omega = state[1, 4]
            self.twist[new] = (omega[new] - self.omega[new]) / tau[new]
            apart += 0.5 * self.radius * tau * np.abs(omega - self.omega - tau * self.twist)
        due = np.flatnonzero((apart > self.tolerance) & rows & ~new)
        self.fresh &= ~rows
        if len(due):
            knots = np.empty(len(due), dtype=KNOT)
            before = state[0][:, due]
            knots["t"], knots["position"], knots["velocity"] = times[0], before[:2].T, before[2:4].T
            knots["omega"], knots["entries"] = before[4], entries[:, due].T
            self.recorder.add(self.first + due, knots, 0.0 if angle is None else angle[due])
            self.t[due], self.x[:, due], self.v[:, due] = times[0], before[:2], before[2:4]
            self.pull[:, due] = (v[:, due] - before[2:4]) / (times[1] - times[0])
            self.omega[due] = before[4]
            self.twist[due] = (state[1, 4, due] - before[4]) / (times[1] - times[0])
