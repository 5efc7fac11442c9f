"""Random machines that move and swing, with joints: two engines that share no mechanics agree."""

import numpy as np
import pytest

import chutelab
from chutelab.results.laws import LEDGER
from sandbox import bodies
from shared import seeds
from test_hinge import drawn as hung
from test_hinge import sound

STEPS = (1e-3, 2.5e-4)
"""s, of Pymunk; its errors are of the order of its step."""
FINER = (2.5e-4, 6.25e-5, 1.5e-5)
"""s; so many are tried until one is as near as its order."""


@pytest.mark.parametrize("seed", seeds(0, 100))
def test_what_swings_by_itself_does_so_in_both_engines(seed):
    """Hinges anywhere, springs, dampers, stops, motors: angles over 0.7 s of each alone."""
    scene = hung(seed)
    box, swings = scene["surface"][:3], scene["surface"][3:]
    times = np.linspace(0.02, 0.69, 30)
    for one in swings:
        # An arc is 2,725 segments there.
        if "center" in one:
            continue
        still = {"at": [0.375, -0.28], "velocity": [0.0, 0.0]}
        alone = {**scene, "surface": [*box, one], "stream": still, "run": {"until": 0.7}}
        angles = chutelab.simulate(alone, engine="contact").pose(one["name"], times)[:, 2]
        off = []
        for dt in STEPS:
            other = chutelab.simulate(alone, {"run.dt": dt}, engine="pymunk")
            off.append(np.abs(other.pose(one["name"], times)[:, 2] - angles).max())
            told = {broken.law for broken in other.laws}
            # What is damped within a step is rough there, and says so.
            assert abs(other.ledger.residual) < 0.3 * other.ledger.turned_over or LEDGER in told
        assert off[1] < max(0.05, 0.6 * off[0]), one


def drawn(seed, *, tied=False):
    """A ball that falls on to a surface that moves, or hangs, with or without a joint, or `tied`.

    One in three is a polygon of up to twenty faces, each of which is a body of its own there.
    """
    random = np.random.default_rng(seed)
    half = random.uniform(0.06, 0.12) * np.array(
        [np.cos(a := random.uniform(-0.6, 0.6)), np.sin(a)]
    )
    motion = {
        0: {"shake": {"by": random.uniform(-0.01, 0.01, 2).tolist(),
                      "frequency": random.uniform(1.0, 12.0)}},
        1: {"turn": random.uniform(-200.0, 200.0),
            "pivot": random.uniform(-0.05, 0.05, 2).tolist()},
        2: {"travel": {"to": (random.uniform(-0.05, 0.05, 2) - half).tolist(),
                       "at": 0.05, "in": 0.3}},
        3: {"hinge": random.uniform(-0.06, 0.06, 2).tolist(), "mass": random.uniform(0.05, 1.0),
            "spring": random.uniform(0.0, 3.0), "damper": random.uniform(0.0, 0.02)},
        4: {},
    }[3 if tied else int(random.integers(5))]  # fmt: skip
    pair = {"restitution": random.uniform(0.2, 0.9), "friction": random.uniform(0.0, 0.6)}
    board = {"name": "board", "from": (-half).tolist(), "to": half.tolist(), **motion, **pair}
    floor = {"name": "floor", "from": [-2.0, -0.6], "to": [2.0, -0.6], "restitution": 0.4}
    place = [float(random.uniform(-0.06, 0.06)), float(random.uniform(0.1, 0.2))]
    scene = {
        "particle": {"radius": random.uniform(0.006, 0.015), "mass": random.uniform(0.01, 0.1),
                     "spin": bool(random.integers(2))},
        "surface": [board, floor],
        "stream": {"at": place, "velocity": random.uniform(-0.5, 0.2, 2).tolist()},
        "run": {"until": float(random.uniform(0.2, 0.45))},
    }  # fmt: skip
    kind = ""
    if tied or ("hinge" not in motion and random.random() < 0.5):
        kind = ("string", "rod", "spring", "pin")[int(random.integers(4))]
        joint = {
            "from": [place[0] + random.uniform(-0.2, 0.2), place[1] + random.uniform(0.05, 0.2)]
        }
        if kind == "spring":
            joint |= {"stiffness": random.uniform(1.0, 30.0), "damper": random.uniform(0.0, 0.2)}
        if kind == "pin":
            joint["from"] = [place[0] + random.uniform(-0.05, 0.05), place[1] + 0.02]
        scene[kind] = [joint]
        if kind == "pin":
            scene["particle"]["spin"], scene["stream"]["velocity"] = True, [0.0, 0.0]
    if "hinge" in motion or kind:
        # Chipmunk finds blows with friction and joints in turn, not by Newton's and Coulomb's laws.
        board["friction"] = floor["friction"] = 0.0
    if random.random() < 1 / 3 and "travel" not in motion:
        count = int(random.integers(3, 21))
        turns = np.arange(count + 1) % count * (2.0 * np.pi / count) + random.uniform(0.0, 1.0)
        far = random.uniform(0.4, 0.6, count)[np.arange(count + 1) % count] * np.hypot(*half)
        del board["from"], board["to"]
        board["points"] = (far * np.array([np.cos(turns), np.sin(turns)])).T.tolist()
    return scene


@pytest.mark.parametrize("seed", seeds(4, 300))
def test_a_ball_and_a_machine_go_the_same_way_in_both_engines(seed):
    goes_alike(drawn(seed))


@pytest.mark.parametrize("seed", seeds(2, 100))
def test_a_ball_on_a_joint_and_a_hinge_go_the_same_way_in_both_engines(seed):
    goes_alike(drawn(seed, tied=True))


def goes_alike(scene):
    """Where a push of 1e-9 m/s grows to less than fifty times its way: to Pymunk's step.

    Beside a corner the way of a step tells which of two faces is struck there. Then a smaller step
    has to be as near as its own order.
    """
    end = [scene["run"]["until"] - 1e-6]
    mine = chutelab.simulate(scene, engine="contact")
    assert not mine.laws
    u, v = scene["stream"]["velocity"]
    pushed = {**scene, "stream": {**scene["stream"], "velocity": [u + 1e-9, v + 1e-9]}}
    place = mine.at(end).position[0]
    apart = np.abs(chutelab.simulate(pushed, engine="contact").at(end).position[0] - place).max()
    grows = apart / (1e-9 * end[0])
    if grows > 50.0:
        pytest.skip(f"it grows {grows:.3g} times")
    off = []
    for dt in FINER:
        theirs = chutelab.simulate(scene, {"run.dt": dt}, engine="pymunk")
        off.append(np.abs(theirs.at(end).position[0] - place).max())
        if off[-1] < 8.0 * dt * max(1.0, grows):
            return
    raise AssertionError(off)


@pytest.mark.parametrize("seed", seeds(20, 300))
def test_bodies_among_all_that_stands_hangs_and_moves_keep_the_laws(seed):
    """Boxes, polygons, disks; pegs, bowls, hinges, drives, gates, one-sided lines, joints, air."""
    sound(chutelab.simulate(bodies(seed), engine="contact"))


def test_what_lies_between_a_falling_stone_and_a_stop_of_its_hinge_holds_the_stone():
    """What is wedged is solved to the end: sweeps go on as long as the stop turns the board."""
    corners = [(0.0076, 0.0018), (0.0014, 0.0077), (-0.0072, 0.003), (-0.0026, -0.0074)]
    scene = {
        "particle": {"shape": "polygon", "points": corners, "mass": 1.0, "spin": True},
        "surface": [{"name": "board", "from": [-0.7854, -0.083], "to": [-0.6445, -0.117],
                     "hinge": [-0.7008, -0.1034], "mass": 1.0, "stops_deg": [-31.7, 30.9],
                     "spring": 1.81, "damper": 0.0774, "friction": 0.0}],
        "stream": {"at": [-0.75, 0.1966], "velocity": [-0.087, -0.236], "angle_deg": -62.7},
        "run": {"until": 0.3},
    }  # fmt: skip
    sound(chutelab.simulate(scene, engine="contact"))


def test_what_hops_fast_gives_no_energy():
    """A disk that skids over a corner."""
    sound(chutelab.simulate(bodies(223), engine="contact"))
