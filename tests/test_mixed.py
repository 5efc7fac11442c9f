"""Boxes and polygons with all else of a machine, by closed forms; and Pymunk at its order."""

from dataclasses import replace
from math import atan2, cos, pi, radians, sin, sqrt, tan

import numpy as np
import pytest

import chutelab
from chutelab.results.laws import judge
from machines import face
from shared import seeds, some
from test_hinge import drawn as hung
from test_hinge import sound
from test_joints import machine_of_joints

pytest.importorskip("scipy")
from scipy.integrate import solve_ivp
from scipy.optimize import brentq
from scipy.special import ellipk

G, M, W, H = 9.81, 0.1, 0.04, 0.02
"""m/s², kg, and width and height of the box, m."""
TURNING = (W * W + H * H) / 12.0
"""I / m of the box about its centre, m²."""
BOX = {"shape": "box", "size": [W, H], "mass": M, "spin": True}
ROUND = {"name": "ball", "radius": 0.01, "spin": True}
LEVER = {"name": "lever", "from": [-0.3, 0.0], "to": [0.3, 0.0], "hinge": [0.0, 0.0], "mass": 0.1}


def seesaw(left, right, end=0.3, dt=1e-3, engine="contact"):
    """Run two boxes on a see-saw, so many m left and right; the right one is heavier."""
    row = {"velocity": [0.0, 0.0], "interact": True, "friction": 2.0, "restitution": 0.0}
    return sound(chutelab.simulate({
        "particle": [{**BOX, "name": "light"}, {**BOX, "name": "heavy", "mass": 2.0 * M}],
        "surface": [{**LEVER, "friction": 2.0, "restitution": 0.0}],
        "stream": [{"particle": "light", "at": [-left, 0.5 * H], **row},
                   {"particle": "heavy", "at": [right, 0.5 * H], **row}],
        "run": {"until": end, "dt": dt},
    }, engine=engine))  # fmt: skip


def test_boxes_in_balance_on_a_see_saw_stay_so():
    """m l = 2 m l / 2."""
    assert np.abs(seesaw(0.2, 0.1).swings["angle"]).max() < 1e-9


def test_a_column_on_a_hinged_plate_is_solved_and_gets_no_energy():
    """Solves that end at their cap give none: impulses do no work on what they leave.

    m v dv + I w dw <= 0 with what moves before and after.
    """
    plate = {**LEVER, "friction": 0.5, "restitution": 0.0, "mass": 2.0, "spring": 20.0,
             "damper": 0.5}  # fmt: skip
    row = {"count": 25, "at": [0.0, 0.51 * H], "to": [0.0, 24.87 * H], "velocity": [0.0, 0.0],
           "interact": True, "friction": 0.5, "restitution": 0.0}  # fmt: skip
    scene = {"particle": {**BOX, "mass": 0.01}, "surface": [plate], "stream": row,
             "run": {"until": 0.2}}  # fmt: skip
    run = sound(chutelab.simulate(scene, engine="contact"))
    assert run.gained < 1e-17
    assert run.unsolved.max() < 1.5e-5


def test_boxes_on_a_see_saw_turn_it_as_one_rigid_body():
    """(I + sum m (l² + h² / 4 + I_box / m)) a = -sum m g (l cos - h / 2 sin), order 2."""
    left, right, end = 0.2, 0.15, 0.3
    inertia = 0.1 * 0.6**2 / 12.0 + sum(
        m * (x * x + 0.25 * H * H + TURNING) for m, x in ((M, left), (2.0 * M, right))
    )

    def rates(_, y):
        places = ((M, -left), (2.0 * M, right))
        return y[1], -sum(
            m * G * (x * cos(y[0]) - 0.5 * H * sin(y[0])) for m, x in places
        ) / inertia  # fmt: skip

    exact = solve_ivp(rates, (0.0, end), (0.0, 0.0), rtol=1e-12, atol=1e-14).y[0, -1]
    off = [abs(seesaw(left, right, end, dt).pose("lever", [end])[0, 2] - exact)
           for dt in (2e-3, 1e-3)]  # fmt: skip
    assert off[1] < 5e-6
    assert off[1] < 0.3 * off[0]
    theirs = chutelab.simulate(seesaw(left, right, end).machine.scene, engine="pymunk")
    assert theirs.pose("lever", [end])[0, 2] == pytest.approx(exact, abs=2e-4)
    assert not theirs.laws
    assert abs(theirs.ledger.residual) < 1e-3 * theirs.ledger.turned_over


@pytest.mark.parametrize("mu", [0.0, 0.3])
def test_a_box_that_pushes_a_flap_keeps_momentum_about_the_hinge(mu):
    """m r × dv + I_box dw = -I dθ'; without friction J = (1 + e) v / (1/m + x²/I_box + l²/I)."""
    e, inertia, v = 0.6, 0.01, 3.0
    scene = {
        "gravity": 0.0, "particle": BOX,
        "surface": [{"name": "flap", "from": [0.0, 0.0], "to": [0.0, -0.4], "hinge": [0.0, 0.0],
                     "inertia": inertia, "spring": 2.0, "restitution": e, "friction": mu}],
        "stream": {"at": [-0.3, -0.3], "velocity": [v, 0.0], "omega": 7.0},
        "run": {"until": 0.15},
    }  # fmt: skip
    recording = sound(chutelab.simulate(scene))
    (blow,) = recording.select("impact")
    (x, y), t = blow["position"], blow["t"]
    swing = recording.swings
    change = swing["rate"][swing["t"] == t].max()
    du, dv = blow["velocity_after"] - blow["velocity_before"]
    turned = blow["omega_after"] - blow["omega_before"]
    own = M * (x * dv - y * du) + M * TURNING * turned
    assert own == pytest.approx(-inertia * change, rel=1e-12)
    corners = [(a * 0.5 * W, b * 0.5 * H) for a in (-1, 1) for b in (-1, 1)]
    angle = 7.0 * t
    px, py = max((cos(angle) * a - sin(angle) * b, sin(angle) * a + cos(angle) * b)
                 for a, b in corners)  # fmt: skip
    assert x + px == pytest.approx(0.0, abs=1e-14)
    if mu:
        return
    # The corner's lever about the centre is py, about the hinge y + py.
    closing = v - 7.0 * py
    impulse = (1.0 + e) * closing / (1.0 / M + py**2 / (M * TURNING) + (y + py) ** 2 / inertia)
    assert blow["normal_impulse"] == pytest.approx(impulse, rel=1e-12)
    assert change == pytest.approx(-impulse * (y + py) / inertia, rel=1e-12)
    off = []
    for dt in (1e-3, 1e-4):
        other = chutelab.simulate(scene, {"run.dt": dt}, engine="pymunk")
        assert not other.laws
        assert abs(other.ledger.residual) < 3e-3 * other.ledger.turned_over
        off.append(np.abs(other.ends()[1]["velocity"] - recording.ends()[1]["velocity"]).max())
    assert off[1] < max(0.3 * off[0], 1e-3)


def a_shape(random, size):
    """Return a box or polygon as drawn, of about that size, m."""
    if random.random() < 0.6:
        return {"shape": "box", "size": random.uniform(0.6 * size, 1.5 * size, 2).tolist()}
    count = int(random.integers(3, 9))
    around = (np.arange(count) + random.uniform(-0.3, 0.3, count)) * 2.0 * pi / count
    points = np.stack([np.cos(around), np.sin(around)], axis=1)
    return {"shape": "polygon", "points": (points * random.uniform(0.4, 0.9) * size).tolist()}


def boxes_among_hinges(seed):
    random, scene = np.random.default_rng(seed + 10_000), hung(seed)
    stream = {**scene["stream"], "count": min(scene["stream"]["count"], 10),
              "restitution": float(random.choice([0.0, 0.3, 0.7])),
              "friction": float(random.uniform(0.0, 1.0))}  # fmt: skip
    kind = {"mass": 0.008, **a_shape(random, 0.02), "spin": True}
    return {**scene, "particle": kind, "stream": stream}


@pytest.mark.parametrize("seed", seeds(4, 60))
def test_random_boxes_among_random_hinges_keep_the_laws(seed):
    sound(chutelab.simulate(boxes_among_hinges(seed), engine="contact"))


@pytest.mark.parametrize(("seed", "end"), [(27, 0.26), (53, 0.5)])
def test_what_contacts_give_a_hinge_is_its_energy(seed, end):
    """ΔE is the work of all contacts, but for the rounding of each step.

    27: a box strikes a board at two places and turns it on to its stop, which takes that after both
    have been told. 53: boxes that lie in a sprung bowl take 5,000 sweeps a step. The hinge's speed
    is what it was before, less the sum of J l / I; added up change by change, it would be off by
    each one's rounding.
    """
    scene = {**boxes_among_hinges(seed), "run": {"until": end}}
    recording = chutelab.simulate(scene, engine="contact")
    assert abs(recording.ledger.residual) < 1e-14 * recording.ledger.turned_over


# Joints


def swing(kind, dt, off, at, size, engine="contact", quarters=1.0):
    """Run a box that is let go level, a joint of which is in the origin, for a quarter period.

    `off` is how far its centre is from there; I = m off², and m / 12 (w² + h²) more if it turns.
    """
    turning = off * off + (sum(side * side for side in size) / 12.0 if kind == "pin" else 0.0)
    period = 4.0 * ellipk(0.5) * sqrt(turning / (G * off))
    return chutelab.simulate({
        "particle": {**BOX, "size": size}, "stream": {"at": at, "velocity": [0.0, 0.0]},
        kind: [{"from": [0.0, 0.0]}], "run": {"until": 0.25 * quarters * period, "dt": dt},
    }, engine=engine)  # fmt: skip


@pytest.mark.parametrize("kind", ["pin", "rod", "string"])
def test_a_box_on_a_joint_is_a_pendulum(kind):
    """On a pin T = 4 K(1/2) sqrt(I / m g d); on a rod or string it does not turn."""
    off, size = (0.09, [0.2, 0.02]) if kind == "pin" else (0.3, [W, H])
    errors = []
    for dt in (2e-3, 1e-3):
        run = swing(kind, dt, off, [off, 0.0], size)
        assert not run.laws
        knots = run.track(0)
        assert np.hypot(*knots["position"].T) == pytest.approx(off, rel=1e-13)
        assert abs(run.ledger.residual) < 1e-13 * run.ledger.turned_over
        assert (abs(knots["omega"]).max() > 1.0) == (kind == "pin")
        x, y = knots[-1]["position"]
        errors.append(abs(atan2(x, -y)))
    assert errors[1] < 3e-5
    assert errors[0] / errors[1] == pytest.approx(4.0, rel=0.15)
    theirs = swing(kind, 1e-3, off, [off, 0.0], size, engine="pymunk")
    assert abs(atan2(*(theirs.track(0)[-1]["position"] * (1.0, -1.0)))) < 2e-4


def test_two_boxes_on_pins_are_a_double_physical_pendulum():
    """Its equations, of two equal bars pinned end to end and let go level; order 2.

    Lagrange's, with angles a, b from the vertical, l the length and J = l²/12 + w²/12 of each:
    (J + l²/4 + l²) a'' + l²/2 cos(a - b) b'' = -l²/2 sin(a - b) b'² - 3/2 g l sin a,
    (J + l²/4) b'' + l²/2 cos(a - b) a'' = l²/2 sin(a - b) a'² - g l / 2 sin b.
    """
    length, wide, end = 0.2, 0.02, 0.5
    own = (length**2 + wide**2) / 12.0 + 0.25 * length**2

    def change(_, state):
        a, b, u, v = state
        across = 0.5 * length**2 * cos(a - b)
        force = 0.5 * length**2 * sin(a - b)
        matrix = [[own + length**2, across], [across, own]]
        right = [
            -force * v * v - 1.5 * G * length * sin(a),
            force * u * u - 0.5 * G * length * sin(b),
        ]
        return u, v, *np.linalg.solve(matrix, right)

    a, b, *_ = solve_ivp(
        change, (0.0, end), (0.5 * pi, 0.5 * pi, 0.0, 0.0), rtol=1e-12, atol=1e-12
    ).y[:, -1]
    one = 0.5 * length * np.array([sin(a), -cos(a)])
    exact = np.array([one, 2.0 * one + 0.5 * length * np.array([sin(b), -cos(b)])])

    def run(dt, engine="contact"):
        row = {"at": [0.1, 0.0], "to": [0.3, 0.0], "velocity": [0.0, 0.0], "count": 2}
        pins = [{"from": [0.0, 0.0]}, {"from": [length, 0.0], "particle": 0, "other": 1}]
        return chutelab.simulate({
            "particle": {**BOX, "size": [length, wide]}, "stream": {**row, "interact": True},
            "pin": pins, "run": {"until": end, "dt": dt},
        }, engine=engine)  # fmt: skip

    errors = []
    for dt in (1e-3, 5e-4):
        recording = run(dt)
        assert not recording.laws
        assert abs(recording.ledger.residual) < 1e-12 * recording.ledger.turned_over
        errors.append(np.abs(recording.ends()[1]["position"] - exact).max())
    assert errors[1] < 1e-4
    assert errors[0] / errors[1] == pytest.approx(4.0, rel=0.15)
    assert np.abs(run(5e-4, "pymunk").ends()[1]["position"] - exact).max() < 1e-3


# What pins take by Chipmunk's order is told by the residual.
@pytest.mark.filterwarnings("ignore:LAW BROKEN, the ledger closes")
@pytest.mark.parametrize(
    ("kind", "mu"), some([(kind, mu) for kind in ("pin", "rod", "string") for mu in (0.0, 0.4)])
)
def test_a_ball_strikes_a_box_on_a_joint(kind, mu):
    """On a pin momentum about it is kept; without friction J = (1 + e) v / (1/m_ball + l²/I)."""
    e, mass, lever = 0.5, 0.05, 0.15
    bar = {**BOX, "name": "bar", "size": [0.02, 0.2]}
    row = {"velocity": [0.0, 0.0], "interact": True, "restitution": e, "friction": mu}
    scene = {
        "gravity": 0.0, "particle": [bar, {**ROUND, "mass": mass}],
        "stream": [{"particle": "bar", "at": [0.0, -0.09], **row},
                   {"particle": "ball", "at": [-0.2, -lever], "velocity": [1.0, 0.0]}],
        kind: [{"from": [0.0, 0.0], "particle": 0}], "run": {"until": 0.3},
    }  # fmt: skip
    run = sound(chutelab.simulate(scene))
    blow = run.events[run.events["kind"] == chutelab.results.Kind.COLLISION][0]
    if kind == "pin":
        inertia = M * (0.02**2 + 0.2**2) / 12.0 + M * 0.09**2
        impulse = (1.0 + e) / (1.0 / mass + lever**2 / inertia)
        assert mu or abs(blow["normal_impulse"]) == pytest.approx(impulse, rel=1e-12)
        bar, ball = (run.track(i)[run.track(i)["t"] == blow["t"]][-1] for i in (0, 1))
        (x, y), (u, v) = ball["position"], ball["velocity"]
        turning = inertia * bar["omega"] + 0.5 * mass * 0.01**2 * ball["omega"]
        assert turning + mass * (x * v - y * u) == pytest.approx(mass * lever, rel=1e-12)
    off = [
        np.abs(chutelab.simulate(scene, {"run.dt": dt}, engine="pymunk").ends()[1]["velocity"]
               - run.ends()[1]["velocity"]).max()
        for dt in (1e-3, 1e-4)
    ]  # fmt: skip
    assert off[1] < max(0.2 * off[0], 1e-6)


@pytest.mark.parametrize("seed", seeds(6, 60))
def test_random_boxes_on_random_joints_keep_the_laws(seed):
    random, scene = np.random.default_rng(seed + 5_000), machine_of_joints(seed)
    kind = {"mass": 0.1, **a_shape(random, 0.03), "spin": True}
    run = chutelab.simulate({**scene, "particle": kind}, engine="contact")
    assert not run.laws
    own = run.ledger
    play = own.turned_over + max(abs(e) for e in (*own.potential, *own.spring))
    assert abs(own.residual) < 1e-9 * play


@pytest.mark.parametrize(
    ("mu", "kind"), some([(mu, kind) for mu in (0.0, 0.5) for kind in ("pin", "rod", "string")], 4)
)
def test_a_ball_strikes_a_box_that_lies_on_a_hung_plank(kind, mu):
    """Sum of m v² / 2 + I w² / 2 + m g y is less by what is booked as lost."""
    shapes = [{**BOX, "name": "plank", "size": [0.2, 0.02]}, {**BOX, "name": "box", "mass": 0.05},
              {**ROUND, "mass": 0.02}]  # fmt: skip
    row = {"velocity": [0.0, 0.0], "friction": mu, "restitution": 0.5, "interact": True}
    run = chutelab.simulate({
        "particle": shapes, kind: [{"particle": 0, "from": [0.03, 0.5]}],
        "surface": [{"name": "far", "from": [-5.0, -9.0], "to": [5.0, -9.0]}],
        "stream": [{"particle": "plank", "at": [0.0, 0.0], **row},
                   {"particle": "box", "at": [0.0, 0.02], **row},
                   {"particle": "ball", "at": [0.013, 0.2], **row}],
        "run": {"until": 0.6},
    }, engine="contact")  # fmt: skip
    turning = [0.1 * (0.2**2 + 0.02**2) / 12.0, 0.05 * TURNING, 0.5 * 0.02 * 0.01**2]

    def energy(n):
        states = [run.track(i)[n] for i in range(3)]
        return sum(
            m * (0.5 * (one["velocity"] ** 2).sum() + G * one["position"][1])
            + 0.5 * inertia * one["omega"] ** 2
            for m, inertia, one in zip((0.1, 0.05, 0.02), turning, states, strict=True)
        )

    lost = run.ledger.restitution_loss + run.ledger.friction_loss
    assert not run.laws
    assert energy(0) - energy(-1) == pytest.approx(lost, rel=1e-9)


# Surfaces that are solid from one side


def thrown_box(height, omega=0.0, dt=1e-3):
    """A box thrown so high, m, from 0.3 m below a line that lets it through from there."""
    line = {"name": "line", "from": [-0.5, 0.0], "to": [0.5, 0.0], "passes": "up"}
    return {
        "particle": BOX, "surface": [{**line, "restitution": 0.0, "friction": 0.3}],
        "stream": {"at": [0.1, -0.3], "velocity": [0.0, sqrt(2.0 * G * height)], "omega": omega},
        "run": {"until": 0.9, "dt": dt},
    }  # fmt: skip


@pytest.mark.parametrize("omega", some([-8.0, 0.0, 3.0]))
def test_a_box_thrown_through_a_line_comes_down_on_its_lowest_corner(omega):
    """Where -0.3 + v t - g t²/2 = w/2 |sin| + h/2 |cos| of the angle omega t, as it falls."""
    v = sqrt(2.0 * G * 0.6)

    def low(t):
        reach = 0.5 * W * abs(sin(omega * t)) + 0.5 * H * abs(cos(omega * t))
        return -0.3 + v * t - 0.5 * G * t * t - reach

    recording = sound(chutelab.simulate(thrown_box(0.6, omega)))
    t = recording.select("impact")["t"][0]
    assert t == pytest.approx(brentq(low, v / G, 0.9, xtol=1e-15), abs=1e-12)
    hits = chutelab.simulate(thrown_box(0.6, omega, 2.5e-4), engine="pymunk").select("impact")
    assert hits["t"][0] == pytest.approx(t, abs=1e-3)


def test_a_box_lies_on_such_a_line_only_if_all_of_it_has_come_through():
    for more in (-1e-8, 1e-8):
        recording = chutelab.simulate(thrown_box(0.3 + 0.5 * H + more))
        assert not recording.laws
        y = recording.at(np.array([0.6])).position[0, 0, 1]
        assert y == pytest.approx(0.5 * H, rel=1e-3) if more > 0.0 else y < -0.5


def one_sided(seed):
    """Boxes or polygons thrown among lines and bows that are solid from one side, some moving."""
    random = np.random.default_rng(seed + 777)
    walls = [[-0.6, 0.6], [-0.6, -0.4], [0.6, -0.4], [0.6, 0.6]]
    surfaces = [{"name": "box", "points": walls}]
    for n in range(3):
        x, y = 0.35 * (n - 1), random.uniform(-0.2, 0.2)
        run = np.sort(random.uniform(-0.15, 0.15, int(random.integers(2, 5))))
        off, kind = random.uniform(-0.05, 0.05, len(run)), random.integers(3)
        own = {"points": [[x + a, y + b] for a, b in zip(run, off, strict=True)],
               "passes": str(random.choice(["up", "down"]))}  # fmt: skip
        if kind == 0:
            own = {"points": [[x + b, y + a] for a, b in zip(run, off, strict=True)],
                   "passes": str(random.choice(["left", "right"]))}  # fmt: skip
        elif kind == 1:
            own = {"center": [x, y], "radius": random.uniform(0.05, 0.12),
                   "from_deg": 20.0, "to_deg": 20.0 + random.uniform(60.0, 300.0),
                   "passes": str(random.choice(["in", "out"]))}  # fmt: skip
        if random.random() < 0.25:
            by = random.uniform(-0.01, 0.01, 2).tolist()
            own["shake"] = {"by": by, "frequency": random.uniform(1.0, 8.0)}
        surfaces.append({"name": f"s{n}", **own})
    pair = {"restitution": float(random.choice([0.0, 0.4])), "friction": random.uniform(0.0, 1.0)}
    stream = {"fill": [[-0.45, 0.25], [0.45, 0.55]], "count": int(random.integers(2, 10)),
              "velocity": random.uniform(-1.0, 1.0, 2).tolist(), "omega": random.uniform(-10, 10),
              "interact": True}  # fmt: skip
    return {
        "particle": {"mass": 0.05, **a_shape(random, 0.035), "spin": True},
        "surface": [{**one, **pair} for one in surfaces], "stream": {**stream, **pair},
        "run": {"until": 1.2},
    }  # fmt: skip


@pytest.mark.parametrize("seed", seeds(5, 40))
def test_random_boxes_among_what_lets_them_through_keep_the_laws(seed):
    sound(chutelab.simulate(one_sided(seed), engine="contact"))


# What rolls on a box


@pytest.mark.parametrize("drop", some([0.01, 0.0]))
def test_a_disk_rolls_on_a_box_as_on_a_floor(drop):
    """Rolling friction c slows it down by 2/3 c g; a blow of m v by as much as v / g of that."""
    r, c, v, end = 0.01, 0.1, 0.8, 0.5
    slab = {"name": "slab", "shape": "box", "size": [1.0, H], "mass": 50.0, "spin": True}
    row = {"interact": True, "friction": 0.6, "restitution": 0.0}
    scene = {
        "particle": [slab, {**ROUND, "mass": 0.01, "rolling_friction": c}],
        "surface": [{"name": "floor", "from": [-1.0, 0.0], "to": [1.0, 0.0], "friction": 0.6}],
        "stream": [{"particle": "slab", "at": [0.0, 0.5 * H], "velocity": [0.0, 0.0], **row},
                   {"particle": "ball", "at": [-0.4, H + r + drop], "velocity": [v, 0.0],
                    "omega": -v / r}],
        "run": {"until": end},
    }  # fmt: skip
    last = sound(chutelab.simulate(scene)).ends()[1][1]
    # Falling and resting, it is pressed by its weight times all of the time.
    assert last["velocity"][0] == pytest.approx(v - 2.0 / 3.0 * c * G * end, abs=1e-8)
    assert last["omega"] == pytest.approx(-last["velocity"][0] / r, abs=1e-6)
    if drop == 0.0:
        theirs = [chutelab.simulate(scene, {"run.dt": dt}, engine="pymunk").ends()[1][1]
                  for dt in (1e-3, 2.5e-4)]  # fmt: skip
        off = [abs(one["velocity"][0] - last["velocity"][0]) for one in theirs]
        assert off[1] < 0.4 * off[0]


# The laws


def lying(surface, at):
    """Run a box that lies on a surface."""
    scene = {"particle": BOX, "surface": [{"name": "bed", **surface, "friction": 0.5}],
             "stream": {"at": at, "velocity": [0.0, 0.0]}, "run": {"until": 0.2}}  # fmt: skip
    return sound(chutelab.simulate(scene))


BED = {"from": [-1.0, 0.0], "to": [1.0, 0.0]}
BOW = {"center": [0.0, -0.5], "radius": 0.5, "from_deg": 30.0, "to_deg": 150.0}
BOWL = {"center": [0.0, 0.5], "radius": 0.5, "from_deg": -150.0, "to_deg": -30.0}


@pytest.mark.parametrize("angle", [0.02, 0.3, 0.5])
@pytest.mark.parametrize(
    ("surface", "y", "deep"),
    [(BED, 0.5 * H, lambda x, y: -y), (BOW, 0.5 * H, lambda x, y: 0.5 - np.hypot(x, y + 0.5)),
     (BOWL, 0.5 + 0.5 * H - sqrt(0.25 - 0.25 * W * W), lambda x, y: np.hypot(x, y - 0.5) - 0.5)],
)  # fmt: skip
def test_a_corner_that_has_gone_through_a_wall_is_told(surface, y, deep, angle):
    """A fault: a box that lies flat is said to be turned. The circle inside it is where it was."""
    run = lying(surface, [0.0, y])
    told = judge(replace(run, angle=run.angle + angle * (run.knots["t"] > 0.05)))
    u, v = 0.5 * W * np.array([1, 1, -1, -1]), 0.5 * H * np.array([1, -1, 1, -1])
    x, y = run.track(0)[-1]["position"]
    corners = x + u * cos(angle) - v * sin(angle), y + u * sin(angle) + v * cos(angle)
    least = deep(*corners).max()
    # A twentieth of its largest radius is allowed in a crowd.
    assert bool(told) == (least > 0.05 * np.hypot(0.5 * W, 0.5 * H))
    assert [(one.law, one.amount) for one in told] == [
        ("nothing inside a surface", pytest.approx(least, abs=1e-6))
    ] * len(told)


# Surfaces


def test_a_corner_that_meets_a_surface_just_inside_its_end_is_struck():
    """The centre is beyond that end: J = (1 + e) v / (1/m + x²/I), x its way to the corner."""
    e, inside = 0.5, 0.0015
    points = [(-0.012, -0.008), (0.012, 0.006), (0.0, 0.014), (-0.014, 0.004)]
    scene = {
        "gravity": 0.0, "particle": {"shape": "polygon", "points": points, "mass": M, "spin": True},
        "surface": [{"name": "shelf", "from": [-0.1, 0.0], "to": [0.0, 0.0], "restitution": e,
                     "friction": 0.0}],
        "stream": {"at": [0.0, 0.05], "velocity": [0.0, -1.0]}, "run": {"until": 0.1},
    }  # fmt: skip
    outline = chutelab.load(scene).particles[0].outline
    low = min(outline, key=lambda corner: corner[1])
    scene["stream"]["at"][0] = -inside - low[0]
    assert scene["stream"]["at"][0] > 0.005
    recording = sound(chutelab.simulate(scene))
    blow = recording.select("impact")[0]
    turning = chutelab.machine.build(chutelab.load(scene)).particle.inertia
    impulse = (1.0 + e) / (1.0 / M + low[0] ** 2 / float(np.max(turning)))
    assert blow["normal_impulse"] == pytest.approx(impulse, rel=1e-12)


def bowled(seed):
    """A box or polygon in a bowl, whose face takes it over the end, which is at rest or moves."""
    random = np.random.default_rng(seed)
    kind, end = {"mass": 0.01, **a_shape(random, 0.02), "spin": True}, random.uniform(300.0, 360.0)
    bowl = {"name": "bowl", "center": [0.0, 0.0], "radius": 0.05, "from_deg": 180.0, "to_deg": end,
            "speed": random.uniform(0.0, 1.0), "restitution": 0.3,
            "friction": random.uniform(0.0, 1.0)}  # fmt: skip
    if random.random() < 0.5:
        by = random.uniform(-0.005, 0.005, 2).tolist()
        bowl["shake"] = {"by": by, "frequency": random.uniform(2.0, 15.0)}
    elif random.random() < 0.5:
        bowl["turn"] = random.uniform(-100.0, 100.0)
        bowl["pivot"] = random.uniform(-0.02, 0.02, 2).tolist()
    place = 0.03 * np.array([cos(a := np.radians(end - 25.0)), sin(a)])
    stream = {"at": place.tolist(), "velocity": random.uniform(-1.0, 1.0, 2).tolist(),
              "angle_deg": random.uniform(-180.0, 180.0),
              "omega": random.uniform(-10.0, 10.0)}  # fmt: skip
    return {"particle": kind, "surface": [bowl], "stream": stream, "run": {"until": 0.5}}


@pytest.mark.parametrize("seed", [115, 125, 260, 274, 547])
def test_a_corner_that_leaves_over_the_end_of_a_bowl_goes_on_along_its_edge(seed):
    sound(chutelab.simulate(bowled(seed), engine="contact"))


def test_a_box_that_turns_and_waits_for_its_place_is_released_as_it_is_written():
    """A lid goes down through its place: it is free when that is below h / 2."""
    lid = {"name": "lid", "from": [-0.1, 0.0], "to": [0.1, 0.0],
             "travel": {"to": [-0.1, -0.1], "at": 0.0, "in": 0.2}}  # fmt: skip
    run = chutelab.simulate({
        "particle": BOX, "surface": [lid], "run": {"until": 0.2},
        "stream": {"at": [0.0, 0.0], "velocity": [0.0, 0.0], "omega": 8.0},
    }, engine="contact")  # fmt: skip
    released = run.track(0)["t"][0]
    here, before = run.pose("lid", [released, released - 1e-3])[:, 1]
    assert here <= -0.5 * H < before


@pytest.mark.parametrize("gap", [0.0, 1e-10, 8e-9, 1e-6])
def test_a_blow_just_after_a_step_begins_keeps_energy_beside_a_string(gap):
    """What a cube brings at v is all that is there and all that is lost: the string is slack.

    m v² / 2 + m g sum y before = sum (m (v² + g y) + I w²) / 2 after + losses.
    """
    fast, size, mass = 10.0, 0.02, 0.1
    row = {"velocity": [0.0, 0.0], "interact": True, "restitution": 0.5, "friction": 0.5}
    places = [[0.0, 0.01], [-0.05, 0.03], [0.03, 0.03 + gap]]
    run = sound(chutelab.simulate({
        "particle": [{"name": name, "shape": "box", "size": [w, size], "mass": mass, "spin": True}
                     for name, w in (("plank", 0.2), ("cube", size))],
        "surface": [{"name": "floor", "from": [-1.0, 0.0], "to": [1.0, 0.0], "restitution": 0.5}],
        "stream": [{"particle": "cube" if k else "plank", "at": at, **row,
                    "velocity": [0.0, -fast if k == 2 else 0.0]} for k, at in enumerate(places)],
        "string": [{"particle": 1, "from": [-0.05, 0.3], "length": 0.5}],
        "run": {"until": 0.01},
    }))  # fmt: skip
    ends = np.array([run.track(i)[-1] for i in range(3)])
    v, w, lost = ends["velocity"], ends["omega"], run.ledger
    turning = mass * (np.array([0.2, size, size]) ** 2 + size**2) / 12.0
    left = (
        0.5 * (mass * (v**2).sum() + (turning * w**2).sum())
        + mass * G * ends["position"][:, 1].sum()
    )
    brought = 0.5 * mass * fast**2 + mass * G * np.array(places)[:, 1].sum()
    assert lost.restitution_loss > 0.4 * brought
    assert left + lost.restitution_loss + lost.friction_loss == pytest.approx(brought, rel=1e-9)


def slides(s, v, omega, end, r, m):
    """Return s, v, the angle and ω of a ball that slides along a face of a box that turns.

    It is D = H/2 + r from the box's centre along the normal, s along the face. As
    (D n + s t)'' n = λ (1/m + 1/M) and ω' = λ s / I, with n' = ω t and t' = -ω n, a force
    λ = -(D ω² + 2 s' ω) / (1/m + 1/M + s²/I) keeps them together, and s'' = s ω² - D ω'.
    """

    def rates(_, y):
        s, v, _, omega = y
        force = -(d * omega**2 + 2.0 * v * omega) / (1.0 / m + 1.0 / M + s * s / (M * TURNING))
        assert force > 0.0
        faster = force * s / (M * TURNING)
        return [v, s * omega**2 - d * faster, omega, faster]

    d = 0.5 * H + r
    return solve_ivp(rates, (0.0, end), [s, v, 0.0, omega], rtol=1e-11, atol=1e-13).y[:, -1]


def test_what_slides_along_a_turning_box_stays_on_it():
    """At order 2: its acceleration 2 s' ω of some g is a load, not a blow at each step.

    Both fall, which changes nothing between them.
    """
    s, v, omega, end, r, m = 0.015, -2.5, 15.0, 8e-3, 0.007, 0.024
    d, row = 0.5 * H + r, {"interact": True, "friction": 0.0, "restitution": 0.5}
    scene = {
        "particle": [{**BOX, "name": "box"}, {**ROUND, "radius": r, "mass": m}],
        "stream": [
            {"particle": "box", "at": [0.0, 0.0], "velocity": [0.0, 0.0], "omega": omega, **row},
            {"particle": "ball", "at": [-s, d], "velocity": [-d * omega - v, -s * omega], **row},
        ],
    }
    s, _, angle, omega = slides(s, v, omega, end, r, m)
    place = [-d * sin(angle) - s * cos(angle), d * cos(angle) - s * sin(angle)]
    errors = []
    for dt in (2e-4, 1e-4):
        found = chutelab.simulate({**scene, "run": {"until": end, "dt": dt}}, engine="contact")
        last = sound(found).ends()[1]
        away = np.abs(last["position"][1] - last["position"][0] - place).max()
        errors.append([away / d, abs(last["omega"][0] / omega - 1.0)])
    rough, fine = np.array(errors)
    assert (rough < [3e-5, 1e-4]).all()
    assert (fine < 0.3 * rough).all()


def streamed(seed):
    """Return a scene: streams of disks, boxes and polygons fall into a bin, on what is in it.

    No board can press anything against another one, or a wall: it would not give way.
    """
    random = np.random.default_rng(seed)

    def one(*values):
        return values[int(random.integers(len(values)))]

    contact = {"friction": one(0.0, 0.3, 0.8), "restitution": one(0.0, 0.2, 0.6, 0.9)}
    kinds, streams = [], []
    for k in range(int(random.integers(1, 4))):
        r, turns = (
            random.uniform(0.004, 0.015),
            2.0 * np.pi * np.arange(n := random.integers(3, 8)) / n,
        )
        outline = (r * np.stack([np.cos(turns), np.sin(turns)])).T.tolist()
        shape = one({"radius": r}, {"radius": [0.7 * r, 1.3 * r]},
                    {"shape": "box", "size": [2.0 * r, 2.0 * r]},
                    {"shape": "box", "size": [2.0 * r, 0.5 * r]},
                    {"shape": "polygon", "points": outline})  # fmt: skip
        kinds.append({"name": f"kind {k}", "mass": one(0.01, 0.05), "spin": True, **shape})
        turned = {"omega": one(0.0, 5.0, -40.0), "angle_deg": one(0.0, 0.0, 45.0, 20.0)}
        streams.append({
            "particle": f"kind {k}", "count": one(15, 30, 60), "rate": one(20.0, 60.0, 120.0),
            "at": [random.uniform(-0.08, 0.08), random.uniform(0.4, 0.8)],
            "velocity": [one(0.0, 0.0, 0.5, -0.5), one(0.0, -1.0)], "start": one(0.0, 0.0, 0.3),
            "interact": True, **contact, **(turned if "shape" in shape else {}),
        })  # fmt: skip
    boards = int(random.integers(3))
    wide = one(0.25, 0.3) if boards else one(0.1, 0.2)
    walls = [[-wide, 1.5], [-wide, 0.0], [wide, 0.0], [wide, 1.5]]
    surfaces = [{"name": "bin", "points": walls, **contact}]
    for k, side in enumerate((-0.1, 0.1)[:boards]):
        at = np.array([side, random.uniform(0.15, 0.35)])
        half, angle = one(0.03, 0.08), random.uniform(-0.8, 0.8)
        arm = half * np.array([np.cos(angle), np.sin(angle)])
        board = {"from": (at - arm).tolist(), "to": (at + arm).tolist()}
        surfaces.append({"name": f"board {k}", **contact, **one(
            board, {**board, "speed": one(0.5, -1.0)},
            {**board, "hinge": at.tolist(), "mass": 0.3, "spring": one(0.0, 0.5), "damper": 0.002},
            {**board, "turn": one(90.0, -300.0), "pivot": at.tolist()},
            {**board, "shake": {"by": [0.0, 0.004], "frequency": 20.0}},
            {"center": at.tolist(), "radius": 0.6 * half, "from_deg": -180.0, "to_deg": 180.0},
            {"center": at.tolist(), "radius": half, "from_deg": -180.0, "to_deg": 0.0},
        )})  # fmt: skip
    return {"particle": kinds, "stream": streams, "surface": surfaces, "run": {"until": 1.5}}


@pytest.mark.parametrize("seed", seeds(2, 100))
def test_streams_of_several_shapes_keep_the_laws(seed):
    """None gets into another, nor through a surface, and the ledger closes."""
    sound(chutelab.simulate(streamed(seed), engine="contact"))


GRIPS = {"speed": 1.5, "pulley_radius": 0.1}
"""An incoming belt that carries balls by adhesion, its surface at y = 0.1 m."""


@pytest.mark.parametrize("drop", [0.02, 0.2])
def test_a_box_that_falls_on_a_belt_with_adhesion_is_gripped(drop):
    """Adhesion ends at separation; else the belt's friction is infinite, so the box has its speed.

    It lies flat if its normal impulse, at one corner, outweighs the friction: v h <= u w. Else it
    tips about the rear corner, which gets the speed of the belt.
    """
    v, u = GRIPS["speed"], sqrt(2.0 * G * drop)
    run = sound(chutelab.simulate({
        "incoming": {**GRIPS, "length": 3.0, "restitution": 0.0},
        "particle": [ROUND, {**BOX, "name": "box"}],
        "stream": [{"particle": "ball"},
                   {"particle": "box", "at": [-2.0, 0.1 + 0.5 * H + drop], "velocity": [0.0, 0.0],
                    "interact": True}],
        "run": {"until": u / G + 1e-7, "dt": 1e-3},
    }, engine="contact"))  # fmt: skip
    end = run.ends()[1][1]
    (x, y), spin = end["velocity"], end["omega"]
    if v * H <= u * W:
        assert (x, y, spin) == pytest.approx((v, 0.0, 0.0), abs=1e-5)
    else:
        rear = x + 0.5 * spin * H, y - 0.5 * spin * W
        assert rear == pytest.approx((v, 0.0), abs=1e-5)
        assert spin > 0.0


@pytest.mark.parametrize("speed", [0.002, 0.02, 2.0])
@pytest.mark.parametrize("friction", [0.3, 1.65])
def test_a_belt_slips_under_a_box_in_a_nip(friction, speed):
    """Under a smooth wall that leans back by α, N2 sin α = µ N1 and N1 = m g + N2 cos α: the belt
    pays µ N1 v with N1 = m g / (1 - µ cot α), here up to 21 m g.

    With h = w cot α / 2 both forces act at the middle of the box. On a slow belt it comes asleep.
    """
    angle, width = radians(60.0), 0.02
    height = 0.5 * width / tan(angle)
    start, end = (
        [0.003 * cos(angle), height - 0.003 * sin(angle)],
        [-0.15, height + 0.15 * tan(angle)],
    )
    recording = chutelab.simulate({
        "particle": {"shape": "box", "size": [width, height], "mass": 0.008, "spin": True},
        "surface": [face("belt", (-1.0, 0.0), (1.0, 0.0), speed=speed, friction=friction),
                    face("wall", start, end, friction=0.0)],
        "stream": {"at": [-0.5 * width - 0.002, 0.5 * height], "velocity": [0.0, 0.0],
                   "interact": True, "restitution": 0.0},
        "run": {"until": 4.0, "engine": "contact"},
    })  # fmt: skip
    work, times = recording.totals["entries"][:, 0], recording.totals["t"]
    power = float(np.diff(np.interp([3.0, 4.0], times, work))[0])
    load = 0.008 * G / (1.0 - friction / tan(angle))
    assert power == pytest.approx(friction * load * speed, rel=1e-6)
    assert sound(recording).track(0)["velocity"][-1] == pytest.approx([0.0, 0.0], abs=1e-9)


@pytest.mark.parametrize("shape", [{"radius": 0.005}, {"shape": "box", "size": [0.01, 0.01]}])
@pytest.mark.parametrize("speed", [0.001, 0.003, 0.02])
def test_a_belt_carries_a_sleeper_to_another_one_that_it_pushes_along(speed, shape):
    """Both are 0.01 m long: that is their distance then."""
    meets = {"velocity": [0.0, 0.0], "interact": True, "restitution": 0.0, "friction": 0.3}
    recording = sound(chutelab.simulate({
        "particle": {**shape, "mass": 0.008, "spin": "size" in shape},
        "surface": [face("belt", (-1.0, 0.0), (0.0, 0.0), speed=speed, friction=0.5),
                    face("floor", (0.0, 0.0), (1.0, 0.0), friction=0.05)],
        "stream": [{"at": [0.0055, 0.005], **meets}, {"at": [-0.03, 0.005], **meets}],
        "run": {"until": 0.028 / speed, "engine": "contact"},
    }))  # fmt: skip
    (lies, _), (comes, _) = recording.at([recording.totals["t"][-1]])[0][0]
    assert lies > 0.0057
    assert lies - comes == pytest.approx(0.01, abs=2e-5)


def gripped(seed):
    """Draw balls that a belt carries by adhesion, and boxes or polygons that fall among them."""
    random = np.random.default_rng(seed)
    draw, one_of = random.uniform, random.choice
    meets = {"interact": True, "restitution": draw(0.0, 0.8), "friction": draw(0.0, 0.6)}
    return {
        "incoming": {"speed": draw(0.3, 3.0), "pulley_radius": draw(0.05, 0.1), "length": 0.6,
                     "incline_deg": float(one_of([-10.0, 0.0, 10.0]))},
        "plate": {"distance": 0.5, "restitution": 0.3, "friction": 0.3},
        "outgoing": {"drop": 0.5, "length": 3.0},
        "particle": [{**ROUND, "radius": 0.0063, "mass": 0.008},
                     {"name": "box", **a_shape(random, draw(0.01, 0.06)), "spin": True,
                      "mass": 0.05}],
        "stream": [
            {"particle": "ball", "count": int(one_of([1, 20, 60])), "rate": 30.0, **meets},
            {"particle": "box", "count": int(one_of([1, 6, 20])), "rate": draw(5.0, 40.0),
             "at": [draw(-0.4, 0.5), draw(0.25, 0.6)], "velocity": [0.0, draw(-1.0, 0.0)],
             "omega": draw(-5.0, 5.0), **meets},
        ],
        "run": {"until": float(one_of([2.0, 5.0]))},
    }  # fmt: skip


def wedged(seed):
    """Draw polygons that the lower belt draws under the plate's end, where most are too large,
    and balls among them."""
    random = np.random.default_rng(seed)
    draw, one_of = random.uniform, random.choice
    corners, size = int(random.integers(3, 9)), draw(0.022, 0.036)
    around = np.arange(corners) * 2.0 * pi / corners
    points = size * np.stack([np.cos(around), np.sin(around)], axis=1)
    rough, speed = float(one_of([0.2, 0.5, 1.0, 5.0])), draw(0.5, 2.5)
    meets = {"interact": True, "restitution": float(one_of([0.0, 0.3, 0.6]))}
    return {
        "incoming": {"speed": speed, "pulley_radius": 0.08, "length": 0.6},
        "plate": {"distance": 0.5, "restitution": 0.3, "friction": float(one_of([0.0, 0.3, 1.0]))},
        "outgoing": {"drop": 0.5, "drop_from": "top", "length": 3.0,
                     "speed": float(one_of([speed, 3.0])), "friction": rough},
        "particle": [{"name": "stone", "shape": "polygon", "points": points.tolist(),
                      "spin": True, "mass": 0.05},
                     {**ROUND, "radius": draw(0.004, 0.01), "mass": 0.008}],
        "stream": [
            {"particle": "stone", "count": int(one_of([3, 10, 20])), "rate": draw(5.0, 40.0),
             "at": [draw(-0.3, 0.5), 0.5], "velocity": [1.0, 0.0], "omega": draw(-8.0, 8.0),
             "friction": min(rough, 1.0), **meets},
            {"particle": "ball", "count": int(one_of([20, 60])), "rate": 30.0, "friction": 0.5,
             **meets},
        ],
        "run": {"until": 3.0},
    }  # fmt: skip


@pytest.mark.parametrize(
    ("draw", "seed"),
    [*((gripped, seed) for seed in (0, 1, 24, 40, 61, 85, 86, 89)),
     *((wedged, seed) for seed in (0, 1, 38, 41, 43, 56, 80, 90))],
)  # fmt: skip
def test_random_polygons_on_belts_that_grip_or_wedge_them_keep_the_laws(draw, seed):
    """Those from 24 on broke one: losses of up to 3 J were given back, and overlaps were 8 %."""
    sound(chutelab.simulate(draw(seed), engine="contact"))


@pytest.mark.slow
@pytest.mark.filterwarnings("ignore:LAW BROKEN, no loss is negative")
@pytest.mark.parametrize("draw", [gripped, wedged])
def test_few_belts_that_wedge_polygons_gain_from_losses_and_they_are_told(draw):
    """Rigid bodies in a wedge may have no solution: at most 2 of 100 break that law."""
    broken = []
    for seed in range(100):
        recording = chutelab.simulate(draw(seed), engine="contact")
        assert {law.law for law in recording.laws} <= {"no loss is negative"}
        broken += [law.amount for law in recording.laws]
        assert abs(recording.ledger.residual) <= 1e-11 * recording.ledger.turned_over
    assert len(broken) <= 2
    assert min(broken, default=0.0) > -0.2
