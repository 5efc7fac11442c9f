"""benchmarks/work_precision.py: errors against formulas written here, fits on made-up rows."""

import getpass
import json
import socket
from dataclasses import replace
from importlib import import_module
from pathlib import Path

import pytest
from click.testing import CliRunner

from chutelab.util.files import tsv_text
from chutelab.util.versions import environment
from work_precision import main
from workprecision import METHODS, Record, Size, cases, claims, from_tsv, whole_process
from workprecision.claims import order
from workprecision.measure import COMMANDS

G, R = 9.81, 0.1
KNOWN = cases()
# A function of the package hides this module.
MEASURE = import_module("workprecision.measure")


def one(case, method, value=None):
    """One record, as little of it as possible."""
    trial = MEASURE.Trial(KNOWN[case], METHODS[method], value, patience=0.03)
    trial.repeat()
    return trial.record()


# Methods.


@pytest.mark.parametrize("case", ["transfer", "bounce", "belt", "independent"])
def test_exact_has_no_error_to_speak_of(case):
    found = one(case, "exact")
    assert not found.failed
    assert found.error < 1e-12
    assert found.residual < 1e-12
    assert found.parameter == ""
    assert found.memory > 1000


def test_plain_pymunk_is_of_first_order():
    rows = [one("transfer", "plain", dt) for dt in (2e-3, 1e-3, 5e-4)]
    assert 0.5 < order(rows, "transfer", "plain") < 1.5
    assert all(1e-4 < row.error < 3e-2 for row in rows)
    # The error of the flight alone: y comes out ½ g dt t too low.
    assert rows[1].error > 0.5 * G * 1e-3 * 0.298 / (R + 0.5179)


# Lines through points.


def rows_of(method, law, steps=(1e-2, 1e-3, 1e-4), case="transfer"):
    """Rows of a method whose error and time follow a law of its step."""
    return [
        Record(case, method, "dt", dt, first=1.0, repeats=3, median=law(dt)[1], error=law(dt)[0])
        for dt in steps
    ]


def test_claims_follow_from_the_rows():
    rows = [
        Record("transfer", "exact", median=5e-4, error=2e-16),
        # error dt / 5, time 4e-6 / dt: 1e-4 at dt = 5e-4, in 8 ms.
        *rows_of("plain", lambda dt: (0.2 * dt, 4e-6 / dt)),
        Record("transfer", "dop853", "rtol", 1e-9, median=7e-4, error=1e-15),
    ]
    said = {claim.sentence: claim.value for claim in claims(rows)}
    assert said == {
        "at an error of 0.0001 exact is 16 times faster than plain Pymunk: 500 µs, 8 ms":
            pytest.approx(16.0),
        "at an error of 0.0001 exact is 1.4 times faster than SciPy DOP853: 500 µs, 700 µs":
            pytest.approx(1.4),
        "exact, with an error of 2e-16, is 8.0 times faster than plain Pymunk at dt = 0.001 s,"
        " with one of 2e-04": pytest.approx(8.0),
    }  # fmt: skip


# Files.


def test_rows_come_back_from_a_file_to_the_last_bit():
    rows = [
        Record("transfer", "plain", "dt", 1.0 / 3.0, 0.1, 9, 1e-17 / 3.0, 2.0**-52, "t2", 12345),
        Record("bounce", "exact", failed='said "no", and left'),
    ]
    about = {"processor": "Some: CPU, 2 cores", "numpy": "2.4"}
    text = tsv_text(rows, Record, about)
    assert from_tsv(text, Record) == (rows, about)
    sizes = [Size("independent", "exact", 10, 40, 0.1, 3, 0.2, 99)]
    assert from_tsv(tsv_text(sizes, Size, {}), Size) == (sizes, {})
    with pytest.raises(ValueError, match="expected the columns"):
        from_tsv(text, Size)


def test_the_environment_names_nobody():
    text = json.dumps(environment())
    assert "core" in text
    for name in (socket.gethostname(), str(Path.home()), str(Path.cwd())):
        assert name not in text
    assert getpass.getuser() not in text.split()


# The whole process, and scaling.


def test_whole_process():
    run, bare = whole_process(0)
    assert (run.method, bare.method) == tuple(COMMANDS)
    assert run.error < 1e-12
    assert bare.error is None
    assert run.median == run.first
    said = claims([replace(run, median=0.31), replace(bare, median=0.12)])
    assert [claim.value for claim in said] == [pytest.approx(0.19)]
    assert "takes 310 ms, 190 ms more than importing NumPy" in said[0].sentence


# The command.


@pytest.fixture(autouse=True)
def hasty(monkeypatch):
    """No measurement is repeated for long: what is measured is not looked at."""
    monkeypatch.setattr(MEASURE, "QUICK_PATIENCE", 0.02)
    monkeypatch.setattr(MEASURE, "SCALING_PATIENCE", 0.02)


def call(*arguments, code=0):
    result = CliRunner().invoke(main, [*map(str, arguments)])
    assert result.exit_code == code, result.output
    assert "Traceback" not in result.output
    return result


def test_the_script_prints_tables_and_writes_both_files(tmp_path):
    out = tmp_path / "new" / "out"
    said = call(
        "transfer", "interacting", "--quick", "--repeats", 1, "--method", "exact", "--out", out
    ).stdout
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


@pytest.mark.parametrize(
    ("arguments", "allowed"),
    [
        (["transfers"], "'transfer', 'bounce', 'belt', 'independent', 'interacting', 'process'"),
        (["--method", "box2d"], "'exact', 'contact', 'aligned', 'fixed', 'plain', 'dop853'"),
        (["--repeats", "0"], "1<=x<=1000"),
        (["--scaling", "transfer"], "independent and interacting"),
        (["--scaling", "--method", "plain"], "exact, contact, fixed"),
        (["--out", ""], "the name of a folder is empty"),
    ],
)
def test_what_the_script_cannot_use_is_refused(arguments, allowed, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    result = call(*arguments, code=2)
    assert allowed in " ".join(result.output.split())
    assert not list(tmp_path.iterdir())
