"""Scenes of all parts, each broken in one place: refused by the command, with file and key."""

import re

import pytest
import tomli_w
from click.testing import CliRunner

from broken_sandbox import BASES, GONE, VARIANTS, broken
from chutelab import machine, scene
from chutelab.cli import main


@pytest.mark.parametrize("name", BASES)
def test_what_is_broken_was_sound(name):
    machine.build(scene.from_dict(BASES[name]))


@pytest.mark.parametrize("number", range(len(VARIANTS)))
def test_a_broken_scene_is_refused_with_file_key_value_and_what_is_allowed(number, tmp_path):
    name, changes, key, allowed = VARIANTS[number]
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
