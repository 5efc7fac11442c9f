"""A stream as a whole, against sums written here."""

from functools import cache

import numpy as np
import pytest
from click.testing import CliRunner

from chutelab import simulate
from chutelab.cli import main
from chutelab.machine import build
from chutelab.results import REASONS, Kind
from chutelab.results.arrival import LOOKS, Places, arrivals, fates
from chutelab.results.ledger import ledger
from chutelab.results.quantities import each, measure
from chutelab.results.recorder import Recorder
from chutelab.results.stream import envelopes, steady
from chutelab.results.summary import summary
from chutelab.scene import SceneError, from_dict, load
from typed import sweep

G = 9.81


@cache
def stream():
    return simulate(load("stream"))


def test_envelope_of_parabolas():
    """Of parabolas from many heights: where 2, 50 and 98 % of them cross each cut."""
    thrown = {"count": 300, "rate": 1e6, "at": [0.0, 1.0], "velocity": [2.0, 0.0]}
    scene = from_dict({
        "stream": {**thrown, "bed_height": 0.2, "seed": 3},
        "surface": [{"name": "floor", "from": [-1.0, -90.0], "to": [9.0, -90.0]}],
        "run": {"until": 2.0},
    })  # fmt: skip
    recording = simulate(scene)
    heights = recording.ends()[0]["position"][:, 1]
    (envelope,) = envelopes(recording, 30).values()
    cuts = 0
    for place, normal, offset in zip(
        envelope.middle, envelope.normal, envelope.offset.T, strict=True
    ):
        # (x, y) = (2 t, h - g t²/2) is on the cut where (x - X) n_y = (y - Y) n_x.
        a, b = 0.5 * G * normal[0], 2.0 * normal[1]
        c = -place[0] * normal[1] - (heights - place[1]) * normal[0]
        t = (-b + np.sqrt(b * b - 4.0 * a * c)) / (2.0 * a) if abs(a) > 1e-12 else -c / b
        if t.min() < 0.0 or np.isnan(offset).any():
            continue  # fewer than half have come, or have not ended, there
        path = np.stack([2.0 * t, heights - 0.5 * G * t * t], axis=-1)
        expected = np.quantile((path - place) @ normal, [0.02, 0.5, 0.98])
        np.testing.assert_allclose(offset, expected, atol=5e-5)
        cuts += 1
    assert cuts > 10


# what has arrived ---------------------------------------------------------------------------------

R, MASS, BELT = 0.01, 0.01, 2.0
"""Radius, m, mass, kg, and speed of the belt at y = 0, m/s, of the cases by hand."""


def by_hand(tracks, collisions=(), landings=()):
    """A recording of tracks [(t, x, y, vx, vy), ...] and of what met, or met the belt, at t."""
    machine = build(from_dict({
        "particle": {"radius": R, "mass": MASS},
        "outgoing": {"speed": BELT, "drop": 1.0, "drop_from": "top", "start": -20.0, "length": 40},
        "incoming": {"speed": 2.0, "pulley_radius": 1.0, "friction": 0.5},
        "stream": {"count": len(tracks), "at": [0.0, 8.0], "velocity": [0.0, 0.0], "rate": 1e3,
                   "interact": True},
        "run": {"until": 3.0},
    }))  # fmt: skip
    recorder = Recorder(machine)
    for i, track in enumerate(tracks):
        for t, x, y, vx, vy in track:
            recorder.knots(i, t, (x, y), (vx, vy), 0.0)
        recorder.ended[i] = REASONS.index("time")
    states = {(i, row[0]): row for i, track in enumerate(tracks) for row in track}
    for t, i, j in collisions:
        _, x, y, vx, vy = states[i, t]
        recorder.events(Kind.COLLISION, i, t, (x, y), (vx, vy), other=j, surface=2)
    for t, i in landings:
        _, x, y, vx, vy = states[i, t]
        recorder.events(Kind.LANDING, i, t, (x, y), (vx, vy), surface=1)
    return recorder.finish(engine="contact", steps=1)


def line(x, y, *times, vx=0.0, vy=0.0):
    """Knots of a particle that moves evenly from (x, y) at t = 0."""
    return [(t, x + vx * t, y + vy * t, vx, vy) for t in times]


def test_a_particle_arrives_on_what_lies_on_the_belt_and_on_nothing_else():
    """0 lies on the belt, 1 on 0; 2 hits 1; 3 hits 4 in the air, then lands; 4 never comes."""
    rests = line(0.0, R, 0.0, 1.0, 2.0, 3.0)
    on_it = line(0.0, 3.0 * R, 0.0, 1.0, 2.0, 3.0)
    comes = [*line(0.0, 5.0 * R + 1.0, 0.0, 1.0, vy=-1.0), (3.0, 0.5, 1.0, 0.2, 0.9)]
    falls = [(0.0, 5.0, 3.0, 0.0, -1.0), (1.0, 5.0, 2.0, 0.0, -1.0), (2.0, 5.0, R, 0.0, -2.0)]
    meets = [
        (0.0, 5.0, 1.0, 0.0, 1.0),
        (1.0, 5.0, 2.0 - 2.0 * R, 0.0, 1.0),
        (3.0, 6.0, 1.0, 1.0, 0.0),
    ]
    recording = by_hand(
        [rests, on_it, comes, falls, meets],
        collisions=[(1.0, 1, 2), (1.0, 3, 4)],
        landings=[(0.0, 0), (2.0, 3)],
    )
    found = arrivals(recording)
    assert found["t"][[0, 3]].tolist() == [0.0, 2.0]
    assert found["t"][1] == pytest.approx(0.0, abs=1e-9)  # no blow was recorded: it lies there
    assert found["t"][2] == 1.0
    assert found["other"][2] == 1
    assert found["velocity_before"][2].tolist() == [0.0, -1.0]
    assert found["position"][2] == pytest.approx([0.0, 5.0 * R])
    assert np.isnan(found["t"][4])
    landed = each(recording, "landing.t")
    assert np.flatnonzero(np.isfinite(landed)).tolist() == [0, 3]


def connected(recording, t):
    """Return which are connected to the belt at t by gaps of less than 1 % of r: a plain count."""
    ((places,), _), (r,) = recording.at([t]), {float(recording.particle.radius)}
    there = np.isfinite(places[:, 0])
    level = recording.machine.segments.start[recording.machine.segments.surface == 2][0, 1]
    found = there & (np.abs(places[:, 1] - level) <= 1.01 * r)
    apart = np.hypot(*(places[:, None] - places[None]).transpose(2, 0, 1))
    touch = there[:, None] & there & (apart <= 2.01 * r)
    for _ in range(recording.count):
        grown = found | touch[found].any(axis=0)
        if (grown == found).all():
            return found
        found = grown
    return found


@pytest.mark.parametrize(("gap", "touches"), [(2e-10, True), (2e-8, False)])
def test_a_mass_point_touches_what_it_lies_on_but_for_rounding(gap, touches):
    floor = {"name": "floor", "from": [0.0, 0.0], "to": [1.0, 0.0]}
    stream = {"at": [0.5, 0.1], "velocity": [0.0, 0.0]}
    tables = {"particle": {"radius": 0.0, "mass": 1.0}, "surface": [floor], "stream": stream}
    there = Places(simulate({**tables, "run": {"until": 0.1}}))
    assert there.bare(np.array([0]), np.array([[0.5, gap]]), "floor", 0.0) == [touches]


@pytest.mark.parametrize("name", ["stream", pytest.param("jet", marks=pytest.mark.slow)])
def test_all_that_ride_the_belt_have_arrived(name):
    """Counted at 400 instants: what lies there at two in turn has arrived, and all have at the end.

    At one alone it may pass what has arrived by a hair since they met.
    """
    recording = stream() if name == "stream" else simulate(crowded())
    came = arrivals(recording)["t"]
    end = float(recording.knots["t"].max())
    seen = np.full(recording.count, np.inf)
    before = np.zeros(recording.count, dtype=bool)
    for t in np.linspace(0.0, end, 400):
        here = connected(recording, t)
        seen[here & before] = np.minimum(seen[here & before], t)
        before = here
    assert np.isfinite(seen).all()
    assert np.isfinite(came).all()
    # Within 1 % of r it is seen before the blow; and some come so softly that there is none.
    late = came - seen
    assert (late < 1e-3).mean() > 0.95
    assert late.max() < 2.0 * end / LOOKS
    landed = np.isfinite(each(recording, "landing.t")).sum()
    assert landed < recording.count
    assert fates(recording).tolist() == ["on outgoing"] * recording.count


def crowded():
    """The transfer of coal in which 151 of 200 were said to miss the belt that all 200 ride."""
    return from_dict({
        "particle": {"material": "coal", "radius": 0.02},
        "incoming": {"speed": 3.0, "pulley_radius": 0.315, "incline_deg": 8.0, "length": 2.0},
        "plate": {"distance": 0.6, "angle_deg": 27.44, "below": 0.9},
        "outgoing": {"speed": 2.0, "drop": 2.5, "drop_from": "top", "start": -1.0, "length": 10.0},
        "stream": {"count": 200, "rate": "30 t/h", "bed_height": 0.104, "interact": True},
        "run": {"until": "settled"},
    })  # fmt: skip


# where they go ------------------------------------------------------------------------------------


def test_fates_add_up_to_all():
    """Carried off either end, beside the machine, in the air, on the belt, on it in a bed."""
    fall = -60.0
    far = [(0.0, 21.0, 1.0, 0.0, 0.0), (3.0, 22.0, fall, 0.0, -1.0)]
    off = [(0.0, 15.0, R, BELT, 0.0), (2.0, 19.0, R, BELT, 0.0), (3.0, 21.0, fall, BELT, -9.0)]
    back = [
        (0.0, -15.0, R, -BELT, 0.0),
        (2.0, -19.0, R, -BELT, 0.0),
        (3.0, -21.0, fall, -BELT, -9.0),
    ]
    tracks = [
        far, off, back, line(0.0, R, 0.0, 3.0), line(0.0, 3.0 * R, 0.0, 3.0),
        line(0.0, 0.5, 0.0, 3.0), [],
    ]  # fmt: skip
    recording = by_hand(tracks, landings=[(0.0, 1), (0.0, 2), (0.0, 3)])
    assert fates(recording).tolist() == [
        "fell right", "off outgoing right", "off outgoing left", "on outgoing", "on outgoing",
        "in the air", "unreleased",
    ]  # fmt: skip
    assert REASONS[recording.ended[-1]] == "unreleased"
    assert sum(summary(recording)["fates"].values()) == len(tracks)


# what it takes ------------------------------------------------------------------------------------


def test_steady_power_is_the_ledgers():
    """8.16 J over 1.6 kg at 5.76 t/h are 8.16 W; the spread over seeds is within the error told."""
    told = []
    for seed in range(3):
        changes = {"stream.rate": "5.76 t/h", "stream.seed": seed, "expect": None}
        recording = simulate(load("stream").with_values(changes))
        found = steady(recording)
        paid = ledger(recording).by_surface["outgoing"]["belt_work"]
        assert found.power == pytest.approx(paid / (200 * 0.008) * 5.76 / 3.6, rel=1e-9)
        assert found.rate == pytest.approx(5.76)
        assert found.width is None
        told.append(found)
    powers = np.array([one.power for one in told])
    assert np.ptp(powers) < 3.0 * max(one.error for one in told) < 0.3 * powers.mean()


def test_steady_power_where_nothing_drives_the_belt():
    """All 200 arrive about as fast as the belt: the ledger's 0.01 J, not the 10.6 W of landings."""
    recording = simulate(crowded())
    paid = ledger(recording).by_surface["outgoing"]["belt_work"]
    mass = 200 * float(recording.particle.mass)
    assert abs(paid) < 0.1
    assert steady(recording).power == pytest.approx(paid / mass * 30.0 / 3.6, abs=1e-9)
    landed = simulate(crowded().with_values({"run.until": "landed"}))
    assert steady(landed).power is None
    assert "run.until=settled tells it" in str(steady(landed))


def test_a_width_is_of_the_material_and_a_slice_is_simulated():
    """A slice of a width w is one particle, 2 r, thick: w/(2 r) slices bring the rate."""
    rate, width, r, m = 36.0, 0.6, 0.0063, 0.008
    changes = {"stream.rate": f"{rate} t/h", "stream.width": width, "run.until": "settled"}
    scene = load("perpendicular").with_values({**changes, "outgoing.length": 8.0, "expect": None})
    assert scene.stream.rate == pytest.approx(rate / 3.6 / m * 2.0 * r / width, rel=1e-14)
    # Eq. (15) takes the particles per second of all of it; it lands at -1 m/s on a belt of 2 m/s.
    assert scene.rate == pytest.approx(rate / 3.6 / m, rel=1e-14)
    told = summary(simulate(scene))
    assert told["theory"]["P"] == pytest.approx(0.5 * m * (1.0 + 4.0) * rate / 3.6 / m)
    assert told["steady"]["power"] == pytest.approx(rate / 3.6 * 2.0 * 3.0)
    assert told["steady"]["width"] == width
    many = load("stream").with_values(
        {"stream.rate": "60 t/h", "stream.width": 0.126, "expect": None}
    )
    crowd = summary(simulate(many))["crowd"]
    assert crowd["whole_flow"] == pytest.approx(crowd["flow"] * 0.126 / (2.0 * r), rel=1e-12)
    assert crowd["whole_flow"] == pytest.approx(60.0, rel=0.25)


@pytest.mark.parametrize(
    ("particle", "words"),
    [({"radius": 0.0}, "disks and spheres"), ({"radius": [0.01, 0.03]}, "at least the diameter")],
)
def test_no_width_below_a_slice(particle, words):
    with pytest.raises(SceneError, match=words) as caught:
        load("perpendicular").with_values(
            {"particle": particle, "stream.width": 0.03, "expect": None}
        )
    assert [fault.key for fault in caught.value.faults] == ["stream.width"]


# how it is told -----------------------------------------------------------------------------------


def call(*arguments, code=0):
    result = CliRunner().invoke(main, list(arguments))
    assert result.exit_code == code, result.output
    return " ".join(result.output.split())


def test_a_crowds_summary_leads_with_the_crowd():
    told = call("run", "stream")
    assert told.index("All particles") < told.index("Energy ledger")
    assert "Particle 0" not in told
    assert "200 of 200 arrived on the outgoing belt" in told
    landed = np.unique(stream().select("landing")["particle"])
    assert 100 < len(landed) < 200, "the others came to lie on these"
    assert f"{len(landed)} landed: touched the belt itself" in told
    assert "in the simulated slice" in told
    assert "Particle 0" in call("run", "stream", "--details")
    assert "Particle 0" in call("run", "perpendicular")


def test_what_is_told_of_a_crowd_is_counted_from_its_arrivals():
    recording = stream()
    told, came = summary(recording), arrivals(recording)
    x = came["position"][:, 0]
    assert told["arrival"]["x"] == x.tolist()
    assert told["crowd"]["arrival"]["x"]["mean"] == pytest.approx(x.mean())
    assert told["crowd"]["arrival"]["x"]["q98"] == pytest.approx(np.quantile(x, 0.98))
    assert told["crowd"]["arrival"]["count"] == 200
    landed = np.unique(recording.select("landing")["particle"])
    assert told["crowd"]["landing"]["count"] == len(landed) < 200
    assert measure(recording, "arrival.vx.spread") == pytest.approx(
        came["velocity_before"][:, 0].std()
    )
    assert summary(simulate(load("perpendicular")))["crowd"] is None


@pytest.mark.parametrize(
    ("command", "words"),
    [
        ("sweep stream --vary plate.angle_deg=0,1 --of landing.x --plot a.png",
         "landing.x is called landing.x.mean now"),
        ("sweep stream --vary plate.angle_deg=0,1 --of belt_work --plot a.png",
         "ledger.by_surface.outgoing.belt_work now"),
        ("sweep stream --vary plate.angle_deg=0,1 --of power --plot a.png",
         "power is called ledger.power now"),
        ("sweep stream --vary plate.angle_deg=0,1 --of plate_hits --plot a.png",
         "plate_hits is called impact.count now"),
        ("solve inclined-20 --vary plate.angle_deg=0:9 --minimize restitution_loss",
         "it is called ledger.restitution_loss now"),
        ("solve stream --vary plate.angle_deg=0:9 --target impact.x=1",
         "particles[0].impact.x, or impact.x.mean of the stream"),
        ("solve stream --vary plate.angle_deg=0:9 --minimize power",
         "particles[0].power, or ledger.power of the stream"),
        ("solve stream --vary plate.angle_deg=0:9 --target landing.x=1",
         "particles[0].landing.x, or landing.x.mean of the stream"),
        ("solve stream --vary plate.angle_deg=0:9 --minimize belt_work",
         "ledger.by_surface.outgoing.belt_work of the stream"),
    ],
)  # fmt: skip
def test_a_name_that_meant_two_things_says_what_it_is_called(command, words):
    assert words in call(*command.split(), code=2)


def test_what_is_expected_of_a_crowd_says_which_it_is_of():
    text = {"value": 1.0, "tolerance": 0.5, "source": "me"}
    scene = load("stream")
    with pytest.raises(SceneError, match=r"particles\[0\]\.landing\.x, or landing\.x\.mean"):
        scene.with_values({"expect": [{"quantity": "landing.x", **text}]})
    for name in ("particles[0].landing.x", "landing.x.mean", "arrival.x.q02"):
        scene.with_values({"expect": [{"quantity": name, **text}]})
    recording = simulate(scene)
    assert measure(recording, "particles[0].landing.x") == each(recording, "landing.x")[0]


def test_a_sweep_misses_only_what_never_came_to_the_belt():
    swept = sweep(load("stream"), ["plate.restitution=0.5"])
    assert swept.columns["misses"][0] == 0.0
    assert swept.columns["reason"][0] == ""
    assert swept.columns["arrival.x.mean"][0] == measure(stream(), "arrival.x.mean")
    short = sweep(load("stream", ["outgoing.start=0.52"]), ["plate.restitution=0.5"])
    missed = int(short.columns["misses"][0])
    assert 0 < missed < 200
    assert f"{missed} of 200 particles missed the outgoing belt" in short.columns["reason"][0]


@pytest.mark.parametrize("engine", ["exact", "contact", "pymunk"])
def test_what_passes_on_to_a_belt_without_a_blow_has_arrived_there(engine):
    """A hollow ends tangentially where a belt runs against the particle, which gets across it."""
    hollow = {"center": [0.0, 0.2], "radius": 0.2, "from_deg": 180, "to_deg": 270, "friction": 0.4}
    belt = {"from": [-0.5, 0.0], "to": [1.0, 0.0], "speed": -1.0, "friction": 0.5}
    recording = simulate(
        {
            "particle": {"radius": 0.01, "spin": True},
            "surface": [{"name": "hollow", **hollow}, {"name": "belt", **belt}],
            "stream": {"at": [-0.185, 0.3], "velocity": [0.0, 0.0]},
            "run": {"until": 3.0},
        },
        engine=engine,
    )
    assert fates(recording).tolist() == ["off belt right"]
    came = arrivals(recording, "belt")["t"][0]
    across = recording.track(0)["t"][recording.track(0)["position"][:, 0] < 0.0].max()
    assert across - 0.01 < came < recording.select("separation", surface="belt")["t"][0]
