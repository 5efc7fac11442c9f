"""Blows on corners have their restitution, however fast a body spins."""

from math import cos, hypot, pi, radians, sin, sqrt

import numpy as np
import pytest

import chutelab
from chutelab.results import Kind

scipy = pytest.importorskip("scipy")
from scipy.optimize import brentq  # noqa: E402

M, E, MU = 0.01, 0.8, 0.2
"""kg; restitution and friction of all pairs."""


def outline(points, q):
    """Return the corners of a body at q = (x, y, angle)."""
    c, s = np.cos(q[2]), np.sin(q[2])
    return q[:2] + points @ np.array([[c, s], [-s, c]])


def first_root(gap, times):
    """Return when a gap closes for the first time, or None."""
    values = np.array([gap(t) for t in times])
    closed = np.flatnonzero((values[:-1] > 0.0) & (values[1:] <= 0.0))
    return brentq(gap, *times[closed[0] : closed[0] + 2], xtol=1e-16) if len(closed) else None


def blows(points, inertia, q, rate, until):
    """Return the blows on the floor y = 0 without gravity: when, and the velocity after each.

    At a corner at r from the centre, with u = v + omega x r, the impulse is that which gives
    u_y' = -E u_y and u_x' = 0 or, if friction cannot do that, the one with |J_x| = MU J_y.
    """
    found, t0 = [], 0.0
    while True:
        times = np.linspace(t0 + 1e-9, until, 4001)
        t = first_root(
            lambda t, q=q, v=rate, t0=t0: outline(points, q + v * (t - t0))[:, 1].min(), times
        )
        if t is None:
            return found
        q, t0 = q + rate * (t - t0), t
        corners = outline(points, q) - q[:2]
        x, y = corners[corners[:, 1].argmin()]
        u = rate[:2] + rate[2] * np.array([-y, x])
        normal, along, both = 1.0 / M + x * x / inertia, 1.0 / M + y * y / inertia, -x * y / inertia
        j = np.linalg.solve([[normal, both], [both, along]], [-(1.0 + E) * u[1], -u[0]])
        if abs(j[1]) > MU * j[0]:
            way = np.sign(j[1]) * MU
            j = -(1.0 + E) * u[1] / (normal + way * both) * np.array([1.0, way])
        rate = rate + np.array([j[1] / M, j[0] / M, (x * j[0] - y * j[1]) / inertia])
        found.append((t, rate))


def square(side):
    x = 0.5 * side
    return np.array([(-x, -x), (x, -x), (x, x), (-x, x)]), M * side**2 / 6.0


def octagon(radius):
    """Its moment of inertia is that of eight triangles of height a = R cos(pi / 8)."""
    angles = np.arange(8) * pi / 4.0
    points = radius * np.column_stack((np.cos(angles), np.sin(angles)))
    return points, M * radius**2 * (1.0 + 2.0 * np.cos(pi / 8.0) ** 2) / 6.0


@pytest.mark.parametrize(
    ("shape", "height", "speed", "angle", "omega", "count"),
    [
        (square(0.006), 0.1, 2.0, 10.0, 0.0, 2),
        (octagon(0.03), 0.035, 0.5, 40.0, 400.0, 1),
        (octagon(0.03), 0.035, 0.2, 10.0, 400.0, 1),
    ],
)
def test_corners_that_spin_down_on_a_floor(shape, height, speed, angle, omega, count):
    points, inertia = shape
    scene = {
        "gravity": 0.0,
        "particle": {"shape": "polygon", "points": points.tolist(), "mass": M, "spin": True},
        "surface": [
            {"name": "floor", "from": [-9.0, 0.0], "to": [9.0, 0.0],
             "restitution": E, "friction": MU},
        ],
        "stream": {
            "at": [0.0, height], "velocity": [0.0, -speed], "angle_deg": angle, "omega": omega,
        },
        "run": {"until": 0.08},
    }  # fmt: skip
    recording = chutelab.simulate(scene, engine="contact")
    assert not recording.laws
    q, rate = np.array([0.0, height, np.radians(angle)]), np.array([0.0, -speed, omega])
    wanted, struck = blows(points, inertia, q, rate, 0.08), recording.select("impact")
    assert len(struck) == len(wanted) == count
    for row, (t, after) in zip(struck, wanted, strict=True):
        assert row["t"] == pytest.approx(t, rel=1e-9)
        assert row["velocity_after"] == pytest.approx(after[:2], rel=1e-7)
        assert row["omega_after"] == pytest.approx(after[2], rel=1e-7)


@pytest.mark.parametrize(("omega", "speed", "angle"), [(400.0, 0.1, 20.0), (200.0, 0.1, 10.0)])
def test_a_ball_that_comes_to_a_spinning_octagon_is_struck_by_the_first_corner(omega, speed, angle):
    """The normal is from the place on the octagon to the centre of the ball; u_n' = -E u_n."""
    points, r = octagon(0.03)[0], 0.01

    def place(t):
        """Place on the octagon that is nearest to the ball, and the way from it to its centre."""
        a = outline(points, np.array([0.0, 0.0, np.radians(angle) + omega * t]))
        b, c = np.roll(a, -1, axis=0) - a, np.array([0.0, 0.045 - speed * t])
        on = a + np.clip(np.sum((c - a) * b, 1) / np.sum(b * b, 1), 0.0, 1.0)[:, None] * b
        nearest = on[np.hypot(*(c - on).T).argmin()]
        return nearest, c - nearest

    kinds = [
        {"name": "octagon", "shape": "polygon", "points": points.tolist(), "mass": 0.1},
        {"name": "ball", "radius": r, "mass": 0.02},
    ]
    pair = {"restitution": E, "friction": MU}
    scene = {
        "gravity": 0.0,
        "particle": [{**kind, "spin": True} for kind in kinds],
        "surface": [{"name": "far", "from": [-9.0, -9.0], "to": [9.0, -9.0]}],
        "stream": [
            {"particle": "octagon", "at": [0.0, 0.0], "velocity": [0.0, 0.0], "omega": omega,
             "angle_deg": angle, "interact": True, **pair},
            {"particle": "ball", "at": [0.0, 0.045], "velocity": [0.0, -speed], **pair},
        ],
        "run": {"until": 0.1},
    }  # fmt: skip
    recording = chutelab.simulate(scene, engine="contact")
    struck = recording.select("collision")[0]
    t = first_root(lambda t: np.hypot(*place(t)[1]) - r, np.linspace(0.0, 0.1, 4001))
    at, way = place(t)
    n = way / r
    now = recording.at([t + 1e-9])
    v, spin = now.velocity[0], now.omega[0]
    on_ball, on_octagon = np.array([way[1], -way[0]]), np.array([-at[1], at[0]])
    after = v[1] + spin[1] * on_ball - v[0] - spin[0] * on_octagon
    before = np.array([0.0, -speed]) - omega * on_octagon
    assert struck["t"] == pytest.approx(t, rel=1e-7)
    assert after @ n == pytest.approx(-E * (before @ n), rel=1e-6)


@pytest.mark.parametrize(("slope", "turn"), [(60.0, 25.0), (60.0, 50.0), (74.0, 30.0)])
@pytest.mark.parametrize("lean", [60.0, 86.6, 160.0])
def test_a_corner_that_slides_into_a_bend_is_struck_there(slope, turn, lean):
    """It does not rotate, and slides without friction down a slope and along another one.

    At the bend it has v² = 2 g s sin(slope), and with no restitution it keeps v cos(turn).
    """
    g, s, size = 9.81, 0.27, np.array([0.04, 0.004])
    a, b, tilt = radians(slope), radians(slope - turn), radians(lean + 90.0 - slope)
    down, on, up = np.array([[cos(a), -sin(a)], [cos(b), -sin(b)], [sin(a), cos(a)]])
    corners = outline(0.5 * size * np.array([(-1, -1), (1, -1), (1, 1), (-1, 1)]), [0, 0, tilt])
    lowest = corners[(corners @ up).argmin()]
    bend = {"name": "bend", "friction": 0.0, "restitution": 0.0,
            "points": [(-0.3 * down).tolist(), [0.0, 0.0], (0.3 * on).tolist()]}  # fmt: skip
    v, t = sqrt(2.0 * g * s * sin(a)), sqrt(2.0 * s / (g * sin(a)))
    found = chutelab.simulate({
        "particle": {"shape": "box", "size": size.tolist(), "mass": 0.03, "spin": False},
        "surface": [bend],
        "stream": {"at": (1e-3 * up - s * down - lowest).tolist(), "velocity": [0.0, 0.0],
                   "angle_deg": np.degrees(tilt), "interact": True},
        "run": {"until": t + 0.01},
    }, engine="contact")  # fmt: skip
    assert found.select(Kind.IMPACT)["t"][1:] == pytest.approx([t], abs=1e-6)
    speed = v * cos(radians(turn)) + g * sin(b) * 0.01
    assert hypot(*found.ends()[1]["velocity"][0]) == pytest.approx(speed, rel=1e-6)


def test_a_corner_that_slides_into_a_bend_on_a_hinge_is_struck_there():
    """Its velocity after the blow does not depend on the step, to 3e-4 m/s.

    The bend swings, so at the end of the first face the corner may be a little inside it.
    """
    face = {"friction": 0.0, "restitution": 0.0, "hinge": [-0.063, 0.02], "mass": 0.017,
            "spring": 0.063, "rest_deg": 11.0, "stops_deg": [-19.0, 16.0]}  # fmt: skip
    points = [[-0.13, 0.145], [-0.081, -0.024], [0.003, -0.105]]
    ends = []
    for dt in (1e-3, 1e-4):
        found = chutelab.simulate({
            "particle": {"shape": "box", "size": [0.0377, 0.00377], "mass": 0.0277, "spin": False},
            "surface": [{"name": "bend", "points": points, **face}],
            "stream": {"at": [-0.115, 0.135], "velocity": [0.13, -0.51], "angle_deg": 77.4,
                       "interact": True},
            "run": {"until": 0.144, "dt": dt},
        }, engine="contact")  # fmt: skip
        ends.append(found.ends()[1]["velocity"][0])
    assert ends[0] == pytest.approx(ends[1], abs=3e-4)


@pytest.mark.parametrize("first", [0, 1])
@pytest.mark.parametrize(("tilt", "s"), [(1e-3, 2e-4), (3e-3, 5e-4), (7e-3, 5e-4)])
def test_a_tip_beside_a_tip_presses_on_the_edge_that_it_is_on(tilt, s, first):
    """Of two needles side by side one tip falls on the long edge of the other, beside its tip.

    That tip is outside of the falling needle by s sin(tilt), less than what rounds a corner. So
    there is one place, with J = (1 + E) v / (2 / m + (a² + b²) / I), a and b the levers of n.
    """
    r, gap, v = 0.016, 1e-7, 0.1
    points = np.array([(-r, -0.1 * r), (r, 0.0), (-r, 0.1 * r)])
    about = points - points.mean(0)
    inertia = M * (about**2).sum() / 12.0
    angles = np.array([pi, -tilt]) - np.arctan(0.05)
    n = np.array([0.0, 1.0])
    place = outline(about, [0.0, 0.0, angles[0]])[1] + np.array([s, 0.0])
    center = place + gap * n - outline(about, [0.0, 0.0, angles[1]])[1]
    kind = {"shape": "polygon", "points": points.tolist(), "mass": M, "spin": True}
    rows = [{"at": [0.0, 0.0], "velocity": [0.0, 0.0]},
            {"at": center.tolist(), "velocity": (-v * n).tolist()}]  # fmt: skip
    rows = [{**row, "angle_deg": float(np.degrees(a)), "interact": True, "restitution": E,
             "friction": 0.0} for row, a in zip(rows, angles, strict=True)]  # fmt: skip
    found = chutelab.simulate({
        "gravity": 0.0, "particle": kind, "stream": [rows[first], rows[1 - first]],
        "surface": [{"name": "far", "from": [-9.0, -9.0], "to": [9.0, -9.0]}],
        "run": {"until": 2e-6},
    }, engine="contact")  # fmt: skip
    levers = place[0], place[0] - center[0]
    j = (1.0 + E) * v / (2.0 / M + (levers[0] ** 2 + levers[1] ** 2) / inertia)
    end = found.at([2e-6])
    for who, sign, lever, begin in ((first, -1.0, levers[0], 0.0), (1 - first, 1.0, levers[1], v)):
        assert end.velocity[0, who] == pytest.approx((sign * j / M - begin) * n, abs=1e-6)
        assert end.omega[0, who] == pytest.approx(sign * j * lever / inertia, rel=1e-4)
