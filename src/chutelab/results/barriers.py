"""Where a track is inside a surface, or passes one: found on the whole path, not at its knots only.

Between two knots a track is a cubic with four control points. Its distance from the line of a
straight piece is a cubic too, the square of its distance from a centre one of degree 6: in
Bernstein's form neither is less than its least coefficient, nor more than its largest. So most
intervals are proven to be clear of a piece at once, all that are not are halved until they are, or
until they are short; what is left is measured. G. Farin, Curves and Surfaces for CAGD, ch. 5, 6.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from math import comb, inf
from typing import Any

import numpy as np

from chutelab.machine import Machine
from chutelab.results.evidence import Evidence
from chutelab.results.recording import blocks, hermite
from chutelab.results.surfaces import Piece
from chutelab.util.arrays import Bools, Floats, Ints

WIDTH = 64
"""Intervals of a block: those that follow each other are near each other, so that one box about
all of them tells which pieces they may meet."""

CHUNK = 1 << 12
"""Intervals that are looked at together: what is computed of them stays in the cache."""

POINTS = ("start", "tangent", "center")
"""What pieces have two numbers of."""

PAIRS = 1 << 14
"""Intervals beside pieces that are halved together."""

HALVINGS = 12
"""A flight of 5 m is looked at every millimetre, where it has to be."""

GATED = 200
"""Times at which it is asked whether a particle has got clear of a gate that shut on it."""

_LEFT = np.array([-1.0, 1.0])
"""What a tangent's coordinates, the second first, are times those of the normal on its left."""

_ROWS, _COLUMNS = np.triu_indices(4)
_SQUARE = np.zeros((7, 10))
for _n, (_i, _j) in enumerate(zip(_ROWS.tolist(), _COLUMNS.tolist(), strict=True)):
    _SQUARE[_i + _j, _n] = comb(3, _i) * comb(3, _j) / comb(6, _i + _j) * (1 + (_i != _j))
"""Coefficients of a squared cubic from the products of its own, of each two rows and columns."""


@dataclass(frozen=True)
class Hit:
    """A place where a particle is deeper in a piece than it may be, or passes it."""

    particle: int
    piece: int  # its number in `Evidence.pieces`
    t: float  # s
    position: tuple[float, float]  # m
    depth: float  # m
    passes: bool  # whether its centre gets to the other side, between the piece's ends


Kind = tuple[dict[str, Floats], Any, int]
"""Pieces of a kind: their numbers; what tells which paths are clear of them; the first's number."""


def _lines(machine: Machine) -> dict[str, Floats]:
    """Return starts, tangents (S, 2) and lengths (S,) of lines, of a family (N, S, ...)."""
    s = machine.segments
    return {"start": s.start, "tangent": s.tangent, "length": s.length}


def _rounds(machine: Machine) -> dict[str, Floats]:
    """Return centres (A, 2), radii, begins and extents (A,) of arcs, the drive pulley last."""
    arcs, wheel = machine.arcs, machine.pulley
    found = {name: getattr(arcs, name) for name in ("center", "radius", "begin", "extent")}
    if wheel is None:
        return found
    radius = np.asarray(wheel.radius, dtype=float)[..., None]
    none = np.zeros(radius.shape)
    own = {"center": np.zeros((*radius.shape, 2)), "radius": radius, "begin": none}
    own["extent"] = none + inf
    if not found["radius"].size:
        return own
    for n, mine in own.items():
        axis = -2 if n in POINTS else -1
        # Of a family either may have a row for each member.
        ahead = np.broadcast_shapes(mine.shape[:axis], found[n].shape[:axis])
        both = (np.broadcast_to(a, (*ahead, *a.shape[axis:])) for a in (found[n], mine))
        found[n] = np.concatenate(list(both), axis=axis)
    return found


def _count(table: dict[str, Floats]) -> int:
    return int(table["radius" if "radius" in table else "length"].shape[-1])


class Paths:
    """Intervals after knots (n,): control points (2, 4, n), m; owners, radii, what is allowed."""

    def __init__(self, e: Evidence, left: Ints) -> None:
        motion = e.columns[:5]
        first, last = motion.take(left, axis=1), motion.take(left + 1, axis=1)
        third = (last[0] - first[0]) / 3.0
        self.knots = left
        self.points = points = np.empty((2, 4, len(left)))
        points[:, 0], points[:, 3] = first[1:3], last[1:3]
        np.add(first[1:3], first[3:] * third, out=points[:, 1])
        np.subtract(last[1:3], last[3:] * third, out=points[:, 2])
        self.owner = np.zeros(0, dtype=np.int64)
        if np.ndim(e.limit_of) or e.family:
            self.owner = np.searchsorted(e.recording.offsets, self.knots, side="right") - 1
        self.limit = _of(e.limit_of, self.owner)


def _of(value: Any, which: Any) -> Any:
    return value if np.ndim(value) == 0 else value[which]


def _pick(table: dict[str, Floats], piece: Ints, owner: Ints | None) -> dict[str, Floats]:
    """Return the rows of some pieces; in a family those of their owners."""
    return {
        n: a[owner, piece] if a.ndim - (n in POINTS) > 1 else a.take(piece, axis=0)
        for n, a in table.items()
    }


def _distances(points: Floats, piece: dict[str, Any]) -> Any:
    """Return distances of control points (2, 4, ...) from lines, to their left positive, m."""
    start, tangent = piece["start"], piece["tangent"]
    tx, ty = tangent[..., 0], tangent[..., 1]
    found = tx * points[1]
    found -= ty * points[0]
    found -= tx * start[..., 1] - ty * start[..., 0]
    return found


def _squares(points: Floats, center: Floats) -> Any:
    """Return the coefficients (7, ...) of the square of the distance from centres, m²."""
    x, y = points[0] - center[..., 0], points[1] - center[..., 1]
    products = x.take(_ROWS, axis=0)
    products *= x.take(_COLUMNS, axis=0)
    of_y = y.take(_ROWS, axis=0)
    of_y *= y.take(_COLUMNS, axis=0)
    products += of_y
    return (_SQUARE @ products.reshape(10, -1)).reshape(7, *products.shape[1:])


def _clear_of_lines(points: Floats, piece: dict[str, Floats], limit: Any) -> Bools:
    """Tell which paths (m,) are proven to keep their distance from straight pieces (m,)."""
    d = _distances(points, piece)
    clear = (d.min(axis=0) >= limit) | (d.max(axis=0) <= -limit)
    if clear.all():
        return np.asarray(clear)
    start, tangent = piece["start"].T, piece["tangent"].T
    foot = tangent[0] * (points[0] - start[0]) + tangent[1] * (points[1] - start[1])
    low, high = foot.min(axis=0) - piece["length"], -foot.max(axis=0)
    clear |= np.maximum(low, high) >= np.maximum(limit, 0.0)
    if clear.all():
        return np.asarray(clear)
    before, beyond = high >= 0.0, low >= 0.0
    ended = (~clear & (before | beyond)).nonzero()[0]
    if len(ended):
        end = piece["start"] + np.where(before, 0.0, piece["length"])[:, None] * piece["tangent"]
        least = np.maximum(_of(limit, ended), 0.0) ** 2
        clear[ended] = _squares(points[:, :, ended], end[ended]).min(axis=0) >= least
    return np.asarray(clear)


def _clear_of_rounds(points: Floats, piece: dict[str, Floats], limit: Any) -> Bools:
    """Tell which paths (m,) are proven to keep their distance from bent pieces (m,)."""
    q, radius = _squares(points, piece["center"]), piece["radius"]
    clear = q.min(axis=0) >= (radius + limit) ** 2
    if clear.all():
        return np.asarray(clear)
    clear |= (q.max(axis=0) <= (radius - limit) ** 2) & (radius > limit)
    if clear.all():
        return np.asarray(clear)
    begin, end = piece["begin"], piece["begin"] + np.minimum(piece["extent"], 7.0)
    x, y = points - piece["center"].T[:, None]
    # Beyond the ends: not counterclockwise of the first, or not clockwise of the last; of an arc of
    # more than half a circle neither.
    not_after = (np.cos(begin) * y - np.sin(begin) * x).max(axis=0) <= 0.0
    not_before = (np.sin(end) * x - np.cos(end) * y).max(axis=0) <= 0.0
    large = piece["extent"] > np.pi
    off = np.where(large, not_after & not_before, not_after | not_before)
    ended = (~clear & off & (piece["extent"] < 2.0 * np.pi)).nonzero()[0]
    if len(ended):
        least = np.maximum(_of(limit, ended), 0.0) ** 2
        clear[ended] = True
        for angle in (begin[ended], end[ended]):
            arm = radius[ended, None] * np.stack([np.cos(angle), np.sin(angle)], axis=-1)
            q = _squares(points[:, :, ended], piece["center"][ended] + arm)
            clear[ended] &= q.min(axis=0) >= least
    return np.asarray(clear)


def hits(e: Evidence) -> list[Hit]:
    """Return where particles are deeper in surfaces than `Evidence.allowed`, or pass them.

    In the order of particles and time, one for each interval beside each piece. What stood in the
    way of a gate as it shut is spared until it is clear of it; what overlapped at its release may
    go on doing so, no deeper.
    """
    found, m = list[Hit](), e.machine
    kinds: list[Kind] = []
    if m.segments.length.size:
        kinds.append((_lines(m), _clear_of_lines, 0))
    if m.arcs.radius.size or m.pulley is not None:
        kinds.append((_rounds(m), _clear_of_rounds, m.segments.length.shape[-1]))
    if not kinds:
        return found
    way = e.columns[:3]
    moves = np.logical_or.reduce(way[:, 1:] != way[:, :-1], axis=0)
    if e.recording.count > 1:
        moves &= e.within
    left = moves.nonzero()[0]
    boxes = None if e.family else Boxes(kinds)
    # What follows each other is of one track only where tracks are long.
    short = len(e.columns[0]) < WIDTH * e.recording.count
    chunk = CHUNK if e.sized else max(1, len(left))
    for first in range(0, len(left), chunk):
        paths = Paths(e, left[first : first + chunk])
        n = len(paths.knots)
        near = None
        if boxes and (n <= WIDTH or not e.sized or (short and n * boxes.count <= PAIRS)):
            near = boxes.near(e, paths)
        for table, clear, number in kinds:
            if not e.sized:
                found += _turned(e, paths, table, number)
            if near is None:
                interval, piece = _unproven(e, paths, table)
            else:
                first_, beyond = near[1].searchsorted((number, number + _count(table))).tolist()
                interval, piece = near[0][first_:beyond], near[1][first_:beyond] - number
            if len(interval):
                interval, piece = _there(e, paths, interval, piece, bent="radius" in table)
            for begin in range(0, len(interval), PAIRS):
                some = slice(begin, begin + PAIRS)
                found += _settled(e, paths, interval[some], piece[some], table, clear, number)
    return sorted(found, key=lambda hit: (hit.particle, hit.t)) if len(found) > 1 else found


def _unproven(e: Evidence, paths: Paths, table: dict[str, Floats]) -> tuple[Ints, Ints]:
    """Return the intervals, and the pieces beside them, that one look does not prove clear."""
    points, n = paths.points, paths.points.shape[2]
    # Of a family a machine for each particle.
    width = 1 if e.family else WIDTH
    blocks_ = -(-n // width)
    if blocks_ * width > n:
        points = np.concatenate([points, points[:, :, -1:].repeat(blocks_ * width - n, 2)], axis=2)
    limit = paths.limit
    if np.ndim(limit):
        limit = np.append(limit, np.full(blocks_ * width - n, inf)).reshape(blocks_, width)
    cut = points.reshape(2, 4, blocks_, width)
    block, piece = _near(e, paths, cut, table)
    own = cut.take(block, axis=2)
    limit = limit[block] if np.ndim(limit) else limit
    chosen = _pick(table, piece, paths.owner[block] if e.family else None)
    row = {
        name: values[..., None, :] if name in POINTS else values[..., None]
        for name, values in chosen.items()
    }
    if "length" in table:
        d = _distances(own, row)
        doubt = (d.min(axis=0) < limit) & (d.max(axis=0) > -limit)
        if e.machine.pulley is not None and doubt.any():
            # The incoming belt ends on the pulley: beyond it that is what is near.
            belt = (piece == 0).nonzero()[0]
            x, y = own.take(belt, axis=2)
            start, tangent = row["start"][belt], row["tangent"][belt]
            foot = tangent[..., 0] * (x - start[..., 0]) + tangent[..., 1] * (y - start[..., 1])
            doubt[belt] &= foot.min(axis=0) < row["length"][belt]
    else:
        doubt = _near_round(own, row, limit)
    pair, column = doubt.nonzero()
    interval, piece = block[pair] * width + column, piece[pair]
    inside = interval < n
    return interval[inside], piece[inside]


def _near_round(points: Floats, piece: dict[str, Floats], limit: Any) -> Bools:
    """Tell which paths have boxes that are not clear of circles."""
    center, radius = np.moveaxis(piece["center"], -1, 0), piece["radius"]
    low, high = points.min(axis=1) - center, points.max(axis=1) - center
    x, y = np.maximum(np.maximum(low, -high), 0.0)
    doubt = x * x + y * y < (radius + limit) ** 2
    x, y = np.maximum(high, -low)
    inner = radius - limit
    doubt &= (x * x + y * y > inner * inner) | (inner <= 0.0)
    return np.asarray(doubt)


class Boxes:
    """A box about each of P pieces, the lines first, turned as the piece is.

    `ways`, (2 P, 2), are its sides' directions, one of each piece and then the other: across and
    along a line, x and y of a bent piece. `low` and `high`, (2, P, 1), m, are how far it goes.
    """

    def __init__(self, kinds: list[Kind]) -> None:
        tables = [table for table, _, _ in kinds]
        lines = _count(tables[0]) if "length" in tables[0] else 0
        self.count = count = sum(map(_count, tables))
        ways = np.zeros((2, count, 2))
        self.low, self.high = low, high = np.empty((2, 2, count, 1))
        self.along = np.zeros((2, count, 1), dtype=bool)
        if lines:
            start, tangent, length = (tables[0][name] for name in ("start", "tangent", "length"))
            ways[0, :lines], ways[1, :lines] = tangent[:, ::-1] * _LEFT, tangent
            low[:, :lines, 0] = high[:, :lines, 0] = np.add.reduce(ways[:, :lines] * start, axis=2)
            high[1, :lines, 0] += length
            self.along[1, :lines] = True
        if lines < count:
            center, radius = tables[-1]["center"].T, tables[-1]["radius"]
            ways[0, lines:, 0] = ways[1, lines:, 1] = 1.0
            low[:, lines:, 0], high[:, lines:, 0] = center - radius, center + radius
        self.ways = ways.reshape(-1, 2)

    def near(self, e: Evidence, paths: Paths) -> tuple[Ints, Ints]:
        """Return intervals, and in order the pieces of whose boxes they are not clear."""
        margin = paths.limit
        if not e.sized:
            # A point may be beyond a line by what is allowed, but not beside its ends.
            margin = np.where(self.along, np.maximum(margin, 0.0), margin)
        low, high = self.low - margin, self.high + margin
        if e.machine.pulley is not None and self.along[1, 0, 0]:
            # The incoming belt ends on the pulley: beyond it that is what is near.
            high[1, 0] = self.high[1, 0]
        found = (self.ways @ paths.points.reshape(2, -1)).reshape(2, self.count, 4, -1)
        doubt = np.minimum.reduce(found, axis=2) < high
        doubt &= np.maximum.reduce(found, axis=2) > low
        piece, interval = (doubt[0] & doubt[1]).nonzero()
        return interval, piece


def _there(
    e: Evidence, paths: Paths, interval: Ints, piece: Ints, *, bent: bool
) -> tuple[Ints, Ints]:
    """Return those intervals beside pieces in which the pieces are there for some time."""
    part = e.machine.arcs if bent else e.machine.segments
    if not len(part.appears) or max(part.appears.max(), -part.vanishes.min()) == -inf:
        return interval, piece
    always = np.append(part.appears, -inf), np.append(part.vanishes, inf)
    row = np.minimum(piece, len(part.appears))
    t, knot = e.recording.knots["t"], paths.knots[interval]
    kept = (t[knot + 1] >= always[0][row] + (e.dt or 0.0)) & (t[knot] <= always[1][row])
    return interval[kept], piece[kept]


def _near(e: Evidence, paths: Paths, points: Floats, table: dict[str, Floats]) -> tuple[Ints, Ints]:
    """Return blocks of intervals and pieces whose boxes touch."""
    reach = e.radius + e.allowed
    low, high = points.min(axis=(1, 3)), points.max(axis=(1, 3))
    if "length" in table:
        end = table["start"] + table["length"][..., None] * table["tangent"]
        least, most = np.minimum(table["start"], end), np.maximum(table["start"], end)
    else:
        arm = table["radius"][..., None]
        least, most = table["center"] - arm, table["center"] + arm
    if e.family and least.ndim > 2:
        least, most = least[paths.owner], most[paths.owner]
    near = np.ones((low.shape[1], _count(table)), dtype=bool)
    for axis in (0, 1):
        near &= low[axis][:, None] <= most[..., axis] + reach
        near &= high[axis][:, None] >= least[..., axis] - reach
    found = near.nonzero()
    return found[0], found[1]


def _settled(
    e: Evidence, paths: Paths, interval: Ints, piece: Ints, table: dict[str, Floats],
    clear: Any, number: int,
) -> list[Hit]:  # fmt: skip
    """Halve intervals (m,) until they are clear of pieces (m,); return where they are not."""
    begin, size = np.zeros(len(interval)), 1.0
    # `take` and `compress` leave the coordinates of all in rows, other than an index would.
    points = paths.points.take(interval, axis=2)
    for halving in range(HALVINGS + 1):
        owner = paths.owner[interval] if len(paths.owner) else None
        proven = clear(points, _pick(table, piece, owner), _of(paths.limit, interval))
        doubt = (~proven).nonzero()[0]
        if not len(doubt):
            return []
        interval, piece, begin = interval[doubt], piece[doubt], begin[doubt]
        points = points.take(doubt, axis=2)
        if halving == HALVINGS:
            break
        a, b, c, d = np.moveaxis(points, 1, 0)
        ab, bc, cd = 0.5 * (a + b), 0.5 * (b + c), 0.5 * (c + d)
        abc, bcd = 0.5 * (ab + bc), 0.5 * (bc + cd)
        middle = 0.5 * (abc + bcd)
        points = np.concatenate(
            [np.stack([a, ab, abc, middle], axis=1), np.stack([middle, bcd, cd, d], axis=1)], axis=2
        )
        size *= 0.5
        begin = np.concatenate([begin, begin + size])
        interval, piece = np.concatenate([interval] * 2), np.concatenate([piece] * 2)
    return _measured(e, paths, interval, piece + number, begin, size, points)


def _measured(
    e: Evidence, paths: Paths, interval: Ints, piece: Ints, begin: Floats, size: float,
    points: Floats,
) -> list[Hit]:  # fmt: skip
    """Return the worst of what is left of each interval (m,) beside each piece (m,), if it is bad.

    Left are the parts of `size` (a share of the interval) that begin at shares (m,).
    """
    worst: dict[tuple[int, int, float], Hit] = {}
    t_of, left = e.columns[0], paths.knots[interval]
    owners = np.searchsorted(e.recording.offsets, left, side="right") - 1
    machines = owners if e.family else np.zeros_like(owners)
    for member, number in sorted({*zip(machines.tolist(), piece.tolist(), strict=True)}):
        rows = ((machines == member) & (piece == number)).nonzero()[0]
        shape, owner = e.pieces_of(member)[number], owners[rows]
        radius = e.radii[owner]
        ends = points[:, ::3, rows].T  # (m, 2, 2)
        first, last = ends[:, 0], ends[:, 1]
        passes = (shape.beside(first) > 0.0) != (shape.beside(last) > 0.0)
        passes &= shape.within(0.5 * (first + last), e.side)
        deep = radius[:, None] - np.hypot(*shape.away(ends.reshape(-1, 2)).T).reshape(-1, 2)
        at, row = deep.argmax(axis=1), np.arange(len(rows))
        knot = left[rows]
        share = begin[rows] + size * at
        t = t_of[knot] + share * (t_of[knot + 1] - t_of[knot])
        deep = deep[row, at]
        bad = (passes | (deep > e.allowed)) & shape.there(t) & (t >= shape.appears + (e.dt or 0.0))
        for one in np.unique(owner[bad]).tolist():
            own = (bad & (owner == one)).nonzero()[0]
            forgiven = _forgiven(e, one, shape, float(e.radii[one]), t[own])
            bad[own] = (passes[own] & (forgiven < inf)) | (deep[own] > forgiven + e.allowed)
            deep[own] -= np.minimum(forgiven, radius[own])
        for n in bad.nonzero()[0].tolist():
            x, y = ends[n, at[n]].tolist()
            hit = Hit(int(owner[n]), number, float(t[n]), (x, y), float(deep[n]), bool(passes[n]))
            # Each passage counts, and of all the rest of an interval the deepest place.
            key = int(knot[n]), number, hit.t if hit.passes else -inf
            if key not in worst or hit.depth > worst[key].depth:
                worst[key] = hit
    return list(worst.values())


def _forgiven(e: Evidence, owner: int, piece: Piece, radius: float, t: Floats) -> Floats:
    """Return how deep a particle may be in a piece at times (m,), m, as it began there.

    That is as deep as it was at its release; and without bound in a gate that shut on it, as long
    as it has not been clear of it since.
    """
    track = e.recording.track(owner)
    start = np.maximum(-piece.gap(track["position"][:1], np.array([radius])), 0.0)
    if piece.appears <= track["t"][0]:
        return np.broadcast_to(start, t.shape)
    last = float(t.max())
    times = np.unique(np.concatenate([t, np.linspace(piece.appears, last, GATED)]))
    ((_, _, left, share),) = blocks(track, np.array([0, len(track)]), times)
    path = np.stack([hermite(track, left, share, axis)[0] for axis in (0, 1)], axis=-1)
    clear = times[piece.gap(path, np.full(len(path), radius)) >= 0.0]
    return np.where(t > clear.min(initial=inf), 0.0, inf)


def _turned(e: Evidence, paths: Paths, table: dict[str, Floats], number: int) -> Iterator[Hit]:
    """Yield where mass points come to a piece from one side and go on on the other.

    Such a passage at a knot, as where a blow does not turn a point back, is in no interval.
    """
    owner = np.searchsorted(e.recording.offsets, paths.knots, side="right") - 1
    same = (owner[1:] == owner[:-1]).nonzero()[0]
    places, t = paths.points[:, 0].T, e.recording.knots["t"][paths.knots]
    count = _count(table)
    for who in np.unique(owner[same]).tolist():
        own = same[owner[same] == who]
        for k in range(number, number + count):
            piece = e.pieces_of(who)[k]
            flat = paths.points.reshape(2, -1).T
            d = piece.beside(flat).reshape(4, -1)
            most = np.take_along_axis(d, np.abs(d).argmax(axis=0)[None], 0)[0]
            turns = (most[own] > e.allowed) & (most[own + 1] < -e.allowed)
            turns |= (most[own] < -e.allowed) & (most[own + 1] > e.allowed)
            met = own[turns] + 1
            met = met[piece.within(places[met], e.side) & piece.there(t[met])]
            met = met[np.hypot(*piece.away(places[met]).T) <= e.allowed]
            for n in met.tolist():
                yield Hit(who, k, float(t[n]), tuple(places[n].tolist()), 0.0, passes=True)
