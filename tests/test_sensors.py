"""Sensors: passages against closed forms, and against a count by hand on the recording."""

import csv
import json
from math import sqrt

import numpy as np
import pytest

import chutelab
from chutelab.results.sensors import flow, passages, reading, residence
from chutelab.scene import SceneError
from shared import call

GATE = {"name": "gate", "from": [0.3, -0.5], "to": [0.3, 0.3]}
LOW = {"name": "low", "from": [-0.2, -0.35], "to": [1.2, -0.35]}


@pytest.fixture(scope="module")
def stream():
    return chutelab.simulate("stream", {"sensor": [GATE, LOW]})


def test_a_flight_passes_where_its_parabola_does():
    """Thrown at v from (0, 0): at x = a after a / v, falling g a²/(2 v²); back down at 2 u / g."""
    g, v, u = 9.81, 1.5, 3.0
    scene = {"stream": {"at": [0.0, 0.0], "velocity": [v, u]}, "run": {"until": 1.0}}
    run = chutelab.simulate(scene)
    (one,) = passages(run, (0.3, -2.0), (0.3, 2.0))
    t = 0.3 / v
    assert one["t"] == pytest.approx(t, rel=1e-14)
    assert one["position"] == pytest.approx([0.3, u * t - 0.5 * g * t * t], rel=1e-13)
    assert one["velocity"] == pytest.approx([v, u - g * t], rel=1e-13)
    assert one["way"] == 1  # rightward through a line drawn upward: from its left
    up, down = passages(run, (0.0, 0.2), (2.0, 0.2))
    root = sqrt(u * u - 2.0 * g * 0.2)
    assert [up["t"], down["t"]] == pytest.approx([(u - root) / g, (u + root) / g], rel=1e-13)
    assert [up["way"], down["way"]] == [-1, 1]
    # It turns right below a line above its top, and a shorter line is missed.
    top = u * u / (2.0 * g) + 1e-12
    assert len(passages(run, (0.0, top), (2.0, top))) == 0
    assert len(passages(run, (0.3, -2.0), (0.3, 0.0))) == 0


def test_counts_are_those_of_a_count_by_hand(stream):
    """The centres are looked at every 0.5 ms; a side is changed between two looks."""
    times = np.arange(0.0, stream.t.max(), 5e-4)
    places = np.asarray(stream.at(times)[0])
    for sensor in (GATE, LOW):
        (ax, ay), (bx, by) = sensor["from"], sensor["to"]
        x, y = places[..., 0], places[..., 1]
        side = (bx - ax) * (y - ay) - (by - ay) * (x - ax)
        along = ((bx - ax) * (x - ax) + (by - ay) * (y - ay)) / ((bx - ax) ** 2 + (by - ay) ** 2)
        within = (along[1:] >= 0.0) & (along[1:] <= 1.0)
        on = ((side[:-1] >= 0.0) & (side[1:] < 0.0) & within).sum()
        back = ((side[:-1] < 0.0) & (side[1:] >= 0.0) & within).sum()
        told = reading(stream, sensor["name"])
        assert (told.count, told.back) == (on, back)
        assert told.mass == pytest.approx(0.008 * (on - back))


@pytest.mark.parametrize("engine", ["exact", "contact", "pymunk"])
def test_a_line_where_centres_are_struck_counts_what_goes_back(engine):
    """A bounce's lowest place lies on it: to and fro, or neither; what starts on it goes away."""
    floor = {"name": "floor", "from": [-1.0, 0.0], "to": [1.0, 0.0], "restitution": 1.0}
    run = chutelab.simulate(
        {
            "particle": {"radius": 0.01},
            "surface": [{**floor, "friction": 0.0}],
            "stream": {"at": [0.0, 0.1], "velocity": [0.0, 0.0]},
            "run": {"until": 1.0},
        },
        engine=engine,
    )
    assert passages(run, (-0.5, 0.01), (0.5, 0.01))["way"].sum() == 0
    assert passages(run, (-0.5, 0.05), (0.5, 0.05))["way"].tolist() == 4 * [1, -1]


def test_rates_depth_and_residence(stream):
    """200 particles a second of 8 g, thrown off a bed of 50 mm, each carried at 2 m/s."""
    told = reading(stream, "gate")
    assert told.rate == pytest.approx(200.0, rel=0.01)
    assert told.mass_rate == pytest.approx(1.6, rel=0.01)
    assert 0.04 < told.depth < 0.05 + 2 * 0.0063 + 1e-9
    found = passages(stream, GATE["from"], GATE["to"])
    edges, counted = flow(found, 0.1, float(stream.t.max()))
    assert counted.sum() == told.count
    assert counted[8:15].mean() == pytest.approx(20.0, rel=0.03)
    assert edges[1] == 0.1
    spent = residence(stream, "gate", "low")
    later = passages(stream, LOW["from"], LOW["to"])
    for particle in (0, 57):
        begin = found["t"][found["particle"] == particle][0]
        end = later["t"][later["particle"] == particle][0]
        assert spent[particle] == end - begin
    assert stream.measure("sensor.gate.count") == 200
    assert stream.measure("sensor.gate.vx.mean") == pytest.approx(2.0, abs=0.01)
    assert stream.measure("particles[0].sensor.low.t") > 0.0


def test_width_kinds_and_sizes_are_told():
    wide = chutelab.simulate("stream", {"sensor": [GATE], "stream.width": 0.63, "stream.count": 60})
    one = reading(wide, "gate")
    assert wide.measure("sensor.gate.whole_rate") == one.whole_rate
    assert one.whole_rate == pytest.approx(3.6 * one.mass_rate * 0.63 / (2 * 0.0063))
    mixed = {"name": "across", "from": [-2.0, -0.2], "to": [2.0, -0.2]}
    run = chutelab.simulate("mixture", {"sensor": [mixed], "run.until": 1.5})
    one, found = reading(run, "across"), passages(run, mixed["from"], mixed["to"])
    assert sum(one.kinds.values()) == one.count == (found["way"] == 1).sum()
    assert len(one.kinds) == len(run.scene.particles)
    sizes = {"particle.radius": [0.004, 0.008], "particle.density": 2500.0, "particle.mass": None}
    sizes["stream.count"] = 60
    large = chutelab.simulate("stream", {"sensor": [GATE], **sizes, "incoming.friction": 0.6})
    one = passages(large, GATE["from"], GATE["to"])
    sizes = large.radius[one["particle"]]
    expected = np.corrcoef(sizes, one["along"])[0, 1]
    assert reading(large, "gate").segregation == pytest.approx(expected)


def test_sensors_change_no_run_and_are_stored(stream, tmp_path):
    assert stream.knots.tobytes() == chutelab.simulate("stream").knots.tobytes()
    stream.save(tmp_path / "run.npz", tolerance=0.0)
    loaded = chutelab.Recording.load(tmp_path / "run.npz")
    assert reading(loaded, "low") == reading(stream, "low")


def test_command_writes_table_and_picture(tmp_path):
    file, out = tmp_path / "gate.toml", tmp_path / "out"
    scene = chutelab.load("perpendicular", {"sensor": [GATE]})
    file.write_text(chutelab.scene.to_toml(scene), encoding="utf-8")
    result = call("run", str(file), "--out", str(out), "--only", "sensors")
    assert "gate" in result.stdout
    rows = list(csv.DictReader((out / "sensors.csv").read_text(encoding="utf-8").splitlines()))
    assert [row["sensor"] for row in rows] == ["gate"]
    assert float(rows[0]["x"]) == pytest.approx(0.3)
    assert (out / "sensors.png").stat().st_size > 5_000
    told = json.loads(call("run", str(file), "--json").stdout)
    assert told["sensors"]["gate"]["count"] == 1
    none = call("run", "slip", "--out", str(out / "2"), "--only", "sensors", code=2)
    assert "sensor: one [[sensor]] or more" in none.stderr
    assert not (out / "2").exists()


@pytest.mark.parametrize(
    ("given", "said"),
    [
        ([{**GATE, "to": GATE["from"]}], "sensor[0].to"),
        ([GATE, GATE], "sensor[1].name"),
        ([{"from": [0.0, 0.0], "to": [1.0, 0.0]}], "sensor[0].name is missing"),
        ([{**GATE, "width": 1.0}], "sensor[0].width"),
    ],
)
def test_bad_sensors_are_refused(given, said):
    with pytest.raises(SceneError) as caught:
        chutelab.load("stream", {"sensor": given})
    assert said in str(caught.value)


def test_an_expectation_of_no_sensor_says_so():
    expect = [{"quantity": "sensor.gate.count", "value": 1.0, "tolerance": 0.0, "source": "none"}]
    with pytest.raises(SceneError, match="no such quantity here"):
        chutelab.load("stream", {"expect": expect})
