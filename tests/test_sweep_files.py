"""Files of sweeps: every bit of the rows, whole or not at all, also after an interruption."""

from __future__ import annotations

import csv
import os
import signal
import subprocess
import sys
from pathlib import Path
from time import monotonic, sleep

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import chutelab
from chutelab.scene import load
from chutelab.studies.sweep import (
    NUMBERS,
    REASON,
    crew,
    planned,
    sweep,
    sweep_to,
)
from chutelab.studies.sweep.batch import alone
from chutelab.studies.sweep.part import part_of
from chutelab.studies.sweep.result import columns_of, text_of
from chutelab.studies.sweep.rows import joined
from chutelab.util.errors import InputError


@pytest.fixture(autouse=True)
def _elsewhere(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)


SMALL = ["plate.angle_deg=-20:40:7", "incoming.speed=1,2"]


def test_a_file_has_every_bit_of_the_rows():
    swept = sweep(load("perpendicular"), SMALL)
    with swept.to_csv("rows.csv").open(newline="") as file:
        head, *rows = csv.reader(file)
    assert head == ["plate.angle_deg", "incoming.speed", *NUMBERS, REASON]
    for name, cells in zip(head, zip(*rows, strict=True), strict=True):
        if name == REASON:
            assert list(cells) == swept.columns[name].tolist()
        else:
            numbers = np.array([float(cell) if cell else np.nan for cell in cells])
            assert numbers.tobytes() == np.asarray(swept.columns[name]).tobytes()


def test_parquet_has_them_too():
    parquet = pytest.importorskip("pyarrow.parquet")
    swept = sweep(load("perpendicular"), SMALL)
    table = parquet.read_table(swept.to_parquet("rows.parquet"))
    assert table.column_names == list(swept.columns)
    for name, values in swept.columns.items():
        column = table.column(name).to_pylist()
        if name == REASON:
            assert column == values.tolist()
        else:
            assert [np.nan if x is None else x for x in column] == pytest.approx(
                values.tolist(), rel=0, abs=0, nan_ok=True
            )


@given(st.lists(st.floats(), min_size=1, max_size=4), st.text(st.characters(codec="utf-8")))
def test_text_gives_rows_back(numbers, words):
    reason = " ".join(words.split())
    columns = {
        "x": np.array(numbers),
        REASON: np.array([reason] * len(numbers), dtype=object),
    }
    found = columns_of(tuple(columns), text_of(columns))
    assert found[REASON].tolist() == [reason] * len(numbers)
    assert np.array_equal(found["x"], columns["x"], equal_nan=True)
    finite = ~np.isnan(columns["x"])
    assert (np.signbit(found["x"]) == np.signbit(columns["x"]))[finite].all()


def test_nothing_is_written_when_a_variant_fails(monkeypatch):
    def broken(*_):
        raise RuntimeError("broken")

    monkeypatch.setattr("chutelab.studies.sweep.sweeping.swept", broken)
    plan = planned(load("perpendicular"), SMALL)
    with crew() as team, pytest.raises(RuntimeError, match="broken"):
        sweep_to(plan, "rows.csv", team)
    assert not list(Path().iterdir())


# going on after an interruption ------------------------------------------------------------------


@pytest.fixture(scope="module")
def interrupted(tmp_path_factory):
    """A sweep of 40 rows in blocks of one, its file, and the rows kept while it was written."""
    folder = tmp_path_factory.mktemp("whole")
    plan = planned(load("perpendicular"), ["plate.angle_deg=-20:20:40"], engine="pymunk")
    kept = []
    with crew() as team:
        sweep_to(plan, folder / "rows.csv", team)
        with pytest.raises(KeyboardInterrupt):
            sweep_to(plan, folder / "cut.csv", team, progress=stop_at(0.99))
    kept = part_of(folder / "cut.csv").read_bytes()
    return plan, (folder / "rows.csv").read_bytes(), kept


def stop_at(share):
    def update(done):
        if done >= share:
            raise KeyboardInterrupt

    return update


@pytest.mark.parametrize("share", [0.0, 0.01, 0.1, 0.3, 0.5, 0.77, 0.98, 1.0])
@pytest.mark.parametrize("form", ["csv", "parquet"])
def test_a_sweep_goes_on_and_writes_the_same_bytes(interrupted, share, form):
    plan, whole, kept = interrupted
    out = Path(f"rows.{form}")
    # Cut anywhere, in the middle of a line or of a number.
    part_of(out).write_bytes(kept[: int(share * len(kept))])
    ran = []
    with crew() as team:
        sweep_to(plan, out, team, resume=True, progress=ran.append)
        if form == "parquet":
            sweep_to(plan, "again.parquet", team)
            whole = Path("again.parquet").read_bytes()
    assert out.read_bytes() == whole
    assert not part_of(out).exists()
    if share > 0.2:
        assert len(ran) < plan.count


def test_rows_that_are_there_are_not_simulated_again(interrupted, monkeypatch):
    plan, whole, kept = interrupted
    part_of(Path("rows.csv")).write_bytes(kept)
    asked = []

    def noting(block):
        asked.append(len(block.values))
        return joined([alone(block, row) for row in range(len(block.values))])

    monkeypatch.setattr("chutelab.studies.sweep.sweeping.swept", noting)
    with crew() as team:
        sweep_to(plan, "rows.csv", team, resume=True)
    assert sum(asked) == 1
    assert Path("rows.csv").read_bytes() == whole


def test_rows_of_another_sweep_are_refused(interrupted):
    plan, _, kept = interrupted
    scene = load("perpendicular")
    part_of(Path("rows.csv")).write_bytes(kept)
    others = {
        "what --vary says": planned(scene, ["plate.angle_deg=-20:20:41"], engine="pymunk"),
        "--engine": planned(scene, ["plate.angle_deg=-20:20:40"], engine="exact"),
        "the scene": planned(
            load("perpendicular", ["gravity=9.8"]), ["plate.angle_deg=-20:20:40"], engine="pymunk"
        ),
        "--sample": planned(scene, ["plate.angle_deg=-20:20"], engine="pymunk", sample=40),
    }
    with crew() as team:
        for difference, other in others.items():
            with pytest.raises(InputError, match=difference):
                sweep_to(other, "rows.csv", team, resume=True)
        with pytest.raises(InputError, match="--resume"):
            sweep_to(plan, "rows.csv", team)
        assert part_of(Path("rows.csv")).read_bytes() == kept
        part_of(Path("rows.csv")).write_bytes(b"my notes\n")
        with pytest.raises(InputError, match="no rows of a sweep"):
            sweep_to(plan, "rows.csv", team, resume=True)


def test_there_may_be_nothing_to_go_on_with(interrupted):
    plan, whole, _ = interrupted
    with crew() as team:
        sweep_to(plan, "rows.csv", team, resume=True)
    assert Path("rows.csv").read_bytes() == whole


def test_ctrl_c_keeps_the_finished_rows_and_says_so():
    sources = str(Path(chutelab.__file__).parent.parent)
    command = ["sweep", "perpendicular", "--vary", "plate.angle_deg=-20:20:100"]
    command += ["--vary", "plate.restitution=0:1:100"]
    running = subprocess.Popen(
        [sys.executable, "-m", "chutelab", *command, "--engine", "pymunk", "--out", "rows.csv"],
        env={**os.environ, "PYTHONPATH": sources},
        stderr=subprocess.PIPE,
        text=True,
    )
    part, patience = part_of(Path("rows.csv")), monotonic() + 30.0
    while not (part.exists() and part.stat().st_size > 20_000) and monotonic() < patience:
        sleep(0.05)
    running.send_signal(signal.SIGINT)
    _, said = running.communicate(timeout=30)
    assert running.returncode == 130
    assert "rows.csv.part has the finished rows; --resume goes on" in said
    assert "Traceback" not in said
    assert [path.name for path in Path().iterdir()] == [part.name]


def test_a_table_has_a_known_ending():
    with pytest.raises(InputError, match="parquet"), crew() as team:
        sweep_to(planned(load("perpendicular"), SMALL), "rows.xlsx", team)
