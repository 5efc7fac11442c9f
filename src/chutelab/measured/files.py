"""A comparison for programs: as one JSON object, and as a table of points."""

from __future__ import annotations

import csv
import io
from math import isfinite
from typing import TYPE_CHECKING, Any

from chutelab.measured.diagnosis import advice

if TYPE_CHECKING:
    from chutelab.measured.residuals import Residuals
    from chutelab.measured.result import Fit

COLUMNS = (
    "line", "t", "x", "y", "simulated_x", "simulated_y", "residual_x", "residual_y",
)  # fmt: skip


def as_dict(found: Residuals, fit: Fit | None = None) -> dict[str, Any]:
    """Return what is known of a comparison, SI units, ready for JSON."""
    track, place = found.track, found.track.placement
    return {
        "format": 1,
        "scene": found.recording.title,
        "data": track.source,
        "track": track.name,
        "points": len(track),
        "used": int(found.used.sum()),
        "left_out": found.left_out(),
        "skipped": track.skipped,
        "placement": {
            "scale": place.scale,
            "origin": list(place.origin),
            "flip_y": place.flip_y,
            "t0": place.t0,
        },
        "residuals": _residuals(found),
        "advice": advice(found),
        "fit": None if fit is None else _fit(fit),
    }


def points_csv(found: Residuals) -> str:
    """Return a table of the points, in the world and on the simulation's clock.

    Points outside the simulated time have no simulated position and no residual.
    """
    text = io.StringIO()
    table = csv.writer(text, lineterminator="\n")
    table.writerow(COLUMNS)
    track = found.track
    for line, t, measured, simulated, off in zip(
        track.lines, track.t, track.position, found.simulated, found.values, strict=True
    ):
        numbers = (t, *measured, *simulated, *off)
        table.writerow([line, *(f"{value:.9g}" if isfinite(value) else "" for value in numbers)])
    return text.getvalue()


def _residuals(found: Residuals) -> dict[str, Any]:
    i = found.worst
    (rms_x, rms_y), (mean_x, mean_y) = found.rms, found.mean
    return {
        "rms_x": rms_x,
        "rms_y": rms_y,
        "mean_x": mean_x,
        "mean_y": mean_y,
        "worst": {
            "line": int(found.track.lines[i]),
            "t": float(found.track.t[i]),
            "x": float(found.values[i, 0]),
            "y": float(found.values[i, 1]),
        },
    }


def _fit(fit: Fit) -> dict[str, Any]:
    columns = zip(fit.parameters, fit.values, fit.errors, fit.low, fit.high, strict=True)
    return {
        "parameters": {
            parameter.key: {
                "value": float(value),
                "error": float(error),
                "low": float(low),
                "high": float(high),
                "start": parameter.start,
                "unit": parameter.unit,
            }
            for parameter, value, error, low, high in columns
        },
        "correlation": fit.correlation.tolist(),
        "scatter": fit.scatter,
        "freedom": fit.freedom,
        "robust": fit.robust,
        "notes": list(fit.notes),
        "before": _residuals(fit.before),
    }
