"""What hangs on joints and meets surfaces on hinges: formulas written here."""

from math import acos, asin, atan2, cos, degrees, hypot, pi, radians, sin, sqrt

import numpy as np
import pytest

import chutelab
from shared import seeds
from test_hinge import G, drawn, sound
from test_joints import machine_of_joints

pytest.importorskip("scipy")
from scipy.integrate import solve_ivp
from scipy.optimize import brentq

M, R = 0.1, 0.01
"""kg and m, of the ball."""


def tied(kind, at, plate, until, dt=1e-3, **keys):
    """Return a ball on a joint from the origin, and a plate on a hinge, without friction."""
    return {
        "particle": {"radius": R, "mass": M, "spin": keys.pop("spin", False)},
        "stream": {"at": list(at), "velocity": keys.pop("velocity", [0.0, 0.0])},
        kind: [{"from": [0.0, 0.0]}],
        "surface": [{"name": "board", "friction": 0.0, **plate}],
        "run": {"until": until, "dt": dt},
        **keys,
    }


@pytest.mark.parametrize("moves", ["ball", "plate"])
@pytest.mark.parametrize("kind", ["rod", "string"])
@pytest.mark.parametrize("turn", [0.0, 0.7])
def test_a_pendulum_and_a_plate_share_momentum_about_the_hinge(moves, kind, turn):
    """On its circle a ball feels the normal n by n·t alone, t along its way; without weight:

    J = (1 + e) (v n·t + l w) / ((n·t)² / m + l² / I), v' = v - J n·t / m, w' = w - J l / I.
    """
    length, lever, inertia, e, stiff = 0.4, 0.15, 2e-3, 0.6, 0.5
    t, n = np.array([1.0, 0.0]), np.array([cos(turn), sin(turn)])
    # The ball hangs straight down when both meet, so far from the hinge.
    face, along = np.array([0.0, -length]) + R * n, np.array([-n[1], n[0]])
    hinge, far = face + lever * along, -(lever + 0.1) * along
    plate = {"hinge": hinge.tolist(), "inertia": inertia, "restitution": e}
    back = 0.3 if moves == "ball" else 0.0
    v, w = (1.5, 0.0) if moves == "ball" else (0.0, sqrt(stiff / inertia * (0.4**2 - 0.2**2)))
    until = back * length / 1.5 + 1e-6
    if moves == "plate":
        # By its spring from 0.4 rad beyond its rest to 0.2: I w² = k (0.4² - 0.2²).
        plate |= {"spring": stiff, "rest_deg": -degrees(0.4)}
        far = np.array([[cos(0.2), -sin(0.2)], [sin(0.2), cos(0.2)]]) @ far
        until = sqrt(inertia / stiff) * acos(0.5) + 1e-6
    scene = tied(
        kind, (-length * sin(back), -length * cos(back)),
        {"from": hinge.tolist(), "to": (hinge + far).tolist(), **plate}, until, 1e-4,
        velocity=[v * cos(back), -v * sin(back)], gravity=0.0,
    )  # fmt: skip
    run = sound(chutelab.simulate(scene))
    pulls = n @ t
    impulse = (1.0 + e) * (v * pulls + lever * w) / (pulls**2 / M + lever**2 / inertia)
    blow = run.events[run.events["kind"] == chutelab.results.Kind.IMPACT]
    assert blow["t"] == pytest.approx([until - 1e-6], rel=1e-7)
    assert blow["normal_impulse"] == pytest.approx([impulse], rel=1e-7)
    left, turns = v - impulse * pulls / M, impulse * lever / inertia - w
    assert run.track(0)[-1]["velocity"] @ t == pytest.approx(left, rel=1e-5)
    assert run.swings["rate"][-1] == pytest.approx(turns, abs=1e-4)
    lost = 0.5 * (M * (v**2 - left**2) + inertia * (w**2 - turns**2))
    assert run.ledger.restitution_loss == pytest.approx(lost, rel=1e-6)


def test_a_blow_that_sticks_leaves_what_joint_hinge_and_contact_allow():
    """Of the speeds q = (v, ball's spin, w) before, M q - J^T (J M^-1 J^T)^-1 J q stays of M q.

    J q are normal velocity and slip of the ball's point less the plate's, whose hinge is off it.
    """
    length, lever, off, inertia, speed = 0.4, 0.15, 0.08, 2e-3, 1.5
    n = np.array([cos(0.7), sin(0.7)])
    along, t = np.array([-n[1], n[0]]), np.array([1.0, 0.0])
    face = np.array([0.0, -length]) + R * n
    hinge = face + lever * along + off * n
    plate = {"from": (face + 0.1 * along).tolist(), "to": (face - 0.1 * along).tolist(),
             "hinge": hinge.tolist(), "inertia": inertia,
             "restitution": 0.0, "friction": 9.0}  # fmt: skip
    back = 0.2
    run = sound(chutelab.simulate(tied(
        "rod", (-length * sin(back), -length * cos(back)), plate, back * length / speed + 1e-7,
        1e-4, velocity=[speed * cos(back), -speed * sin(back)], gravity=0.0, spin=True,
    )))  # fmt: skip
    places = np.array([[n @ t, 0.0, -lever], [along @ t, R, off]])
    light = np.diag([1.0 / M, 2.0 / (M * R**2), 1.0 / inertia])
    q = np.array([speed, 0.0, 0.0])
    q -= light @ places.T @ np.linalg.solve(places @ light @ places.T, places @ q)
    last = run.track(0)[-1]
    assert last["velocity"] @ t == pytest.approx(q[0], rel=1e-5)
    assert last["omega"] == pytest.approx(q[1], rel=1e-5)
    assert run.swings["rate"][-1] == pytest.approx(q[2], rel=1e-5)


@pytest.mark.parametrize("kind", ["rod", "string"])
def test_a_hung_ball_and_a_sprung_plate_come_to_rest_in_their_equilibrium(kind):
    """The plate turns by a, k a = N l - m' g d cos(b + a), and N n + T e = m g up on the ball."""
    length, tilt, far, mass, stiff = 0.3, radians(-30.0), 0.4, 0.2, 1.5
    hinge = np.array([-0.05, -0.15])

    def place(turned):
        """Angle of the string from straight down at which the ball touches the plate."""
        up = np.array([-sin(tilt + turned), cos(tilt + turned)])
        return brentq(
            lambda s: up @ (length * np.array([sin(s), -cos(s)]) - hinge) - R, 0.0, 0.5 * pi
        )

    def moment(turned):
        s, b = place(turned), tilt + turned
        up, string = np.array([-sin(b), cos(b)]), np.array([-sin(s), cos(s)])
        pressed, _ = np.linalg.solve(np.column_stack([up, string]), [0.0, M * G])
        lever = np.array([cos(b), sin(b)]) @ (length * np.array([sin(s), -cos(s)]) - hinge)
        return -stiff * turned - pressed * lever - mass * G * 0.5 * far * cos(b)

    turned = brentq(moment, -0.6, 0.0)
    s = place(0.0)
    plate = {"from": hinge.tolist(), "hinge": hinge.tolist(), "mass": mass, "spring": stiff,
             "to": (hinge + far * np.array([cos(tilt), sin(tilt)])).tolist(),
             "damper": 0.12, "restitution": 0.0}  # fmt: skip
    scene = tied(kind, (length * sin(s), -length * cos(s)), plate, 4.0, 2e-3)
    run = sound(chutelab.simulate(scene))
    x, y = run.track(0)[-1]["position"]
    # In a crowd it may be a thousandth of its radius deep.
    assert run.swings["angle"][-1] == pytest.approx(turned, abs=1e-5)
    assert atan2(x, -y) == pytest.approx(place(turned), abs=5e-5)


def riding(until, dt):
    """Return where a ball that swings on a sprung plate is, by the engine and by its equation.

    The angle s of the rod is all that is free, that b of the plate follows: with D from the hinge
    to the ball, b = angle of D - asin(R / |D|). H = p² / 2 (m L² + I b'²) + potential energies.
    """
    length, mass, stiff, far = 0.3, 0.2, 2.0, 0.5
    hinge, inertia = np.array([-0.1, -0.25]), mass * far**2 / 3.0

    def follows(s):
        x, y = length * np.array([sin(s), -cos(s)]) - hinge
        u, v = length * np.array([cos(s), sin(s)])
        away = hypot(x, y)
        rate = (x * v - y * u) / away**2
        rate += R * (x * u + y * v) / away**3 / sqrt(1.0 - (R / away) ** 2)
        return atan2(y, x) - asin(R / away), rate

    start = 0.7
    written = follows(start)[0]

    def energy(s, p):
        b, rate = follows(s)
        height = -M * G * length * cos(s) + 0.5 * mass * G * far * sin(b)
        bent = 0.5 * stiff * (b - written - 0.5) ** 2
        return 0.5 * p * p / (M * length**2 + inertia * rate**2) + height + bent

    def change(_, state):
        s, p = state
        rise = (energy(s + 1e-5, p) - energy(s - 1e-5, p)) / 2e-5
        return p / (M * length**2 + inertia * follows(s)[1] ** 2), -rise

    exact = solve_ivp(change, (0.0, until), (start, 0.0), rtol=1e-10, atol=1e-12).y[0, -1]
    plate = {"from": hinge.tolist(), "hinge": hinge.tolist(), "mass": mass, "spring": stiff,
             "to": (hinge + far * np.array([cos(written), sin(written)])).tolist(),
             "rest_deg": degrees(0.5), "restitution": 0.0}  # fmt: skip
    scene = tied("rod", (length * sin(start), -length * cos(start)), plate, until, dt)
    run = sound(chutelab.simulate(scene))
    assert len(run.events) == 1
    x, y = run.track(0)[-1]["position"]
    return abs(atan2(x, -y) - exact)


def test_a_ball_that_swings_on_a_plate_is_of_order_two():
    coarse, fine = riding(0.2, 1e-3), riding(0.2, 5e-4)
    assert fine < 1e-6
    assert coarse / fine == pytest.approx(4.0, rel=0.02)


def ladder(dt):
    """Return a ladder without weight that turns between two walls, balls at its ends outside them.

    Its length L, ends at L (cos a, sin a): K = m L² w² / 2, and so a turns evenly; both are pulled
    along the ladder by m L w², so each presses its wall, by m L w² sin a and m L w² cos a.
    """
    length, rate, begin = 0.5, 2.0, 0.5
    x, y = length * cos(begin), length * sin(begin)
    rows = [{"at": [x - R, -R], "velocity": [-y * rate, 0.0]},
            {"at": [-R, y - R], "velocity": [0.0, x * rate]}]  # fmt: skip
    smooth = {"friction": 0.0, "restitution": 0.0}
    run = chutelab.simulate({
        "particle": {"radius": R, "mass": M, "spin": False}, "gravity": 0.0,
        "stream": [row | {"interact": True} for row in rows],
        "rod": [{"particle": 0, "other": 1}], "run": {"until": 0.3, "dt": dt, "loads": 0.3},
        "surface": [{"name": "floor", "from": [-1.0, 0.0], "to": [1.0, 0.0], **smooth},
                    {"name": "wall", "from": [0.0, -1.0], "to": [0.0, 1.0], **smooth}],
    })  # fmt: skip
    (x, _), (_, y) = run.ends()[1]["position"]
    end = begin + 0.6
    pressed = M * length * rate * np.array([cos(begin) - cos(end), sin(end) - sin(begin)])
    on_floor, on_wall = run.impulses["force"][0]
    assert [on_floor[1], on_wall[0]] == pytest.approx(pressed, rel=5e-3)
    return run, atan2(y + R, x + R) - end


def test_a_ladder_between_walls_turns_evenly_and_gets_no_energy_of_them():
    runs = [ladder(dt) for dt in (1e-3, 5e-4)]
    for run, _ in runs:
        sound(run)
        assert run.contacts == 0
        for particle in (0, 1):
            lost = np.diff(run.track(particle)["entries"][:, 1])
            assert lost.min() > -1e-16
    (_, coarse), (_, fine) = runs
    assert abs(fine) < 1e-6
    assert coarse / fine == pytest.approx(4.0, rel=0.01)


@pytest.mark.parametrize("pegs", [2, 3])
def test_a_chain_that_falls_over_pegs_gives_nothing_back(pegs):
    """Nine or six disks on rods, rough and hardly elastic, which rattle between pegs and joints."""
    count = {2: 9, 3: 6}[pegs]
    meets = {"friction": 0.3, "restitution": 0.2}
    places = np.linspace(-0.2, 0.2, pegs)
    chain = {
        "particle": {"shape": "disk", "radius": R, "mass": 0.05, "spin": True},
        "stream": {"count": count, "at": [-0.3, 0.3], "to": [0.3, 0.3], "velocity": [0.0, 0.0],
                   "interact": True, **meets},
        "rod": [{"particle": 0, "from": [-0.35, 0.3]},
                *({"particle": i, "other": i - 1} for i in range(1, count))],
        "surface": [{"name": f"peg-{n}", "center": [float(x), 0.2], "radius": 0.04,
                     "from_deg": 0.0, "to_deg": 360.0, "friction": 0.3}
                    for n, x in enumerate(places)],
        "run": {"until": 1.0},
    }  # fmt: skip
    sound(chutelab.simulate(chain, engine="contact"))


def among_hinges(seed):
    """Return random hinges, and disks on random joints that fall on them."""
    scene, joints = drawn(seed), machine_of_joints(seed)
    for row in joints["stream"]["to"], joints["stream"]["at"]:
        row[0] -= 0.3
    for kind in ("string", "rod", "spring", "pin"):
        for row in joints.get(kind, []):
            if "from" in row:
                row["from"][0] -= 0.3
    joints["surface"] = scene["surface"]
    return joints


@pytest.mark.parametrize("seed", seeds(6, 200))
def test_random_joints_among_random_hinges_keep_the_laws(seed):
    run = chutelab.simulate(among_hinges(seed))
    assert not run.laws
    own = run.ledger
    play = own.turned_over + max(abs(e) for e in (*own.potential, *own.spring))
    assert abs(own.residual) < 1e-11 * play
