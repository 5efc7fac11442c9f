"""The loop of the pymunk engine."""

from __future__ import annotations

from heapq import heapify, heappop, heappush
from math import inf
from time import perf_counter
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from chutelab.machine import moved, origin
from chutelab.recorder import Recorder, StalledError
from chutelab.recording import Kind
from chutelab.stepper.books import SETTLED, STILL
from chutelab.stepper.carriage import Carriage, Carriages, carriage
from chutelab.stepper.clash import Clashes
from chutelab.stepper.entries import end_contacts
from chutelab.stepper.forecast import Forecast
from chutelab.stepper.impacts import particle_partner, solid_partner, strike
from chutelab.stepper.kick import kick
from chutelab.stepper.outline import Outline
from chutelab.stepper.report import Report
from chutelab.stepper.solids import Solids, solids
from chutelab.stepper.state import Run
from chutelab.stepper.tracks import CARRIED, DONE, FLYING, RESTING, WAITING

if TYPE_CHECKING:
    from collections.abc import Callable

    from chutelab.machine import Machine
    from chutelab.recording import Recording

Ints = NDArray[np.int64]


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
    StalledError
        If there are too many impacts within one step; it has the recording so far.
    """
    if machine.particle.radius <= 0.0:
        raise ValueError("particle.radius = 0: pymunk needs disks with a radius above 0 m")
    begin = perf_counter()
    place = origin(machine)
    machine = moved(machine, -place[0], -place[1])
    recorder = Recorder(machine.count, machine.surfaces)
    shapes = solids(machine)
    report = Report(progress)
    outline = Outline(
        shapes,
        machine.pulley.radius if machine.pulley is not None else 0.0,
        machine.particle.radius,
        machine.gravity,
    )
    clashes = Clashes(machine, shapes)
    everybody = np.arange(machine.count)

    def finished(steps: int) -> Recording:
        return recorder.finish(
            scene=machine.text, title=machine.title, engine="pymunk", particle=machine.particle,
            gravity=machine.gravity, steps=steps, seconds=perf_counter() - begin, origin=place,
        )  # fmt: skip

    groups = [everybody] if machine.interact else np.split(everybody, machine.count)
    steps = 0
    for done, ids in enumerate(groups):
        loop = _Loop(machine, shapes, outline, recorder, ids, clashes)
        report.done, report.part = done / len(groups), 1.0 / len(groups)
        try:
            loop.run(report)
        except StalledError as stalled:
            loop.stop(stalled.t)
            stalled.recording = finished(steps + loop.steps)
            x, y = stalled.position
            stalled.position = x + place[0], y + place[1]
            raise
        steps += loop.steps
    report.last()
    return finished(steps)


class _Loop:
    """Runs one world until its last particle has ended, in `steps` of all and of pairs."""

    def __init__(
        self, machine: Machine, shapes: Solids, outline: Outline, recorder: Recorder, ids: Ints,
        clashes: Clashes,
    ) -> None:  # fmt: skip
        self.machine = machine
        releases = machine.releases
        self.release = releases.t[ids]
        self.rides: dict[int, Carriage] = {
            n: carriage(machine, shapes, int(i))
            for n, i in enumerate(ids.tolist())
            if releases.carried[i]
        }
        self.carriages = Carriages(self.rides, len(ids))
        start = float(self.release[0])
        if len(ids) == 1 and 0 in self.rides:
            # Nothing to step before it is let go.
            start = min(self.rides[0].until, machine.end_time)
        self.run_state = Run(machine, shapes, recorder, ids, start, clashes)
        self.forecast = Forecast(self.run_state, outline)
        self.agenda = [
            (float(t), n, self._release) for n, t in enumerate(self.release) if t < machine.end_time
        ]
        heapify(self.agenda)
        self.last, self.tick = start, inf
        self.steps = 0

    def run(self, report: Report) -> None:
        """Run to the end."""
        end, exits = self.machine.end_time, self.run_state.tracks.exit
        now = begin = self.agenda[0][0] if self.agenda else end
        while True:
            self._prepare(now)
            impact, exit_ = self.forecast.next(), float(exits[exits.argmin()])
            due = self.agenda[0][0] if self.agenda else inf
            now = min(impact, exit_, due, self.tick)
            if now > end or now == inf:
                break
            # At one time the step goes first: what joins a contact then has no part in it yet.
            if now == self.tick:
                self._step(now)
            elif now == due:
                _, n, act = heappop(self.agenda)
                act(n, now)
            elif now == exit_:
                self._exit(now)
            else:
                self._impact(now)
            if self.steps % 32 == 0:
                report((now - begin) / (end - begin) if end > begin else 1.0)
        self.stop(end)

    def _prepare(self, now: float) -> None:
        """Foretell what new paths lead to; see whether pymunk has to step."""
        r, mode = self.run_state, self.run_state.tracks.mode
        if not r.fresh and self.tick < inf:
            return
        some = np.count_nonzero
        alive = bool(some(mode == RESTING))
        if not alive and some(mode == FLYING):
            alive = not self.machine.align or (
                self.machine.interact and bool(some(mode == CARRIED) or some(r.crowd.stepped))
            )
        if not alive:
            self.tick = inf
        elif self.tick == inf:
            self.tick = r.next_tick(now)
            self.last = self.tick - r.dt
            self._carry(now)
        if self.machine.align:
            self.forecast.refresh(now, self.tick)
        r.fresh.clear()

    def _carry(self, now: float) -> None:
        """Put carried particles on paths that agree with their rides now and at the next step."""
        r, k = self.run_state, self.run_state.tracks
        span = self.tick - now
        who = (k.mode == CARRIED).nonzero()[0]
        if self.machine.interact and len(who) and 0.0 < span < inf:
            k.from_t[who] = now
            k.from_x[who], mean = self.carriages.chord(who, now, self.tick)
            k.from_v[who] = mean - 0.5 * span * r.gravity
            r.version[who] += 1

    def _impact(self, t: float) -> None:
        r, what = self.run_state, self.forecast.take()
        self.steps += 1
        if what.touch is not None:
            partner = solid_partner(r, what.touch)
        else:
            partner = particle_partner(r, what.particle, what.other, t)
        strike(r, what.particle, partner, t)

    def _step(self, t: float) -> None:
        r = self.run_state
        mode = r.tracks.mode
        if not self.machine.align:
            kick(r, mode == CARRIED, self.last, t)
        elif np.count_nonzero(
            ((mode == RESTING) & ~r.idle.asleep) | ((mode == FLYING) & r.crowd.stepped)
        ):
            kick(r, self.forecast.beside & (mode == CARRIED), self.last, t)
        self.steps += 1
        r.crowd.look(t)
        self.last, self.tick = t, r.next_tick(t)
        r.idle.move(t, self.tick)
        self._settle(t)
        self._carry(t)
        if self.machine.align:
            self.forecast.window(t, self.tick)

    def _settle(self, t: float) -> None:
        """End what has settled."""
        r, mode = self.run_state, self.run_state.tracks.mode
        if self.machine.until != "settled":
            return
        if self.machine.interact:
            live, some = (mode == RESTING).nonzero()[0], np.count_nonzero
            ended = len(mode) - len(live) == some(mode == DONE)
            if not ended or some(r.calm[live] * r.dt < STILL[1]):
                return
        else:
            live = ((mode == RESTING) & (r.calm >= SETTLED[1])).nonzero()[0]
        self._end_settled(live, t)

    def _end_settled(self, who: Ints, t: float) -> None:
        r, k = self.run_state, self.run_state.tracks
        end_contacts(r, who)
        r.event(Kind.SETTLE, who, t, k.x[who], k.v[who], k.omega[who], r.stays.on[who])
        r.finish(who, "settled")

    def _exit(self, t: float) -> None:
        r, k = self.run_state, self.run_state.tracks
        gone = (k.exit <= t).nonzero()[0]
        x, v = k.flight(gone, t)
        k.knot(gone, t, x, v, k.omega[gone])
        r.event(Kind.EXIT, gone, t, x, v, k.omega[gone])
        r.finish(gone, "exit")

    def _release(self, n: int, t: float) -> None:
        r, k, releases = self.run_state, self.run_state.tracks, self.machine.releases
        one, i = np.array([n]), int(self.run_state.ids[n])
        x, v = releases.position[i], releases.velocity[i]
        k.knot(one, t, x, v, 0.0)
        r.event(Kind.RELEASE, one, t, x, v, 0.0)
        if n not in self.rides:
            r.take_off(n)
            return
        k.mode[n] = CARRIED
        if self.rides[n].speed == 0.0 and self.machine.until == "settled" and r.count == 1:
            r.stays.on[n] = 0
            self._end_settled(one, t)
            return
        if self.rides[n].until < self.machine.end_time:
            heappush(self.agenda, (self.rides[n].until, n, self._separate))
        self._carry(t)
        r.changed(n)

    def _separate(self, n: int, t: float) -> None:
        r, k, one = self.run_state, self.run_state.tracks, np.array([n])
        self._close_ride(n, self.rides[n], t)
        r.event(Kind.SEPARATION, one, k.t[one], k.x[one], k.v[one], 0.0, 0)
        if r.inside[n]:
            r.world.remove(n)
            r.inside[n] = False
        r.take_off(n)

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

    def stop(self, end: float) -> None:
        """End what is left."""
        r, k = self.run_state, self.run_state.tracks
        resting = (k.mode == RESTING).nonzero()[0]
        end_contacts(r, resting)
        flying = (k.mode == FLYING).nonzero()[0]
        if len(flying):
            x, v = k.flight(flying, end)
            k.knot(flying, end, x, v, k.omega[flying])
        for n in (k.mode == CARRIED).nonzero()[0].tolist():
            self._close_ride(n, self.rides[n], end)
        left = ((k.mode != DONE) & (k.mode != WAITING)).nonzero()[0]
        r.finish(left, "time")
        r.flush()
