"""Whether `check` knows how long runs take: random crowds, bounces, and machines.

    python benchmarks/estimates.py [COUNT]

By default 300 of each, which takes an hour. Each estimate stands beside the processor time that the
run took; the last line of each kind is what the README tells: within a factor of three nine times
out of ten, or "not known".
"""

import sys
from pathlib import Path
from time import process_time

import numpy as np

from chutelab.checks.preflight.trial import effort, trial_run
from chutelab.engines.simulation import choose, follow, simulate
from chutelab.machine import build
from chutelab.results.recorder import EnoughError, StalledError
from chutelab.results.summary import stopped
from chutelab.scene import from_dict, load

sys.path.insert(0, str(Path(__file__).parents[1] / "tests"))
from crowds import crowd
from drawn import draw

LONGEST = 20.0
"""s of processor time that a run is followed for."""

FACTOR, SHARE = 3.0, 0.9
"""An estimate is within this factor this often, or says that it does not know."""

FLOOR = 0.005
"""s; what takes less is over at once, however much less."""


def bounce(seed):
    """Return the machine of a seed: a disk that bounces on a floor, in a box, a wedge, on a belt.

    Restitutions up to 1, up to 1,000 s, and all engines.
    """
    rng = np.random.default_rng(seed)

    def uniform(low, high):
        return float(rng.uniform(low, high))

    def one_of(*values):
        return values[int(rng.integers(len(values)))]

    r = 10.0 ** uniform(-3.0, -1.5)
    tiny = 10.0 ** uniform(-5.0, -1.5)
    lossy = one_of(0.0, uniform(0.0, 0.3), tiny, tiny)
    pair = {"restitution": 1.0 - lossy, "friction": one_of(0.0, uniform(0.0, 1.0))}
    wide, high = uniform(4.0, 40.0) * r, uniform(6.0, 60.0) * r
    points, speed = {
        "floor": ([[-1e3 * r, 0.0], [1e3 * r, 0.0]], 0.0),
        "box": ([[-wide, high], [-wide, 0.0], [wide, 0.0], [wide, high], [-wide, high]], 0.0),
        "wedge": ([[-wide, 0.7 * wide], [0.0, 0.0], [wide, uniform(0.3, 1.0) * wide]], 0.0),
        "belt": ([[-1e3 * r, 0.0], [1e3 * r, 0.0]], uniform(-2.0, 2.0)),
    }[one_of("floor", "box", "wedge", "belt")]
    lasts = 10.0 ** uniform(0.0, 3.0)
    sideways = one_of(0.0, uniform(-0.5, 0.5))
    return build(
        from_dict(
            {
                "particle": {"radius": r, "spin": one_of(True, False)},
                "surface": [{"name": "s", "points": points, "speed": speed, **pair}],
                "stream": {
                    "at": [0.0, 0.5 * high + 1.5 * r],
                    "velocity": [sideways, one_of(0.0, uniform(-1.0, 1.0))],
                },
                "run": {
                    "engine": one_of("exact", "exact", "contact", "pymunk"),
                    "until": one_of("settled", lasts),
                    "max_time": lasts,
                },
            },
            f"bounce-{seed}",
        )
    )


def measured(machine):
    """Return the processor time of a run, s, or None if it takes longer than `LONGEST`."""
    begin = process_time()

    def watch(_share):
        if process_time() - begin > LONGEST:
            raise EnoughError

    try:
        recording = follow(machine, None, watch)
    except StalledError:
        return process_time() - begin
    return process_time() - begin if stopped(recording) is None else None


def judged(machines):
    """Return the share of estimates that are right, of those that are told, and how many are."""
    for engine in ("exact", "contact", "pymunk"):
        simulate(
            load("slip"), engine=engine
        )  # what an engine's first run in a process adds is not asked
    right = told = false = count = 0
    for name, machine in machines:
        count += 1
        estimate = effort(machine, trial_run(machine, choose(machine)), 0.0, 0)
        took = measured(machine)
        real, said = max(FLOOR, took or LONGEST), max(FLOOR, estimate.seconds)
        wrong = False
        if estimate.at_least:
            false += (wrong := took is not None and said > FACTOR * real)
        else:
            # Of a run that was not followed to its end it is not known how much longer it takes.
            told += 1
            wrong = FACTOR * said < real or (took is not None and said > FACTOR * real)
            right += not wrong
        sys.stdout.write(
            f"{name:>16} {'more than' if took is None else '':>9} {real:8.3f} s,"
            f" {'at least' if estimate.at_least else 'about':>8} {said:8.3f} s"
            f" {'WRONG' if wrong else ''}\n"
        )
        sys.stdout.flush()
    sys.stdout.write(
        f"{right} of {told} right; of {count} {count - told} not told, {false} of them too high\n"
    )
    return right / told, told / count, false / count


def main():
    count = int(sys.argv[1]) if len(sys.argv) > 1 else 300
    kinds = (lambda seed: crowd(seed)[1]), bounce, (lambda seed: build(draw(seed)))
    for one in kinds:
        right, told, false = judged((str(seed), one(seed)) for seed in range(count))
        if right < SHARE or told < 0.8 or false > 0.02:
            sys.stdout.write("FAILED\n")


if __name__ == "__main__":
    main()
