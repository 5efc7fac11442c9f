"""Fields of a crowd on a grid: density, velocity, granular temperature and stress.

Coarse graining after I. Goldhirsch, Granular Matter 12 (2010) 239-252: each particle is spread by
Lucy's kernel, w(d) = 5/(π c²) (1 + 3 d/c) (1 - d/c)³ for d < c, which ends at its width c; in two
dimensions, for the slice that is simulated. On the grid the weights of each particle are normalised
to the sum 1, so no mass is lost. Fields are means over a window of time.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from importlib.util import find_spec
from math import ceil, inf, nan
from pathlib import Path
from typing import Any, Final

import numpy as np

from chutelab.core import number as number_of
from chutelab.results.arrival import Places
from chutelab.results.record import Record
from chutelab.results.rows import Kind
from chutelab.util.arrays import Bools, Floats
from chutelab.util.errors import InputError, MissingLibraryError
from chutelab.util.files import whole
from chutelab.util.tables import Sheet, Shown, number

SAMPLES: Final = 50
"""Times in the window at which tracks are sampled."""

WIDE: Final = 3.0
"""Default width of the kernel, in mean diameters."""

FINE: Final = 4
"""Default number of cells per width of the kernel."""

MOST_CELLS: Final = 1_000_000

CHUNK: Final = 500_000
"""Weights that are computed at once."""

NODES: Final = 3
"""Nodes of Gauss's rule for the integral of the kernel along a branch of a third of its width: to
1e-4."""

SAME: Final[float] = number_of("SAME_IMPULSE")

NAMES: Final = {
    "density": "kg/m²", "vx": "m/s", "vy": "m/s", "speed": "m/s", "temperature": "m²/s²",
    "pressure": "N/m", "sxx": "N/m", "sxy": "N/m", "syx": "N/m", "syy": "N/m",
}  # fmt: skip
"""The fields on the grid, and their units."""


def need_vtk() -> None:
    """Raise a `MissingLibraryError` if no VTK file can be written."""
    if find_spec("pyevtk") is None:
        raise MissingLibraryError('a VTK file needs: pip install "chutelab[vtk]"')


@dataclass(frozen=True, eq=False, repr=False)
class Fields(Shown):
    """Fields on a grid of square cells, at the middles of the cells.

    Attributes
    ----------
    x, y : ndarray, shape (X,), (Y,)
        Middles of the cells, m.
    cell, width : float
        Edge of a cell, and width c of the kernel, m.
    window : (float, float)
        Times over which means are taken, s.
    density : ndarray, shape (X, Y)
        ρ, of the slice, kg/m².
    velocity : ndarray, shape (2, X, Y)
        V, mean momentum over mean density, m/s; NaN where there are no particles.
    temperature : ndarray, shape (X, Y)
        Half the mean square deviation of velocities from V, m²/s²; NaN where there are no
        particles.
    kinetic : ndarray, shape (2, 2, X, Y)
        Kinetic stress, -Σ m w v' v', N/m; negative is compression.
    contact : ndarray, shape (2, 2, X, Y)
        Stress of impacts and, with ``run.stress``, of lasting contacts, -Σ J b ∫ w over the
        window's length: J on a particle, b to its centre from that of the other or from the contact
        point on a surface, N/m.
    traction : ndarray, shape (2, X, Y)
        Force of surfaces in these contacts, Σ J w at the contact over the window's length, N/m².
    left_out : float
        Share of the impulses on particles in the window that are not in contact stress and
        traction: those of lasting contacts, where the recording does not have them by pairs.
    joined : bool
        Whether there are strings, rods, springs or pins, whose forces are in no stress.
    """

    x: Floats
    y: Floats
    cell: float
    width: float
    window: tuple[float, float]
    density: Floats
    velocity: Floats
    temperature: Floats
    kinetic: Floats
    contact: Floats
    traction: Floats
    left_out: float
    joined: bool

    def __getitem__(self, name: str) -> Floats:
        """Return one of `NAMES`, (X, Y); stress is kinetic and contact stress together."""
        if name not in NAMES:
            raise InputError(f"one of {', '.join(NAMES)}", "field", name)
        stress = self.kinetic + self.contact
        if name[0] == "s" and name[1:] != "peed":
            row, column = ("xy".index(axis) for axis in name[1:])
            return np.asarray(stress[row, column])
        match name:
            case "vx" | "vy":
                return np.asarray(self.velocity["xy".index(name[1])])
            case "speed":
                return np.asarray(np.hypot(*self.velocity))
            case "pressure":
                return np.asarray(-0.5 * (stress[0, 0] + stress[1, 1]))
        return np.asarray(getattr(self, name))

    @property
    def mass(self) -> float:
        """The integral of the density, kg: the mean mass inside."""
        return float(self.density.sum()) * self.cell**2

    @property
    def note(self) -> str:
        """How the fields were averaged, and what is left out."""
        begin, end = self.window
        said = (
            f"Lucy's kernel, width {number(self.width)} m, on cells of {number(self.cell)} m; mean"
            f" from {number(begin)} to {number(end)} s"
        )
        if self.left_out > 0.0:
            said += (
                f"; lasting contacts, {100.0 * self.left_out:.0f} % of all impulses there, are not"
                " in the stress: the contact engine keeps them with run.stress, such as 0.01 s"
            )
        if self.joined:
            said += "; what strings, rods, springs and pins give is not in the stress"
        return said

    def sheet(self, *, details: bool = False) -> Sheet:
        """Return least, mean and largest value of each field."""
        some, rows = self.density > 0.0, []
        for name, unit in NAMES.items():
            values = self[name][some]
            if len(values):
                told = (number(float(of(values))) for of in (np.min, np.mean, np.max))
                rows.append((f"{name}, {unit}", *told))
        return Sheet("Fields", ("", "least", "mean", "largest"), tuple(rows), notes=(self.note,))

    def as_dict(self) -> dict[str, Any]:
        """Return plain data for JSON: parameters, and least, mean and largest of each field."""
        some = self.density > 0.0
        told = {
            name: [float(of(self[name][some])) for of in (np.min, np.mean, np.max)]
            for name in NAMES
            if some.any()
        }
        return {
            "window": list(self.window), "kernel": "Lucy", "width": self.width, "cell": self.cell,
            "mass": self.mass, "left_out": self.left_out, "fields": told,
        }  # fmt: skip

    def rows(self) -> Iterator[Sequence[object]]:
        """Yield the rows of a table, one per cell, the names of the columns first."""
        yield "x", "y", *NAMES
        columns = [self[name].ravel().tolist() for name in NAMES]
        places = np.stack(np.meshgrid(self.x, self.y, indexing="ij"), axis=-1).reshape(-1, 2)
        for place, *values in zip(places.tolist(), *columns, strict=True):
            yield *place, *(None if value != value else value for value in values)

    def write_vtk(self, path: str | Path) -> None:
        """Write an image of VTK, such as ParaView opens, with the fields of the cells.

        Raises
        ------
        MissingLibraryError
            Without the extra ``chutelab[vtk]``.
        """
        need_vtk()
        from pyevtk.hl import imageToVTK

        def cells(values: Floats) -> Floats:
            return np.asfortranarray(values[:, :, None])

        data: dict[str, Any] = {name: cells(self[name]) for name in NAMES}
        vx, vy = data.pop("vx"), data.pop("vy")
        data["velocity"] = (vx, vy, np.zeros_like(vx))
        corner = (float(self.x[0]) - 0.5 * self.cell, float(self.y[0]) - 0.5 * self.cell, 0.0)
        with whole(path) as unfinished:
            made = imageToVTK(
                str(unfinished.with_suffix("")), corner, (self.cell,) * 3, cellData=data
            )
            Path(made).replace(unfinished)


class _Grid:
    """Square cells over a box, and the kernel that spreads over them."""

    def __init__(self, low: Floats, high: Floats, cell: float, width: float) -> None:
        many = np.maximum(1.0, np.ceil((high - low) / cell * (1.0 - 1e-12)))
        if not many.prod() <= MOST_CELLS:
            allowed = f"so large that the box has {MOST_CELLS:,} cells or fewer"
            raise InputError(allowed, "cell", cell)
        self.low, self.cell, self.width = low, cell, width
        self.shape = int(many[0]), int(many[1])
        reach = ceil(width / cell) + 1
        steps = np.arange(-reach, reach + 1)
        self.stencil = np.stack(np.meshgrid(steps, steps, indexing="ij"), axis=-1).reshape(-1, 2)

    def add(self, sums: Floats, places: Floats, values: Floats) -> None:
        """Spread values (K, c) about places (c, 2), m, and add them to sums (K, X, Y)."""
        flat = sums.reshape(len(sums), -1)
        size = max(1, CHUNK // len(self.stencil))
        for begin in range(0, len(places), size):
            some = places[begin : begin + size]
            index = np.floor((some - self.low) / self.cell).astype(np.int64)[:, None] + self.stencil
            off = self.low + (index + 0.5) * self.cell - some[:, None]
            far = np.sqrt((off * off).sum(axis=-1)) / self.width
            weight = (1.0 + 3.0 * far) * (1.0 - far).clip(min=0.0) ** 3
            weight /= weight.sum(axis=1, keepdims=True) * self.cell**2
            own, near = np.nonzero((far < 1.0) & ((index >= 0) & (index < self.shape)).all(axis=-1))
            cell = index[own, near] @ np.array([self.shape[1], 1])
            share = weight[own, near]
            for row, value in zip(flat, values[:, begin : begin + size], strict=True):
                row += np.bincount(cell, share * value[own], len(row))


def fields(
    recording: Record,
    begin: float | None = None,
    end: float | None = None,
    *,
    samples: int = SAMPLES,
    width: float | None = None,
    cell: float | None = None,
    box: Sequence[Sequence[float]] | None = None,
) -> Fields:
    """Return the fields of a recording, means over a window of time.

    Parameters
    ----------
    recording : Record
        A run of one scene.
    begin, end : float, optional
        The window, s; by default all of the run.
    samples : int
        At how many even times tracks are looked at.
    width : float, optional
        Where the kernel ends, m; by default three mean diameters.
    cell : float, optional
        Edge of a cell, m; by default a quarter of the width.
    box : ((x, y), (x, y)), optional
        Two corners of the grid, m; by default it covers all places in the window.

    Raises
    ------
    InputError
        If a number is out of its range, or no particle is there in the window.
    """
    if recording.family is not None:
        raise InputError("of a single scene, not of a family", "recording", recording.title)
    last = float(recording.knots["t"].max(initial=0.0))
    begin, end = 0.0 if begin is None else begin, last if end is None else end
    if not 0.0 <= begin < end <= last * (1.0 + 1e-12):
        allowed = f"must be two times from 0 to {last:g} s, the second one later"
        raise InputError(allowed, "window", [begin, end])
    if samples < 1:
        raise InputError("a whole number above 0", "samples", samples)
    if width is None:
        width = 2.0 * WIDE * float(np.mean(recording.radius))
    cell = width / FINE if cell is None else cell
    if not 0.0 < width < inf:
        raise InputError("a finite number above 0 m", "width", width)
    if not 0.0 < cell <= 0.5 * width:
        raise InputError(
            f"a number above 0, half of the width of {width:g} m at most", "cell", cell
        )
    # The middles of even parts of the window.
    times = begin + (end - begin) * (np.arange(samples) + 0.5) / samples
    found = recording.at(times)
    row, particle = np.nonzero(np.isfinite(found.position[..., 0]))
    places, velocity = found.position[row, particle], found.velocity[row, particle]
    if not len(places):
        raise InputError("a window in which there are particles", "window", [begin, end])
    if box is None:
        low, high = places.min(axis=0) - width - cell, places.max(axis=0) + width + cell
    else:
        corners = np.asarray(box, dtype=np.float64)
        if (
            corners.shape != (2, 2)
            or not np.isfinite(corners).all()
            or not np.ptp(corners, axis=0).all()
        ):
            raise InputError("two corners ((x, y), (x, y)) of a box, m", "box", box)
        low, high = corners.min(axis=0), corners.max(axis=0)
    grid = _Grid(low, high, cell, width)
    mass = recording.mass[particle] / samples
    vx, vy = velocity.T
    sums = np.zeros((6, *grid.shape))
    grid.add(sums, places, mass * np.stack([np.ones_like(vx), vx, vy, vx * vx, vx * vy, vy * vy]))
    density, momentum = sums[0], sums[1:3]
    some = density > 0.0
    mean = np.divide(momentum, density, out=np.full_like(momentum, nan), where=some)
    flow = np.stack([sums[3:5], sums[4:6]])
    kinetic = np.where(some, mean[:, None] * momentum[None] - flow, 0.0)
    heat = (-0.5 * (kinetic[0, 0] + kinetic[1, 1])).clip(min=0.0)
    contact, traction = np.zeros((2, 2, *grid.shape)), np.zeros((2, *grid.shape))
    blows = _blows(recording, begin, end)
    for given in (blows, _kept(recording, begin, end, samples)):
        given.spread(grid, contact, traction)
    # The forces of lasting contacts are recorded.
    kept = recording.engine == "contact" and recording.machine.stress > 0.0
    return Fields(
        x=grid.low[0] + (np.arange(grid.shape[0]) + 0.5) * cell,
        y=grid.low[1] + (np.arange(grid.shape[1]) + 0.5) * cell,
        cell=cell,
        width=width,
        window=(begin, end),
        density=density,
        velocity=mean,
        temperature=np.divide(heat, density, out=np.full_like(heat, nan), where=some),
        kinetic=kinetic,
        contact=contact / (end - begin),
        traction=traction / (end - begin),
        left_out=0.0 if kept else _left_out(recording, begin, end, blows),
        joined=bool(recording.machine.joints),
    )


@dataclass(frozen=True, eq=False)
class _Given:
    """Forces in contacts: impulses (c, 2), N s, on particles at centers (c, 2), m.

    Branches (c, 2), m, lead to them from the other particle's centre, or from points on surfaces
    (`on_surface`); `stress` (c, 2, 2), N m s, is the sum of J b.
    """

    center: Floats
    branch: Floats
    impulse: Floats
    stress: Floats
    on_surface: Bools

    def spread(self, grid: _Grid, contact: Floats, traction: Floats) -> None:
        """Add it to the sums."""
        stress, flat = -self.stress.reshape(-1, 4).T, contact.reshape(4, *grid.shape)
        for node, weight in zip(*np.polynomial.legendre.leggauss(NODES), strict=True):
            places = self.center - 0.5 * (1.0 + node) * self.branch
            grid.add(flat, places, 0.5 * weight * stress)
        borne = self.on_surface
        grid.add(traction, (self.center - self.branch)[borne], self.impulse[borne].T)

    @property
    def size(self) -> float:
        """Sum of the sizes of impulses on particles, N s."""
        return float((np.hypot(*self.impulse.T) * np.where(self.on_surface, 1.0, 2.0)).sum())


def _blows(recording: Record, begin: float, end: float) -> _Given:
    """Return the impulses of impacts in a window.

    If all contacts of a particle were solved at once, its change is the sum of several impulses,
    which are recorded with the lasting contacts.
    """
    some = recording.select(Kind.IMPACT, Kind.LANDING, Kind.COLLISION)
    t = some["t"]
    some = some[(t >= begin) & (t < end)]
    after, before, whose = some["velocity_after"], some["velocity_before"], some["particle"]
    change = recording.mass[whose][:, None] * (after - before)
    # J = J_n n + J_t (n_y, -n_x): as complex numbers n (J_n - i J_t).
    push = some["normal_impulse"] - 1j * some["tangential_impulse"]
    alone = np.abs(np.hypot(*change.T) - np.abs(push)) <= SAME * np.abs(push)
    some, impulse, push = some[alone], change[alone], push[alone]
    center, pair = some["position"], some["other"] >= 0
    normal = np.divide(impulse[:, 0] + 1j * impulse[:, 1], push, out=np.ones_like(push),
                       where=push != 0.0)  # fmt: skip
    reach = recording.radius[some["particle"]] + np.where(
        pair, recording.radius[some["other"]], 0.0
    )
    normal /= np.abs(normal)
    branch = reach[:, None] * np.stack([normal.real, normal.imag], axis=-1)
    return _Given(center, branch, impulse, impulse[:, :, None] * branch[:, None], ~pair)


def _kept(recording: Record, begin: float, end: float, samples: int) -> _Given:
    """Return the impulses of lasting contacts in a window, if they are recorded.

    The impulse of a bin is spread evenly over it; bins longer than a sample count at several times.
    """
    rows = recording.lasting
    since, until = rows["from"], rows["to"]
    within = (until > begin) & (since < end) & rows["impulse"].any(axis=-1)
    rows, since, until = rows[within], since[within], until[within]
    first, last = since.clip(begin), until.clip(max=end)
    parts = np.maximum(1, np.ceil((last - first) * samples / (end - begin))).astype(np.int64)
    of = np.repeat(np.arange(len(rows)), parts)
    nth = np.arange(len(of)) - np.repeat(parts.cumsum() - parts, parts)
    span = (last - first) / parts
    times = first[of] + (nth + 0.5) * span[of]
    share = (span / (until - since))[of]
    rows = rows[of]
    impulse, stress = share[:, None] * rows["impulse"], share[:, None, None] * rows["stress"]
    own, other = rows["particle"], rows["other"]
    there, pair = Places(recording), other >= 0
    center = there.on(own, times)
    # Along b = Jᵀ (J b) / J².
    branch = np.einsum("ca,cab->cb", impulse, stress)
    branch *= (recording.radius[own] / np.hypot(*branch.T))[:, None]
    branch[pair] = center[pair] - there.on(other[pair], times[pair])
    return _Given(center, branch, impulse, stress, ~pair)


def _left_out(recording: Record, begin: float, end: float, blows: _Given) -> float:
    """Return the share of the impulses on particles that is due to lasting contacts, 0 to 1."""
    knots, owner = recording.knots, recording.owner
    t, velocity = knots["t"], knots["velocity"]
    h = np.diff(t)
    within = (np.minimum(t[1:], end) - np.maximum(t[:-1], begin)).clip(min=0.0)
    left = np.flatnonzero((owner[1:] == owner[:-1]) & (within > 0.0))
    given = np.diff(velocity, axis=0)[left]
    given += recording.gravity * h[left, None] * recording.machine.up
    sizes = np.hypot(*given.T)
    # Flights change momentum only by gravity, to rounding.
    fast = np.hypot(*velocity[left].T) + recording.gravity * h[left]
    borne = recording.mass[owner[left]] * np.where(sizes > 1e-9 * fast, sizes, 0.0)
    lasting = float((borne * within[left] / h[left]).sum())
    return lasting / (lasting + blows.size) if lasting > 0.0 else 0.0
