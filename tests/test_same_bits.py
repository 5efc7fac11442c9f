"""The same command leaves the same files to the last bit, on any machine, for any user."""

import json
import os
import subprocess
import sys
from pathlib import Path

import pytest

from chutelab.cli import main

HERE = Path(__file__).parent

QUICK = [
    "run perpendicular --out run --only csv,npz,json -q",
    "live perpendicular -o live.html",
]

# The words of one command a line; each may use what those above it have written.
EVERY = [
    *QUICK,
    "run perpendicular --out pictures --only png -q",
    "run stream --out film --format mp4 --set stream.count=9 -q",
    "run perpendicular --out film --only gif,webm,strobe -q",
    "run stream --out met --set stream.count=20 --set stream.interact=true --only npz,json,png -q",
    "run slip --out pymunk --engine pymunk --only npz,json,csv -q",
    "run perpendicular --out reached --engine pymunk --accuracy 1e-6 --only npz,json -q",
    "sweep perpendicular --vary plate.angle_deg=0:40:5 --out a.csv --plot a.svg",
    "show run/recording.npz --out shown",
    "sweep perpendicular --vary plate.angle_deg=0:40:5 --json --out a.parquet --plot a.pdf",
    "sweep perpendicular --vary plate.angle_deg=0:40:5 --vary incoming.speed=1:3:4 --jobs 2"
    " --out b.csv --plot b.svg",
    "sweep perpendicular --vary plate.angle_deg=0:40 --vary incoming.speed=1:3 --sample 8"
    " --design sobol --out c.parquet --plot c.pdf",
    "sweep perpendicular --uncertainty plate.restitution=0.5±0.05 --out u.csv --plot u.png",
    "solve perpendicular --vary plate.angle_deg=0:60 --target landing.vx=1 --out solved",
    "solve perpendicular --vary plate.angle_deg=0:60 --vary incoming.speed=1:3"
    " --minimize belt_work --out least",
    "compare perpendicular --data perpendicular-track --out compared",
    "discharge slip --out discharged",
    "field slip --out fields --vtk",
    "report perpendicular -o report.html",
    "lesson list --json",
    "lesson show 3",
    "lesson build 1 --out built",
    "lesson page 1 -o pages",
    "lesson scorm 1 -o scorm.zip",
    "lesson new own",
    "lesson new mine --from 3",
    "lesson grade mine/exercise.ipynb --out class.csv",
    "figure 6 --out figures",
    "tables --json",
    "scenes --json",
    "schema",
    "schema --run",
    "quantities --json",
    "materials --json",
    "new untitled.toml",
    "run untitled.toml --out untitled --only npz,json,png -q",
    "lesson build ./own -q",
    "lesson page ./mine -o bundle",
    "stress slip --json",
]

ALGEBRA = [
    "compare perpendicular --data perpendicular-track --fit plate.restitution --json --out fitted",
    "verify perpendicular stream --json",
]
"""What goes through LAPACK and BLAS, whose last digits depend on the processor: least squares, and
SciPy's ODE solver, the answer that `verify` holds the others against."""

TIMED = {"bench", "check"}
"""Commands whose answer is how long something takes, or will."""

ONE = {"PYTHONHASHSEED": "1", "TZ": "UTC", "LC_ALL": "C.UTF-8", "COLUMNS": "80"}
OTHER = {"PYTHONHASHSEED": "77", "TZ": "Asia/Tokyo", "OPENBLAS_NUM_THREADS": "1"}
KERNELS = {"OPENBLAS_CORETYPE": "Prescott"}
"""Of linear algebra: those of the oldest processor, not the ones that suit this one best."""


def written(folder, commands, environment):
    """Run commands in a new folder; return what is in its files by their paths in it."""
    folder.mkdir(parents=True)
    arguments = [HERE / "in_a_row.py", json.dumps([line.split() for line in commands])]
    given = {*ONE, *OTHER, *KERNELS}
    found = {key: value for key, value in os.environ.items() if key not in given}
    path = os.pathsep.join([str(HERE.parent / "src"), *filter(None, [found.get("PYTHONPATH")])])
    subprocess.run(
        [sys.executable, *arguments],
        cwd=folder,
        env={**found, "COLUMNS": "80", "PYTHONPATH": path, **environment},
        check=True,
        timeout=600,
    )
    files = sorted(path for path in folder.rglob("*") if path.is_file())
    return {str(path.relative_to(folder)): path.read_bytes() for path in files}


@pytest.mark.slow
@pytest.mark.parametrize(
    ("commands", "kernels"),
    [
        pytest.param(QUICK, KERNELS, id="quick"),
        pytest.param(EVERY, KERNELS, marks=pytest.mark.slow, id="every"),
        pytest.param([*QUICK, *ALGEBRA], {}, marks=pytest.mark.slow, id="algebra"),
    ],
)
def test_files_are_the_same_bits_from_any_process(tmp_path, commands, kernels):
    one = written(tmp_path / "one", commands, ONE)
    other = written(tmp_path / "another folder" / "other", commands, {**OTHER, **kernels})
    assert list(one) == list(other)
    assert [name for name in one if one[name] != other[name]] == []
    assert {"run/recording.npz", "run/summary.json", "overlay.svg", "overlay.pdf"} <= one.keys()


def test_every_command_is_compared_or_answers_with_times():
    lesson = main.commands["lesson"].commands
    lines = [line.split() for line in (*EVERY, *ALGEBRA)]
    assert {words[0] for words in lines} | TIMED == main.commands.keys()
    assert {words[1] for words in lines if words[0] == "lesson"} == lesson.keys()
