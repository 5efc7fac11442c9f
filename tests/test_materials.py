"""Materials: a scene's own, the presets, and how ``chutelab materials`` prints them."""

import json
import re
import tomllib

import pytest
from click.testing import CliRunner
from pydantic import ValidationError

from chutelab.cli import main
from chutelab.scene.materials import DENSEST, LIGHTEST, PRESETS, Material

# The contract of the scene file, copied by hand.
NUMBERS = (
    "density", "restitution", "friction", "restitution_steel", "friction_steel",
    "restitution_rubber", "friction_rubber",
)  # fmt: skip

# What sources give, copied by hand from them: it lies within the spread.
MEASURED = [
    ("steel", "density", (7800, 7860)),  # OpenStax; Lust
    ("steel", "restitution", (0.6, 0.85)),  # bearing ball; Hlosta
    ("steel", "friction", (0.17, 0.42, 0.5)),  # Hlosta; ToolBox; Lust
    ("rubber", "density", (1190,)),  # CRC
    ("rubber", "restitution", (0.83,)),  # rubber bands
    ("rubber", "friction_steel", (0.64, 0.86)),  # ToolBox
    ("gravel", "density", (2640, 2760)),  # CRC, granite
    ("gravel", "restitution", (0.83,)),  # Durda, granite
    ("gravel", "friction_steel", (0.39, 0.49, 0.59)),  # EN 1991-4, aggregate
    ("limestone", "density", (2680, 2760)),  # CRC
    ("sand", "density", (2650,)),  # CRC, quartz
    ("sand", "friction_steel", (0.38, 0.48, 0.57)),  # EN 1991-4
    ("coal", "density", (1200, 1500, 1800)),  # CRC
    ("coal", "friction_steel", (0.44, 0.49, 0.59)),  # EN 1991-4
    ("coal", "friction_rubber", (0.5, 0.7)),  # ISO 5048
    ("iron-ore", "density", (3600, 5200)),  # limonite, hematite
    ("iron-ore", "friction_steel", (0.49, 0.54, 0.59)),  # EN 1991-4
    ("wheat", "density", (1240, 1333)),  # Int. Agrophysics; J. Food Engineering
    ("wheat", "friction_steel", (0.248, 0.331, 0.38, 0.57)),  # Asli-Ardeh; EN 1991-4
    ("wood", "density", (490, 600, 900)),  # CRC, cedar and oak
    ("wood", "friction", (0.25, 0.3, 0.5)),  # ToolBox; Lust
    ("wood", "friction_steel", (0.2, 0.3, 0.6)),  # ToolBox; Lust
    ("polyethylene", "density", (920, 970)),  # CRC
    ("polyethylene", "restitution", (0.87,)),  # Foerster, acetate
    ("polyethylene", "friction_steel", (0.2, 0.35)),  # ToolBox; Lust
    ("glass", "density", (2400, 2600, 2800)),  # CRC; OpenStax
    ("glass", "restitution", (0.66, 0.97)),  # marble; Foerster
    ("glass", "friction", (0.092, 0.4)),  # Foerster; ToolBox
    ("glass", "friction_rubber", (2.0,)),  # ToolBox
    ("ice", "density", (917,)),  # CRC
    ("ice", "restitution", (0.06, 0.45, 0.84)),  # Heißelmann
    ("ice", "friction", (0.01, 0.15)),  # Seppyo
    ("ice", "friction_rubber", (0.15, 0.4)),  # Physics Factbook
]


def call(*arguments, code=0):
    result = CliRunner(env={"COLUMNS": "80"}).invoke(main, ["materials", *arguments])
    assert result.exit_code == code, result.output
    return result


def test_a_pair_that_is_not_given_is_as_the_material_with_itself():
    own = {"name": "slag", "density": 2900.0, "restitution": 0.3, "friction": 0.7}
    slag = Material(**own, friction_rubber=0.0)
    assert (slag.restitution_steel, slag.restitution_rubber) == (0.3, 0.3)
    assert (slag.friction_steel, slag.friction_rubber) == (0.7, 0.0)
    assert slag.model_dump(exclude_unset=True) == {**own, "friction_rubber": 0.0}
    # A default follows what it defaults to.
    changed = Material(**{**slag.model_dump(exclude_unset=True), "friction": 0.2})
    assert (changed.friction_steel, changed.friction_rubber) == (0.2, 0.0)


@pytest.mark.parametrize(
    "wrong",
    [
        {"density": 0.0}, {"density": -1.0}, {"density": float("inf")}, {"restitution": 1.01},
        {"restitution_steel": -0.1}, {"friction": -0.1}, {"friction_rubber": "0.5"},
        {"name": "iron  ore"}, {"name": ""}, {"friction_glass": 0.5}, {"density": None},
        {"restitution": None}, {"friction": None}, {"name": None},
    ],
)  # fmt: skip
def test_a_material_that_cannot_be_is_refused(wrong):
    good = {"name": "slag", "density": 2900.0, "restitution": 0.3, "friction": 0.7}
    Material(**good)
    ((key, value),) = wrong.items()
    given = {**good, key: value}
    if value is None:  # left out
        del given[key]
    with pytest.raises(ValidationError) as refused:
        Material(**given)
    assert [error["loc"] for error in refused.value.errors()] == [(key,)]


@pytest.mark.parametrize("name", PRESETS)
def test_a_preset_lies_within_its_spread_and_has_sources(name):
    preset = PRESETS[name]
    assert preset.material.name == name
    values = preset.material.model_dump(exclude={"name"})
    assert tuple(values) == tuple(preset.spread) == tuple(preset.sources) == NUMBERS
    assert Material(name=name, **values) == preset.material
    for key, value in values.items():
        low, high = preset.spread[key]
        assert 0.0 < low <= value <= high, key
        assert low < high, key
        assert preset.sources[key], key
        assert all(len(text) > 40 for text in preset.sources[key]), key
        # Two digits are all that is known; densities may have three.
        assert float(f"{value:.{3 if key == 'density' else 2}g}") == value
        if key.startswith("restitution"):
            assert high < 1.0
    assert preset.spread["density"][0] > LIGHTEST
    assert preset.spread["density"][1] < DENSEST


@pytest.mark.parametrize(("name", "key", "found"), MEASURED)
def test_what_was_measured_lies_within_the_spread(name, key, found):
    low, high = PRESETS[name].spread[key]
    assert low <= min(found)
    assert max(found) <= high


def test_the_list_has_every_number_and_is_not_cut():
    text = call().stdout
    # Tables fill their last column with spaces.
    assert max(len(line.rstrip()) for line in text.splitlines()) <= 80
    assert "…" not in text
    tables, _, notes = text.partition("\n[1] ")
    densities, restitutions, frictions = re.split(r"\nCoefficient of \w+ .\n", tables)
    for name, preset in PRESETS.items():
        assert re.search(rf"^{name} .*{preset.about}", densities, re.MULTILINE)
        for key, value in preset.material.model_dump(exclude={"name"}).items():
            low, high = preset.spread[key]
            table = restitutions if key.startswith("restitution") else frictions
            printed = f" {value:.2f}  {low:.2f}-{high:.2f} "
            if key == "density":
                table, printed = densities, f" {value:.0f} +{low:.0f}-{high:.0f} "
            assert re.search(f"^{name} .*{printed}", table, re.MULTILINE), (name, key)
            assert all(source in " ".join(notes.split()) for source in preset.sources[key])


@pytest.mark.parametrize("name", PRESETS)
def test_one_material_ends_with_tables_to_copy(name):
    text = call(name).stdout
    assert max(len(line.rstrip()) for line in text.splitlines()) <= 80
    table, _, particle = text.partition("\nIn a scene:\n")
    as_it_is, changed, block = re.split(r'^Or .*material = "(.*)":$', particle, flags=re.M)
    assert tomllib.loads(as_it_is) == {"particle": {"material": name}}
    (own,) = tomllib.loads(block)["material"]
    assert own.pop("name") == changed == f"my-{name}"
    assert Material(name=name, **own) == PRESETS[name].material
    said = " ".join(table.split())
    for sources in PRESETS[name].sources.values():
        assert all(source in said for source in sources)


@pytest.mark.parametrize("arguments", [(), ("iron-ore",)])
def test_json_gives_the_presets_back(arguments):
    found = json.loads(call(*arguments, "--json").stdout)
    assert list(found) == ["format", "materials", "sources"]
    assert [one["material"]["name"] for one in found["materials"]] == list(arguments or PRESETS)
    for one in found["materials"]:
        preset = PRESETS[one["material"]["name"]]
        assert Material(**one["material"]) == preset.material
        assert one["about"] == preset.about
        assert {key: tuple(ends) for key, ends in one["spread"].items()} == preset.spread
        sources = {
            key: tuple(found["sources"][number - 1] for number in numbers)
            for key, numbers in one["sources"].items()
        }
        assert sources == preset.sources


@pytest.mark.parametrize(
    ("name", "hint"),
    [
        ("coall", "did you mean coal?"),
        ("iron ore", "did you mean iron-ore?"),
        ("Steel", "did you mean steel?"),
        ("x", f"there are {', '.join(PRESETS)}"),
        ("", f"there are {', '.join(PRESETS)}"),
    ],
)
def test_an_unknown_material_is_refused_with_what_was_meant(name, hint):
    for more in ([], ["--json"]):
        result = call(name, *more, code=2)
        assert result.stdout == ""
        assert result.stderr == f"Error: material = {json.dumps(name)}: {hint}\n"
