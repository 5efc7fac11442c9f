"""A figure with a headline, that writes itself and shows itself in a notebook.

Whatever matplotlib was told there.
"""

from __future__ import annotations

from io import BytesIO
from pathlib import Path
from textwrap import shorten
from typing import Any

from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

from chutelab.files import whole
from chutelab.plots import style

DPI = 120
"""Dots to the inch in files, unless a picture is for print."""

ON_SCREEN = 80
"""Dots to the inch in a notebook; files have what the figure was made with."""


class Picture(Figure):
    """A matplotlib figure with its canvas, made without pyplot; arguments as of `Figure`."""

    def __init__(self, *args: Any, **kwargs: Any) -> None:
        super().__init__(*args, **kwargs)
        FigureCanvasAgg(self)

    def headline(self, x: float, y: float, title: str, longest: int = 80) -> None:
        """Write a title at a place, in shares of the figure, cut at `longest` characters."""
        self.text(
            x, y, shorten(title, longest, placeholder=" …"),
            fontsize=style.LARGE, fontweight="bold", verticalalignment="center",
        )  # fmt: skip

    def write(self, path: str | Path | None) -> None:
        """Write the figure, whole or not at all; nothing without a path.

        The suffix says the format, PNG without one.
        """
        if path is None:
            return
        with whole(path) as unfinished:
            self.savefig(unfinished, format=Path(path).suffix.lstrip(".") or "png")

    def _repr_png_(self) -> bytes:
        buffer = BytesIO()
        self.savefig(buffer, format="png", dpi=ON_SCREEN)
        return buffer.getvalue()
