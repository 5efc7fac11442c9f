"""benchmarks/work_precision.py: it runs, and exact has no error to speak of."""

import getpass
import json
import socket
from importlib import import_module
from pathlib import Path

import pytest
from click.testing import CliRunner

from chutelab.checks.workprecision import environment
from work_precision import main
from workprecision import METHODS, Record, cases, from_tsv

KNOWN = cases()
# A function of the package hides this module.
MEASURE = import_module("workprecision.measure")


@pytest.mark.parametrize(
    "case",
    [
        "transfer",
        *(pytest.param(c, marks=pytest.mark.slow) for c in ("bounce", "belt", "independent")),
    ],
)
def test_exact_has_no_error_to_speak_of(case):
    trial = MEASURE.Trial(KNOWN[case], METHODS["exact"], None, patience=0.03)
    trial.repeat()
    found = trial.record()
    assert not found.failed
    assert found.error < 1e-12
    assert found.residual < 1e-12
    assert found.parameter == ""
    assert found.memory > 1000


def test_the_environment_names_nobody():
    text = json.dumps(environment())
    assert "core" in text
    for name in (socket.gethostname(), str(Path.home()), str(Path.cwd())):
        assert name not in text
    assert getpass.getuser() not in text.split()


@pytest.fixture(autouse=True)
def hasty(monkeypatch):
    """No measurement is repeated for long: what is measured is not looked at."""
    monkeypatch.setattr(MEASURE, "QUICK_PATIENCE", 0.02)
    monkeypatch.setattr(MEASURE, "SCALING_PATIENCE", 0.02)


def test_the_script_prints_tables_and_writes_both_files(tmp_path):
    out = tmp_path / "new" / "out"
    words = f"transfer interacting --quick --repeats 1 --method exact --out {out}"
    said = CliRunner().invoke(main, words.split()).stdout
    assert "Single transfer" in said
    assert "1,000 interacting particles" in said
    assert "exact failed: no contacts between particles" in said
    assert f"wrote into {out}: work-precision.tsv, work-precision.png" in said
    assert sorted(file.name for file in out.iterdir()) == [
        "work-precision.png", "work-precision.tsv"
    ]  # fmt: skip
    rows, about = from_tsv((out / "work-precision.tsv").read_text(encoding="utf-8"), Record)
    assert [(row.case, row.method, bool(row.failed)) for row in rows] == [
        ("transfer", "exact", False),
        ("interacting", "exact", True),
    ]
    assert rows[0].error < 1e-12
    assert about == environment()
