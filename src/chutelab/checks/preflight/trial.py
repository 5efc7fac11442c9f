"""What `preflight` finds: what is built and skipped, and the cost.

The cost is estimated from a trial run, which is cut off after 1 s.
"""

from __future__ import annotations

import sys
from collections.abc import Iterator, Mapping
from dataclasses import astuple, dataclass, field, replace
from math import ceil, inf, log, log1p
from time import process_time
from typing import Any

import numpy as np

from chutelab.engines.exact import ROUNDS
from chutelab.engines.simulation import follow
from chutelab.machine import Machine, build
from chutelab.results import EVENT, KNOT, REASONS, Recording
from chutelab.results.recorder import EnoughError, StalledError
from chutelab.results.rows import LOAD
from chutelab.results.sensors import readings
from chutelab.results.summary import air_drag, stopped
from chutelab.results.wear import touched
from chutelab.scene import Scene, SceneError
from chutelab.scene.units import write_size
from chutelab.theory import drag, predict
from chutelab.theory.prediction import Coverage
from chutelab.util.arrays import Floats
from chutelab.util.tables import Sheet, Shown


@dataclass(frozen=True)
class Part:
    """Something that is built, or skipped: its name, and how or why in words."""

    name: str
    what: str


@dataclass(frozen=True)
class Stepping:
    """What finite steps mean for a scene."""

    dt: float  # longest step, s
    aligned: bool  # impacts are found at their own times, so nothing is passed through at any speed
    speed: float | None  # highest in the trial run, m/s; None if there was none
    way: float | None  # distance that a particle covers in a step at that speed, m
    bound: float  # upper bound of it if steps are not aligned: the radius, m
    longest: float | None  # step with which it stays below, s
    safe: bool  # no particle can pass through a surface unseen

    def rows(self) -> list[tuple[str, str]]:
        """Return it in words, under headings."""
        longest = write_size(self.dt, "s")
        if self.aligned:
            return [
                ("steps", f"at most {longest} while contacts last"),
                ("tunnelling", "none at any speed: impacts are found at their own times"),
            ]
        room = f"a surface catches it within {write_size(self.bound, 'm')}"
        passing = f"nothing moved in the trial run; {room}"
        if self.way is not None and self.longest is not None:
            passing = (
                f"{'none' if self.safe else 'POSSIBLE'}: at {self.speed:.3g} m/s a particle covers"
                f" {write_size(self.way, 'm')} in a step, and {room}: safe below dt ="
                f" {write_size(self.longest, 's')}"
            )
        return [("steps", f"all of {longest}"), ("tunnelling", passing)]


@dataclass(frozen=True)
class Extra:
    """Cost of recording something in a run, or of computing it from one."""

    name: str  # "loads", "sensors" or "wear"
    seconds: float  # more of processor time for the whole run, about
    memory: int  # more bytes at the peak, about

    def row(self) -> tuple[str, str]:
        """Return it in words."""
        more = write_size(float(f"{self.seconds:.1g}"), "s", digits=6) if self.seconds else "0 s"
        memory = f" and {float(f'{self.memory / 1e6:.1g}'):g} MB" if self.memory else ""
        return self.name, f"about {more}{memory} more"


@dataclass(frozen=True)
class Effort:
    """What a run is expected to cost."""

    contacts: int  # impacts and collisions, about
    seconds: float  # processor time of a run here and now, about
    at_least: bool  # the amount is unknown: all numbers are lower bounds
    how: str  # what the estimate rests on
    memory: int  # bytes that a run needs at its peak, about
    extras: tuple[Extra, ...] = ()  # cost of quantities that are measured only on request


@dataclass(frozen=True)
class Advice:
    """A warning about something that works, and what would change it."""

    warning: str
    change: str  # what to do, in words
    settings: Mapping[str, Any]  # as settings for `Scene.with_values`; empty if none is known


@dataclass(frozen=True, repr=False)
class Preflight(Shown):
    """All that `chutelab check` says of a scene."""

    title: str
    built: tuple[Part, ...]
    skipped: tuple[Part, ...]
    engine: str
    why: str  # this engine runs
    ends: str  # when the run is over
    stepping: Stepping | None  # None if the exact engine runs
    effort: Effort
    theory: Coverage
    advice: tuple[Advice, ...]

    def sheet(self) -> Sheet:
        """Return all of it, under headings."""
        rows: list[tuple[str, ...]] = [("built",), *map(astuple, self.built)]
        rows += [("skipped",), *map(astuple, self.skipped)]
        rows += [("how it runs",), ("engine", f"{self.engine}: {self.why}"), ("ends", self.ends)]
        if self.stepping is not None:
            rows += self.stepping.rows()
        about = "not known, at least" if self.effort.at_least else "about"
        # Contacts and memory are known to two digits, the time to one.
        contacts = int(float(f"{self.effort.contacts:.2g}"))
        lasts = write_size(float(f"{self.effort.seconds:.1g}"), "s", digits=6)
        rows.append(("contacts", f"{about} {contacts:,}"))
        rows.append(("run time", f"{about} {lasts}; {self.effort.how}"))
        rows.append(("memory", f"{about} {float(f'{self.effort.memory / 1e6:.2g}'):,.0f} MB"))
        rows += [extra.row() for extra in self.effort.extras]
        rows.append(("closed form",))
        if self.theory.covers:
            rows.append(("covers", ", ".join(self.theory.covers)))
        if self.theory.leaves_out:
            missing = ", ".join(self.theory.leaves_out) if self.theory.covers else "all of it"
            rows.append(("leaves out", missing))
        rows.append(("because" if self.theory.reason else "in words", self.theory.words))
        if self.advice:
            rows.append(("what to mind",))
        for advice in self.advice:
            rows += [("warning", advice.warning), ("change", advice.change)]
        return Sheet(self.title, ("", ""), tuple(rows), texts=2)


MANY = 12
"""Pieces of one surface that are listed; if there are more, only their number is given."""


def built(machine: Machine) -> Iterator[Part]:
    """Yield the parts of a machine, world frame."""
    for index, surface in enumerate(machine.surfaces):
        own = [part.of(part.surface == index) for part in machine.parts]
        count = sum(len(part.surface) for part in own)
        if count > MANY:
            points = np.round(np.concatenate([part.corners for part in own]), 12) + 0.0
            (x0, y0), (x1, y1) = points.min(axis=0), points.max(axis=0)
            box = f"from ({x0:.6g}, {y0:.6g}) to ({x1:.6g}, {y1:.6g}) m"
            yield Part(surface, f"{count} pieces, {box}")
            continue
        for part in own:
            for piece in map(part.of, range(len(part.surface))):
                said = f", moving at {piece.speed:.6g} m/s" if piece.speed else ""
                if np.isfinite(piece.appears):
                    said += f", from t = {piece.appears:.6g} s"
                if np.isfinite(piece.vanishes):
                    said += f", until t = {piece.vanishes:.6g} s"
                yield Part(surface, piece.where() + said)
        if machine.pulley is not None and machine.pulley.surface == index:
            yield Part("pulley", f"radius {machine.pulley.radius:.6g} m, axis at (0, 0)")
    for joint in machine.joints:
        begin = f"particle {joint.other}"
        if joint.anchor is not None:
            place = "({:.6g}, {:.6g}) m".format(*joint.anchor)
            begin = place if joint.over is None else f"{begin} over {place}"
        held = f"from {begin} to particle {joint.particle}, {joint.length:.6g} m long"
        yield Part(joint.kind, held)
    releases = machine.releases
    for n, kind in enumerate(machine.scene.particles):
        which = (releases.kind == n).nonzero()[0]
        if not len(which):
            continue
        p = machine.particle.of(which)
        radii, masses = np.atleast_1d(p.radius), np.atleast_1d(p.mass)
        turning = f"a free {kind.shape}" if np.any(p.inertia) else "not turning"
        size = _span(radii, "radius", "m") if np.any(radii) else "a mass point"
        if kind.outline:
            size = f"a {kind.shape}, {2.0 * kind.radius:.6g} m across"
        many = f"{len(which):,} of them, each " if len(which) > 1 else ""
        yield Part(
            kind.name or "particle", f"{many}{size}, {_span(masses, 'mass', 'kg')}, {turning}"
        )
    for n, name in enumerate(machine.streams):
        which = (releases.stream == n).nonzero()[0]
        (x, y), (vx, vy) = releases.position[which[0]], releases.velocity[which[0]]
        first, last = releases.t[which[0]], releases.t[which[-1]]
        begin = f" at t = {first:.6g} s" if first else ""
        end = f", the last at t = {last:.6g} s" if len(which) > 1 else ""
        where = f"the first from ({x:.6g}, {y:.6g}) m at ({vx:.6g}, {vy:.6g}) m/s"
        yield Part("release" if len(machine.streams) == 1 else name, f"{where}{begin}{end}")


def _span(values: Floats, name: str, unit: str) -> str:
    low, high = values.min(), values.max()
    to = f" to {high:.6g}" if high > low else ""
    return f"{name} {low:.6g}{to} {unit}"


def skipped(
    scene: Scene, machine: Machine, engine: str, recording: Recording | None
) -> Iterator[Part]:
    """Yield the parts that are not built, and why; `recording` is a trial run of the scene."""
    for table in ("incoming", "plate", "outgoing", "surface"):
        if not getattr(scene, table):
            written = f"[[{table}]]" if table == "surface" else f"[{table}]"
            name = "surfaces" if table == "surface" else table
            yield Part(name, f"the scene has no {written}")
    if not np.any(machine.particle.inertia):
        yield Part("rotation", "particle.spin = false")
    if not machine.interact:
        why = "stream.count = 1" if machine.count == 1 else "stream.interact = false"
        yield Part("collisions", f"of particles with each other: {why}")
    if engine == "exact":
        yield Part("steps", "the next event is solved for, so no flight is stepped")
    elif engine == "contact" or (machine.align and not machine.interact):
        yield Part("flights", "only lasting contacts take steps, impacts have their own times")
    if machine.until == "landed":
        yield Part("what follows", 'the first touch of the outgoing belt: run.until = "landed"')
    if scene.air_density:
        return
    air = drag(scene, predict(scene), 0.0) if recording is None else air_drag(recording)
    if air is not None:
        yield Part("air", f"its drag would be {air.effect}")


PATIENCE = 1.0
"""s of processor time after the start of a trial. Of 130 random crowds of 50 to 500 disks four in
five are over by then."""

LONE_PATIENCE = 0.1
"""The same for a run of particle 0 alone."""

BIN, BRIEF, TURNS = 0.01, 0.06, 3
"""To measure the cost of loads: width of the bins (s), length of the run (s), and repeats."""

MOST = 5000
"""Most particles in a trial of a stepped engine, which sets up memory for each."""

WARMING = 0.05
"""s; a shorter trial is run a second time, since its first run is mostly warming up."""


@dataclass(frozen=True)
class Trial:
    """A run up to its end, or up to the time limit."""

    recording: Recording | None  # None if it never came to one
    seconds: float  # of processor time; once warm, if it came to its end
    marks: Floats = field(default_factory=lambda: np.zeros((0, 2)))  # s, and share of the run done
    warming: float = 0.0  # s by which the first run took longer
    # Run of particle 0 alone, without steps if possible; None if the trial was not stepped, either.
    lone: Recording | None = None
    trouble: str = ""  # the error that ended it, if the engine got stuck

    @property
    def whole(self) -> bool:
        """Whether it came to its end, with all that the scene has."""
        return self.recording is not None and not self.trouble and stopped(self.recording) is None


def trial_run(machine: Machine, engine: str) -> Trial:
    """Run a machine until it ends, or its time is up.

    Raises a `SceneError` if the engine that the scene asks for cannot run it.
    """
    scene = machine.scene
    few = machine
    if engine != "exact" and machine.count > MOST and not scene.joints:
        share = MOST / machine.count
        fewer = {
            f"stream[{n}].count": ceil(share * stream.count)
            for n, stream in enumerate(scene.streams)
        }
        few = build(scene.with_values({**fewer, "expect": None}))
    found = _timed(few, PATIENCE)
    if found.whole and found.seconds <= WARMING:
        warm = _timed(few, PATIENCE)
        found = replace(warm, warming=max(0.0, found.seconds - warm.seconds))
    if engine == "exact":
        return found
    try:
        alone = scene.alone().with_values({"run.engine": "auto"})
        lone = _timed(build(alone), LONE_PATIENCE).recording
    except SceneError:
        lone = None
    return replace(found, lone=lone)


def extras(machine: Machine, tried: Trial, cost: Effort) -> Iterator[Extra]:
    """Yield what loads, sensors and wear cost: loads are counted in a part of the run, or not.

    The others are read off the trial run, and grow with what is recorded.
    """
    if tried.recording is None or tried.trouble:
        return
    without, counting = (
        build(tried.recording.scene.with_values({"run.loads": every, "expect": None}))
        for every in (None, machine.loads or BIN)
    )
    more = []
    for _ in range(TURNS):
        runs = [_timed(one, BRIEF) for one in (without, counting)]
        marks = [
            np.vstack([(0.0, 0.0), one.marks, *[(one.seconds, 1.0)] * one.whole]) for one in runs
        ]
        # Time that each took up to the point that the slower one reached.
        share = min(one[-1, 1] for one in marks)
        begin, end = (float(np.interp(share, one[:, 1], one[:, 0])) for one in marks)
        if begin > 0.0:
            more.append((end - begin) / begin)
    if more:
        part, spent = (
            max(0.0, float(np.median(more))),
            tried.seconds if tried.whole else cost.seconds,
        )
        last = tried.recording.knots["t"].max(initial=0.0) if tried.whole else machine.end_time
        bins = ceil(last / (machine.loads or BIN)) * len(machine.surfaces)
        yield Extra("loads", part * spent, bins * LOAD.itemsize)
    grown = 1.0 if tried.whole else cost.seconds / tried.seconds
    for name, read in (("sensors", readings), ("wear", touched)):
        if name == "sensors" and not machine.scene.sensor:
            continue
        spent, before = 0.0, peak()
        for _ in range(2):
            # The first time is mostly warming up if it is short.
            if spent <= WARMING:
                tried.recording.found.clear()
                begin = process_time()
                read(tried.recording)
                spent = process_time() - begin
        yield Extra(name, grown * spent, round(grown * (peak() - before)))


def _timed(machine: Machine, patience: float) -> Trial:
    begin = process_time()
    marks: list[tuple[float, float]] = []

    def watch(share: float) -> None:
        now = process_time() - begin
        if marks and share < marks[-1][1]:
            marks.clear()  # another engine has taken over
        marks.append((now, share))
        # The core is compiled once in a process, before its first step.
        if now - marks[0][0] > patience:
            raise EnoughError

    recording, trouble = None, ""
    try:
        recording = follow(machine, None, watch)
    except StalledError as stalled:
        trouble = str(stalled)
        if stalled.recording is not None:
            recording = Recording.of(stalled.recording)
    seconds = process_time() - begin
    return Trial(recording, seconds, np.array(marks).reshape(-1, 2), trouble=trouble)


def stepping(machine: Machine, engine: str, tried: Trial) -> Stepping:
    """Compare the distance per step with the largest at which surfaces stop particles.

    The contact engine finds every impact at its own time, as the pymunk engine does for a lone
    particle with aligned steps. Otherwise a contact is detected at the end of a step, and that must
    be before the centre is on the other side, since surfaces have no thickness.
    """
    bound = float(np.min(machine.particle.radius))
    runs = (run for run in (tried.lone, tried.recording) if run is not None and len(run.knots))
    speed = way = None
    if (run := next(runs, None)) is not None:
        # Not every knot has the speed just before an impact; events do.
        seen = np.concatenate([run.knots["velocity"], run.events["velocity_before"]])
        speed = float(np.hypot(*seen.T).max())
        way = speed * machine.step_of(engine)
    aligned = engine == "contact" or (machine.align and not machine.interact)
    return Stepping(
        dt=machine.step_of(engine),
        aligned=aligned,
        speed=speed,
        way=way,
        bound=bound,
        longest=bound / speed if speed else None,
        safe=aligned or way is None or way < bound,
    )


FEWEST = 0.1
"""If a trial covers a smaller share of the run, its time is only a lower bound."""

SPREAD = 3.0
"""If two estimates differ by a larger factor, neither is reported."""

LATE = 0.4
"""Weight of the pace at the trial's end against that of the whole trial, in logarithms. Of 76
random crowds that were cut off after 0.1 s, one in ten takes at least 4 times as long as the pace
of the whole trial says, and one in ten at most a ninth of what the pace at its end says."""

CROWDED = 2.0
"""Factor by which a particle of a crowd takes longer to land or settle than one alone, about."""

REST = 2e-10
"""s; time between the last bounces before rest, about, in the exact engine."""


def peak() -> int:
    """Return the bytes that this process has had at its peak; 0 where that cannot be told."""
    try:
        from resource import RUSAGE_SELF, getrusage
    except ImportError:
        return 0
    return getrusage(RUSAGE_SELF).ru_maxrss * (1 if sys.platform == "darwin" else 1024)


def effort(machine: Machine, tried: Trial, setup: float, grown: int) -> Effort:
    """Tell from a trial what the whole run costs.

    Its set-up took so many s of processor time, and with the trial so many bytes of memory.
    """
    recording, least = tried.recording, round(PROGRAM) + grown
    if recording is None:
        how = "a trial run did not come to an end"
        return Effort(0, setup + tried.seconds, True, how, least)
    count, some = machine.count, recording.count
    if tried.trouble or (tried.whole and some == count):
        seconds = setup + tried.seconds + tried.warming
        how = "until it gets stuck" if tried.trouble else "measured in a complete run"
        memory = max(_memory(recording, machine, 1.0), least)
        return Effort(recording.contacts, seconds, False, how, memory)
    together = _together(recording)
    took = float(tried.marks[-1, 0])
    if recording.engine == "exact":
        guesses = [took * grown for grown in _bounces(recording)]
        share = took / max(guesses)
    elif some == count:
        guesses, share = _paces(tried, recording, _shares(tried, recording), together)
        if together and machine.until == "settled":
            # The run may also take all the time that the scene allows.
            later, _ = _paces(tried, recording, tried.marks[:, 1], together)
            guesses += later
    else:
        guesses, share = [took * count / some], 0.0
    spread = max(guesses) / min(guesses)
    known = spread <= SPREAD and (recording.engine == "exact" or share >= FEWEST)
    how = f"a trial run of {took:.1g} s covered {100.0 * share:.2g} % of the run"
    if some < count:
        how = f"a trial run with {some:,} of {count:,} particles"
    seconds = min(guesses) * spread**LATE if known else max(took, min(guesses) / 2.0)
    contacts = round(recording.contacts * seconds / took)
    if known and tried.lone is not None and stopped(tried.lone) is None:
        contacts = max(contacts, tried.lone.contacts * count)  # the first may have met nothing yet
    memory = max(_memory(recording, machine, seconds / took), least)
    return Effort(contacts, setup + seconds, not known, how, memory)


def _together(recording: Recording) -> bool:
    """Tell whether particles are stepped together; otherwise they run one after the other."""
    machine = recording.machine
    return machine.interact or (recording.engine == "pymunk" and not machine.align)


def _paces(
    tried: Trial, recording: Recording, shares: Floats, together: bool
) -> tuple[list[float], float]:
    """Return the run's time, s, estimated from the whole trial and from its second half.

    The latter grows with the number of particles that are there, if they are stepped together. And
    the share of the run that the trial got through; `shares` are those at its marks.
    """
    spent = tried.marks[:, 0]
    took, share = float(spent[-1] - spent[0]), float(shares[-1])
    if share <= shares[0]:
        return [tried.seconds, inf], 0.0
    half = int(np.searchsorted(spent - spent[0], 0.5 * took, side="right")) - 1
    gained, grown = float(share - shares[half]), 1.0
    now = float(recording.knots["t"].max(initial=0.0))
    if together and now > 0.0:
        first, last = recording.offsets[:-1], recording.offsets[1:] - 1
        gone = recording.released & (recording.ended != REASONS.index("stopped"))
        t, due = recording.knots["t"], recording.machine.releases.t
        life = float((t[last[gone]] - t[first[gone]]).mean()) if gone.any() else inf
        old = max(1, int(np.count_nonzero(due <= now - life)))
        leaving = min(1.0, int(np.count_nonzero(gone)) / old)

        def there(begin: float, end: float) -> float:
            """Return how many particles are there on average."""
            times = np.linspace(begin, end, 100)
            went = np.searchsorted(due, times - life, side="right")
            here = np.searchsorted(due, times, side="right") - leaving * went
            return float(np.maximum(here, 1.0).mean())

        grown = there(now, now / share) / there(now * float(shares[half]) / share, now)
    rest = 1.0 - share
    early = took / (share - float(shares[0])) * rest
    late = inf if gained <= 0.0 else 0.5 * took / gained * rest * grown
    return [float(spent[-1]) + early, float(spent[-1]) + late], share


def _shares(tried: Trial, recording: Recording) -> Floats:
    """Return the shares of the run that were done at the marks of a trial.

    An engine with steps counts in time up to the end that the scene allows. Where particles end
    when they have landed or settled, one by itself tells how long that takes, about.
    """
    shares, machine, lone = tried.marks[:, 1], recording.machine, tried.lone
    if machine.until == "time" or lone is None or stopped(lone) is not None:
        return shares
    life, end = float(np.ptp(lone.knots["t"])), machine.end_time
    if not _together(recording):
        done = np.floor(shares * machine.count).clip(max=machine.count - 1).astype(np.int64)
        part = (shares * machine.count - done) * (end - machine.releases.t[done])
        return np.minimum(1.0, (done + np.minimum(1.0, part / max(life, 1e-9))) / machine.count)
    # In a crowd it takes longer.
    over = min(end, float(machine.releases.t[-1]) + CROWDED * life)
    now = float(recording.knots["t"].max(initial=0.0))
    by_time = abs(now - shares[-1] * end) < 0.1 * now and now < over
    return shares * (end / over) if by_time else shares


def _bounces(recording: Recording) -> list[float]:
    """Return the ratio of the run's time to the trial's, for the exact engine, twice.

    Its particles run one after the other. The two values assume that bounces follow each other as
    much faster, or slower, than the last ones as their scatter allows.
    """
    under_way = np.flatnonzero(recording.released & recording.ended_by("stopped"))
    one = int(under_way[0] if len(under_way) else np.count_nonzero(recording.released) - 1)
    begun, track = one + 1, recording.track(one)
    if begun > 2:
        # Most have ended: they are alike.
        return [recording.count / begun, recording.count / (begun - 1)]
    if not len(track):
        return [recording.count / begun, inf]
    # Bounces to come of the one under way, as a share of all so far.
    end = float(np.broadcast_to(recording.machine.end_time, recording.count)[one])
    share, most = len(track) / len(recording.knots), ROUNDS / len(track)
    left = (min(more, most) * share for more in _left(track["t"], end))
    return [(1.0 + more) * recording.count / begun for more in left]


def _left(times: Floats, end: float) -> tuple[float, float]:
    """Return how many times as many knots as there are at `times` (s) come until the end, twice.

    Bounces that lose a share of their speed get shorter like a geometric series, and those that
    lose nothing do not.
    """
    t = np.unique(times)
    count, rest = len(t) - 1, end - float(t[-1])
    if rest <= 0.0:
        return 0.0, 0.0
    if count < 16:
        return 0.0, inf
    places = np.linspace(0.5 * count, count, 9).astype(np.int64)
    each = np.diff(t[places]) / np.diff(places)
    (slope, middle), scatter = np.polyfit(np.arange(8.0) - 3.5, np.log(each), 1, cov=True)
    error = 2.0 * float(np.sqrt(scatter[0, 0]))
    found = []
    for q in (slope - error, slope + error):
        last = float(np.exp(middle + 3.5 * q))
        # j further stretches take last (e^q + ... + e^(j q)).
        taken = 16.0 * rest / (last * count)
        j = taken
        if abs(q) > 1e-9:
            inside = taken * -np.expm1(-q)
            j = log1p(inside) / q if inside > -1.0 else inf
            if q < 0.0 and last > REST:
                j = min(j, log(REST / last) / q)
        found.append(float(j) / 16.0)
    return min(found), max(found)


RECORDED = 3.2
"""Bytes of memory at the peak per byte of knots and events: as recorded, sorted and joined."""

OWN = {"exact": 500.0, "contact": 20e3, "pymunk": 10e3}
"""Bytes that an engine sets up for a particle."""

PROGRAM = 75e6
"""Bytes of the program itself."""


def _memory(recording: Recording, machine: Machine, grown: float) -> int:
    """Return the bytes that a run takes at its peak, if it records `grown` times as much."""
    written = len(recording.knots) * KNOT.itemsize + len(recording.events) * EVENT.itemsize
    own = OWN[recording.engine] * machine.count
    return round(PROGRAM + own + RECORDED * grown * written)
