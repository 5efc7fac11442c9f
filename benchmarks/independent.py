"""Run time, error and memory of particles that do not meet each other, beside SciPy's DOP853.

    python benchmarks/independent.py [--repeats N] [COUNT ...]

COUNT is 1, 1000 and 100000 by default; 1000000 takes some seconds and 1.5 GB. Times run from the
validated scene to the recording. DOP853 does the same transfer of one particle, flight to the
plate, blow, flight to the belt, with events and a tolerance of 1e-13; for more particles it is
repeated. Errors are those of the landing point against the closed form, as a share of the drop.

The floor is what memory alone would take: the state of all particles copied once a round, and the
recording once.
"""

from __future__ import annotations

import argparse
import subprocess
import sys
import tracemalloc
from functools import partial
from math import sqrt
from statistics import median
from time import perf_counter

import numpy as np
from scipy.integrate import solve_ivp

from chutelab.engines.simulation import simulate
from chutelab.results import Kind
from chutelab.results.ledger import ledger
from chutelab.scene import load

G, SPEED, PULLEY, DISTANCE, DROP, RESTITUTION, RADIUS = 9.81, 2.0, 0.1, 0.5, 0.5, 0.5, 0.0063
STATE = 20
"""Numbers of 8 bytes of each particle that a round reads and writes."""

PEAK = """
import sys
from pathlib import Path
from chutelab import load, simulate
simulate(load("stream-independent", ["stream.count=" + sys.argv[1]]))
print(*(line for line in Path("/proc/self/status").read_text().splitlines() if "VmHWM" in line))
"""
"""Not `ru_maxrss`, which a child takes over from its parent."""


def terminal(function):
    function.terminal, function.direction = True, -1.0
    return function


def dop853(height=0.0):
    """Carry one particle from the top of the pulley to the belt; return where it lands."""
    wall = PULLEY + DISTANCE - RADIUS
    lowest = PULLEY + RADIUS - 0.5 * G * (wall / SPEED) ** 2 - DROP

    def motion(_, y):
        return y[2], y[3], 0.0, -G

    def fly(state, event):
        way = solve_ivp(
            motion, (0.0, 10.0), state, "DOP853", events=terminal(event), rtol=1e-13, atol=1e-13
        )
        return way.y[:, -1]

    x, y, vx, vy = fly(
        (0.0, PULLEY + RADIUS + height, SPEED, 0.0), lambda _, state: wall - state[0]
    )
    return fly((x, y, -RESTITUTION * vx, vy), lambda _, state: state[1] - lowest)[0]


def landing(height):
    """Where it lands, in closed form."""
    wall = PULLEY + DISTANCE - RADIUS
    t = wall / SPEED
    fall = sqrt(2.0 * (0.5 * G * t**2 + DROP + height) / G)
    return wall - RESTITUTION * SPEED * (fall - t)


def seconds(function, *arguments, repeats=1):
    """Return the median time of some runs, and the last result."""
    times, result = [], None
    for _ in range(repeats):
        result = None  # its memory is free for the next one
        begin = perf_counter()
        result = function(*arguments)
        times.append(perf_counter() - begin)
    return median(times), result


def floor(recording):
    """Time to copy what a run has to read and write."""
    state = np.zeros((STATE, recording.count))
    arrays = [recording.knots.view(np.uint8), recording.events.view(np.uint8)]
    targets = [np.zeros_like(array) for array in (state, *arrays)]

    def copy():
        for _ in range(recording.steps):
            np.copyto(targets[0], state)
        for target, array in zip(targets[1:], arrays, strict=True):
            np.copyto(target, array)

    return seconds(copy, repeats=5)[0]


def report(count, repeats):
    name = "perpendicular" if count == 1 else "stream-independent"
    scene = load(name, [f"stream.count={count}"])
    first, recording = seconds(simulate, scene)
    each = 9 if count <= 1000 else 1
    ours, theirs, core = [], [], []
    # Turn and turn about, so that a busy machine is busy for all.
    for _ in range(repeats):
        theirs.append(seconds(dop853, repeats=9)[0])
        if count == 1:
            core.append(seconds(partial(simulate, engine="contact"), scene, repeats=9)[0])
        ours.append(seconds(simulate, scene, repeats=each)[0])
    time, reference = median(ours), median(theirs)
    heights = recording.select(Kind.RELEASE)["position"][:, 1] - PULLEY - RADIUS
    down = recording.first(recording.select(Kind.LANDING))
    error = max(
        abs(x - landing(h)) / DROP for x, h in zip(down["position"][:, 0], heights, strict=True)
    )
    events = len(recording.events)
    share = ledger(recording).relative_residual
    print(f"{count:,} particles, {events:,} events, {recording.steps} rounds")
    print(f"    exact         {time * 1e3:9.3f} ms (first run {first * 1e3:.1f} ms)")
    print(f"                  {time / events * 1e6:9.3f} µs an event")
    print(f"                  {error:9.0e} error, {share:.0e} ledger residual")
    print(f"    DOP853        {reference * count * 1e3:9.3f} ms, {dop853_error():.0e} error:")
    print(f"                  {reference * count / time:9.2f} times the time of exact")
    if core:
        share = median(a / b for a, b in zip(core, theirs, strict=True))
        print(f"    contact       {median(core) * 1e3:9.3f} ms, {share:.2f} of DOP853's")
    least = floor(recording)
    print(
        f"    memory traffic{least * 1e3:9.3f} ms at least: exact takes {time / least:.1f} times it"
    )
    if count > 1:
        tracemalloc.start()
        simulate(scene)
        allocated = tracemalloc.get_traced_memory()[1]
        tracemalloc.stop()
        found = subprocess.run(
            [sys.executable, "-c", PEAK, str(count)], capture_output=True, text=True, check=True
        )
        peak = int(found.stdout.split()[1]) * 1024
        print(f"    memory        {allocated / 1e6:9.0f} MB allocated at the peak,")
        print(f"                  {peak / 1e6:9.0f} MB the whole process")


def dop853_error():
    return abs(dop853() - landing(0.0)) / DROP


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("counts", nargs="*", type=int, default=[1, 1000, 100_000])
    parser.add_argument("--repeats", type=int, default=9)
    given = parser.parse_args()
    for count in given.counts:
        # About as long for many particles as for one.
        report(count, max(3, min(given.repeats, given.repeats * 100_000 // count)))


if __name__ == "__main__":
    main()
