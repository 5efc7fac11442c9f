"""Machines drawn at random: a particle thrown into surfaces that cross, fold, move and grip."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from chutelab.stress.case import LONE, Case, surface, thrown

if TYPE_CHECKING:
    from collections.abc import Sequence

QUICK, MANY = 20, 500
"""Machines in the quick set, and in all."""

RESOLVED = 1e-3
"""m; smaller disks than this are left to the exact engine here: `extremes` has them for all."""

SHORTEST = 0.05
"""m; shortest segment drawn."""


def machine(seed: int) -> dict[str, Any]:
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


def _surface(rng: np.random.Generator, name: str) -> dict[str, Any] | None:
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


def _place(rng: np.random.Generator) -> float:
    """Draw a coordinate within 1 m; half of them from a grid, so that things fall together."""
    return float(rng.integers(-8, 9)) / 8.0 if rng.integers(2) else float(rng.uniform(-1.0, 1.0))


def _one_of(rng: np.random.Generator, values: Sequence[float]) -> float:
    return values[int(rng.integers(len(values)))]


def cases() -> tuple[Case, ...]:
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
                full=seed >= QUICK,
            )
        )
    return tuple(out)
