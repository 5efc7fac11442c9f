"""Files of sweeps: every bit of the rows, whole or not at all."""

import csv
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from chutelab.scene import load
from chutelab.studies.sweep import COLUMNS, REASON, TEXTS, crew, planned, sweep, sweep_to
from chutelab.studies.sweep.rows import columns_of
from chutelab.util.errors import InputError
from chutelab.util.files import csv_columns


@pytest.fixture(autouse=True)
def _elsewhere(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)


SMALL = {"plate.angle_deg": range(-20, 41, 10), "incoming.speed": [1, 2]}


def test_a_file_has_every_bit_of_the_rows():
    swept = sweep(load("perpendicular"), SMALL)
    with swept.to_csv("rows.csv").open(newline="") as file:
        head, *rows = csv.reader(file)
    assert head == ["plate.angle_deg", "incoming.speed", *COLUMNS, *TEXTS]
    for name, cells in zip(head, zip(*rows, strict=True), strict=True):
        if name in TEXTS:
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
        if name in TEXTS:
            assert column == values.tolist()
        else:
            assert [np.nan if x is None else x for x in column] == pytest.approx(
                values.tolist(), rel=0, abs=0, nan_ok=True
            )


@pytest.mark.slow
@settings(max_examples=40)
@given(st.lists(st.floats(), min_size=1, max_size=4), st.text(st.characters(codec="utf-8")))
def test_text_gives_rows_back(numbers, words):
    reason = " ".join(words.split())
    columns = {"x": np.array(numbers), REASON: np.array([reason] * len(numbers), dtype=object)}
    found = columns_of(tuple(columns), csv_columns(columns.values()))
    assert found[REASON].tolist() == [reason] * len(numbers)
    assert np.array_equal(found["x"], columns["x"], equal_nan=True)
    finite = ~np.isnan(columns["x"])
    assert (np.signbit(found["x"]) == np.signbit(columns["x"]))[finite].all()


def test_nothing_is_written_when_a_variant_fails(monkeypatch):
    def broken(*_):
        raise RuntimeError("broken")

    monkeypatch.setattr("chutelab.studies.sweep.swept", broken)
    plan = planned(load("perpendicular"), SMALL)
    with crew() as team, pytest.raises(RuntimeError, match="broken"):
        sweep_to(plan, "rows.csv", team)
    assert not list(Path().iterdir())


def test_a_table_has_a_known_ending():
    with pytest.raises(InputError, match="parquet"), crew() as team:
        sweep_to(planned(load("perpendicular"), SMALL), "rows.xlsx", team)
