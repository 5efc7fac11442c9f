"""Searches among streams: the answer and its error, limits, targets with a minimum, stops."""

import json
import re
import signal
from math import sqrt
from time import monotonic

import numpy as np
import pytest
from click.testing import CliRunner

import chutelab
from chutelab import scene as sc
from chutelab.cli import main
from chutelab.pictures.plots.studies import scan
from chutelab.studies import design
from chutelab.studies.design import constrained, minimize, solve
from chutelab.studies.design.evaluation import Span, measured
from chutelab.studies.design.searches import Fit, Found, Wishes, search
from shared import call, seeds
from test_repeats import CROWD

A, B = Span("a", "", 0.0, 40.0, None), Span("b", "", 0.0, 1.0, None)


class Drawn:
    """Known functions of two keys with noise, of each run and in common of each seed."""

    stopped = None

    def __init__(self, function, noise, common, seed):
        self.random = np.random.default_rng(seed)
        self.function, self.noise, self.common = function, np.array(noise), common
        self.quantities = range(len(noise))
        self.shift = None

    def seeds(self, points, count):
        size = (count, len(self.quantities))
        if self.shift is None:
            self.shift = self.common * self.noise * self.random.standard_normal(size)
        self.ran = np.ones(len(points), dtype=bool)
        own = self.noise * self.random.standard_normal((len(points), *size))
        return np.stack(self.function(*points.T), axis=-1)[:, None] + self.shift + own


def bend(a, b):
    """Two quantities with targets 1.5 and 0.4: at a = 30 and b = 0.25 exactly."""
    return 0.05 * a * (1.0 + 0.2 * (b - 0.25)), 1.5 + 0.0 * a, b**2 + 0.01125 * a, 0.4 + 0.0 * a


def bowl(a, b):
    """Least at a = 22, b = 0.6; with a + 20 b = 40 at `MEETING`."""
    return 0.002 * (a - 22.0) ** 2 + 2.0 * (b - 0.6) ** 2, a + 20.0 * b, 40.0 + 0.0 * a


TWO = Wishes(targets=((0, 1), (2, 3)))

# a + 20 b = 40, least of 0.002 (a - 22)² + 2 (b - 0.6)²: b = 2 - a / 20 and the derivative by a,
# 0.004 (a - 22) - 0.2 (1.4 - a / 20) = 0, so a = (0.088 + 0.28) / 0.014.
MEETING = (0.088 + 0.28) / 0.014


def answers(function, noise, wishes, common, searches, points):
    """Return the answers of searches with other noise, and their errors."""
    runs = [
        search(Drawn(function, noise, common, seed), wishes, (A, B), 8, points, seed)
        for seed in range(searches)
    ]
    return np.array([one.at for one in runs]), np.array([one.error for one in runs])


@pytest.mark.slow
def test_a_search_with_noise_finds_where_two_targets_are_met():
    found, told = answers(bend, (0.02, 0.0, 0.005, 0.0), TWO, 1.0, 2, 12)
    assert np.all(np.abs(found - [30.0, 0.25]) < 4.0 * told)
    assert np.all(told < [1.0, 0.03])


@pytest.mark.slow
@pytest.mark.parametrize(("function", "noise", "wishes", "at"), [
    (bend, (0.02, 0.0, 0.005, 0.0), TWO, (30.0, 0.25)),
    (bowl, (0.02, 0.1, 0.0), Wishes(objective=0), (22.0, 0.6)),
    (bowl, (0.02, 0.1, 0.0), Wishes(((1, 2),), objective=0), (MEETING, 2.0 - MEETING / 20.0)),
    (bowl, (0.02, 0.1, 0.0), Wishes((), ((1, 40.0),), 0), (MEETING, 2.0 - MEETING / 20.0)),
], ids=["targets", "minimum", "both", "limit"])  # fmt: skip
def test_the_error_that_is_told_is_how_far_answers_are_off(function, noise, wishes, at):
    """Over searches with other noise: as far as told or less, and told as no more than 8 times."""
    found, told = answers(function, noise, wishes, 1.0, 5, 48)
    off, told = (np.sqrt(np.mean(np.square(one), axis=0)) for one in (found - at, told))
    assert np.all(off < 1.7 * told), (off, told)
    assert np.all(told < 8.0 * off + 0.0025 * np.array([40.0, 1.0])), (off, told)


@pytest.mark.parametrize("seed", seeds(1, 2))
def test_beside_a_jump_the_value_that_is_told_is_that_of_runs(seed):
    """The work of a belt falls with the angle, until from 22° on the plate is no longer met."""

    def work(a):
        return (np.where(a < 22.0, 20.5 - 0.024 * (a + 4.0) ** 2, -1.5),)

    angle = Span("a", "", -10.0, 30.0, None)
    found = search(Drawn(work, (0.2,), 1.0, seed), Wishes(objective=0), (angle,), 8, 24, seed)
    (value, error), at = found.quantities[0], found.at[0]
    assert at >= 22.0
    assert value == pytest.approx(-1.5, abs=4.0 * error)
    assert error < 0.5


def test_what_is_wished_is_computed_from_means_of_seeds():
    """Two seeds by hand: differences, limits both ways, mean + 2 s, the share that has numbers."""
    values = np.array([[[1.0, 0.5, 0.9], [3.0, 0.5, 0.8]]])
    wishes = Wishes(((0, 1),), ((2, 0.8), (~2, 0.9)), 0, 1.0, 2.0)
    mean, s = 2.0, sqrt(2.0)  # of 1 and 3: deviations ±1, s² = 2 / (2 - 1)
    np.testing.assert_allclose(
        wishes.columns(values), [[mean - 0.5, 0.85 - 0.8, 0.9 - 0.85, mean + 2.0 * s, 0.5]]
    )
    most = Wishes(objective=0, sign=-1.0, deviations=2.0)
    np.testing.assert_allclose(most.columns(values)[0, 0], -mean + 2.0 * s)


def test_a_limit_or_target_and_a_minimum_without_noise_are_exact():
    def columns(points):
        return Wishes(((1, 2),), ((0, -1.0),), 0).columns(np.stack(bowl(*points.T), -1)[:, None])

    at, missed = constrained(columns, Wishes(((1, 2),), ((0, -1.0),), 0), (A, B), 0)
    np.testing.assert_allclose(at, [MEETING, 2.0 - MEETING / 20.0], rtol=1e-5)
    assert missed < 1e-6


def test_a_target_of_a_lone_particle_is_met_at_its_minimum():
    """A perpendicular plate sends a point back with ε v: of all speeds and ε with ε v = 1 m/s the
    shortest fall is none, the flight to the plate takes d / v: fastest at the end of the range."""
    found = solve(
        "perpendicular", {"incoming.speed": (1.5, 4.0), "plate.restitution": (0.1, 0.9)},
        {"impact.vx_after": -1.0}, minimize="impact.t",
    )  # fmt: skip
    speed, restitution = found.answer.values
    assert speed == pytest.approx(4.0, rel=1e-6)
    assert restitution * speed == pytest.approx(1.0, rel=1e-6)
    assert found.answer.place == "end"


@pytest.mark.slow
def test_a_minimum_of_a_lone_particle_keeps_to_its_bound():
    limit = {"incoming.speed": (1.5, 4.0), "plate.restitution": (0.1, 0.9)}
    least = minimize("perpendicular", limit, "impact.t", subject_to={"impact.vx": (None, 2.5)})
    assert least.answer.values[0] == pytest.approx(2.5, rel=1e-6)


@pytest.mark.parametrize(("error", "told"), [(4e-5, "35 "), (0.5, "35.00 ± 0.50 ")])
def test_an_end_of_the_range_that_no_seed_doubts_has_no_error(error, told, monkeypatch):
    ended = Found(np.array([35.0]), np.array([error]), np.array([[35.0]]), np.ones((1, 3, 1)), 0.0,
                  [(1.0, 0.1)])  # fmt: skip
    monkeypatch.setattr(design, "search", lambda *_: ended)
    found = minimize(CROWD, {"plate.angle_deg": (10.0, 35.0)}, "arrival.vx.mean", repeat=3)
    assert found.answer.values == (35.0,)
    assert found.answer.errors == (error if error > 1e-3 else 0.0,)
    assert found.answer.place == "end"
    assert re.search(rf"^least +{told} +1\.00 ± 0\.10", str(found), re.MULTILINE)


@pytest.mark.slow
def test_a_least_at_the_end_of_a_range_is_told_so():
    """Faster belts throw a bed sooner off; below 2.1 m/s lower layers leave under upper ones."""
    found = minimize(CROWD, {"incoming.speed": (1.5, 2.5)}, "track.t.mean", repeat=2, points=8)
    assert found.answer.values == (2.5,)
    assert found.answer.place == "end"
    assert "end of the range" in str(found)


@pytest.mark.slow
def test_an_answer_of_a_stream_has_no_more_digits_than_its_error_leaves(tmp_path):
    found = solve(
        CROWD, {"plate.angle_deg": (10.0, 35.0)}, {"arrival.vx.mean": 1.6}, repeat=3, points=10
    )
    (angle,), (error,) = found.answer.values, found.answer.errors
    assert 0.0 < error < 2.0
    digits = max(0, 1 - int(np.floor(np.log10(error))))
    assert angle == round(angle, digits)
    assert f"{angle:.{digits}f} ± " in str(found)
    # It is an answer: other seeds have the speed there that was asked for, within their error.
    seeds = [CROWD.with_values({"plate.angle_deg": angle, "stream.seed": n}) for n in range(3, 7)]
    speeds = [chutelab.simulate(one).measure("arrival.vx.mean") for one in seeds]
    slope = 0.12  # m/s per degree, of the picture
    allowed = 3.0 * sqrt(np.var(speeds, ddof=1) / 4.0 + (slope * error) ** 2)
    assert np.mean(speeds) == pytest.approx(1.6, abs=allowed)
    scan(found).write(tmp_path / "scan.png")


def test_a_search_that_is_stopped_tells_what_is_known():
    begun = monotonic()
    found = solve(
        CROWD, {"plate.angle_deg": (10.0, 35.0)}, {"arrival.vx.mean": 1.6}, repeat=4,
        max_seconds=0.5,
    )  # fmt: skip
    assert monotonic() - begun < 20.0
    assert any("time was up" in note for note in found.notes)
    lone = solve("perpendicular", {"plate.angle_deg": (0, 60), "incoming.speed": (1, 3)},
                 {"landing.vx": 0.5}, max_seconds=1e-9)  # fmt: skip
    assert any("stopped" in note for note in lone.notes)

    def interrupt(_share):
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt) as caught:
        solve(CROWD, {"plate.angle_deg": (10.0, 35.0)}, {"arrival.vx.mean": 1.6}, repeat=2,
              progress=interrupt)  # fmt: skip
    assert any("interrupted" in note for note in caught.value.solution.notes)


@pytest.mark.slow
def test_ctrl_c_writes_what_is_known(tmp_path, monkeypatch):
    """It comes while the variants that have run are looked at; the run for the picture goes on."""
    (tmp_path / "crowd.toml").write_text(sc.to_toml(CROWD), encoding="utf-8")
    whole = Fit.best

    def interrupted(self, keys):
        monkeypatch.setattr(Fit, "best", whole)
        signal.raise_signal(signal.SIGINT)

    monkeypatch.setattr(Fit, "best", interrupted)
    asked = ["--vary", "plate.angle_deg=10:35", "--target", "arrival.vx.mean=1.6", "--repeat", "2"]
    called = ["solve", str(tmp_path / "crowd.toml"), *asked, "--out", str(tmp_path / "out")]
    result = CliRunner().invoke(main, called)
    assert result.exit_code == 130
    assert "Not finished: interrupted after 8 variants." in result.stdout
    assert (tmp_path / "out" / "overlay.png").exists()
    assert not json.loads((tmp_path / "out" / "solve.json").read_text())["finished"]


def test_one_variant_tells_of_no_other():
    """Where one alone of the variants has a number: that one, its seeds' error, any other key."""

    class Once(Drawn):
        def seeds(self, points, count):
            values = np.full_like(super().seeds(points, count), np.nan)
            values[2, :, 0], self.place = np.arange(count), points[2]
            return values

    once = Once(lambda a: (a,), [1.0], 0.0, 0)
    found = search(once, Wishes(limits=((0, 0.0),)), (A,), 4, 8, 0)
    assert found.at == pytest.approx(once.place)
    assert found.error.tolist() == [20.0]
    assert found.quantities == [(1.5, pytest.approx(np.std(range(4), ddof=1) / 2.0))]


@pytest.mark.parametrize(("options", "said"), [
    (["--subject-to", "arrival.share=1"], "QUANTITY>=VALUE"),
    (["--subject-to", "arrival.shar>=1"], "did you mean arrival.share"),
    (["--subject-to", "arrival.share>=1", "--subject-to", "arrival.share>0"], "limit already"),
    (["--subject-to", "arrival.vx.mean>=outgoing.speed"], "a limit is a number"),
    (["--deviations", "2", "--repeat", "1"], "one run has none"),
    (["--deviations", "2"], "of what is least or largest"),
    (["--repeat", "0"], "0"), (["--jobs", "2", "--scheduler", "a:1"], "give one of them"),
    (["--maximize", "arrival.share"], "as many keys"),
])  # fmt: skip
def test_questions_that_make_no_sense_are_refused(options, said, tmp_path, monkeypatch):
    monkeypatch.setattr("chutelab.studies.sweep.plan.judged", None)
    file = tmp_path / "crowd.toml"
    file.write_text(sc.to_toml(CROWD), encoding="utf-8")
    question = ["--vary", "plate.angle_deg=10:30", "--target", "arrival.vx.mean=1.6"]
    result = call("solve", str(file), *question, *options, code=2)
    assert said in " ".join(result.output.split())


def test_the_share_of_an_event_is_its_count_by_the_number_of_particles():
    run = chutelab.simulate(CROWD)
    assert run.measure("impact.share") == run.measure("impact.count") / 40
    assert measured(CROWD, "arrival.share").unit == ""


@pytest.mark.slow
def test_a_cluster_finds_the_same_answer(tmp_path):
    distributed = pytest.importorskip("distributed")
    file = tmp_path / "crowd.toml"
    file.write_text(sc.to_toml(CROWD), encoding="utf-8")
    question = ["solve", str(file), "--vary", "plate.angle_deg=10:35", "--target",
                "arrival.vx.mean=1.6", "--repeat", "2", "--points", "8", "--json"]  # fmt: skip
    here = CliRunner().invoke(main, question)
    with distributed.LocalCluster(
        n_workers=2, threads_per_worker=1, processes=True, dashboard_address=None,
        silence_logs=False,
    ) as cluster:  # fmt: skip
        there = CliRunner().invoke(main, [*question, "--scheduler", cluster.scheduler_address])
    assert here.exit_code == there.exit_code == 0, there.output
    assert here.stdout == there.stdout


@pytest.mark.slow
def test_two_keys_of_a_crowd_within_a_fifth_of_a_degree(tmp_path):
    """200 particles, two targets, two processors, a minute of each: 120 s of processor time."""
    from os import times

    crowd = CROWD.with_values({"stream.count": 200})
    file = tmp_path / "crowd.toml"
    file.write_text(sc.to_toml(crowd), encoding="utf-8")
    begun = times()
    result = CliRunner().invoke(main, [
        "solve", str(file), "--vary", "plate.angle_deg=0:40", "--vary", "plate.distance=0.45:0.9",
        "--target", "arrival.vx.mean=1.6", "--target", "arrival.x.mean=1.65", "--jobs", "2",
        "--json", "-q",
    ])  # fmt: skip
    spent = sum(times()[:4]) - sum(begun[:4])
    assert result.exit_code == 0, result.output
    answer = json.loads(result.stdout)["answers"][0]
    assert answer["errors"][0] <= 0.2
    assert spent < 120.0
    angle, distance = answer["values"].values()
    there = {"plate.angle_deg": angle, "plate.distance": distance}
    runs = [crowd.with_values({**there, "stream.seed": n}) for n in range(100, 112)]
    speeds = [chutelab.simulate(one).measure("arrival.vx.mean") for one in runs]
    # 0.1 m/s per degree: 0.2° are 0.02 m/s, and the mean of twelve has 0.003 m/s.
    assert np.mean(speeds) == pytest.approx(1.6, abs=0.03)
