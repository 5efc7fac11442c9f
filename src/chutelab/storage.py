"""Recordings on disk: one npz file that round-trips to the last bit, and CSV for spreadsheets."""

from __future__ import annotations

import json
import zipfile
from dataclasses import asdict, fields
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from chutelab.files import whole
from chutelab.recording import EVENT, KNOT, Kind, Particle, Recording

if TYPE_CHECKING:
    from collections.abc import Collection, Iterable

FORMAT = 1
"""Version of the file; a reader refuses what it does not know."""

ARRAYS = {
    "knots": KNOT,
    "offsets": np.dtype("i8"),
    "ended": np.dtype("i1"),
    "events": EVENT,
    "by_surface": np.dtype("f8"),
}

SAMPLES = 200
"""Rows of trajectory.csv per particle where no interval is asked for."""

MOST_SAMPLES = 1_000_000
"""Rows of trajectory.csv altogether where no interval is asked for: beyond it no spreadsheet opens
the file, so many particles get fewer rows each."""


class RecordingError(ValueError):
    """A file is not a recording that this version can read."""


def save(recording: Recording, path: str | Path) -> Path:
    """Write a recording to an npz file, whole or not at all."""
    path = Path(path)
    about = {
        field.name: getattr(recording, field.name)
        for field in fields(recording)
        if field.name not in ARRAYS
    }
    about["particle"] = asdict(recording.particle)
    header = json.dumps({"format": FORMAT, **about})
    arrays = {name: getattr(recording, name) for name in ARRAYS}
    with whole(path) as unfinished, unfinished.open("wb") as file:
        np.savez_compressed(file, about=np.array(header), **arrays)
    return path


def load(path: str | Path) -> Recording:
    """Read what `save` wrote.

    Raises
    ------
    RecordingError
        If the file is missing, damaged, of another kind or of another version.
    """
    path = Path(path)
    try:
        with np.load(path, allow_pickle=False) as data:
            about: dict[str, Any] = json.loads(str(data["about"]))
            if about.pop("format", None) != FORMAT:
                raise RecordingError(
                    f"{path}: a recording of another version of chutelab; run its scene again"
                )
            arrays = {name: data[name] for name in ARRAYS}
        if any(array.dtype != ARRAYS[name] for name, array in arrays.items()):
            raise RecordingError(f"{path}: not a recording: its arrays are of another type")
        about["particle"] = Particle(**about["particle"])
        about["surfaces"] = tuple(about["surfaces"])
        return Recording(**about, **arrays)
    except RecordingError:
        raise
    except FileNotFoundError:
        raise RecordingError(f"{path}: no such file") from None
    except OSError as error:
        raise RecordingError(f"{path}: cannot be read: {error.strerror or error}") from None
    except (ValueError, KeyError, TypeError, EOFError, zipfile.BadZipFile) as error:
        raise RecordingError(
            f"{path}: not a recording as `chutelab run --out` writes it (recording.npz)"
        ) from error


def to_csv(
    recording: Recording,
    folder: str | Path,
    *,
    step: float | None = None,
    only: Collection[str] = ("events", "trajectory"),
) -> list[Path]:
    """Write events.csv and trajectory.csv, each whole or not at all.

    Parameters
    ----------
    recording : Recording
        What to write.
    folder : path
        Existing directory.
    step : float, optional
        Interval of the trajectory, s; by default about `SAMPLES` rows a particle.
    only : collection of str
        Which of the two.

    Raises
    ------
    ValueError
        If `step` is not positive.
    """
    if step is not None and not step > 0.0:
        raise ValueError(f"step = {step!r}: more than 0 s")
    written = []
    for name, lines in (("events", _events), ("trajectory", _trajectory)):
        if name in only:
            path = Path(folder) / f"{name}.csv"
            with whole(path) as unfinished, unfinished.open("w", encoding="utf-8") as file:
                file.writelines(f"{line}\n" for line in lines(recording, step))
            written.append(path)
    return written


def _events(recording: Recording, _step: float | None) -> Iterable[str]:
    yield (
        "t,particle,other,kind,surface,x,y,vx_before,vy_before,vx_after,vy_after,"
        "omega_before,omega_after,normal_impulse,tangential_impulse"
    )
    events, kinds = recording.events, [kind.name.lower() for kind in Kind]
    names = (*recording.surfaces, "")
    vectors = ("position", "velocity_before", "velocity_after")
    scalars = ("omega_before", "omega_after", "normal_impulse", "tangential_impulse")
    numbers = [column for name in vectors for column in events[name].T.tolist()]
    numbers += [events[name].tolist() for name in scalars]
    heads = zip(*(events[name].tolist() for name in EVENT.names[:5]), strict=True)
    for (t, particle, other, kind, surface), *row in zip(heads, *numbers, strict=True):
        partner = "" if other < 0 else str(other)
        yield ",".join(
            [repr(t), str(particle), partner, kinds[kind], names[surface], *map(repr, row)]
        )


def _trajectory(recording: Recording, step: float | None) -> Iterable[str]:
    yield "t,particle,x,y,vx,vy"
    if not len(recording.knots):
        return
    begin, end = float(recording.knots["t"].min()), float(recording.knots["t"].max())
    if step is None:
        rows = max(2, min(SAMPLES, MOST_SAMPLES // recording.count))
        times = np.linspace(begin, end, rows)
    else:
        times = begin + step * np.arange(int((end - begin) / step * (1.0 + 1e-12)) + 1)
    for t in times:
        position, velocity = recording.at([t])
        for i in np.flatnonzero(np.isfinite(position[0, :, 0])):
            (x, y), (vx, vy) = position[0, i].tolist(), velocity[0, i].tolist()
            yield f"{float(t)!r},{i},{x!r},{y!r},{vx!r},{vy!r}"
