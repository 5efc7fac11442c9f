"""All cases.

Defined here are the cases that run twice (the machine far away, or in a mirror), and machines drawn
at random: a particle thrown into surfaces that cross, fold, move and grip.
"""

import numpy as np

from stress import extremes, geometry
from stress.case import LONE, Case, Twin, merged, surface, thrown

FAR = 1e6
"""m that machines are moved by; a double's ulp there is 1.2e-10 m."""

FAR_BOUND = 1e-9
"""m: eight ulps at `FAR`."""


def moved(tables, dx, dy):
    """Return a scene of free surfaces with everything moved by (dx, dy) m."""
    return _mapped(tables, lambda x, y: [x + dx, y + dy], 1.0)


def mirrored(tables):
    """Return a scene of free surfaces with x and -x exchanged."""
    return _mapped(tables, lambda x, y: [-x, y], -1.0)


def _mapped(tables, to, turn):
    stream = tables["stream"]
    vx, vy = stream["velocity"]
    surfaces = [{**s, "points": [to(*p) for p in s["points"]]} for s in tables["surface"]]
    return merged(
        tables,
        {"surface": surfaces, "stream": {"at": to(*stream["at"]), "velocity": [turn * vx, vy]}},
    )


def _machines():
    """Machines within 4 m left of and below the origin, at places that doubles hold exactly.

    So they can be moved by `FAR` in either direction without moving their parts against each other.
    """
    wall = surface("wall", (-1.0, -3.5), (-1.0, -1.0), friction=0.25)
    ramp = surface("ramp", (-3.5, -1.5), (-2.25, -2.0), restitution=0.25, friction=0.125)
    floor = surface("floor", (-3.75, -3.0), (-1.0, -3.0), restitution=0.5)
    belt = surface("belt", (-1.25, -3.0), (-3.75, -3.0), speed=1.5, restitution=0.25)
    slide = surface("slide", (-3.0, -2.5), (-2.0, -3.0), (-1.25, -3.0), friction=0.0)
    throw = thrown((-3.0, -1.0), (1.5, 0.0))
    disk = {"particle": {"radius": 1.0 / 64.0, "spin": True}, "run": {"until": 1.5}}
    still = merged(disk, {"particle": {"spin": False}})
    return {
        "flight": merged(still, throw, {"surface": [wall], "run": {"until": 0.5}}),
        "wall": merged(disk, throw, {"surface": [wall, floor], "stream": {"velocity": [4.0, 1.0]}}),
        "ramp": merged(disk, throw, {"surface": [ramp, floor, wall]}),
        "belt": merged(still, throw, {"surface": [belt]}),
        "slide": merged(still, {"surface": [slide], **thrown((-2.75, -2.5), (0.0, 0.0))}),
        "lying": merged(disk, {"surface": [floor], **thrown((-2.0, -3.0 + 1 / 64), (1.0, 0.0))}),
        "edge": merged(disk, {"surface": [floor], **thrown((-1.25, -3.0 + 1 / 64), (0.5, 0.0))}),
        "weightless": merged(
            disk, throw, {"surface": [wall, floor], "gravity": 0.0, "stream": {"velocity": [3, -2]}}
        ),
    }


def _twins():
    out = []
    for name, tables in _machines().items():
        for axis, shift in (("x", (FAR, 0.0)), ("y", (0.0, FAR)), ("xy", (-FAR + 4.0, FAR))):
            there = moved(tables, *shift)
            back = _shifted_back(shift)
            twin = Twin("shift symmetry", there, back, FAR_BOUND)
            # What stays in contact takes longest.
            slow = ("pymunk",) if name in {"lying", "edge", "slide"} else ()
            named = f"shift-{name}-{axis}"
            out.append(
                Case(named, "shifted by 10^6 m", tables, steps=(1e-3,), twin=twin, slow=slow)
            )
        twin = Twin("mirror symmetry", mirrored(tables), lambda p: p * [-1.0, 1.0])
        out.append(Case(f"mirror-{name}", "mirrored", tables, twin=twin))
    return out


def _shifted_back(shift):
    return lambda p: p - np.array(shift)


QUICK, MANY = 4, 500
"""Machines in the default run, and in all."""

RESOLVED = 1e-3
"""m; smaller disks than this are left to the exact engine here: `extremes` has them for all."""

SHORTEST = 0.05
"""m; shortest segment drawn."""


DRIVEN = {152: LONE, **dict.fromkeys((94, 355, 399), ("pymunk",))}
"""Seeds at which belts drive a particle to and fro in a wedge without end, and the engines that
have to tell. Where little is given back the contact engine, and for what does not turn the exact
one, let the belt stall; Chipmunk has nothing of the kind."""


def machine(seed):
    """Return the scene of a seed."""
    rng = np.random.default_rng(seed)
    surfaces = [found for n in range(rng.integers(1, 6)) if (found := _surface(rng, f"s{n}"))]
    spin = bool(rng.integers(2))
    radius = _one_of(rng, [1e-6 if spin else 0.0, 1e-3, 0.004, 0.03, 0.125])
    speed = _one_of(rng, [0.5, 2.0, 20.0])
    return {
        "gravity": _one_of(rng, [9.81, 9.81, 1.6, 0.0]),
        "particle": {"radius": radius, "spin": spin, "mass": _one_of(rng, [1e-9, 0.2, 1e6])},
        "surface": surfaces,
        # Above all surfaces, whatever the radius.
        **thrown((_place(rng), 1.25), (speed * _place(rng), speed * _place(rng))),
        "run": {"until": 1.5},
    }


def _surface(rng, name):
    points = [(_place(rng), _place(rng))]
    for _ in range(rng.integers(1, 4)):
        following = (_place(rng), _place(rng))
        if np.hypot(*np.subtract(following, points[-1])) > SHORTEST:
            points.append(following)
    materials = {
        "restitution": _one_of(rng, [0.0, 0.3, 0.8, 0.999, 1.0]),
        "friction": _one_of(rng, [0.0, 0.1, 0.6, 5.0, 1e6]),
        "speed": _one_of(rng, [0.0, 0.0, 0.0, 1.5, -0.7, 100.0]),
    }
    return surface(name, *points, **materials) if len(points) > 1 else None


def _place(rng):
    """Draw a coordinate within 1 m; half of them from a grid, so that things fall together."""
    return float(rng.integers(-8, 9)) / 8.0 if rng.integers(2) else float(rng.uniform(-1.0, 1.0))


def _one_of(rng, values):
    return values[int(rng.integers(len(values)))]


def drawn_cases():
    """Return the cases."""
    out = []
    for seed in range(MANY):
        tables = machine(seed)
        resolved = tables["particle"]["radius"] >= RESOLVED
        out.append(
            Case(
                f"drawn-{seed}",
                "drawn at random",
                tables,
                engines=LONE if resolved else ("exact",),
                steps=(1e-3,),
                # A spinning disk held between a moving surface and another.
                may_refuse={"exact": "run.engine"},
                driven=DRIVEN.get(seed, ()),
                slow=() if seed < QUICK else LONE,
            )
        )
    return tuple(out)


def all_cases():
    """Return the cases."""
    return (*extremes.CASES, *geometry.CASES, *extremes.lasting_cases(), *_twins(), *drawn_cases())
