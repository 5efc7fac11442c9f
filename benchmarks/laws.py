"""What the laws of every run, and loads if they are asked for, take as shares of the run itself.

    python benchmarks/laws.py [SCENE ...]

By default of all shipped scenes. Processor time of resolving and running a scene, and of the same
with its laws, in turns; medians. Lone particles are judged in the core's memory as their run ends,
so that the judging is the difference of the two. Loads are counted in bins of 0.01 s, as a share
of the run with its laws. Either share ought to be at most a tenth.
"""

import sys
from statistics import median
from time import process_time

from chutelab.core import Module
from chutelab.engines.simulation import follow
from chutelab.machine import ahead
from chutelab.scene import load, shipped

SHORT, MANY = 50_000, 20
"""Knots up to which a run is short, and runs that are timed together then."""
TURNS, FEW = 25, 5
"""Of short runs, and of others."""


def timed(function, times):
    begin = process_time()
    for _ in range(times):
        function()
    return (process_time() - begin) / times


def unjudged(honest):
    """Have a call into the core believe that knots were taken, so that it judges none."""

    def run(module, *arguments):
        for subject in ("Exact", "World"):
            module.structs[subject].is_whole = False
        return honest(module, *arguments)

    return run


def measure(name):
    scene, counting = load(name), load(name, {"run.loads": 0.01})

    def judged(scene=scene):
        recording = follow(ahead(scene), None, None)
        return recording, recording.laws

    def counted():
        judged(counting)

    def bare(honest=Module.run):
        Module.run = unjudged(honest)
        follow(ahead(scene), None, None)
        Module.run = honest

    recording, _ = judged()
    short = len(recording.knots) <= SHORT
    times, turns = (MANY, TURNS) if short and recording.engine != "pymunk" else (1, FEW)
    rows = [[timed(each, times) for each in (bare, judged, counted)] for _ in range(turns)]
    ran = median(run for run, *_ in rows)
    share = median((whole - run) / run for run, whole, _ in rows)
    loads = median((more - whole) / whole for _, whole, more in rows)
    print(
        f"{name:20} {recording.engine:8} {len(recording.knots):9,} {1e3 * ran:10.3f}"
        f" {1e3 * share * ran:9.3f} {share:6.3f} {loads:6.3f}",
        flush=True,
    )


def main(names):
    times = f"{'run, ms':>10} {'laws, ms':>9} {'share':>6} {'loads':>6}"
    print(f"{'scene':20} {'engine':8} {'knots':>9} {times}")
    for name in names or shipped():
        measure(name)


if __name__ == "__main__":
    main(sys.argv[1:])
