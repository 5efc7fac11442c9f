"""Pictures that answer: sliders for notebooks, and a page that needs no installation.

>>> from chutelab.pictures.live import sliders
>>> sliders("perpendicular")  # doctest: +SKIP

- `picture`: a run as SVG and a table; drawn as text, since that takes a few milliseconds.
- `board`: the sliders and the picture together; the only module that needs ipywidgets.
- `runs`: every variant of a page simulated, and packed.
- `describe`: what a page is told of its scene: keys, their rules, materials.
- `page`: `write`, a scene and its variants as one HTML file.
- ``assets``: HTML, CSS and JavaScript of the page: ``tracks.js`` (curves between knots),
  ``books.js`` (the energy ledger), ``view.js``, ``picture.js`` and ``film.js`` (the canvas: scale,
  what rests, what moves), ``panels.js`` (bars and numbers), ``input.js`` (keyboard and touch),
  ``main.js`` (sliders and clock).

No physics is in the page: it draws the cubic Hermite curves through the knots that the engine left.
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from chutelab.scene import Scene, load

if TYPE_CHECKING:
    import ipywidgets


def sliders(scene: Scene | str | Path, overrides: Sequence[str] = ()) -> ipywidgets.VBox:
    """Show a scene with a slider for each quantity it has: angle, speeds, ε, µ.

    Parameters
    ----------
    scene : Scene, str or Path
        A scene, a file, or the name of a shipped scene.
    overrides : sequence of str
        ``KEY=VALUE`` each, laid over a file or shipped scene.

    Returns
    -------
    ipywidgets.VBox
        Put it last in a cell to see it.

    Raises
    ------
    SceneError
        If the scene cannot be used. What a slider makes impossible is said in words instead.
    ImportError
        Without ipywidgets.
    """
    try:
        from chutelab.pictures.live.board import Board
    except ModuleNotFoundError as error:
        message = 'live sliders need ipywidgets: python -m pip install "chutelab[notebook]"'
        raise ImportError(message) from error
    return Board(scene if isinstance(scene, Scene) else load(scene, overrides)).box


__all__ = ["sliders"]
