"""WebAssembly operations of the core in some cases: a number that no other program changes.

    python benchmarks/operations.py [CASE|SCENE...]

To compare two checkouts, run it in both. Processor time scatters by 10 % and more on a busy
machine; of the same code this count does not, and 1,000 in a box scatter by 0.3 % from seed to
seed. It is no time: an operation on four numbers counts once, and what memory costs is not in it.
The cases are the runs of `against.py`, `box` (1,000 disks pour into a box for 2 s), `squares` and
`rounds` (300 boxes, and as many disks of their area, poured into a bin, in a mean of twelve draws),
and 600 variants of `spoon` by speed, friction and restitution.
"""

import sys
from functools import cache
from importlib.resources import files

import numpy as np
import wasmtime

from against import RUNS
from chutelab import core
from chutelab.engines.simulation import simulate
from chutelab.scene import from_dict, load
from chutelab.studies.sweep import sweep
from others import POURED

ALL = 1 << 62
"""Operations that a store may run."""

VARIED = {"spoon, speed": ("incoming.speed", 1.5, 3.0),
          "spoon, friction": ("surface.spoon.friction", 0.0, 0.5),
          "spoon, restitution": ("surface.spoon.restitution", 0.0, 0.5)}  # fmt: skip

HALF, WIDE, MANY, DRAWS = 0.009, 0.1 * 5.0**0.5, 300, 12
SHAPES = {"squares": {"shape": "box", "size": [2.0 * HALF, 2.0 * HALF]},
          "rounds": {"radius": 2.0 * HALF / np.pi**0.5}}  # fmt: skip


def bin_of(shape, seed):
    """Return a scene: 300 particles of a shape fall into a bin, for 2 s."""
    high, near = 0.06 + MANY * (2.9 * HALF) ** 2 / (WIDE - 0.01), WIDE - 0.014
    walls = {"left": [[-WIDE, 0.0], [-WIDE, 5.0]], "right": [[WIDE, 0.0], [WIDE, 5.0]],
             "floor": [[-WIDE, 0.0], [WIDE, 0.0]]}  # fmt: skip
    return from_dict({
        "particle": {**SHAPES[shape], "mass": 0.01, "spin": True},
        "surface": [{"name": name, "points": ends, "friction": 0.4}
                    for name, ends in walls.items()],
        "stream": {"count": MANY, "fill": [[-near, 0.014], [near, high]], "seed": seed,
                   "interact": True, "restitution": 0.2, "friction": 0.4},
        "run": {"until": 2.0, "engine": "contact"},
    })  # fmt: skip


stores = []


class Counted(wasmtime.Store):
    """A store whose operations are counted."""

    def __init__(self, engine):
        super().__init__(engine)
        self.set_fuel(ALL)
        stores.append(self)


@cache
def counting():
    """Return the compiled module, with counters."""
    config = wasmtime.Config()
    config.consume_fuel = True
    engine = wasmtime.Engine(config)
    return engine, wasmtime.Module(engine, (files(core) / "core.wasm").read_bytes())


def run(case):
    if case in VARIED:
        key, low, high = VARIED[case]
        sweep(load("spoon"), {key: np.linspace(low, high, 600)}, engine="exact")
    elif case in SHAPES:
        for seed in range(DRAWS):
            simulate(bin_of(case, seed))
    elif case == "box":
        simulate(from_dict(POURED))
    else:
        name, *settings = RUNS.get(case, [case])
        simulate(load(name, settings))


def main(cases):
    wasmtime.Store, core._compiled = Counted, counting
    for case in cases:
        # The first time the core also makes room in its memory.
        run(case)
        before = sum(ALL - store.get_fuel() for store in stores)
        run(case)
        done = sum(ALL - store.get_fuel() for store in stores) - before
        done /= DRAWS if case in SHAPES else 1
        print(f"{case:18} {1e-6 * done:12.3f} million", flush=True)


if __name__ == "__main__":
    main(
        sys.argv[1:] or [case for case in (*RUNS, *VARIED, "box", *SHAPES) if "pymunk" not in case]
    )
