"""Laws that no scene may break: random machines of free surfaces, any particle."""

from itertools import pairwise, product

import numpy as np
import pytest
from hypothesis import HealthCheck, Phase, assume, given, settings
from hypothesis import strategies as st

from chutelab import machine, scene
from chutelab.engines import exact
from chutelab.engines.simulation import simulate
from chutelab.results.ledger import ledger
from chutelab.scene import Scene, plain, to_dict
from chutelab.scene.tables import Stream
from sandbox import draw

unit = st.floats(-1.0, 1.0)
points = st.tuples(unit, unit)


@st.composite
def soups(draw):
    """A particle thrown into up to five surfaces with random ends, materials and belts."""
    surfaces, belts = [], draw(st.booleans())
    for n in range(draw(st.integers(1, 5))):
        corners = draw(st.lists(points, min_size=2, max_size=3, unique=True))
        assume(all(np.hypot(*np.subtract(a, b)) > 0.05 for a, b in pairwise(corners)))
        surfaces.append(
            {
                "name": f"s{n}",
                "points": [list(c) for c in corners],
                "restitution": draw(st.sampled_from([0.0, 0.3, 0.8, 1.0])),
                "friction": draw(st.sampled_from([0.0, 0.1, 0.6, 5.0])),
                "speed": draw(st.sampled_from([0.0, 1.5, -0.7])) if belts else 0.0,
            }
        )
    spin = draw(st.booleans())
    radius = draw(st.sampled_from([0.004, 0.03, 0.1] if spin else [0.0, 0.004, 0.03, 0.1]))
    return {
        "gravity": draw(st.sampled_from([9.81, 9.81, 1.6, 0.0])),
        "particle": {"radius": radius, "spin": spin, "mass": 0.2},
        "surface": surfaces,
        "stream": {"at": [draw(unit), 1.2], "velocity": [2.0 * draw(unit), 2.0 * draw(unit)]},
        "run": {"until": 1.5},
    }


def gaps(built, position):
    """Distance of a centre from every segment, less the radius."""
    seg = built.segments
    along = np.clip(((position - seg.start) * seg.tangent).sum(axis=-1), 0.0, seg.length)
    foot = seg.start + along[:, None] * seg.tangent
    return np.hypot(*(position - foot).T) - built.particle.radius


def run(soup):
    built = machine.build(scene.from_dict(soup))
    try:
        return built, exact.run(built)
    except exact.CornerError:
        assume(False)


def most(recording):
    """Largest residual allowed, J; 1 mJ is turned over by a fall of half a millimetre."""
    return 1e-12 * max(ledger(recording).turned_over, 1e-3)


fuzz = settings(
    deadline=None,
    max_examples=120,
    suppress_health_check=list(HealthCheck),
    phases=[Phase.generate],
)


@fuzz
@given(soups())
def test_a_lone_particle_keeps_the_laws(soup):
    """Numbers are finite, the ledger closes, only belts raise energy, and nothing is passed."""
    built, recording = run(soup)
    books, track = ledger(recording), recording.track(0)
    assert np.isfinite(recording.knots["position"]).all()
    assert abs(books.residual) <= most(recording)
    assert books.restitution_loss >= 0.0
    assert books.friction_loss >= 0.0
    if not built.segments.speed.any():
        total = np.sum(recording.energies(track), axis=0)
        assert (np.diff(total) <= 1e-12 * max(np.abs(total).max(), 1e-3)).all()
    if gaps(built, np.array(soup["stream"]["at"])).min() > 0.0:
        position, _ = recording.at(np.linspace(track["t"][0], track["t"][-1], 400))
        # Round an end the Hermite curve is off by ρ Δφ⁴/384 < 1e-9 ρ.
        worst = min(gaps(built, p).min() for p in position[:, 0])
        assert worst >= -1e-9 * max(1.0, built.particle.radius)


@fuzz
@given(soups(), st.integers(2, 6))
def test_in_a_crowd_a_particle_does_what_it_does_alone(soup, count):
    crowd = {
        **soup,
        "stream": {**soup["stream"], "count": count, "rate": 9.0, "bed_height": 0.5},
        "run": {"until": 1.2},
    }
    _, together = run(crowd)
    _, alone = run({**crowd, "stream": {**crowd["stream"], "count": 1}, "run": {"until": 1.2}})
    assert together.track(0).tobytes() == alone.track(0).tobytes()
    assert ledger(together).relative_residual <= 1e-12


FASTER = {"s": 0.5, "1/s": 2.0, "m/s": 2.0, "m/s²": 4.0}
"""By which keys of these units grow when all goes twice as fast; lengths and masses stay."""


def times(value, factor):
    if isinstance(value, list):
        return [times(one, factor) for one in value]
    if isinstance(value, str) and value.endswith(" t/h"):
        return f"{2.0 * float(value[:-4])!r} t/h"
    return factor * value if isinstance(value, int | float) else value


def faster(table, model):
    """Return a table of a scene file with all in it twice as fast."""
    if isinstance(table, list):
        return [faster(row, model) for row in table]
    grown = {}
    for name, field in model.model_fields.items():
        key, extra = field.alias or name, field.json_schema_extra
        inner = Scene.tables().get(key) if model is Scene else None
        if key in table and inner:
            grown[key] = faster(table[key], inner)
        elif key in table:
            unit = extra.get("x-unit") if isinstance(extra, dict) else None
            grown[key] = times(table[key], FASTER[unit]) if unit in FASTER else table[key]
    return grown


def twice_as_fast(given):
    """Return a scene with g × 4, speeds × 2, times / 2, of defaults with a unit, too."""
    tables = plain(to_dict(given))
    tables.pop("expect", None)
    tables.pop("live", None)
    run = given.run
    tables["gravity"] = given.gravity
    tables["run"] = {**tables.get("run", {}), "dt": run.dt, "max_time": run.max_time}
    rows = tables.get("stream", {})
    rows = [rows] if isinstance(rows, dict) else rows
    default = {"rate": Stream().rate}
    tables["stream"] = [row if "fill" in row or "to" in row else default | row for row in rows]
    return scene.from_dict(faster(tables, Scene))


def assert_repeats(given, engine):
    """A film of the run shown twice as fast is the run of the scene with g × 4, to the last bit.

    Lengths and masses stay and times halve, so speeds double, and energies are four times as much.
    """
    slow = simulate(given, engine=engine)
    fast = simulate(twice_as_fast(given), engine=engine)
    factors = {
        "t": 0.5, "position": 1.0, "velocity": 2.0, "omega": 2.0, "entries": 4.0, "angle": 1.0,
        "particle": 1, "other": 1, "kind": 1, "surface": 1, "velocity_before": 2.0,
        "velocity_after": 2.0, "omega_before": 2.0, "omega_after": 2.0, "normal_impulse": 2.0,
        "tangential_impulse": 2.0,
    }  # fmt: skip
    for one, other in ((slow.knots, fast.knots), (slow.events, fast.events)):
        for name in one.dtype.names:
            # Numbers below 1e-308 have fewer digits.
            pair = factors[name] * one[name], other[name]
            np.testing.assert_allclose(*pair, rtol=0.0, atol=1e-300, err_msg=name)
    np.testing.assert_array_equal(4.0 * slow.by_surface, fast.by_surface)
    np.testing.assert_array_equal(slow.ended, fast.ended)


@pytest.mark.parametrize(
    ("which", "engine"),
    [
        *product(["perpendicular", "slip", "free-fall", 4, 14, 28], ["exact", "contact"]),
        *product(["perpendicular", "free-fall", 14], ["pymunk"]),
        *(pytest.param(which, "pymunk", marks=pytest.mark.slow) for which in ("slip", 4, 28)),
    ],
)
def test_twice_as_fast_under_four_times_the_gravity(which, engine):
    given = scene.load(which) if isinstance(which, str) else draw(which)
    assert_repeats(given, engine)


@pytest.mark.parametrize("which", ["hopper", 9, 13, 17, 21, 23])
def test_a_crowd_twice_as_fast_under_four_times_the_gravity(which):
    """Gates open and shut, islands fall asleep, and what has settled ends the run."""
    few = {"stream.count": 60}
    given = scene.load(which).with_values(few) if which == "hopper" else draw(which)
    assert given.crowded
    assert_repeats(given, "contact")


@pytest.mark.slow
@pytest.mark.parametrize("which", ["hopper", "mixture", "stream", "rock-box", *range(30, 80)])
def test_any_machine_twice_as_fast_under_four_times_the_gravity(which):
    given = scene.load(which) if isinstance(which, str) else draw(which)
    # Without gravity nothing tells how fast is fast, and bounds are those for 9.81 m/s².
    if given.gravity > 0.0:
        assert_repeats(given, "contact")
