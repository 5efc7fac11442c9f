"""The loop of the pymunk engine."""

from __future__ import annotations

from math import ceil, inf
from time import perf_counter
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from chutelab.recorder import Recorder
from chutelab.recording import Kind
from chutelab.stepper.books import SETTLED, STILL, Motion, settle_books
from chutelab.stepper.carriage import Carriage, carriage
from chutelab.stepper.solids import Solids, solids
from chutelab.stepper.state import Run
from chutelab.stepper.strike import lone, strike
from chutelab.stepper.tracks import CARRIED, DONE, FLYING, RESTING, WAITING

if TYPE_CHECKING:
    from collections.abc import Callable

    from chutelab.machine import Machine
    from chutelab.recording import Recording
    from chutelab.stepper.world import Contacts

Ints = NDArray[np.int64]

PAUSE = 0.05
"""s between two reports of progress."""


def run(machine: Machine, progress: Callable[[float], None] | None = None) -> Recording:
    """Run a machine, stepping contacts with pymunk.

    Particles that do not interact get a Space each, one after the other.

    Parameters
    ----------
    machine : Machine
        From `chutelab.machine.build`; the radius must be more than 0.
    progress : callable, optional
        Called with the share of the run that is done, at most 20 times a second.

    Returns
    -------
    Recording
        Flights to rounding error, contacts to the accuracy of the step; bit-identical for the same
        machine but for `seconds`.

    Raises
    ------
    ValueError
        If the particle has no radius.
    """
    if machine.particle.radius <= 0.0:
        raise ValueError("particle.radius = 0: pymunk needs disks with a radius above 0 m")
    begin = perf_counter()
    recorder = Recorder(machine.count, machine.surfaces)
    shapes = solids(machine)
    report = _Report(progress)
    everybody = np.arange(machine.count)
    groups = [everybody] if machine.interact else np.split(everybody, machine.count)
    steps = 0
    for done, ids in enumerate(groups):
        loop = _Loop(machine, shapes, recorder, ids)
        report.done, report.part = done / len(groups), 1.0 / len(groups)
        steps += loop.run(report)
    report.last()
    return recorder.finish(
        scene=machine.scene,
        title=machine.title,
        engine="pymunk",
        particle=machine.particle,
        gravity=machine.gravity,
        steps=steps,
        seconds=perf_counter() - begin,
    )


class _Report:
    """Passes progress on, but not more often than `PAUSE`."""

    def __init__(self, progress: Callable[[float], None] | None) -> None:
        self._progress = progress
        self._next = perf_counter() + PAUSE
        self.done, self.part = 0.0, 1.0

    def __call__(self, share: float) -> None:
        if self._progress is not None and perf_counter() >= self._next:
            self._progress(self.done + self.part * share)
            self._next = perf_counter() + PAUSE

    def last(self) -> None:
        if self._progress is not None:
            self._progress(1.0)


class _Loop:
    """Steps one world until its last particle has ended."""

    def __init__(self, machine: Machine, shapes: Solids, recorder: Recorder, ids: Ints) -> None:
        self.machine = machine
        releases = machine.releases
        self.release = releases.t[ids].copy()
        self.rides: dict[int, Carriage] = {
            n: carriage(machine, shapes, int(i))
            for n, i in enumerate(ids.tolist())
            if releases.carried[i]
        }
        self.separation = np.full(len(ids), inf)
        for n, ride in self.rides.items():
            self.separation[n] = ride.until
        self.start = float(self.release[0])
        if len(ids) == 1 and 0 in self.rides:
            # Nothing to step before it is let go.
            self.start = min(self.rides[0].until, machine.end_time)
        span = machine.end_time - self.start
        self.steps = max(0, ceil(span / machine.dt - 1e-9))
        # All steps alike: pymunk reports impulses wrongly where two steps differ in length.
        self.run_state = Run(
            machine, shapes, recorder, ids, span / self.steps if self.steps else machine.dt
        )
        self.agenda = -inf

    def run(self, report: _Report) -> int:
        """Step to the end; return the number of steps taken."""
        r, taken = self.run_state, 0
        self._schedule(self.start)
        for n in range(1, self.steps + 1):
            if (r.tracks.mode == DONE).all():
                break
            self._step(self.start + (n - 1) * r.dt, self.start + n * r.dt)
            taken = n
            if n % 32 == 0:
                report(n / self.steps)
        self._stop(self.start + taken * r.dt)
        return taken

    def _step(self, t0: float, t: float) -> None:
        r = self.run_state
        self._carry(t0, t)
        r.world.step(r.dt)
        contacts = r.world.contacts()
        touched = np.zeros(r.count, dtype=bool)
        if contacts is not None:
            touched[contacts.first] = True
            touched[contacts.other[contacts.other < r.count]] = True
        r.lift(np.flatnonzero((r.tracks.mode == RESTING) & ~touched), t0)
        if contacts is None:
            r.touching = np.empty(0, dtype=np.int64)
        else:
            self._resolve(contacts, t)
            self._settle(t)
        if t >= self.agenda or r.tracks.exit.min() <= t:
            self._schedule(t)

    def _resolve(self, contacts: Contacts, t: float) -> None:
        """Hand the contacts of a step to those who know what to do with them."""
        r, k = self.run_state, self.run_state.tracks
        x, v, spin = r.world.states()
        carried = k.mode == CARRIED
        first_carried = carried[contacts.first]
        if first_carried.any():
            contacts = contacts.turned(first_carried)
        alone = lone(r, contacts)
        keys = r.keys(contacts.first, contacts.other)
        flying = np.flatnonzero(k.mode == FLYING)
        before, spin_before = k.aim.copy(), k.spin.copy()
        before[flying] = k.flight(flying, t)[1] - 0.5 * r.dt * r.gravity
        before[carried], spin_before[flying] = v[carried], k.omega[flying]
        spin_before[carried] = 0.0
        motion = Motion(before, v, spin_before, spin)
        states = np.concatenate([x, v], axis=1)
        for row in np.flatnonzero(alone).tolist():
            strike(r, contacts, row, t, states)
        if not alone.all():
            settle_books(r, contacts.take(~alone), x, motion, t)
        r.touching = keys

    def _carry(self, t0: float, t: float) -> None:
        """Lead carried bodies along their rides during a step."""
        r = self.run_state
        for n in np.flatnonzero(r.tracks.mode == CARRIED).tolist():
            ride = self.rides[n]
            if ride.x + ride.speed * (t - ride.t) > 0.0:
                (x0, y0), _ = ride.state(t0)
                (x1, y1), _ = ride.state(t)
                r.world.place(n, (x0, y0), ((x1 - x0) / r.dt, (y1 - y0) / r.dt))

    def _settle(self, t: float) -> None:
        """End what has settled."""
        r, mode = self.run_state, self.run_state.tracks.mode
        if self.machine.until != "settled":
            return
        if self.machine.interact:
            live = np.flatnonzero(mode != DONE)
            if (mode[live] != RESTING).any() or (r.calm[live] * r.dt < STILL[1]).any():
                return
        else:
            live = np.flatnonzero((mode == RESTING) & (r.calm >= SETTLED[1]))
        self._end_settled(live, t)

    def _end_settled(self, who: Ints, t: float) -> None:
        r, k = self.run_state, self.run_state.tracks
        k.close(who)
        r.event(Kind.SETTLE, who, t, k.x[who], k.v[who], k.omega[who], r.on[who])
        r.finish(who, "settled")

    def _schedule(self, t: float) -> None:
        """Do what is due by t: releases, separations, exits."""
        r, k = self.run_state, self.run_state.tracks
        gone = np.flatnonzero(k.exit <= t)
        if len(gone):
            for n in gone.tolist():
                one = np.array([n])
                x, v = k.flight(one, float(k.exit[n]))
                k.knot(one, k.exit[n], x, v, k.omega[n])
            r.event(Kind.EXIT, gone, k.t[gone], k.x[gone], k.v[gone], k.omega[gone])
            r.finish(gone, "exit")
        end = self.machine.end_time
        due = np.flatnonzero((k.mode == WAITING) & (self.release <= t) & (self.release < end))
        for n in due.tolist():
            self._release(n, t)
        for n in np.flatnonzero((k.mode == CARRIED) & (self.separation <= t)).tolist():
            self._separate(n, self.rides[n], t)
        waiting, carried = k.mode == WAITING, k.mode == CARRIED
        self.agenda = min(
            float(self.release[waiting].min(initial=inf)),
            float(self.separation[carried].min(initial=inf)),
        )

    def _release(self, n: int, t: float) -> None:
        r, k, releases = self.run_state, self.run_state.tracks, self.machine.releases
        one, i = np.array([n]), int(self.run_state.ids[n])
        x, v = releases.position[i], releases.velocity[i]
        k.knot(one, self.release[n], x, v, 0.0)
        r.event(Kind.RELEASE, one, self.release[n], x, v, 0.0)
        if n not in self.rides:
            self._let_fly(n, t)
            return
        k.mode[n] = CARRIED
        if self.rides[n].speed == 0.0 and self.machine.until == "settled" and r.count == 1:
            r.on[n] = 0
            self._end_settled(one, float(self.release[n]))
        elif self.rides[n].until > t:
            place, velocity = self.rides[n].state(t)
            r.world.add(n, place, velocity, carried=True)

    def _separate(self, n: int, ride: Carriage, t: float) -> None:
        r, k, one = self.run_state, self.run_state.tracks, np.array([n])
        self._close_ride(n, ride, ride.until)
        r.event(Kind.SEPARATION, one, k.t[one], k.x[one], k.v[one], 0.0, 0)
        r.world.remove(n)
        self._let_fly(n, t)

    def _close_ride(self, n: int, ride: Carriage, until: float) -> None:
        """Write the knots of a ride, and the work by which the belt lets the particle down."""
        r, k, one = self.run_state, self.run_state.tracks, np.array([n])
        for time in ride.times(until):
            x, v = ride.state(time)
            fall = float(k.x[n, 1]) - x[1]
            if fall > 0.0:
                r.recorder.book(r.ids[one], 0, -r.mass * self.machine.gravity * fall)
            if time > k.t[n]:
                k.knot(one, time, x, v, 0.0)

    def _let_fly(self, n: int, t: float) -> None:
        """Put a particle into the world where its flight from the last knot has it at t."""
        r, k, one = self.run_state, self.run_state.tracks, np.array([n])
        k.fly(one)
        x, v = k.flight(one, t)
        v = v + 0.5 * r.dt * r.gravity
        r.world.add(n, tuple(x[0].tolist()), tuple(v[0].tolist()))

    def _stop(self, t: float) -> None:
        """End what is left when the time is up."""
        r, k = self.run_state, self.run_state.tracks
        k.close(np.flatnonzero(k.mode == RESTING))
        end = self.machine.end_time
        flying = np.flatnonzero(k.mode == FLYING)
        if len(flying):
            x, v = k.flight(flying, end)
            k.knot(flying, end, x, v, k.omega[flying])
        for n in np.flatnonzero(k.mode == CARRIED).tolist():
            self._close_ride(n, self.rides[n], end)
        left = np.flatnonzero((k.mode != DONE) & (k.mode != WAITING))
        r.finish(left, "time")
