"""Recordings on disk: one npz file, and CSV for spreadsheets.

The file keeps all bits, that of a large crowd within a tolerance, see `packing`. It does not have
the time that the run took, so the same run makes the same bytes.
"""

from __future__ import annotations

import json
import warnings
import zipfile
from collections.abc import Collection, Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import asdict
from errno import EINVAL, ESPIPE
from math import inf, isnan, prod
from pathlib import Path
from typing import Any

import numpy as np
from numpy.lib import format as npy
from numpy.typing import NDArray

from chutelab.machine import SWING, build
from chutelab.results import packing
from chutelab.results.loads import borne, need_loads
from chutelab.results.record import Record
from chutelab.results.rows import ENGINES, ENTRIES, EVENT, KNOT, LASTING, LOAD, REASONS, TOTAL, Kind
from chutelab.results.sensors import need_sensors, sensed
from chutelab.results.wear import KEYS, check_coefficients, touched
from chutelab.scene import from_dict
from chutelab.util.errors import InputError
from chutelab.util.files import csv_lines, whole, write_lines
from chutelab.util.tables import frame as data_frame
from chutelab.util.tables import plain

FORMAT, EARLIER, PACKED = 1, 2, 3
"""Versions of the file, the last for large crowds, as was the second; others are refused."""

TOLERANCE = 1e-6
"""Largest error of tracks of a large crowd in a file, as a share of the radius."""

MANY = 10_000
"""A crowd with at least so many knots is large."""

ARRAYS = {
    "knots": KNOT,
    "offsets": np.dtype("i8"),
    "ended": np.dtype("i1"),
    "events": EVENT,
    "by_surface": np.dtype("f8"),
    "angle": np.dtype("f8"),
    "totals": TOTAL,
    "unsolved": np.dtype("f8"),
    "drives": np.dtype("f8"),
    "impulses": LOAD,
    "lasting": LASTING,
    "swings": SWING,
    "hinge_work": np.dtype("f8"),
    "stopped": np.dtype("f8"),
    "springs": np.dtype("f8"),
    "triggered": np.dtype("f8"),
}
"""Arrays of a file and their types."""

TYPES = ARRAYS | packing.COLUMNS
"""Types of all arrays that a file may have."""

UNPACKED = ("knots", "angle", "events")
"""Arrays that are stored in a packed file as `packing.COLUMNS`."""

MAYBE = (
    "angle", "totals", "unsolved", "drives", "impulses", "lasting", "swings",
    "hinge_work", "stopped", "springs", "triggered",
)  # fmt: skip
"""Arrays that are left out if they are empty."""

BY_HAND = "hastened", "torque"
"""Numbers that the header has if they are not 0."""

HEADERS = {(1, 0): npy.read_array_header_1_0, (2, 0): npy.read_array_header_2_0}
"""Readers of an array's shape and type, by the version of its format."""

SMALL = 1 << 20
"""Arrays of up to so many bytes may be compressed by any factor."""

MOST_UNPACKED = 150
"""Largest compression factor of larger arrays: runs in which almost nothing happens reach 60, a
file made to fill the memory 1000."""

LEVEL = 4
"""Level of zlib: higher ones take twice the time and save 2 % of a crowd's file, and nothing of
others."""

FAR = 1e100
"""Bound on every number: energies and distances computed from it stay finite."""

TABLES = ("events", "trajectory", "sensors", "loads", "wear")
"""Tables that `to_csv` can write; the last three only on request."""

COLUMNS = ("t", "particle", "other", "kind", "surface")
"""Fields of an event that events.csv begins with."""

SAMPLES = 200
"""Default number of times in trajectory.csv."""

MOST_ROWS = 1_000_000
"""Most rows of trajectory.csv: spreadsheets do not open more."""


class RecordingError(InputError):
    """A file is not a recording that this version can read."""


def save(recording: Record, path: str | Path, *, tolerance: float = TOLERANCE) -> Path:
    """Write a recording to an npz file, whole or not at all.

    Parameters
    ----------
    recording : Record
        What to write.
    path : path
        The file.
    tolerance : float
        Largest error of tracks of a crowd of `MANY` knots or more, in radii of the smallest
        particle, up to 0.01; other recordings, and all with 0, keep all bits.

    Raises
    ------
    ValueError
        If the tolerance is out of its range.
    """
    if not 0.0 <= tolerance <= 0.01:
        raise ValueError(f"tolerance = {tolerance!r}: from 0 to 0.01 radii")
    path = Path(path)
    arrays = {
        name: getattr(recording, name)
        for name in ARRAYS
        if name not in MAYBE or getattr(recording, name).size
    }
    packed: dict[str, Any] = {}
    if tolerance and recording.machine.interact and len(recording.knots) >= MANY:
        # Places are too large for whole numbers of units: do not pack.
        with suppress(OverflowError):
            packed = packing.pack(recording, tolerance)
    with whole(path) as unfinished:
        if packed:
            few = {name: array for name, array in arrays.items() if name not in UNPACKED}
            _write(unfinished, _about(recording, PACKED), few | packed)
        # An array that compresses so well that it would be refused is stored uncompressed.
        if not packed or not _fits(unfinished, packed):
            _write(unfinished, _about(recording), arrays)
    return path


def _write(path: Path, about: dict[str, Any], arrays: dict[str, Any]) -> None:
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED, compresslevel=LEVEL) as archive:
        for name, array in ({"about": np.array(json.dumps(about))} | arrays).items():
            with archive.open(f"{name}.npy", "w", force_zip64=True) as entry:
                npy.write_array(entry, array, allow_pickle=False)


def _fits(path: Path, packed: Mapping[str, NDArray[Any]]) -> bool:
    """Whether the compression factor of a file is credible."""
    knots, events = packed["when"].shape[-1], packed["whose"].shape[-1]
    most = max(KNOT.itemsize * knots, EVENT.itemsize * events, packed["sizes"].size)
    return bool(most <= max(SMALL, MOST_UNPACKED * path.stat().st_size))


def load(path: str | Path) -> Record:
    """Read what `save` wrote.

    Nothing is unpacked before its size is known and credible.

    Raises
    ------
    RecordingError
        If the file is missing, damaged, of another kind or of another version; or if its
        compression factor or its content cannot come from a run.
    """
    path = Path(path)
    kind = "not a recording as `chutelab run --out` writes it"
    try:
        if path.exists() and not path.is_file():
            # Opening a pipe would block.
            raise OSError(ESPIPE, "it is no regular file")  # noqa: TRY301
        with zipfile.ZipFile(path) as archive:
            about = json.loads(str(_array(archive, "about")))
            if about.get("format") in (FORMAT, EARLIER, PACKED):
                return _recording(about, archive)
    except FileNotFoundError:
        raise RecordingError(f"{path}: no such file") from None
    except OSError as error:
        # In a damaged file an offset may point before its beginning.
        unread = f"cannot be read: {error.strerror or error}"
        said = f"{kind} (recording.npz)" if error.errno == EINVAL else unread
        raise RecordingError(f"{path}: {said}") from None
    except (MemoryError, RecordingError):
        raise
    except _UnfitError as error:
        raise RecordingError(f"{path}: {kind}: {error}") from None
    except Exception as error:
        # Damaged bytes raise many kinds of errors: from zipfile, zlib, tokenize, json, NumPy.
        raise RecordingError(f"{path}: {kind} (recording.npz)") from error
    raise RecordingError(f"{path}: a recording of another version of chutelab; run its scene again")


class _UnfitError(ValueError):
    """The content of a file cannot come from a run; the text says why."""


def _array(archive: zipfile.ZipFile, name: str, room: int = 0) -> NDArray[Any]:
    """Return one array of an archive; up to `room` bytes it may be compressed by any factor."""
    info = archive.getinfo(f"{name}.npy")
    # Other methods can expand one byte to a million.
    if info.compress_type not in (zipfile.ZIP_STORED, zipfile.ZIP_DEFLATED):
        raise _UnfitError(f"{name} is packed by another method")
    with archive.open(info) as entry, warnings.catch_warnings():
        warnings.simplefilter("error")
        shape, _, dtype = HEADERS[npy.read_magic(entry)](entry)
        size = prod(shape) * dtype.itemsize
        if entry.tell() + size != info.file_size:
            raise _UnfitError(f"{name} has another size than it says")
    if dtype != TYPES.get(name, dtype) or (name == "about" and (dtype.kind, shape) != ("U", ())):
        raise _UnfitError(f"{name} is of another type")
    packed = min(info.compress_size, Path(str(archive.filename)).stat().st_size)
    if size > max(SMALL, room, MOST_UNPACKED * packed):
        raise _UnfitError(
            f"{name} would be {size / 1e6:.3g} MB, unpacked from {packed / 1e6:.3g} MB"
        )
    with archive.open(info) as entry:
        array: NDArray[Any] = npy.read_array(entry, allow_pickle=False)
    return array


def _about(recording: Record, form: int = FORMAT) -> dict[str, Any]:
    """Return the header of the file."""
    return {
        "format": form,
        # Only keys that were given, since their presence may have a meaning.
        "scene": recording.scene.model_dump_json(by_alias=True, exclude_unset=True),
        "title": recording.title,
        "engine": recording.engine,
        "particle": plain(asdict(recording.particle)),
        "gravity": recording.gravity,
        "surfaces": list(recording.surfaces),
        "steps": recording.steps,
        "contacts": recording.contacts,
        **({"instead": recording.instead} if recording.instead else {}),
        "gained": recording.gained,
        **{name: value for name in BY_HAND if (value := getattr(recording, name))},
        **({"air_loss": recording.air_loss} if recording.scene.air_density else {}),
    }


def _recording(about: dict[str, Any], archive: zipfile.ZipFile) -> Record:
    """Return the recording in header and arrays; an error if they contradict each other.

    Every index has to be valid, and all must fit the scene. Its text may be older, without later
    keys.
    """
    counts = about["steps"], about["contacts"]
    if about["engine"] not in ENGINES:
        raise _UnfitError("the header names no engine")
    if not all(type(count) is int and 0 <= count < 2**63 for count in counts):
        raise _UnfitError("steps and contacts in the header have to be whole numbers")
    scene = from_dict(json.loads(about["scene"]), about["title"])
    # Any number of particles that were never released compresses to almost nothing.
    room = 8 * (scene.count + 1)
    machine, is_packed = build(scene), about["format"] != FORMAT
    arrays: dict[str, Any] = {
        name: _array(archive, name, room)
        for name in ARRAYS
        if name not in (UNPACKED if is_packed else ())
        and (name not in MAYBE or f"{name}.npy" in archive.namelist())
    }
    if is_packed:
        path = Path(str(archive.filename))
        room = MOST_UNPACKED * path.stat().st_size
        packed = {name: _array(archive, name, room) for name in packing.COLUMNS}
        if not _fits(path, packed):
            raise _UnfitError("tracks or events would be too large for the file")
        arrays |= packing.unpack(
            packed, arrays["offsets"], machine.particle, earlier=about["format"] == EARLIER
        )
    about.pop("seconds", None)  # earlier files have the time that the run took
    about.setdefault("gained", 0.0)  # ... and not this
    told = {name: about[name] for name in ("engine", "steps", "contacts", "gained")}
    told |= {name: about.get(name, 0.0) for name in ("air_loss", *BY_HAND)}
    instead = str(about.get("instead", ""))
    recording = Record(machine=machine, instead=instead, **told, **arrays)
    if _about(recording, about["format"]) | {"scene": about["scene"]} != about:
        raise _UnfitError("the header is of another scene")
    numbers = {
        "by_surface": arrays["by_surface"], "angle": recording.angle, "drives": recording.drives,
        "unsolved": recording.unsolved,
    }  # fmt: skip
    single = [told[name] for name in ("gained", "air_loss", *BY_HAND)]
    numbers["gained"] = np.array(single, dtype=float)
    numbers |= {"hinge_work": recording.hinge_work, "springs": recording.springs}
    numbers["stopped"] = recording.stopped
    for name in ("knots", "events", "totals", "impulses", "lasting", "swings"):
        array = getattr(recording, name)
        numbers |= {f"{name}.{key}": array[key] for key in array.dtype.names or ()}
    for name, values in numbers.items():
        if not np.all(np.abs(values) < FAR):
            raise _UnfitError(f"{name} has a number that is not finite, or beyond {FAR:g}")
    offsets, knots, events = recording.offsets, recording.knots, recording.events
    if not (knots.ndim == events.ndim == offsets.ndim == recording.totals.ndim == 1):
        raise _UnfitError("an array has another number of dimensions")
    sizes, surfaces = np.diff(offsets), len(recording.surfaces)
    hung, swung = recording.swings["surface"], recording.swings["t"]
    sound = (
        len(offsets) > 0
        and offsets[0] == 0
        and offsets[-1] == len(knots)
        and not np.any((sizes < 0) | (sizes == 1))
        and recording.angle.shape in ((0,), knots.shape)
        and recording.ended.shape == sizes.shape
        and recording.unsolved.shape in ((0,), recording.totals.shape)
        and (not recording.impulses.size or recording.impulses.shape[1:] == (surfaces - 1,))
        and recording.lasting.ndim == 1
        and not np.any(
            (recording.lasting["particle"] < 0)
            | (recording.lasting["particle"] >= len(sizes))
            | (recording.lasting["other"] <= -surfaces)
            | (recording.lasting["other"] >= len(sizes))
        )
        and not np.any((recording.ended < 0) | (recording.ended >= len(REASONS)))
        and recording.by_surface.shape == (surfaces, len(ENTRIES))
        and recording.drives.shape == ((surfaces,) if recording.machine.movers else (0,))
        and recording.hinge_work.shape == ((surfaces if len(recording.swings) else 0), 4)
        and recording.stopped.shape in ((0,), recording.swings.shape)
        and recording.springs.shape == (len(recording.scene.spring), 4)
        and recording.triggered.shape == (len(recording.machine.triggers),)
        and not np.any(np.isnan(recording.triggered))
        and recording.swings.ndim == 1
        and all(
            mover.hinge is None or len(mover.hinge.states) for mover in recording.machine.movers
        )
        and not np.any(np.diff(swung)[np.diff(hung) == 0] < 0.0)
        and not np.any((events["surface"] < -1) | (events["surface"] >= surfaces))
        and not np.any((events["particle"] < 0) | (events["particle"] >= len(sizes)))
        and not np.any((events["other"] < -1) | (events["other"] >= len(sizes)))
        and not np.any((events["kind"] < 0) | (events["kind"] >= len(Kind)))
    )
    if not sound:
        raise _UnfitError("the arrays do not fit together")
    of_knots, of_events = knots["t"], events["t"]
    backward = np.diff(of_knots) < 0.0
    backward[offsets[1:-1][(offsets[1:-1] > 0) & (offsets[1:-1] < len(knots))] - 1] = False
    if np.any(backward) or np.any(np.diff(of_events) < 0.0):
        raise _UnfitError("the times of a track, or of the events, go backward")
    return recording


def to_csv(
    recording: Record,
    folder: str | Path,
    *,
    step: float | None = None,
    only: Collection[str] = TABLES[:2],
    coefficients: Mapping[str, float] | None = None,
) -> list[Path]:
    """Write events.csv, trajectory.csv, sensors.csv, loads.csv and wear.csv, each whole or not.

    Parameters
    ----------
    recording : Record
        What to write.
    folder : path
        Existing directory.
    step : float, optional
        Interval of the trajectory, s; by default that of `instants`.
    only : collection of str
        Which of the five; by default the first two.
    coefficients : mapping, optional
        "erosion", m³/J, and "abrasion", 1/Pa, as `wear.worn` takes them; wear.csv then has columns
        with volumes, m³.

    Raises
    ------
    InputError
        If a coefficient is out of its range; nothing is written then.
    ValueError
        If `step` is not positive and finite, or so short that the trajectory would have more than
        `MOST_ROWS` rows; nothing is written then.
    """
    check_coefficients(coefficients := coefficients or {})
    tables = {name: _table(recording, name, step, coefficients) for name in TABLES if name in only}
    return [
        write_lines(Path(folder) / f"{name}.csv", csv_lines(rows)) for name, rows in tables.items()
    ]


def frame(recording: Record, table: str = "trajectory", *, step: float | None = None) -> Any:
    """Return what `to_csv` writes as a pandas DataFrame.

    Parameters
    ----------
    recording : Record
        What to show.
    table : {"trajectory", "events"}
        Positions (m) and velocities (m/s) of all particles at equal intervals (s); or their events,
        in SI units.
    step : float, optional
        Interval of the trajectory, s; by default that of `instants`.

    Raises
    ------
    ImportError
        Without pandas.
    ValueError
        If there is no such table, or `to_csv` would refuse the step.
    """
    if table not in TABLES:
        raise ValueError(f"table = {table!r}: one of {', '.join(TABLES)}")
    names, *rows = _table(recording, table, step, {})
    return data_frame({str(name): [row[i] for row in rows] for i, name in enumerate(names)})


def _table(
    recording: Record, name: str, step: float | None, coefficients: Mapping[str, float]
) -> Iterator[Sequence[object]]:
    """Return the rows of a table, the names of its columns first."""
    if step is not None:
        if not 0.0 < step < inf:
            raise ValueError(f"step = {step!r}: a finite number above 0 s")
        first, last = (ends["t"] for ends in recording.ends())
        spans = float((last - first).sum())
        many = spans / step + len(first)
        if name == "trajectory" and many > MOST_ROWS:
            room = MOST_ROWS - len(first)
            least = f"{1.05 * spans / room:.2g} s or more" if room > 0 else "none"
            raise ValueError(
                f"step = {step!r}: the trajectory would have up to {many:.3g} rows, and"
                f" {MOST_ROWS:,} are what a spreadsheet opens; allowed: {least}"
            )
    if name == "sensors":
        return _passages(recording)
    if name in ("loads", "wear"):
        return _loads(recording) if name == "loads" else _wear(recording, coefficients)
    return _events(recording) if name == "events" else _trajectory(recording, step)


def instants(recording: Record) -> int:
    """Return the default number of times in trajectory.csv.

    It is `SAMPLES`, or fewer if it would have more than `MOST_ROWS` rows.
    """
    if not len(recording.knots):
        return 0
    first, last = (ends["t"] for ends in recording.ends())
    whole = float(last.max() - first.min())
    # A particle has a row at each time within its track, and at most one more for its beginning.
    share = float((last - first).sum()) / whole if whole > 0.0 else float(len(first))
    return max(2, min(SAMPLES, 1 + int((MOST_ROWS - len(first)) / share))) if share else SAMPLES


def _events(recording: Record) -> Iterator[Sequence[object]]:
    places = ("x", "y", "vx_before", "vy_before", "vx_after", "vy_after")
    vectors = ("position", "velocity_before", "velocity_after")
    scalars = ("omega_before", "omega_after", "normal_impulse", "tangential_impulse")
    yield *COLUMNS, *places, *scalars
    events, kinds = recording.events, [kind.name.lower() for kind in Kind]
    names = (*recording.surfaces, None)
    numbers = [column for name in vectors for column in events[name].T.tolist()]
    numbers += [events[name].tolist() for name in scalars]
    heads = zip(*(events[name].tolist() for name in COLUMNS), strict=True)
    for (t, particle, other, kind, surface), *row in zip(heads, *numbers, strict=True):
        yield t, particle, None if other < 0 else other, kinds[kind], names[surface], *row


def _trajectory(recording: Record, step: float | None) -> Iterator[Sequence[object]]:
    yield "t", "particle", "x", "y", "vx", "vy"
    if not len(recording.knots):
        return
    begin, end = float(recording.knots["t"].min()), float(recording.knots["t"].max())
    if step is None:
        times = np.linspace(begin, end, instants(recording)).tolist()
    else:
        # An end after a whole number of steps belongs to the table, whatever rounding gives.
        last = int((end - begin) / step * (1.0 + 1e-12))
        times = [min(begin + step * n, end) for n in range(last + 1)]
    for t in times:
        (position,), (velocity,) = recording.at([t])
        for i in np.flatnonzero(np.isfinite(position[:, 0])).tolist():
            yield t, i, *position[i].tolist(), *velocity[i].tolist()


def _passages(recording: Record) -> Iterator[Sequence[object]]:
    need_sensors(recording.scene)
    yield "sensor", "t", "particle", "way", "along", "x", "y", "vx", "vy", "radius", "mass"
    for sensor in recording.scene.sensor:
        for t, particle, way, along, place, velocity in sensed(recording, sensor.name).tolist():
            own = float(recording.radius[particle]), float(recording.mass[particle])
            yield sensor.name, t, particle, way, along, *place, *velocity, *own


def _loads(recording: Record) -> Iterator[Sequence[object]]:
    need_loads(recording)
    yield "surface", "t", "normal", "along", "fx", "fy", "x", "y", "torque"
    for name, one in borne(recording).items():
        columns = one.edges, one.normal, one.along, *one.force.T, *one.place.T, one.torque
        for t, *row in zip(*(column.tolist() for column in columns), strict=False):
            yield name, t, *(None if isnan(value) else value for value in row)


def _wear(recording: Record, coefficients: Mapping[str, float]) -> Iterator[Sequence[object]]:
    yield "surface", "from", "to", "x", "y", *KEYS, *(f"{key}_m3" for key in coefficients)
    for name, one in touched(recording).items():
        columns = (
            one.edges[:-1],
            one.edges[1:],
            *one.places[:, 1].T,
            *(getattr(one, key) for key in KEYS),
            *(k * getattr(one, key) for key, k in coefficients.items()),
        )
        for row in zip(*(column.tolist() for column in columns), strict=True):
            yield name, *(None if isnan(value) else value for value in row)
