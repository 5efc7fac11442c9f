"""From a scene to surfaces, releases and the nominal particle, against formulas by hand."""

import re
from math import atan2, cos, hypot, inf, radians, sin, sqrt

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from chutelab import machine, scene
from machines import nominal

G, R, GAP, V, DROP, r = 9.81, 0.1, 0.5, 2.0, 0.5, 0.0063


def built(source="<scene>", **tables):
    """The machine of `perpendicular`, with keys changed, tables added, or dropped where None."""
    mapping = {
        "incoming": {"speed": V, "pulley_radius": R},
        "plate": {"distance": GAP},
        "outgoing": {"drop": DROP},
    }
    for name, keys in tables.items():
        mapping[name] = {**mapping.get(name, {}), **keys} if isinstance(keys, dict) else keys
    kept = {name: keys for name, keys in mapping.items() if keys is not None}
    return machine.build(scene.from_dict(kept, source))


def segment(found, name):
    index = np.flatnonzero(found.segments.surface == found.surfaces.index(name))[0]
    return found.segments.start[index], found.segments.end[index], index


def impact(alpha, *, radius=r, pivot=R, speed=V, angle=0.0):
    """Centre when it first is r in front of the plate's line, from separation at `angle`."""
    rc, d = R + radius, R + GAP
    x, y = rc * sin(angle), rc * cos(angle)
    vx, vy = speed * cos(angle), -speed * sin(angle)
    c, s = cos(alpha), sin(alpha)
    gaps = [0.5 * G * s, -(vx * c + vy * s), (d - x) * c + (pivot - y) * s - radius]
    roots = np.roots(gaps)
    t = min(root.real for root in roots if abs(root.imag) == 0.0 and root.real > 0.0)
    return np.array([x + vx * t, y + vy * t - 0.5 * G * t * t])


@given(
    # np.roots divides by the sine of the angle.
    alpha=st.floats(-50.0, 10.0).filter(lambda a: a == 0.0 or abs(a) > 1e-9),
    radius=st.one_of(st.just(0.0), st.floats(1e-4, 0.03)),
    speed=st.floats(1.5, 6.0),
    pivot=st.floats(-0.1, 0.3),
)
def test_the_belt_hangs_from_the_impact_and_the_plate_stops_short_of_it(
    alpha, radius, speed, pivot
):
    plate = {"angle_deg": alpha, "pivot_height": pivot, "above": 1.5}
    found = built(particle={"radius": radius}, incoming={"speed": speed}, plate=plate)
    angle = radians(alpha)
    height = impact(angle, radius=radius, speed=speed, pivot=pivot)[1] - DROP - radius
    start, end, _ = segment(found, "outgoing")
    assert start == pytest.approx([-2.0, height], abs=1e-13)
    assert end == pytest.approx([4.0, height], abs=1e-13)
    low, high, index = segment(found, "plate")
    up = np.array([-sin(angle), cos(angle)])
    assert low[1] == pytest.approx(height + max(0.05, 3.0 * radius), abs=1e-13)
    assert high == pytest.approx([R + GAP, pivot] + 1.5 * up, abs=1e-14)
    assert (low - [R + GAP, pivot]) @ [cos(angle), sin(angle)] == pytest.approx(0.0, abs=1e-14)
    tx, ty = found.segments.tangent[index]
    assert (-ty, tx) == pytest.approx((-cos(angle), -sin(angle)), abs=1e-15)


def test_a_belt_hangs_from_a_ride_round_the_pulley_too():
    speed, rc = 0.8, R + r
    phi = np.arccos(speed**2 / (G * rc))
    start, _, _ = segment(built(incoming={"speed": speed}), "outgoing")
    expected = impact(0.0, speed=speed, angle=phi)[1] - DROP - r
    assert start[1] == pytest.approx(expected, abs=1e-14)


def test_the_other_surfaces_stand_where_the_scene_says():
    found = built(
        particle={"spin": True},
        incoming={"length": 1.5, "friction": 0.3, "restitution": 0.2},
        outgoing={"speed": -1.0, "start": -0.5, "length": 2.0, "restitution": 0.1, "friction": 0.7},
        surface=[
            {
                "name": "chute", "points": [[1.0, 0.0], [1.0, 3.0], [5.0, 0.0]],
                "speed": 0.5, "restitution": 0.6, "friction": 0.8,
            }
        ],
    )  # fmt: skip
    assert found.surfaces == ("incoming", "plate", "outgoing", "chute")
    assert found.segments.surface.tolist() == [0, 1, 2, 3, 3]
    assert found.landing == 2
    assert found.segments.start[[0, 3, 4]].tolist() == [[-1.5, R], [1.0, 0.0], [1.0, 3.0]]
    assert found.segments.end[[0, 3, 4]].tolist() == [[0.0, R], [1.0, 3.0], [5.0, 0.0]]
    assert found.segments.length[[0, 3, 4]].tolist() == [1.5, 3.0, 5.0]
    assert found.segments.tangent[[0, 3, 4]].tolist() == [[1, 0], [0, 1], [0.8, -0.6]]
    assert found.segments.speed.tolist() == [2.0, 0.0, -1.0, 0.5, 0.5]
    assert found.segments.restitution.tolist() == [0.2, 0.5, 0.1, 0.6, 0.6]
    assert found.segments.friction.tolist() == [0.3, 0.0, 0.7, 0.8, 0.8]
    assert segment(found, "outgoing")[1][0] - segment(found, "outgoing")[0][0] == 2.0
    assert found.pulley == machine.Pulley(R, V, 0.3, 0.2, 0)
    assert built().pulley.friction == built().segments.friction[0] == inf
    assert found.particle.inertia == 0.5 * 0.008 * r**2
    assert built().particle.inertia == 0.0
    with pytest.raises(ValueError, match="read-only"):
        found.segments.start[0] = 0.0


@pytest.mark.parametrize(
    ("tables", "key", "words"),
    [
        ({"plate": {"angle_deg": 60.0}}, "outgoing.drop_from", "never meets"),
        ({"incoming": {"speed": 0.0}}, "outgoing.drop_from", "never meets"),
        # from behind the plate, over its top, and back onto the face
        ({"plate": {"angle_deg": -30.0}, "stream": {"at": [0.8, 0.2], "velocity": [-2.0, 0.0]}},
         "outgoing.drop_from", "never meets"),
        ({"plate": {"below": 0.2}}, "plate.below", "0.4259 m below the pivot"),
        ({"plate": {"pivot_height": -0.8}}, "plate.above", "0.4741 m above the pivot"),
        ({"plate": {"above": 0, "pivot_height": -1}, "outgoing": {"drop_from": "top"}},
         "plate.above", "more than 0"),
    ],
)  # fmt: skip
def test_a_machine_that_contradicts_itself_is_refused(tables, key, words):
    # the impact lies g (0.5937 / 2)²/2 - r = 0.4259 m below the pulley's top
    with pytest.raises(scene.SceneError, match=r"mine\.toml") as raised:
        built("mine.toml", **tables)
    assert [fault.key for fault in raised.value.faults] == [key]
    assert key in str(raised.value)
    assert words in str(raised.value)
    if "outgoing" not in tables:
        assert 'outgoing.drop_from = "top"' in str(raised.value)
        # and that is what helps
        assert built(**{**tables, "outgoing": {"drop_from": "top"}}).warnings


@pytest.mark.parametrize("speed", [1.9, 2.0, 2.1, 2.2, 2.3])
def test_the_advice_of_a_refusal_is_enough(speed):
    with pytest.raises(scene.SceneError) as raised:
        built(incoming={"speed": speed}, plate={"below": 0.1})
    (length,) = re.findall(r"at least (\S+) m", str(raised.value))
    start, _, _ = segment(built(incoming={"speed": speed}, plate={"below": float(length)}), "plate")
    assert start[1] == pytest.approx(impact(0.0, speed=speed)[1], abs=1.001e-4)


def crossed(**tables):
    found = falling(**tables).warnings
    return {frozenset((caution.surface, caution.crosses)) for caution in found}


@pytest.mark.parametrize("low", [False, True])
@pytest.mark.parametrize("seed", range(25))
def test_arcs_that_cross_are_warned_of(seed, low):
    """By hand: along each of two pieces, the side of the other's carrier changes on the other."""
    draw = np.random.default_rng(seed)
    parts, curves = [], []
    for name in ("one", "two"):
        center, radius = draw.uniform(-0.5, 0.5, 2), draw.uniform(0.3, 0.9)
        begin, extent = draw.uniform(-180.0, 180.0), draw.uniform(60.0, 300.0)
        if name == "one" and low:
            a, b = draw.uniform(-1.0, 1.0, (2, 2))
            parts.append({"name": name, "from": a.tolist(), "to": b.tolist()})
            curves.append(a + np.linspace(0.0, 1.0, 4001)[:, None] * (b - a))
            continue
        angle = np.radians(begin + np.linspace(0.0, extent, 4001))
        parts.append({
            "name": name, "center": center.tolist(), "radius": radius, "from_deg": begin,
            "to_deg": begin + extent,
        })  # fmt: skip
        curves.append(center + radius * np.stack([np.cos(angle), np.sin(angle)], axis=1))
    inside = np.hypot(*(curves[0] - center).T) < radius
    met = curves[0][1:][inside[1:] != inside[:-1]] - center
    turn = np.degrees(np.arctan2(met[:, 1], met[:, 0])) - begin
    want = bool((np.mod(turn, 360.0) < extent).any())
    assert crossed(surface=parts) == ({frozenset(("one", "two"))} if want else set())


def test_arcs_that_touch_do_not_cross():
    """A chute that goes tangentially over into a spoon, pegs side by side, rings in each other."""
    spoon = {"name": "spoon", "center": [0.0, 0.0], "radius": 0.5, "from_deg": 180, "to_deg": 270}
    chute = {"name": "chute", "from": [-0.5, 1.0], "to": [-0.5, 0.0]}
    assert crossed(surface=[spoon, chute]) == set()
    assert crossed(surface=[spoon, {**chute, "to": [-0.5, -0.1]}]) == set()
    through = {**chute, "from": [-0.4, 1.0], "to": [-0.4, -1.0]}
    assert crossed(surface=[spoon, through]) == {frozenset(("chute", "spoon"))}
    assert crossed(surface=[spoon, {**through, "to": [-0.4, -0.3]}]) == set()
    ring = {"name": "one", "center": [0.0, 0.0], "radius": 0.5}
    for x, radius in ((1.0, 0.5), (0.1, 0.4), (0.0, 0.3)):
        other = {"name": "two", "center": [x, 0.0], "radius": radius}
        assert crossed(surface=[ring, other]) == set()
        wider = {**other, "radius": radius + 0.01}
        assert len(crossed(surface=[ring, wider])) == (1 if x else 0)


@pytest.mark.parametrize("bent", [False, True])
def test_gates_cross_only_what_is_there_while_they_are(bent):
    flat = {"name": "flat", "from": [2.0, 2.0], "to": [3.0, 2.0]}
    upright = {"name": "upright", "from": [2.5, 1.5], "to": [2.5, 2.5]}
    if bent:
        upright = {"name": "upright", "center": [2.5, 2.0], "radius": 0.3, "to_deg": 180.0,
                   "from_deg": -180.0}  # fmt: skip
    said = (machine.Caution("upright", crosses="flat"),)
    for times, warnings in [
        (({}, {}), said),
        (({"opens_at": 1.0}, {"closes_at": 0.9}), said),
        (({"opens_at": 1.0}, {"closes_at": 1.0}), ()),
        (({"closes_at": 2.0}, {"opens_at": 1.0}), ()),
        (({"closes_at": 2.0}, {}), said),
    ]:
        assert built(surface=[flat | times[0], upright | times[1]]).warnings == warnings


def exit_box(found, particle=0):
    """Return left, bottom, right and top of a particle's box."""
    return found.releases.exit_box[particle].tolist()


def test_the_scene_ends_a_metre_below_or_without_gravity_around_it():
    found = built()
    assert exit_box(found) == [-inf, segment(found, "outgoing")[0][1] - 1.0, inf, inf]
    left, bottom, right, top = exit_box(built(gravity=0.0))
    # without gravity the impact is at Rc and the belt 0.5 m + r lower
    assert (left, right, top) == pytest.approx((-3.0, 5.0, 1.4), abs=1e-15)
    assert bottom == pytest.approx(R - DROP - 1.0, abs=1e-15)
    bare = exit_box(built(gravity=0.0, plate=None, outgoing=None))
    # it is released on the belt, its centre r above
    assert bare == pytest.approx((-2.0, -R - 1.0, R + 1.0, R + 0.0063 + 1.0), abs=1e-15)
    low = built(stream={"at": [0.5, -9.0], "velocity": [0.0, 5.0]}, plate=None, outgoing=None)
    assert exit_box(low) == [-inf, -10.0, inf, inf]


def test_all_that_a_scene_has_is_in_the_box_where_it_ends():
    def box(**tables):
        tables = {"stream": {"at": [2.0, 3.0], "velocity": [0.0, 0.0]}, "gravity": 0.0, **tables}
        return machine.build(scene.from_dict(tables))

    assert exit_box(box()) == [1.0, 2.0, 3.0, 4.0]
    # An arc from 30 to 300 degrees of radius 2 round (2, 3): it has its top, its left and its
    # bottom at 90, 180 and 270 degrees; rightmost is its first end, x = 2 + 2 cos 30° = 2 + √3.
    arc = {"name": "a", "center": [2.0, 3.0], "radius": 2.0, "from_deg": 30.0, "to_deg": 300.0}
    expected = [0.0 - 1.0, 1.0 - 1.0, 2.0 + 3.0**0.5 + 1.0, 5.0 + 1.0]
    assert exit_box(box(surface=[arc])) == pytest.approx(expected, abs=1e-14)
    # A string reaches as far all round as its length, 3-4-5 if it has to span that.
    for length, reach in ((7.0, 7.0), (None, 5.0)):
        string = {"from": [5.0, 7.0]} | ({"length": length} if length else {})
        expected = [4.0 - reach, 6.0 - reach, 6.0 + reach, 8.0 + reach]
        assert exit_box(box(string=[string])) == pytest.approx(expected, abs=1e-14)
    # Of two that meet, one's box holds the other's release too, but not of two that do not.
    streams = [{"at": [x, 0.0], "velocity": [0.0, 0.0]} for x in (0.0, 4.0)]
    apart = box(stream=streams)
    assert [exit_box(apart, n)[0] for n in (0, 1)] == [-1.0, 3.0]
    crowd = box(stream=[{**stream, "interact": True} for stream in streams])
    assert [exit_box(crowd, n)[0] for n in (0, 1)] == [-1.0, -1.0]


def test_runs_end_in_time():
    stream = {"count": 11, "rate": 5.0}
    assert built(stream=stream, run={"max_time": 3.0}).end_time == 5.0
    timed = built(stream=stream, run={"until": 1.25})
    assert (timed.end_time, timed.until) == (1.25, "time")
    assert built(run={"until": 100.0}).end_time == 30.0
    assert built().until == "landed"
    assert built(outgoing=None).until == "settled"


def test_a_slow_release_is_drawn_along_the_belt():
    changes = ["incoming.speed=9", "incoming.friction=0.4", "stream.velocity=[1.5, 0.0]"]
    position, velocity, _ = nominal(scene.load("perpendicular", changes))
    assert position.tolist() == [0.0, R + r]
    assert velocity == pytest.approx((sqrt(1.5**2 + 2 * 0.4 * G * 1.0), 0.0), rel=1e-15, abs=0.0)


def test_a_box_may_stand_on_a_floor_from_the_beginning():
    def standing(height):
        return machine.build(scene.from_dict({
            "particle": {"shape": "box", "size": [0.02, 0.1], "mass": 0.1, "spin": True},
            "surface": [{"name": "floor", "from": [-1.0, 0.0], "to": [1.0, 0.0]}],
            "stream": {"at": [0.0, height], "velocity": [0.0, 0.0]},
        }))  # fmt: skip

    assert standing(0.05).releases.position.tolist() == [[0.0, 0.05]]
    # I = m (w² + h²) / 12
    inertia = 0.1 * (0.02**2 + 0.1**2) / 12.0
    assert standing(0.05).particle.inertia == pytest.approx(inertia, rel=1e-14, abs=0.0)
    with pytest.raises(scene.SceneError, match=r"at least 0\.05 m from floor"):
        standing(0.049)


def falling(**tables):
    """Return a machine of particles that fall past a few surfaces."""
    dropped = {"at": [0.0, 1.0], "velocity": [0.0, 0.0]}
    return machine.build(scene.from_dict({"stream": dropped, **tables}))


def test_a_gate_that_opens_and_closes_again_is_two_pieces():
    line = {"from": [0.0, 0.0], "to": [1.0, 0.0]}
    found = falling(surface=[
        {"name": "always", **line},
        {"name": "opens", **line, "opens_at": 1.0},
        {"name": "closes", **line, "closes_at": 1.0},
        {"name": "shut-between", **line, "closes_at": 1.0, "opens_at": 2.0},
        {"name": "open-between", **line, "opens_at": 1.0, "closes_at": 2.0},
    ])  # fmt: skip
    there = {
        name: [
            (found.segments.appears[k], found.segments.vanishes[k])
            for k in np.flatnonzero(found.segments.surface == n)
        ]
        for n, name in enumerate(found.surfaces)
    }
    assert there == {
        "always": [(-inf, inf)],
        "opens": [(-inf, 1.0)],
        "closes": [(1.0, inf)],
        "shut-between": [(1.0, 2.0)],
        "open-between": [(-inf, 1.0), (2.0, inf)],
    }


def test_copies_are_rows_of_rows_of_one_surface():
    pegs = {
        "name": "pegs",
        "center": [1.0, 2.0],
        "radius": 0.1,
        "repeat": [[3, 0.5, 0.0], [2, 0.25, -1.0]],
    }
    found = falling(surface=[pegs])
    assert found.surfaces == ("pegs",)
    assert found.arcs.center.tolist() == [
        [1.0, 2.0], [1.5, 2.0], [2.0, 2.0], [1.25, 1.0], [1.75, 1.0], [2.25, 1.0]
    ]  # fmt: skip
    assert found.arcs.whole.all()


@pytest.mark.parametrize(("first", "last", "clockwise"), [(0.0, 90.0, -1.0), (90.0, 0.0, 1.0)])
def test_an_arc_runs_from_its_first_angle_to_its_last(first, last, clockwise):
    arc = {"name": "arc", "center": [0.0, 0.0], "radius": 0.5, "from_deg": first, "to_deg": last}
    arcs = falling(surface=[{**arc, "speed": 2.0}]).arcs
    assert arcs.begin.tolist() == [0.0]
    assert arcs.extent.tolist() == [radians(90.0)]
    assert arcs.speed.tolist() == [2.0 * clockwise]
    begin, end = arcs.ends
    assert begin == pytest.approx(np.array([[0.5, 0.0]]), rel=0.0, abs=1e-16)
    assert end == pytest.approx(np.array([[0.0, 0.5]]), rel=0.0, abs=1e-16)


@pytest.mark.parametrize("to", [(3.0, 1.0), (-1.0, 0.5)])
def test_a_conveyor_runs_forward_on_top_and_back_below(to):
    belt = {"name": "belt", "from": [1.0, 0.0], "to": list(to), "pulley_radius": 0.2, "speed": 3.0}
    found = falling(conveyor=[belt])
    way = np.subtract(to, (1.0, 0.0)) / hypot(to[0] - 1.0, to[1])
    start, end, tangent = found.segments.start, found.segments.end, found.segments.tangent
    # The top is above the axes, by the radius, and runs from the one to the other.
    top = np.array([-way[1], way[0]]) * (1.0 if way[0] > 0.0 else -1.0)
    assert top[1] > 0.0
    assert start[0] == pytest.approx(np.array([1.0, 0.0]) + 0.2 * top, rel=1e-14)
    assert end[1] == pytest.approx(np.array([1.0, 0.0]) - 0.2 * top, rel=1e-14)
    assert tangent[0] == pytest.approx(way, rel=1e-14)
    assert tangent[1] == pytest.approx(-way, rel=1e-14)
    assert found.segments.speed.tolist() == [3.0, 3.0]
    assert found.arcs.center.tolist() == [[1.0, 0.0], list(to)]
    assert found.arcs.speed.tolist() == [3.0 if way[0] > 0.0 else -3.0] * 2


@pytest.mark.parametrize("end", ["from", "to"])
def test_nothing_is_released_in_a_conveyors_pulley(end):
    belt = {"name": "belt", "from": [1.0, 0.0], "to": [3.0, 0.5], "pulley_radius": 0.2,
            "speed": 3.0}  # fmt: skip
    disk, (x, y) = {"radius": 0.02}, belt[end]
    for up in (0.0, 0.1, -0.17, 0.219):
        with pytest.raises(scene.SceneError, match=r"stream\.at = .*from belt") as caught:
            falling(particle=disk, conveyor=[belt], stream={"at": [x, y + up], "velocity": [0, 0]})
        assert caught.value.faults[0].key == "stream.at"
    above = {"at": [x, y + 0.2 / cos(atan2(0.5, 2.0)) + 0.021], "velocity": [0, 0]}
    falling(particle=disk, conveyor=[belt], stream=above)
    packed = {"fill": [[x - 0.4, y - 0.4], [x + 0.4, y + 0.4]], "count": 250}
    places = falling(particle=disk, conveyor=[belt], stream=packed).releases.position
    assert np.hypot(*(places - (x, y)).T).min() >= 0.22


MIXTURE = {
    "particle": [
        {"name": "small", "radius": [0.002, 0.004], "density": 2500.0},
        {"name": "large", "shape": "sphere", "spin": True, "mass": 0.5, "radius": 0.02},
    ],
    "stream": [
        {"particle": "small", "count": 500, "fill": [[0.0, 0.0], [0.3, 0.5]]},
        {"particle": "large", "count": 3, "at": [0.0, 1.0], "to": [1.0, 1.0], "velocity": [0, 0]},
    ],
}


def test_particles_of_several_kinds_are_arrays():
    found = machine.build(scene.from_dict(MIXTURE))
    radius, mass, kind = found.particle.radius, found.particle.mass, found.releases.kind
    assert kind.tolist() == [0] * 500 + [1] * 3
    assert radius[0] == 0.003  # the first has the mean
    assert radius[:500].min() >= 0.002
    assert radius[:500].max() <= 0.004
    # Drawn evenly: mean 3 mm, standard deviation (b - a) / sqrt(12).
    assert radius[:500].mean() == pytest.approx(0.003, rel=0.03)
    assert radius[:500].std() == pytest.approx(0.002 / sqrt(12.0), rel=0.1)
    assert mass[:500] == pytest.approx(2500.0 * 4.0 / 3.0 * np.pi * radius[:500] ** 3, rel=1e-13)
    assert mass[500:].tolist() == [0.5] * 3
    # 2/5 m r² of what turns
    assert found.particle.inertia[500:] == pytest.approx(0.4 * 0.5 * 0.02**2, rel=1e-14)
    assert not found.particle.inertia[:500].any()
    # A line without a rate: all at once, evenly spaced.
    assert found.releases.position[500:].tolist() == [[0.0, 1.0], [0.5, 1.0], [1.0, 1.0]]
    assert not found.releases.t.any()


def test_a_packed_box_holds_all_and_none_is_in_another_or_in_a_surface():
    wall = {"name": "wall", "from": [0.1, 0.0], "to": [0.2, 0.5]}
    peg = {"name": "peg", "center": [0.25, 0.1], "radius": 0.03}
    found = machine.build(scene.from_dict({**MIXTURE, "surface": [wall, peg]}))
    place, radius = found.releases.position[:500], found.particle.radius[:500]
    assert (place - radius[:, None]).min() >= 0.0
    assert (place + radius[:, None])[:, 0].max() <= 0.3
    apart = np.hypot(*(place[:, None] - place).transpose(2, 0, 1))
    np.fill_diagonal(apart, inf)
    assert (apart >= radius[:, None] + radius).all()
    along = np.array([0.1, 0.5])
    share = np.clip((place - [0.1, 0.0]) @ along / (along @ along), 0.0, 1.0)
    assert (np.hypot(*(place - [0.1, 0.0] - share[:, None] * along).T) >= radius).all()
    assert (abs(np.hypot(*(place - [0.25, 0.1]).T) - 0.03) >= radius).all()
    with pytest.raises(
        scene.SceneError, match=r"stream\[0\]\.fill = \[\[0.0, 0.0\], \[0.3, 0.5\]\]"
    ):
        machine.build(scene.from_dict(MIXTURE, overrides=["stream[0].count=5000"]))


def test_what_a_pair_meets_with_is_said_by_pair_then_surface_then_material():
    coal = {"name": "lump", "material": "coal", "radius": 0.01}
    document = {
        "particle": [coal, {"name": "ball"}],
        "surface": [{"name": "plain", "from": [0.0, 0.0], "to": [1.0, 0.0]}, {"name": "told",
         "from": [0.0, -1.0], "to": [1.0, -1.0], "restitution": 0.9}, {"name": "lined",
         "from": [0.0, -2.0], "to": [1.0, -2.0], "material": "rubber"}],
        "pair": [{"between": ["told", "lump"], "friction": 0.07}],
        "stream": [{"particle": "lump", "at": [0.0, 1.0], "velocity": [0.0, 0.0], "interact": True},
         {"particle": "ball", "at": [0.5, 1.0], "velocity": [0.0, 0.0], "friction": 0.04}],
    }  # fmt: skip
    found = machine.build(scene.from_dict(document))
    material = scene.materials.PRESETS["coal"].material
    assert found.segments.restitution.tolist() == [
        [material.restitution_steel, 0.9, material.restitution_rubber], [0.3, 0.9, 0.3]
    ]  # fmt: skip
    assert found.segments.friction.tolist() == [
        [material.friction_steel, 0.07, material.friction_rubber], [0.4, 0.4, 0.4]
    ]  # fmt: skip
    # Among themselves: coal's own; what the stream says; and of the two the geometric mean.
    mixed = sqrt(material.friction * 0.04)
    assert found.pair_friction == pytest.approx(
        np.array([[material.friction, mixed], [mixed, 0.04]]), rel=1e-15
    )
    assert found.particle.mass[0] == pytest.approx(
        material.density * 4.0 / 3.0 * np.pi * 0.01**3, rel=1e-15
    )


def test_a_rate_may_be_a_mass_per_time():
    rate = ["stream.rate='36 t/h'", "stream.count=3"]
    found = scene.load("perpendicular", rate)
    # 36 t/h are 10 kg/s, 1250 particles of 8 g a second.
    assert found.stream.rate == pytest.approx(1250.0, rel=1e-15)
    assert found.stream.mass_rate == pytest.approx(10.0, rel=1e-15)
    lighter = found.with_values({"particle.mass": 0.004})
    assert lighter.stream.rate == pytest.approx(2500.0, rel=1e-15)
    # Of a range the mean of r³ counts: (b⁴ - a⁴) / (4 (b - a)).
    mixed = found.with_values({"particle.radius": [0.003, 0.006], "particle.density": 2000.0})
    mean = 2000.0 * 4.0 / 3.0 * np.pi * (0.006**4 - 0.003**4) / (4.0 * 0.003)
    assert mixed.stream.rate == pytest.approx(10.0 / mean, rel=1e-14)
