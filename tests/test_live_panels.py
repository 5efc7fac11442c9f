"""What the live page's panels and tools work out, against formulas and Python's own recordings."""

import zlib
from pathlib import Path

import numpy as np
import pytest

import chutelab
import sandbox
from chutelab.engines.contact import run
from chutelab.machine import build
from chutelab.pictures.live import _packed
from chutelab.pictures.live.describe import describe
from chutelab.results import Kind
from chutelab.results.arrival import arrivals
from chutelab.results.ledger import ledger
from chutelab.results.stream import envelopes
from chutelab.scene import from_dict, load
from chutelab.scene.quantities import THEORY
from live.node import ask as ask_node
from live.node import needs_node, page_scene, plain

THROW = Path(__file__).parents[1] / "lessons" / "01-the-parabola" / "throw.toml"
pytestmark = needs_node

# A lone particle and a stream, on plates, round a pulley with slip, on a belt, on arcs; a crowd.
SCENES = [
    ("perpendicular",), ("inclined-20", "plate.angle_deg=-10"), ("inclined-40",), ("slip",),
    ("low-speed",), ("belt-landing",), ("spoon",), (str(THROW),),
    ("stream-independent", "stream.count=50"), ("stream", "stream.count=40"),
    ("damper-plate", "run.until=1.5"), ("see-saw", "run.until=1.5"), ("flap-gate",),
]  # fmt: skip


def ask(**questions):
    return ask_node("panels.mjs", plain({"lab": describe(load("perpendicular")), **questions}))


@pytest.fixture(scope="module")
def runs():
    told = [page_scene(load(name, overrides)) for name, *overrides in SCENES]
    given, scenes = zip(*told, strict=True)
    answers = ask(scenes=given)["runs"]
    names = [name for name, *_ in SCENES]
    return dict(zip(names, zip(scenes, answers, strict=True), strict=True))


@pytest.mark.parametrize("name", [name for name, *_ in SCENES])
def test_both_bars_are_equally_long_at_any_time(runs, name):
    _, answer = runs[name]
    for at in answer["ledgers"]:
        # A lone particle's residual is rounding, which is not shown.
        if name in ("perpendicular", "inclined-40", "slip", "low-speed", "spoon"):
            assert "residual" not in dict(at["putIn"] + at["isNow"]), at
        parts = [value for _, value in at["putIn"] + at["isNow"]]
        put_in, is_now = (sum(value for _, value in at[side]) for side in ("putIn", "isNow"))
        assert min(parts) >= 0.0
        assert abs(put_in - is_now) <= 3e-12 * put_in, at
        # Energy by its definition, whatever was put in.
        assert at["kinetic"] >= 0.0
        # What falls out of the gate is below the machine.
        assert at["potential"] >= -1e-12 or name == "flap-gate"


@pytest.mark.parametrize("tilt", [0.0, 20.0])
def test_heights_count_from_the_machines_lowest_point(tilt):
    """m g h from where it would lie at the lowest place, at all times: h = y cos θ - x sin θ.

    What falls beside the floor leaves 1 m below it, with -m g (1 m + r).
    """
    mass, r, g, (x, y), (right, low) = 0.1, 0.02, 9.81, (0.0, 0.3), (6.0, -0.2)
    [answer] = ask(scenes=[page_scene(from_dict({
        "particle": {"radius": r, "mass": mass}, "gravity_deg": tilt,
        "stream": {"at": [x, y], "velocity": [0.0, 0.0]},
        "surface": [{"name": "floor", "points": [[5.0, low], [right, low]]}],
    }))[0]])["runs"]  # fmt: skip
    cos, sin = np.cos(np.radians(tilt)), np.sin(np.radians(tilt))
    start = mass * g * ((y * cos - x * sin) - (low * cos - right * sin) - r)
    ledgers = answer["ledgers"][:400]
    assert [at["start"] for at in ledgers] == pytest.approx([start] * 400, rel=1e-12)
    kinetic, potential = (
        np.array([at[name] for at in ledgers]) for name in ("kinetic", "potential")
    )
    assert np.abs(kinetic + potential - start).max() < 1e-12 * start
    assert [at["potential"] for at in answer["samples"]][-1] == potential[-1]
    if not tilt:
        assert potential[-1] == pytest.approx(-mass * g * (1.0 + r), rel=1e-12)
        # It has given more than there was at the release, and stands on that side.
        assert dict(ledgers[-1]["putIn"])["potential"] == -potential[-1]


def test_with_joints_the_ledger_closes_at_any_time():
    """Springs keep 1/2 k (l - l0)², dampers take c ∫ l'² dt; nothing that is lost is negative."""
    k, c, rest = 20.0, 0.3, 0.2
    ball = {"velocity": [0.0, 0.0], "interact": True}
    scene = from_dict({
        "particle": {"radius": 0.02, "mass": 0.1}, "gravity_deg": 20.0, "run": {"until": 1.5},
        "stream": [{**ball, "at": [0.3, 0.0]}, {**ball, "at": [0.6, 0.1]}],
        "rod": [{"from": [0.0, 0.0]}],
        "spring": [{"particle": 1, "other": 0, "stiffness": k, "damper": c, "length": rest}],
    })  # fmt: skip
    answers = ask(scenes=[page_scene(one)[0] for one in (scene, load("cradle"))])["runs"]
    for answer in answers:
        for at in answer["ledgers"]:
            size = sum(value for _, value in at["putIn"])
            assert abs(at["residual"]) <= 1e-13 * size, at
            least = min(at[name] for name in at if name.endswith("_loss") or name == "spring")
            assert least >= -1e-13 * size
            assert (at["belt_work"], at["push_work"]) == pytest.approx((0.0, 0.0), abs=1e-13 * size)
            assert at["potential"] >= -1e-4 * size
    # Evenly spread times come first.
    recording, ledgers = chutelab.simulate(scene, engine="contact"), answers[0]["ledgers"][:400]
    places, _ = recording.at([at["t"] for at in ledgers])
    length = np.hypot(*(places[:, 0] - places[:, 1]).T)
    kept = np.array([at["spring"] for at in ledgers])
    assert np.abs(kept - 0.5 * k * (length - rest) ** 2).max() < 1e-3 * kept.max()
    lost = c * np.trapezoid(np.gradient(length, ledgers[1]["t"]) ** 2, dx=ledgers[1]["t"])
    assert ledgers[-1]["damper_loss"] == pytest.approx(lost, rel=1e-3)
    ours = recording.ledger
    assert ledgers[-1]["damper_loss"] == pytest.approx(ours.damper_loss, rel=1e-12)
    assert ledgers[-1]["spring"] == pytest.approx(ours.spring[1], rel=1e-12)


def test_hinges_are_in_the_ledger_beside_joints():
    """A motor turns a bar at a steady rate: its work is that of lifting, and once ½ (m l²/3) w²."""
    m, rate, begin, end = 0.2, np.radians(90.0), np.array([0.0, 0.0]), np.array([0.2, -0.06])
    bar = {"from": begin.tolist(), "to": end.tolist(), "hinge": [0.0, 0.0], "mass": m}
    flap = {**bar, "spring": 0.5, "damper": 0.01}
    bar["motor"] = {"speed_deg": 90.0, "torque": 5.0}
    scene = from_dict({
        "particle": {"radius": 0.02, "mass": 0.1}, "run": {"until": 1.0},
        "stream": [{"at": [-1.0, 0.3], "velocity": [0.0, 0.0]}],
        "string": [{"from": [-0.9, 0.5]}],
        "surface": [{**bar, "name": "bar"}, {**flap, "name": "flap", "hinge": [2.0, 0.0],
                     "from": [2.0, 0.0], "to": [2.2, -0.06]}],
    })  # fmt: skip
    (answer,) = ask(scenes=[page_scene(scene)[0]])["runs"]
    ours, its = chutelab.simulate(scene, engine="contact").ledger, answer["ledger"]
    # After a quarter turn the middle is at half of (0.06, 0.2).
    lifted = m * 9.81 * 0.5 * (0.2 + 0.06)
    turning = 0.5 * m * (end**2).sum() / 3.0 * rate**2
    assert its["belt_work"] == pytest.approx(lifted + turning, rel=1e-3)
    off = 1e-11 * ours.turned_over
    assert its["belt_work"] == pytest.approx(ours.drive_work, abs=off)
    assert its["damper_loss"] == pytest.approx(ours.damper_loss, abs=off)
    for entry in ("kinetic", "potential", "spring"):
        assert its[entry] == pytest.approx(getattr(ours, entry)[1], abs=off), entry
    assert abs(its["residual"]) < off


@pytest.mark.parametrize("name", ["damper-plate", "see-saw", "flap-gate"])
def test_what_hangs_is_in_the_ledger(runs, name):
    """Energies of hinges and springs, what dampers and stops take: as Python's ledger has them.

    In a crowd a page's tracks leave over what the curves between knots do.
    """
    scene, answer = runs[name]
    ours, its = chutelab.simulate(scene, engine="contact").ledger, answer["ledger"]
    off = ours.turned_over * (1e-12 if name == "damper-plate" else 2e-5)
    for entry in ("restitution_loss", "friction_loss", "damper_loss", "belt_work"):
        assert its[entry] == pytest.approx(getattr(ours, entry), abs=off), entry
    for entry in ("kinetic", "potential", "spring"):
        assert its[entry] == pytest.approx(getattr(ours, entry)[1], abs=off), entry
    assert abs(its["residual"]) < off
    assert its["damper_loss"] > 0.0 or name == "see-saw"


def test_the_numbers_are_those_of_pythons_recordings(runs):
    for name in ("perpendicular", "inclined-20", "inclined-40", "slip", "low-speed"):
        scene, answer = runs[name]
        ours = chutelab.compare(chutelab.simulate(scene, engine="contact")).simulated
        its = {row["id"]: row["simulated"] for row in answer["numbers"]}
        its["phi1_deg"] = np.radians(its["phi1_deg"])
        told = [row for row in THEORY.values() if row.name in its]
        assert len(told) >= 11
        for row in told:
            expected = pytest.approx(ours[row.field], rel=1e-13, abs=1e-15)
            assert its[row.name] == expected, (name, row.name)


def test_the_time_of_flight_is_told_where_no_plate_is_on_the_way(runs):
    scene, answer = runs[str(THROW)]
    told = {row["id"]: row["simulated"] for row in answer["numbers"]}
    fall = scene.outgoing.drop
    assert told["flight.t"] == pytest.approx(np.sqrt(2.0 * fall / scene.gravity), rel=1e-9)
    _, answer = runs["perpendicular"]
    assert {row["id"]: row["simulated"] for row in answer["numbers"]}["flight.t"] is None


@pytest.mark.parametrize("name", ["stream-independent", "stream", "spoon"])
def test_a_crowds_numbers_are_sums_over_all(runs, name):
    scene, answer = runs[name]
    ours, its = chutelab.simulate(scene, engine="contact"), answer["crowd"]
    landed = ours.first(ours.select(Kind.LANDING))
    x = arrivals(ours)["position"][:, 0]
    x = x[np.isfinite(x)]
    counts = (its["released"], its["arrived"], its["landed"])
    assert counts == (ours.count, len(x), len(landed))
    assert its["mean"] == pytest.approx(x.mean(), rel=1e-13)
    assert its["spread"] == pytest.approx(x.std(), rel=1e-9)
    assert its["quantiles"] == pytest.approx(np.quantile(x, [0.02, 0.5, 0.98]), rel=1e-13)
    assert its["flow"] == pytest.approx(chutelab.results.stream.crowd(ours).flow, rel=1e-12)
    books = ledger(ours)
    assert its["work"] == pytest.approx(books.belt_work, rel=1e-9)
    lasts = ours.knots["t"].max() - ours.knots["t"].min()
    assert its["power"] == pytest.approx(books.belt_work / lasts, rel=1e-9)
    lost = {n: b["restitution_loss"] + b["friction_loss"] for n, b in books.by_surface.items()}
    assert dict(its["losses"]) == pytest.approx({n: v for n, v in lost.items() if v}, rel=1e-9)
    assert [v for _, v in its["losses"]] == sorted((v for v in lost.values() if v), reverse=True)


def same_arrivals(ours, its):
    """Tell whether the page has Python's arrivals, to the last bit."""
    found = arrivals(ours)
    rows = zip(found["t"], *found["position"].T, *found["velocity_before"].T, strict=True)
    told = [[np.nan] * 5 if one is None else [*one.values()] for one in its]
    return np.array_equal(np.array([*rows]), np.array(told, dtype=float), equal_nan=True)


@pytest.mark.parametrize("name", [name for name, *_ in SCENES])
def test_arrivals_and_envelopes_are_pythons(runs, name):
    """Arrivals to the last bit; lines to rounding, which sums differently."""
    scene, answer = runs[name]
    ours = chutelab.simulate(scene, engine="contact")
    assert same_arrivals(ours, answer["arrivals"])
    bands = [*envelopes(ours).values()]
    assert len(bands) == len(answer["envelopes"])
    for band, its in zip(bands, answer["envelopes"], strict=True):
        its = np.array(its["lines"], dtype=float)
        there = its.shape[1]
        assert np.isnan(band.lines[:, there:]).all()
        assert its == pytest.approx(band.lines[:, :there], abs=1e-12, nan_ok=True)


@pytest.mark.slow
def test_arrivals_in_crowds_drawn_at_random_are_pythons():
    """Those that touch only what lies there, softly or hard, among them."""
    beds = [f"stream.bed_height={0.02 * seed}" for seed in range(6)]
    drawn = [load("stream", ["stream.count=30", f"stream.seed={n}", b]) for n, b in enumerate(beds)]
    drawn += [from_dict(sandbox.tables(seed)) for seed in range(1, 40, 2)]
    told = [page_scene(scene) for scene in drawn if build(scene).landing >= 0]
    assert len(told) > 4
    answers = ask(crowds=[given for given, _ in told])["arrivals"]
    indirect = 0
    for n, ((_, scene), its) in enumerate(zip(told, answers, strict=True)):
        ours = run(build(scene))
        assert same_arrivals(ours, its), n
        own = ours.first(ours.select(Kind.LANDING, Kind.IMPACT, surface="outgoing"))
        indirect += np.isfinite(arrivals(ours)["t"]).sum() - len(own)
    assert indirect > 5


LAWS = ("law-finite", "law-inside", "law-through", "law-energy", "law-losses", "law-ledger")


@pytest.mark.parametrize("name", ["perpendicular", "stream"])
def test_each_law_is_broken_by_what_breaks_it_and_by_nothing_else(name):
    # What a belt carries by adhesion nothing holds apart.
    few = ["stream.count=20", "incoming.friction=0.5"] if name == "stream" else ()
    given, _ = page_scene(load(name, few))
    # Of particles that meet only.
    laws = (*LAWS, "law-apart", "law-solved") if name == "stream" else LAWS
    asked = [{"scene": given, "fault": law} for law in ("none", *laws)]
    sound, *broken = ask(faulty=asked)["faulty"]
    assert sound["laws"] == []
    for law, told in zip(laws, broken, strict=True):
        first = next(one for one in told["laws"] if one["law"] == law)
        if law in ("law-inside", "law-through"):
            assert (first["name"], first["particle"]) == ("outgoing", told["disk"])
            assert first["t"] == pytest.approx(told["at"], abs=0.2)


def test_sound_runs_keep_the_laws(runs):
    assert [name for name, (_, answer) in runs.items() if answer["laws"]] == []
    told = ask(sound=[sandbox.tables(seed) for seed in range(12)])["laws"]
    assert [seed for seed, law in enumerate(told) if law] == []


def test_a_track_is_drawn_as_the_curve_it_is(runs):
    scene, answer = runs[str(THROW)]
    points = np.array(answer["points"])
    (v, g), fall = (scene.incoming.speed, scene.gravity), np.diff(points[:, 0]) > 0.0
    top = scene.incoming.pulley_radius + scene.particle.radius
    middle = 0.5 * (points[1:] + points[:-1])[fall]
    flies = middle[:, 0] > 0.0
    x, y = middle[flies].T
    assert np.abs(y - (top - 0.5 * g * (x / v) ** 2)).max() < 3e-4
    assert len(points) < 60


def test_forces_are_what_newton_says(runs):
    """Carried by a level belt: m g up; in flight none."""
    scene, answer = runs["perpendicular"]
    weight = scene.particle.mass * scene.gravity
    ours = chutelab.simulate(scene, engine="contact")
    kinds, times = ours.events["kind"], ours.events["t"]
    left, hit = times[kinds == Kind.SEPARATION][0], times[kinds == Kind.IMPACT][0]
    carried = flown = 0
    for t, x, y in answer["forces"]:
        if 1e-6 < t < left - 1e-6:
            assert (x, y) == pytest.approx((0.0, weight), abs=1e-9 * weight)
            carried += 1
        elif left + 1e-6 < t < hit - 1e-6:
            assert (x, y) == pytest.approx((0.0, 0.0), abs=1e-9 * weight)
            flown += 1
    assert min(carried, flown) > 50


def test_histogram_and_running_mean_are_numpys():
    rng = np.random.default_rng(3)
    sets = [rng.normal(0.4, 0.03, 500), rng.uniform(-2.0, 1.0, 7), np.full(30, 0.45), [1.25]]
    answers = ask(values=[list(values) for values in sets])
    for values, bins, means in zip(sets, answers["histograms"], answers["means"], strict=True):
        counts, width = bins["counts"], bins["width"]
        edges = bins["from"] + width * np.arange(len(counts) + 1)
        inside = np.floor(np.asarray(values) / width).astype(int) - round(bins["from"] / width)
        assert counts == np.bincount(inside, minlength=len(counts)).tolist()
        assert sum(counts) == len(values)
        assert edges[0] <= min(values) + 1e-12
        assert max(values) <= edges[-1] + 1e-12
        # A round width: one digit, 1, 2 or 5.
        assert f"{width:.0e}"[0] in "125"
        for n, at in enumerate(means, 1):
            assert at["mean"] == pytest.approx(np.mean(values[:n]), rel=1e-12)
            if n > 1:
                error = np.std(values[:n], ddof=1) / np.sqrt(n)
                assert at["error"] == pytest.approx(error, rel=1e-9, abs=1e-15)
            else:
                assert at["error"] is None


def test_the_stop_watch_counts_simulated_time_back_too():
    acts = [
        ["toggle", 1.0], ["lap", 1.5], ["toggle", 2.0], ["toggle", 5.0], ["lap", 4.75],
        ["toggle", 4.5],
    ]  # fmt: skip
    first, second = ask(watches=[acts, [*acts, ["reset", 9.0]]])["watches"]
    assert first == {"reading": 0.5, "laps": [0.5, 0.75]}
    assert second == {"reading": 0, "laps": []}


def test_what_is_packed_as_text_is_read_as_it_was_at_every_length():
    contents = [np.random.default_rng(n).bytes(n) for n in range(60)]
    texts = [_packed(content) for content in contents]
    compressed = [zlib.compress(content, 9) for content in contents]
    assert ask(packed=texts)["packed"] == [list(content) for content in compressed]
    # Letters that stand for themselves in a script's JSON; 13 bits in two, at most 6 in a last one.
    assert {*"".join(texts)} <= {chr(code) for code in range(33, 127)} - set('"<\\')
    for text, content in zip(texts, compressed, strict=True):
        assert 0 <= 6.5 * len(text) - 8 * len(content) < 7
