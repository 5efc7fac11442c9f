"""Scenes as they should not be: one readable message that names the file and every key at fault."""

import math

import pytest

from broken import BIG, BROKEN, HOOD, IN, PLATE
from chutelab import scene
from chutelab.machine import build


def message(call, *arguments):
    with pytest.raises(scene.SceneError) as caught:
        call(*arguments)
    return str(caught.value)


@pytest.mark.parametrize("case", BROKEN)
def test_a_broken_file_is_refused_with_file_key_and_what_is_allowed(case, tmp_path):
    text, keys, allowed = BROKEN[case]
    file = tmp_path / "broken.toml"
    file.write_text(text, encoding="utf-8")
    said = message(lambda text: build(scene.load(text)), file)
    assert said.startswith(f"{file}: ")
    for key in keys:
        assert key in said
    assert allowed in said
    lines = said.replace(str(file), "").splitlines()
    assert len(lines) <= 1 + 3, "one fault brings no crowd of others with it"
    assert max(map(len, lines)) < 190
    assert list(tmp_path.iterdir()) == [file]


@pytest.mark.parametrize(
    ("content", "says"),
    [
        (b"\x89PNG\r\n\x1a\n\0\0\0\rIHDR", "not a text file"),
        (IN.encode("utf-16"), "not a text file"),
        (b'title = "x"\ntitle2 = "\xe9t\xe9"\n', "line 2: not UTF-8 text (byte 0xe9)"),
        (b"\xff\xfe\xfd", "line 1: not UTF-8 text"),
        (b"# filler\n" * 200_000, "too large for a scene"),
        (b"x = " + b"[" * 20_000, "nested too deep"),
        (b"a." * 150 + b"b = 1", "nested too deep"),
        (b"[" + b"a." * 100_000 + b"b]", "nested too deep"),
        (b"[plate]\n" + b"a = {" * 50 + b"}" * 50, "nested too deep"),
        (b"x = " + b"9" * 20_000, "too large"),
        (b"x = 2020-13-45", "not TOML"),
    ],
)
def test_rubbish_is_refused_with_the_file_and_the_reason(content, says, tmp_path):
    file = tmp_path / "rubbish.toml"
    file.write_bytes(content)
    said = message(scene.load, file)
    assert said.startswith(f"{file}: ")
    assert says in said
    assert len(said.splitlines()) == 1


@pytest.mark.parametrize("levels", [500, 100_000])
def test_mappings_nested_too_deep_are_refused(levels):
    """As JSON gives them, and one that holds itself."""
    table, lists = {}, []
    for _ in range(levels):
        table, lists = {"a": table}, [lists]
    endless = {}
    endless["a"] = endless
    for found in (table, {"surface": lists}, {"surface": [{"from": lists}]}, endless):
        assert "nested too deep" in message(scene.from_dict, found)


@pytest.mark.parametrize("place", ["{}", "plate.{}"])
def test_a_key_that_is_no_text_is_refused(place):
    said = message(scene.load, "perpendicular", [f"{place.format(chr(0xD800))}=1"])
    assert f'{place.format("")}"\\ud800" = ' in said


@pytest.mark.parametrize(
    ("name", "says"),
    [
        ("perpendiculer", "no such file, and no shipped scene of this name; did you mean perp"),
        ("scenes/inclined-30.toml", "did you mean inclined-"),
        ("nothing-like-it", "there are arch, belt-landing, "), ("", '"": no such file'),
        ("nul\0byte", "nul\\x00byte: no such file"), ("x" * 5000, "xxx...: no such file"),
    ],
)  # fmt: skip
def test_a_scene_that_is_nowhere_is_answered_with_similar_names(name, says, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    said = message(scene.load, name)
    assert says in said
    assert len(said) < 500


def test_a_file_that_may_not_be_read_is_said_so(tmp_path, monkeypatch):
    file = tmp_path / "locked.toml"
    file.write_text(IN, encoding="utf-8")

    def refuse(*_arguments):
        raise PermissionError(13, "Permission denied")

    monkeypatch.setattr("pathlib.Path.open", refuse)
    assert message(scene.load, file) == f"{file}: cannot be read: Permission denied"


def test_all_faults_of_a_file_come_in_one_message_conflicts_too():
    text = (
        "[incoming]\nspeed = -1\n"
        "[plate]\ndistance = 'far'\nangel_deg = 20\n"
        "[particle]\nradius = 0\nspin = true\n"
        "[stream]\ncount = 0\ninteract = true\n"
        '[[surface]]\nname = "a"\nfrom = [0, 0]\nrestitution = 2\n'
        '[[surface]]\nname = "a"\npoints = [[0, 0], [1, nan]]\n'
        '[run]\nuntil = "landed"\n'
    )
    with pytest.raises(scene.SceneError) as caught:
        scene.parse(text, "all.toml")
    faults = {fault.key: fault.value for fault in caught.value.faults}
    assert faults == {
        "incoming.speed": -1, "incoming.pulley_radius": scene.MISSING, "plate.distance": "far",
        "plate.angel_deg": 20, "surface[0].restitution": 2,
        "surface[1].points[1][1]": pytest.approx(math.nan, nan_ok=True), "stream.count": 0,
        "run.until": "landed", "particle.spin": True, "stream.interact": True,
        "surface[0].to": scene.MISSING, "surface[1].name": "a",
    }  # fmt: skip
    lines = str(caught.value).splitlines()
    assert lines[0] == "all.toml: 12 faults"
    assert len(lines) == 13
    assert all(any(key in line for line in lines) for key in faults)


def test_a_key_at_fault_starts_no_quarrel_with_others():
    text = IN + PLATE + "[particle]\nradius = 'small'\nspin = true\n[stream]\ninteract = true\n"
    said = message(scene.parse, text)
    assert said == (
        '<scene>: particle.radius = "small":'
        " must be a number from 1e-09 to 1000000, 0 or a range [from, to] with from < to, in m"
    )


def test_what_is_no_conflict_is_taken():
    scene.parse(IN + '[stream]\ninteract = true\n[run]\nengine = "exact"')
    release = "[stream]\nspeed_spread = 0.1\nvelocity = [1, 0]\n"
    scene.parse(IN + "friction = 0.5\n" + release)
    # and so does the air above an adhesive one
    scene.parse(IN + release + "at = [-0.5, 0.1064]\n")
    scene.parse(IN + "[stream]\nvelocity = [2, 0]\nat = [-0.5, 0.1063]\n")


def test_a_long_list_of_faults_and_a_long_value_are_cut_but_not_lost():
    text = IN + "[run]\n" + "".join(f'zzz{i} = "{BIG}"\n' for i in range(100))
    with pytest.raises(scene.SceneError) as caught:
        scene.parse(text)
    assert len(caught.value.faults) == 100
    assert caught.value.faults[99].value == BIG
    lines = str(caught.value).splitlines()
    assert lines[-1] == "  and 60 more"
    # All but the names of the keys that there are.
    assert max(map(len, lines)) - len(", ".join(scene.Run.model_fields)) < 95


def test_a_message_carries_no_terminal_commands():
    said = message(scene.parse, '"\\u001b[31m" = "\\u001b[2J\\u009b"\n' + IN, "\x1b[1mfile.toml")
    assert said.isprintable()
    assert "\\x1b[1mfile.toml" in said


@pytest.mark.parametrize(
    ("override", "says"),
    [
        ("plate.angle_deg", "--set plate.angle_deg: must be KEY=VALUE"),
        ("=3", "--set =3: must be KEY=VALUE"),
        ("plate..angle_deg=3", "--set plate..angle_deg=3: must be KEY=VALUE"),
        ("plate.angle_deg=steep", 'plate.angle_deg = "steep": must be a number'),
        ("plate.angle_deg=95", "(from --set plate.angle_deg=95)"),
        ("plate.angel=95", "did you mean plate.angle_deg? (from --set plate.angel=95)"),
        ("plat.angle_deg=95", "did you mean plate? (from --set plat.angle_deg=95)"),
        ("plate.below=nan", "(from --set plate.below=nan)"),
        ("title.x=1", "--set title.x=1: title is no table"),
        ("stream.at[0]=1", "--set stream.at[0]=1: stream.at is not there"),
        ("plate[0]=1", "plate = 1: must be a table of keys and values"),
        ("plate[1]=1", "--set plate[1]=1: plate is no list"),
        ("surface[1].speed=1", "--set surface[1].speed=1: surface has 1 entries"),
        ("surface.hod.speed=1", "--set surface.hod.speed=1: no surface has the name hod; did you"),
        ("surface.q.speed=1", "no surface has the name q; there are: hood"),
        ("surface.hood.speed=x", 'surface[0].speed = "x": must be a number'),
        ("gravity=1\nb = 2", 'gravity = "1\\nb = 2": must be a number'),
        ("outgoing.speed=1", "outgoing.drop is missing"),
        ("run.engine=exact,pymunk", "(from --set run.engine=exact,pymunk)"),
    ],
)  # fmt: skip
def test_a_bad_override_is_named_as_it_was_given(override, says):
    said = message(scene.parse, 'title = "T"\n' + IN + PLATE + HOOD, "x.toml", [override])
    assert said.startswith("x.toml: ")
    assert says in said


def test_an_override_can_mend_a_fault():
    assert scene.parse(IN.replace("2", "-2"), overrides=["incoming.speed=2"]).incoming is not None
