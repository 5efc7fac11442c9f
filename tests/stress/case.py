"""`Case`: a scene that is hard on an engine, and what is asked of it besides the laws for all."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from typing import Any

from chutelab.checks.stress import Evidence, Verdict
from chutelab.scene import from_dict
from chutelab.util.arrays import Floats

Tables = Mapping[str, Any]
Map = Callable[[Floats], Floats]

ENGINES = ("exact", "contact", "pymunk", "fixed")
"""``fixed`` is pymunk with run.align = false: every step lasts dt."""

LONE, CROWD = ("exact", "contact", "pymunk"), ("contact", "pymunk")
"""Those that follow particles which do not meet, and which do."""

STEPS = (1e-3, 1.0 / 30.0)
"""s; the default, and two frames of a game."""

PATIENCE = 20.0
"""s of processor time that one run may take."""


@dataclass(frozen=True)
class Twin:
    """The same machine in another place; what happens must be the same.

    Attributes
    ----------
    law : str
        Name of the symmetry.
    tables : mapping
        The twin's scene.
    back : callable
        Maps the twin's positions (..., 2) to the original's.
    bound : float or None
        m; None: what rounding, magnified by contacts, explains.
    particle : int
        Which of the twin's particles is compared with particle 0, or -1: each with its like.
    """

    law: str
    tables: Tables
    back: Map
    bound: float | None = None
    particle: int = -1


@dataclass(frozen=True)
class Case:
    """A scene, its engines and steps, and what is asked of it besides the laws for all.

    Attributes
    ----------
    name : str
        Short: it is part of test ids.
    group : str
        What is being stressed.
    tables : mapping
        The scene, as `chutelab.scene.from_dict` takes it.
    engines : tuple of str
        Which of `ENGINES` it is run on.
    steps : tuple of float
        Steps of the stepped ones, s.
    formula : callable or None
        A law of its own: a closed formula.
    refusals : mapping of str to str
        Engines that must refuse the scene, and the key that they have to name.
    may_refuse : mapping of str to str
        Engines that may do so instead of keeping the laws.
    driven : tuple of str
        Engines that have to tell that belts drive its particle to and fro without end.
    unpromised : mapping of str to str
        Engines that do not promise to keep the laws here, and why: the test is skipped.
    ends : tuple of str
        How particles may end, empty: in any way.
    inside : tuple of float or None
        Left, right, bottom and top (m) that no centre may leave.
    at_rest : bool
        Whether everything must lie still, not sunk in, at the end.
    twin
        See there.
    slow : tuple of str
        Engines on which it takes too long for the default run, at its finest step.
    patience : float
        s of processor time that one run may take.
    """

    name: str
    group: str
    tables: Tables
    engines: tuple[str, ...] = LONE
    steps: tuple[float, ...] = STEPS
    formula: Callable[[Evidence], Verdict | None] | None = None
    refusals: Mapping[str, str] = field(default_factory=dict)
    may_refuse: Mapping[str, str] = field(default_factory=dict)
    driven: tuple[str, ...] = ()
    unpromised: Mapping[str, str] = field(default_factory=dict)
    ends: tuple[str, ...] = ()
    inside: tuple[float, float, float, float] | None = None
    at_rest: bool = False
    twin: Twin | None = None
    slow: tuple[str, ...] = ()
    patience: float = PATIENCE

    def but(self, **changes):
        """Return the case with some attributes changed."""
        return replace(self, **changes)


def by_name(engine):
    """Return what run.engine calls one of `ENGINES`."""
    return "pymunk" if engine == "fixed" else engine


def scene_of(tables, name, engine, dt):
    """Validate a scene for an engine and a step; one kind of particles has 4 mm if not told."""
    run = {"loads": 1000.0, **tables.get("run", {})}
    run["engine"] = by_name(engine)
    if dt is not None:
        run["dt"] = dt
    if engine == "fixed":
        run["align"] = False
    particle = tables.get("particle", {})
    if isinstance(particle, dict):
        particle = {"radius": 0.004, **particle}
    return from_dict({"title": name, **tables, "particle": particle, "run": run}, name)


def merged(*tables):
    """Lay tables over each other, key by key; lists and numbers of the later ones win."""
    out = {}
    for layer in tables:
        for key, value in layer.items():
            old = out.get(key)
            out[key] = {**old, **value} if isinstance(old, dict) else value
    return out


def surface(name, *points, restitution=0.5, friction=0.3, speed=0.0):
    """Return the table of a free surface."""
    return {
        "name": name,
        "points": [list(point) for point in points],
        "restitution": restitution,
        "friction": friction,
        "speed": speed,
    }


def thrown(at, velocity, **stream):
    """Return the table of a stream released at a point."""
    return {"stream": {"at": list(at), "velocity": list(velocity), **stream}}


TRANSFER = {
    "incoming": {"speed": 2.0, "pulley_radius": 0.1},
    "plate": {"distance": 0.5, "restitution": 0.5},
    "outgoing": {"drop": 0.5, "drop_from": "top"},
}
"""Belt, plate, belt: the machine that all of this is about."""
