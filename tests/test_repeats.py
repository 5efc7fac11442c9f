"""Many seeds: means and standard errors of runs, sweeps and searches, against sums by hand."""

import csv
import io
import json
from functools import cache
from math import sqrt

import numpy as np
import pytest
from click.testing import CliRunner

import chutelab
from chutelab import scene as sc
from chutelab.cli import main
from chutelab.pictures.plots.studies import repeats, sweep_figure
from chutelab.results.quantities import measure
from chutelab.studies.repeats import repeat
from chutelab.studies.sweep import sweep
from chutelab.util.errors import InputError
from shared import call

CROWD = sc.from_dict({
    "title": "Crowd transfer",
    "particle": {"material": "coal", "radius": 0.02},
    "incoming": {"speed": 3.0, "pulley_radius": 0.315, "incline_deg": 8.0, "length": 2.0},
    "plate": {"distance": 0.6, "angle_deg": 20.0, "below": 0.9},
    "outgoing": {"speed": 2.0, "drop": 2.5, "drop_from": "top", "start": -1.0, "length": 10.0},
    "stream": {"count": 40, "rate": "30 t/h", "bed_height": 0.104, "interact": True},
})  # fmt: skip


@cache
def seeded(n, *changes):
    return chutelab.simulate(CROWD.with_values({"stream.seed": n, **dict(changes)}))


def by_hand(name, seeds, **changes):
    """The quantity of each seed, run by itself, and mean and s / sqrt(n) of those that have it."""
    found = np.array([measure(seeded(n, *changes.items()), name) for n in range(seeds)])
    n, mean = len(found), sum(found) / len(found)
    return found, mean, sqrt(sum((found - mean) ** 2) / (n - 1) / n)


@pytest.mark.slow
def test_a_repeat_is_mean_and_standard_error_of_single_runs():
    found = repeat(CROWD, 3)
    for name in ("arrival.vx.mean", "ledger.by_surface.plate.friction_loss", "contacts"):
        values, mean, error = by_hand(name, 3)
        assert found.values[name].tolist() == values.tolist(), name
        assert found[name].mean == pytest.approx(mean, rel=1e-13)
        assert found[name].error == pytest.approx(error, rel=1e-9)
        assert found[name].spread == pytest.approx(error * sqrt(3), rel=1e-9)
    assert found["landing.count"] == (40.0, 0.0, 0.0, 3)
    again = repeat(CROWD, 3, jobs=2)
    assert again.csv() == found.csv()
    rows = list(csv.DictReader(io.StringIO(found.csv())))
    assert [row["seed"] for row in rows] == ["0", "1", "2"]
    assert float(rows[2]["contacts"]) == found.values["contacts"][2]
    assert "landing.x.mean, m" in str(found)
    assert repeats(found).axes[0].get_yticklabels()


def test_variants_of_a_sweep_have_the_same_seeds():
    found = sweep(CROWD, {"plate.angle_deg": [10.0, 30.0]}, repeat=3)
    for row, angle in enumerate((10.0, 30.0)):
        _, mean, error = by_hand("arrival.vx.mean", 3, **{"plate.angle_deg": angle})
        assert found.columns["arrival.vx.mean"][row] == pytest.approx(mean, rel=1e-13)
        assert found.columns["arrival.vx.mean.error"][row] == pytest.approx(error, rel=1e-9)
    assert found.unit("arrival.vx.mean.error") == "m/s"
    bars = sweep_figure(found, "arrival.vx.mean").axes[0].collections[0].get_segments()
    shown = [[low[1], high[1]] for low, high in bars]
    mean, error = (found.columns[f"arrival.vx.mean{end}"] for end in ("", ".error"))
    np.testing.assert_allclose(shown, np.transpose([mean - error, mean + error]), rtol=1e-12)


def test_a_seed_that_has_no_number_does_not_count_and_is_told():
    """Beyond some angle no particle arrives: there, and nowhere else, is no mean."""
    found = sweep(
        CROWD.with_values({"outgoing.start": 1.44}), {"plate.angle_deg": [20.0]}, repeat=4
    )
    told = [
        measure(chutelab.simulate(CROWD.with_values({"stream.seed": n, "outgoing.start": 1.44})),
                "misses")
        for n in range(4)
    ]  # fmt: skip
    assert found.columns["misses"][0] == np.mean(told)
    assert "of 4 seeds" in found.columns["reason"][0]


def test_an_interrupted_sweep_of_another_number_of_seeds_is_refused(tmp_path):
    out, vary = tmp_path / "rows.csv", ["--vary", "plate.angle_deg=10,20"]
    file = tmp_path / "crowd.toml"
    file.write_text(sc.to_toml(CROWD), encoding="utf-8")
    options = ["sweep", str(file), *vary, "--out", str(out), "-q", "--repeat"]
    assert CliRunner().invoke(main, [*options, "2"]).exit_code == 0
    head = out.read_text().splitlines()[0].split(",")
    assert "arrival.vx.mean.error" in head
    assert head[-1] == "reason"
    part = tmp_path / "rows.csv.part"
    part.write_text('{"format": 5, "repeat": 3}\n', encoding="utf-8")
    found = call(*options, "2", "--resume", code=2)
    assert "--repeat" in found.output


@pytest.mark.parametrize(("name", "count", "said"), [
    ("perpendicular", 3, "nothing is drawn at random for a single particle"),
    ("stream", 0, "a whole number from 1"),
    ("stream", 5000, "to 1000"),
])  # fmt: skip
def test_seeds_that_tell_nothing_are_refused(name, count, said):
    with pytest.raises(InputError, match=said):
        repeat(name, count)
    with pytest.raises(InputError, match=said):
        sweep(name, {"plate.angle_deg": [10.0]}, repeat=count)


def test_ctrl_c_tells_what_has_run():
    def interrupt(share):
        if share > 0.03:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt) as caught:
        repeat(CROWD, 50, progress=interrupt)
    found = caught.value.repeats
    assert found.values["contacts"].tolist() == by_hand("contacts", 2)[0].tolist()
    assert "Stopped: 2 of 50 seeds have run" in str(found)


def test_the_command_tells_means_and_writes_its_files(tmp_path):
    file, out = tmp_path / "crowd.toml", tmp_path / "out"
    file.write_text(sc.to_toml(CROWD), encoding="utf-8")
    found = CliRunner().invoke(
        main, ["run", str(file), "--repeat", "3", "--json", "--out", str(out)]
    )
    assert found.exit_code == 0, found.output
    told = json.loads(found.stdout)["quantities"]["landing.x.mean"]
    values, mean, error = by_hand("landing.x.mean", 3)
    assert told["values"] == values.tolist()
    assert (told["mean"], told["error"]) == pytest.approx((mean, error), rel=1e-9)
    assert sorted(path.name for path in out.iterdir()) == [
        "repeats.csv", "repeats.json", "repeats.png",
    ]  # fmt: skip
    for wrong in (["--accuracy", "1mm"], ["--only", "png", "--out", str(out)]):
        assert CliRunner().invoke(main, ["run", str(file), "--repeat", "3", *wrong]).exit_code == 2
    assert CliRunner().invoke(main, ["run", str(file), "--jobs", "2"]).exit_code == 2
    # A second is enough for one seed at least, and not for 1000.
    found = CliRunner().invoke(main, ["run", str(file), "--repeat", "1000", "--max-seconds", "0.2"])
    assert "of 1000 seeds have run" in " ".join(found.output.split())
