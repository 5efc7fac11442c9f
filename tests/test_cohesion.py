"""Cohesion, a force that it takes to pull two off each other, against closed forms."""

from math import cos, radians, sin, sqrt

import numpy as np
import pytest

from chutelab import scene as sc
from chutelab.engines.simulation import simulate
from chutelab.scene import SceneError
from chutelab.theory import predict

R, M, G = 0.005, 0.01, 9.81
W = M * G
RANGE = 5e-3 * R  # docs/physics.md: gaps across which it holds


def hanging(count, force, until=0.5, engine="auto", **more):
    """A chain of disks below a plate, each of which touches the next."""
    return sc.from_dict({
        "particle": {"name": "coal", "radius": R, "mass": M},
        "pair": [{"between": ["coal", other], "cohesion": force} for other in ("coal", "roof")],
        "surface": [
            {"name": "roof", "from": [-0.1, 0.0], "to": [0.1, 0.0], "restitution": 0.0},
            {"name": "floor", "from": [-1.0, -2.0], "to": [1.0, -2.0]},
        ],
        "stream": [
            {"name": f"row {n}", "particle": "coal", "at": [0.0, -R - 2.0 * R * n],
             "velocity": [0.0, 0.0], "interact": count > 1}
            for n in range(count)
        ],
        "run": {"until": until, "loads": 0.01, "engine": engine}, **more,
    })  # fmt: skip


@pytest.mark.parametrize("count", [1, 2, 4])
def test_a_chain_hangs_while_its_weight_is_less_than_the_force(count):
    """The uppermost contact bears the weight of all; it is the first that gives way."""
    run = simulate(hanging(count, 1.01 * count * W))
    ends = run.at([0.5])[0][0]
    assert ends[:, 1] == pytest.approx(-R - 2.0 * R * np.arange(count), abs=1e-3 * R)
    # The plate is pulled down by the weight: its normal load is negative.
    assert run.loads("roof").normal[10:40] == pytest.approx(-count * W, rel=1e-6)
    assert not run.laws
    run = simulate(hanging(count, 0.9 * count * W))
    # It falls with what is left of the weight, 0.1 g, while that is as far as cohesion reaches.
    reach, slow = sqrt(2.0 * RANGE / (0.1 * G)), 0.1 * G
    fallen = 0.5 * G * (0.5 - reach) ** 2 + slow * reach * (0.5 - reach)
    assert run.at([0.5])[0][0][0, 1] == pytest.approx(-R - fallen, abs=0.02)
    assert not run.laws
    assert run.ledger.relative_residual < 1e-11


@pytest.mark.parametrize(("bonds", "holds"), [(2.02, True), (1.8, False)])
@pytest.mark.parametrize(("light", "gravity"), [(0.5, 9.81), (2.0, 3.7)])
def test_a_bond_number_counts_weights_of_the_lighter_kind(bonds, holds, light, gravity):
    """F = Bo g min(m, m'): a disk that hangs below one of its weight and more is let go by Bo."""
    kinds = [("upper", light * M), ("lower", M)]
    rows = [("upper", "roof", 20.0), ("upper", "lower", bonds * M / min(M, light * M) / 2.0)]
    run = simulate(sc.from_dict({
        "gravity": gravity,
        "particle": [{"name": name, "radius": R, "mass": mass} for name, mass in kinds],
        "pair": [{"between": [a, b], "bond_number": number} for a, b, number in rows],
        "surface": [{"name": "roof", "from": [-0.1, 0.0], "to": [0.1, 0.0], "restitution": 0.0}],
        "stream": [
            {"name": name, "particle": name, "at": [0.0, -R - 2.0 * R * n],
             "velocity": [0.0, 0.0], "interact": True}
            for n, (name, _) in enumerate(kinds)
        ],
        "run": {"until": 0.3},
    }))  # fmt: skip
    # The lower one weighs M g, and the force is bonds / 2 of that: it holds from bonds = 2 on.
    upper, lower = run.at([0.3])[0][0][:, 1]
    assert upper == pytest.approx(-R, abs=1e-3 * R)
    assert (abs(lower + 3.0 * R) < 1e-3 * R) == holds


@pytest.mark.parametrize("angle", [20.0, 40.0, 50.0, 60.0])
@pytest.mark.parametrize("force", [0.0, 0.05, 0.1])
def test_friction_is_that_of_weight_and_cohesion(angle, force):
    """Down an incline: a = g sin α - µ (g cos α + F / m), if that is more than 0."""
    mu, t, a = 0.4, 0.4, radians(angle)
    away, up = np.array([-sin(a), cos(a)]), np.array([cos(a), sin(a)])
    run = simulate({
        "particle": {"name": "coal", "radius": R, "mass": M},
        "pair": [{"between": ["coal", "plane"], "cohesion": force, "friction": mu}],
        "surface": [{"name": "plane", "from": [0.0, 0.0], "to": list(3.0 * up)}],
        "stream": {"at": list(2.5 * up + R * away), "velocity": [0.0, 0.0]}, "run": {"until": t},
    })  # fmt: skip
    places = run.at([0.0, t])[0][:, 0]
    slides = max(G * sin(a) - mu * (G * cos(a) + force / M), 0.0)
    assert np.hypot(*(places[1] - places[0])) == pytest.approx(0.5 * slides * t**2, abs=1e-12)


@pytest.mark.parametrize(("force", "speed"), [(0.2, 1.0), (1.0, 0.5), (5.0, 0.5), (20.0, 0.5)])
def test_a_blow_pays_the_energy_to_be_pulled_off(force, speed):
    """½ m v'² = ε² ½ m v² - F d, d the range; what has less stays."""
    e = 0.5
    run = simulate({
        "gravity": 0.0, "particle": {"name": "coal", "radius": R, "mass": M},
        "pair": [{"between": ["coal", "wall"], "cohesion": force, "restitution": e}],
        "surface": [{"name": "wall", "from": [-1.0, 0.0], "to": [1.0, 0.0], "friction": 0.0}],
        "stream": {"at": [0.0, 0.1], "velocity": [0.0, -speed]}, "run": {"until": 0.5},
    })  # fmt: skip
    left = (e * speed) ** 2 - 2.0 * force * RANGE / M
    assert run.knots["velocity"][-1, 1] == pytest.approx(sqrt(max(left, 0.0)), abs=1e-12)
    lost = 0.5 * M * (speed**2 - max(left, 0.0))
    assert run.ledger.restitution_loss == pytest.approx(lost, rel=1e-9)
    if left < 0.0:
        assert run.at([0.5])[0][0, 0, 1] == pytest.approx(R, abs=1e-3 * R)


@pytest.mark.parametrize("tension", [0.1, 0.95, 1.05])
def test_a_pair_turns_about_its_middle_as_long_as_cohesion_gives_the_centripetal_force(tension):
    """F = m w² r holds smooth disks on a circle; without, they leave along its tangent."""
    force, t = 1.0, 0.2
    turn = sqrt(tension * force / (M * R))
    run = simulate({
        "gravity": 0.0, "particle": {"name": "coal", "radius": R, "mass": M},
        "pair": [{"between": ["coal", "coal"], "cohesion": force, "restitution": 0.0,
                  "friction": 0.0}],
        "stream": [
            {"name": name, "particle": "coal", "at": [side * R, 0.0], "interact": True,
             "velocity": [0.0, side * turn * R]}
            for name, side in (("left", -1.0), ("right", 1.0))
        ],
        "run": {"until": t, "dt": 1e-4},
    })  # fmt: skip
    (x, y), *_ = run.at([t])[0][0] - run.at([t])[0][0].mean(axis=0)
    if tension > 1.0:
        assert np.hypot(x, y) == pytest.approx(R * np.hypot(1.0, turn * t), rel=1e-6)
        return
    assert np.hypot(x, y) == pytest.approx(R, rel=5e-4)
    off = np.angle(complex(x, y) / complex(-R, 0.0) * np.exp(-1j * turn * t))
    assert abs(off) < 2e-3 * turn * t
    assert run.ledger.kinetic[1] == pytest.approx(M * (turn * R) ** 2, rel=1e-3)
    assert run.ledger.relative_residual < 1e-11


def heaped(pair):
    return simulate({
        "particle": {"name": "coal", "radius": [0.004, 0.006], "mass": M, "spin": True},
        "pair": pair,
        "surface": [{"name": "floor", "points": [[-0.3, 0.0], [0.3, 0.0]], "restitution": 0.2,
                     "friction": 0.5}],
        "stream": {"particle": "coal", "count": 100, "fill": [[-0.03, 0.02], [0.03, 0.5]],
                   "interact": True, "restitution": 0.3, "friction": 0.5},
        "run": {"until": 1.0},
    })  # fmt: skip


def test_what_clings_keeps_the_laws_and_lies_steeper():
    both = [{"between": ["coal", other], "cohesion": 30.0 * W} for other in ("coal", "floor")]
    none = [pair | {"cohesion": 0.0} for pair in both]
    loose, clings, zero = map(heaped, ([], both, none))
    for run in (loose, clings):
        assert not run.laws
        assert run.ledger.relative_residual < 1e-11
    spread, narrow = (np.nanstd(run.at([1.0])[0][0, :, 0]) for run in (loose, clings))
    assert narrow < 0.7 * spread
    # Without it the bits are the same.
    assert zero.knots.tobytes() == loose.knots.tobytes()


def test_what_does_not_have_it_says_so():
    for engine in ("exact", "pymunk"):
        with pytest.raises(SceneError, match="cohesion"):
            simulate(hanging(1, 1.0, engine=engine))
    with pytest.raises(SceneError, match=r"pair\[0\].cohesion = -1"):
        hanging(1, -1.0)
    scene = sc.load("perpendicular", {"particle.name": "coal"})
    clings = sc.from_dict(
        scene.model_dump(by_alias=True, exclude_unset=True)
        | {"pair": [{"between": ["coal", "plate"], "cohesion": 0.1}]}
    )
    assert "clings" in str(predict(clings).reason)
