"""The film as a GIF: one shared palette, delays in whole hundredths, written whole or not at all.

Pillow writes the file itself, not through imageio: that has no way to pass frames that already
share a palette.
"""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from PIL import Image

from chutelab.animate.moments import film, frame_delay, slowness, span
from chutelab.animate.stage import VIEW, Stage
from chutelab.files import whole
from chutelab.plots import style
from chutelab.plots.scenery import machine_of, scene_of
from chutelab.plots.window import window_of
from chutelab.theory import predict

if TYPE_CHECKING:
    from collections.abc import Iterator

    from numpy.typing import NDArray

    from chutelab.recording import Recording

COLOURS = 255
"""Of the palette: one index is left, for what does not change from frame to frame."""

PURE = ("#FFFFFF", *sorted({*style.ENERGY.values(), style.TRACK, style.STREAM, style.ANALYTIC}))
"""Colours that the palette holds unmixed."""

NEXT_TO = 11
"""Steps (of 255) in every channel within which a mixed colour gives way to a pure one: Pillow looks
colours up by the corner of a cell, up to 3 steps away in each channel, so that one at less than
twice that distance could be taken for it."""

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


def shared_palette(frames: list[NDArray[np.uint8]]) -> Image.Image:
    """Return an image whose palette suits all of the frames, (height, width, 3) each.

    White and the colours that stand for something are in it as they are; median cut, which mixes
    neighbours, chooses the rest.
    """
    exact = np.array([_rgb(colour) for colour in PURE], dtype=np.uint8)
    mixed = Image.fromarray(np.concatenate(frames)).quantize(
        colors=COLOURS - len(exact), method=Image.Quantize.MEDIANCUT, dither=Image.Dither.NONE
    )
    rest = np.array(mixed.getpalette(), dtype=np.uint8).reshape(-1, 3)
    apart = np.abs(rest[:, None].astype(int) - exact).max(axis=2).min(axis=1) > NEXT_TO
    table = Image.new("P", (1, 1))
    table.putpalette([*exact.ravel().tolist(), *rest[apart].ravel().tolist()])
    return table


def _rgb(colour: str) -> tuple[int, ...]:
    return tuple(bytes.fromhex(colour.removeprefix("#")))
