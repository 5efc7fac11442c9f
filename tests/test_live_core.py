"""Scenes become rows and runs in the page's host of the core as in Python's, to the last bit."""

import numpy as np
import pytest

import sandbox
from chutelab import core as module
from chutelab.engines import contact as engine
from chutelab.engines.simulation import simulate
from chutelab.machine import build
from chutelab.pictures.live.describe import describe
from chutelab.results.loads import gather
from chutelab.results.rows import EVENT
from chutelab.scene import from_dict, load, parse
from live.node import ask, needs_node, page_scene

pytestmark = needs_node

SCENES = [
    ("perpendicular", "run.loads=0.01"), ("hopper", "stream.count=30", "run.loads=0.05"),
    ("stream", "stream.count=30"), ("slip",), ("spoon",),
    ("cascade",), ("two-sizes",), ("inclined-conveyor",),
    ("perpendicular", "incoming.friction=0.5", "run.until=settled"),
    ("belt-landing",), ("free-fall",), ("mixture", "stream.fines.count=30"),
    ("slip", "particle.shape=sphere", "particle.spin=true"),
    *(("stream", "stream.count=20", f"stream.seed={seed}") for seed in (2**32, 2**53 - 1)),
]  # fmt: skip
BALL = {"stream": {"at": [0.0, 0.3], "velocity": [0.1, 0.0]}, "run": {"until": 0.5}}
LINE = {"name": "line", "from": [-0.2, 0.0], "to": [0.3, 0.0], "restitution": 0.6}
HANGS = {"hinge": "pivot", "mass": 0.1, "friction": 0.5}
MOVING = [
    {"shake": {"by": [0.001, 0.004], "frequency": 12.5, "phase_deg": 30.0}, "speed": 0.5},
    {"turn": -40.0, "pivot": [0.1, -0.05]}, {"travel": {"to": [-0.3, 0.1], "in": 0.6}},
    {"turn": 20.0, "shake": {"by": [0.01, 0.0], "frequency": 3.0}, "closes_at": 0.05},
    {**HANGS, "spring": 2.0, "rest_deg": 5.0, "damper": 0.01},
    {**HANGS, "stops_deg": [-30.0, 15.0]}, {**HANGS, "hinge": [0.05, 0.0], "inertia": 0.5},
    {**HANGS, "motor": {"speed_deg": 120.0, "torque": 0.3}},
]  # fmt: skip
BELL = {"touched": "line"}
WAITING = [
    {"opens_when": BELL}, {"closes_when": BELL}, {"turn": 90.0, "starts_when": BELL},
    {"shake": {"by": [0.0, 0.01], "frequency": 9.0}, "starts_when": BELL},
    {"travel": {"to": [0.0, 1.0], "at": 0.1, "in": 0.3}, "starts_when": BELL},
    {**HANGS, "motor": {"speed_deg": 200.0, "torque": 1.0}, "starts_when": BELL},
]  # fmt: skip
MANY = [
    ("inclined-40",),
    ("low-speed",),
    ("stream", "stream.count=60"),
    ("hopper", "stream.count=150"),
]


def same_runs(scenes):
    told = [page_scene(scene) for scene in scenes]
    swung = 0
    lab = describe(load("perpendicular"))
    answers = ask("core.mjs", {"lab": lab, "scenes": [given for given, _ in told]})
    for (given, scene), answer in zip(told, answers, strict=True):
        assert parse(answer["toml"]) == scene, given
        machine = build(scene)
        machine = engine.together(machine) if scene.cornered else machine
        job = engine.Job(module.Module(), machine)
        assert job.run(None) is None
        job.drain()
        assert answer["state"] == "done"
        disks, knots, angles = map(np.concatenate, zip(*job.knots, strict=True))
        its = np.array(answer["knots"]).reshape(-1, 11)
        assert np.array_equal(its[:, :9], knots.view("<f8").reshape(-1, 9)), given
        assert np.array_equal(its[:, 9], disks), given
        assert np.array_equal(its[:, 10], angles), given
        events = np.concatenate(job.events).view(EVENT)
        assert [event["t"] for event in answer["events"]] == events["t"].tolist(), given
        assert [event["kind"] for event in answer["events"]] == events["kind"].tolist(), given
        states = job.module.array("swings", module.dtype("Swing"), job.module.world.swing_count)
        swings = np.array(answer["swings"]).reshape(-1, 7)
        for n, name in ((0, "t"), (1, "angle"), (2, "rate"), (6, "surface")):
            assert np.array_equal(swings[:, n], states[name]), given
        swung += len(states)
        triggers = job.module.array(
            "triggers", module.dtype("Trigger"), job.module.world.trigger_count
        )
        assert np.array_equal([float(t) for t in answer["triggered"]], triggers["t"]), given
        loads = gather(job.module, job.owners)
        assert answer["loads"] == loads.view("<f8").ravel().tolist(), given
        books = job.module.array("books", engine.REAL, 3 * (job.owners + 1)).reshape(-1, 3)
        assert np.array_equal(np.array(answer["books"]), books), given
    return swung


@pytest.mark.parametrize("scenes", [SCENES, pytest.param(MANY, marks=pytest.mark.slow)])
def test_the_pages_host_runs_every_kind_of_scene_as_python_does(scenes):
    same_runs([load(name, overrides) for name, *overrides in scenes])


def test_what_moves_does_so_as_in_python():
    kinds = {"particle": [{"name": "a"}, {"name": "b", "radius": [0.005, 0.01], "spin": True}]}
    two = [
        {**BALL["stream"], "particle": "a", "interact": True},
        {"fill": [[-0.1, 0.2], [0.1, 0.28]], "count": 6, "particle": "b", "interact": True},
    ]
    crowd = {**BALL, **kinds, "stream": two}
    arc = {"name": "bowl", "center": [0.0, 0.2], "radius": 0.2, "from_deg": 200, "to_deg": 340}
    scenes = [
        from_dict({**base, "surface": [{**shape, **keys}]})
        for base, shape in ((BALL, LINE), (crowd, arc))
        for keys in MOVING
    ]
    scenes += [
        from_dict({**crowd, "surface": [{**shape, "passes": passes, **keys}]})
        for shape, ways in ((LINE, ("up", "down")), (arc, ("in", "out")))
        for passes, keys in zip(ways, MOVING[:2], strict=True)
    ]  # fmt: skip
    tilted = from_dict({**crowd, "gravity_deg": 55.0, "surface": [{**LINE, **HANGS}]})
    assert same_runs([tilted, load("see-saw"), load("damper-plate"), *scenes]) > 1000


def test_what_hangs_on_joints_moves_as_in_python():
    pair = {"fill": [[-0.1, 0.2], [0.1, 0.28]], "count": 6, "interact": True}
    crowd = {**BALL, "particle": {"radius": 0.008, "spin": True}, "stream": pair, "surface": [LINE]}
    above = {"from": [-0.2, 0.5]}
    apart = [{"particle": 1, "other": 4}, {"particle": 2, **above}]
    soft = {"stiffness": 4.0, "damper": 0.02, "length": 0.1}
    scenes = [from_dict({**crowd, table: apart}) for table in ("string", "rod")]
    scenes.append(from_dict({**crowd, "spring": [{**one, **soft} for one in apart]}))
    long = [{**above, "length": 0.6}]
    pins = [{"from": [0.0, 0.24], "particle": 0}, {"from": [0.1, 0.2], "particle": 3, "other": 5}]
    scenes += [from_dict({**crowd, "pin": pins}), from_dict({**BALL, "string": long})]
    over = [{"particle": 1, "other": 4, "over": [0.0, 0.6]}]
    scenes += [
        from_dict({**crowd, "string": over}),
        from_dict({**crowd, "string": [{**over[0], "length": 1.2}]}),
    ]
    boxes = {**crowd, "particle": CORNERED[0]}
    scenes += [from_dict({**boxes, **joints}) for joints in ({"rod": apart}, {"pin": pins})]
    hung = {**crowd, "surface": [{**LINE, **HANGS, "spring": 0.5}]}
    scenes += [from_dict({**hung, **joints}) for joints in ({"string": apart}, {"pin": pins})]
    same_runs([load("cradle"), *scenes])
    lab = describe(load("perpendicular"))
    wrong = (
        ("string", {**above, "length": 0.01}, "string[0].length"),
        ("rod", {**above, "particle": 1}, "rod[0].particle"),
        ("pin", {**above, "other": 0}, "pin[0].other"),
        ("rod", {**above, "other": 0}, "rod[0].other"),
        ("string", {}, "string[0].from"),
        ("string", {**above, "over": [0.0, 0.5]}, "string[0].over"),
        ("spring", above, "spring[0].stiffness"),
    )
    given = [{**BALL, table: [row]} for table, row, _ in wrong]
    answers = ask("bits.mjs", {"lab": lab, "scenes": given})["scenes"]
    assert [answer["fault"]["key"] for answer in answers] == [key for *_, key in wrong]


def test_what_waits_for_a_touch_acts_as_in_python():
    falls = {"at": [-0.1, 0.5], "velocity": [0.1, 0.0], "interact": True}
    shelf = {"name": "shelf", "from": [0.05, 0.15], "to": [0.4, 0.15]}
    scenes = [
        from_dict({**BALL, "stream": [{**BALL["stream"], "at": [0.2, 0.3], "interact": True},
                                      falls], "surface": [LINE, {**shelf, **keys}]})
        for keys in WAITING
    ]  # fmt: skip
    for scene in scenes:
        assert np.isfinite(simulate(scene).triggered).all()
    same_runs(scenes)


def test_what_clings_passes_or_flies_in_air_does_so_as_in_python():
    kinds = {"particle": [{"name": "a"}, {"name": "b", "radius": [0.005, 0.01], "spin": True}]}
    two = [
        {"fill": [[-0.1, 0.1], [0.1, 0.2]], "count": 6, "particle": name, "interact": True}
        for name in "ab"
    ]
    two[1]["fill"] = [[-0.1, 0.22], [0.1, 0.32]]
    crowd = {**BALL, **kinds, "stream": two, "surface": [LINE]}
    pairs = [
        [{"between": ["a", "b"], "cohesion": 0.5}, {"between": ["line", "b"], "cohesion": 0.2}],
        [{"between": ["b", "b"], "cohesion": 0.5, "friction": 0.2}],
        [{"between": ["a", "b"], "meet": False}],
    ]
    scenes = [from_dict({**crowd, "pair": pair}) for pair in pairs]
    flying = (crowd, {**crowd, "pair": pairs[0]}, BALL)
    flying = (*flying, {**BALL, "particle": CORNERED[1]})
    scenes += [from_dict({**base, "air_density": 40.0}) for base in flying]
    same_runs(scenes)
    runs = [simulate(scene).knots.tobytes() for scene in (from_dict(crowd), *scenes[:4])]
    assert len({*runs}) == 5


CORNERED = [
    {"shape": "box", "size": [0.03, 0.012], "spin": True},
    {"shape": "polygon", "points": [[0.0, 0.0], [0.01, 0.03], [-0.017, 0.011]], "spin": True},
    {"shape": "polygon", "points": [[0.0, 0.01], [0.02, 0.0], [0.037, 0.013], [0.03, 0.03],
                                    [0.01, 0.029]], "mass": 0.03},
]  # fmt: skip


def test_boxes_and_polygons_move_as_in_python():
    names = [{"name": f"k{n}", **kind} for n, kind in enumerate(CORNERED)]
    boxes = [[[-0.1, 0.05 + 0.1 * n], [0.1, 0.14 + 0.1 * n]] for n in range(3)]
    kinds = [*names, {"name": "ball", "radius": 0.01}]
    crowd = {**BALL, "particle": kinds, "surface": [LINE], "stream": [
        *({"particle": f"k{n}", "fill": fill, "count": 3, "interact": True, "omega": 3.0 * (n < 2),
           "angle_deg": 25.0 * n}
          for n, fill in enumerate(boxes)),
        {"particle": "ball", "at": [0.0, 0.4], "velocity": [0.0, -0.5]},
    ]}  # fmt: skip
    alone = [{**BALL, "particle": kind, "surface": [LINE]} for kind in CORNERED]
    row = {"stream": {"at": [-0.1, 0.2], "to": [0.2, 0.2], "velocity": [0.3, 0.0], "count": 4}}
    ways = (MOVING[0], MOVING[4], {"passes": "up"})
    moving = [
        {**base, "surface": [{**LINE, **keys}]} for base in (crowd, alone[0]) for keys in ways
    ]
    scenes = [crowd, {**crowd, "gravity_deg": 30.0}, *alone, {**alone[1], **row}, *moving]
    same_runs([load("domino-gate"), *map(from_dict, scenes)])


@pytest.mark.parametrize("count", [8, pytest.param(200, marks=pytest.mark.slow)])
def test_it_runs_scenes_with_any_keys_as_python_does(count):
    same_runs([from_dict(sandbox.tables(seed)) for seed in range(count)])
