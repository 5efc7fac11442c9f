"""Columns as a pandas DataFrame, where pandas is installed, and as CSV."""

from __future__ import annotations

import csv
import io
from importlib import import_module
from math import isnan
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from collections.abc import Mapping

    from numpy.typing import NDArray


def frame(columns: Mapping[str, NDArray[Any]]) -> Any:
    """Return named columns of one length as a DataFrame.

    Raises
    ------
    ImportError
        Without pandas; says what to install.
    """
    try:
        pandas = import_module("pandas")
    except ImportError as error:
        raise ImportError(
            "A DataFrame needs pandas: pip install pandas. The arrays are there without it."
        ) from error
    return pandas.DataFrame(dict(columns))


def csv_text(columns: Mapping[str, NDArray[Any]]) -> str:
    """Return named columns of one length as CSV; NaN is an empty cell."""
    out = io.StringIO()
    writer = csv.writer(out, lineterminator="\n")
    writer.writerow(columns)
    for row in zip(*(column.tolist() for column in columns.values()), strict=True):
        writer.writerow("" if isinstance(one, float) and isnan(one) else one for one in row)
    return out.getvalue()
