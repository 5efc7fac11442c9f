"""Restitution that falls with speed, against the power law of contacts that yield."""

from itertools import pairwise

import numpy as np
import pytest

from chutelab import scene as sc
from chutelab.engines.simulation import simulate
from chutelab.results import Kind
from chutelab.results.ledger import energy_at
from chutelab.scene import SceneError
from chutelab.studies.sweep import sweep
from chutelab.theory import predict

E0, V0, M, R = 0.8, 1.5, 0.01, 0.01


def law(v):
    """Johnson, Contact Mechanics (1985), section 11.5: e goes with v^(-1/4) once it yields."""
    return E0 * min(1.0, (v / V0) ** -0.25)


def dropped(height, engine, **particle):
    return sc.from_dict({
        "particle": {"radius": R, "mass": M, "restitution_speed": V0, **particle},
        "surface": [{"name": "floor", "from": [-1.0, 0.0], "to": [1.0, 0.0], "restitution": E0}],
        "stream": {"at": [0.0, height + R], "velocity": [0.0, 0.0]},
        "run": {"engine": engine, "until": 3.0},
    })  # fmt: skip


@pytest.mark.parametrize("engine", ["exact", "contact"])
@pytest.mark.parametrize("height", [0.05, 0.3, 2.0])
def test_a_bounce_follows_the_power_law_and_the_ledger_has_its_loss(engine, height):
    """The first blow has √(2 g h); all that follow, too: the fast ones lose more."""
    run = simulate(dropped(height, engine))
    blows = run.select("impact")
    before, after = -blows["velocity_before"][:, 1], blows["velocity_after"][:, 1]
    assert before[0] == pytest.approx(np.sqrt(2.0 * 9.81 * height), rel=1e-9)
    for v, w in list(zip(before, after, strict=True))[:5]:
        assert w == pytest.approx(law(v) * v, rel=1e-9)
    lost = 0.5 * M * before[0] ** 2 * (1.0 - law(before[0]) ** 2)
    energy = energy_at(run, [np.sqrt(2.0 * height / 9.81) + 0.01])
    assert energy["restitution_loss"][0] == pytest.approx(lost, rel=1e-9)


def test_two_particles_meet_at_the_speed_of_one_against_the_other():
    scene = sc.from_dict({
        "gravity": 0.0,
        "particle": {"radius": R, "mass": M, "restitution_speed": V0},
        "stream": [
            {"name": side, "at": [x, 0.0], "velocity": [v, 0.0], "restitution": E0, "friction": 0.0,
             "interact": True}
            for side, x, v in (("left", -0.1, 2.0), ("right", 0.1, -3.0))
        ],
        "run": {"until": 0.1},
    })  # fmt: skip
    run = simulate(scene)
    assert run.engine == "contact"
    velocity = run.at([0.1])[1][0, :, 0]
    # Equal masses: the centre goes on at -0.5 m/s, the relative speed is e(5) 5 m/s afterwards.
    assert velocity == pytest.approx([-0.5 - 2.5 * law(5.0), -0.5 + 2.5 * law(5.0)], rel=1e-12)
    (blow,) = run.events[run.events["kind"] == Kind.COLLISION]
    assert blow["other"] >= 0


@pytest.mark.parametrize("engine", ["exact", "contact"])
def test_without_it_and_below_its_speed_runs_have_the_same_bits(engine):
    usual, never = (simulate(dropped(0.3, engine, restitution_speed=v)) for v in (None, 10.0))
    for one, other in pairwise((usual, never)):
        assert one.events.tobytes() == other.events.tobytes()
        assert one.knots.tobytes() == other.knots.tobytes()


def test_a_family_has_the_rows_of_its_members():
    speeds = [0.2, 0.5, 1.0, 1.5, 2.0, 3.0, 4.0, 5.0, 6.0]
    found = sweep("perpendicular", {"particle.restitution_speed": speeds})
    for n, v in enumerate(speeds):
        alone = simulate("perpendicular", {"particle.restitution_speed": v})
        assert found.columns["landing.x.mean"][n] == pytest.approx(
            alone.measure("landing.x"), rel=1e-12
        )
    # The belt's 2 m/s meets the plate: ε = 0.5 falls by (2 / v)^(1/4).
    back = [-simulate("perpendicular", {"particle.restitution_speed": v}).measure("impact.vx_after")
            for v in (0.5, 4.0)]  # fmt: skip
    assert back == pytest.approx([2.0 * 0.5 / 4.0**0.25, 2.0 * 0.5], rel=1e-12)


def test_what_does_not_have_it_says_so():
    with pytest.raises(SceneError, match="restitution_speed"):
        simulate(dropped(0.3, "pymunk"))
    with pytest.raises(SceneError, match="restitution_speed"):
        dropped(0.3, "exact", restitution_speed=0.0)
    changed = sc.load("perpendicular", {"particle.restitution_speed": 0.5})
    assert "falls with speed" in str(predict(changed).reason)
