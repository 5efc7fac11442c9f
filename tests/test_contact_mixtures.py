"""The contact engine on machines drawn at random from all parts that disks can meet."""

from __future__ import annotations

from dataclasses import replace
from math import cos, inf, pi, sin

import numpy as np
import pytest

import chutelab
from chutelab.engines.contact import run
from chutelab.results import REASONS, Kind
from chutelab.results.ledger import ledger
from chutelab.scene import load
from machines import bent, face, gated, of_sizes, scene_of, thrown

INSIDE = 0.03
"""Radii that nothing may be in another or in a surface."""


class Draw:
    """A closed container with ramps, spoons, pegs, a conveyor and gates, and a mixture in it."""

    def __init__(self, seed):
        self.rng = np.random.default_rng(seed)
        self.drum = bool(self.rng.integers(2))
        self.kinds = int(self.rng.integers(1, 4))
        self.end = 1.2
        self.machine = self._surfaces()
        self.machine = self._mixture(self.machine)

    def uniform(self, low, high):
        return float(self.rng.uniform(low, high))

    def _values(self):
        return {"restitution": self.uniform(0.0, 1.0), "friction": self.uniform(0.0, 1.0)}

    def _surfaces(self):
        """Build the unit container, |x| <= 1, and what is in it, away from the particles' start."""
        flat, arcs, gates = [], [], {}
        if self.drum:
            arcs.append({"center": (0.0, 0.0), "radius": 1.0, "begin": self.uniform(-3.0, 3.0),
                         "extent": 2.0 * pi, "speed": self.uniform(-1.0, 1.0),
                         **self._values()})  # fmt: skip
        else:
            corners = np.array([[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0], [-1.0, -1.0]])
            flat += [face(f"wall-{n}", corners[n].tolist(), corners[n + 1].tolist(),
                          **self._values()) for n in range(4)]  # fmt: skip
        for n in range(int(self.rng.integers(0, 4))):
            middle, angle = self.rng.uniform(-0.5, 0.5, 2) - [0.0, 0.3], self.uniform(0.0, pi)
            along = self.uniform(0.1, 0.3) * np.array([cos(angle), sin(angle)])
            if self.rng.integers(2):
                gates[len(flat)] = sorted(self.rng.uniform(0.0, self.end, 2))
            flat.append(face(f"ramp-{n}", (middle - along).tolist(), (middle + along).tolist(),
                             speed=self.uniform(-1.0, 1.0), **self._values()))  # fmt: skip
        for n in range(int(self.rng.integers(0, 4))):
            wide = self.rng.integers(2)
            appears, vanishes = (
                sorted(self.rng.uniform(0.0, self.end, 2)) if n == 2 else (-inf, inf)
            )
            radius, extent = self.uniform(0.05, 0.3), self.uniform(0.3, 6.0 if wide else pi)
            center, begin = self.rng.uniform(-0.5, 0.5, 2) - [0.0, 0.3], self.uniform(-pi, pi)
            values = {"speed": self.uniform(-0.5, 0.5), **self._values()}
            arcs.append({"center": center, "radius": radius, "begin": begin, "extent": extent,
                         "appears": appears, "vanishes": vanishes, **values})  # fmt: skip
            # A tangential ramp goes on from its first end, which points clockwise.
            first = center + radius * np.array([cos(begin), sin(begin)])
            onward = first + self.uniform(0.1, 0.3) * np.array([sin(begin), -cos(begin)])
            if n == 0:
                flat.append(face("spoon", onward.tolist(), first.tolist(), **values))
        arcs += [
            {"name": "pegs", "center": self.rng.uniform(-0.6, 0.6, 2) - [0.0, 0.3],
             "radius": self.uniform(0.01, 0.05), "begin": 0.0, "extent": 2.0 * pi,
             **self._values()}
            for _ in range(int(self.rng.integers(0, 20)))
        ]  # fmt: skip
        flat = flat or [face("far", (-9.0, -5.0), (9.0, -5.0))]
        machine = scene_of(surface=flat, stream={"count": 2, "interact": True, "rate": 1.0,
                                                 "bed_height": 1.0, "at": [0.0, 3.0]},
                           run={"until": self.end})  # fmt: skip
        for piece, (appears, vanishes) in gates.items():
            machine = gated(machine, piece, appears, vanishes)
        return bent(machine, *arcs) if arcs else machine

    def _mixture(self, machine):
        """Put particles in a lattice in the upper part of the container, where no surface is."""
        small = self.uniform(0.006, 0.012)
        ratio = 10.0 ** self.uniform(0.0, 1.0 if small < 0.008 else 0.5)
        pitch = 2.1 * small * ratio
        x, y = np.meshgrid(np.arange(-0.6, 0.6, pitch), np.arange(0.0, 0.6, pitch))
        place = np.stack([x.ravel(), y.ravel()], axis=1)
        radius = small * ratio ** self.rng.uniform(0.0, 1.0, len(place))
        free = depths(machine, place, radius, 0.0, always=True) <= 0.0
        place, radius = place[free][:70], radius[free][:70]
        n = len(place)
        velocity = self.rng.normal(0.0, 1.0, (n, 2))
        mass = 2000.0 * radius**3 * 10.0 ** self.rng.uniform(-0.5, 0.5, n)
        share = self.rng.choice([0.0, 0.4, 0.5], n)
        k = self.kinds
        rest, rub = self.rng.uniform(0.0, 1.0, (2, k, k))
        rolling = self.rng.choice([0.0, 0.05, 0.3], k)
        machine = thrown(machine, place, velocity)
        machine = of_sizes(
            machine, radius, mass, share, self.rng.integers(0, k, n), rolling=rolling,
            pair_restitution=0.5 * (rest + rest.T), pair_friction=0.5 * (rub + rub.T),
        )  # fmt: skip
        if k > 1:
            parts = {}
            for name in ("segments", "arcs"):
                part = getattr(machine, name)
                spread = self.rng.uniform(0.5, 1.0, (2, k, 1))
                parts[name] = replace(part, restitution=spread[0] * part.restitution,
                                      friction=spread[1] * part.friction)  # fmt: skip
            machine = replace(machine, **parts)
        late = self.rng.permutation(n) < n // 3
        t = np.where(late, self.rng.uniform(0.0, 0.3, n), 0.0)
        return replace(machine, releases=replace(machine.releases, t=t), interact=True)


def distances(machine, place):
    """Distance (P, N) of points (N, 2) to each segment and arc, m."""
    found, segments, arcs = [], machine.segments, machine.arcs
    for start, tangent, length in zip(
        segments.start, segments.tangent, segments.length, strict=True
    ):
        along = np.clip((place - start) @ tangent, 0.0, length)
        found.append(np.hypot(*(place - start - along[:, None] * tangent).T))
    for center, radius, begin, extent in zip(
        arcs.center, arcs.radius, arcs.begin, arcs.extent, strict=True
    ):
        x, y = (place - center).T
        angle = np.mod(np.arctan2(y, x) - begin, 2.0 * pi)
        # Beyond the arc the nearer end is the nearest point.
        beyond = np.where(angle - extent < 2.0 * pi - angle, extent, 0.0)
        angle = begin + np.where(angle <= extent, angle, beyond)
        found.append(np.hypot(x - radius * np.cos(angle), y - radius * np.sin(angle)))
    return np.array(found)


def depths(machine, place, radius, t, spared=None, *, always=False):
    """Return how deep disks (N,) are in the worst surface that is there at t, in radii."""
    there = np.ones(len(machine.segments.length) + len(machine.arcs.radius), dtype=bool)
    if not always:
        appears = np.append(machine.segments.appears, machine.arcs.appears)
        vanishes = np.append(machine.segments.vanishes, machine.arcs.vanishes)
        there = (appears <= t) & (t <= vanishes)
    deep = 1.0 - distances(machine, place) / radius
    deep[~there] = -inf
    if spared is not None:
        deep[spared] = -inf
    return deep.max(axis=0)


def faults(draw, recording):
    """Return what a run did that none may do."""
    machine, found = draw.machine, []
    radius = machine.particle.radius
    unexplained = ledger(recording).relative_residual
    if not unexplained <= 1e-10:
        found.append(f"ledger: {unexplained:.1e}")
    # Who is in a gate when it shuts is not touched by it: left out with that gate from then on.
    appears = np.append(machine.segments.appears, machine.arcs.appears)
    spared = np.zeros((len(appears), machine.count), dtype=bool)
    for piece in np.flatnonzero(np.isfinite(appears)):
        x = recording.at([appears[piece]])[0][0]
        spared[piece] = distances(machine, x)[piece] < radius
    for t in np.linspace(1e-3, 0.999 * draw.end, 500):
        x = recording.at([t])[0][0]
        here = np.flatnonzero(np.isfinite(x[:, 0]))
        deep = depths(machine, x[here], radius[here], t, spared[:, here])
        found += [
            f"{t:.4g} s: {here[k]} in a surface by {deep[k]:.2g} r"
            for k in np.flatnonzero(deep > INSIDE)
        ]
        gap = np.hypot(*np.moveaxis(x[here][:, None] - x[here], -1, 0))
        least = np.minimum.outer(radius[here], radius[here])
        deep = (np.add.outer(radius[here], radius[here]) - gap) / least
        np.fill_diagonal(deep, -inf)
        if deep.max() > INSIDE:
            i, j = here[list(np.unravel_index(deep.argmax(), deep.shape))]
            found.append(f"{t:.4g} s: {i} in {j} by {deep.max():.2g} r")
    last = recording.ends()[1]["position"]
    away = np.hypot(*last.T) if draw.drum else np.abs(last).max(axis=1)
    out = np.flatnonzero(~(away < 1.0))
    return found + [f"{i} is out of the container" for i in out]


def check(seed):
    draw = Draw(seed)
    recording = run(draw.machine)
    assert {REASONS[k] for k in recording.ended} == {"time"}
    assert faults(draw, recording) == []


# 16, 182, 371: moving surfaces draw disks into wedges; 171: another disk knocks on a sunk one.
@pytest.mark.parametrize("seed", [0, 1, 2, 16, 171])
def test_mixtures_obey_the_laws_of_contact(seed):
    check(seed)


@pytest.mark.slow
@pytest.mark.parametrize("seed", [*range(3, 16), *range(17, 63), 182, 371])
def test_sixty_mixtures_obey_the_laws_of_contact(seed):
    check(seed)


@pytest.mark.parametrize("name", ["galton", "rock-box"])
def test_in_a_crowd_who_parts_from_a_surface_does_so_on_its_track(name):
    recording = chutelab.simulate(load(name, ["stream.count=40"]))
    events = recording.events[recording.events["kind"] == Kind.SEPARATION]
    assert len(events) > 40
    places = np.stack([recording.at([e["t"]])[0][0, e["particle"]] for e in events])
    # NaN, before the release, is no place.
    assert np.hypot(*(places - events["position"]).T).max() < 1e-3 * 0.003
