"""What the laws that every run is judged by take, as a share of the run itself.

    python benchmarks/laws.py [SCENE ...]

By default of all shipped scenes. Processor time of resolving and running a scene, and of judging
its recording, in turns; medians. The share ought to be at most a tenth.
"""

import sys
from statistics import median
from time import process_time

from chutelab.engines.simulation import follow
from chutelab.machine import build
from chutelab.results.laws import examine
from chutelab.scene import load, shipped

REPEATS = 5
SHORT, MANY = 50_000, 20
"""Knots up to which a run is short, and runs that are timed together then."""


def timed(function, *arguments, times):
    begin = process_time()
    for _ in range(times):
        function(*arguments)
    return (process_time() - begin) / times


def measure(name):
    scene = load(name)

    def run():
        return follow(build(scene), None, None)

    recording = run()
    times = MANY if len(recording.knots) <= SHORT else 1
    pairs = [
        (timed(run, times=times), timed(examine, recording, times=times)) for _ in range(REPEATS)
    ]
    ran, judged = (median(part) for part in zip(*pairs, strict=True))
    share = median(laws / whole for whole, laws in pairs)
    print(
        f"{name:20} {recording.engine:8} {len(recording.knots):8,} {1e3 * ran:10.3f}"
        f" {1e3 * judged:9.3f} {share:6.3f}",
        flush=True,
    )


def main(names):
    print(f"{'scene':20} {'engine':8} {'knots':>8} {'run, ms':>10} {'laws, ms':>9} {'share':>6}")
    for name in names or shipped():
        measure(name)


if __name__ == "__main__":
    main(sys.argv[1:])
