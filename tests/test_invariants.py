"""Laws that no scene may break: random machines of free surfaces, any particle."""

from itertools import product

import numpy as np
import pytest

from chutelab import scene
from chutelab.engines.simulation import simulate
from chutelab.machine import chooses
from chutelab.scene import Scene, plain, to_dict
from chutelab.scene.tables import Stream
from sandbox import draw
from shared import some

FASTER = {"s": 0.5, "1/s": 2.0, "m/s": 2.0, "m/s²": 4.0}
"""By which keys of these units grow when all goes twice as fast; lengths and masses stay."""


def times(value, factor):
    if isinstance(value, list):
        return [times(one, factor) for one in value]
    if isinstance(value, str) and value.endswith(" t/h"):
        return f"{2.0 * float(value[:-4])!r} t/h"
    return factor * value if isinstance(value, int | float) else value


def faster(table, model):
    """Return a table of a scene file with all in it twice as fast."""
    if isinstance(table, list):
        return [faster(row, model) for row in table]
    grown = {}
    for name, field in model.model_fields.items():
        key, extra = field.alias or name, field.json_schema_extra
        inner = Scene.tables().get(key) if model is Scene else None
        if key in table and inner:
            grown[key] = faster(table[key], inner)
        elif key in table:
            unit = extra.get("x-unit") if isinstance(extra, dict) else None
            grown[key] = times(table[key], FASTER[unit]) if unit in FASTER else table[key]
    return grown


def twice_as_fast(given):
    """Return a scene with g × 4, speeds × 2, times / 2, of defaults with a unit, too."""
    tables = plain(to_dict(given))
    tables.pop("expect", None)
    tables.pop("live", None)
    run = given.run
    tables["gravity"] = given.gravity
    tables["run"] = {**tables.get("run", {}), "max_time": run.max_time}
    if not chooses(given):
        tables["run"]["dt"] = run.dt
    rows = tables.get("stream", {})
    rows = [rows] if isinstance(rows, dict) else rows
    default = {"rate": Stream().rate}
    tables["stream"] = [row if "fill" in row or "to" in row else default | row for row in rows]
    return scene.from_dict(faster(tables, Scene))


def assert_repeats(given, engine):
    """A film of the run shown twice as fast is the run of the scene with g × 4, to the last bit.

    Lengths and masses stay and times halve, so speeds double, and energies are four times as much.
    """
    slow = simulate(given, engine=engine)
    fast = simulate(twice_as_fast(given), engine=engine)
    factors = {
        "t": 0.5, "position": 1.0, "velocity": 2.0, "omega": 2.0, "entries": 4.0, "angle": 1.0,
        "particle": 1, "other": 1, "kind": 1, "surface": 1, "velocity_before": 2.0,
        "velocity_after": 2.0, "omega_before": 2.0, "omega_after": 2.0, "normal_impulse": 2.0,
        "tangential_impulse": 2.0,
    }  # fmt: skip
    for one, other in ((slow.knots, fast.knots), (slow.events, fast.events)):
        for name in one.dtype.names:
            # Numbers below 1e-308 have fewer digits.
            pair = factors[name] * one[name], other[name]
            np.testing.assert_allclose(*pair, rtol=0.0, atol=1e-300, err_msg=name)
    np.testing.assert_array_equal(4.0 * slow.by_surface, fast.by_surface)
    np.testing.assert_array_equal(slow.ended, fast.ended)


@pytest.mark.parametrize(
    ("which", "engine"),
    [
        *some(product(["perpendicular", "slip", "free-fall", 4, 14, 28], ["exact", "contact"])),
        *some([("free-fall", "pymunk"), (14, "pymunk"), ("perpendicular", "pymunk")]),
        *(pytest.param(which, "pymunk", marks=pytest.mark.slow) for which in ("slip", 4, 28)),
    ],
)
def test_twice_as_fast_under_four_times_the_gravity(which, engine):
    given = scene.load(which) if isinstance(which, str) else draw(which)
    assert_repeats(given, engine)


@pytest.mark.parametrize("which", ["hopper", 9, 13, 17, 21, 23])
def test_a_crowd_twice_as_fast_under_four_times_the_gravity(which):
    """Gates open and shut, islands fall asleep, and what has settled ends the run."""
    few = {"stream.count": 60}
    given = scene.load(which).with_values(few) if which == "hopper" else draw(which)
    assert given.crowded
    assert_repeats(given, "contact")


@pytest.mark.slow
@pytest.mark.parametrize("which", ["hopper", "mixture", "stream", "rock-box", *range(30, 80)])
def test_any_machine_twice_as_fast_under_four_times_the_gravity(which):
    given = scene.load(which) if isinstance(which, str) else draw(which)
    # Without gravity nothing tells how fast is fast, and bounds are those for 9.81 m/s².
    if given.gravity > 0.0:
        assert_repeats(given, "contact")
