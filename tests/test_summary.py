"""The JSON object of a run: the keys of the contract, numbers or null, nothing else."""

import json
from functools import cache

import numpy as np
import pytest

import chutelab
from chutelab import scene
from chutelab.engines.simulation import simulate
from chutelab.results import REASONS, Kind
from chutelab.results.quantities import compare
from chutelab.results.summary import Plug, plugged, schema, sheets, summary

TOP = [
    "format", "scene", "engine", "particles", "seconds", "steps", "contacts", "separation",
    "impact", "landing", "arrival", "flight", "track", "ended", "fates", "crowd", "stopped",
    "plugged", "waited", "squeezed", "rolling", "steady", "drag", "laws", "instead", "ledger",
    "sensors", "loads", "theory", "theory_as_printed", "error", "accuracy",
]  # fmt: skip
BEFORE = ["t", "x", "y", "vx", "vy"]
LEDGER = [
    "kinetic", "potential", "belt_work", "restitution_loss", "friction_loss", "residual",
    "turned_over", "by_surface", "by_stream", "drive_work",
    "spring", "damper_loss", "air_loss",
    "push_work",
]  # fmt: skip
THEORY = [
    "phi1_deg", "v1", "t2", "x2", "y2", "v2", "phi2_deg", "phi2r_deg", "v2r", "t3", "x3", "y3",
    "v3x", "v3y", "v3", "d3", "dEk", "P", "belt_work", "slip_heat", "reason",
]  # fmt: skip


@cache
def run(name, *overrides):
    return simulate(scene.load(scene.find(name), overrides))


def printed(recording):
    """The object as a reader of the JSON has it; NaN and infinities are refused."""
    return json.loads(json.dumps(summary(recording), allow_nan=False))


SHIPPED = [(name, ()) for name in scene.shipped() if scene.load(name).count == 1] + [
    ("stream", ("stream.count=4", "run.until=0.9")),
    ("stream-independent", ("stream.count=40", "run.until=0.9")),
]


@pytest.mark.parametrize(("name", "overrides"), SHIPPED)
def test_the_keys_are_those_of_the_contract(name, overrides):
    recording = run(name, *overrides)
    found = printed(recording)
    assert list(found) == TOP
    assert found["separation"].keys() >= {*BEFORE}
    assert found["impact"].keys() >= {*BEFORE, "vx_after", "vy_after"} <= found["landing"].keys()
    assert found["ended"].keys() >= {"t", "x", "y", "reason"}
    assert list(found["ledger"]) == LEDGER
    assert list(found["ledger"]["by_surface"]) == list(recording.surfaces)
    for entries in found["ledger"]["by_surface"].values():
        assert list(entries)[:3] == ["belt_work", "restitution_loss", "friction_loss"]
        assert set(list(entries)[3:]) <= {"drive_work", "damper_loss", "air_loss"}
    assert list(found["theory"]) == THEORY
    assert found["error"].keys() - {"max"} == compare(recording).errors.keys()
    assert found["format"] == 1
    for key in ("separation", "impact", "landing", "ended"):
        for column in found[key].values():
            assert len(column) == found["particles"] == recording.count


@pytest.mark.parametrize(("name", "overrides"), SHIPPED)
def test_columns_hold_the_first_event_of_each_particle_or_null(name, overrides):
    recording = run(name, *overrides)
    found = printed(recording)
    wanted = {
        "separation": (Kind.SEPARATION, "incoming"),
        "impact": (Kind.IMPACT, "plate"),
        "landing": (Kind.LANDING, "outgoing"),
    }
    for key, (kind, surface) in wanted.items():
        for particle in range(recording.count):
            own = [
                event
                for event in recording.events
                if event["particle"] == particle
                and event["kind"] == kind
                and recording.surfaces[event["surface"]] == surface
            ]
            names = BEFORE if key == "separation" else [*BEFORE, "vx_after", "vy_after"]
            row = [found[key][name][particle] for name in names]
            if not own:
                assert row == [None] * len(row)
                continue
            event = own[0]
            expected = [event["t"], *event["position"], *event["velocity_before"]]
            expected += [] if key == "separation" else [*event["velocity_after"]]
            assert row == expected
    for particle in range(recording.count):
        track = recording.track(particle)
        assert found["ended"]["t"][particle] == (float(track["t"][-1]) if len(track) else None)
        reason = found["ended"]["reason"][particle]
        assert reason == REASONS[recording.ended[particle]]


def test_where_theory_ends_it_says_null_and_why():
    found = printed(run("free-fall"))
    assert {found["theory"][key] for key in THEORY[:-1]} == {None}
    assert "incoming" in found["theory"]["reason"]
    assert found["error"] == {"max": None}
    part = printed(run("perpendicular", "outgoing.start=2.0", "outgoing.drop_from=top"))
    assert part["theory"]["v2r"] > 0.0
    assert part["theory"]["t3"] is None
    assert part["landing"]["t"] == [None]
    assert part["ended"]["reason"] == ["exit"]


@pytest.mark.parametrize(
    ("name", "override"),
    [
        ("perpendicular", "plate.friction=0.1"),
        ("perpendicular", "plate.angle_deg=1e-9"),
        ("inclined-20", "plate.friction=0"),
        ("free-fall", "gravity=9.8"),
    ],
)
def test_it_is_printed_for_a_frictionless_upright_plate_only(name, override):
    assert printed(run(name, override))["theory_as_printed"] is None


ROLLING = ("particle.spin=true", "run.until=settled", "outgoing.length=8")


@pytest.mark.parametrize(
    ("friction", "belt"), [(0.0, 2.0), (0.3, 2.0), (0.0, 0.5), (0.3, -2.0), (0.0, -1.5)]
)
def test_a_disk_that_rolls_on_the_belt_is_said_not_to_be_carried(friction, belt):
    """No slip from v_x = -1 m/s on: v_x + w/3, w = v_b - v_x - s; paid m v_b w/3, a load m v_b
    (v_b - v_x). At a frictionless plate the rim speed s stays 0; else J_t = m/3 of the slip
    2.92 m/s, at most µ m (1 + ε) v_n = 0.9 m, gives s = r J_t r / (m r²/2), along the belt."""
    overrides = (*ROLLING, f"plate.friction={friction}", f"outgoing.speed={belt}")
    found = printed(run("perpendicular", *overrides))
    fall = 9.81 * 0.298
    impulse = min(fall / 3.0, friction * 1.5 * 2.0)
    rim = 2.0 * impulse
    slip = belt + 1.0 - rim
    assert found["rolling"] == {
        "particles": 1,
        "belt_work": pytest.approx(0.008 * belt * slip / 3.0, rel=1e-12, abs=0.0),
        "belt_work_carried": pytest.approx(0.008 * belt * (belt + 1.0), rel=1e-12, abs=0.0),
    }


@pytest.mark.parametrize(
    "overrides",
    [
        ("run.until=settled", "outgoing.length=8"),  # does not turn: carried in the end
        (*ROLLING, "outgoing.speed=-1"),  # arrives as fast as the belt runs
        ("particle.spin=true",),  # only landed
        # Slips so long that it is off the end before.
        (*ROLLING, "outgoing.friction=0.02", "outgoing.start=-1"),
    ],
)
def test_nothing_rolls_where_all_are_carried_or_nothing_settled(overrides):
    assert printed(run("perpendicular", *overrides))["rolling"] is None


FEED = ("stream.count=12", "stream.rate=1000", "stream.bed_height=0", "run.until=0.3")


@pytest.mark.parametrize("engine", ["contact", "pymunk"])
def test_it_says_how_many_waited_for_a_place_and_how_long(engine):
    # In one layer on a belt of 2 m/s the place is free again after 2 r / v = 6.3 ms: particle i is
    # due at i ms and comes at 6.3 i ms, 5.3 i ms late. Engines look once a step of 1 ms.
    recording = run("stream", *FEED, f"run.engine={engine}")
    late = 5.3e-3 * np.arange(1, 12)
    found = printed(recording)["waited"]
    assert (found["particles"], found["never"]) == (11, 0)
    assert late.max() - 1e-9 <= found["longest"] <= late.max() + 11e-3
    assert found["mean"] == pytest.approx(np.mean(late) * found["longest"] / late.max(), abs=1e-3)
    # What is released stands clear of the one before it.
    gaps = np.diff(recording.select(Kind.RELEASE)["t"])
    assert gaps.min() >= 6.3e-3 * (1.0 - 1e-9)


@pytest.mark.parametrize("engine", ["contact", "pymunk"])
def test_none_waits_where_there_is_room(engine):
    # 1/150 s at 2 m/s is 13.3 mm; the pymunk engine releases at its steps, which is no waiting.
    changed = ("stream.rate=150", "incoming.friction=0.5", f"run.engine={engine}")
    assert printed(run("stream", *FEED, *changed))["waited"] is None


def test_a_plugged_hopper_is_announced_and_one_that_runs_out_is_not():
    # Three or four grains bridge an opening of 2 diameters in 5 of 16 draws, and one of 8 in none.
    narrow = [
        f"surface[{i}].points=[[{x}0.1, 1.2], [{x}0.1, 0.076], [{x}0.006, 0.0]]"
        for i, x in enumerate(("-", ""))
    ]
    draws = [run("hopper", "stream.count=60", f"stream.seed={n}", *narrow) for n in range(6)]
    plugged = [one for one in (printed(draw)["plugged"] for draw in draws) if one]
    assert plugged
    for stuck in plugged:
        assert stuck["still"] + stuck["through"] == 60
        assert stuck["still"] > 50
    assert printed(run("hopper", "stream.count=60"))["plugged"] is None


def test_what_trembles_on_a_floor_is_stuck_and_what_slides_is_not():
    """Without friction each keeps its speed: 0.5 mm/s, 5 mm/s; a third falls past the floor."""
    floor = {"name": "floor", "from": [0.0, 0.0], "to": [1.0, 0.0], "friction": 0.0}
    places = (0.3, 5e-4, 0.01), (0.7, 5e-3, 0.01), (1.5, 0.0, -0.5)
    streams = [{"name": f"s{n}", "at": [x, y], "velocity": [u, 0.0], "interact": True}
               for n, (x, u, y) in enumerate(places)]  # fmt: skip
    run = chutelab.simulate(
        {
            "particle": {"radius": 0.01},
            "surface": [floor],
            "stream": streams,
            "run": {"until": 1.0},
        },
        engine="pymunk",
    )
    assert list(run.ended_by("exit")) == [False, False, True]
    assert plugged(run) == Plug(1, 1)


def test_what_never_finds_a_place_is_counted_and_what_is_not_due_is_not():
    # One lies in the place for good; until 0.045 s particles 1 to 4 are due.
    lying = {
        "surface": [{"name": "floor", "from": [-1.0, 0.0], "to": [1.0, 0.0]}],
        "stream": {
            "count": 10, "rate": 100.0, "at": [0.0, 0.0063], "velocity": [0.0, 0.0],
            "interact": True,
        },
        "run": {"until": 0.045},
    }  # fmt: skip
    found = printed(simulate(scene.from_dict(lying, "mine.toml")))["waited"]
    assert found == {"particles": 0, "longest": 0.0, "mean": 0.0, "never": 4}


def described(schema, found, path=""):
    """Assert that an object has the keys and types that a JSON Schema says, and no others."""
    kinds = {"integer": int, "number": (int, float), "string": str, "array": list, "object": dict}
    types = schema.get("type", [])
    allowed = [
        kinds[one] for one in ([types] if isinstance(types, str) else types) if one != "null"
    ]
    assert (found is None and "null" in types) or not types or isinstance(found, *allowed), path
    if isinstance(found, dict) and "properties" in schema:
        assert found.keys() <= schema["properties"].keys(), path
        assert not (missing := set(schema.get("required", ())) - found.keys()), (path, missing)
        for key, inner in found.items():
            described(schema["properties"][key], inner, f"{path}.{key}")
    for inner in found if isinstance(found, list) else ():
        described(schema.get("items", {}), inner, path)
        assert inner in schema.get("items", {}).get("enum", [inner])


@pytest.mark.parametrize("case", [*SHIPPED[:3], *SHIPPED[-2:]])
def test_the_schema_describes_every_key_with_its_unit(case):
    said = schema()
    described(said, printed(run(case[0], *case[1])))
    for event in ("separation", "impact", "landing", "arrival"):
        units = {key: one["x-unit"] for key, one in said["properties"][event]["properties"].items()}
        assert units.items() >= {"t": "s", "x": "m", "y": "m", "vx": "m/s", "vy": "m/s"}.items()
    assert said["properties"]["theory"]["properties"]["phi1_deg"]["x-unit"] == "degrees"


def test_the_first_six_contacts_are_listed_where_no_theory_speaks_of_them():
    """From 0.8 m it meets the floor after sqrt(2 h / g), then each 0.8 times as long as before."""
    floor = {"name": "floor", "from": [-1.0, 0.0], "to": [1.0, 0.0], "restitution": 0.8}
    run = simulate({
        "particle": {"radius": 0.0}, "surface": [floor], "run": {"until": 3.5},
        "stream": {"at": [0.0, 0.8], "velocity": [0.0, 0.0]},
    })  # fmt: skip
    assert len(run.select(Kind.IMPACT)) > 6
    (way,) = [sheet for sheet in sheets(run) if sheet.title == "Particle 0, its first contacts"]
    fall = np.sqrt(2.0 * 0.8 / 9.81)
    times = fall + 2.0 * fall * np.cumsum([0.0, *0.8 ** np.arange(1, 6)])
    assert [row[0] for row in way.rows] == ["meets floor"] * 6
    assert [float(row[1]) for row in way.rows] == pytest.approx(times, rel=1e-5)


@pytest.mark.parametrize("name", ["domino-gate", "flap-gate", "loop", "damper-plate"])
def test_no_table_is_empty_and_none_counts_a_loss_twice(name):
    """Σ losses of surfaces and particles = total = Σ losses of streams."""
    found = {sheet.title: sheet for sheet in sheets(run(name))}
    assert all(sheet.rows for title, sheet in found.items() if title)
    for row in found["Particle 0"].rows if "Particle 0" in found else ():
        assert "-" not in row
    (losses,) = (sheet for title, sheet in found.items() if title.startswith("Energy ledger"))
    for index, head in enumerate(losses.columns):
        if head.endswith("loss"):
            rows, (total, *parts) = (
                [float(row[index]) for row in group] for group in (losses.rows, losses.foot)
            )
            assert sum(rows) == pytest.approx(total, rel=1e-5)
            assert not parts or sum(parts) == pytest.approx(total, rel=1e-5)
