"""The stream: when, where and how fast each particle starts."""

from time import process_time

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from chutelab import scene
from chutelab.engines import contact
from chutelab.engines.simulation import simulate
from chutelab.machine import build
from chutelab.machine.releases import DEEP, squeeze
from chutelab.results import Kind
from chutelab.scene.variants import Family

G, V, r = 9.81, 2.0, 0.0063
RC = 0.1 + r


def drawn(*, incoming=None, particle=None, **stream):
    belt = {"speed": V, "pulley_radius": 0.1, **(incoming or {})}
    tables = {"incoming": belt, "particle": particle or {}, "stream": stream}
    return build(scene.from_dict(tables, "mine.toml")).releases


@given(count=st.integers(1, 400), rate=st.floats(1e-3, 1e6), seed=st.integers(0, 2**63 - 1))
def test_particle_i_starts_at_i_over_the_rate_on_the_belt(count, rate, seed):
    found = drawn(count=count, rate=rate, seed=seed, bed_height=0.05)
    assert found.t.tolist() == [i / rate for i in range(count)]
    assert found.position.shape == found.velocity.shape == (count, 2)
    assert (found.position[:, 0] == -1.0).all()
    assert (found.position[:, 1] >= RC).all()
    assert (found.position[:, 1] <= RC + 0.05).all()
    assert (found.velocity == [V, 0.0]).all()
    assert found.carried.all()
    # particle 0 is nominal
    assert found.position[0].tolist() == [-1.0, RC]
    with pytest.raises(ValueError, match="read-only"):
        found.t[0] = 1.0


def spinning(engine, shape, omega, **stream):
    """Let go at rest on a floor, without restitution."""
    floor = {"name": "floor", "from": [-1.0, 0.0], "to": [1.0, 0.0]}
    return simulate(
        {
            "particle": {"radius": 0.02, "mass": 0.1, "spin": True, "shape": shape},
            "surface": [floor | {"friction": 0.3, "restitution": 0.0}],
            "stream": {"at": [0.0, 0.02], "velocity": [0.0, 0.0], "omega": omega, **stream},
            "run": {"until": 0.6},
        },
        engine=engine,
    )


@pytest.mark.parametrize(("shape", "k"), [("disk", 1 / 2), ("sphere", 2 / 5)])
@pytest.mark.parametrize("engine", ["exact", "contact", "pymunk"])
def test_what_spins_at_its_release_slips_until_it_rolls(engine, shape, k):
    # m v = J and k m r² (ω - ω0) = r J until v = -r ω: v = -r ω0 k/(1 + k), after v/(µ g).
    m, radius, mu, omega = 0.1, 0.02, 0.3, -60.0
    recording = spinning(engine, shape, omega)
    v = -radius * omega * k / (1 + k)
    knots, ledger, about = recording.track(0), recording.ledger, pytest.approx
    assert knots["omega"][[0, -1]] == about([omega, -v / radius], rel=1e-9)
    assert knots["velocity"][-1] == about([v, 0.0], rel=1e-9, abs=1e-12)
    slips = v / (mu * G)
    close = 1e-5 if engine == "contact" else 1e-9
    assert knots["position"][-1, 0] == about(v * (0.6 - 0.5 * slips), rel=close)
    start = 0.5 * k * m * (radius * omega) ** 2
    assert ledger.friction_loss == about(start / (1 + k), rel=1e-9)
    assert ledger.kinetic == about((start, start * k / (1 + k)), rel=1e-9)
    assert not recording.laws


@pytest.mark.parametrize("engine", ["contact", "pymunk"])
def test_what_spins_among_others_keeps_its_spin_in_flight(engine):
    recording = spinning(engine, "disk", 7.0, at=[0.0, 2.5], to=[0.1, 2.5], count=2, interact=True)
    assert recording.select(Kind.RELEASE)["omega_after"].tolist() == [7.0, 7.0]
    for i in range(2):
        assert recording.track(i)["omega"].tolist() == [7.0] * len(recording.track(i))


def test_on_a_belt_with_friction_a_spin_shifts_the_separation():
    tables = {
        "incoming": {"speed": 2.0, "pulley_radius": 0.1, "friction": 0.3, "length": 0.4},
        "particle": {"radius": 0.02, "spin": True},
        "stream": {"omega": -20.0},
    }
    exact, contact, plain = (
        simulate({**tables, **more}, engine=engine).select(Kind.SEPARATION)[0]
        for engine, more in (("exact", {}), ("contact", {}), ("exact", {"stream": {}}))
    )
    for field in ("t", "position", "velocity_after", "omega_after"):
        assert contact[field] == pytest.approx(exact[field], rel=1e-4, abs=1e-6)
    assert abs(plain["t"] - exact["t"]) > 1e-3


def test_a_particle_let_go_from_rest_has_its_spread_forwards():
    found = drawn(count=50, at=[0.0, 1.0], velocity=[0.0, 0.0], speed_spread=0.3)
    assert (found.velocity[:, 1] == 0.0).all()
    assert 0.0 < np.abs(found.velocity[1:, 0]).max() <= 0.3


def test_a_fill_with_a_spread_of_speeds_is_a_gas():
    """Both components are normal, so v² / 2 over their variance is exponential (Maxwell)."""
    stats = pytest.importorskip("scipy.stats")
    tables = {
        "gravity": 0.0,
        "particle": {"radius": 0.002},
        "surface": [{"name": "box", "points": [[0, 0], [1, 0], [1, 1], [0, 1], [0, 0]],
                     "restitution": 1.0, "friction": 0.0}],
        "stream": {"count": 3000, "fill": [[0.01, 0.01], [0.99, 0.99]], "speed_spread": 0.4,
                   "seed": 3},
        "run": {"until": 0.5},
    }  # fmt: skip
    velocity = build(scene.from_dict(tables)).releases.velocity
    for component in velocity.T:
        assert stats.kstest(component / 0.4, "norm").pvalue > 0.01
    assert abs(np.corrcoef(velocity.T)[0, 1]) < 3.0 / np.sqrt(len(velocity))
    assert stats.kstest((velocity**2).sum(axis=1) / 0.32, "expon").pvalue > 0.01
    tables["stream"] |= {"count": 150, "interact": True, "restitution": 1.0, "friction": 0.0}
    recording = simulate(tables)
    assert not recording.laws
    assert recording.contacts > 50
    kinetic = recording.ledger.kinetic
    assert kinetic[1] == pytest.approx(kinetic[0], rel=1e-11)
    # Without it a fill is at rest, as it was.
    del tables["stream"]["speed_spread"]
    assert not build(scene.from_dict(tables)).releases.velocity.any()


@pytest.mark.parametrize(
    ("changes", "carried"),
    [
        ({}, True),
        ({"incoming": {"friction": 0.5}}, False),
        ({"at": [-0.3, RC]}, True),
        ({"at": [-0.3, RC + 1e-6], "velocity": [V, 0.0]}, False),
        ({"at": [0.1, RC], "velocity": [V, 0.0]}, False),
    ],
)
def test_only_what_starts_on_an_adhesive_belt_is_carried(changes, carried):
    found = drawn(**changes)
    assert found.carried.tolist() == [carried]
    assert found.position.tolist() == [list(changes.get("at", [-1.0, RC]))]


def bed_of_numpy(seeds, count, rate, height, speed, spread, radii, fall, floor):
    """Heights, speeds and radii of a bed: all drawn, then each height anew until it is free.

    It is kept as it is after a thousand.
    """
    rng, t = np.random.default_rng(seeds), np.arange(count) / rate
    y = height * rng.random(count)
    u = speed + spread * rng.uniform(-1.0, 1.0, count)
    size = rng.uniform(*radii, count) if radii[0] < radii[1] else np.full(count, radii[0])
    y[0], u[0], size[0] = 0.0, speed, 0.5 * sum(radii)
    for i in range(1, count):
        age = t[i] - t[:i]
        dx, dy = u[:i] * age, np.maximum(y[:i] - fall * age**2, floor)
        for _ in range(1000):
            if (dx**2 + (dy - y[i]) ** 2 >= (size[:i] + size[i]) ** 2).all():
                break
            y[i] = height * rng.random()
    return y, u, size


@pytest.mark.slow
@settings(max_examples=6)
@given(
    seed=st.sampled_from([0, 2**32 - 1, 2**32, 2**63 - 1]) | st.integers(0, 2**63 - 1),
    second=st.booleans(), carried=st.booleans(), count=st.integers(2, 100),
    rate=st.floats(50.0, 5000.0), height=st.floats(0.01, 0.3), spread=st.floats(0.1, 0.5),
    radii=st.sampled_from([(0.004, 0.004), (0.003, 0.008)]),
)  # fmt: skip
def test_beds_are_those_of_numpys_random_numbers(
    seed, second, carried, count, rate, height, spread, radii
):
    """To the last bit, for seeds of one word and of two, of the first stream and of others."""
    bed = {"count": count, "rate": rate, "bed_height": height, "seed": seed, "interact": True}
    if not carried:
        bed |= {"at": [0.0, 3.0], "velocity": [1.5, 0.0], "speed_spread": spread}
    other = {"at": [0.0, 9.0], "velocity": [0.0, 0.0]}
    tables = {
        "incoming": {"speed": V, "pulley_radius": 0.1},
        "particle": {"radius": list(radii) if radii[0] < radii[1] else radii[0]},
        "stream": [other, bed] if second else [bed],
    }
    machine = build(scene.from_dict(tables))
    found, own = machine.releases, slice(int(second), None)
    speed, spread, fall, floor = (V, 0.0, 0.0, 0.0) if carried else (1.5, spread, 0.5 * G, -np.inf)
    seeds = [seed, 1] if second else seed
    y, u, size = bed_of_numpy(seeds, count, rate, height, speed, spread, radii, fall, floor)
    mean = 0.5 * sum(radii)
    lowest = 0.1 + mean if carried else 3.0
    rides = size - mean if carried else 0.0
    assert found.carried[own].tolist() == [carried] * count
    assert found.position[own, 1].tolist() == (lowest + (y + rides)).tolist()
    assert found.velocity[own].tolist() == [[v, 0.0] for v in u.tolist()]
    assert np.broadcast_to(machine.particle.radius, machine.count)[own].tolist() == size.tolist()


def packed_at_once(left, bottom, right, top, radius, seed):
    """All places of a box: rows 2.04 r sqrt(3)/2 apart, every other one shifted by 1.02 r, and
    each place moved by up to 0.01 r."""
    places, room = [], 1.01 * radius
    pitch = 2.04 * radius
    rise = pitch * np.sqrt(0.75)
    for row in range(int((top - bottom - 2 * room) // rise) + 1):
        for column in range(int((right - left - 2 * room) // pitch) + 1):
            x = left + room + (column * pitch + 0.5 * pitch * (row % 2))
            if x <= right - room:
                places.append([x, bottom + room + row * rise])
    moved = np.random.default_rng(seed).uniform(-1.0, 1.0, (len(places), 2))
    return np.array(places) + 0.01 * radius * moved


def test_each_of_a_family_starts_as_it_would_by_itself():
    one = scene.load("inclined-conveyor", ["stream.count=1"])
    columns = {
        "incoming.incline_deg": np.array([0.0, 4.0, -3.0, 12.0]),
        "incoming.pulley_radius": np.array([0.2, 0.25, 0.2, 0.3]),
        "stream.start": np.array([0.0, 0.5, 0.0, 2.0]),
    }
    found = vars(build(Family(one, columns)).releases)
    for n in range(4):
        alone = vars(build(one.with_values({key: own[n] for key, own in columns.items()})).releases)
        for name in ("t", "position", "velocity", "carried"):
            assert found[name][n].tobytes() == alone[name][0].tobytes()


@pytest.mark.parametrize("count", [10, 20_000])
def test_a_box_is_packed_from_below_only_as_far_as_it_takes(count):
    radius, box = 0.001, [[0.0, 0.0], [1.0, 0.2]]
    stream = {"count": count, "fill": box, "seed": 7, "interact": True}
    line = {"name": "line", "from": [0.0, -0.01], "to": [1.0, -0.01]}
    tables = {"particle": {"radius": radius}, "surface": [line], "stream": stream}
    found = build(scene.from_dict(tables)).releases.position
    expected = packed_at_once(0.0, 0.0, 1.0, 0.2, radius, 7)
    assert len(expected) > 50_000
    assert np.abs(found - expected[:count]).max() < 1e-15


def test_what_is_poured_into_what_was_poured_lies_beside_it():
    box = [[0.0, 0.0], [0.3, 0.3]]
    streams = [{"count": 150, "fill": box, "seed": seed, "interact": True} for seed in (1, 2)]
    particles = [{"name": "a", "radius": 0.004}, {"name": "b", "radius": 0.007}]
    for one, kind in zip(streams, "ab", strict=True):
        one["particle"] = kind
    line = {"name": "line", "from": [0.0, -0.01], "to": [1.0, -0.01]}
    tables = {"particle": particles, "surface": [line], "stream": streams}
    machine = build(scene.from_dict(tables))
    apart = machine.releases.position[:, None] - machine.releases.position
    radius = machine.particle.radius
    free = np.hypot(*apart.T) - radius[:, None] - radius + np.eye(300)
    assert free.min() >= -1e-15


def test_a_box_is_not_looked_through_for_ever():
    """One row of 49 million places, all in a line: of them a million are tried."""
    line = {"name": "line", "from": [0.0, 0.001], "to": [1e5, 0.001]}
    stream = {"count": 10, "fill": [[0.0, 0.0], [1e5, 0.0025]], "interact": True}
    tables = {"particle": {"radius": 0.001}, "surface": [line], "stream": stream}
    with pytest.raises(scene.SceneError, match="a larger box: none of radius"):
        build(scene.from_dict(tables))


@pytest.mark.parametrize(
    "stream",
    [
        {"at": [0.0, 1.0], "velocity": [0.0, 0.0], "rate": 1e9, "bed_height": 1.0},
        {"fill": [[0.0, 0.0], [1e5, 10.0]]},
    ],
    ids=["bed", "box"],
)
def test_seconds_allowed_are_those_of_the_set_up_too(stream):
    line = {"name": "line", "from": [0.0, -0.1], "to": [15.0, -0.1]}
    stream = {"count": 2_000_000, "interact": True, **stream}
    made = scene.from_dict({"surface": [line], "stream": stream})
    began = process_time()
    with pytest.raises(
        scene.SceneError, match=r"stream\.count = 2000000: must be fewer, or more seconds"
    ):
        simulate(made, max_seconds=0.02)
    assert process_time() - began < 2.0


def bed(*overrides):
    """Return a run of layers of a bed, until all are off the pulley."""
    found = scene.load("stream", ["stream.count=40", "run.until=2.8", *overrides])
    recording = contact.run(build(found))
    released = recording.select(Kind.RELEASE)
    return recording, squeeze(found, released["t"], released["position"])


@pytest.mark.parametrize(
    "speed", [0.7, *(pytest.param(v, marks=pytest.mark.slow) for v in (0.5, 0.9))]
)
def test_layers_on_a_slow_pulley_ride_into_each_other(speed):
    """As deep as the tracks of a run say, in which riders cannot be pushed."""
    recording, found = bed(f"incoming.speed={speed}")
    leaves = np.full(40, np.inf)
    left = recording.first(recording.select(Kind.SEPARATION, surface="incoming"))
    leaves[left["particle"]] = left["t"]
    times = np.linspace(0.0, 2.8, 8000)
    place, _ = recording.at(times)
    place[times[:, None] >= leaves] = np.nan
    depth = np.zeros(40)
    for i in range(40):
        apart = np.hypot(*np.moveaxis(place - place[:, i : i + 1], 2, 0))
        apart[:, i] = np.nan
        depth[i] = np.nanmax(2.0 * r - apart, initial=0.0)
    # Between two of these times they get up to 2 v Δt nearer to each other.
    assert depth.max() == pytest.approx(found.deepest, abs=2.0 * speed * 2.8 / 8000)
    assert found.deepest > 0.1 * r
    assert abs(np.count_nonzero(depth > DEEP * r) - found.particles) <= 1
    highest = recording.select(Kind.RELEASE)["position"][:, 1].max()
    assert found.grip == pytest.approx(speed**2 / (G * highest), rel=1e-12, abs=0.0)


@pytest.mark.parametrize(
    "overrides",
    [
        # sqrt(g (0.1063 + 0.05)) = 1.2383 m/s: all leave at the top.
        ("incoming.speed=1.24",),
        # One layer, 14 mm between centres of 12.6 mm: none is nearer on the chord than that.
        ("incoming.speed=0.7", "stream.bed_height=0", "stream.rate=50"),
        ("incoming.speed=0.7", "incoming.friction=0.5"),
        ("incoming.speed=0.7", "stream.interact=false"),
    ],
)
def test_where_none_rides_into_another_nothing_is_said(overrides):
    assert bed(*overrides)[1] is None


def is_refused(tables):
    try:
        build(scene.from_dict(tables))
    except scene.SceneError as error:
        return "inside" in str(error)
    return False


def depth(outline, points):
    """How deep the deepest of the points lies in a convex polygon, m; negative outside."""
    sides = np.roll(outline, -1, axis=0) - outline
    away = points[:, None] - outline
    across = sides[:, 0] * away[..., 1] - sides[:, 1] * away[..., 0]
    return (across / np.hypot(*sides.T)).min(axis=1).max()


@pytest.mark.parametrize("kind", ["line", "arc", "pulley"])
def test_a_polygon_is_refused_exactly_where_a_surface_passes_through_it(kind):
    """Of random boxes and triangles, against many points of the surface."""
    rng, told = np.random.default_rng(1), {True: 0, False: 0}
    for draw in range(75):
        size, turn = rng.uniform(0.02, 0.5, 2), rng.uniform(-np.pi, np.pi)
        corners = size * [(-0.5, -0.5), (0.5, -0.5), (0.5, 0.5), (-0.5, 0.5)]
        shape = {"shape": "box", "size": size.tolist()}
        if draw % 2:
            angles = rng.uniform(0.0, 2.0, 3) + np.array([0.0, 2.1, 4.2])
            corners = size * np.column_stack([np.cos(angles), np.sin(angles)])
            corners -= corners.mean(axis=0)
            shape = {"shape": "polygon", "points": corners.tolist()}
        at, radius = rng.uniform(-0.4, 0.4, 2), rng.uniform(0.02, 0.4)
        c, s = np.cos(turn), np.sin(turn)
        outline = corners @ np.array([[c, s], [-s, c]]) + at
        share, tables = np.linspace(0.0, 1.0, 3_001)[:, None], {}
        if kind == "line":
            a, b = rng.uniform(-0.5, 0.5, (2, 2))
            points = a + share * (b - a)
            tables["surface"] = [{"name": "s", "from": a.tolist(), "to": b.tolist()}]
        else:
            begin, way = rng.uniform(0.0, 360.0), rng.uniform(5.0, 330.0)
            way = 360.0 if kind == "pulley" else way
            angles = np.radians(begin + share * way)
            points = radius * np.hstack([np.cos(angles), np.sin(angles)])
            arc = {"center": [0.0, 0.0], "radius": radius, "from_deg": begin, "to_deg": begin + way}
            tables["surface"] = [{"name": "s", **arc}]
        if kind == "pulley":
            ends = {"from": [0.0, 0.0], "to": [900.0, 0.0], "pulley_radius": radius}
            tables = {"conveyor": [{"name": "s", **ends, "speed": 0.0}]}
            points = np.vstack([points * n for n in np.linspace(0.0, 1.0, 20)])
            belts = np.hstack([share, np.full_like(share, radius)])
            points = np.vstack([points, belts, belts * [1.0, -1.0]])
        gap = np.hypot(*np.diff(points[:3_001], axis=0).T).max()
        gap = max(gap, radius / 19) if kind == "pulley" else gap
        deep = depth(outline, points)
        stream = {"at": at.tolist(), "velocity": [0.0, 0.0], "angle_deg": np.degrees(turn).item()}
        tables |= {"particle": {**shape, "mass": 0.1, "spin": True}, "stream": stream}
        if deep > 1e-8 or deep < -gap:
            told[deep > 0.0] += 1
            assert is_refused(tables) == (deep > 0.0), (draw, deep)
    assert min(told.values()) > 10


def test_a_long_box_is_refused_across_an_arc_and_free_above_two_posts():
    def tables(width, y, *surfaces):
        box = {"shape": "box", "size": [width, 0.05], "mass": 0.5, "spin": True}
        named = [{"name": f"s{n}", **one} for n, one in enumerate(surfaces)]
        return {"particle": box, "surface": named, "stream": {"at": [0.0, y], "velocity": [0, 0]}}

    bowl = {"center": [0.0, 0.0], "radius": 0.3, "from_deg": 180.0, "to_deg": 360.0}
    # Its lower corners lie on the bowl if y = 0.025 - sqrt(0.3² - 0.25²).
    lowest = 0.025 - np.sqrt(0.3**2 - 0.25**2).item()
    assert is_refused(tables(0.5, lowest - 1e-8, bowl))
    assert not is_refused(tables(0.5, lowest - 5e-10, bowl))
    # Up to 1e-9 m are moved out: here of a box that stands on its lowest corner.
    stands = tables(0.05, np.sqrt(2.0).item() * 0.025 - 0.3 - 5e-10, bowl)
    stands["stream"]["angle_deg"] = 45.0
    found = build(scene.from_dict(stands)).releases.position[0]
    assert found == pytest.approx([0.0, np.sqrt(2.0) * 0.025 - 0.3], abs=1e-15)
    posts = [{"from": [x, -1.0], "to": [x, 0.0]} for x in (-0.2, 0.3)]
    assert not is_refused(tables(0.6, 0.025, *posts))
    assert is_refused(tables(0.6, 0.025 - 1e-8, *posts))


def test_a_surface_that_waits_to_be_touched_for_is_not_in_the_way_at_the_release():
    gate = {"name": "gate", "from": [-1.0, 0.5], "to": [1.0, 0.5]}
    floor = {"name": "floor", "from": [-1.0, 0.0], "to": [1.0, 0.0]}
    stream = {"at": [0.0, 0.5], "velocity": [0.0, 0.0]}
    assert is_refused({"surface": [gate, floor], "stream": stream})
    waits = {"closes_when": {"touched": "floor"}}
    assert not is_refused({"surface": [gate | waits, floor], "stream": stream})


@pytest.mark.parametrize("shapes", [("box", "disk"), ("disk", "box"), ("box", "box")])
@pytest.mark.parametrize("starts", [(0.0, 0.0), (0.0, 0.0105)])
@pytest.mark.parametrize("beside", [False, True])
def test_what_is_struck_right_after_its_release_gets_the_blow(shapes, starts, beside):
    """Within a step, and before any other impact: J = (1 + e) v m / 2 at the time gap / v.

    A surface somewhere else changes nothing.
    """
    gap, v, e, m = 1e-4, 1.0, 0.5, 0.3
    size = {"box": {"size": [0.05, 0.05]}, "disk": {"radius": 0.025}}
    both = {"interact": True, "friction": 0.0, "restitution": e}
    rows = [
        {"particle": shape, "at": [x, 0.0], "velocity": [-u, 0.0], "start": start, **both}
        for shape, x, u, start in zip(shapes, (0.0, 0.05 + gap), (0.0, v), starts, strict=True)
    ]
    tables = {
        "gravity": 0.0,
        "particle": [{"name": s, "shape": s, "mass": m, "spin": True, **size[s]} for s in size],
        "stream": rows,
        "run": {"until": starts[1] + 3e-3, "dt": 1e-3},
    }
    if beside:
        tables["surface"] = [{"name": "floor", "from": [-1.0, -1.0], "to": [1.0, -1.0]}]
    found = simulate(tables, engine="contact")
    blows = found.select(Kind.COLLISION)
    assert np.unique(blows["t"]) == pytest.approx([starts[1] + gap / v], abs=1e-12)
    assert blows["normal_impulse"].sum() == pytest.approx(0.5 * (1.0 + e) * m * v, rel=1e-12)
