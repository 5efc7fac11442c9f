"""Scenes of all parts, each broken in one place: refused by the command, with file and key."""

import re
from contextlib import nullcontext
from math import inf, nan

import pytest
import tomli_w
from click.testing import CliRunner

from broken_sandbox import BASES, BY_HAND, GONE, at, broken, leaves
from chutelab import machine, scene
from chutelab.cli import main


@pytest.mark.parametrize("name", BASES)
def test_what_is_broken_was_sound(name):
    machine.build(scene.from_dict(BASES[name]))


@pytest.mark.parametrize("number", range(len(BY_HAND)))
def test_a_broken_scene_is_refused_with_file_key_value_and_what_is_allowed(number, tmp_path):
    name, changes, key, allowed = BY_HAND[number]
    tables = broken(name, changes)
    file = tmp_path / "broken.toml"
    file.write_text(tomli_w.dumps(tables), encoding="utf-8")
    words = ["check", str(file)]
    if number % 4 == 0:
        words = ["run", str(file), "--out", str(tmp_path / "out")]
    outcome = CliRunner().invoke(main, words)
    said = outcome.stderr
    assert outcome.exit_code == 2, (changes, outcome.output)
    assert said.startswith(f"Error: {file}: "), (changes, said)
    lines = said.replace(str(file), "").splitlines()
    assert len(lines) <= 1 + 3, (changes, "one fault brings no crowd of others with it", said)
    about = [line for line in lines if re.search(rf" {re.escape(key)}( =|:| is missing)", line)]
    assert any(allowed in line for line in about), (changes, said)
    if changes.get(key, GONE) is not GONE:
        assert any(f"{key} = {scene.shown(changes[key])}: " in line for line in about), said
    assert "Traceback" not in said + outcome.stdout
    assert not outcome.stdout
    assert [path.name for path in tmp_path.iterdir()] == ["broken.toml"]


MOVES = [
    *("turn", "shake.by", "shake.frequency", "shake.phase_deg", "travel.to", "travel.at"),
    *("travel.in", "hinge", "mass", "inertia", "spring", "rest_deg", "damper", "stops_deg"),
    *("motor.speed_deg", "motor.torque", "starts_when.touched"),
]
KEYS = {
    "machine": [
        *("gravity_deg", "stream[1].omega", "surface[0].pivot", "surface[0].passes"),
        *("surface[0].opens_when.touched", "surface[0].closes_when.touched", "pair[1].meet"),
        *(f"{table}.{key}" for table in ("surface[0]", "plate[1]") for key in MOVES),
    ],
    "dominoes": [
        *("particle[1].shape", "particle[1].size", "particle[2].points"),
        *(f"string[0].{key}" for key in ("from", "particle", "length", "other")),
        *(f"rod[0].{key}" for key in ("from", "particle", "length", "other")),
        *(f"spring[0].{key}" for key in ("from", "particle", "length", "stiffness", "damper")),
        *(f"pin[0].{key}" for key in ("from", "particle", "other")),
    ],
}
"""Keys of what moves, hangs, is joined, waits and lets through, by a scene that has their table."""


@pytest.mark.parametrize("junk", [nan, -inf, {"a": 1}, [[1.0]], 1e300, True], ids=str)
@pytest.mark.parametrize("name", BASES)
def test_what_no_key_has_is_refused_by_each_of_them(name, junk):
    """With key, value and what is allowed instead; all that a scene has, and then could have."""
    values = {scene.shown(value) for value in (junk, *(junk if type(junk) is list else ()))}
    base = BASES[name]
    own = [key for key in leaves(base) if not junk is at(base, key) is True]
    for keys in (own, KEYS.get(name, []) if junk is not True else []):
        with pytest.raises(scene.SceneError) if keys else nullcontext() as refused:
            scene.from_dict(broken(name, dict.fromkeys(keys, junk)))
        for key in keys:
            # Of a list it may be an entry that is told, of a table its key, of a range the whole.
            whole = key.partition("radius[")[0] + "radius" if "radius[" in key else key
            told = [fault for fault in refused.value.faults if fault.key.startswith(whole)]
            given = {scene.shown(fault.value) for fault in told}
            assert given & values or (given and (isinstance(junk, dict) or whole != key)), key
            assert all(len(fault.allowed) > 5 for fault in told)
