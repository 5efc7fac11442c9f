"""The contact engine where friction locks, and where what lay on a surface parts from it."""

from __future__ import annotations

from math import cos, pi, sin

import numpy as np
import pytest

from chutelab.engines.contact import run
from chutelab.results import Kind
from machines import bent, face, scene_of, thrown

G = 9.81
R = 0.01
"""m; of the disks."""
GRIP = {"friction": 1e6, "restitution": 0.0}
FAR = face("far", (-50.0, -90.0), (50.0, -90.0))


@pytest.mark.parametrize(("count", "alpha", "friction"), [(3, 0.2, 1.0), (4, 0.25, 1.0)])
def test_a_nip_that_no_impulses_hold_open_lets_the_belt_slip(count, alpha, friction):
    """A belt drives disks that hardly roll into a wedge: none sinks into what does not give way.

    Rigid bodies have no solution with all of the friction. The lowest disk touches both faces
    where its centre is r / tan(α/2) above their edge.
    """
    edge, normal = -0.3, np.array([cos(alpha), -sin(alpha)])
    wall = face("wall", (0.0, edge), (0.6 * sin(alpha), edge + 0.6 * cos(alpha)), **GRIP)
    machine = scene_of(
        particle={"radius": R, "spin": True, "rolling_friction": 0.3},
        surface=[face("belt", (0.0, edge), (0.0, 0.3), speed=-1.0, **GRIP), wall],
        stream={"count": 2, "interact": True, "rate": 1.0, "bed_height": 1.0, "at": [0.0, 3.0],
                "restitution": 0.0, "friction": friction},
        run={"until": 0.5},
    )  # fmt: skip
    row = np.multiply.outer(R * (1.0 + 2.01 * np.arange(count)), [cos(0.1), sin(0.1)])
    recording = run(thrown(machine, row + np.array([1e-4, 0.15])))
    places = recording.at(np.linspace(1e-3, 0.499, 200))[0]
    others = np.hypot(*np.moveaxis(places[:, :, None] - places[:, None], -1, 0))
    others[:, range(count), range(count)] = np.inf
    from_wall = -(places - [0.0, edge]) @ normal
    assert min(0.5 * others.min(), places[..., 0].min(), from_wall.min()) > 0.99 * R
    lowest = places[-1, :, 1].min()
    assert lowest == pytest.approx(edge + R / np.tan(0.5 * alpha), abs=0.02 * R / alpha)


@pytest.mark.parametrize("dt", [1e-3, 2.5e-4])
def test_who_leaves_a_crest_flies(dt):
    """A disk rolls over a round crest, which grips without a bound, and leaves it once and for all.

    Gripped at the top it keeps v1 = 2/3 v0; 3/4 v^2 - 3/4 v1^2 = g l (1 - cos φ), and it leaves
    where v^2 = g l cos φ: at cos φ = (3 v1^2/(g l) + 4) / 7. From there its gap grows like t^3.
    """
    crest = {"center": (0.0, 0.0), "radius": 0.2, "begin": 0.0, "extent": 2.0 * pi, **GRIP}
    machine = bent(scene_of(particle={"radius": R, "spin": True}, surface=[FAR],
                            run={"until": 0.5, "dt": dt}), crest)  # fmt: skip
    length = 0.2 + R
    for v0 in np.linspace(0.3, 1.4, 23):
        recording = run(thrown(machine, [0.0, length], [v0, 0.0]))
        left = recording.select(Kind.SEPARATION)
        assert len(left) == 1
        cosine = (3.0 * (v0 / 1.5) ** 2 / (G * length) + 4.0) / 7.0
        assert left["position"][0, 1] / length == pytest.approx(cosine, abs=100.0 * dt * dt)
        events = recording.events
        assert not len(events[events["t"] > left["t"][0]])
        last = recording.track(0)
        last = last[last["t"] > left["t"][0] + dt]
        assert np.ptp(last["omega"]) == 0.0
        assert np.ptp(last["velocity"][:, 0]) == 0.0


@pytest.mark.parametrize("crowded", [False, True])
def test_who_is_struck_off_a_ramp_has_left_the_ramp(crowded):
    """It slides down at 45 degrees onto the ground, without friction, and is thrown off both.

    v^2 = 2 g s sin 45 along the ramp; half of v sin 45 comes back, off the ramp.
    """
    smooth, side = {"friction": 0.0, "restitution": 0.5}, np.sqrt(0.5)
    ramp = face("ramp", (-1.0, 1.0), (0.0, 0.0), **smooth)
    machine = scene_of(surface=[ramp, face("ground", (-1.0, 0.0), (3.0, 0.0), **smooth)],
                       run={"until": 0.55})  # fmt: skip
    # It meets the ground where its centre is r above it, and on the ramp.
    foot, way = np.array([R * (np.sqrt(2.0) - 1.0), R]), 0.5
    start = foot + way * side * np.array([-1.0, 1.0])
    recording = run(thrown(machine, [start, (2.5, R)] if crowded else start))
    left = recording.select(Kind.SEPARATION)[0]
    blow = next(one for one in recording.select(Kind.IMPACT) if one["surface"] == 1)
    speed = np.sqrt(2.0 * G * way * side)
    assert machine.surfaces[left["surface"]] == "ramp"
    assert blow["t"] <= left["t"] <= blow["t"] + machine.dt
    np.testing.assert_allclose(blow["position"], foot, rtol=0, atol=1e-3 * R)
    np.testing.assert_allclose(
        blow["velocity_after"], speed * side * np.array([1.0, 0.5]), rtol=2e-3
    )


@pytest.mark.parametrize("crowded", [False, True])
@pytest.mark.parametrize("aside", [0.1, 0.2, 0.4])
@pytest.mark.parametrize("share", [1.0, 1.0001, 1.003])
def test_a_disk_squeezes_through_the_gap_of_a_ring_and_feels_both_ends(share, aside, crowded):
    """The gap is hardly wider than the disk: next to one end it may not be in the other.

    It falls in through the top, and comes to lie at the bottom of the ring. A thousandth of the
    radius of overlap is left alone.
    """
    ring, half = 5.0 * R, np.arcsin(share / 5.0)
    arc = {"center": (0.0, 0.0), "radius": ring, "begin": 0.5 * pi + half,
           "extent": 2.0 * (pi - half), "friction": 0.0, "restitution": 0.0}  # fmt: skip
    machine = bent(scene_of(surface=[FAR], run={"until": 0.3}), arc)
    ends = ring * np.array([[sin(half), cos(half)], [-sin(half), cos(half)]])
    for speed in (1.0, 3.0):
        places = [(aside * R, 0.08), (5.0, 5.0)] if crowded else [(aside * R, 0.08)]
        recording = run(thrown(machine, places, [0.0, -speed]))
        way = np.concatenate([
            recording.track(0)["position"], recording.at(np.linspace(0.0, 0.299, 1000))[0][:, 0]
        ])  # fmt: skip
        assert np.hypot(*(way[:, None] - ends).transpose(2, 0, 1)).min() > 0.999 * R
        assert np.hypot(*way[-1]) < ring - 0.999 * R
