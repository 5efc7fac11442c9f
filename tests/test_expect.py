"""What scenes are expected to show: read, measured, judged."""

import json
import re
from functools import cache
from math import acos, degrees, isnan, sqrt

import numpy as np
import pytest

from chutelab import scene as sc
from chutelab.checks.agreement import ENGINES, MOST_ALONE, verify
from chutelab.engines.simulation import simulate
from chutelab.results import Kind
from chutelab.results.quantities import measure, measured
from chutelab.results.summary import summary
from chutelab.scene.quantities import FIRST, REGISTRY, STATISTICS, THEORY, lookup, whose
from chutelab.scene.units import read_size, write_size
from chutelab.studies.accuracy import LateError, answer
from chutelab.studies.sweep.plan import Block, runs
from machines import PERPENDICULAR

G = 9.81


def expecting(quantity, value, tolerance, *, more="", machine=PERPENDICULAR):
    lines = f'quantity = "{quantity}"\nvalue = {value}\ntolerance = {tolerance}\nsource = "me"\n'
    return sc.parse(f"{machine}[[expect]]\n{lines}{more}")


@cache
def shipped(name, *overrides):
    scene = sc.load(name, overrides)
    return scene, simulate(scene)


# Sizes with units.


def test_sizes_are_read_with_their_units():
    for text, number, unit in [
        ("0.5 mm", 5e-4, "m"), ("0.5mm", 5e-4, "m"), (" 3 cm ", 0.03, "m"), ("7 nm", 7e-9, "m"),
        ("1.5e2 µm", 1.5e-4, "m"), ("150 \N{GREEK SMALL LETTER MU}m", 1.5e-4, "m"),
        ("150 um", 1.5e-4, "m"), ("2 km", 2000.0, "m"), ("20 mm/s", 0.02, "m/s"),
        ("3 ms", 0.003, "s"), ("12 mJ", 0.012, "J"), ("4 W", 4.0, "W"), ("2 %", 0.02, "%"),
        ("0.1 degrees", 0.1, "degrees"), ("0.1°", 0.1, "degrees"), ("3", 3.0, ""),
        ("-1e-3", -1e-3, ""),
    ]:  # fmt: skip
        assert read_size(text) == (number, unit)


@pytest.mark.parametrize(
    "text", ["", "mm", "1 parsec", "one mm", "1,5 mm", "nan", "inf m", "1e999 m", "1 m m", "0x1 m"]
)
def test_what_is_no_size_is_refused(text):
    with pytest.raises(ValueError, match=r"unit|number"):
        read_size(text)


@pytest.mark.parametrize("unit", ["m", "s", "J", "m/s", "degrees", ""])
def test_a_size_that_was_written_is_read_back(unit):
    for number in (1.0, 0.25, 4.4e-3, 3e-5, 7.5e-9, 0.0, 1e-16):
        found = read_size(write_size(number, unit))
        assert found == (pytest.approx(number, rel=1e-15, abs=0.0), unit)


# What can be expected: the names are those of the JSON summary.


def flat(value, path=()):
    """Leaves of a JSON object by their dotted names; a list is one leaf."""
    if isinstance(value, dict):
        for key, inner in value.items():
            yield from flat(inner, (*path, key))
    else:
        yield ".".join(path), value


@pytest.mark.parametrize("name", ["belt-landing", "free-fall", "low-speed"])
def test_names_are_the_keys_of_the_json_and_give_its_numbers(name):
    scene, recording = shipped(name)
    tables = [table for table in ("incoming", "plate", "outgoing") if getattr(scene, table)]
    surfaces = [*tables, *(free.name for free in scene.surface)]
    found = json.loads(json.dumps(summary(recording)))
    compared = set()
    for key, value in flat(found):
        if lookup(key, surfaces) is None:
            continue
        measured = measure(recording, FIRST + key if isinstance(value, list) else key)
        first = value[0] if isinstance(value, list) else value
        assert measured == first or (first is None and isnan(measured)), key
        compared.add(key)
    before = ["t", "x", "y", "vx", "vy"]
    keys = {"incoming": ["flight.t", *(f"separation.{key}" for key in before)]}
    keys["plate"] = [f"impact.{key}" for key in (*before, "vx_after", "vy_after")]
    keys["outgoing"] = [f"landing.{key}" for key in (*before, "vx_after", "vy_after")]
    keys["outgoing"] += [f"arrival.{key}" for key in before]
    entries = ["belt_work", "restitution_loss", "friction_loss"]
    expected = {"contacts", "error.max", "track.t", "ended.t", "ended.x", "ended.y"}
    expected |= {f"ledger.{key}" for key in (*entries, "residual", "turned_over")}
    expected |= {
        f"ledger.by_surface.{n}.{key}" for n in (*surfaces, "particles") for key in entries
    }
    assert compared >= expected.union(*(keys[table] for table in tables))
    assert {row.name for row in THEORY.values()} == set(found["theory"]) - {"reason"}


def test_statistics_are_over_all_particles_it_happened_to():
    _, recording = shipped("stream-independent", "stream.count=40", "outgoing.length=2.4435")
    landed = recording.first(recording.select(Kind.LANDING))
    x = landed["position"][:, 0]
    assert 0 < len(x) < 40, "the belt ends in the middle of the stream"
    for statistic, value in {
        "count": len(x),
        "x.mean": x.sum() / len(x),
        "x.spread": sqrt(((x - x.sum() / len(x)) ** 2).sum() / len(x)),
        "x.min": sorted(x)[0],
        "x.max": sorted(x)[-1],
        "vx_after.mean": landed["velocity_after"][:, 0].sum() / len(x),
    }.items():
        found = measure(recording, f"landing.{statistic}")
        assert found == pytest.approx(value, rel=1e-13, abs=0.0)
    tracks = [recording.track(particle)["t"] for particle in range(40)]
    assert tracks[1][0] > 0.0, "released later"
    lasted = sum(t[-1] - t[0] for t in tracks) / 40
    assert measure(recording, "track.t.mean") == pytest.approx(lasted, rel=1e-13, abs=0.0)
    assert measure(recording, "misses") == 40 - len(x)
    assert measure(recording, "ended.landed") == len(x)
    assert measure(recording, "ended.exit") == 40 - len(x)
    assert measure(recording, "ended.settled") == 0


def test_what_did_not_happen_is_nan_and_unknown_names_are_errors():
    _, recording = shipped("perpendicular", "outgoing.length=0.1")
    assert isnan(measure(recording, "landing.x"))
    assert isnan(measure(recording, "landing.x.mean"))
    assert measure(recording, "landing.count") == 0.0
    with pytest.raises(KeyError):
        measure(recording, "landings")


def names_of(scene):
    """Every name that a scene of one stream has for a quantity of one particle, or of all."""
    surfaces = [*scene.surfaces, "particles"]
    for row in REGISTRY.values():
        for surface in surfaces if "SURFACE" in row.name else [""]:
            base = row.name.replace("SURFACE", surface)
            for name in (base, FIRST + base, *(f"{base}.{statistic}" for statistic in STATISTICS)):
                found = lookup(name, scene.surfaces)
                if found is not None and not whose(found, scene.count):
                    yield name


@pytest.mark.parametrize(
    "settings", [[], ["stream.count=3", "stream.speed_spread=0.1", "incoming.friction=0.5"]]
)
def test_each_row_of_the_registry_is_read_alone_in_a_crowd_and_in_a_family(settings):
    """A family of variants gives each the numbers that it has alone, but for rounding."""
    _, crowd = shipped("spoon", "stream.count=4")
    for name in names_of(crowd.scene):
        assert isinstance(measure(crowd, name), float), name
    scene = sc.load("belt-landing", settings)
    block = Block(scene, ("plate.restitution",), np.array([[0.3], [0.5]]))
    found = runs(block)
    rows, family = next(found)
    alone = [simulate(scene.with_values(block.settings(row))) for row in rows]
    names = [name for name in names_of(scene) if name.split(".")[0] not in ("contacts", "wear")]
    assert len(names) > 400
    for name in names:
        expected = [measure(recording, name) for recording in alone]
        kind = pytest.approx(expected, rel=1e-12, abs=1e-13, nan_ok=True)
        assert measured(family, name) == kind, name


# Tolerances.


def only(found, engine):
    (row,) = [row for row in found.findings if row.engine == engine]
    return row


@pytest.mark.parametrize(
    ("value", "tolerance", "holds"),
    [
        # The relative error of a length is to d1 = 0.6 m, if that is more: 0.6 mm are 1e-3.
        ("0.5943", "1.01e-3", True),
        ("0.5943", "0.99e-3", False),
        ("0.5943", '"0.101 %"', True),
        ("0.5943", '"0.099 %"', False),
        ("0.5943", '"0.61 mm"', True),
        ("0.5943", '"590 µm"', False),
        ("1.1874", "0.501", True),
        ("1.1874", "0.499", False),
        ('"theory"', "1e-15", True),
    ],
)
def test_a_number_is_relative_and_a_string_absolute(value, tolerance, holds):
    found = verify(expecting("x2", value, tolerance))
    row = only(found, "exact")
    assert row.holds is holds
    assert row.simulated == pytest.approx(0.5937, rel=1e-15, abs=0.0)
    assert found.failures == sum(not row.holds for row in found.findings)
    assert bool(found.failures) is not holds


def test_angles_are_degrees_but_relative_to_a_radian():
    machine = PERPENDICULAR.replace("0.1", "0.5")
    angle = degrees(acos(4.0 / (G * 0.5063)))
    row = only(verify(expecting("phi1_deg", angle + 1.0, "1.0", machine=machine)), "exact")
    assert row.error == pytest.approx(np.pi / 180.0, rel=1e-12, abs=0.0)
    row = only(verify(expecting("phi1_deg", angle + 1.0, '"1°"', machine=machine)), "exact")
    assert row.error == pytest.approx(1.0, rel=1e-12, abs=0.0)
    assert row.unit == "degrees"


def test_a_ledger_entry_is_measured_by_itself_and_the_residual_by_what_was_turned_over():
    # The plate takes ½ m v² (1 - ε²) = 12 mJ.
    row = only(verify(expecting("ledger.restitution_loss", 0.1, 1)), "exact")
    assert row.error == pytest.approx(abs(row.simulated - 0.1) / 0.1, rel=1e-12, abs=0.0)
    _, recording = shipped("perpendicular")
    turned_over = measure(recording, "ledger.turned_over")
    row = only(verify(expecting("ledger.residual", 0.01, 1)), "exact")
    assert row.error == pytest.approx(0.01 / turned_over, rel=1e-9)


def test_pymunk_may_have_a_tolerance_of_its_own_or_none():
    # One lies r above the belt; 0.1 mm are more than nothing and less than a millimetre.
    own = verify(expecting("x2", 0.5938, 1e-12, more='tolerance_pymunk = "1 mm"'))
    assert [row.engine for row in own.findings] == ["exact", "contact", "pymunk", "theory"]
    assert [row.holds for row in own.findings] == [False, False, True, False]
    own = verify(expecting("x2", 0.5938, 1e-12, more='tolerance_contact = "1 mm"'))
    assert [row.holds for row in own.findings] == [False, True, False, False]
    none = verify(expecting("x2", 0.5938, '"1 mm"', more='tolerance_pymunk = "none"'))
    row = only(none, "pymunk")
    assert (row.tolerance, row.holds) == (None, True)
    assert none.failures == 0


def test_what_does_not_happen_fails():
    machine = PERPENDICULAR + "length = 0.1\n"
    found = verify(expecting("landing.x", 0.5, 1.0, machine=machine))
    assert not only(found, "exact").holds
    assert isnan(only(found, "exact").error)
    assert found.failures >= 1
    # The theory's word, where the theory has none.
    found = verify(expecting("x3", '"theory"', 1.0, machine=machine))
    assert not any(row.holds for row in found.findings)
    assert isnan(only(found, "exact").expected)


# Which answers are asked.


def test_the_theory_is_asked_for_its_own_symbols_only():
    assert [row.engine for row in verify(expecting("t2", 0.29685, 1e-6)).findings] == [
        *("exact", "contact", "pymunk", "theory")
    ]
    for quantity, value in (("t2", '"theory"'), ("impact.t", "0.79685"), ("t2.mean", "0.29685")):
        engines = [row.engine for row in verify(expecting(quantity, value, 1e-6)).findings]
        assert engines == ["exact", "contact", "pymunk"]


@pytest.mark.parametrize(
    ("more", "engines", "skipped"),
    [
        ("[particle]\nradius = 0\n", ["exact"],
         {name: f'must be more than 0 with run.engine = "{name}"'
          for name in ("contact", "pymunk")}),
        ("[stream]\ncount = 3\ninteract = true\nrate = 20\n", ["contact", "pymunk"],
         {"exact": "must be contact or pymunk, because stream.interact = true"}),
        (f"[stream]\ncount = {MOST_ALONE + 1}\n", ["exact", "contact"],
         {"pymunk": f"of {MOST_ALONE + 1} particles that do not meet it runs particle 0 alone"}),
    ],
)  # fmt: skip
def test_engines_that_are_not_for_a_scene_are_left_out(more, engines, skipped):
    found = verify(expecting("landing.count", 1, 1, machine=PERPENDICULAR + more))
    assert [row.engine for row in found.findings] == engines
    assert found.skipped == skipped


# The shipped scenes.


@pytest.mark.parametrize("name", sc.shipped())
def test_each_shipped_scene_says_what_it_shows_and_by_what_source(name):
    scene = sc.load(name)
    assert len(scene.expect) >= 3
    assert all(len(expect.source) > 5 for expect in scene.expect)


SECONDS_IN_PYMUNK = (
    *("bucket-elevator", "coal-transfer", "cradle", "damper-plate", "domino-gate", "dominoes"),
    *("drum", "feeder", "flap-gate", "galton", "heap", "hopper", "loop", "rock-box", "silo"),
    *("belt-landing", "mixture", "slip", "spoon", "stream", "vibrating-feeder"),
)
"""Scenes that take Pymunk 0.5 s or more: with it they are verified in the slow tests."""


SECONDS = ("feeder", "galton", "heap", "mixture")
"""Of these those that take the contact engine over a second, too."""


@pytest.mark.parametrize(
    ("name", "engines"),
    [
        *((name, 2 if name in SECONDS_IN_PYMUNK else 3)
          for name in sc.shipped() if name not in SECONDS),
        *(pytest.param(name, 3, marks=pytest.mark.slow) for name in SECONDS_IN_PYMUNK),
    ],
)  # fmt: skip
def test_each_shipped_scene_shows_what_it_is_expected_to(name, engines, monkeypatch):
    def some(scene, engine, **options):
        if engine not in ("dop853", *ENGINES[:engines]):
            raise LateError("it takes seconds")
        return answer(scene, engine, **options)

    monkeypatch.setattr("chutelab.checks.agreement.answer", some)
    found = verify(sc.load(name))
    broken = [row for row in (*found.findings, *found.agreements) if not row.holds]
    assert broken == []
    assert {"exact", "contact"} & {row.engine for row in found.findings}


def test_a_quantity_may_be_of_one_stream():
    drops = {"count": 3, "rate": 1.0, "velocity": [0.0, 0.0]}
    floor = {"name": "floor", "from": [-9, 0], "to": [9, 0], "restitution": 0.0}
    document = {
        "stream": [{"at": [1.0, 1.0], **drops}, {"name": "far", "at": [4.0, 2.0], **drops}],
        "surface": [floor],
    }
    recording = simulate(sc.from_dict(document))
    assert measure(recording, "ended.x.mean") == pytest.approx(2.5, rel=1e-12, abs=0.0)
    assert measure(recording, "by_stream.stream.ended.x.mean") == 1.0
    assert measure(recording, "by_stream.far.ended.x.mean") == 4.0
    assert measure(recording, "by_stream.far.impact.floor.count") == 3.0
    # Fallen from rest: v = sqrt(2 g h).
    fallen = sqrt(2.0 * 9.81 * (2.0 - 0.0063))
    vy = measure(recording, "by_stream.far.impact.floor.vy.min")
    assert vy == pytest.approx(-fallen, rel=1e-12, abs=0.0)
    for name in ("by_stream.near.ended.x.mean", "by_stream.far.x2", "by_stream.far.ended.x"):
        expect = {"quantity": name, "value": 1.0, "tolerance": 0.1, "source": "nobody"}
        with pytest.raises(sc.SceneError, match=re.escape(f'expect[0].quantity = "{name}"')):
            sc.from_dict({**document, "expect": [expect]})
