"""Scenes as they should be: the contract's keys and defaults, files found by name, overrides."""

import json
import re
import subprocess
import sys
import tomllib
from pathlib import Path

import numpy as np
import pytest
from pydantic import ValidationError

from chutelab import scene as sc
from chutelab.scene.overrides import limits_of, rule_at, sized, unit_of
from chutelab.scene.schema import TABLES, SceneTables, to_dict
from chutelab.scene.units import UNITS, read_size, size_in

CONVEYOR = """
[incoming]
speed = 2.0
pulley_radius = 0.1
"""

MACHINE = """
[incoming]
speed = 3.0
pulley_radius = 0.2
[plate]
distance = 0.5
[outgoing]
drop = 0.5
"""

HOOD = """
[[surface]]
name = "hood"
from = [0.8, 0.5]
to = [1.0, 0.1]
[[surface]]
name = "floor"
points = [[-1, 0], [0, 0], [1, 0.5]]
speed = 1
"""

# Design, section 3, copied by hand: what a scene has that names only what it must.
CONTRACT = {
    "title": "machine",
    "gravity": 9.81, "gravity_deg": 0.0,
    "air_density": 0.0,
    "particle": {"name": None, "shape": "disk", "radius": 0.0063, "size": None, "points": None,
     "mass": 0.008, "density": None, "material": None, "spin": False, "rolling_friction": 0.0,
     "restitution_speed": None},
    "material": (),
    "pair": (),
    "incoming": {"speed": 3.0, "pulley_radius": 0.2, "length": 1.0, "incline_deg": 0.0,
     "friction": "adhesion", "restitution": 0.0},
    "plate": {"name": None, "pivot": None, "distance": 0.5, "angle_deg": 0.0, "pivot_height": 0.2,
     "above": 0.3, "below": None, "restitution": 0.5, "friction": 0.0, "shake": None,
     "travel": None, "turn": 0.0, "hinge": None, "mass": None, "inertia": None, "spring": 0.0,
     "rest_deg": 0.0, "damper": 0.0, "stops_deg": None, "motor": None,
     "starts_when": None},
    "outgoing": {"speed": 3.0, "drop": 0.5, "drop_from": "impact", "start": -2.0, "length": 6.0,
     "restitution": 0.0, "friction": 0.5},
    "conveyor": (),
    "surface": (),
    "string": (),
    "rod": (),
    "spring": (),
    "pin": (),
    "sensor": (),
    "stream": {"name": "stream", "particle": None, "count": 1, "rate": 200.0, "width": None,
     "start": 0.0, "bed_height": 0.0, "speed_spread": 0.0, "seed": 0, "at": None, "to": None,
     "fill": None, "velocity": None, "omega": 0.0, "angle_deg": 0.0, "interact": False,
     "restitution": 0.5, "friction": 0.3},
    "run": {"engine": "auto", "until": "landed", "max_time": 30.0, "dt": 0.001, "align": True,
     "loads": None, "stress": None},
    "expect": (),
    "view": None,
    "live": {"predict": False, "controls": None, "panels": None, "ranges": {}, "presets": ()},
}  # fmt: skip

EXPECT = {"quantity", "value", "tolerance", "tolerance_contact", "tolerance_pymunk", "source"}


def test_the_defaults_are_the_contract():
    scene = sc.parse(MACHINE, "somewhere/machine.toml")
    assert to_dict(scene, defaults=True) == CONTRACT
    assert scene.source == "somewhere/machine.toml"


def test_free_surfaces_have_the_contract_defaults_and_points():
    hood, floor = sc.parse(CONVEYOR + HOOD).surface
    assert hood.points == ((0.8, 0.5), (1.0, 0.1))
    assert (hood.name, hood.restitution, hood.friction, hood.speed) == ("hood", 0.3, 0.4, 0.0)
    assert floor.points == ((-1.0, 0.0), (0.0, 0.0), (1.0, 0.5))
    assert floor.speed == 1.0


def test_a_view_is_two_corners_the_second_right_of_the_first_and_above_it():
    view = sc.parse(MACHINE + "[view]\nfrom = [-1, -2]\nto = [1.5, 0.5]").view
    assert (view.from_, view.to) == ((-1.0, -2.0), (1.5, 0.5))
    for to in ("[-1, 0.5]", "[1.5, -2.0]", "[-3, 0.5]", "[-0.9999999, 0.5]"):
        with pytest.raises(sc.SceneError) as told:
            sc.parse(MACHINE + f"[view]\nfrom = [-1, -2]\nto = {to}", "my.toml")
        assert "my.toml: view.to = [" in str(told.value)
        assert "must lie right of view.from = [-1, -2] and above it" in str(told.value)
    for text, said in (
        ("from = [-1, nan]\nto = [1, 1]", "view.from[1]"), ("from = [0, 0]", "view.to"),
        ("from = [0, 0]\nto = [1e9, 1]", "view.to[0]"), ("from = 3\nto = [1, 1]", "view.from"),
    ):  # fmt: skip
        with pytest.raises(sc.SceneError) as told:
            sc.parse(MACHINE + f"[view]\n{text}")
        (fault,) = told.value.faults
        assert fault.key == said


def test_without_outgoing_belt_a_scene_runs_until_settled():
    scene = sc.parse(CONVEYOR)
    assert scene.run.until == "settled"
    assert scene.plate is None
    assert scene.outgoing is None
    assert sc.parse(CONVEYOR, overrides=["run.until=2"]).run.until == 2.0


def test_a_scene_taken_apart_and_changed_gets_its_dependent_defaults_anew():
    document = sc.to_dict(sc.parse(MACHINE))
    document["incoming"].update(speed=5, pulley_radius=0.3)
    changed = sc.from_dict(document)
    assert changed.plate is not None
    assert changed.outgoing is not None
    assert changed.outgoing.speed == 5.0
    assert changed.plate.pivot_height == 0.3


def test_scenes_are_frozen_all_the_way_down():
    scene = sc.parse(MACHINE + HOOD)
    for table, key in [(scene, "gravity"), (scene.plate, "distance"), (scene.surface[0], "speed")]:
        with pytest.raises(ValidationError, match="frozen"):
            setattr(table, key, 1.0)
    assert hash(scene) == hash(sc.parse(MACHINE + HOOD))


def test_the_title_is_the_files_name_unless_given(tmp_path):
    file = tmp_path / "my chute.toml"
    file.write_text(CONVEYOR, encoding="utf-8")
    assert sc.load(file).title == "my chute"
    file.write_text('title = "Given"\n' + CONVEYOR, encoding="utf-8")
    assert sc.load(file).title == "Given"


@pytest.mark.parametrize("encoding", ["utf-8", "utf-8-sig"])
def test_windows_files_are_read(tmp_path, encoding):
    file = tmp_path / "windows.toml"
    text = 'title = "Skluz č. 1"\n' + CONVEYOR
    file.write_bytes(text.replace("\n", "\r\n").encode(encoding))
    assert sc.load(file).title == "Skluz č. 1"


# Hypothesis: what goes in comes out.

# Each key with the least and the largest value it takes, and values that are just outside.
RANGES = """
gravity 0 1e-9 1e6 | -1 9e-10 1.1e6
particle.radius 1e-9 | -1 9e-10
particle.mass 1e-27 1e6 | 0 9e-28 1.1e6
incoming.speed 0 1e-9 1e6 | -2 1e-12 1.1e6
incoming.pulley_radius 1e-9 1e6 | 0 9e-10
incoming.length 1e-9 1e6 | 5e-324 9e-10
incoming.incline_deg -60 60 | -60.1 60.1
incoming.friction 0 1e6 | -0.1 1.1e6
plate.distance 1e-9 1e6 | 0 9e-10
plate.restitution 0 1 | -0.1 1.1
outgoing.drop 1e-9 1e6 | 0 9e-10
outgoing.speed -1e6 1e6 | -1.1e6 1.1e6
stream.count 1 10000000 | 0 10000001
stream.rate 1e-6 1e9 | 0 9e-7 1.1e9
stream.seed 0 9223372036854775807 | -1 9223372036854775808
stream.start 0 | -1
run.dt 1e-7 0.1 | 0 9e-8 0.11
run.until 1e-9 1e6 | 0 9e-10
run.max_time 1e-9 1e6 | 0 9e-10
surface.hood.speed -1e6 1e6 | -1.1e6 1.1e6
surface.hood.opens_at -1e6 1e6 | -1.1e6
"""


@pytest.mark.parametrize("line", RANGES.strip().splitlines())
def test_a_key_takes_the_values_of_its_range_and_no_others(line):
    inside, outside = (part.split() for part in line.split("|"))
    key, *inside = inside
    for value in inside:
        sc.parse(MACHINE + HOOD, overrides=[f"{key}={value}"])
    for value in outside:
        with pytest.raises(sc.SceneError) as told:
            sc.parse(MACHINE + HOOD, overrides=[f"{key}={value}"])
        assert [fault.key.replace("[0]", ".hood") for fault in told.value.faults] == [key], value


# The shipped scenes.

SHIPPED = (
    "arch", "belt-landing", "bucket-elevator", "cascade", "coal-transfer", "cradle",
    "damper-plate", "domino-gate", "dominoes", "drum", "feeder", "flap-gate", "free-fall",
    "galton", "heap", "hopper",
    "inclined-20", "inclined-40", "inclined-60", "inclined-conveyor", "loop", "low-speed",
    "mixture", "perpendicular", "perpendicular-fast", "rock-box", "see-saw", "silo", "slip",
    "spoon", "stream", "stream-independent", "two-sizes", "vibrating-feeder",
)  # fmt: skip


def test_a_text_is_validated_once_and_a_file_that_has_changed_anew(tmp_path):
    path, text = tmp_path / "own.toml", sc.shipped()["perpendicular"].read_text(encoding="utf-8")
    path.write_text(text, encoding="utf-8")
    first = sc.load(path)
    assert sc.load(path) is first
    assert sc.load(path, "incoming.speed=3").incoming.speed == 3.0
    assert sc.load(path).incoming.speed == first.incoming.speed != 3.0
    path.write_text(text.replace("speed = 2.0", "speed = 2.5", 1), encoding="utf-8")
    assert sc.load(path).incoming.speed == 2.5


def test_exactly_the_promised_scenes_are_shipped():
    assert tuple(sc.shipped()) == SHIPPED, "in alphabetical order"


@pytest.mark.parametrize("name", SHIPPED)
def test_each_shipped_scene_has_a_title_and_three_lines_on_what_to_look_at(name):
    (about,) = [about for about in sc.about() if about.name == name]
    scene = sc.load(name)
    assert scene.title == about.title
    assert scene.title not in {name, "Untitled scene"}
    assert len(about.look) == 3
    assert about.look[0].endswith((".", "?")), "`chutelab scenes` shows the first line alone"
    assert all(30 < len(line) < 100 for line in about.look)
    assert sc.from_dict(sc.to_dict(scene)) == scene


def test_a_scene_is_found_by_name_from_anywhere(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    shipped = sc.shipped()["perpendicular"]
    assert sc.find("perpendicular") == sc.find("perpendicular.toml") == shipped
    (tmp_path / "perpendicular").mkdir()
    assert sc.find("perpendicular") == shipped, "a folder of that name is no scene"
    own = tmp_path / "stream.toml"
    own.write_text(CONVEYOR, encoding="utf-8")
    assert sc.find("stream.toml") == Path("stream.toml"), "a file that is there wins"
    assert sc.find("stream") == sc.shipped()["stream"]


def test_scenes_of_an_installed_wheel_are_found_in_the_package(tmp_path):
    package = Path(sc.__file__).parents[1]
    for source in (p for d in ("*.py", "scene/*.*", "util/*.py") for p in package.glob(d)):
        target = tmp_path / "chutelab" / source.relative_to(package)
        target.parent.mkdir(parents=True, exist_ok=True)
        target.write_bytes(source.read_bytes())
    scenes = tmp_path / "chutelab" / "data" / "scenes"
    scenes.mkdir(parents=True)
    (scenes / "only.toml").write_text(CONVEYOR, encoding="utf-8")
    code = "from chutelab import scene; print(list(scene.shipped()), scene.load('only').source)"
    printed = _python(code, cwd=tmp_path, path=tmp_path)
    assert printed == "['only'] only"


def test_the_starter_is_complete_and_valid_and_shows_the_defaults():
    text = sc.template()
    scene = sc.parse(text)
    assert scene.outgoing is not None
    # With what is commented out put in, it is still valid, and every key there is, is in it.
    keys = re.compile(r"^# (?=[a-z_]+ = |\[)", re.MULTILINE)
    everything = tomllib.loads(keys.sub("", text))
    assert set(everything) | {"pair"} == set(CONTRACT)
    # What goes instead of something else is further in.
    instead = re.compile(r"^# ( {2}(?=[a-z_]+ = |\[))?", re.MULTILINE)
    blocks = instead.sub("", text).split("\n[")
    said = {
        block.strip("[").partition("]")[0]: set(re.findall(r"^(\w+) = ", block, re.MULTILINE))
        for block in blocks[1:]
    }
    tables = {name.lower(): table for name, table in sc.schema()["$defs"].items()}
    assert said == {
        name: set(table["properties"]) - {"points"} | ({"points"} if name == "particle" else set())
        for name, table in tables.items()
        if name not in ("preset", "shake", "travel", "motor", "when")  # in one line
    }
    assert set(everything["expect"][0]) == EXPECT
    complete = sc.from_dict(everything)
    assert complete.surface[0].name == "hood"
    assert complete.expect[0].quantity == "x2"
    minimal = sc.parse(MACHINE, overrides=["incoming.speed=2", "incoming.pulley_radius=0.1"])
    assert scene == sc.from_dict({**sc.to_dict(minimal), "title": scene.title})


# Overrides.


@pytest.mark.parametrize(
    ("override", "path", "value"),
    [
        ("plate.angle_deg=20", ("plate", "angle_deg"), 20.0),
        ("plate.angle_deg = -2.5e1", ("plate", "angle_deg"), -25.0),
        ("incoming.friction=adhesion", ("incoming", "friction"), "adhesion"),
        ('incoming.friction="adhesion"', ("incoming", "friction"), "adhesion"),
        ("incoming.friction=0.5", ("incoming", "friction"), 0.5),
        ("particle.spin=true", ("particle", "spin"), True),
        ("stream.at=[0.5, 1]", ("stream", "at"), (0.5, 1.0)),
        ("run.engine=pymunk", ("run", "engine"), "pymunk"),
        ("run.until=2.5", ("run", "until"), 2.5),
        ("title=Plate = wall, 2 m/s # 1", ("title",), "Plate = wall, 2 m/s # 1"),
        ("title=", ("title",), ""),
        ("gravity=0", ("gravity",), 0.0),
        ("surface.hood.restitution=0.2", ("surface", 0, "restitution"), 0.2),
        ("surface[1].speed=-1", ("surface", 1, "speed"), -1.0),
        ("surface.floor.points[2][1]=9", ("surface", 1, "points", 2, 1), 9.0),
        ("surface[0].name=cover", ("surface", 0, "name"), "cover"),
    ],
)
def test_an_override_sets_its_key_and_no_other(override, path, value):
    plain, changed = sc.parse(MACHINE + HOOD), sc.parse(MACHINE + HOOD, overrides=[override])

    def leaves(tree, above=()):
        if isinstance(tree, dict):
            branches = tree.items()
        elif isinstance(tree, tuple) and above[-1] not in ("at", "velocity"):
            branches = enumerate(tree)
        else:
            return {above: tree}
        return {k: v for key, branch in branches for k, v in leaves(branch, (*above, key)).items()}

    expected = leaves(to_dict(plain, defaults=True)) | {path: value}
    assert leaves(to_dict(changed, defaults=True)) == expected


def test_overrides_leave_the_callers_mapping_alone():
    document = tomllib.loads(MACHINE + HOOD)
    before = json.dumps(document)
    sc.from_dict(document, overrides=["surface.hood.speed=3", "plate.angle_deg=3"])
    assert json.dumps(document) == before


# What editors and other programs see.


def test_the_schema_describes_every_key_of_the_contract():
    schema = sc.schema()
    assert schema["title"] == "Chutelab scene"
    assert schema["type"] == "object"
    assert schema["additionalProperties"] is False
    assert set(schema["properties"]) == set(CONTRACT)
    assert schema["$schema"].startswith("https://json-schema.org/")
    tables = {name.lower(): table for name, table in schema["$defs"].items()}
    for name, keys in CONTRACT.items():
        if isinstance(keys, dict):
            assert set(tables[name]["properties"]) == set(keys)
    assert set(tables["expect"]["properties"]) == EXPECT
    assert set(tables["expect"]["required"]) == EXPECT - {"tolerance_contact", "tolerance_pymunk"}
    assert set(tables["surface"]["properties"]) == {
        *("name", "from", "to", "points", "center", "radius", "from_deg", "to_deg", "repeat"),
        *("restitution", "friction", "material", "speed", "opens_at", "closes_at"),
        *("opens_when", "closes_when", "starts_when", "passes"),
        *("pivot", "shake", "travel", "turn", "hinge", "mass", "inertia", "spring", "rest_deg"),
        *("damper", "stops_deg", "motor"),
    }
    assert set(tables["shake"]["properties"]) == {"by", "frequency", "phase_deg"}
    assert set(tables["travel"]["properties"]) == {"to", "at", "in"}
    assert tables["incoming"]["required"] == ["speed", "pulley_radius"]
    assert tables["plate"]["oneOf"] == [
        {"required": ["distance"]}, {"required": ["name", "pivot"]}
    ]  # fmt: skip
    for table in tables.values():
        assert table["additionalProperties"] is False
        for key in table["properties"].values():
            assert key["description"].endswith(".")
            unit = key.get("x-unit")
            assert unit is None or key["description"].endswith(f" ({unit}).")


def test_the_schema_knows_no_null_and_gives_the_ranges():
    schema = sc.schema()
    text = json.dumps(schema)
    assert '"null"' not in text
    assert ": null" not in text
    plate = schema["$defs"]["Plate"]["properties"]
    assert (plate["angle_deg"]["exclusiveMinimum"], plate["angle_deg"]["x-unit"]) == (
        -90,
        "degrees",
    )
    assert (plate["restitution"]["minimum"], plate["restitution"]["maximum"]) == (0, 1)
    assert schema["$defs"]["Run"]["properties"]["engine"]["enum"] == [
        "auto",
        "exact",
        "contact",
        "pymunk",
    ]


def _python(code, cwd=None, path=Path(sc.__file__).parents[2]):
    run = subprocess.run(
        [sys.executable, "-c", code],
        env={"PYTHONPATH": str(path), "PYTHONDONTWRITEBYTECODE": "1"},
        cwd=cwd,
        capture_output=True,
        encoding="utf-8",
        check=True,
    )
    return run.stdout.strip()


@pytest.mark.parametrize(
    ("values", "read"),
    [
        ({"plate.angle_deg": 20.0}, lambda s: s.plate.angle_deg == 20.0),
        ({"plate": {"distance": 0.4}}, lambda s: (s.plate.distance, s.plate.above) == (0.4, 0.3)),
        ({"incoming.speed": 3}, lambda s: s.outgoing.speed == 3.0),
        ({"incoming.speed": np.float64(3.5)}, lambda s: s.incoming.speed == 3.5),
        ({"stream.count": 5.0}, lambda s: s.stream.count == 5),
        ({"stream.seed": np.int64(7)}, lambda s: s.stream.seed == 7),
        ({"stream.velocity": np.array([2.0, 0.0])}, lambda s: s.stream.velocity == (2.0, 0.0)),
        ({"plate.above": None}, lambda s: "above" not in s.plate.model_fields_set),
        ({"outgoing": None}, lambda s: s.outgoing is None and s.run.until == "settled"),
        ({}, lambda s: True),
    ],
)
def test_a_scene_with_other_values_is_validated_and_filled_in_anew(values, read):
    scene = sc.load("perpendicular")
    other = scene.with_values(values)
    assert read(other)
    assert other.source == scene.source
    assert other == sc.from_dict(sc.to_dict(other))
    assert (other == scene) == (not values or "plate.above" in values)


def test_refused_values_are_named_by_their_keys_all_at_once():
    with pytest.raises(sc.SceneError) as error:
        sc.load("perpendicular").with_values(
            {"plate.angle_deg": 95.0, "stream.count": 1.5, "surface.hood.speed": 1.0, "title": 3}
        )
    faults = {fault.key: fault for fault in error.value.faults}
    assert list(faults) == ["surface.hood.speed", "title", "plate.angle_deg", "stream.count"]
    assert faults["plate.angle_deg"].value == 95.0
    assert faults["plate.angle_deg"].allowed.endswith("in degrees")
    assert "from" not in str(faults["plate.angle_deg"])


def test_faults_of_a_shipped_scene_name_it_and_no_path(tmp_path):
    with pytest.raises(sc.SceneError) as caught:
        sc.load("perpendicular.toml", "incoming.sped=3")
    assert str(caught.value).startswith("perpendicular: incoming.sped = 3: unknown key;")
    mine = tmp_path / "perpendicular.toml"
    mine.write_text(MACHINE)
    with pytest.raises(sc.SceneError, match=re.escape(f"{mine}: incoming.sped")):
        sc.load(mine, {"incoming.sped": 3})


@pytest.mark.parametrize(
    ("text", "path", "value"),
    [
        ("particle.radius=4mm", ("particle", "radius"), 0.004),
        ("particle.radius= 0.4 cm", ("particle", "radius"), 0.004),
        ("particle.mass=8 g", ("particle", "mass"), 0.008),
        ("incoming.speed=250cm/s", ("incoming", "speed"), 2.5),
        ("incoming.friction=30%", ("incoming", "friction"), 0.3),
        ("incoming.friction=adhesion", ("incoming", "friction"), "adhesion"),
        ("plate.angle_deg=-3°", ("plate", "angle_deg"), -3.0),
        ("gravity=1.62 m/s²", ("gravity",), 1.62),
        ("run.dt=1ms", ("run", "dt"), 0.001),
        ("title=4mm", ("title",), "4mm"),
    ],
)
def test_texts_take_units(text, path, value):
    found = sc.load("perpendicular", text)
    for part in path:
        found = getattr(found, part)
    assert found == value


@pytest.mark.parametrize("unit", UNITS)
def test_every_known_unit_can_be_written(unit):
    si, size = UNITS[unit]
    assert read_size(f"2 {unit}") == (pytest.approx(2.0 * size, rel=1e-15), si)


def test_every_key_of_a_table_takes_numbers_with_its_own_unit_alone():
    """What the tables tell of units is what the whole schema says, at every key."""
    texts = [f"2 {unit}".strip() for unit in (*UNITS, "kg/m³", "N m", "miles")]
    for table, model in (("", SceneTables), *TABLES.items()):
        for name, field in model.model_fields.items():
            path = (table, field.alias or name) if table else (field.alias or name,)
            takes = limits_of(rule_at(path) or {}) is not None
            for text in (*texts, "2 balls and 3"):
                number = size_in(text, unit_of(path)) if takes else None
                assert sized(text, path) == (text if number is None else number), (path, text)


@pytest.mark.parametrize(
    ("text", "says"),
    [
        ("particle.radius=4s", '"4s": must be a number'),
        ("incoming.speed=2 m", ", km/s (from --set incoming.speed=2 m)"),
        ("particle.radius=4,5mm", "write 4.5, with a decimal point"),
        ("plate.restitution=0.5m", "must be a number from 0 to 1"),
        ("stream.count=3m", "must be a whole number"),
    ],
)
def test_another_unit_is_refused(text, says):
    with pytest.raises(sc.SceneError, match=re.escape(says)):
        sc.load("perpendicular", text)


@pytest.mark.parametrize(
    "table", ["surface", "material", "pair", "conveyor", "string", "rod", "spring", "pin", "sensor"]
)
def test_one_pair_of_brackets_is_answered_with_two(table):
    text = f"{CONVEYOR}\n[{table}]\nname = 'a'\n"
    with pytest.raises(sc.SceneError) as caught:
        sc.parse(text)
    said = [str(fault) for fault in caught.value.faults]
    assert f"{table} = a table: head it [[{table}]], with two brackets each" in said[0]
    assert len(said) == 1


def test_names_may_have_spaces():
    row = '[[surface]]\nname = "my hood"\nfrom = [0, -1]\nto = [1, -1]\n'
    found = sc.parse(CONVEYOR + row, overrides=["surface.my hood.speed=30cm/s"])
    assert found.surface[0].speed == 0.3
    assert sc.parse(sc.to_toml(found)) == found
    assert found.with_values({"surface.my hood.speed": 1}).surface[0].speed == 1.0
    for name in (" hood", "hood ", "my  hood", "my\thood", "a.b", "", "x" * 41):
        with pytest.raises(sc.SceneError, match="must be 1 to 40 characters without"):
            sc.parse(CONVEYOR + row.replace("my hood", name.replace("\t", "\\t")))
