"""Machines that several test files run."""

from __future__ import annotations

from dataclasses import replace
from math import cos, inf, sin

import numpy as np

from chutelab.core import Module
from chutelab.machine import Arcs, Particle, build
from chutelab.machine.builder import lay
from chutelab.scene import from_dict

PERPENDICULAR = """
[incoming]
speed = 2.0
pulley_radius = 0.1
[plate]
distance = 0.5
[outgoing]
drop = 0.5
"""

MOVING_CORNER = {
    "particle": {"radius": 0.05, "spin": True},
    "surface": [
        {"name": "floor", "from": [-1.0, 0.0], "to": [1.0, 0.0], "speed": 1.0, "friction": 0.5},
        {"name": "wall", "from": [0.5, 0.0], "to": [0.5, 1.0], "friction": 0.5},
    ],
    "stream": {"at": [0.0, 0.06], "velocity": [0.0, 0.0]},
    "run": {"until": 3.0},
}
"""A spinning disk held between a moving surface and another: beyond the exact engine."""

SCENE = {
    "particle": {"radius": 0.01, "mass": 0.1, "spin": True},
    "stream": {"at": [0.0, 1.0], "velocity": [0.0, 0.0]},
    "run": {"until": 1.0, "max_time": 100.0},
}


def scene_of(**tables):
    """Return a machine: `SCENE` with other tables, or with keys of its tables replaced."""
    document = {name: dict(values) for name, values in SCENE.items()}
    for name, values in tables.items():
        if isinstance(values, dict):
            document.setdefault(name, {}).update(values)
        else:
            document[name] = values
    return build(from_dict(document))


def in_a_box(random, surfaces):
    """Return a scene of particles that fall on to surfaces, all of them in a box without a lid."""
    box = [
        {"name": "floor", "from": [-0.4, -0.3], "to": [0.4, -0.3]},
        {"name": "left", "from": [-0.4, -0.3], "to": [-0.4, 0.5]},
        {"name": "right", "from": [0.4, -0.3], "to": [0.4, 0.5]},
    ]
    return {
        "particle": {"radius": random.uniform(0.006, 0.012), "mass": 0.008,
                     "spin": bool(random.integers(2))},
        "surface": [*box, *surfaces],
        "stream": {"fill": [[-0.2, 0.18], [0.2, 0.5]], "count": int(random.integers(1, 25)),
                   "interact": True},
        "run": {"until": 1.0},
    }  # fmt: skip


def nominal(scene):
    """Return where free flight of the nominal particle begins, its velocity, and where it hits."""
    found = lay(Module(), scene, scene.met(scene.kinds[0], "incoming")[1])[1]
    return found["position"], found["velocity"], found["hit"]


def face(name, start, end, **values):
    return {"name": name, "from": list(start), "to": list(end), **values}


def thrown(machine, position, velocity=(0.0, 0.0), t=0.0):
    """Return the machine with disks (N, 2) released where told, all at once; two or more meet."""
    position = np.array(position, dtype=float).reshape(-1, 2)
    count = len(position)
    releases = replace(
        machine.releases,
        t=np.full(count, t, dtype=float),
        position=position,
        velocity=np.broadcast_to(np.array(velocity, dtype=float), position.shape).copy(),
        carried=np.zeros(count, dtype=bool),
        omega=np.zeros(count),
        angle=np.zeros(count),
        stream=np.zeros(count, dtype=np.int64),
        kind=np.zeros(count, dtype=np.int64),
    )
    return boxed(replace(machine, releases=releases, interact=count > 1))


def boxed(machine):
    """Return the machine with the boxes of its particles round all that it has now, and 1 m."""
    arcs, place = machine.arcs, machine.releases.position
    corners = [machine.segments.start, machine.segments.end]
    for share in np.linspace(0.0, 1.0, 361):
        angle = arcs.begin + share * arcs.extent
        way = np.stack([np.cos(angle), np.sin(angle)], axis=1)
        corners.append(arcs.center + arcs.radius[:, None] * way)
    wheel = machine.pulley.radius if machine.pulley else None
    corners += [np.array([[-wheel, -wheel], [wheel, wheel]])] if wheel else []
    corners += [place] if machine.interact else []
    corners = np.concatenate(corners)
    low = np.minimum(corners.min(axis=0, initial=inf), place) - 1.0
    high = np.maximum(corners.max(axis=0, initial=-inf), place) + 1.0
    if machine.gravity:
        low[:, 0], high[:] = -inf, inf
    box = np.concatenate([low, high], axis=1)
    return replace(machine, releases=replace(machine.releases, exit_box=box))


def bent(machine, *arcs):
    """Return the machine with arcs, each a surface of its own unless it has the name of another.

    Each is a mapping of center, radius, begin and extent, and maybe name, speed, restitution,
    friction, appears and vanishes.
    """
    usual = {
        "speed": 0.0, "restitution": 0.0, "friction": 0.0, "appears": -inf, "vanishes": inf,
        "one_sided": 0,
    }  # fmt: skip
    rows = [{"name": f"arc {n}", **usual, **arc} for n, arc in enumerate(arcs)]
    names = tuple(dict.fromkeys([*machine.surfaces, *(row.pop("name") for row in rows)]))
    owner = [names.index(arc.get("name", f"arc {n}")) for n, arc in enumerate(arcs)]
    columns = {name: np.array([row[name] for row in rows], dtype=float) for name in rows[0]}
    arcs = Arcs(**columns, surface=np.array(owner))
    return boxed(loose(replace(machine, surfaces=names, arcs=arcs)))


def loose(machine):
    """Return the machine without cohesion, of its own number of kinds and surfaces."""
    kinds = len(machine.pair_restitution)
    return replace(machine, cohesion=np.zeros((kinds, kinds + len(machine.surfaces))))


def gated(machine, piece, appears=-inf, vanishes=inf):
    """Return the machine with a segment that is there from one time to another only."""
    came, went = machine.segments.appears.copy(), machine.segments.vanishes.copy()
    came[piece], went[piece] = appears, vanishes
    return replace(machine, segments=replace(machine.segments, appears=came, vanishes=went))


def of_sizes(machine, radius, mass, share=0.0, kind=None, **tables):
    """Return the machine with radii (N,) and masses (N,), I = share m r^2, and tables by kind."""
    radius, mass, share = np.broadcast_arrays(radius, mass, share)
    particle = Particle(radius.copy(), mass.copy(), share * mass * radius**2)
    releases = machine.releases
    if kind is not None:
        releases = replace(releases, kind=np.array(kind))
    return loose(replace(machine, particle=particle, releases=releases, **tables))


def box(count, seed, side, *, radius=0.02, friction=0.0, spin=False, end=1.0, dt=1e-3):
    """A gas: disks in a square lattice in an elastic box, velocities of variance 1 m²/s²."""
    corners = [[0.0, 0.0], [side, 0.0], [side, side], [0.0, side], [0.0, 0.0]]
    machine = scene_of(
        gravity=0.0,
        particle={"radius": radius, "spin": spin},
        surface=[{"name": "box", "points": corners, "restitution": 1.0, "friction": 0.0}],
        stream={"count": 2, "at": [0.5 * side, 0.5 * side], "interact": True, "restitution": 1.0,
                "friction": friction, "bed_height": 0.4 * side, "rate": 1e-3},
        run={"until": end, "max_time": end, "dt": dt},
    )  # fmt: skip
    rows = int(np.ceil(np.sqrt(count)))
    place = (np.stack(np.divmod(np.arange(count), rows), axis=1) + 0.5) * side / rows
    return thrown(machine, place, np.random.default_rng(seed).normal(size=(count, 2)))


WHEEL, BELT, LENGTH = 0.5, 2.0, 0.5
"""m, m/s, m: a pulley, its belt, and how far before the pulley's axis a disk is put on it."""


def over_the_pulley(radius, friction, spin, speed, **run):
    """A disk put on a Coulomb belt at a speed."""
    return scene_of(
        particle={"radius": radius, "spin": spin},
        incoming={"speed": BELT, "pulley_radius": WHEEL, "friction": friction},
        stream={"at": [-LENGTH, WHEEL + radius], "velocity": [speed, 0.0]},
        run=run,
    )


SLIDES = [
    {"speed": 0.5, "belt": 2.0, "friction": 0.3},
    {"speed": 0.5, "belt": 2.0, "friction": 0.3, "spin": True},
    {"speed": 1.0, "slope": 0.3, "friction": 0.2},
    {"speed": 1.0, "slope": 0.3, "friction": 0.2, "spin": True},
    {"speed": 0.5, "slope": 0.6, "friction": 0.1, "belt": 1.5, "spin": True},
    {"speed": 0.0, "slope": 0.3, "friction": 0.5, "belt": -1.0},
]
"""Options of `ramp`."""


def ramp(*, speed, friction, belt=0.0, slope=0.0, spin=False, **run):
    """A disk put on a ramp or belt that falls by an angle (rad)."""
    along, up = np.array([cos(slope), -sin(slope)]), np.array([sin(slope), cos(slope)])
    surface = face(
        "ramp", (-20.0 * along).tolist(), (20.0 * along).tolist(), friction=friction, speed=belt,
        restitution=0.0,
    )  # fmt: skip
    return scene_of(
        particle={"radius": 0.02, "spin": spin},
        surface=[surface],
        stream={"at": (0.02 * up).tolist(), "velocity": (speed * along).tolist()},
        run=run,
    )
