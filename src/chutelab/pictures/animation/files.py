"""Films as files: GIF or video.

Pillow writes the GIF: one fixed palette for all frames, so that no colour can flicker, and of each
frame only the pixels that changed. Videos, mp4 or webm, go through imageio and its ffmpeg.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from importlib.util import find_spec
from itertools import combinations
from pathlib import Path
from typing import Any, cast

import numpy as np
from numpy.typing import NDArray
from PIL import Image
from PIL.GifImagePlugin import getdata, getheader

from chutelab.pictures import PURPLE
from chutelab.pictures.animation.drawing import Part
from chutelab.pictures.plots import style
from chutelab.util.arrays import Ints
from chutelab.util.errors import MissingLibraryError


def palette() -> tuple[str, ...]:
    """Return the colours of every GIF: few, since few make a small file.

    These are the background, the greys and the colours with a meaning, and mixtures of them with
    which anti-aliased edges look smooth. Every other colour is shown as the nearest of these.
    """
    hues = [style.TRACK, style.ANALYTIC, style.BELT, style.STRIKE, style.STREAM, PURPLE]
    flat = [*style.ENERGY.values(), style.WALL]
    edges = [style.tint(hue, share) for share in (0.5, 0.75, 0.25) for hue in hues]
    meeting = [style.tint(one, 0.5, other) for one, other in combinations(hues, 2)]
    dark = [style.tint(hue, 0.6, style.INK) for hue in hues]
    greys = [
        style.GROUND,
        style.INK,
        style.MUTED,
        style.STEEL,
        style.STEEL_LIGHT,
        style.ENERGY["start"],
        style.BELT_BODY,
        style.CLEAT,
        style.BELT_NAME,
    ]
    # Otherwise a grey edge would be shown in a dull colour.
    greys += [style.tint(style.INK, share) for share in (0.81, 0.592, 0.53, 0.17)]
    return tuple(dict.fromkeys([*greys, *hues, *flat, *edges, *meeting, *dark]))


class Colours:
    """Maps pixels to the colours of `palette`."""

    def __init__(self) -> None:
        self.table = b"".join(bytes.fromhex(colour[1:]) for colour in palette())
        # Table over the upper six bits of red, green and blue, filled when a colour first occurs.
        self.known = np.full(1 << 18, -1, dtype=np.int16)

    def of(self, pixels: NDArray[np.uint32]) -> NDArray[np.uint8]:
        """Return the numbers of the nearest colours of pixels (n,), RGBA."""
        keys = (pixels >> 2 & 0x3F) | (pixels >> 4 & 0xFC0) | (pixels >> 6 & 0x3F000)
        found = self.known[keys]
        if (found < 0).any():
            new = np.unique(keys[found < 0])
            parts = np.stack([new << 2 & 0xFC, new >> 4 & 0xFC, new >> 10 & 0xFC], axis=-1)
            colours = np.frombuffer(self.table, np.uint8).reshape(-1, 3)
            away = parts.astype(int)[:, None] - colours
            self.known[new] = (away**2).sum(axis=2).argmin(axis=1)
            found = self.known[keys]
        return np.asarray(found, dtype=np.uint8)


def changed(now: NDArray[np.uint32], before: NDArray[np.uint32], parts: Iterable[Part]) -> Ints:
    """Return the numbers of the pixels, row by row, that changed in regions of a picture.

    `before` is updated to `now` there.
    """
    found = [np.empty(0, dtype=np.intp)]
    for rows, columns in parts:
        new, old = now[rows, columns], before[rows, columns]
        (at,) = (new != old).ravel().nonzero()
        if len(at):
            old[:] = new
            y, x = np.divmod(at, new.shape[1])
            found.append((y + rows.start) * now.shape[1] + x + columns.start)
    return np.concatenate(found)


def write_gif(
    path: Path,
    pictures: Iterable[tuple[NDArray[np.uint8], Iterable[Part]]],
    delays: Iterable[int],
    comment: str = "",
) -> None:
    """Write pictures of one size, (H, W, 4), RGBA, as a GIF that loops for ever.

    Each picture comes with the regions in which it may differ from the one before. Delays are in
    hundredths of a second; equal pictures in a row become one frame. Only pixels that changed are
    converted and written. The comment is stored, not shown.
    """
    colours = Colours()
    # The table ends with a colour that no pixel has; it is transparent, so that the last frame
    # stays visible.
    clear = len(colours.table) // 3
    look: dict[str, Any] = {"transparency": clear, "disposal": 1}

    def frames() -> Iterator[tuple[NDArray[np.uint8], tuple[int, int], int]]:
        """Yield frames with their places and durations."""
        waits: tuple[NDArray[np.uint8], tuple[int, int]] | None = None
        stays = 0
        for (picture, parts), delay in zip(pictures, delays, strict=True):
            now = picture.view("<u4")[..., 0]
            if waits is None:
                before, shown = now.copy(), np.empty(now.size, dtype=np.uint8)
                starts = np.flatnonzero(np.diff(now.ravel(), prepend=~now[0, :1]))
                lengths = np.diff(starts, append=now.size)
                shown[:] = np.repeat(colours.of(now.ravel()[starts]), lengths)
                waits = shown.reshape(now.shape).copy(), (0, 0)
            else:
                places = changed(now, before, parts)
                found = colours.of(now.ravel()[places])
                other = found != shown[places]
                places, found = places[other], found[other]
                if len(places):
                    yield *waits, stays
                    shown[places] = found
                    y, x = np.divmod(places, now.shape[1])
                    top, left = y.min(), x.min()
                    frame = np.full((y.max() - top + 1, x.max() - left + 1), clear, dtype=np.uint8)
                    frame[y - top, x - left] = found
                    waits, stays = (frame, (int(left), int(top))), 0
            stays += delay
        assert waits is not None
        yield *waits, stays

    with path.open("wb") as file:
        for frame, place, delay in frames():
            image = Image.fromarray(frame)
            if not file.tell():
                image.putpalette(colours.table + bytes(3))
                file.writelines(getheader(image, info={"loop": 0, "comment": comment, **look})[0])
            file.writelines(getdata(image, place, duration=10 * delay, **look))
        file.write(b";")


VIDEOS = {
    "mp4": ("libx264", "-crf 20 -preset medium -movflags +faststart"),
    "webm": ("libvpx-vp9", "-crf 28 -b:v 0 -deadline realtime -cpu-used 7 -row-mt 1"),
}
"""Codec of each kind of video and its options, by the suffix of the file.

Lines and letters stay sharp; the file begins to play before it is all there.
"""


class VideoError(MissingLibraryError):
    """A video cannot be written, and what to do about it."""


def need_video(kind: str) -> None:
    """Raise a `VideoError` if the extra that writes this kind of film is not installed."""
    if find_spec("imageio_ffmpeg") is None:
        raise VideoError(
            f'a film as {kind} needs what is not installed: pip install "chutelab[video]"'
        )


def write_video(
    path: Path, kind: str, fps: int, pictures: Iterable[Image.Image], delays: Iterable[int]
) -> None:
    """Write pictures, each for a delay in hundredths of a second, as a video of one of `VIDEOS`.

    Raises a `VideoError` if the extra is not installed.
    """
    need_video(kind)
    from imageio.v2 import get_writer

    codec, parameters = VIDEOS[kind]
    # So that the same pictures make the same bytes: the encoders' result depends on the number of
    # threads, and ffmpeg writes a random number into a webm unless told.
    parameters += " -threads 4 -flags:v +bitexact -fflags +bitexact"
    options: dict[str, Any] = {
        "fps": fps, "codec": codec, "quality": None, "pixelformat": "yuv420p",
        "macro_block_size": 2, "output_params": parameters.split(), "ffmpeg_log_level": "error",
    }  # fmt: skip
    with cast(Any, get_writer(path, format="FFMPEG", mode="I", **options)) as video:
        for picture, delay in zip(pictures, delays, strict=True):
            for _ in range(max(1, round(delay / (100 // fps)))):
                video.append_data(np.asarray(picture))
