"""What the page does itself, beside the core: keys, refusals, transfers, predictions."""

import json

import numpy as np
import pytest

import sandbox
from chutelab.machine import build
from chutelab.pictures.live.describe import describe
from chutelab.scene import SceneError, from_dict, load, parse
from chutelab.scene.overrides import Override
from chutelab.theory import Reason, predict, transfer
from chutelab.theory.prediction import unbounded
from chutelab.theory.transfer import STAGES
from live.node import ask, needs_node, plain
from test_live_core import CORNERED, MOVING

pytestmark = needs_node

DRAWS = [60, pytest.param(500, marks=pytest.mark.slow)]
"""How many scenes are drawn: few, since the core builds and steps for both hosts."""


def in_node(asked, what="scenes", *, runs=False):
    """Return what JavaScript says of scenes, as their files have them, of transfers or edits."""
    lab = describe(load("perpendicular"))
    return ask("bits.mjs", {"lab": lab, what: asked, "runs": runs})[what]


def differences(mine, other, path=""):
    """Yield where two trees differ."""
    if isinstance(mine, dict) and isinstance(other, dict):
        for key in mine:
            yield from differences(mine[key], other.get(key), f"{path}.{key}")
    elif isinstance(mine, list) and isinstance(other, list) and len(mine) == len(other):
        for n, pair in enumerate(zip(mine, other, strict=True)):
            yield from differences(*pair, f"{path}[{n}]")
    elif mine != other:
        yield f"{path}: {mine} in Python, {other} in JavaScript"


WALL = {"name": "wall", "from": [0.0, 0.0], "to": [1.0, 0.0]}
THROWN = {"stream": {"at": [0.0, 1.0], "velocity": [0.0, 0.0]}, "surface": [WALL]}
BELTS = {"incoming": {"speed": 1.0, "pulley_radius": 0.1}, "plate": {"distance": 0.3},
         "outgoing": {"drop": 0.6, "drop_from": "top"}}  # fmt: skip
REFUSED = {
    "inside a surface": {**THROWN, "stream": {"at": [0.5, 0.002], "velocity": [0.0, 0.0]}},
    "inside the pulley": {**BELTS, "stream": {"at": [0.0, 0.05], "velocity": [0.0, 0.0]}},
    "a box that is too small": {"stream": {"fill": [[0.0, 0.0], [0.1, 0.1]], "count": 900}},
    "a plate of no length": {**BELTS, "plate": {"distance": 0.3, "above": 0.0, "below": 0.0}},
    "two ends that are one": {**THROWN, "surface": [{**WALL, "to": [0.0, 0.0]}]},
    "an arc of no length": {
        **THROWN,
        "surface": [{"name": "a", "center": [5, 5], "radius": 1, "from_deg": 9, "to_deg": 9}],
    },
    "an arc of less than an atom": {
        **THROWN, "surface": [{"name": "a", "center": [5, 5], "radius": 1e-3, "to_deg": 1e-5}],
    },
    "two damping plates": {**BELTS, "plate": [{"distance": 0.3}, {"distance": 0.4}]},
    "a name that is there twice": {**THROWN, "surface": [WALL, WALL]},
    "a conveyor of no length": {
        **THROWN,
        "conveyor": [{"name": "c", "from": [0.0, 0.0], "to": [0.0, 0.0], "speed": 1.0}],
    },
    "a plate without a belt": {**THROWN, "plate": {"distance": 0.3}},
    "a landing without a belt": {**THROWN, "run": {"until": "landed"}},
    "no place to start from": {"surface": [WALL]},
    "a speed that adhesion does not allow": {
        **BELTS, "stream": {"count": 3, "speed_spread": 0.1},
    },
    "no speed": {**BELTS, "incoming": {"pulley_radius": 0.1}},
    "a kind that is not there": {
        **BELTS, "particle": [{"name": "a"}, {"name": "b"}], "stream": {"particle": "c"},
    },
}  # fmt: skip


def keys_refused(document):
    """Return the keys for which Python refuses a scene, or to write a page of it as it is."""
    try:
        scene = from_dict(document)
        describe(scene)
        build(scene)
    except SceneError as error:
        return [fault.key for fault in error.faults]
    measured = scene.outgoing is not None and scene.outgoing.drop_from == "impact"
    return ["outgoing.drop_from"] if measured else []


def test_what_cannot_be_built_is_refused_by_the_same_key():
    drawn = {}
    for seed in range(40):
        tables = sandbox.Drawing(np.random.default_rng(seed), meet=seed % 2 == 1).tables
        if keys_refused(tables):
            drawn[seed] = tables
    assert len(drawn) > 5
    scenes = REFUSED | drawn
    for name, document, found in zip(scenes, scenes.values(), in_node([*scenes.values()]),
                                     strict=True):  # fmt: skip
        keys = keys_refused(document)
        assert keys, name
        assert found.get("fault", {}).get("key") in keys, (name, keys, found.get("fault"))


def test_a_page_refuses_mass_points_by_their_key():
    with pytest.raises(SceneError) as caught:
        describe(from_dict({**THROWN, "particle": {"radius": 0.0}}))
    assert [fault.key for fault in caught.value.faults] == ["particle.radius"]


def test_what_boxes_and_polygons_do_not_have_is_refused_by_the_same_key():
    box, kind = {"shape": "box", "size": [0.1, 0.1], "spin": True}, {"shape": "polygon"}
    own = {**THROWN, "particle": box}
    documents = [
        {**own, "particle": {**box, **more}}
        for more in ({"radius": 0.1}, {"density": 900.0}, {"points": [[0, 0], [1, 0], [0, 1]]},
                     {"rolling_friction": 0.1}, {"shape": "sphere"}, {"size": [0.1]})
    ]  # fmt: skip
    documents += [{**own, "particle": one} for one in (
        {"shape": "box"}, kind, {**kind, "points": [[0, 0], [1, 0], [0.2, 0.2], [0, 1]]},
        {**kind, "points": [[0, 0], [1, 0]]},
    )]  # fmt: skip
    documents += [
        {**own, "run": {"engine": "exact"}},
        {**own, "stream": {**own["stream"], "width": 0.5}}, {**BELTS, "particle": box},
        {**THROWN, "stream": {**THROWN["stream"], "angle_deg": 30.0}},
        *({**own, "particle": {"name": "a", **box}, "pair": [{"between": ["a", "wall"], **pulls}]}
          for pulls in ({"cohesion": 0.1}, {"bond_number": 2.0})),
    ]  # fmt: skip
    for document, found in zip(documents, in_node(documents), strict=True):
        keys = keys_refused(document)
        assert keys, document
        assert found.get("fault", {}).get("key") in keys, (document, keys, found.get("fault"))


def test_a_belt_below_the_impact_is_told_from_the_top():
    scene = load("perpendicular")
    told = from_dict(describe(scene)["scene"])
    assert told.outgoing.drop_from == "top"
    mine, other = (build(one).segments.start[2, 1] for one in (scene, told))
    assert other == pytest.approx(mine, abs=1e-15)


SHAPE = {
    "title": 'quoted "so", \\ back, tab\t, ü and \x7f',
    "gravity": 1.5e-7,
    "particle": [{"name": "a", "spin": True}, {"name": "b", "radius": [0.01, 0.02]}],
    "incoming": {"speed": 1e6, "pulley_radius": 0.1},
    "surface": [
        {**WALL, "from": [-0.0, 0.3]},
        {"name": "pegs", "center": [5.0, 5.0], "radius": 0.1, "repeat": [[2, 1.0, -0.0]]},
    ],
    "stream": {"particle": "b", "count": 2, "seed": 2**53 - 1, "rate": "12.5 t/h"},
}
EDITS = {
    "a value": {"gravity": 3.0}, "a default": {"incoming.length": 0.30000000000000004},
    "a row by its name": {"surface.wall.speed": -2.5},
    "a row by its number": {"surface[1].radius": 1e-3},
    "part of a point": {"surface[0].from[1]": 5e-324},
    "a whole point": {"surface.wall.to": [2.0, 1e21 / 1e16]},
    "a key that goes": {"surface.pegs.repeat": None, "particle.a.spin": None},
    "a table that comes": {"run.until": 2.0},
    "the only stream by its number": {"stream[0].count": 7},
    "several": {"particle[1].mass": 0.5, "particle[1].radius": 0.25, "stream.seed": 12},
}  # fmt: skip


def test_keys_that_are_changed_are_those_that_python_changes():
    scene = from_dict(SHAPE)
    edits = [[SHAPE, values] for values in EDITS.values()]
    for (name, values), found in zip(EDITS.items(), in_node(edits, "edits"), strict=True):
        assert found["there"] == [*values.values()], name
        wanted = from_dict(SHAPE, overrides=[Override(*pair) for pair in values.items()])
        assert parse(found["toml"]) == wanted, name
        assert parse(found["kept"]) == scene, name


def test_a_row_that_goes_is_no_longer_there():
    (found,) = in_node([[SHAPE, {"surface[0]": None}]], "edits")
    assert parse(found["toml"]) == from_dict({**SHAPE, "surface": SHAPE["surface"][1:]})


CLAIMS = {
    "outside": Reason.OUTSIDE, "early": Reason.EARLY, "no-impact": Reason.NO_IMPACT,
    "second": Reason.SECOND, "misses": Reason.MISSES, None: None,
}  # fmt: skip
SYMBOLS = [name for names in STAGES.values() for name in names]


def unlike(mine, found):
    """Return what differs between a transfer in Python and in JavaScript."""
    values = {name: float(getattr(mine, name)) for name in SYMBOLS}
    claim = CLAIMS[(found["reason"] or {"claim": None})["claim"]]
    wrong = list(differences(plain(values), found["numbers"]))
    if claim != Reason.of(mine.reason):
        wrong.append(f"{mine.reason} in Python, {found['reason']} in JavaScript")
    return wrong


def camel(name):
    head, *rest = name.split("_")
    return head + "".join(map(str.capitalize, rest))


@pytest.mark.parametrize("count", DRAWS)
def test_transfers_are_the_same_to_the_last_bit(count):
    rng = np.random.default_rng(2016)
    drawn = []
    for n in range(count):
        values = {
            "speed": rng.uniform(0.2, 4.0), "pulley_radius": rng.uniform(0.05, 0.5),
            "distance": rng.uniform(-0.2, 1.0), "angle": rng.uniform(-1.4, 1.4),
            "pivot_height": rng.uniform(-0.5, 0.5), "restitution": rng.uniform(0.0, 1.0),
            "drop": rng.uniform(0.0, 2.0), "belt_speed": rng.uniform(-2.0, 3.0),
            "particle_radius": rng.uniform(0.001, 0.05), "mass": rng.uniform(0.001, 1.0),
            "gravity": rng.uniform(0.1, 20.0), "spin": bool(rng.random() < 0.5),
            "inertia": rng.uniform(0.1, 1.0), "incline": rng.uniform(-0.9, 0.9),
            "plate_friction": rng.uniform(0.0, 1.0), "interval": rng.uniform(0.001, 1.0),
            "unbounded_plate": bool(rng.random() < 0.5),
        }  # fmt: skip
        # Some at their defaults, and what is special: a level belt, an upright plate, no gravity.
        if n % 3 == 0:
            values |= {"incline": 0.0, "angle": 0.0 if n % 2 else values["angle"]}
        elif n % 25 == 1:
            values |= {"gravity": 0.0}
        elif n % 25 == 2:
            values |= {"restitution": 1.5, "speed": -1.0 if n % 2 else 1.0}
        kept = {"speed", "pulley_radius", "distance"}
        drawn.append({
            name: value for name, value in values.items() if name in kept or rng.random() < 0.9
        })  # fmt: skip
    told = [{camel(name): value for name, value in values.items()} for values in drawn]
    answered = 0
    for values, found in zip(drawn, in_node(told, "transfers"), strict=True):
        mine = transfer(**values)
        answered += not np.isnan(mine.x3)
        assert not unlike(mine, found), (values, unlike(mine, found))
    assert 0.2 * count < answered < 0.8 * count


def transfer_scene(seed):
    """Draw a belt, a plate and a belt, and now and then something that is in the way."""
    rng = np.random.default_rng(seed)
    draw = sandbox.Drawing(rng, meet=False)
    wheel = draw.number(0.05, 0.3)
    tables = {
        "gravity": draw.one_of(9.81, 9.81, draw.number(1.0, 20.0), 0.0),
        "particle": {"radius": draw.number(0.002, 0.03), **draw.some(
            mass=draw.number(0.01, 1.0), spin=True, shape="sphere",
        )},
        "incoming": {"speed": draw.number(0.3, 4.0), "pulley_radius": wheel, **draw.some(
            length=draw.number(0.3, 1.0), incline_deg=draw.number(-25.0, 35.0),
        )},
        "plate": {"distance": draw.number(0.05, 0.8), **draw.some(
            angle_deg=draw.number(-50.0, 70.0), above=draw.number(0.05, 0.5),
            below=draw.number(0.05, 0.8), pivot_height=draw.number(-0.2, 0.4),
        ), **draw.values()},
        "stream": draw.some(rate=draw.number(1.0, 300.0)),
    }  # fmt: skip
    if tables["gravity"] == 0.0:
        # Straight back from an upright plate it would graze the belt all along.
        tables["plate"]["angle_deg"] = draw.number(1.0, 40.0) * draw.one_of(-1.0, 1.0)
    if draw.chance(0.9):
        tables["outgoing"] = {
            "drop": draw.number(0.3, 1.5) + 2.0 * wheel, "drop_from": "top",
            **draw.some(speed=draw.number(-2.0, 3.0), start=draw.number(-2.0, 0.3), length=3.0),
        }  # fmt: skip
    if draw.chance(0.4):
        draw.transfer = True
        tables["surface"] = [
            {"name": f"s{n}", **draw._course(), **draw.some(opens_at=draw.number(0.1, 2.0))}
            for n in range(draw.whole(1, 2))
        ]
    if draw.chance(0.1):
        tables["plate"] = [tables["plate"], draw._hanging()]
    return tables


def misses_the_face(scene):
    """Tell whether the equations' flight passes the finite plate, or never comes to its line."""
    found, machine = unbounded(scene), build(scene)
    plate = machine.segments.surface.tolist().index(machine.surfaces.index("plate"))
    ride = scene.incoming.pulley_radius + scene.particle.radius
    centre = ride * np.sin(found.phi1) + found.x2, ride * np.cos(found.phi1) - found.y2
    foot = (centre - machine.segments.start[plate]) @ machine.segments.tangent[plate]
    return not 0.0 <= foot <= machine.segments.length[plate]


@pytest.mark.parametrize("count", DRAWS)
def test_predictions_are_the_same_to_the_last_bit_and_have_the_same_reasons(count):
    """Python looks for what is in the way, the page reads it off its run's events."""
    documents = []
    for seed in range(count):
        tables = transfer_scene(seed)
        if not keys_refused(tables):
            documents.append(tables)
    assert len(documents) > 0.9 * count
    reasons, passed = [], 0
    for document, answer in zip(documents, in_node(documents, runs=True), strict=True):
        scene, found = from_dict(document), answer["prediction"]
        mine, why = predict(scene), found["reason"] or {"claim": None, "text": None, "words": {}}
        if "it is a gate" in str(mine.reason) and why["text"] != "gate":
            # It was not there when the particle came.
            solid = [one for one in document["surface"] if "opens_at" not in one]
            mine = predict(from_dict({**document, "surface": solid}))
        reasons.append(Reason.of(mine.reason))
        if reasons[-1] is Reason.EARLY and why["claim"] == "no-impact":
            # Of what would strike an end of the plate, but meets something else before, both hold.
            assert misses_the_face(scene), document
            passed += 1
            found = {**found, "reason": {"claim": "early"}}
        elif reasons[-1] is Reason.EARLY:
            assert f": {why['words']['surface']}: " in str(mine.reason), (document, why)
        wrong = unlike(mine, found)
        assert not wrong, (document, str(mine.reason), why, wrong[:3])
    assert passed <= max(1, 0.01 * count)
    for reason in (None, *Reason):
        assert reasons.count(reason) > 0.02 * count, (reason, reasons.count(reason))


JUNK = (
    0, -1, 1, 3.5, 1e-320, 1e300, 2**60, True, False, "", "x", "steel", "wall", "kind-0", "plate",
    "a b", "𝔘", "120 t/h", "0 t/h", "landed", "adhesion", [], {}, [1.0], [0.0, 0.0], [2.0, 1.0],
    [[0.0, 0.0], [1.0, 0.0]], [[0, 0], [0, 0]], {"x": 1},
)  # fmt: skip


def spoilt(rng, tables):
    """Return a scene in which a key is lost, doubled, misspelt, or has another's value."""
    tables = json.loads(json.dumps(tables))
    place = tables
    while True:
        keys = [*place] if isinstance(place, dict) else [*range(len(place))]
        if not keys:
            return tables
        key = keys[rng.integers(len(keys))]
        inner = place[key]
        if isinstance(inner, dict | list) and inner and rng.random() < 0.8:
            place = inner
            continue
        way = rng.integers(5)
        if way == 0:
            del place[key]
        elif way == 1 and isinstance(place, dict):
            place[f"{key}x"] = inner
        elif way == 2 and isinstance(place, dict):
            other = ("opens_at", "center", "to", "name", "density", "pivot", "fill", "radius")
            place[other[rng.integers(len(other))]] = JUNK[rng.integers(len(JUNK))]
        else:
            place[key] = JUNK[rng.integers(len(JUNK))]
        return tables


@pytest.mark.parametrize("count", DRAWS)
def test_what_is_taken_from_an_address_is_refused_where_python_refuses_it(count):
    """Any text may be there: it must never do more than be refused."""
    rng = np.random.default_rng(99)
    seeds = [sandbox.tables(seed) for seed in range(20)]
    moving = {**THROWN, "run": {"until": 1.0}}
    seeds += [{**moving, "surface": [{**WALL, **keys}]} for keys in MOVING]
    lid = {"name": "lid", "from": [2.0, 0.0], "to": [3.0, 0.0]}
    kinds = [{"name": "a"}, {"name": "b"}]
    two = [{**THROWN["stream"], "particle": name, "interact": True} for name in "ab"]
    two[1]["at"] = [0.5, 1.0]
    pairs = [
        {"between": ["a", "b"], "meet": False},
        {"between": ["a", "wall"], "cohesion": 0.1},
        {"between": ["b", "wall"], "bond_number": 1.7},
    ]
    crowd = {**moving, "particle": kinds, "stream": two, "pair": pairs}
    seeds += [
        {**crowd, "surface": [WALL, {**lid, f"{doing}_when": {"touched": "wall"}, **keys}]}
        for doing, keys in (("opens", {}), ("closes", {"opens_at": 1.0}), ("starts", {"turn": 9.0}))
    ]
    shapes = [*CORNERED, {**CORNERED[0], "material": "wood"}]
    seeds += [{**moving, "particle": shape} for shape in shapes]
    documents = [spoilt(rng, seeds[n % len(seeds)]) for n in range(count)]
    refused = 0
    for document, found in zip(documents, in_node(documents), strict=True):
        keys = keys_refused(document)
        refused += bool(keys)
        assert ("fault" in found) == bool(keys), (document, keys, found.get("fault"))
        if keys:
            key = found["fault"]["key"]
            near = [k for k in keys if k.startswith(key) or key.startswith(k) or not k]
            assert near, (document, keys, key)
    assert refused > 0.5 * count
