"""The package as a Python user meets it: what functions take, and what they say to a slip."""

import json
import signal
import sys
from math import radians

import numpy as np
import pytest

import chutelab
import typed
from chutelab import design, theory
from chutelab.checks.preflight import preflight
from chutelab.machine import build
from chutelab.results.summary import stopped
from chutelab.scene import shipped, to_dict
from chutelab.util.errors import InputError
from shared import call

PEG = {"center": [0.0, 0.0], "radius": 0.01}

FUNCTIONS = {
    "simulate": lambda scene: chutelab.simulate(scene).measure("landing.x"),
    "predict": lambda scene: float(theory.predict(scene).x3),
    "solve": lambda scene: chutelab.solve(scene, {"plate.restitution": (0.1, 0.9)},
     {"landing.vx": -0.6}, points=5).answer.values[0],
    "minimize": lambda scene: design.minimize(scene, {"plate.restitution": (0.1, 0.9)}, "dEk",
     points=5).answer.values[0],
    "sweep": lambda scene: (chutelab.sweep(scene, {"plate.restitution": [0.2,
     0.4]}).columns["landing.x.mean"].sum()),
    "preflight": lambda scene: preflight(scene).effort.contacts,
    "value": lambda scene: design.value(scene, "landing.x"),
    "load": lambda scene: chutelab.load(scene).gravity,
}  # fmt: skip


# What `minimize` takes goes the way of `solve`.
@pytest.mark.parametrize(
    "name",
    [pytest.param(n, marks=pytest.mark.slow) if n == "minimize" else n for n in FUNCTIONS],
)
def test_what_takes_a_scene_takes_a_name_a_path_and_tables(name):
    path = shipped()["perpendicular"]
    scene = chutelab.load(path)
    given = (scene, "perpendicular", path, str(path), to_dict(scene))
    answers = [FUNCTIONS[name](one) for one in given]
    assert answers == [answers[0]] * len(given)
    with pytest.raises(chutelab.SceneError, match="did you mean perpendicular"):
        FUNCTIONS[name]("perpendicuar")


def test_a_scene_is_changed_as_it_is_run():
    """The plate takes 1 - ε of the speed across it: v_x = -ε · 2 m/s at the landing."""
    changes = {"plate.restitution": 0.3, "plate": {"above": "45 cm"}}
    recording = chutelab.simulate("perpendicular", changes)
    assert recording.measure("landing.vx") == pytest.approx(-0.6, rel=1e-14)
    assert recording.scene.plate.above == 0.45
    assert chutelab.simulate(recording.scene, "gravity=5").scene.gravity == 5.0
    with pytest.raises(chutelab.SceneError, match=r"plate\.restitution = 3: must be"):
        chutelab.simulate("perpendicular", {"plate.restitution": 3})


def test_mappings_ask_the_same_as_texts():
    said = typed.solve("inclined-20", "plate.angle_deg=0:60", "landing.vx=outgoing.speed")
    given = chutelab.solve(
        "inclined-20", {"plate.angle_deg": (0, 60)}, {"landing.vx": "outgoing.speed"}
    )
    assert str(said) == str(given)
    texts = typed.sweep("perpendicular", ["plate.distance=40cm,500mm", "gravity=5:9:3"])
    numbers = {"plate.distance": ["40 cm", 0.5 * 1.0], "gravity": [5, 7, 9]}
    with pytest.raises(InputError, match="give all numbers in one kind of unit"):
        chutelab.sweep("perpendicular", numbers)
    numbers["plate.distance"] = np.array([0.4, 0.5])
    found = chutelab.sweep("perpendicular", numbers).columns
    assert all(
        np.array_equal(found[key], texts.columns[key]) for key in ("landing.x.mean", "gravity")
    )
    with pytest.raises(InputError, match="must be a list of numbers"):
        chutelab.sweep("perpendicular", {"gravity": 5})
    for ask in (
        lambda: chutelab.sweep("perpendicular", ["gravity=5:9:3"]),
        lambda: chutelab.solve("inclined-20", "plate.angle_deg=0:60", {"landing.vx": 1}),
        lambda: chutelab.solve("inclined-20", {"plate.angle_deg": (0, 60)}, "landing.vx=1"),
        lambda: design.uncertainty("perpendicular", ["restitution=0.5±0.05"]),
    ):
        with pytest.raises(InputError, match="is for the command line; in Python"):
            ask()
    # What is wrong is named as in Python, not as an option.
    with pytest.raises(InputError, match=r"^vary plate\.angl_deg: unknown key; did you mean"):
        chutelab.sweep("perpendicular", {"plate.angl_deg": [0, 1]})


def test_a_recording_answers_by_itself():
    recording = chutelab.simulate("slip")
    assert recording.ledger is recording.ledger
    assert recording.ledger.by_surface["incoming"]["friction_loss"] > 0.0
    assert json.dumps(recording.summary(), allow_nan=False)
    assert recording.summary()["landing"]["x"][0] == recording.measure("landing.x")
    t = recording.t
    assert (np.diff(t) > 0.0).all()
    assert np.isfinite(recording.at(t)[0]).all()
    for slip in ("landing.z", "impact.hood.t", "by_stream.main.landing.x.mean", ""):
        with pytest.raises(KeyError, match="no quantity"):
            chutelab.measure(recording, slip)
    with pytest.raises(KeyError, match=r"did you mean landing\.x"):
        chutelab.measure(recording, "landng.x")
    for ask in (
        chutelab.compare,
        chutelab.overlay,
        lambda given: chutelab.measure(given, "landing.x"),
        lambda given: chutelab.animate(given, "slip.gif"),
    ):
        with pytest.raises(TypeError, match=r"^'slip' is no recording; give what chutelab\.simul"):
            ask("slip")


class HaltError(Exception):
    pass


@pytest.mark.parametrize("engine", ["exact", "contact", "pymunk"])
@pytest.mark.parametrize("slip", [HaltError, KeyboardInterrupt])
def test_what_ends_a_run_has_the_recording_so_far(engine, slip):
    name = "stream-independent" if engine == "exact" else "stream"
    looks = []

    def progress(share):
        looks.append(share)
        if len(looks) == 3:
            if slip is HaltError:
                raise HaltError
            signal.raise_signal(signal.SIGINT)  # as Ctrl-C

    with pytest.raises(slip) as ended:
        chutelab.simulate(name, engine=engine, progress=progress)
    recording = ended.value.recording
    assert stopped(recording) is not None
    assert "stopped" in recording.summary()["ended"]["reason"]
    assert recording.ledger.relative_residual < 1e-9
    assert signal.getsignal(signal.SIGINT) is signal.default_int_handler


def test_degrees_in_place_of_radians_are_told():
    numbers = {"speed": 2.0, "pulley_radius": 0.1, "distance": 0.5}
    with pytest.warns(UserWarning, match=r"angle = 20 is in radians.*np\.radians\(20\)"):
        theory.transfer(**numbers, angle=20)
    theory.transfer(**numbers, angle=radians(20))


def test_scenes_and_machines_show_themselves_in_a_line():
    scene = chutelab.load("perpendicular")
    said = "<Scene perpendicular: Perpendicular damping plate, 2 m/s; 1 particle, incoming, plate,"
    assert repr(scene) == f"{said} outgoing>"
    assert repr(build(scene)) == f"<Machine of {scene!r}>"
    assert (
        len(
            repr(chutelab.load("galton", {"surface": [PEG | {"name": f"p{i}"} for i in range(50)]}))
        )
        < 150
    )


@pytest.mark.parametrize(
    ("library", "words", "extra"),
    [
        ("scipy.optimize", "solve slip --vary incoming.speed=1:2 --minimize impact.t", "design"),
        ("scipy.optimize", "compare slip --data perpendicular-track --fit incoming.speed", "fit"),
        ("typst", "lesson show 1 --sheet student -o a.pdf", "pdf"),
        ("imageio_ffmpeg", "run slip --out out --format webm", "video"),
    ],
)
def test_what_a_missing_library_comes_with_is_said(library, words, extra, monkeypatch, tmp_path):
    monkeypatch.chdir(tmp_path)
    monkeypatch.setitem(sys.modules, library, None)
    said = " ".join(call(*words.split(), code=2).output.split())
    assert f'pip install "chutelab[{extra}]"' in said
    assert list(tmp_path.iterdir()) == []
