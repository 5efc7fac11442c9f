"""Run time and memory of `stream-independent`: 10,000 particles that do not meet each other.

    python tests/benchmarks/independent.py [REPEATS]

Prints the first run, the median of the repeats, the peak of what the run allocates, and the same
scene stepped, for as many particles as fit into a few seconds.
"""

import sys
import tracemalloc
from statistics import median
from time import perf_counter

from chutelab import load, simulate
from chutelab.ledger import ledger

STEPPED = 25
"""Particles of the stepped run; it is scaled up from these, each has a Space to itself."""


def seconds(scene, engine):
    begin = perf_counter()
    recording = simulate(scene, engine=engine)
    return perf_counter() - begin, recording


def main(repeats):
    scene = load("stream-independent")
    first, recording = seconds(scene, "exact")
    times = [seconds(scene, "exact")[0] for _ in range(repeats)]
    tracemalloc.start()
    simulate(scene, engine="exact")
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    events = len(recording.events)
    share = ledger(recording).relative_residual
    print(f"exact:  {recording.count} particles, {events} events, {recording.steps} rounds")
    print(f"        first run {first:.3f} s, median of {repeats}: {median(times):.3f} s,")
    print(f"        {median(times) / events * 1e6:.2f} µs an event, peak {peak / 1e6:.0f} MB,")
    print(f"        ledger residual {share:.0e} of the energy turned over")
    few = load("stream-independent", [f"stream.count={STEPPED}"])
    stepped, other = seconds(few, "pymunk")
    whole = stepped * recording.count / STEPPED
    print(f"pymunk: {STEPPED} particles {stepped:.2f} s, so about {whole / 60:.1f} min for all,")
    print(f"        {whole / median(times):.0f} times as long, at dt = {scene.run.dt} s,")
    print(f"        ledger residual {ledger(other).relative_residual:.0e}")


if __name__ == "__main__":
    main(int(sys.argv[1]) if len(sys.argv) > 1 else 9)
