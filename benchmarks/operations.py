"""WebAssembly operations of the core in some cases: a number that no other program changes.

    python benchmarks/operations.py [CASE|SCENE...]

To compare two checkouts, run it in both. Processor time scatters by 10 % and more on a busy
machine; of the same code this count does not, and 1,000 in a box scatter by 0.3 % from seed to
seed. It is no time: an operation on four numbers counts once, and what memory costs is not in it.
The cases are the runs of `against.py`, `box` (1,000 disks pour into a box for 2 s), and 600
variants of `spoon` by speed and by friction.
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
          "spoon, friction": ("surface.spoon.friction", 0.0, 0.5)}  # fmt: skip


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
        print(f"{case:18} {1e-6 * done:12.3f} million", flush=True)


if __name__ == "__main__":
    main(sys.argv[1:] or [case for case in (*RUNS, *VARIED, "box") if "pymunk" not in case])
