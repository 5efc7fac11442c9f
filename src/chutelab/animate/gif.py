"""The film as a GIF: one shared palette, delays in whole hundredths, written whole or not at all.

Pillow writes the file itself, not through imageio: that has no way to pass frames that already
share a palette.
"""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from PIL import Image

from chutelab.animate.film import film, frame_delay, slowness, span
from chutelab.animate.stage import VIEW, Stage
from chutelab.plots.output import whole
from chutelab.plots.scenery import machine_of, scene_of, window_of
from chutelab.theory import predict

if TYPE_CHECKING:
    from collections.abc import Iterator

    from chutelab.recording import Recording

COLOURS = 255
"""Of the palette: one index is left, for what does not change from frame to frame."""

SAMPLES = 8
"""Frames that the palette is made from."""

LEAST = (320, 180)
"""Pixels below which text cannot be read."""


def animate(
    recording: Recording,
    path: str | Path,
    *,
    fps: int = 25,
    width: int = 800,
    height: int = 450,
    slow: float | None = None,
) -> Path:
    """Write the lesson picture of a recording, a GIF that loops for ever.

    Parameters
    ----------
    recording : Recording
        From either engine, with at least one knot of particle 0.
    path : path
        Where to; written whole or not at all.
    fps : int
        Pictures a second: 25 or 50, or another divisor of 100 below.
    width, height : int
        Pixels.
    slow : float, optional
        Seconds on the screen for one second of the recording; by default a round number that
        makes the motion take four to six seconds, holds not counted.

    Returns
    -------
    Path
        Of the file.

    Raises
    ------
    ValueError
        If `fps`, `slow` or the size is not possible.
    OSError
        If the file cannot be written.
    """
    frame_delay(fps)
    if width < LEAST[0] or height < LEAST[1]:
        raise ValueError(f"{width} x {height} pixels: allowed are at least {LEAST[0]} x {LEAST[1]}")
    machine = machine_of(recording)
    aspect = VIEW[2] * width / (VIEW[3] * height)
    window = window_of(recording, machine).fitted(aspect)
    begin, end = span(recording, window)
    pace = slowness(end - begin) if slow is None else slow
    moments = film(recording, begin, end, fps=fps, slow=pace)
    stage = Stage(
        recording,
        machine,
        predict(scene_of(recording)),
        window,
        moments,
        slow=pace,
        width=width,
        height=height,
    )
    path = Path(path)
    with whole(path) as unfinished:
        _write(stage, unfinished)
    return path


def _write(stage: Stage, path: Path) -> None:
    count = len(stage.moments)
    palette = shared_palette(
        [stage.frame(i) for i in np.unique(np.linspace(0, count - 1, SAMPLES).astype(int))]
    )
    frames = _frames(stage, palette)
    next(frames).save(
        path,
        format="GIF",
        save_all=True,
        append_images=frames,
        # Pillow counts in milliseconds.
        duration=[10 * moment.delay for moment in stage.moments],
        loop=0,
        optimize=True,
    )


def _frames(stage: Stage, palette: Image.Image) -> Iterator[Image.Image]:
    for i in range(len(stage.moments)):
        picture = Image.fromarray(stage.frame(i))
        yield picture.quantize(palette=palette, dither=Image.Dither.NONE)


def shared_palette(frames: list[np.ndarray]) -> Image.Image:
    """Return an image whose palette suits all of the frames, (height, width, 3) each."""
    return Image.fromarray(np.concatenate(frames)).quantize(
        colors=COLOURS, method=Image.Quantize.MEDIANCUT, dither=Image.Dither.NONE
    )
