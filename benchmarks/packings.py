"""What is right: packings of disks poured into boxes, as shipped and solved to convergence.

    python benchmarks/packings.py [--runs N] [--jobs N] [WIDTH ...]

`COUNT` equal disks are poured into boxes of some widths (m), N runs each (10 by default) that
differ by seed, until they sleep. Each is run four times: `shipped`, as `chutelab run` does;
`solved`, steps of 1 ms swept until no sweep changes a velocity by more than `ACCURATE`, or
`SWEEPS` times; and that with the step halved once and twice. Of a packing are told

    height     mean height of the centres, m
    fraction   share of the area that disks cover, 3 diameters off walls and floor and from there up
               to the mean height plus half of it again, where the packing is still whole
    contacts   per disk there: gaps up to half a per cent of the radius

as mean ± standard error over the runs. The last column is how far `shipped` is from the finest,
in standard errors of the difference. `unsolved` is the overlap, in radii, that 1 of 100 steps
leaves (`Recording.unsolved`), `s` the processor time of a run.
"""

from __future__ import annotations

import argparse
import sys
from concurrent.futures import ProcessPoolExecutor
from pathlib import Path
from time import process_time
from typing import Any

import numpy as np

from chutelab import scene
from chutelab.machine import build

sys.path.insert(0, str(Path(__file__).parents[1] / "tests"))
from cores import Core

WIDTHS = (0.08, 0.12, 0.16, 0.2)
"""m."""

COUNT, RADIUS = 150, 0.004

SWEEPS, ACCURATE = 2000, 1e-7
"""Sweeps, and m/s: of a radius 2.5e-8 in a step."""

LEVELS = {
    "shipped": {}, "solved": {"dt": 1e-3}, "solved, dt/2": {"dt": 5e-4},
    "solved, dt/4": {"dt": 2.5e-4},
}  # fmt: skip
"""Step, s."""

TOUCH = 5e-3
"""Radii."""


def poured(width: float, seed: int, step: dict[str, float]) -> Any:
    """Return the machine of a box."""
    half = 0.5 * width
    walls = {"name": "box", "points": [[-half, 3.0], [-half, 0.0], [half, 0.0], [half, 3.0]]}
    tables = {
        "particle": {"radius": RADIUS, "mass": 0.0021, "spin": True},
        "surface": [{**walls, "restitution": 0.5, "friction": 0.3}],
        "stream": {
            "count": COUNT, "rate": 500.0, "at": [-0.6 * half, 0.4], "velocity": [1.0, 0.0],
            "bed_height": 0.05, "speed_spread": 0.05, "interact": True, "seed": seed,
            "restitution": 0.5, "friction": 0.3,
        },
        "run": {"until": "settled", "max_time": 20.0, **step},
    }  # fmt: skip
    return build(scene.from_dict(tables))


def packed(width: float, seed: int, level: str) -> tuple[float, ...]:
    """Run one; return height, fraction, contacts, seconds, and whether it sleeps in the end."""
    began = process_time()
    core = Core(poured(width, seed, LEVELS[level]))
    if level != "shipped":
        core.world.sweeps, core.world.accurate = SWEEPS, ACCURATE
    recording = core.run()
    took = process_time() - began
    place = recording.ends()[1]["position"]
    height = float(place[:, 1].mean())
    low, high = 6.0 * RADIUS, 1.5 * height
    across = 0.5 * width - 6.0 * RADIUS
    away = np.hypot(*(place[:, None] - place).transpose(2, 0, 1))
    np.fill_diagonal(away, np.inf)
    inside = (place[:, 1] > low) & (place[:, 1] < high) & (np.abs(place[:, 0]) < across)
    contacts = np.count_nonzero(away[inside] < (2.0 + TOUCH) * RADIUS, axis=1).mean()
    # Of points on a fine grid, those that are covered.
    x, y = np.meshgrid(np.linspace(-across, across, 300), np.linspace(low, high, 300))
    nearest = np.full(x.shape, np.inf)
    for u, v in place:
        nearest = np.minimum(nearest, np.hypot(x - u, y - v))
    left = float(np.quantile(recording.unsolved, 0.99))
    asleep = float(np.mean(recording.ended_by("settled")))
    return height, float((nearest < RADIUS).mean()), float(contacts), left, took, asleep


def main() -> None:
    """Print a table."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").partition("\n")[0])
    parser.add_argument("widths", nargs="*", type=float, default=WIDTHS, metavar="WIDTH")
    parser.add_argument("--runs", type=int, default=10)
    parser.add_argument("--jobs", type=int, default=1)
    asked = parser.parse_args()
    print(f"{'':20} {'height, m':>20} {'fraction':>18} {'contacts':>16}  unsolved      s asleep")
    with ProcessPoolExecutor(asked.jobs) as pool:
        for width in asked.widths:
            means, errors = np.zeros((2, len(LEVELS), 3))
            for n, level in enumerate(LEVELS):
                runs = [pool.submit(packed, width, seed, level) for seed in range(asked.runs)]
                rows = np.array([run.result() for run in runs])
                means[n] = rows[:, :3].mean(axis=0)
                errors[n] = rows[:, :3].std(axis=0, ddof=1) / np.sqrt(len(rows))
                told = "  ".join(
                    f"{m:.5f} ± {e:.5f}" for m, e in zip(means[n], errors[n], strict=True)
                )
                left, took, asleep = rows[:, 3:].mean(axis=0)
                print(f"{width} {level:14} {told}  {left:.1e} {took:7.2f} {asleep:.2f}", flush=True)
            off = (means[0] - means[-1]) / np.hypot(errors[0], errors[-1])
            print(
                f"{width} shipped is off by {', '.join(f'{one:+.1f}' for one in off)}", flush=True
            )


if __name__ == "__main__":
    main()
