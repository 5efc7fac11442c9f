"""The look at a scene before it runs: what it says must come true."""

import os
import re
import time
from dataclasses import replace
from math import acos, asin, atan2, cos, degrees, hypot, inf, nan, pi, radians, sin

import numpy as np
import pytest

from chutelab import scene as sc
from chutelab.checks.preflight import places, preflight, trial
from chutelab.checks.preflight.passing import passings
from chutelab.engines import pymunk
from chutelab.engines.simulation import simulate
from chutelab.machine import build
from chutelab.results import REASONS
from chutelab.results.recorder import StalledError
from chutelab.results.sensors import readings
from chutelab.results.wear import touched
from machines import PERPENDICULAR

LONE = [name for name in sc.shipped() if sc.load(name).count == 1]


def look(name, *overrides):
    return preflight(sc.load(name, overrides))


@pytest.fixture
def brief(monkeypatch):
    """How long a run takes is not asked: a trial gets a tenth of a second."""
    monkeypatch.setattr(trial, "PATIENCE", 0.1)


def named(parts):
    return {part.name: part.what for part in parts}


# What is built, and what is skipped.


def test_all_parts_are_told_with_their_places():
    built = named(look("perpendicular").built)
    assert list(built) == ["incoming", "pulley", "plate", "outgoing", "particle", "release"]
    assert built["incoming"] == "from (-1, 0.1) to (0, 0.1) m, moving at 2 m/s"
    assert built["pulley"] == "radius 0.1 m, axis at (0, 0)"
    # The belt is d2 + r below the impact, the plate ends 0.05 m above the belt.
    belt = 0.1063 - 0.5 * 9.81 * 0.29685**2 - 0.5 - 0.0063
    assert built["outgoing"] == f"from (-2, {belt:.6g}) to (4, {belt:.6g}) m, moving at 2 m/s"
    assert built["plate"] == f"from (0.6, {belt + 0.05:.6g}) to (0.6, 0.4) m"
    assert built["particle"] == "radius 0.0063 m, mass 0.008 kg, not turning"
    assert built["release"] == "the first from (-1, 0.1063) m at (2, 0) m/s"


def test_what_a_scene_does_not_need_is_skipped_with_the_reason(brief):
    skipped = named(look("perpendicular").skipped)
    assert skipped.pop("air").endswith("mm farther forward")
    assert skipped == {
        "surfaces": "the scene has no [[surface]]",
        "rotation": "particle.spin = false",
        "collisions": "of particles with each other: stream.count = 1",
        "steps": "the next event is solved for, so no flight is stepped",
        "what follows": 'the first touch of the outgoing belt: run.until = "landed"',
    }
    free = named(look("free-fall", "particle.spin=true").skipped)
    assert set(free) == {"incoming", "plate", "outgoing", "collisions", "steps", "air"}
    assert free["collisions"].endswith("stream.interact = false")
    crowd = named(look("stream").skipped)
    assert set(crowd) == {"surfaces", "rotation", "flights", "air"}


@pytest.mark.parametrize(
    ("name", "overrides", "engine", "why"),
    [
        ("perpendicular", [], "exact", "a single particle meets only surfaces"),
        ("stream-independent", [], "exact", "particles do not meet each other"),
        ("stream", [], "contact", "particles meet each other"),
        ("slip", ["run.engine=contact"], "contact", 'run.engine = "contact" asks for it'),
        ("perpendicular", ["run.engine=pymunk"], "pymunk", 'run.engine = "pymunk" asks for it'),
        ("perpendicular", ["run.engine=exact"], "exact", 'run.engine = "exact" asks for it'),
    ],
)
def test_the_engine_is_the_one_that_will_run(name, overrides, engine, why):
    overrides = [*overrides, "stream.count=3"] if "stream" in name else overrides
    found = look(name, *overrides)
    assert found.engine == simulate(sc.load(name, overrides)).engine == engine
    assert found.why.startswith(why)
    assert (found.stepping is None) == (engine == "exact")


def test_the_end_of_the_run_is_told():
    assert look("slip", "run.until=0.7").ends == "at t = 0.7 s"
    assert (
        look("slip").ends
        == "each particle when it has landed or has left the scene, at most at t = 30 s"
    )
    assert look("stream", "stream.count=2").ends.startswith("when all are at rest")


# Finite steps.


@pytest.mark.parametrize(("dt", "safe"), [(1.4e-3, True), (1.45e-3, False)])
def test_a_fixed_step_must_be_shorter_than_what_a_surface_catches(dt, safe, brief):
    found = look("perpendicular", "run.engine=pymunk", "run.align=false", f"run.dt={dt}")
    steps = found.stepping
    assert steps is not None
    assert steps.safe is safe
    # It is fastest at its end: v² = v0² + 2 g (y2 + d2) less what the plate has taken of v_x.
    fastest = (1.0 + 2 * 9.81 * (0.5 * 9.81 * 0.29685**2 + 0.5)) ** 0.5
    assert steps.speed == pytest.approx(fastest, rel=1e-3)
    assert steps.bound == 0.0063
    assert steps.way == pytest.approx(fastest * dt, rel=1e-3)
    assert steps.longest == pytest.approx(0.0063 / fastest, rel=1e-3)
    told = [advice for advice in found.advice if "may pass through" in advice.warning]
    assert bool(told) is not safe


def test_releases_that_wait_for_a_free_place_are_noticed():
    """A thousand a second on one spot, where 158 find room."""
    overrides = ["stream.count=5", "stream.rate=1000", "stream.interact=true"]
    (advice,) = look("perpendicular", *overrides).advice
    # At 2 m/s a disk of 12.6 mm is out of the way after 6.3 ms, and the next one comes at the step
    # after that, of 1 ms: 6 ms more for each that follows.
    assert "of 5 particles tried, 4 particles waited for a free place" in advice.warning
    assert "0.024 s at most" in advice.warning
    assert advice.change.startswith("stream.rate = ")
    # 1 ms by the rate and the 24 ms of four, and a hundredth to spare.
    assert advice.settings == {"stream.rate": pytest.approx(0.99 / 0.007, rel=4e-3)}
    assert applied("perpendicular", overrides, advice).advice == ()


def test_advice_about_a_rate_is_in_the_unit_that_was_given():
    """A thousand a second of 8 g are 28.8 t/h."""
    overrides = ["stream.count=5", "stream.rate=28.8 t/h", "stream.interact=true"]
    (advice,) = look("perpendicular", *overrides).advice
    rate = advice.settings["stream.rate"]
    assert rate.endswith(" t/h")
    plain = look("perpendicular", *overrides[:1], "stream.rate=1000", *overrides[2:]).advice[0]
    expected = plain.settings["stream.rate"] * 0.008 * 3.6
    assert float(rate.removesuffix(" t/h")) == pytest.approx(expected, rel=0.01)
    assert applied("perpendicular", overrides, advice).advice == ()


# What it costs: on counts; seconds are the machine's.


@pytest.mark.usefixtures("patient")
@pytest.mark.parametrize("name", LONE)
def test_a_lone_particles_contacts_are_those_of_its_run(name):
    found = look(name)
    assert found.effort.contacts == simulate(sc.load(name)).contacts
    assert not found.effort.at_least
    assert 0.0 < found.effort.seconds < 5.0


class Clock:
    """Processor time that passes by a tick a look: no machine is busier than another."""

    def __init__(self, tick):
        self.now, self.tick = 0.0, tick

    def __call__(self):
        self.now += self.tick
        return self.now


@pytest.fixture(autouse=True)
def reports_by_steps(monkeypatch):
    """Engines report by steps and events alone: a busy machine gets as many as an idle one."""
    monkeypatch.setattr(pymunk, "SLICE", inf)
    monkeypatch.setattr("chutelab.engines.exact.SLICE", 0.0)
    monkeypatch.setattr("chutelab.engines.exact.FIRST", 20_000)


@pytest.fixture
def patient(monkeypatch):
    """A busy machine gets as far in a trial as an idle one."""
    monkeypatch.setattr(trial, "PATIENCE", 30.0)
    monkeypatch.setattr(trial, "LONE_PATIENCE", 30.0)


def look_at(monkeypatch, scene, most, tick=1.0):
    """Return what a run will cost, told after so many looks at it, and a tick for each."""
    monkeypatch.setattr(trial, "process_time", Clock(tick))
    monkeypatch.setattr(trial, "PATIENCE", (most - 0.5) * tick)
    monkeypatch.setattr(trial, "LONE_PATIENCE", 1e9)
    return preflight(scene).effort


def looks(scene, engine=None):
    """Return the shares of a run that were reported, and its recording."""
    shares = []
    return shares, simulate(scene, engine=engine, progress=shares.append)


BOUNCE = """
[particle]
radius = 0.02
[[surface]]
name = "floor"
from = [-1, 0]
to = [1, 0]
restitution = {}
[stream]
at = [0, 0.52]
velocity = [0, 0]
[run]
until = {}
max_time = 1000
"""


@pytest.mark.parametrize(
    ("restitution", "until"),
    [(0.9, '"settled"'), (0.98, '"settled"'), (0.98, 40.0), (0.999, 40.0), (1.0, 45.0)],
)
def test_the_bounces_to_come_follow_from_those_that_were(restitution, until, monkeypatch):
    """With ε they are a geometric series, down to 1e-9 m/s; without loss they are all alike."""
    monkeypatch.setattr("chutelab.engines.exact.FIRST", 1)
    scene = sc.parse(BOUNCE.format(restitution, until))
    shares, whole = looks(scene)
    found = look_at(monkeypatch, scene, len(shares) // 4)
    assert not found.at_least
    assert "% of the run" in found.how
    assert found.seconds == pytest.approx(len(shares), rel=0.1)
    assert found.contacts == pytest.approx(whole.contacts, rel=0.1)


@pytest.mark.parametrize(
    ("name", "changes"),
    [
        ("stream", ["stream.count=60", "run.engine=pymunk", "run.until=landed"]),
        pytest.param(
            "stream-independent",
            ["stream.count=6", "run.until=settled", "run.engine=pymunk"],
            marks=pytest.mark.slow,
        ),
        ("stream-independent", ["stream.count=30000", "run.until=settled"]),
    ],
)
def test_a_run_that_was_followed_for_a_third_is_known_to_a_factor_of_three(
    name, changes, monkeypatch
):
    scene = sc.load(name, changes)
    shares, whole = looks(scene)
    found = look_at(monkeypatch, scene, len(shares) // 3)
    assert not found.at_least
    assert len(shares) / 3.0 < found.seconds < 3.0 * len(shares)
    assert whole.contacts / 5.0 < found.contacts < 5.0 * whole.contacts


def test_what_a_trial_hardly_begins_is_not_known(monkeypatch):
    scene = sc.load("stream", ["run.engine=pymunk", "run.until=settled"])
    found = look_at(monkeypatch, scene, 2)
    assert found.at_least
    assert found.seconds >= 2.0
    monkeypatch.undo()
    monkeypatch.setattr(trial, "MOST", 20)
    some = look("stream").effort
    assert some.at_least
    assert some.how == "a trial run with 20 of 200 particles"
    monkeypatch.setattr(trial, "PATIENCE", 0.0)
    shown = str(look("stream"))
    assert re.search(r"run time +not known, at least \d", shown)
    assert re.search(r"memory +not known, at least \d+ MB", shown)


@pytest.mark.usefixtures("patient")
def test_memory_grows_with_what_is_recorded():
    """72 bytes a knot and 99 an event, there some three times at the end; and the program."""
    few, many = (look("stream-independent", f"stream.count={n}").effort for n in (1000, 20_000))
    written = (120_000 - 6000) * 72 + (80_000 - 4000) * 99
    assert 2.0 * written < many.memory - few.memory < 5.0 * written
    assert 2e7 < few.memory < 3e8


def test_memory_that_the_machine_has_not_is_a_warning(monkeypatch):
    assert look("slip").advice == ()
    monkeypatch.setattr(os, "sysconf", lambda _name: 1000, raising=False)
    (advice,) = look("slip").advice
    assert re.search(r"may need 0\.\d+ GB of memory, and the machine has 0\.001 GB", advice.warning)
    assert "--max-seconds" in advice.change


def test_a_trial_that_is_stuck_is_a_warning_not_a_crash(monkeypatch):
    def stuck(*_arguments):
        raise StalledError(0, 1.5, (0.1, 0.2), "it bounces for ever")

    monkeypatch.setattr(trial, "follow", stuck)
    (advice,) = look("perpendicular").advice
    assert advice.warning.startswith("a trial run did not come to an end: particle 0 is stuck")


# What the closed form covers.


def test_layers_that_ride_into_each_other_on_a_slow_pulley_are_noticed(brief):
    overrides = ["incoming.speed=0.7", "stream.count=30"]
    (advice,) = [a for a in look("stream", *overrides).advice if "ride into others" in a.warning]
    # The highest is drawn: 0.7² / (9.81 (0.1063 + h)), 0 <= h <= 0.05 m, is 0.320 to 0.470.
    grip = float(re.search(r"v²/\(g rho\) = ([\d.]+)", advice.warning)[1])
    angle = float(re.search(r"for ([\d.]+)°", advice.warning)[1])
    assert 0.319 <= grip < 0.34
    assert cos(radians(angle)) == pytest.approx(grip, abs=2e-3)
    assert "adhesion carries all layers at one speed" in advice.warning
    # Not another speed, which is another machine: a grip that lets layers push each other.
    assert advice.settings == {"incoming.friction": 0.5}
    again = applied("stream", overrides, advice)
    assert not [a for a in again.advice if "ride into others" in a.warning]


# Warnings, each with what to change: applying it must help.


def applied(name, overrides, advice):
    """Look again with the settings that were recommended."""
    assert advice.settings
    return preflight(sc.load(name, overrides).with_values(advice.settings))


@pytest.mark.parametrize(
    ("name", "overrides", "warning", "key"),
    [
        ("perpendicular", ("outgoing.drop=0.15", "outgoing.drop_from=top", "plate.below=0.45"),
         "outgoing: it crosses the drive pulley", "outgoing.drop"),
        ("perpendicular", ("outgoing.drop=0.4", "outgoing.drop_from=top"),
         "0.4259 m below the pivot, off the finite plate", "outgoing.drop"),
        ("perpendicular", ("outgoing.drop=1", "outgoing.drop_from=top", "plate.below=0.1"),
         "off the finite plate", "plate.below"),
        ("perpendicular", ("plate.angle_deg=80", "outgoing.drop_from=top", "outgoing.drop=1"),
         "never meets the plate's line", "plate.angle_deg"),
        ("perpendicular", ("run.engine=pymunk", "run.align=false", "run.dt=0.01"),
         "may pass through", "run.align"),
        ("perpendicular", ("plate.below=2",), "outgoing: it crosses plate", "plate.below"),
        ("free-fall", ("surface.ramp.to=[0.5,-0.1]",), "floor: it crosses ramp",
         "surface.ramp.points"),
        ("perpendicular", ("outgoing.length=0.1",), "misses the outgoing belt", "outgoing.length"),
        ("perpendicular", ("outgoing.start=1", "outgoing.length=2"), "misses the outgoing belt",
         "outgoing.start"),
    ],
)  # fmt: skip
def test_a_setting_that_is_recommended_does_away_with_its_warning(name, overrides, warning, key):
    found = look(name, *overrides)
    (advice,) = [advice for advice in found.advice if warning in advice.warning]
    assert advice.change.startswith(f"{key} = ")
    assert key in advice.settings
    again = applied(name, overrides, advice)
    assert not [other for other in again.advice if warning in other.warning]
    assert len(again.advice) < len(found.advice)


def test_where_nothing_helps_it_says_what_happens():
    crossed = PERPENDICULAR + (
        '[[surface]]\nname = "a"\nfrom = [2, 0]\nto = [3, 0]\n'
        '[[surface]]\nname = "b"\nfrom = [-0.05, 0]\nto = [0.05, 0]\n'
    )
    (advice,) = preflight(sc.parse(crossed)).advice
    assert advice.warning == "b: it crosses the drive pulley"
    assert advice.change == "if it is meant, leave it; the first contact wins"


def test_of_many_pieces_and_crossings_some_are_told():
    """A polyline of 12 pieces is told piece by piece; of 28 crossings of eight lines, 20 are."""
    for pieces in (12, 13):
        points = [[0.1 * k, 0.01 * (k % 2) - 1.0] for k in range(pieces + 1)]
        told = built_of([{"name": "floor", "points": points}])
        assert len(told) == (pieces if pieces == 12 else 1)
    ways = [pi * n / 8.0 for n in range(8)]
    star = [
        {"name": f"s{n}", "from": [-cos(a), -sin(a) - 2.0], "to": [cos(a), sin(a) - 2.0]}
        for n, a in enumerate(ways)
    ]
    *told, last = preflight(sc.from_dict({**DROP, "surface": star})).advice
    assert [" crosses " in one.warning for one in told] == [True] * 20
    assert last.warning == "8 further pairs of surfaces cross"


DROP = {"stream": {"at": [0.0, 0.5], "velocity": [0.0, 0.0]}, "run": {"until": 0.2}}


def built_of(surfaces):
    """Return what is told of surfaces, piece by piece."""
    names = {one["name"] for one in surfaces}
    parts = preflight(sc.from_dict({**DROP, "surface": surfaces})).built
    return [part for part in parts if part.name in names]


def test_a_belt_that_is_too_short_gets_half_a_metre_beyond_the_landing(brief):
    # It lands at 0.4546 m: half a metre more, up to a tenth, from its start at -2 m.
    found = look("perpendicular", "outgoing.length=2.2").advice
    (settings,) = [one.settings for one in found if "misses" in one.warning]
    assert settings == {"outgoing.length": pytest.approx(3.0)}


@pytest.mark.parametrize(("radius", "told"), [("1.9 mm", True), ("2.1 mm", False)])
def test_particles_that_pymunk_does_not_resolve_are_told(radius, told, brief):
    found = look("perpendicular", "run.engine=pymunk", f"particle.radius={radius}").advice
    assert any("less than 2 mm" in one.warning for one in found) is told


OWN = {"exact": 500.0, "contact": 20e3, "pymunk": 10e3}


@pytest.mark.parametrize(
    ("engine", "marks", "seconds"),
    [
        # All at one pace, the second half at another: their mean, by logarithms, 4 to 6.
        ("contact", [(1.0, 0.1), (2.0, 0.4)], 4.0 * (5.0 / 4.0) ** 0.4),
        ("pymunk", [(1.0, 0.1), (2.0, 0.4)], 4.0 * (5.0 / 4.0) ** 0.4),
        # A tenth of the run, or less; paces that differ by less than three, or more.
        ("contact", [(1.0, 0.055), (2.0, 0.11)], 2.0 / 0.11),
        ("contact", [(1.0, 0.045), (2.0, 0.09)], None),
        ("contact", [(1.0, 0.02), (2.0, 0.12)], (2.0 + 0.88 / 0.1) * (2.0 / 0.12 / 10.8) ** 0.4),
        ("contact", [(1.0, 0.29), (2.0, 0.30)], None),
    ],
)
def test_what_a_trial_tells_of_the_whole_run(engine, marks, seconds):
    """75 MB of the program, what an engine sets up, 3.2 bytes for each that is written."""
    stream = {**DROP["stream"], "to": [0.5, 0.5], "count": 5, "rate": 1e9, "interact": True}
    scene = sc.from_dict({**DROP, "stream": stream, "run": {"until": 0.2, "engine": engine}})
    whole = simulate(scene)
    ended = np.full(5, REASONS.index("stopped"), dtype=whole.ended.dtype)
    some = replace(whole, ended=ended)
    tried = trial.Trial(some, 2.0, np.array([(0.0, 0.0), *marks]))
    found = trial.effort(some.machine, tried, 0.5, 0)
    assert found.at_least is (seconds is None)
    if seconds is not None:
        assert found.seconds == pytest.approx(0.5 + seconds, rel=1e-12)
        written = 72.0 * len(some.knots) + some.events.nbytes
        expected = 75e6 + 5.0 * OWN[engine] + 3.2 * seconds / 2.0 * written
        assert found.memory == pytest.approx(expected, abs=1.0)


def test_a_trial_takes_a_second_of_processor_time(monkeypatch):
    monkeypatch.setattr(trial, "process_time", Clock(0.2))
    scene = sc.load("stream", ["stream.count=30", "run.engine=pymunk", "run.until=2"])
    assert preflight(scene).effort.how.startswith("a trial run of 1 s covered")


def test_a_run_that_its_bound_stops_is_noticed():
    (advice,) = look("belt-landing", "run.max_time=2").advice
    assert "stopped at t = 2 s by run.max_time, before it is at rest" in advice.warning
    assert advice.change.startswith("run.max_time = 20, or")
    assert look("belt-landing", "run.max_time=20").advice == ()
    assert look("belt-landing", "run.until=2").advice == ()


def test_pymunk_for_what_exact_does_at_once_is_noticed(brief):
    (advice,) = look("stream-independent", "stream.count=100", "run.engine=pymunk").advice
    assert "100 particles one after the other" in advice.warning
    assert advice.change.startswith('run.engine = "auto"')
    small = look(
        "perpendicular", "run.engine=pymunk", "particle.radius=1e-4", "particle.mass=1e-8"
    ).advice
    assert [advice.change for advice in small] == ['run.engine = "auto", for the exact engine']


@pytest.mark.parametrize(
    "name",
    [pytest.param(name, marks=() if name in LONE else pytest.mark.slow) for name in sc.shipped()],
)
def test_no_shipped_scene_has_a_warning(name):
    assert look(name).advice == ()


def test_a_density_that_no_solid_has_is_noticed():
    def said(*overrides):
        found = look("perpendicular", *overrides).advice
        return [one.warning for one in found if "density" in one.warning]

    assert not said()
    assert not said("particle.radius=0")
    # 8 g in a sphere of 4 mm: m / (4/3 π r³)
    (warning,) = said("particle.radius=0.004")
    assert f"{0.008 / (4.0 / 3.0 * pi * 0.004**3):,.0f} kg/m³, more than any solid" in warning
    assert "less than any solid" in said("particle.mass=1e-5")[0]


@pytest.mark.parametrize(("start", "length", "told"), [
    (0.07, None, True), (0.0, None, False), (0.07, 0.1, False),
])  # fmt: skip
def test_a_string_to_a_particle_that_comes_later_is_told(start, length, told):
    """At 1 m/s the first is 0.07 m away by then, of a string of 0.03 m."""
    row = {"interact": True, "velocity": [0.0, 0.0]}
    tables = {
        "gravity": 0.0,
        "surface": [{"name": "far", "from": [-1.0, -1.0], "to": [1.0, -1.0]}],
        "stream": [row | {"at": [0.0, 0.0], "velocity": [1.0, 0.0]},
                   row | {"at": [0.03, 0.0], "start": start}],
        "string": [{"particle": 0, "other": 1} | ({"length": length} if length else {})],
        "run": {"until": 0.2},
    }  # fmt: skip
    said = [one.warning for one in preflight(sc.from_dict(tables)).advice]
    waits = [one for one in said if "particle 1 is released 0.07 s after particle 0" in one]
    assert len(waits) == told


BOARD = {"name": "board", "from": [0.0, 0.0], "to": [0.5, 0.0]}
WALL = {"name": "wall", "from": [0.3, 0.1], "to": [0.3, 1.0]}
UPRIGHT = {"name": "board", "from": [0.0, 0.0], "to": [0.0, 0.5]}
HUNG = {"hinge": [0.0, 0.0], "inertia": 0.01}
AHEAD = {"name": "wall", "from": [0.3, -1.0], "to": [0.3, 1.0]}
PEG = {"name": "wall", "center": [0.3, 0.2], "radius": 0.05}


def passes(*surfaces, until=2.0):
    stream = {"at": [0.0, 3.0], "velocity": [0.0, 0.0], "interact": True}
    tables = {"surface": list(surfaces), "stream": stream, "run": {"until": until}}
    machine = build(sc.from_dict(tables))
    return passings(machine, simulate(machine.scene))


@pytest.mark.parametrize(
    ("board", "wall", "t", "degrees", "place"),
    [
        # The tip of a board of L = 0.5 m comes to a wall at d = 0.3 m: L sin θ = d.
        (UPRIGHT | {"turn": -90.0}, AHEAD, asin(0.6) / (pi / 2.0), -36.8699, (0.3, 0.4)),
        # The end (0.3, 0.1) of a wall comes to the board.
        (BOARD | {"turn": 90.0}, WALL, atan2(0.1, 0.3) / (pi / 2.0), 18.43495, (0.3, 0.1)),
        (BOARD | HUNG | {"stops_deg": [-90.0, 30.0]}, WALL, nan, 18.43495, (0.3, 0.1)),
        # θ = k θ0 / 2I t² at first; from 0, with a spring: θ0 (1 - cos √(k/I) t).
        (BOARD | HUNG | {"spring": 0.1, "rest_deg": 60.0}, WALL,
         acos(1.0 - atan2(0.1, 0.3) / (pi / 3.0)) / 10.0**0.5, 18.43495, (0.3, 0.1)),
        # Tangent to a circle: atan(2/3) - asin(R / D), √(D² - R²) away from the pivot.
        (BOARD | {"turn": 90.0}, PEG, (atan2(0.2, 0.3) - asin(0.05 / hypot(0.2, 0.3))) / (pi / 2.0),
         degrees(atan2(0.2, 0.3) - asin(0.05 / hypot(0.2, 0.3))), None),
        # A gate that is there from 1 s on: two turns and some.
        (BOARD | {"turn": 270.0}, WALL | {"closes_at": 1.0},
         (2.0 * pi + atan2(0.1, 0.3)) / (1.5 * pi), 378.43495, (0.3, 0.1)),
        # Both of two doors turn by 90 degrees per second: L sin θ = 0.4 m.
        (UPRIGHT | {"turn": -90.0}, {"name": "wall", "from": [0.8, 0.0], "to": [0.8, 0.5],
         "turn": 90.0}, asin(0.8) / (pi / 2.0), -degrees(asin(0.8)), (0.4, 0.3)),
        # Through 0.3 m of 0.4 m, of which the second half is braked: 1 - 2 (1 - u)² = 3/4.
        (UPRIGHT | {"travel": {"to": [0.4, 0.0], "at": 0.5, "in": 1.0}}, AHEAD,
         1.5 - 0.125**0.5, 0.0, None),
        # Upwards by A sin 2πft, A = 0.02 m, 5 Hz, to a wall that ends 0.01 m above it.
        (BOARD | {"shake": {"by": [0.0, 0.02], "frequency": 5.0}},
         {"name": "wall", "from": [0.3, 0.01], "to": [0.3, 1.0]}, 1.0 / 60.0, 0.0, (0.3, 0.01)),
        # A wheel of 0.1 m about (0, 0.1) travels on the floor, v t² / 2 at first.
        ({"name": "board", "center": [0.0, 0.1], "radius": 0.1,
          "travel": {"to": [0.4, 0.1], "at": 0.0, "in": 1.0}}, AHEAD, 0.5, 0.0, (0.3, 0.1)),
    ],
)  # fmt: skip
def test_a_moving_surface_that_passes_through_another_is_told(board, wall, t, degrees, place):
    (found,) = passes(board, wall)
    assert (found.surface, found.through) == ("board", "wall")
    assert found.t == pytest.approx(t, rel=1e-6, abs=1e-4 * (wall is PEG), nan_ok=True)
    assert np.degrees(found.turned) == pytest.approx(degrees, rel=1e-6, abs=1e-2 * (wall is PEG))
    if place is not None:
        assert found.place == pytest.approx(place, abs=1e-6)


@pytest.mark.parametrize(
    "surfaces",
    [
        # It hangs on the end of a wall, and of one that it comes to lie on; in a corner.
        [BOARD | HUNG | {"stops_deg": [-90.0, 90.0]},
         {"name": "wall", "from": [0.0, 0.0], "to": [0.0, 1.0]}],
        [BOARD | HUNG | {"stops_deg": [-80.0, 0.0]}, WALL | {"from": [0.3, 0.0]}],
        [BOARD | HUNG | {"stops_deg": [-80.0, 80.0]},
         {"name": "corner", "points": [[0.0, 0.6], [0.0, 0.0], [-0.5, 0.2]]}],
        # Shut, it lies end to end with a ledge.
        [BOARD | HUNG | {"stops_deg": [-80.0, 80.0]},
         {"name": "ledge", "from": [0.5, 0.0], "to": [1.0, 0.0]}],
        # Its tip clears the wall, and a housing round it, by a µm.
        [BOARD | {"turn": 300.0},
         {"name": "wall", "from": [0.500001, -1.0], "to": [0.500001, 1.0]}],
        [BOARD | {"turn": 300.0}, {"name": "housing", "center": [0.0, 0.0], "radius": 0.500001}],
        # A floor travels down between two walls, and on below them.
        [{"name": "floor", "from": [0.1, 0.0], "to": [0.3, 0.0],
          "travel": {"to": [0.1, -0.5], "at": 0.2, "in": 0.5}},
         {"name": "left", "from": [0.1, -0.3], "to": [0.1, 1.0]},
         {"name": "right", "from": [0.3, -0.3], "to": [0.3, 1.0]}],
        # Two turn and shake as one.
        [BOARD | {"turn": 300.0}, {"name": "blade", "from": [0.0, 0.2], "to": [0.4, 0.1],
          "pivot": [0.0, 0.0], "turn": 300.0}],
        # The wall is gone in time, and there again in time.
        [BOARD | {"turn": 90.0}, WALL | {"opens_at": 0.2},
         WALL | {"name": "late", "closes_at": 2.1}],
    ],
)  # fmt: skip
def test_surfaces_that_only_touch_do_not_pass_through_each_other(surfaces):
    assert passes(*surfaces) == []


def test_stops_that_are_recommended_keep_a_hinge_from_passing_through(brief):
    for stops in ({"stops_deg": [-45.0, 80.0]}, {"spring": 0.1, "rest_deg": 60.0}):
        scene = sc.from_dict(
            DROP | {"surface": [BOARD | HUNG | stops, WALL], "run": {"until": 1.0}}
        )
        (advice,) = preflight(scene).advice
        assert "board: " in advice.warning
        assert "it passes through wall" in advice.warning
        assert advice.change.startswith("surface.board.stops_deg = [")
        assert advice.settings["surface.board.stops_deg"][1] == 18.4
        assert preflight(scene.with_values(advice.settings)).advice == ()


def test_each_pair_that_passes_through_is_told_once_and_one_that_crosses_is_not(brief):
    """Blades up to 0.36 m away from their axis, which is as far from that of the drive pulley."""
    blades = {"points": [[0.15, 0.2], [0.5, 0.2], [0.5, 0.5]], "pivot": [0.3, 0.2], "turn": 200.0}
    tables = {
        "incoming": {"speed": 2.0, "pulley_radius": 0.1},
        "surface": [
            blades | {"name": "wheel"},
            {"name": "wall", "from": [0.4, 0.1], "to": [0.4, 0.3]},
            {"name": "ceiling", "from": [-1.0, 0.52], "to": [2.0, 0.52]},
            {"name": "beyond", "from": [-1.0, 0.57], "to": [2.0, 0.57]},
        ],
        "run": {"until": 2.0},
    }
    said = [one.warning for one in preflight(sc.from_dict(tables)).advice]
    through = [one.split(",")[0] for one in said if "wheel: " in one]
    others = ("incoming", "the drive pulley", "ceiling")
    assert sorted(through) == sorted(f"wheel: it passes through {one}" for one in others)
    assert "wall: it crosses wheel" in said


def test_a_release_between_the_sides_of_a_conveyor_is_warned_of():
    belt = {"name": "belt", "from": [1.0, 0.0], "to": [3.0, 0.0], "pulley_radius": 0.2, "speed": 1}
    for y, said in ((0.0, 1), (0.3, 0)):
        stream = {"at": [2.0, y], "velocity": [0.0, 0.0]}
        looked = preflight(sc.from_dict({"conveyor": [belt], "stream": stream}))
        loops = [one for one in looked.advice if "inside its loop" in one.warning]
        assert len(loops) == said


GAP = """
[particle]
radius = [0.008, 0.01]
[incoming]
speed = 2.0
pulley_radius = 0.1
[plate]
distance = 0.4
below = {below}
[outgoing]
drop = 0.8
drop_from = "top"
[stream]
count = {count}
rate = 50.0
interact = true
"""
"""The belt is 0.8 m below the pivot: the plate's end leaves 0.8 m - below, and 2 r is to 20 mm."""


@pytest.mark.parametrize(
    ("below", "count", "told"), [(0.739, 30, False), (0.742, 30, True), (0.742, 1, False)]
)
def test_a_plate_that_leaves_a_crowd_less_than_three_grains_is_told(below, count, told):
    machine = build(given := sc.parse(GAP.format(below=below, count=count)))
    largest = 2.0 * float(np.max(machine.particle.radius))
    assert count == 1 or (0.8 - below < 3.0 * largest) == (below > 0.74)
    found = [one for one in places(given, machine) if "grains" in one.warning]
    assert len(found) == told
    if told:
        assert "leaves 58 mm above outgoing" in found[0].warning
        shorter = given.with_values(found[0].settings)
        assert 0.0 < 0.8 - shorter.plate.below - 3.0 * largest < 2e-3
        assert not list(places(shorter, build(shorter)))


FILLED = """
[particle]
radius = 0.02
[stream]
count = 400
fill = [[0.0, 0.0], [1.0, 1.0]]
interact = true
[run]
until = 1.0
"""

WALLS = {
    # y = 0.3 + 0.4 x, past both sides of the box.
    "slope": ("points = [[-0.1, 0.26], [1.1, 0.74]]", lambda x, y: y < 0.3 + 0.4 * x),
    # A corner of the box is cut off by two pieces.
    "corner": ("points = [[-0.1, 0.2], [0.3, 0.2], [0.3, -0.1]]", lambda x,
     y: (y < 0.2) & (x < 0.3)),
    "arc": ("center = [1.0, 0.0]\nradius = 0.4\nfrom_deg = 80\nto_deg = 190", lambda x,
     y: (x - 1.0) ** 2 + y**2 < 0.4**2),
    "ends within": ("points = [[-0.1, 0.5], [0.9, 0.5]]", lambda x, y: x < -1.0),
    # Surfaces are hollow: a wide peg is filled, too, a narrow one is not.
    "wide peg": ("center = [0.5, 0.3]\nradius = 0.2", lambda x,
     y: (x - 0.5) ** 2 + (y - 0.3) ** 2 < 0.2**2),
    "peg": ("center = [0.5, 0.3]\nradius = 0.015", lambda x, y: x < -1.0),
    "bucket": ("points = [[0.2, 0.8], [0.2, 0.3], [0.7, 0.3], [0.7, 0.8]]", lambda x, y: x < -1.0),
    "beside": ("points = [[0.0, 1.0], [0.0, 0.0], [1.0, 0.0]]", lambda x, y: x < -1.0),
}  # fmt: skip


@pytest.mark.parametrize("name", WALLS)
def test_a_fill_that_reaches_through_walls_is_told(name):
    surface, beyond = WALLS[name]
    given = sc.parse(FILLED + f'[[surface]]\nname = "{name}"\n{surface}\n')
    machine = build(given)
    outside = int(beyond(*machine.releases.position.T).sum())
    outside = min(outside, machine.count - outside)
    found = [one.warning for one in places(given, machine)]
    said = f"stream.fill reaches through {name}: {outside} of 400 particles start beyond"
    assert found == ([said] if outside else [])
    assert (outside > 5) == (name in ("slope", "corner", "arc", "wide peg"))


def test_what_measuring_costs_is_told_as_it_is():
    """Against whole runs with and without; a busy machine may be off by twice."""

    def spent(work):
        work()
        begin = time.process_time()
        work()
        return time.process_time() - begin

    scene = sc.load("stream", ["sensor=[{name='gate', from=[0.7, -0.2], to=[0.9, -0.2]}]"])
    found = preflight(scene)
    told = {extra.name: extra for extra in found.effort.extras}
    assert list(told) == ["loads", "sensors", "wear"]
    run = simulate(scene, loads=0.01)
    assert told["loads"].memory == pytest.approx(run.impulses.nbytes, rel=0.01)
    assert told["loads"].seconds < found.effort.seconds
    for name, read in (("sensors", readings), ("wear", touched)):
        took = spent(lambda read=read: (run.found.clear(), read(run)))
        assert 0.3 * took < told[name].seconds < 3.0 * took
    rows = {row[0]: row[1] for row in found.sheet().rows if len(row) == 2}
    assert " more" in rows["wear"]
    assert "sensors" not in {extra.name for extra in preflight("spoon").effort.extras}
