"""Corners inside arcs: a box there is a pendulum about the centre of the arc, at order 2."""

from dataclasses import replace
from math import atan2, cos, degrees, hypot, pi, sin, sqrt

import numpy as np
import pytest

import chutelab
from chutelab.results.laws import LOSSES
from sandbox import bodies

G, M, R, W, H = 9.81, 0.1, 0.2, 0.05, 0.02
"""m/s², kg; radius of the arc, width and height of the box, m."""
D = sqrt(R * R - 0.25 * W * W) - 0.5 * H
"""m; from the centre of the arc to that of the box, if both its lower corners are on the arc."""
INERTIA = M * (W * W + H * H) / 12.0 + M * D * D
"""kg m²; about the centre of the arc."""
RATE = sqrt(M * G * D / INERTIA)
"""rad/s; of small swings."""
STEPS = np.array([1e-3, 5e-4, 2.5e-4])
ARC = {"name": "arc", "center": [0.0, 0.0], "radius": R, "from_deg": 0.0, "to_deg": 360.0,
       "friction": 0.0, "restitution": 0.8}  # fmt: skip
BOX = {"shape": "box", "size": [W, H], "mass": M, "spin": True}


def mean(a, b):
    """The arithmetic-geometric mean."""
    for _ in range(8):
        a, b = 0.5 * (a + b), sqrt(a * b)
    return a


def inside(angle, omega, *, gravity=G, arc=(), until=1.0):
    """A box with both lower corners on the inside of a circle, at an angle from its bottom."""
    stream = {"at": [D * sin(angle), -D * cos(angle)], "angle_deg": degrees(angle),
              "velocity": [omega * D * cos(angle), omega * D * sin(angle)],
              "omega": omega}  # fmt: skip
    return {"gravity": gravity, "particle": BOX, "surface": [ARC | dict(arc)], "stream": stream,
            "run": {"until": until}}  # fmt: skip


def run(tables, dt):
    """A run whose laws hold, and the changes of the sum of energy and losses at its steps, J."""
    recording = chutelab.simulate(tables, {"run.dt": dt}, engine="contact")
    assert not recording.laws
    return recording, np.ptp(recording.totals["entries"][:, 1])


def place(recording):
    """Where the box is as the run ends: the angle from the bottom, rad, and the distance, m."""
    x, y = recording.ends()[1]["position"][0]
    return atan2(x, -y), hypot(x, y)


def is_second_order(errors):
    """Half of the step, a quarter of the error."""
    return np.all(np.abs(errors[1:] / errors[:-1] - 0.25) < 0.06)


def hop(speed, dt):
    """J; what the chords of a step are faster than the arc, along the normal."""
    return M * (speed * speed * dt / (2.0 * R)) ** 2


@pytest.mark.parametrize("turn", [0.0, 20.0])
@pytest.mark.parametrize("angle", [0.4, 1.0])
def test_a_smooth_box_swings_as_a_physical_pendulum(angle, turn):
    """T = 2 pi / (rate agm(1, cos(angle / 2))); at 5/4 T it is at the bottom. The arc may turn."""
    period = 2.0 * pi / (RATE * mean(1.0, cos(0.5 * angle)))
    off, lost = np.transpose([
        (place(recording)[0], loss)
        for recording, loss in (
            run(inside(angle, 0.0, arc={"turn": turn}, until=1.25 * period), dt) for dt in STEPS
        )
    ])  # fmt: skip
    fastest = R * 2.0 * RATE * sin(0.5 * angle)
    assert is_second_order(off)
    assert np.abs(off[0]) < (RATE * STEPS[0]) ** 2 * 1.25 * 2.0 * pi
    assert np.all(lost < hop(fastest, STEPS) + M * (G * STEPS) ** 2)


@pytest.mark.parametrize("gravity", [0.0, G])
def test_a_fast_box_goes_round_and_round(gravity):
    """One turn takes 2 pi / (omega agm(1, sqrt(1 - 4 rate²/omega²))), three turns are run."""
    omega = 30.0
    slow = sqrt(1.0 - 4.0 * gravity / G * (RATE / omega) ** 2)
    until = 3.0 * 2.0 * pi / (omega * mean(1.0, slow))
    off, away, lost = np.transpose([
        (*place(recording), loss)
        for recording, loss in (
            run(inside(0.0, omega, gravity=gravity, until=until), dt) for dt in STEPS / 2.0
        )
    ])  # fmt: skip
    assert is_second_order(off)
    assert np.abs(off[0]) < (omega * STEPS[0] / 2.0) ** 2 * 6.0 * pi
    assert away == pytest.approx(D, abs=1e-6 * R)
    energy = 0.5 * INERTIA * omega**2
    assert np.all(lost < (1e-9 * energy if gravity == 0.0 else hop(R * omega, STEPS / 2.0)))


APART = 0.35
"""rad; half of the angle between two boxes on a rod."""


def pair(angle, *, arc=(), drop=0.0, until=1.0):
    """Two boxes as `inside`, joined by a rod, at APART on both sides of an angle; they may drop."""
    far = D - drop
    streams = [{"at": [far * sin(a), -far * cos(a)], "angle_deg": degrees(a),
                "velocity": [0.0, 0.0], "interact": True}
               for a in (angle - APART, angle + APART)]  # fmt: skip
    return {"particle": BOX, "surface": [ARC | dict(arc)], "stream": streams,
            "rod": [{"particle": 0, "other": 1}], "run": {"until": until}}  # fmt: skip


@pytest.mark.parametrize("angle", [0.4, 1.0])
def test_two_smooth_boxes_on_a_rod_swing_as_one_body(angle):
    """Their centre of mass is at D cos(APART): the rate is as much lower as its square root."""
    rate = RATE * sqrt(cos(APART))
    period = 2.0 * pi / (rate * mean(1.0, cos(0.5 * angle)))
    off = []
    for dt in STEPS:
        recording, loss = run(pair(angle, until=1.25 * period), dt)
        angles = [atan2(x, -y) for x, y in recording.ends()[1]["position"]]
        assert angles[1] - angles[0] == pytest.approx(2.0 * APART, abs=(RATE * dt) ** 2)
        off.append(0.5 * sum(angles))
        fastest = 2.0 * D * rate * sin(0.5 * angle)
        assert loss < 2.0 * (hop(fastest, dt) + M * (G * dt) ** 2)
    assert is_second_order(np.array(off))
    assert abs(off[0]) < (RATE * STEPS[0]) ** 2 * 1.25 * 2.0 * pi


@pytest.mark.parametrize(("angle", "mu"), [(0.1, 0.3), (0.3, 0.4), (0.2, 0.6)])
def test_two_boxes_that_drop_on_a_rough_arc_come_to_rest_on_their_rod(angle, mu):
    """Their height becomes heat, once. A gap at the end of the step that did not know of the rod's
    pull threw both to and fro: they gave back 2 J of 0.05.
    """
    for dt in STEPS[:2]:
        tables = pair(angle, arc={"friction": mu, "restitution": 0.0}, drop=0.005)
        recording, _ = run(tables, dt)
        heights = [states["position"][:, 1].sum() for states in recording.ends()]
        lost = recording.totals["entries"][:, 1:].sum(1)
        assert np.abs(recording.at(np.array([0.999])).velocity).max() < G * dt
        assert lost[-1] == pytest.approx(M * G * (heights[0] - heights[1]), rel=1e-4)
        assert (np.maximum.accumulate(lost) - lost).max() < M * (G * dt) ** 2


@pytest.mark.parametrize("mu", [0.1, 0.2])
def test_what_slides_down_a_slope_on_a_rod_loses_by_friction_alone(mu):
    """mu m g cos times way, though each step's impulses come in two halves with a hop between."""
    slope, until, dt = 0.5, 0.5, 1e-3
    down, up = np.array([cos(slope), -sin(slope)]), np.array([sin(slope), cos(slope)])
    streams = [{"at": (0.5 * H * up + x * down).tolist(), "velocity": [0.0, 0.0],
                "angle_deg": -degrees(slope), "interact": True} for x in (-0.1, 0.0)]  # fmt: skip
    line = {"name": "slope", "from": (-down).tolist(), "to": (2.0 * down).tolist()}
    tables = {"particle": BOX, "surface": [line | {"friction": mu}], "stream": streams,
              "rod": [{"particle": 0, "other": 1}], "run": {"until": until}}  # fmt: skip
    ledger = run(tables, dt)[0].ledger
    way = 0.5 * G * (sin(slope) - mu * cos(slope)) * until**2
    assert ledger.friction_loss == pytest.approx(2.0 * mu * M * G * cos(slope) * way, rel=1e-9)
    assert abs(ledger.restitution_loss) < 1e-9 * ledger.friction_loss


def slides(mu, omega, angle, until):
    """Angle and heat as both corners slide: forces at them from Newton's and Euler's laws.

    With S and T the sum and difference of both normal forces and sin b = W / 2 R, radially
    M D omega² + M g cos = S cos b - mu T sin b, along M D a = -M g sin - T sin b - mu S cos b,
    and INERTIA a = -M g D sin - mu R S.
    """
    sine = W / (2.0 * R)
    cosine = sqrt(1.0 - sine * sine)

    def rates(state):
        angle, omega, _ = state
        matrix = [[cosine, -mu * sine, 0.0], [mu * cosine, sine, M * D], [mu * R, 0.0, INERTIA]]
        down, along = G * cos(angle), -G * sin(angle)
        pressed = [M * (down + D * omega**2), M * along, M * D * along]
        s, _, a = np.linalg.solve(matrix, pressed)
        return np.array([omega, a, mu * s * R * omega])

    state, steps = np.array([angle, omega, 0.0]), 2000
    h = until / steps
    for _ in range(steps):
        one = rates(state)
        two = rates(state + 0.5 * h * one)
        three = rates(state + 0.5 * h * two)
        four = rates(state + h * three)
        state = state + h / 6.0 * (one + 2.0 * two + 2.0 * three + four)
    return state[0], state[2]


@pytest.mark.parametrize(("mu", "omega"), [(0.1, 8.0), (0.3, 8.0), (0.3, 25.0)])
def test_friction_takes_what_its_bound_and_the_way_say(mu, omega):
    until = 0.2
    angle, heat = slides(mu, omega, -1.0, until)
    off, wrong, lost = [], [], []
    for dt in STEPS / 2.0:
        recording, loss = run(inside(-1.0, omega, arc={"friction": mu}, until=until), dt)
        off.append((place(recording)[0] - angle + pi) % (2.0 * pi) - pi)
        wrong.append(recording.totals["entries"][-1, 2] - heat)
        lost.append(loss)
        assert np.all(np.diff(recording.totals["entries"][:, 2]) >= 0.0)
    assert is_second_order(np.array(off))
    assert np.abs(wrong[-1]) < 1e-4 * heat
    assert np.all(lost < hop(R * omega, STEPS / 2.0) + M * (G * STEPS) ** 2)


def states(tables):
    """States as the run ends for each step: place, velocity and angle."""
    found, end = [], np.array([tables["run"]["until"] * (1.0 - 1e-12)])
    for dt in STEPS:
        now = run(tables, dt)[0].at(end)
        found.append([*now.position[0, 0], *now.velocity[0, 0], now.angle[0, 0]])
    return np.array(found)


@pytest.mark.parametrize(
    ("shape", "arc"),
    [
        ("one corner", {}),
        ("octagon", {}),
        ("box", {"shake": {"by": [0.004, 0.002], "frequency": 3.0}, "restitution": 0.0}),
        ("box", {"hinge": [0.0, 0.1], "mass": 0.5, "from_deg": 180.0}),
    ],
)
def test_what_no_formula_gives_converges_at_order_two(shape, arc):
    """One corner on the arc, polygons, arcs that shake and swing."""
    tables = inside(0.9, 0.0, arc=arc, until=0.4)
    if shape == "one corner":
        # Its right lower corner is on the arc, at 60 degrees below the horizontal.
        angle = -0.25
        c, s = cos(angle), sin(angle)
        x = R * cos(pi / 3.0) - 0.5 * (c * W + s * H)
        y = -R * sin(pi / 3.0) - 0.5 * (s * W - c * H)
        tables["stream"] |= {"at": [x, y], "angle_deg": degrees(angle)}
        tables["run"] = {"until": 0.04}
    if shape == "octagon":
        r, turn = 0.02, pi / 8.0
        points = [[r * cos((2 * k + 1) * turn), r * sin((2 * k + 1) * turn)] for k in range(8)]
        tables["particle"] = {**BOX, "shape": "polygon", "points": points}
        del tables["particle"]["size"]
        far = sqrt(R * R - (r * sin(turn)) ** 2) - r * cos(turn)
        tables["stream"]["at"] = [far * sin(0.9), -far * cos(0.9)]
    first, second, third = states(tables)
    ratio = np.abs(third - second).max() / np.abs(second - first).max()
    assert ratio < 0.31


@pytest.mark.parametrize("way", [0.15, 0.18, 0.21, 0.24, 0.27, 0.3, 0.33, 0.36])
def test_a_box_slides_through_a_channel_of_pieces_and_loses_nothing(way):
    """Two slopes of 45 degrees that continue an arc: corners pass both joints, again and again."""
    side, top = sqrt(0.5), sqrt(0.5) * (R + 0.5)
    low, smooth = side * R, {"friction": 0.0, "restitution": 0.0}
    slopes = [
        {"name": "left", "from": [-top, side * (0.5 - R)], "to": [-low, -low], **smooth},
        {"name": "right", "from": [low, -low], "to": [top, side * (0.5 - R)], **smooth},
    ]
    box = [side * (0.5 * H - R - way), side * (0.5 * H - R + way)]
    tables = {
        "particle": BOX, "surface": [*slopes, ARC | {"from_deg": 225.0, "to_deg": 315.0}],
        "stream": {"at": box, "velocity": [0.0, 0.0], "angle_deg": -45.0},
        "run": {"until": 1.2},
    }  # fmt: skip
    fastest = sqrt(2.0 * G * (side * way + (1.0 - side) * R))
    for dt in STEPS:
        assert run(tables, dt)[1] < hop(fastest, dt) + M * (G * dt) ** 2


@pytest.mark.parametrize("dt", STEPS)
def test_a_thin_box_that_slides_into_an_arc_by_chance_gets_no_energy(dt):
    """What losses give back is below what a law of the run allows, by far; more is told."""
    recording = chutelab.simulate(bodies(166, both=False), {"run.dt": dt}, engine="contact")
    losses = recording.totals["entries"][:, 1]
    turned = recording.ledger.turned_over
    assert (np.maximum.accumulate(losses) - losses).max() < 1e-4 * turned
    for fall, told in ((0.005, False), (0.03, True)):
        totals = recording.totals.copy()
        totals["entries"][-1, 1] = losses.max() - fall * turned
        assert [one.law for one in replace(recording, totals=totals).laws] == [LOSSES] * told
