"""Throughput of `sweep` beside a plain loop over `simulate`: angle × speed × ε, one particle each.

    OMP_NUM_THREADS=1 python benchmarks/sweep.py [VARIANTS]

Both validate each variant, run it and read its row off the recording. Times are of the processor,
on one core. The file is written on top, and timed by itself. At last a tenth of the variants of
`spoon`, with its 40 particles, and of `slip`, by one key each.
"""

import sys
import tempfile
from pathlib import Path
from statistics import median
from time import process_time

import numpy as np

from chutelab.engines.simulation import simulate
from chutelab.scene import from_dict, load, to_dict
from chutelab.studies.sweep import REASON, TEXTS, row_of, sweep

REPEATS = 3
SINGLE = 300
"""Variants of the loop: it takes as long for each of them."""

KEYS = ("plate.angle_deg", "incoming.speed", "plate.restitution")
FAMILIES = (
    ("spoon", "incoming.speed", 1.5, 3.0),
    ("spoon", "plate.angle_deg", -5.0, 20.0),
    ("spoon", "plate.restitution", 0.0, 0.5),
    ("spoon", "surface.spoon.friction", 0.0, 0.5),
    ("spoon", "surface.spoon.friction", 0.0, 1.0),
    ("spoon", "surface.spoon.radius", 0.49, 0.51),
    # Each of its 40 bounces some thirty times in the spoon.
    ("spoon", "surface.spoon.restitution", 0.0, 0.5),
    ("slip", "incoming.friction", 0.3, 1.0),
)


def timed(function):
    begin = process_time()
    result = function()
    return process_time() - begin, result


def scene_of(document, values):
    return from_dict(document, "<loop>", [f"{k}={v!r}" for k, v in zip(KEYS, values, strict=True)])


def main(count):
    scene = load("perpendicular")
    # From 1.05 m/s on particles leave at the top; slower ones ride round the pulley.
    for low, steepest, what in (
        (1.5, 20.0, "leaving at the top"),
        (0.6, 0.0, "half of them riding round the pulley"),
    ):
        side = round(count ** (1 / 3))
        varies = {
            KEYS[0]: np.linspace(-20.0, steepest, side),
            KEYS[1]: np.linspace(low, 3.0 if low > 1.0 else 1.5, side),
            KEYS[2]: np.linspace(0.0, 1.0, -(-count // side**2)),
        }
        runs = [timed(lambda varies=varies: sweep(scene, varies)) for _ in range(REPEATS)]
        swept = runs[-1][1]
        batch = median(seconds for seconds, _ in runs) / len(swept)

        document = to_dict(scene)
        rng = np.random.default_rng(0)
        chosen = rng.choice(np.flatnonzero(swept.columns[REASON] == ""), SINGLE, replace=False)
        values = [[float(swept.columns[key][row]) for key in KEYS] for row in chosen]

        def loop(values=values, document=document):
            return [simulate(scene_of(document, one)) for one in values]

        def rows(values=values, document=document):
            return [row_of(scene_of(document, one)) for one in values]

        loop_time = median(timed(loop)[0] for _ in range(REPEATS)) / SINGLE
        row_time, found = timed(rows)
        off = max(
            abs(swept.columns[name][at] / row[name][0] - 1.0)
            for row, at in zip(found, chosen, strict=True)
            for name in row
            if name not in (*TEXTS, "error.max", "ledger.residual") and row[name][0]
        )
        with tempfile.TemporaryDirectory() as folder:
            file_time, _ = timed(lambda at=folder, one=swept: one.to_csv(Path(at) / "rows.csv"))
        print(f"{len(swept)} variants, {what}; {np.sum(swept.columns[REASON] != '')} refused")
        print(f"  sweep                 {batch * len(swept):6.2f} s, {1e6 * batch:7.1f} µs each")
        print(f"  loop over simulate    {'':9} {1e6 * loop_time:7.1f} µs each")
        print(f"  loop, with its rows   {'':9} {1e6 * row_time / SINGLE:7.1f} µs each")
        print(f"  ratio: {loop_time / batch:.0f} times, {row_time / SINGLE / batch:.0f} with rows")
        print(f"  the CSV file, on top  {file_time:6.2f} s; rows agree to {off:.0e}")
    for name, key, low, high in FAMILIES:
        part, varies = load(name), {key: np.linspace(low, high, count // 10)}
        times = [timed(lambda one=part, by=varies: sweep(one, by))[0] for _ in range(REPEATS)]
        print(f"{count // 10} of {name}, {key} {low:g} to {high:g}: {min(times):.2f} s")


if __name__ == "__main__":
    main(int(sys.argv[1]) if sys.argv[1:] else 100_000)
