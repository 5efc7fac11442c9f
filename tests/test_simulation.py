"""From a scene to a recording: which engine runs, and the same numbers every time."""

import numpy as np
import pytest

from chutelab import machine, scene
from chutelab.engines.simulation import ENGINES, choose, simulate
from chutelab.results import REASONS, Kind, Recording
from chutelab.results.ledger import ledger
from chutelab.results.recorder import EnoughError
from chutelab.results.summary import stopped, summary, waits
from machines import MOVING_CORNER

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
    "galton": "contact",
    "mixture": "contact",
    "cradle": "pymunk",
    "dominoes": "pymunk",
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


@pytest.mark.parametrize(("name", "engine", "changes", "looks"), STOPPABLE)
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
