"""``[live]``: what the page of a scene offers; its keys are the scene's, and no engine sees it."""

import pytest

from chutelab import scene as sc
from chutelab.engines.simulation import simulate
from chutelab.results import Recording
from chutelab.scene.messages import live_of

MACHINE = """
[incoming]
speed = 2.0
pulley_radius = 0.1
[plate]
distance = 0.5
[outgoing]
drop = 0.5
[[surface]]
name = "hood"
from = [1, 1]
to = [2, 2]
"""
LIVE = """
[live]
predict = true
controls = ["plate.angle_deg", "surface.hood.from", "stream.count"]
panels = ["energy", "landing"]
[live.ranges]
plate.angle_deg = [-20, 70]
"stream.count" = [1, 5]
[[live.presets]]
name = "Moon"
set = { gravity = 1.62, surface.hood.to = [2, 3] }
"""


def faults(live):
    """What is said of a scene with this [live] table, by key."""
    with pytest.raises(sc.SceneError) as caught:
        sc.parse(MACHINE + "[live]\n" + live)
    return {fault.key: fault.allowed for fault in caught.value.faults}


def test_keys_may_be_written_with_dots_or_as_tables_and_survive_being_written():
    scene = sc.parse(MACHINE + LIVE)
    assert scene.live.ranges == {"plate.angle_deg": (-20.0, 70.0), "stream.count": (1.0, 5.0)}
    assert scene.live.presets[0].set == {"gravity": 1.62, "surface.hood.to": [2, 3]}
    assert sc.parse(sc.to_toml(scene)) == scene
    assert sc.from_dict(sc.to_dict(scene)) == scene
    assert hash(sc.parse(MACHINE + LIVE)) == hash(scene)


def test_a_page_gets_every_key_by_index():
    scene = sc.parse(MACHINE + LIVE)
    assert live_of(scene, sc.to_dict(scene)) == {
        "predict": True,
        "controls": ["plate.angle_deg", "surface[0].from", "stream.count"],
        "panels": ["energy", "landing"],
        "ranges": {"plate.angle_deg": [-20.0, 70.0], "stream.count": [1.0, 5.0]},
        "presets": [{"name": "Moon", "set": {"gravity": 1.62, "surface[0].to": [2, 3]}}],
    }


def test_drops_are_measured_from_where_the_page_measures_them():
    presets = 'presets = [{ name = "a", set = { outgoing.drop = 0.6 } }]'
    scene = sc.parse(f"{MACHINE}[live]\nranges = {{ outgoing.drop = [0.4, 1] }}\n{presets}")
    page = sc.to_dict(scene)
    page["outgoing"] |= {"drop": 0.75, "drop_from": "top"}  # 0.25 more than from the impact
    found = live_of(scene, page)
    assert found["ranges"] == {"outgoing.drop": [0.65, 1.25]}
    assert found["presets"] == [{"name": "a", "set": {"outgoing.drop": 0.85}}]


@pytest.mark.parametrize(
    ("key", "says"),
    [
        ("plate.angel_deg", "did you mean plate.angle_deg?"),
        ("plat.angle_deg", "did you mean plate?"), ("stream.at[0]", "no stream.at[0]"),
        ("surface[1].to", "no surface[1]"), ("surface.hod.to", "did you mean surface.hood?"),
        ("surface.to", "by name"), ("conveyor[0].speed", "no [[conveyor]]"),
        ("plate", "a whole table"), ("surface[0]", "a whole table"),
        ("live.predict", "no part of the machine"), ("expect[0].value", "no part of the machine"),
        ("a  b", "no key, such as plate.angle_deg"),
    ],
)  # fmt: skip
def test_a_key_that_the_scene_has_not_is_named_wherever_it_stands(key, says):
    text = MACHINE.replace("[[surface]]", '[[surface]]\nname = "floor"\nfrom = [0, 0]\nto = [1, 0]'
                           "\n[[surface]]") if key == "surface.to" else MACHINE  # fmt: skip
    live = f'''
[live]
controls = ["gravity", "{key}"]
ranges = {{ "{key}" = [0, 1] }}
presets = [{{ name = "it", set = {{ "{key}" = 1 }} }}]
'''
    with pytest.raises(sc.SceneError) as caught:
        sc.parse(text + live)
    quoted = f'"{key}"'
    places = ("live.controls[1]", f"live.ranges.{quoted}", f"live.presets[0].set.{quoted}")
    found = {fault.key.replace(f"s.{key}", f"s.{quoted}").replace(f"t.{key}", f"t.{quoted}"):
             fault.allowed for fault in caught.value.faults}  # fmt: skip
    assert set(found) == set(places)
    assert all(says in said for said in found.values())


def test_values_of_the_wrong_kind_say_what_is_right():
    found = faults(
        'predict = 1\ncontrols = 3\npanels = ["numbers", "x"]\nranges = 4\npresets = [1]'
    )
    assert found["live.predict"] == "must be true or false"
    assert found["live.controls"].startswith("must be a list of keys such as")
    assert '"energy", "numbers", "landing"' in found["live.panels[1]"]
    assert found["live.ranges"] == "must be a table of keys, each with its [from, to]"
    assert found["live.presets[0]"] == "must be a table of keys and values"
    assert "predict, controls, panels" in faults("hide = true")["live.hide"]


def test_ranges_ascend_and_stay_within_what_a_key_can_be():
    found = faults("ranges = { gravity = [2, 1], incoming.speed = 3, plate.above = [1] }")
    assert set(found.values()) == {"must be [from, to] with from < to"}
    assert set(found) == {'live.ranges.gravity', 'live.ranges."incoming.speed"',
                          'live.ranges."plate.above"'}  # fmt: skip
    found = faults(
        "ranges = { plate.angle_deg = [-20, 100], run.engine = [0, 1], stream.count = [0, 9] }"
    )
    assert found['live.ranges."plate.angle_deg"'] == "it can be from -90 to 90 only"
    assert found['live.ranges."stream.count"'].startswith("it can be from 1 to ")
    assert "no number" in found['live.ranges."run.engine"']


def test_steps_of_an_engine_are_nothing_to_change_on_a_page():
    found = faults('controls = ["gravity", "run.dt"]')
    assert list(found) == ["live.controls[1]"]
    assert "without steps" in found["live.controls[1]"]


def test_presets_have_names_of_their_own_and_values_that_their_keys_take():
    rows = '{ name = "Moon", set = { gravity = -1 } }, { name = "Moon", set = { gravity = 1 } }'
    found = faults(f"presets = [{rows}]")
    assert found == {
        "live.presets[0].set": "gravity = -1: must be a number from 1e-09 to 1000000 or 0, in m/s²",
        "live.presets[1].name": "must differ from those of other presets",
    }
    assert "a table of keys" in faults('presets = [{ name = "x" }]')["live.presets[0].set"]


def test_what_does_not_go_together_is_for_the_page_to_say():
    """A plate of no length: with --set the scene may be one in which the preset would fit."""
    text = MACHINE + '[live]\npresets = [{ name = "low", set = { plate.above = 0 } }]'
    with pytest.raises(sc.SceneError, match="length"):
        sc.parse(MACHINE, overrides=["plate.above=0", "plate.below=0"])
    assert sc.parse(text, overrides=["plate.below=0"]).live.presets[0].name == "low"


def test_no_engine_looks_at_it_and_recordings_keep_it(tmp_path):
    plain, live = sc.parse(MACHINE), sc.parse(MACHINE + LIVE)
    bare, shown = simulate(plain), simulate(live)
    assert bare.knots.tobytes() == shown.knots.tobytes()
    shown.save(tmp_path / "recording.npz")
    assert Recording.load(tmp_path / "recording.npz").scene.live == live.live
