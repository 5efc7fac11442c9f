"""The Pymunk engine on arcs, gates, inclined belts, kinds, boxes and strings; laws written here."""

from __future__ import annotations

from dataclasses import replace
from math import acos, cos, hypot, inf, pi, radians, sin, sqrt, tan

import numpy as np
import pytest

from chutelab.engines.pymunk import run
from chutelab.machine import Arcs
from chutelab.results import Kind
from machines import face, scene_of, thrown

G = 9.81


def with_arcs(machine, *arcs):
    """Return the machine with arcs, each a surface of its own: (center, radius, begin, extent) and
    speed, restitution, friction, appears, vanishes by name."""
    names = tuple(f"arc{n}" for n in range(len(arcs)))
    base = {"speed": 0.0, "restitution": 0.0, "friction": 0.0, "appears": -inf, "vanishes": inf}
    rows = [
        dict(zip(("center", "radius", "begin", "extent"), arc[:4], strict=True), **(base | arc[4]))
        for arc in arcs
    ]
    columns = {name: np.array([row[name] for row in rows], dtype=float) for name in rows[0]}
    owner = len(machine.surfaces) + np.arange(len(arcs))
    return replace(
        machine, surfaces=(*machine.surfaces, *names), arcs=Arcs(**columns, surface=owner)
    )


def lone(position, velocity=(0.0, 0.0), *, until=1.0, dt=1e-3, **tables):
    tables["particle"] = {"radius": 0.01, "spin": False} | tables.get("particle", {})
    run_table = {"until": until, "max_time": until, "dt": dt} | tables.pop("run", {})
    machine = scene_of(run=run_table, **tables)
    return thrown(machine, position, velocity)


def residual(recording):
    """Return the largest residual of a particle's ledger, J: states against what was booked."""
    p, g, worst = recording.particle, recording.gravity, 0.0
    mass, inertia = (
        np.broadcast_to(p.mass, recording.count),
        np.broadcast_to(p.inertia, recording.count),
    )
    for i in range(recording.count):
        track = recording.track(i)
        v, y = np.hypot(*track["velocity"].T), track["position"][:, 1]
        energy = 0.5 * mass[i] * v**2 + 0.5 * inertia[i] * track["omega"] ** 2 + mass[i] * g * y
        belt, restitution, friction = track["entries"].T
        off = energy - energy[0] - (belt - restitution - friction)
        worst = max(worst, float(np.abs(off).max()))
    return worst


def test_inside_a_drum_without_gravity_the_way_is_a_polygon():
    # Chords of a circle of radius R - r: struck at the angle it is met at, all equally long.
    m = lone((0.3, 1.0), (0.6, 0.8), gravity=0.0, until=5.0)
    m = with_arcs(m, ((0.1, 1.0), 0.5, 0.0, 2.0 * pi, {"restitution": 1.0}))
    hits = run(m).select(Kind.IMPACT)
    assert np.hypot(*(hits["position"] - [0.1, 1.0]).T) == pytest.approx(0.49, abs=1e-13)
    # The first chord from (0.2, 0) along (0.6, 0.8); its distance from the centre is 0.16.
    assert hits["t"][0] == pytest.approx(sqrt(0.49**2 - 0.16**2) - 0.12, abs=1e-13)
    assert np.diff(hits["t"]) == pytest.approx(2.0 * sqrt(0.49**2 - 0.16**2), abs=1e-11)
    assert len(hits) == 6


@pytest.mark.parametrize("side", ["inside", "outside"])
def test_an_arc_is_met_where_the_parabola_meets_its_circle(side):
    # From above the middle of a lower half circle, or of an upper one, moved to and fro.
    begin, y = (pi, 1.0) if side == "inside" else (0.0, 2.0)
    rho = 0.49 if side == "inside" else 0.51
    m = lone((-0.1, y), (0.4, 0.0), until=1.0)
    m = with_arcs(m, ((0.0, 1.0), 0.5, begin, pi, {"restitution": 0.5, "friction": 0.1}))
    got = run(m)
    hit = got.select(Kind.IMPACT)[0]
    # (x0 + v t)² + (y0 - g t²/2 - 1)² = ρ², highest power first.
    roots = np.roots(
        [0.25 * G * G, 0.0, 0.16 - G * (y - 1.0), -0.08, 0.01 + (y - 1.0) ** 2 - rho**2]
    )
    t = min(t.real for t in roots if abs(t.imag) < 1e-9 and t.real > 0.0)
    assert hit["t"] == pytest.approx(t, abs=1e-13)
    n = (hit["position"] - [0.0, 1.0]) / rho * (-1.0 if side == "inside" else 1.0)
    before, after = hit["velocity_before"], hit["velocity_after"]
    assert after @ n == pytest.approx(-0.5 * (before @ n), abs=1e-12)
    assert residual(got) < 1e-7


def slid(theta, speed, radius, friction, steps=4000):
    """Return v² after sliding in a hollow from the angle θ left of the lowest point to it: RK4 of
    dv²/dθ = 2 g ρ (sin θ' - µ cos θ') - 2 µ v², θ' what is left."""

    def rate(left, square):
        return 2.0 * G * radius * (sin(left) - friction * cos(left)) - 2.0 * friction * square

    h, square = theta / steps, speed**2
    for n in range(steps):
        left = theta - n * h
        a = rate(left, square)
        b = rate(left - 0.5 * h, square + 0.5 * h * a)
        c = rate(left - 0.5 * h, square + 0.5 * h * b)
        d = rate(left - h, square + h * c)
        square += h / 6.0 * (a + 2.0 * b + 2.0 * c + d)
    return square


@pytest.mark.parametrize("friction", [0.0, 0.3])
def test_a_slide_down_a_hollow_arc_is_of_order_two(friction):
    # A quarter circle, entered tangentially at 60° with 2 m/s, left at its lowest point.
    rho, theta = 0.49, radians(60.0)
    want = sqrt(slid(theta, 2.0, rho, friction))
    errors = []
    for dt in (4e-3, 2e-3, 1e-3):
        m = lone(
            (-rho * sin(theta), 1.0 - rho * cos(theta)), (2.0 * cos(theta), -2.0 * sin(theta)),
            until=1.0, dt=dt,
        )  # fmt: skip
        begin = 1.5 * pi - theta - 0.1
        m = with_arcs(m, ((0.0, 1.0), 0.5, begin, theta + 0.1, {"friction": friction}))
        got = run(m)
        left = got.select(Kind.SEPARATION)[-1]
        assert left["position"] == pytest.approx([0.0, 0.51], abs=1e-5)
        assert abs(hypot(*left["velocity_after"]) - want) < 2e-5 * (dt / 1e-3) ** 2
        errors.append(residual(got))
    # Chipmunk's impulse half-way is off by the square of the angle that is turned in a step.
    assert errors[-1] < 2e-6
    assert errors[0] / errors[-1] > 3.0


def test_a_ball_leaves_a_round_top_where_it_presses_no_more():
    # cos φ = (2 + v0²/(g ρ))/3 on a smooth circle, away from the origin.
    rho, v = 0.51, 0.5
    m = lone((0.7, 1.0 + rho), (v, 0.0), until=1.0, dt=1e-3)
    m = with_arcs(m, ((0.7, 1.0), 0.5, 0.0, 2.0 * pi, {}))
    got = run(m)
    left = got.select(Kind.SEPARATION)[0]
    cosine = (left["position"][1] - 1.0) / rho
    assert cosine == pytest.approx((2.0 + v * v / (G * rho)) / 3.0, abs=2e-6)
    assert residual(got) < 1e-6


def test_a_wheel_away_from_the_origin_grips_a_ball_at_its_rims_speed():
    # J_t = m* (u - v_t) for a grip: a disk that falls on the top of a wheel which runs forward.
    m = lone((0.7, 1.6), (0.3, 0.0), until=0.5, particle={"spin": True})
    m = with_arcs(m, ((0.7, 1.0), 0.5, 0.0, 2.0 * pi, {"speed": 1.5, "friction": 5.0}))
    hit = run(m).select(Kind.IMPACT)[0]
    n = (hit["position"] - [0.7, 1.0]) / 0.51
    slip = hit["velocity_before"] @ [n[1], -n[0]] - 1.5
    assert hit["tangential_impulse"] == pytest.approx(-0.1 / 3.0 * slip, abs=1e-9)


def gated(machine, appears, vanishes):
    """Return the machine with its first surface there from and up to a time."""
    parts = machine.segments
    times = {"appears": appears, "vanishes": vanishes}
    rows = {key: np.array([value, *getattr(parts, key)[1:]]) for key, value in times.items()}
    return replace(machine, segments=replace(parts, **rows))


FLOOR = face("floor", (-1.0, 0.0), (1.0, 0.0), restitution=0.0)


def test_what_lies_on_a_gate_falls_when_it_opens():
    m = gated(lone((0.0, 0.06), until=0.5, surface=[FLOOR]), -inf, 0.25)
    got = run(m)
    end = got.track(0)[-1]
    assert end["position"][1] == pytest.approx(0.01 - 0.5 * G * 0.25**2, abs=1e-12)
    assert residual(got) < 1e-13
    left = got.select(Kind.SEPARATION)[0]
    assert left["t"] == pytest.approx(0.25, abs=1e-12)


def test_a_gate_is_met_once_it_is_there():
    # Thrown up through the plane of the gate and down again, on it if it has shut meanwhile.
    m = lone((0.0, -0.5), (0.0, 4.0), until=1.0, surface=[face("gate", (-1.0, 0.0), (1.0, 0.0))])
    hit = run(gated(m, 0.4, inf)).select(Kind.IMPACT)[0]
    down = (4.0 + sqrt(16.0 - 2.0 * G * 0.51)) / G
    assert hit["t"] == pytest.approx(down, abs=1e-12)


def test_a_gate_shuts_on_nobody():
    # It appears while the disk is in it, and lets it through; the disk meets it from below, later.
    m = lone((0.0, -0.3), (0.0, 3.0), until=1.0, surface=[face("gate", (-1.0, 0.0), (1.0, 0.0))])
    through = (3.0 - sqrt(9.0 - 2.0 * G * 0.3)) / G
    got = run(gated(m, through, inf))
    hit = got.select(Kind.IMPACT)[0]
    assert hit["t"] == pytest.approx((3.0 + sqrt(9.0 - 2.0 * G * 0.31)) / G, abs=1e-12)
    assert hit["position"][1] == pytest.approx(0.01, abs=1e-12)


@pytest.mark.parametrize("align", [True, False])
@pytest.mark.parametrize(("slope", "speed"), [(15.0, 1.0), (15.0, 3.0), (-15.0, 1.0), (-15.0, 3.0)])
def test_an_inclined_belt_lets_go_at_its_tangent_point_or_further_on(slope, speed, align):
    # v² >= g ρ cos β: at the tangent point, else at cos φ = v²/(g ρ).
    beta, rho, way = radians(slope), 0.51, 0.4
    along, up = np.array([cos(beta), sin(beta)]), np.array([-sin(beta), cos(beta)])
    m = scene_of(
        particle={"radius": 0.01, "spin": False},
        incoming={"speed": speed, "pulley_radius": 0.5, "friction": "adhesion"},
        stream={"at": [-way, rho], "velocity": [speed, 0.0]},
        run={"until": 2.0, "align": align},
    )
    m = thrown(m, rho * up - way * along, speed * along)
    parts = m.segments
    start, tangent = parts.start.copy(), parts.tangent.copy()
    start[0], tangent[0] = 0.5 * up - parts.length[0] * along, along
    m = replace(
        m, pulley=replace(m.pulley, incline=beta),
        segments=replace(parts, start=start, tangent=tangent),
        releases=replace(m.releases, carried=np.array([True])),
    )  # fmt: skip
    got = run(m)
    left = got.select(Kind.SEPARATION)[0]
    cosine = speed**2 / (G * rho)
    phi = -beta if cosine >= cos(beta) else acos(cosine)
    assert left["position"] == pytest.approx([rho * sin(phi), rho * cos(phi)], abs=1e-12)
    assert left["velocity_after"] == pytest.approx([speed * cos(phi), -speed * sin(phi)], abs=1e-12)
    assert left["t"] == pytest.approx((way + rho * (phi + beta)) / speed, abs=1e-12)
    # The belt pays what the particle rises.
    rise = left["position"][1] - m.releases.position[0, 1]
    assert got.by_surface[0, 0] == pytest.approx(0.1 * G * rise, abs=1e-12)
    assert residual(got) < 1e-10


@pytest.mark.parametrize("shape", ["disk", "sphere"])
def test_rolling_friction_slows_a_rolling_ball(shape):
    # m a = -F and I dω = F r - arm N: a = -g arm/r · m r²/(I + m r²) once it rolls; stops for good.
    share = 0.5 if shape == "disk" else 0.4
    m = lone((0.0, 0.01), (0.5, 0.0), until=20.0, particle={"spin": True}, surface=[
        face("floor", (-1.0, 0.0), (9.0, 0.0), restitution=0.0, friction=0.6)
    ])  # fmt: skip
    m = replace(m, rolling=np.array([0.02]))
    m = replace(m, particle=replace(m.particle, inertia=share * 0.1 * 0.01**2))
    got = run(replace(m, until="settled"))
    settle = got.select(Kind.SETTLE)[0]
    stick = got.select(Kind.STICK)[0]
    v, slow = stick["velocity_after"][0], G * 0.02 / (1.0 + share)
    # It stops at the end of a step.
    assert settle["t"] - stick["t"] == pytest.approx(v / slow + 5e-4, abs=6e-4)
    way = settle["position"][0] - stick["position"][0]
    assert way == pytest.approx(v * v / (2.0 * slow), abs=1e-7)
    assert residual(got) < 1e-12


@pytest.mark.parametrize(("slope", "rolls"), [(1.0, False), (2.0, True)])
def test_rolling_friction_holds_a_ball_on_a_slope_up_to_its_angle(slope, rolls):
    # Up to tan β = arm/r it stays; beyond, m a (1 + I/(m r²)) = m g (sin β - arm/r cos β).
    beta, r, arm = radians(slope), 0.01, tan(radians(1.5))
    along = np.array([cos(beta), -sin(beta)])
    floor = face("ramp", (-along).tolist(), (9.0 * along).tolist(), restitution=0.0, friction=0.6)
    m = lone((r * sin(beta), r * cos(beta)), until=1.0, particle={"spin": True}, surface=[floor])
    got = run(replace(m, rolling=np.array([arm])))
    gone = hypot(*(got.track(0)[-1]["position"] - got.track(0)[0]["position"]))
    want = 0.5 * G * (sin(beta) - arm * cos(beta)) / 1.5 if rolls else 0.0
    assert gone == pytest.approx(want, abs=1e-9)
    assert residual(got) < 1e-12
