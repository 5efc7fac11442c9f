"""From a scene to a recording: which engine runs, and the same numbers every time."""

import numpy as np
import pytest

from chutelab import core, machine, scene
from chutelab.engines.simulation import ENGINES, choose, follow, simulate
from chutelab.results import REASONS, Kind, Recording
from chutelab.results.ledger import ledger
from chutelab.results.recorder import EnoughError
from chutelab.results.summary import stopped, summary, waits
from machines import MOVING_CORNER
from shared import some

ARRAYS = ("knots", "offsets", "ended", "events", "by_surface")


def loaded(name, *overrides):
    return scene.load(scene.find(name), overrides)


def same(one, other):
    assert all(getattr(one, a).tobytes() == getattr(other, a).tobytes() for a in ARRAYS)
    names = ("scene", "title", "engine", "surfaces", "steps", "contacts", "particle", "gravity")
    return all(getattr(one, name) == getattr(other, name) for name in names)


AUTO = {
    "hopper": "contact",
    "heap": "contact",
    "stream": "contact",
    "rock-box": "contact",
    "coal-transfer": "contact",
    "feeder": "contact",
    "silo": "contact",
    "galton": "contact",
    "mixture": "contact",
    "damper-plate": "contact",
    "drum": "contact",
    "bucket-elevator": "contact",
    "flap-gate": "contact",
    "vibrating-feeder": "contact",
    "see-saw": "contact",
    "arch": "contact",
    "loop": "contact",
    "cradle": "contact",
    "domino-gate": "contact",
    "dominoes": "contact",
}


@pytest.mark.parametrize("name", scene.shipped())
def test_auto_takes_exact_unless_particles_interact(name):
    built = machine.build(loaded(name))
    assert choose(built) == choose(built, "auto") == AUTO.get(name, "exact")
    assert [choose(built, engine) for engine in ENGINES[1:]] == ["exact", "contact", "pymunk"]


def test_the_scene_chooses_and_the_caller_overrides():
    stepped = loaded("perpendicular", "run.engine=pymunk")
    assert simulate(stepped).engine == "pymunk"
    assert simulate(stepped, engine="exact").engine == "exact"
    assert simulate(loaded("perpendicular"), engine="pymunk").engine == "pymunk"
    with pytest.raises(ValueError, match="newton") as raised:
        simulate(stepped, engine="newton")
    assert all(name in str(raised.value) for name in ENGINES)


def test_a_disk_held_in_a_moving_corner_goes_to_contact_unless_exact_was_asked_for():
    assert simulate(scene.from_dict(MOVING_CORNER, "mine.toml")).engine == "contact"
    with pytest.raises(scene.SceneError, match=r"mine\.toml: run\.engine.*contact"):
        simulate(scene.from_dict(MOVING_CORNER, "mine.toml"), engine="exact")


@pytest.mark.parametrize("engine", ["exact", "contact", "pymunk"])
def test_progress_goes_from_0_to_1(engine):
    shares = []
    simulate(loaded("free-fall"), engine=engine, progress=shares.append)
    assert shares == sorted(shares)
    assert shares[0] >= 0.0
    assert shares[-1] == 1.0


# Ended before it is over.

STOPPABLE = (
    # scene, engine, what is changed, looks until the end
    ("stream", "contact", ("stream.count=60",), 4),
    ("stream", "pymunk", ("stream.count=20", "run.until=0.7"), 9),
    ("stream-independent", "exact", ("stream.count=6000", "run.until=settled"), 6),
    ("belt-landing", "exact", (), 1),
    ("belt-landing", "contact", (), 5),
    ("belt-landing", "pymunk", (), 9),
    ("perpendicular", "pymunk", ("run.align=false",), 6),
)


def after(looks):
    """Return a progress that ends a run at so many looks."""
    seen = []

    def progress(share):
        assert 0.0 <= share <= 1.0
        seen.append(share)
        if len(seen) >= looks:
            raise EnoughError

    progress.seen = seen
    return progress


@pytest.mark.parametrize(("name", "engine", "changes", "looks"), some(STOPPABLE, 2))
def test_a_run_that_is_stopped_keeps_what_was_recorded(name, engine, changes, looks, tmp_path):
    scene_, whole = loaded(name, *changes), simulate(loaded(name, *changes), engine=engine)
    recording = simulate(scene_, engine=engine, progress=(watch := after(looks)))
    assert len(watch.seen) == looks
    found = stopped(recording)
    assert found is not None
    assert stopped(whole) is None
    halted = recording.ended == REASONS.index("stopped")
    assert (recording.ended[~halted] == whole.ended[~halted]).all()
    assert found.particles == np.count_nonzero(halted & recording.released) > 0
    assert found.unreleased == np.count_nonzero(halted & ~recording.released)
    # The books close, and no event is made up or left out up to there.
    assert ledger(recording).relative_residual < (1e-3 if engine == "pymunk" else 1e-12)
    assert 0.0 < found.t < whole.knots["t"].max()
    for kind in (Kind.RELEASE, Kind.IMPACT, Kind.LANDING, Kind.COLLISION):
        mine, all_ = (
            run.select(kind)[run.select(kind)["t"] < found.t] for run in (recording, whole)
        )
        assert mine.tobytes() == all_.tobytes()
    times = np.linspace(0.0, found.t, 50, endpoint=False)
    for mine, all_ in zip(recording.at(times), whole.at(times), strict=True):
        # A track may leave out 1e-4 radii of what lasts.
        assert np.allclose(mine, all_, rtol=0.0, atol=1e-3, equal_nan=True)
    again = Recording.load(recording.save(tmp_path / "part.npz"))
    assert same(recording, again)
    assert summary(again)["stopped"] == vars(found)
    assert waits(again) is None


@pytest.mark.parametrize("engine", ["exact", "contact", "pymunk"])
def test_a_time_limit_ends_a_run(engine):
    found = stopped(simulate(loaded("belt-landing"), engine=engine, max_seconds=1e-9))
    assert (found.particles, found.unreleased) == (1, 0)
    assert stopped(simulate(loaded("perpendicular"), engine=engine, max_seconds=1e3)) is None


KINDS = """
[[particle]]
name = "a"
radius = [0.004, 0.01]
spin = true
rolling_friction = 0.02
[[particle]]
name = "b"
radius = 0.006
mass = 0.02
shape = "sphere"
spin = true
[[surface]]
name = "bowl"
center = [{x}, 0.5]
radius = 0.5
from_deg = 200
to_deg = 340
friction = 0.3
[[surface]]
name = "floor"
from = [{low}, -0.4]
to = [{high}, -0.4]
[[pair]]
between = ["a", "floor"]
restitution = 0.3
[[stream]]
particle = "a"
at = [{x}, 0.6]
velocity = [0.1, 0]
count = 5
rate = 20
speed_spread = 0.1
[[stream]]
particle = "b"
at = [{left}, 0.6]
velocity = [0, 0]
count = 3
rate = 7
start = 0.1
[run]
until = {until}
"""


def kinds(x=0.0, until='"settled"'):
    return KINDS.format(x=x, low=x - 1.0, high=x + 1.0, left=x - 0.2, until=until)


@pytest.mark.parametrize(
    ("text", "near"),
    [
        (scene.find("slip").read_text("utf-8"), True),
        (scene.find("spoon").read_text("utf-8"), True),
        (kinds(), True),
        (kinds(until="0.45"), True),
        pytest.param(kinds(x=20.0), False, marks=pytest.mark.slow),
        (kinds(x=1000.0), False),
    ],
    ids=["slip", "spoon", "kinds", "for a time", "aside", "far off"],
)
@pytest.mark.parametrize("engine", ["exact", "contact"])
def test_a_machine_that_the_core_builds_as_it_runs_is_the_one_handed_over(text, near, engine):
    """To the last bit; it is built in Python only when it is asked for, or far from the origin."""
    given = scene.parse(text)
    found = simulate(given, engine=engine)
    assert found.machine.is_ahead == near
    assert same(found, follow(machine.build(given), engine, None))
    assert found.contacts > 0
    assert not found.laws
    assert not found.machine.is_ahead


def test_a_run_that_engines_move_to_an_origin_of_its_own_follows_any_other():
    """What a run does not have, such as totals of a crowd, is frozen with the run before."""
    simulate("perpendicular")
    far = {"surface": [{"name": "floor", "from": [-1.0, -90.0], "to": [9.0, -90.0]}],
           "stream": {"at": [0.0, 1.0], "velocity": [0.0, 0.0]}, "run": {"until": 1.0}}  # fmt: skip
    runs = [simulate(scene.from_dict(far)) for _ in range(2)]
    assert same(*runs)
    np.testing.assert_allclose(runs[0].ends()[1]["position"], [[0.0, 1.0 - 0.5 * 9.81]], atol=1e-12)


@pytest.mark.parametrize("engine", ["exact", "contact"])
def test_a_scene_that_was_handed_over_and_never_run_leaves_nothing_behind(engine):
    """As when Ctrl-C comes between: the core takes memory that it has not been in for zeros."""
    before = simulate("perpendicular", engine=engine)
    module = core.Module()
    assert module.begin_with(np.full(1000, np.nan))
    core.give_back(module)
    assert same(simulate("perpendicular", engine=engine), before)
    assert core.borrow() is module
    core.give_back(module)
