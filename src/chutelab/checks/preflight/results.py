"""What a look at a scene finds: what is built and skipped, and what the closed form covers."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import astuple, dataclass
from math import isfinite
from typing import Any

import numpy as np

from chutelab.machine import Machine, Pieces
from chutelab.results import Recording
from chutelab.results.summary import air_drag
from chutelab.scene import Scene
from chutelab.scene.quantities import THEORY
from chutelab.scene.units import write_size
from chutelab.theory import Reason, drag, predict
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
    aligned: bool  # blows are met at their own instants: nothing is passed through at any speed
    speed: float | None  # highest in the trial run, m/s; None if there was none
    way: float | None  # of a particle in a step at that speed, m
    bound: float  # what it must stay below if steps are not aligned: the radius, m
    longest: float | None  # step with which it would, s
    safe: bool  # no particle can pass through a surface unseen

    def rows(self) -> list[tuple[str, str]]:
        """Return it in words, under headings."""
        longest = write_size(self.dt, "s")
        if self.aligned:
            return [
                ("steps", f"at most {longest} while contacts last"),
                ("tunnelling", "none at any speed: blows have their own instants"),
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
class Effort:
    """What a run is expected to cost."""

    contacts: int  # impacts and collisions, about
    seconds: float  # processor time of a run here and now, about
    at_least: bool  # how much cannot be told: all are lower bounds
    how: str  # what the estimate rests on
    memory: int  # bytes that a run needs at its peak, about


@dataclass(frozen=True)
class Coverage:
    """What the closed form has to say of a scene."""

    covers: tuple[str, ...]  # the paper's symbols that it gives
    leaves_out: tuple[str, ...]  # and those that it does not
    reason: str  # why it stops, as `chutelab.theory` has it; "" if it does not
    words: str  # the same for people


@dataclass(frozen=True)
class Advice:
    """Something that works but may surprise, and what would change it."""

    warning: str
    change: str  # what to do, in words
    settings: Mapping[str, Any]  # the same for `Scene.with_values`; empty if none is known to help


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
        # Two digits of contacts and memory and one of the time are known.
        contacts = int(float(f"{self.effort.contacts:.2g}"))
        lasts = write_size(float(f"{self.effort.seconds:.1g}"), "s", digits=6)
        rows.append(("contacts", f"{about} {contacts:,}"))
        rows.append(("run time", f"{about} {lasts}; {self.effort.how}"))
        rows.append(("memory", f"{about} {float(f'{self.effort.memory / 1e6:.2g}'):,.0f} MB"))
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


WORDS = {
    Reason.OUTSIDE: "The paper's equations are about another machine",
    Reason.EARLY: "The equations stop short of a contact they know nothing of",
    Reason.NO_IMPACT: "The particle flies past the plate, and the equations end with the flight",
    Reason.SECOND: "After the plate it meets something else before it lands",
    Reason.MISSES: "It does not come down on the outgoing belt",
}
"""What a reason means, in words for a first look at the scene."""


def coverage(scene: Scene) -> Coverage:
    """Ask the theory about a scene; it speaks of particle 0."""
    found, lone = predict(scene), scene.count == 1
    given = tuple(name for name in THEORY if isfinite(float(getattr(found, name))))
    reason = str(found.reason)
    kind = Reason.of(reason)
    words = "All of the transfer, belt to belt."
    if kind is not None:
        words = f"{WORDS[kind]}: {reason.partition(': ')[2]}."
    if given and not lone:
        words += " It speaks of particle 0 only."
    if "belt_work" in given and not (lone and scene.run.until == "settled"):
        words += " A simulation has belt_work and slip_heat to compare in a run"
        words += " until settled." if lone else " of one particle until settled."
    return Coverage(given, tuple(name for name in THEORY if name not in given), reason, words)


MANY = 12
"""Pieces of one surface that are listed; of more only how many they are."""


def built(machine: Machine) -> Iterator[Part]:
    """Yield the parts of a machine, world frame."""
    for index, surface in enumerate(machine.surfaces):
        mine = [part.of(part.surface == index) for part in machine.parts]
        count = sum(len(part.surface) for part in mine)
        if count > MANY:
            points = np.round(np.concatenate([part.corners for part in mine]), 12) + 0.0
            (x0, y0), (x1, y1) = points.min(axis=0), points.max(axis=0)
            box = f"from ({x0:.6g}, {y0:.6g}) to ({x1:.6g}, {y1:.6g}) m"
            yield Part(surface, f"{count} pieces, {box}")
            continue
        for part in mine:
            for piece in map(part.of, range(len(part.surface))):
                yield Part(surface, piece.where() + _moves(piece))
        if machine.pulley is not None and machine.pulley.surface == index:
            yield Part("pulley", f"radius {machine.pulley.radius:.6g} m, axis at (0, 0)")
    for thread in machine.threads:
        x, y = thread.anchor
        held = f"({x:.6g}, {y:.6g}) m to particle {thread.particle}, {thread.length:.6g} m long"
        yield Part("string", f"from {held}")
    yield from _kinds(machine)
    yield from _releases(machine)


def _moves(piece: Pieces) -> str:
    """Say how fast a piece of a surface moves, and when it is there."""
    said = f", moving at {piece.speed:.6g} m/s" if piece.speed else ""
    if np.isfinite(piece.appears):
        said += f", from t = {piece.appears:.6g} s"
    if np.isfinite(piece.vanishes):
        said += f", until t = {piece.vanishes:.6g} s"
    return said


def _kinds(machine: Machine) -> Iterator[Part]:
    """Yield what particles there are, kind by kind."""
    for n, kind in enumerate(machine.scene.particles):
        which = (machine.releases.kind == n).nonzero()[0]
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


def _span(values: Floats, name: str, unit: str) -> str:
    low, high = values.min(), values.max()
    to = f" to {high:.6g}" if high > low else ""
    return f"{name} {low:.6g}{to} {unit}"


def _releases(machine: Machine) -> Iterator[Part]:
    """Yield where each stream begins, and when it ends."""
    releases = machine.releases
    for n, name in enumerate(machine.streams):
        which = (releases.stream == n).nonzero()[0]
        (x, y), (vx, vy) = releases.position[which[0]], releases.velocity[which[0]]
        first, last = releases.t[which[0]], releases.t[which[-1]]
        begin = f" at t = {first:.6g} s" if first else ""
        end = f", the last at t = {last:.6g} s" if len(which) > 1 else ""
        where = f"the first from ({x:.6g}, {y:.6g}) m at ({vx:.6g}, {vy:.6g}) m/s"
        yield Part("release" if len(machine.streams) == 1 else name, f"{where}{begin}{end}")


def skipped(
    scene: Scene, machine: Machine, engine: str, recording: Recording | None
) -> Iterator[Part]:
    """Yield what the scene does without, and why; `recording` is a trial run of it."""
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
        yield Part("flights", "only contacts that last are stepped, blows have their own instants")
    if machine.until == "landed":
        yield Part("what follows", 'the first touch of the outgoing belt: run.until = "landed"')
    air = drag(scene, predict(scene), 0.0) if recording is None else air_drag(recording)
    if air is not None:
        yield Part("air", str(air).replace("air drag, left out, would be", "its drag would be"))
