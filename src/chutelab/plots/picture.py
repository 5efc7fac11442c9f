"""A figure that shows itself in a notebook, whatever matplotlib was told there."""

from __future__ import annotations

from io import BytesIO
from typing import Any

from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

ON_SCREEN = 80
"""Dots to the inch in a notebook; files have what the figure was made with."""


class Picture(Figure):
    """A matplotlib figure with its canvas, made without pyplot; arguments as of `Figure`."""

    def __init__(self, *args: Any, **kwargs: Any) -> None:
        super().__init__(*args, **kwargs)
        FigureCanvasAgg(self)

    def _repr_png_(self) -> bytes:
        buffer = BytesIO()
        self.savefig(buffer, format="png", dpi=ON_SCREEN)
        return buffer.getvalue()
