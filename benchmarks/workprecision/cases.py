"""The cases of the benchmark: a machine or a few, what is known about them, and a method's error.

A stepping method may be right by luck, where a step happens to end at a contact. So the cases of
one particle are several machines whose belts and plates differ by millimetres, and the error is the
worst of them; times are those of the first. A crowd is chaotic and has no reference: its error is
how deep its particles overlap.

One particle starts where scene files start it, on 1 m of belt before the pulley. Particles of a
stream, whose upper layers no belt of Pymunk's would carry, start at the pulley's top.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from math import sqrt
from typing import Any

import numpy as np

from chutelab.machine import build
from chutelab.results import Kind, Recording
from chutelab.results.quantities import relative_error, scales
from chutelab.scene import Scene, from_dict
from chutelab.theory import predict, transfer
from chutelab.util.arrays import Floats

Answer = dict[str, Floats]

TRANSFER = ("t2", "y2", "t3", "x3", "v3x", "v3y")
"""Time and fall to the plate; from there time and way back to the landing, landing velocity."""

GRIP = ("t_grip", "x_grip")
"""Time (s) and way forward (m) from the landing to the end of the slip."""

BALL = {"radius": 0.004, "mass": 0.0021}
"""Of steel: a small one passes through what it meets in shorter steps than the scenes' default."""

REST = ("t_rest", "y_rest")
"""Time (s) from the release, and height (m), at which a bouncing particle lies still."""


class MissedError(ValueError):
    """A particle never got to where the case ends."""


@dataclass(frozen=True, eq=False)
class Reference:
    """What an answer should be, and by what errors are measured.

    Attributes
    ----------
    values : dict of ndarray, (N,)
        By quantity.
    sizes : dict of float
        Scale of each quantity, as `chutelab.results.quantities.relative_error` takes it.
    """

    values: Answer
    sizes: Mapping[str, float]


def of_transfer(recording: Recording) -> Answer:
    """Read the `TRANSFER` quantities of all particles off a recording."""
    left, hit, down = (
        _first(recording, kind, surface)
        for kind, surface in (
            (Kind.SEPARATION, "incoming"),
            (Kind.IMPACT, "plate"),
            (Kind.LANDING, "outgoing"),
        )
    )
    return {
        "t2": hit["t"] - left["t"],
        "y2": left["y"] - hit["y"],
        "t3": down["t"] - hit["t"],
        "x3": hit["x"] - down["x"],
        "v3x": -down["vx"],
        "v3y": -down["vy"],
    }


def of_grip(recording: Recording) -> Answer:
    """Read the `TRANSFER` and `GRIP` quantities off a recording of lone particles."""
    down = _first(recording, Kind.LANDING, "outgoing")
    held = _last(recording, Kind.STICK, "outgoing")
    return {
        **of_transfer(recording),
        "t_grip": held["t"] - down["t"],
        "x_grip": held["x"] - down["x"],
    }


def of_rest(recording: Recording) -> Answer:
    """Read the `REST` quantities off a recording."""
    begin = _first(recording, Kind.RELEASE, None)
    still = _last(recording, Kind.STICK, None)
    return {"t_rest": still["t"] - begin["t"], "y_rest": still["y"]}


def _first(recording: Recording, kind: Kind, surface: str | None) -> Answer:
    return _columns(recording, kind, surface, last=False)


def _last(recording: Recording, kind: Kind, surface: str | None) -> Answer:
    return _columns(recording, kind, surface, last=True)


def _columns(recording: Recording, kind: Kind, surface: str | None, *, last: bool) -> Answer:
    """Return time, place and incoming velocity of one event of each particle, (N,) each."""
    events = recording.select(kind, surface=surface)
    if last:
        events = events[::-1]
    events = recording.first(events)
    sources = {
        "t": events["t"],
        "x": events["position"][:, 0],
        "y": events["position"][:, 1],
        "vx": events["velocity_before"][:, 0],
        "vy": events["velocity_before"][:, 1],
    }
    columns = {name: np.full(recording.count, np.nan) for name in sources}
    for name, values in sources.items():
        columns[name][events["particle"]] = values
    return columns


def worst(answer: Answer, reference: Reference) -> tuple[float, str]:
    """Return the largest relative error of all particles and quantities, and whose it is.

    Raises
    ------
    MissedError
        If a particle has no answer where the reference has one.
    """
    largest, name = 0.0, ""
    for quantity, expected in reference.values.items():
        found = np.asarray(answer[quantity], dtype=np.float64)
        lost = int(np.count_nonzero(np.isfinite(expected) & ~np.isfinite(found)))
        if lost:
            who = "it" if len(expected) == 1 else f"{lost:,} of {len(expected):,}"
            raise MissedError(f"{who} never {_MISSED[quantity]}")
        size = reference.sizes[quantity]
        for one, other in zip(found.tolist(), expected.tolist(), strict=True):
            error = relative_error(one, other, size)
            if not error <= largest:
                largest, name = error, quantity
    return largest, name


_MISSED = (
    dict.fromkeys(("t2", "y2"), "met the plate")
    | dict.fromkeys(("t3", "x3", "v3x", "v3y"), "landed on the belt")
    | dict.fromkeys(GRIP, "got as fast as the belt")
    | dict.fromkeys(REST, "came to rest")
)

FRAME = 0.01
"""s between the frames in which overlaps are looked for."""

PERCENTILE = 99.0


def frames_of(recording: Recording) -> Floats:
    """Return places every `FRAME` seconds, (T, N, 2), NaN where a particle is not there."""
    _, last = recording.ends()
    end = float(last["t"].max())
    times = np.arange(1, 1 + round(end / FRAME)) * FRAME
    return recording.at(np.minimum(times, end))[0]


def overlaps(frames: Floats, radius: float) -> Floats:
    """Return by how much pairs of disks overlap, in radii, over all frames (T, N, 2).

    Only pairs that do are listed, once for each frame in which they do.
    """
    found = [np.empty(0)]
    for frame in frames:
        there = frame[np.isfinite(frame[:, 0])]
        there = there[np.argsort(there[:, 0], kind="stable")]
        # In the order of x, partners are at most a few places apart.
        for ahead in range(1, len(there)):
            apart = there[ahead:] - there[:-ahead]
            apart = apart[apart[:, 0] < 2.0 * radius]
            if not len(apart):
                break
            overlap = 2.0 - np.hypot(apart[:, 0], apart[:, 1]) / radius
            found.append(overlap[overlap > 0.0])
    return np.concatenate(found)


def typical(overlap: Floats) -> float:
    """Return the `PERCENTILE` of some overlaps, 0 of none."""
    return float(np.percentile(overlap, PERCENTILE)) if len(overlap) else 0.0


SHIFTS = (0.0, 0.0047, 0.0091, 0.0137, 0.0179)
"""m; how much farther the plate is, or higher the start. With 2 m/s, uneven parts of the way in the
longest step of 0.01 s."""

BELT_SHIFT = 0.7
"""How much longer the belt is, in shifts of the plate; so that no step ends at its end either."""

SIZES = {
    "t2": "time", "y2": "length", "t3": "time", "x3": "length", "v3x": "speed", "v3y": "speed",
    "t_grip": "time", "x_grip": "length",
}  # fmt: skip
"""What kind of quantity each is; see `chutelab.results.quantities.scales`."""

CROWD = 1000
"""Particles of the two cases with many."""


@dataclass(frozen=True, eq=False)
class Case:
    """A problem that every method is asked to solve.

    Attributes
    ----------
    name, title : str
        On the command line, and over a panel.
    error : str
        What its error is, in a sentence.
    scenes : tuple of Scene
        The machines; times are taken with the first.
    read : callable or None
        From a recording to the answer; None for the case that has no reference.
    reference : callable or None
        The answer of a scene in closed form.
    """

    name: str
    title: str
    error: str
    scenes: tuple[Scene, ...]
    read: Callable[[Recording], Answer] | None = None
    reference: Callable[[Scene], Reference] | None = None


def _machine(title: str, **changes: dict[str, Any]) -> Scene:
    """Return the shipped transfer, with the belt 1 m under the pulley's top, and changes."""
    tables: dict[str, dict[str, Any]] = {
        "particle": BALL,
        "incoming": {"speed": 2.0, "pulley_radius": 0.1},
        "plate": {"distance": 0.5, "restitution": 0.5, "below": 0.75},
        "outgoing": {"drop": 1.0, "drop_from": "top", "friction": 0.3},
        "stream": {},
        "run": {"until": "landed"},
    }
    for table, values in changes.items():
        tables[table] = {**tables[table], **values}
    return from_dict({"title": title, **tables}, title)


def _drop(shift: float) -> Scene:
    """Return a particle over a floor."""
    floor = {"name": "floor", "points": [(-1.0, 0.0), (1.0, 0.0)], "restitution": 0.5}
    tables = {
        "particle": BALL,
        "surface": [{**floor, "friction": 0.0}],
        "stream": {"at": (0.0, 0.5 + shift), "velocity": (0.0, 0.0)},
        "run": {"until": "settled"},
    }
    return from_dict({"title": "bounce to rest", **tables}, "bounce")


def of_one_transfer(scene: Scene) -> Reference:
    """Return the closed form's answer for one particle, `chutelab.theory.prediction`."""
    known = predict(scene)
    kinds = scales(scene, known)
    values = {name: np.array([float(getattr(known, name))]) for name in list(SIZES)[:6]}
    return Reference(values, {name: kinds[kind] for name, kind in SIZES.items()})


def of_one_grip(scene: Scene) -> Reference:
    """Return the same, and the slip on the belt.

    The landing, without restitution, presses with m v3y and so changes the velocity by up to
    µ v3y; what slip is left then goes at µ g, over (v_b² - v²) / (2 µ g).
    """
    flight = of_one_transfer(scene)
    assert scene.outgoing is not None
    mu, g, belt = float(scene.outgoing.friction), scene.gravity, scene.outgoing.speed
    landing, pressed = -float(flight.values["v3x"][0]), mu * float(flight.values["v3y"][0])
    after = min(landing + pressed, belt) if landing < belt else max(landing - pressed, belt)
    time = abs(belt - after) / (mu * g)
    slip = {"t_grip": np.array([time]), "x_grip": np.array([0.5 * (after + belt) * time])}
    return Reference({**flight.values, **slip}, flight.sizes)


def of_one_bounce(scene: Scene) -> Reference:
    """Return when infinitely many bounces end: 2 u ε / (g (1 - ε)) after the first, at y = r.

    Lengths are measured by the fall, times by the whole.
    """
    floor, r, g = scene.surface[0], scene.particle.radius, scene.gravity
    assert scene.stream.at is not None
    fall = scene.stream.at[1] - r
    speed = sqrt(2.0 * g * fall)
    time = speed / g + 2.0 * speed * floor.restitution / (g * (1.0 - floor.restitution))
    values = {"t_rest": np.array([time]), "y_rest": np.array([r])}
    return Reference(values, {"t_rest": time, "y_rest": fall})


def of_many_transfers(scene: Scene) -> Reference:
    """Return the closed form's answer for each particle of a stream that does not interact.

    A particle in a layer h up rides a pulley that is larger by h, in front of a plate that is
    nearer by as much.
    """
    belt, plate, out, r = scene.incoming, scene.plate, scene.outgoing, scene.particle.radius
    assert belt is not None
    assert plate is not None
    assert out is not None
    starts = build(scene).releases
    layer = starts.position[:, 1] - belt.pulley_radius - r
    machine: dict[str, Any] = {
        "speed": starts.velocity[:, 0],
        "pulley_radius": belt.pulley_radius + layer,
        "distance": plate.distance - layer,
        "restitution": plate.restitution,
        "belt_speed": out.speed,
        "particle_radius": r,
        "mass": scene.particle.mass,
        "gravity": scene.gravity,
    }
    flight = transfer(**machine)
    leaving = (belt.pulley_radius + layer + r) * np.cos(flight.phi1)
    lying = belt.pulley_radius - out.drop + r
    known = transfer(**machine, drop=leaving - flight.y2 - lying)
    kinds = scales(scene, predict(scene))
    values = {name: np.array(getattr(known, name)) for name in list(SIZES)[:6]}
    return Reference(values, {name: kinds[kind] for name, kind in SIZES.items()})


def cases() -> dict[str, Case]:
    """Return all cases by name, in the order in which they are shown."""
    top = (0.0, 0.104)
    shifted: list[dict[str, Any]] = [
        {"incoming": {"length": 1.0 + BELT_SHIFT * shift}, "plate": {"distance": 0.5 + shift}}
        for shift in SHIFTS
    ]
    return {
        case.name: case
        for case in (
            Case(
                "transfer",
                "Single transfer",
                "worst relative error of time and place at the plate, and of time, place and"
                " velocity at the landing",
                tuple(_machine("single transfer", **changes) for changes in shifted),
                of_transfer,
                of_one_transfer,
            ),
            Case(
                "bounce",
                "Bounce to rest",
                "worst relative error of the time and height at which it lies still",
                tuple(_drop(shift) for shift in SHIFTS),
                of_rest,
                of_one_bounce,
            ),
            Case(
                "belt",
                "Belt landing",
                "as the transfer, with time and way of the slip until the belt grips",
                tuple(
                    _machine("belt landing", **changes, run={"until": "settled"})
                    for changes in shifted
                ),
                of_grip,
                of_one_grip,
            ),
            Case(
                "independent",
                f"{CROWD:,} independent particles",
                "as the transfer, the worst of all particles",
                (
                    _machine(
                        "independent",
                        stream={"count": CROWD, "rate": 1000.0, "bed_height": 0.1, "at": top},
                    ),
                ),
                of_transfer,
                of_many_transfers,
            ),
            Case(
                "interacting",
                f"{CROWD:,} interacting particles",
                "99th percentile of the overlaps of particles, in radii: rigid ones have none",
                (
                    _machine(
                        "interacting",
                        stream={
                            "count": CROWD,
                            "rate": 400.0,
                            "bed_height": 0.05,
                            "at": top,
                            "interact": True,
                            "restitution": 0.8,
                            "friction": 0.3,
                        },
                        # Long enough for what is on the belt when the last one has landed.
                        outgoing={"length": 12.0},
                        run={"until": 3.1},
                    ),
                ),
            ),
        )
    }
