"""What a piece of a surface is: nearest point, gap, normal, ends, box and path, by their formulas.

The references go along each piece in small steps: for an arc c + R (cos φ, sin φ).
"""

from dataclasses import dataclass, replace
from math import inf, pi

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from chutelab.checks.preflight import Part
from chutelab.checks.preflight.trial import built
from chutelab.checks.stress import Evidence
from chutelab.checks.stress.barriers import released_free
from chutelab.machine import Arcs, Segments, build, shapes
from chutelab.pictures.plots import overlay
from chutelab.results.arrival import fates
from chutelab.scene import from_dict
from handmade import recording_of

OWN = {"speed": 1.0, "restitution": 0.5, "friction": 0.2, "surface": 0, "one_sided": 0}
TIMES = {"appears": -inf, "vanishes": inf}
STEPS = 20_001

number, angle = st.floats(-3.0, 3.0), st.floats(-2.0 * pi, 2.0 * pi)
place = st.tuples(number, number)


def piece(kind, **shape):
    arrays = {**OWN, **TIMES, **shape}
    return kind(**{name: np.array([value]) for name, value in arrays.items()}).of(0)


segment = st.builds(
    lambda start, turn, length: piece(
        Segments, start=start, tangent=[np.cos(turn), np.sin(turn)], length=length
    ),
    place, angle, st.floats(0.01, 3.0),
)  # fmt: skip
arc = st.builds(
    lambda center, radius, begin, extent: piece(
        Arcs, center=center, radius=radius, begin=begin, extent=extent
    ),
    place, st.floats(0.01, 3.0), angle, st.floats(0.01, 2.0 * pi) | st.just(2.0 * pi),
)  # fmt: skip


def points_of(one):
    """Return points all along a piece, and unit normals there."""
    share = np.linspace(0.0, 1.0, STEPS)[:, None]
    if isinstance(one, Segments):
        left = np.array([-one.tangent[1], one.tangent[0]])
        return one.start + share * one.length * one.tangent, np.tile(left, (STEPS, 1))
    turn = one.begin + share * one.extent
    out = np.concatenate([np.cos(turn), np.sin(turn)], axis=1)
    return one.center + one.radius * out, out


@given(segment | arc, place)
def test_the_nearest_point_is_nearer_than_all_others(one, there):
    points, normals = points_of(one)
    far = np.hypot(*(points - there).T)
    step, gap = float(one.way) / STEPS, float(one.gap(np.array(there)))
    nearest = one.nearest(np.array(there))
    assert np.hypot(*(nearest - there)) == pytest.approx(gap, abs=1e-13)
    # So is the point that it is so far along.
    along = one.at(one.along(np.array(there)))
    assert np.hypot(*(along - there)) == pytest.approx(gap, abs=1e-12)
    # It is on the piece, and no point of that is nearer.
    off = np.hypot(*(points - nearest).T)
    assert off.min() <= step
    assert far.min() - step <= gap <= far.min() + 1e-13
    assert one.gap(np.array([there, there]), 0.1) == pytest.approx([gap - 0.1] * 2, abs=1e-13)
    index = int(off.argmin())
    if 10 < index < STEPS - 10 and gap > 1e-3:
        normal = one.normal(np.array(there))
        assert abs(normal @ normals[index]) == pytest.approx(1.0, abs=1e-6)
        # The way from there is along it.
        assert abs(normal @ one.away(np.array(there))) == pytest.approx(gap, rel=1e-9)


@given(segment | arc)
def test_ends_boxes_and_paths_are_those_of_all_its_points(one):
    points, _ = points_of(one)
    first, last = one.ends
    np.testing.assert_allclose([first, last], points[[0, -1]], atol=1e-13)
    # A step off an end, along the piece.
    step = float(one.way) / (STEPS - 1)
    for end, inward, after in zip(one.ends, one.inward, points[[1, -2]], strict=True):
        np.testing.assert_allclose(end + step * inward, after, atol=1e-3 * step)
    path = one.path()
    # Of an arc clockwise, as a positive speed leads.
    due = [first, last] if isinstance(one, Segments) else [last, first]
    np.testing.assert_allclose(path[[0, -1]], due, atol=1e-12)
    # A chord of an arc over an angle δ is off by R δ²/8 at most.
    off = one.way if isinstance(one, Segments) else one.radius
    assert one.gap(0.5 * (path[1:] + path[:-1])).max() <= 3.5e-4 * off + 1e-13
    np.testing.assert_allclose(one.at(np.array([0.0, one.way])), path[[0, -1]], atol=1e-12)
    low, high = one.boxes
    assert (low <= points + 1e-13).all()
    assert (high >= points - 1e-13).all()
    own = {field: np.array(getattr(one, field))[None] for field in one.__dataclass_fields__}
    corners = type(one)(**own).corners
    step = 2.0 * float(one.way) / STEPS
    np.testing.assert_allclose(corners.min(axis=0), points.min(axis=0), atol=step)
    np.testing.assert_allclose(corners.max(axis=0), points.max(axis=0), atol=step)


def test_pieces_of_a_machine_are_its_surfaces_and_the_pulley():
    """Also where a particle is: on the rim of the pulley, its gap is its height above it."""
    tables = {
        "incoming": {"speed": 2.0, "pulley_radius": 0.5},
        "outgoing": {"speed": 1.0, "drop": 1.0},
        "plate": {"distance": 0.6},
        "surface": [
            {"name": "gate", "from": [0, -3], "to": [1, -3], "opens_at": 2.0},
            {"name": "peg", "center": [3, 0], "radius": 0.1},
        ],
    }
    machine = build(from_dict(tables))
    assert machine.names == ["incoming", "plate", "outgoing", "gate", "peg", "pulley"]
    kinds = [Segments] * 4 + [Arcs] * 2
    assert [type(one) for one in machine.pieces] == kinds
    assert [bool(one.whole) for one in machine.pieces] == [False] * 4 + [True] * 2
    assert [bool(one.gate) for one in machine.pieces] == [name == "gate" for name in machine.names]
    gate, wheel = machine.pieces[3], machine.pieces[-1]
    assert gate.there(np.array([0.0, 2.0, 2.1])).tolist() == [True, False, False]
    assert gate.there(np.array([2.0, 2.2]), late=0.1).tolist() == [True, False]
    assert wheel.surface == 0
    assert wheel.gap(np.array([0.0, 0.52]), 0.02) == pytest.approx(0.0, abs=1e-15)


@dataclass(frozen=True, eq=False, kw_only=True)
class Ellipses(shapes.Pieces):
    """Right halves of upright ellipses, by their points: a kind that the sources do not know."""

    center: np.ndarray
    half: np.ndarray  # half axes, (..., S, 2)

    def of(self, which):
        own = {name: np.asarray(getattr(self, name))[which] for name in self.__dataclass_fields__}
        return type(self)(**own)

    def points(self, steps=721):
        turn = np.linspace(0.5 * pi, -0.5 * pi, steps)
        out = np.stack([np.cos(turn), np.sin(turn)], axis=-1)
        return self.center[..., None, :] + self.half[..., None, :] * out

    def away(self, places):
        away = places[..., None, :] - self.points()
        nearest = np.hypot(*np.moveaxis(away, -1, 0)).argmin(axis=-1)
        return np.take_along_axis(away, nearest[..., None, None], axis=-2)[..., 0, :]

    def normal(self, places):
        out = (places - self.away(places) - self.center) / self.half**2
        return out / np.hypot(*np.moveaxis(out, -1, 0))[..., None]

    way = property(lambda self: np.hypot(*np.diff(self.points(), axis=-2).T).sum(axis=0))
    whole = property(lambda self: np.zeros(np.shape(self.speed), dtype=bool))
    ends = property(lambda self: (self.points()[..., 0, :], self.points()[..., -1, :]))
    inward = property(lambda self: (np.array([1.0, 0.0]), np.array([1.0, 0.0])))
    boxes = property(lambda self: (self.center - self.half, self.center + self.half))
    corners = property(lambda self: self.points(3).reshape(-1, 2))

    def at(self, way):
        points = self.points()
        gone = np.append(0.0, np.hypot(*np.diff(points, axis=0).T).cumsum())
        return np.stack([np.interp(way, gone, axis) for axis in points.T], axis=-1)

    def along(self, places):
        gone = np.linspace(0.0, self.way, 721)
        return gone[((self.at(gone) - places[..., None, :]) ** 2).sum(axis=-1).argmin(axis=-1)]

    def path(self):
        return self.points(31)

    def told(self):
        return {}

    def where(self):
        return "an ellipse"


def test_a_new_kind_of_piece_is_drawn_described_and_checked_as_it_says_itself():
    """Half an ellipse in place of an arc; a disk with the height 2 b of its box lies on its top."""
    drawn = from_dict(
        {
            "particle": {"radius": 0.1},
            "stream": {"at": [0.0, 1.1], "velocity": [0.0, 0.0]},
            "surface": [{"name": "bow", "center": [0, 0], "radius": 1.0, "to_deg": 90}],
            "run": {"until": 0.1},
        }
    )
    machine = build(drawn)
    own = {name: getattr(machine.arcs, name) for name in (*OWN, *TIMES)}
    ellipse = Ellipses(center=np.zeros((1, 2)), half=np.array([[2.0, 1.0]]), **own)
    machine = replace(machine, arcs=ellipse)
    (one,) = machine.pieces
    assert one.gap(np.array([0.0, 1.1]), 0.1) == pytest.approx(0.0, abs=1e-12)
    assert machine.corners.max(axis=0) == pytest.approx([2.0, 1.0])
    assert next(built(machine)) == Part("bow", "an ellipse")
    still = [(t, 0.0, 1.1, 0.0, 0.0, 0.0) for t in (0.0, 0.1)]
    recording = recording_of(machine, still)
    assert fates(recording).tolist() == ["on bow"]
    figure = overlay(recording)
    (line,) = [line for line in figure.axes[0].lines if line.get_gid() == "surface bow"]
    np.testing.assert_allclose(line.get_xydata(), ellipse.of(0).path())
    assert released_free(Evidence(recording)).holds
    sunk = recording_of(machine, [(t, x, y - 1e-3, *more) for t, x, y, *more in still])
    assert released_free(Evidence(sunk)).figure == pytest.approx(1e-3, rel=1e-6)
