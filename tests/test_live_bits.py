"""What turns keys into machines, in Python and in JavaScript: every number to the last bit."""

from __future__ import annotations

import json
import shutil
import subprocess
from pathlib import Path

import numpy as np
import pytest

import chutelab.pictures.live
import sandbox
from chutelab.machine import build
from chutelab.pictures.live.describe import describe
from chutelab.scene import SceneError, from_dict, load, parse, shipped

NODE = shutil.which("node")
ASSETS = Path(chutelab.pictures.live.__file__).parent / "assets"

pytestmark = pytest.mark.skipif(NODE is None, reason="node is not installed")

SCENES = 500


def in_node(documents):
    """Return what JavaScript says of scenes, given as their files have them."""
    lab = describe(load("perpendicular"))
    told = json.dumps({"lab": lab, "scenes": documents})
    script = Path(__file__).parent / "live" / "bits.mjs"
    done = subprocess.run(
        [NODE, str(script), str(ASSETS)], input=told, capture_output=True, text=True, check=False,
        timeout=120,
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    return json.loads(done.stdout)


def plain(value):
    """Return numbers as they are written in what node says."""
    if isinstance(value, float) and not np.isfinite(value):
        return {"inf": "Infinity", "-inf": "-Infinity", "nan": "NaN"}[str(value)]
    if isinstance(value, list | tuple):
        return [plain(entry) for entry in value]
    return {key: plain(entry) for key, entry in value.items()} if isinstance(value, dict) else value


def rows(**columns):
    """Return arrays (N, ...) as N tables."""
    lists = {name: column.tolist() for name, column in columns.items()}
    return [dict(zip(lists, row, strict=True)) for row in zip(*lists.values(), strict=True)]


def by_kind(values, kinds):
    """Return values (S,) or (K, S) as (S, K)."""
    count = np.size(values) // kinds
    return np.array(values).reshape(kinds, count).T


def numbers(machine):
    """Return a machine as JavaScript has it."""
    count, kinds = machine.count, len(machine.rolling)
    starts, bends, releases = machine.segments, machine.arcs, machine.releases
    pairs = [
        {
            "restitution": by_kind(part.restitution, kinds),
            "friction": by_kind(part.friction, kinds),
            "surface": part.surface, "appears": part.appears, "vanishes": part.vanishes,
            "speed": part.speed,
        }
        for part in (starts, bends)
    ]  # fmt: skip
    pulley = None
    if machine.pulley is not None:
        pulley = {
            name: getattr(machine.pulley, name)
            for name in ("radius", "speed", "incline", "surface")
        }
        for name in ("restitution", "friction"):
            value = np.array(getattr(machine.pulley, name), dtype=float)
            pulley[name] = value.reshape(kinds).tolist()
    return plain({
        "surfaces": list(machine.surfaces),
        "gravity": machine.gravity,
        "landing": machine.landing,
        "until": machine.until,
        "endTime": float(machine.end_time),
        "dt": machine.dt,
        "interact": machine.interact,
        "exitBox": [float(side) for side in machine.exit_box],
        "segments": rows(
            x=starts.start[:, 0], y=starts.start[:, 1], tx=starts.tangent[:, 0],
            ty=starts.tangent[:, 1], length=starts.length, **pairs[0],
        ),
        "arcs": rows(
            x=bends.center[:, 0], y=bends.center[:, 1], radius=bends.radius, begin=bends.begin,
            extent=bends.extent, **pairs[1],
        ),
        "pulley": pulley,
        "releases": rows(
            t=releases.t, x=releases.position[:, 0], y=releases.position[:, 1],
            vx=releases.velocity[:, 0], vy=releases.velocity[:, 1], carried=releases.carried,
            stream=releases.stream, kind=releases.kind,
        ),
        **{
            name: np.broadcast_to(getattr(machine.particle, name), count).tolist()
            for name in ("radius", "mass", "inertia")
        },
        "pairRestitution": machine.pair_restitution.tolist(),
        "pairFriction": machine.pair_friction.tolist(),
        "rolling": machine.rolling.tolist(),
    })  # fmt: skip


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


def compare(documents, names):
    for document, name, found in zip(documents, names, in_node(documents), strict=True):
        scene = from_dict(document)
        assert "machine" in found, (name, found)
        wrong = list(differences(numbers(build(scene)), found["machine"]))
        assert not wrong, (name, len(wrong), wrong[:5])
        assert parse(found["toml"]) == scene, name


def test_machines_drawn_at_random_are_the_same_to_the_last_bit():
    compare([sandbox.tables(seed) for seed in range(SCENES)], range(SCENES))


def test_shipped_scenes_are_the_same_to_the_last_bit():
    documents, names = [], []
    for name in shipped():
        try:
            documents.append(describe(load(name))["scene"])
        except SceneError:
            continue
        names.append(name)
    assert len(names) > 10
    compare(documents, names)


WALL = {"name": "wall", "from": [0.0, 0.0], "to": [1.0, 0.0]}
THROWN = {"stream": {"at": [0.0, 1.0], "velocity": [0.0, 0.0]}, "surface": [WALL]}
BELTS = {"incoming": {"speed": 1.0, "pulley_radius": 0.1}, "plate": {"distance": 0.3},
         "outgoing": {"drop": 0.6, "drop_from": "top"}}  # fmt: skip
REFUSED = {
    "inside a surface": {**THROWN, "stream": {"at": [0.5, 0.002], "velocity": [0.0, 0.0]}},
    "inside the pulley": {**BELTS, "stream": {"at": [0.0, 0.05], "velocity": [0.0, 0.0]}},
    "inside at its second stream": {
        **THROWN, "stream": [THROWN["stream"], {"at": [0.5, 0.0], "velocity": [0.0, 0.0]}],
    },
    "a box that is too small": {"stream": {"fill": [[0.0, 0.0], [0.1, 0.1]], "count": 900}},
    "a plate of no length": {**BELTS, "plate": {"distance": 0.3, "above": 0.0, "below": 0.0}},
    "a plate that ends above its pivot": {
        **BELTS, "plate": {"distance": 0.3, "above": 0.0, "pivot_height": -0.6},
    },
    "two ends that are one": {**THROWN, "surface": [{**WALL, "to": [0.0, 0.0]}]},
    "two points that are one": {
        **THROWN, "surface": [{"name": "a", "points": [[0, 0], [1, 0], [1, 0]]}],
    },
    "an arc of no length": {
        **THROWN,
        "surface": [{"name": "a", "center": [5, 5], "radius": 1, "from_deg": 9, "to_deg": 9}],
    },
    "an arc beyond one turn": {
        **THROWN, "surface": [{"name": "a", "center": [5, 5], "radius": 1, "to_deg": 361}],
    },
    "a gate that opens as it closes": {
        **THROWN, "surface": [{**WALL, "opens_at": 1.0, "closes_at": 1.0}],
    },
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
    "a velocity that adhesion does not allow": {**BELTS, "stream": {"velocity": [2.0, 0.0]}},
    "a negative radius": {**BELTS, "incoming": {"speed": 1.0, "pulley_radius": -0.1}},
    "too steep a plate": {**BELTS, "plate": {"distance": 0.3, "angle_deg": 90.0}},
    "no speed": {**BELTS, "incoming": {"pulley_radius": 0.1}},
    "a kind that is not there": {
        **BELTS, "particle": [{"name": "a"}, {"name": "b"}], "stream": {"particle": "c"},
    },
}  # fmt: skip


def keys_refused(document):
    """Return the keys for which Python refuses a scene."""
    try:
        build(from_dict(document))
    except SceneError as error:
        return [fault.key for fault in error.faults]
    return []


def test_what_cannot_be_built_is_refused_by_the_same_key():
    drawn = {}
    for seed in range(150):
        tables = sandbox.Drawing(np.random.default_rng(seed), meet=seed % 2 == 1).tables
        if keys_refused(tables):
            drawn[seed] = tables
    assert len(drawn) > 20
    scenes = REFUSED | drawn
    for name, document, found in zip(scenes, scenes.values(), in_node([*scenes.values()]),
                                     strict=True):  # fmt: skip
        keys = keys_refused(document)
        assert keys, name
        assert found.get("fault", {}).get("key") in keys, (name, keys, found.get("fault"))


def test_random_numbers_are_those_of_numpy_for_all_seeds():
    """Seeds of one word and of two, of the first stream and of others."""
    seeds = [0, 1, 2**32 - 1, 2**32, 2**53 - 1, 2**63 - 1]
    stream = {"at": [0.0, 0.0], "velocity": [0.0, 0.0], "bed_height": 1.0, "count": 4}
    documents = [{"stream": [{**stream, "seed": str(seed)}] * 2} for seed in seeds]
    for seed, found in zip(seeds, in_node(documents), strict=True):
        heights = [release["y"] for release in found["machine"]["releases"]]
        for n, dice in enumerate((np.random.default_rng(seed), np.random.default_rng([seed, 1]))):
            wanted = dice.random(4)
            assert heights[4 * n : 4 * n + 4] == [0.0, *wanted[1:].tolist()]


def test_a_page_refuses_what_is_no_disk_by_its_key():
    box = {"shape": "box", "size": [0.1, 0.1]}
    for table, key in ((box, "particle.shape"), ({"radius": 0.0}, "particle.radius")):
        with pytest.raises(SceneError) as caught:
            describe(from_dict({**THROWN, "particle": table}))
        assert [fault.key for fault in caught.value.faults] == [key]
    with pytest.raises(SceneError, match="string"):
        describe(from_dict({**THROWN, "string": [{"from": [0.0, 2.0]}]}))


def test_a_belt_below_the_impact_is_told_from_the_top():
    scene = load("perpendicular")
    told = from_dict(describe(scene)["scene"])
    assert told.outgoing.drop_from == "top"
    mine, other = (build(one).segments.start[2, 1] for one in (scene, told))
    assert other == pytest.approx(mine, abs=1e-15)
