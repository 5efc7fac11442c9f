"""Boxes and polygons with all else of a machine: hinges; closed forms, and Pymunk at its order."""

from math import cos, pi, sin

import numpy as np
import pytest

import chutelab
from shared import seeds
from test_hinge import drawn as hung
from test_hinge import sound

pytest.importorskip("scipy")
from scipy.integrate import solve_ivp

G, M, W, H = 9.81, 0.1, 0.04, 0.02
"""m/s², kg, and width and height of the box, m."""
TURNING = (W * W + H * H) / 12.0
"""I / m of the box about its centre, m²."""
BOX = {"shape": "box", "size": [W, H], "mass": M, "spin": True}
LEVER = {"name": "lever", "from": [-0.3, 0.0], "to": [0.3, 0.0], "hinge": [0.0, 0.0], "mass": 0.1}


def seesaw(left, right, end=0.3, dt=1e-3, engine="contact"):
    """Run two boxes on a see-saw, so many m left and right; the right one is heavier."""
    row = {"velocity": [0.0, 0.0], "interact": True, "friction": 2.0, "restitution": 0.0}
    return sound(chutelab.simulate({
        "particle": [{**BOX, "name": "light"}, {**BOX, "name": "heavy", "mass": 2.0 * M}],
        "surface": [{**LEVER, "friction": 2.0, "restitution": 0.0}],
        "stream": [{"particle": "light", "at": [-left, 0.5 * H], **row},
                   {"particle": "heavy", "at": [right, 0.5 * H], **row}],
        "run": {"until": end, "dt": dt},
    }, engine=engine))  # fmt: skip


def test_boxes_in_balance_on_a_see_saw_stay_so():
    """m l = 2 m l / 2."""
    assert np.abs(seesaw(0.2, 0.1).swings["angle"]).max() < 1e-9


def test_boxes_on_a_see_saw_turn_it_as_one_rigid_body():
    """(I + sum m (l² + h² / 4 + I_box / m)) a = -sum m g (l cos - h / 2 sin), order 2."""
    left, right, end = 0.2, 0.15, 0.3
    inertia = 0.1 * 0.6**2 / 12.0 + sum(
        m * (x * x + 0.25 * H * H + TURNING) for m, x in ((M, left), (2.0 * M, right))
    )

    def rates(_, y):
        places = ((M, -left), (2.0 * M, right))
        return y[1], -sum(
            m * G * (x * cos(y[0]) - 0.5 * H * sin(y[0])) for m, x in places
        ) / inertia  # fmt: skip

    exact = solve_ivp(rates, (0.0, end), (0.0, 0.0), rtol=1e-12, atol=1e-14).y[0, -1]
    off = [abs(seesaw(left, right, end, dt).pose("lever", [end])[0, 2] - exact)
           for dt in (2e-3, 1e-3)]  # fmt: skip
    assert off[1] < 5e-6
    assert off[1] < 0.3 * off[0]
    theirs = chutelab.simulate(seesaw(left, right, end).machine.scene, engine="pymunk")
    assert theirs.pose("lever", [end])[0, 2] == pytest.approx(exact, abs=2e-4)
    assert not theirs.laws
    assert abs(theirs.ledger.residual) < 1e-3 * theirs.ledger.turned_over


@pytest.mark.parametrize("mu", [0.0, 0.3])
def test_a_box_that_pushes_a_flap_keeps_momentum_about_the_hinge(mu):
    """m r × dv + I_box dw = -I dθ'; without friction J = (1 + e) v / (1/m + x²/I_box + l²/I)."""
    e, inertia, v = 0.6, 0.01, 3.0
    scene = {
        "gravity": 0.0, "particle": BOX,
        "surface": [{"name": "flap", "from": [0.0, 0.0], "to": [0.0, -0.4], "hinge": [0.0, 0.0],
                     "inertia": inertia, "spring": 2.0, "restitution": e, "friction": mu}],
        "stream": {"at": [-0.3, -0.3], "velocity": [v, 0.0], "omega": 7.0},
        "run": {"until": 0.15},
    }  # fmt: skip
    recording = sound(chutelab.simulate(scene))
    (blow,) = recording.select("impact")
    (x, y), t = blow["position"], blow["t"]
    swing = recording.swings
    change = swing["rate"][swing["t"] == t].max()
    du, dv = blow["velocity_after"] - blow["velocity_before"]
    turned = blow["omega_after"] - blow["omega_before"]
    own = M * (x * dv - y * du) + M * TURNING * turned
    assert own == pytest.approx(-inertia * change, rel=1e-12)
    corners = [(a * 0.5 * W, b * 0.5 * H) for a in (-1, 1) for b in (-1, 1)]
    angle = 7.0 * t
    px, py = max((cos(angle) * a - sin(angle) * b, sin(angle) * a + cos(angle) * b)
                 for a, b in corners)  # fmt: skip
    assert x + px == pytest.approx(0.0, abs=1e-14)
    if mu:
        return
    # The corner's lever about the centre is py, about the hinge y + py.
    closing = v - 7.0 * py
    impulse = (1.0 + e) * closing / (1.0 / M + py**2 / (M * TURNING) + (y + py) ** 2 / inertia)
    assert blow["normal_impulse"] == pytest.approx(impulse, rel=1e-12)
    assert change == pytest.approx(-impulse * (y + py) / inertia, rel=1e-12)
    off = []
    for dt in (1e-3, 1e-4):
        other = chutelab.simulate(scene, {"run.dt": dt}, engine="pymunk")
        assert not other.laws
        assert abs(other.ledger.residual) < 3e-3 * other.ledger.turned_over
        off.append(np.abs(other.ends()[1]["velocity"] - recording.ends()[1]["velocity"]).max())
    assert off[1] < max(0.3 * off[0], 1e-3)


def cornered(scene, seed, most=10):
    """Return a scene with boxes or polygons instead of disks, rough and elastic as drawn."""
    random = np.random.default_rng(seed + 10_000)
    count = int(random.integers(3, 9))
    around = (np.arange(count) + random.uniform(-0.3, 0.3, count)) * 2.0 * pi / count
    points = np.stack([np.cos(around), np.sin(around)], axis=1) * random.uniform(0.008, 0.018)
    kind = {"shape": "polygon", "points": points.tolist()}
    if random.random() < 0.6:
        kind = {"shape": "box", "size": random.uniform(0.012, 0.03, 2).tolist()}
    stream = {**scene["stream"], "count": min(scene["stream"]["count"], most),
              "restitution": float(random.choice([0.0, 0.3, 0.7])),
              "friction": float(random.uniform(0.0, 1.0))}  # fmt: skip
    return {**scene, "particle": {"mass": 0.008, **kind, "spin": True}, "stream": stream}


@pytest.mark.parametrize("seed", seeds(8, 60))
def test_random_boxes_among_random_hinges_keep_the_laws(seed):
    sound(chutelab.simulate(cornered(hung(seed), seed), engine="contact"))


def test_a_corner_that_meets_a_surface_just_inside_its_end_is_struck():
    """The centre is beyond that end: J = (1 + e) v / (1/m + x²/I), x its way to the corner."""
    e, inside = 0.5, 0.0015
    points = [(-0.012, -0.008), (0.012, 0.006), (0.0, 0.014), (-0.014, 0.004)]
    scene = {
        "gravity": 0.0, "particle": {"shape": "polygon", "points": points, "mass": M, "spin": True},
        "surface": [{"name": "shelf", "from": [-0.1, 0.0], "to": [0.0, 0.0], "restitution": e,
                     "friction": 0.0}],
        "stream": {"at": [0.0, 0.05], "velocity": [0.0, -1.0]}, "run": {"until": 0.1},
    }  # fmt: skip
    outline = chutelab.load(scene).particles[0].outline
    low = min(outline, key=lambda corner: corner[1])
    scene["stream"]["at"][0] = -inside - low[0]
    assert scene["stream"]["at"][0] > 0.005
    recording = sound(chutelab.simulate(scene))
    blow = recording.select("impact")[0]
    turning = chutelab.machine.build(chutelab.load(scene)).particle.inertia
    impulse = (1.0 + e) / (1.0 / M + low[0] ** 2 / float(np.max(turning)))
    assert blow["normal_impulse"] == pytest.approx(impulse, rel=1e-12)
