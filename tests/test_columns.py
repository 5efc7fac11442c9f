"""Tall columns and silos: no solve makes energy, however contacts wedge."""

import pytest

from chutelab.engines.contact import run
from chutelab.engines.simulation import simulate
from chutelab.machine import build
from chutelab.results import Kind
from chutelab.scene import from_dict
from columns import column, faults


@pytest.mark.parametrize(("seed", "count"), [(3, 60), (4, 60)])
def test_a_column_makes_no_energy(seed, count):
    scene, fastest = column(seed, count)
    assert faults(run(build(from_dict(scene))), fastest) == []


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(20))
def test_twenty_columns_and_silos_make_no_energy(seed):
    scene, fastest = column(seed, 400)
    assert faults(run(build(from_dict(scene))), fastest) == []


@pytest.mark.parametrize("engine", ["contact", "pymunk"])
def test_disks_that_just_touch_are_there_from_the_start(engine):
    """Six in a pile: where 0.03 and 0.05 are rounded, neighbours overlap in the last digit."""
    scene = {
        "particle": {"radius": 0.01, "spin": True},
        "surface": [{"name": "f", "from": [-0.5, 0.0], "to": [0.5, 0.0], "restitution": 0.0}],
        "stream": {
            "count": 6, "at": [0.0, 0.01], "to": [0.0, 0.11], "velocity": [0.0, 0.0],
            "interact": True, "restitution": 0.0,
        },
        "run": {"until": 0.05},
    }  # fmt: skip
    released = simulate(from_dict(scene), engine=engine).select(Kind.RELEASE)
    assert released["t"].tolist() == [0.0] * 6
