"""From a scene to a recording: which engine runs, and the same numbers every time."""

from __future__ import annotations

from importlib import import_module

import pytest

from chutelab import machine, scene
from chutelab.engines import exact
from chutelab.engines.simulation import ENGINES, choose, simulate
from chutelab.results import REASONS

ARRAYS = ("knots", "offsets", "ended", "events", "by_surface")


def loaded(name, *overrides):
    return scene.load(scene.find(name), overrides)


def same(one, other):
    assert all(getattr(one, a).tobytes() == getattr(other, a).tobytes() for a in ARRAYS)
    names = ("scene", "title", "engine", "surfaces", "steps", "contacts", "particle", "gravity")
    return all(getattr(one, name) == getattr(other, name) for name in names)


@pytest.mark.parametrize("name", scene.shipped())
def test_auto_takes_exact_unless_particles_interact(name):
    built = machine.build(loaded(name))
    assert choose(built) == choose(built, "auto") == ("contact" if name == "stream" else "exact")
    assert [choose(built, engine) for engine in ENGINES[1:]] == ["exact", "contact", "pymunk"]


def test_one_particle_has_nobody_to_interact_with():
    recording = simulate(loaded("perpendicular", "stream.interact=true"))
    assert recording.engine == "exact"


def test_the_scene_chooses_and_the_caller_overrides():
    stepped = loaded("perpendicular", "run.engine=pymunk")
    assert simulate(stepped).engine == "pymunk"
    assert simulate(stepped, engine="exact").engine == "exact"
    assert simulate(loaded("perpendicular"), engine="pymunk").engine == "pymunk"
    with pytest.raises(ValueError, match="newton") as raised:
        simulate(stepped, engine="newton")
    assert all(name in str(raised.value) for name in ENGINES)


@pytest.mark.parametrize(
    ("name", "overrides", "engine", "words"),
    [
        ("stream", (), "exact", ("run.engine", "stream.interact")),
        ("perpendicular", ("particle.radius=0",), "pymunk", ("particle.radius", "run.engine")),
        ("perpendicular", ("particle.radius=0",), "contact", ("particle.radius", "run.engine")),
    ],
)
def test_what_an_engine_cannot_do_is_refused_with_file_and_keys(name, overrides, engine, words):
    with pytest.raises(scene.SceneError) as raised:
        simulate(loaded(name, *overrides), engine=engine)
    for word in (f"{name}.toml", *words):
        assert word in str(raised.value)


def test_a_disk_held_in_a_moving_corner_goes_to_contact_unless_exact_was_asked_for():
    corner = {
        "particle": {"radius": 0.05, "spin": True},
        "surface": [
            {"name": "floor", "from": [-1.0, 0.0], "to": [1.0, 0.0], "speed": 1.0, "friction": 0.5},
            {"name": "wall", "from": [0.5, 0.0], "to": [0.5, 1.0], "friction": 0.5},
        ],
        "stream": {"at": [0.0, 0.06], "velocity": [0.0, 0.0]},
        "run": {"until": 3.0},
    }
    assert simulate(scene.from_dict(corner, "mine.toml")).engine == "contact"
    with pytest.raises(scene.SceneError, match=r"mine\.toml: run\.engine.*contact"):
        simulate(scene.from_dict(corner, "mine.toml"), engine="exact")


@pytest.mark.parametrize(
    ("name", "overrides", "engine"),
    [
        ("perpendicular", (), "exact"),
        ("belt-landing", ("particle.spin=true",), "exact"),
        ("stream-independent", ("stream.count=300", "stream.seed=5"), "exact"),
        ("perpendicular", (), "pymunk"),
        ("perpendicular", (), "contact"),
        ("stream", ("stream.count=5", "run.until=1.0"), "contact"),
        ("stream", ("stream.count=5", "run.until=1.0"), "pymunk"),
    ],
)
def test_the_same_scene_and_seed_give_the_same_bits(name, overrides, engine):
    one, other = (simulate(loaded(name, *overrides), engine=engine) for _ in range(2))
    assert same(one, other)
    assert len(one.events) > 0


def test_another_seed_gives_another_run():
    one, other = (
        simulate(loaded("stream-independent", "stream.count=20", f"stream.seed={seed}"))
        for seed in (1, 2)
    )
    assert one.knots.tobytes() != other.knots.tobytes()


@pytest.mark.parametrize("engine", ["exact", "contact", "pymunk"])
def test_simulating_is_building_and_running(engine):
    run = exact.run if engine == "exact" else import_module(f"chutelab.engines.{engine}").run
    asked = loaded("perpendicular")
    recording = simulate(asked, engine=engine)
    assert same(recording, run(machine.build(asked)))
    assert 0.0 < recording.seconds < 60.0
    assert scene.from_dict({**scene.to_dict(asked)}) == asked
    assert [REASONS[n] for n in recording.ended] == ["landed"]


@pytest.mark.parametrize("engine", ["exact", "contact", "pymunk"])
def test_progress_goes_from_0_to_1(engine):
    shares = []
    simulate(loaded("free-fall"), engine=engine, progress=shares.append)
    assert shares == sorted(shares)
    assert shares[0] >= 0.0
    assert shares[-1] == 1.0
