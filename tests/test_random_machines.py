"""Random machines that move and swing, with joints: two engines that share no mechanics agree."""

import copy
from functools import cache
from itertools import pairwise

import numpy as np
import pytest

import chutelab
from chutelab.results import laws
from sandbox import bodies
from shared import seeds
from test_hinge import drawn as hung
from test_hinge import sound
from test_run_laws import spoilt

STEPS = (1e-3, 2.5e-4)
"""s, of Pymunk; its errors are of the order of its step."""
FINER = (2.5e-4, 6.25e-5, 1.5e-5)
"""s; so many are tried until one is as near as its order."""
CALM = 50.0
"""Times that a push may grow in what is no chaos."""


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
            assert (
                abs(other.ledger.residual) < 0.3 * other.ledger.turned_over or laws.LEDGER in told
            )
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


# Chipmunk shares no blow rightly between joints and friction: its ledger says so.
@pytest.mark.filterwarnings("ignore:LAW BROKEN")
@pytest.mark.parametrize("seed", seeds(3, 100))
def test_boxes_and_polygons_go_the_same_way_in_both_engines(seed):
    """One or two among what stands, hangs and moves, or tied."""
    if seed == 82:
        pytest.xfail("a corner, which is round in Chipmunk, turns it by 1 % less: 3 mm at last")
    goes_alike(bodies(seed, few=True))


def test_most_of_them_are_judged():
    """So that what is skipped as chaotic does not hide what is wrong."""
    calm = [growth(bodies(seed, few=True)) < CALM for seed in range(50)]
    assert np.mean(calm) > 0.95


def growth(scene):
    """How many times its way a push of 1e-9 m/s of each particle grows."""
    pushed = copy.deepcopy(scene)
    for row in [*np.atleast_1d(pushed["stream"])]:
        row["velocity"] = [v + 1e-9 for v in row["velocity"]]
    one, other = (last(each, engine="contact") for each in (scene, pushed))
    return np.abs(one - other).max() / (1e-9 * scene["run"]["until"])


def last(scene, *changes, engine):
    """Where all particles are as a run ends, m; of the contact engine it keeps all laws."""
    recording = chutelab.simulate(scene, *changes, engine=engine)
    assert engine == "pymunk" or not recording.laws
    return recording.at([scene["run"]["until"] - 1e-6]).position


def goes_alike(scene):
    """Where a push grows to less than `CALM` times its way: to Pymunk's step.

    Beside a corner the way of a step tells which of two faces is struck there. Then a smaller step
    has to be as near as its own order.
    """
    grows, off = growth(scene), []
    if grows > CALM:
        pytest.skip(f"it grows {grows:.3g} times")
    for dt in FINER:
        mine, theirs = (last(scene, {"run.dt": dt}, engine=name) for name in ("contact", "pymunk"))
        off.append(np.abs(theirs - mine).max())
        if off[-1] < 8.0 * dt * max(1.0, grows):
            return
    raise AssertionError(off)


@pytest.mark.parametrize("both", [False, True])
@pytest.mark.parametrize("seed", seeds(10, 300))
def test_bodies_among_all_that_stands_hangs_and_moves_keep_the_laws(seed, both):
    """Boxes, polygons, disks; pegs, bowls, hinges, drives, gates, one-sided lines, joints, air."""
    sound(chutelab.simulate(bodies(seed, both=both), engine="contact"))


def sinks(recording, by):
    """Have the lowest particle end lower by so much, m."""
    low = min(recording.offsets[1:] - 1, key=lambda row: recording.knots["position"][row, 1])

    def change(knots):
        knots["position"][low, 1] -= by

    return change


def meets(recording):
    """Have one particle go where another one goes."""
    own = slice(*recording.offsets[:2])

    def change(knots):
        there = recording.at(knots["t"][own]).position[:, -1]
        knots["position"][own] = np.where(np.isfinite(there), there, knots["position"][own])

    return change


def late(recording, name, amount):
    """Have a quantity of each particle differ in the second half of its track."""

    def change(knots):
        for first, end in pairwise(recording.offsets.tolist()):
            knots[name][(first + end) // 2 : end] += amount

    return change


def unsolved(steps):
    steps[len(steps) // 2] = 0.2


FAULTS = {
    laws.FINITE: lambda run, _: {"knots": late(run, "omega", np.nan)},
    laws.THROUGH: lambda run, _: {"knots": sinks(run, 2.0)},
    laws.INSIDE: lambda run, _: {"knots": sinks(run, 0.004)},
    laws.APART: lambda run, _: {"knots": meets(run)},
    laws.ENERGY: lambda run, _: {"knots": late(run, "velocity", [0.0, 9.0])},
    laws.LOSSES: lambda run, play: {"knots": late(run, "entries", [0.0, -0.1 * play, 0.0])},
    laws.LEDGER: lambda run, play: {"knots": late(run, "entries", [0.0, 0.0, 1e-3 * play])},
    laws.SOLVED: lambda run, _: {"unsolved": unsolved},
}
"""A fault for each law that the contact engine can break: what a recording has instead."""


@cache
def among_bodies(seed):
    return chutelab.simulate(bodies(seed, both=True), engine="contact")


@pytest.mark.parametrize("law", FAULTS)
@pytest.mark.parametrize("seed", [19, 26])
def test_each_law_sees_its_fault_among_bodies(seed, law):
    """Boards that turn, shake and hang, a string; one that turns, one that hangs, a rod, a pin."""
    run = among_bodies(seed)
    wrong = spoilt(run, **FAULTS[law](run, run.ledger.turned_over))
    assert law in {broken.law for broken in wrong.laws}


HALL = {"points": [[-1.0, 1.5], [-1.0, -0.8], [1.0, -0.8], [1.0, 1.5]], "restitution": 0.0}
BOW = {"center": [-0.6728864, -0.1], "radius": 0.2378392, "from_deg": -3.0769223,
       "to_deg": 177.522489}  # fmt: skip
STONES = [
    ([[0.0076, 0.0018], [0.0014, 0.0077], [-0.0072, 0.003], [-0.0026, -0.0074]], 1.0,
     {**HALL, "friction": 0.0}, {"at": [0.45, 0.2188], "velocity": [0.7986, 0.9658]}),
    ([[0.0271, 0.0069], [-0.0231, 0.0157], [-0.0165, -0.0226]], 0.1, {**HALL, "friction": 0.5085},
     {"at": [-0.75, 0.3893], "velocity": [-0.5776, 0.6865], "omega": -15.7357, "angle_deg": 45.0}),
    ([[0.0089384, -0.0011329], [0.0005317, 0.0089942], [-0.0070752, 0.0055785],
      [-0.0075107, -0.0049767], [0.0030044, -0.0084942]], 1.0, BOW,
     {"at": [-0.2166667, 0.6699094], "velocity": [-0.7269874, 0.0692307], "angle_deg": 45.0}),
]  # fmt: skip


@pytest.mark.parametrize(("points", "mass", "surface", "stream"), STONES)
def test_one_stone_gets_energy_of_no_corner_and_rolls_into_no_arc(points, mass, surface, stream):
    """Sliding off an end it leaves by its edge; rolling on to an edge is a blow when it is fast."""
    stone = {"shape": "polygon", "points": points, "mass": mass, "spin": True}
    scene = {"particle": stone, "surface": [{"name": "it", **surface}], "run": {"until": 0.94},
             "stream": {**stream, "interact": True}}  # fmt: skip
    sound(chutelab.simulate(scene, engine="contact"))


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


def test_what_slid_off_a_corner_is_not_pushed_by_the_edge_behind_it():
    """A box slides along another and off its corner: steps of all lengths give the same way."""
    box = {"shape": "box", "size": [0.0753, 0.0377], "mass": 0.01, "spin": True}
    first = {"at": [-0.05, 0.1584], "velocity": [-0.594, -0.6605], "omega": 16.85,
             "interact": True, "restitution": 0.0, "friction": 0.2}  # fmt: skip
    then = {"at": [0.05, 0.178], "velocity": [-0.1967, 0.6358]}
    scene = {
        "particle": box, "stream": [first, then], "run": {"until": 0.25},
        "rod": [{"particle": 0, "from": [0.0049, 0.3534]}], "string": [{"particle": 1, "other": 0}],
    }  # fmt: skip
    ends = [
        sound(chutelab.simulate(scene, {"run.dt": dt}, engine="contact")).at([0.249]).position
        for dt in (1e-3, 5e-5)
    ]
    assert ends[1] == pytest.approx(ends[0], abs=1e-6)
