"""A film as mp4 or webm, for programs that show no GIF; through imageio and its ffmpeg."""

from __future__ import annotations

from importlib.util import find_spec
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from pathlib import Path

    import numpy as np
    from numpy.typing import NDArray

VIDEOS = ("mp4", "webm")
"""Kinds of video, by the suffix of their files."""

CODECS = {"mp4": "libx264", "webm": "libvpx-vp9"}

QUALITY = {
    "mp4": ["-crf", "20", "-preset", "medium", "-movflags", "+faststart"],
    "webm": ["-crf", "28", "-b:v", "0", "-deadline", "realtime", "-cpu-used", "7", "-row-mt", "1"],
}
"""Lines and letters stay sharp; the file begins to play before it is all there."""


class VideoError(RuntimeError):
    """A video cannot be written, and what to do about it."""


def need_video(kind: str) -> None:
    """Raise a `VideoError` if the extra that writes this kind of film is not installed."""
    if find_spec("imageio_ffmpeg") is None:
        raise VideoError(
            f'a film as {kind} needs what is not installed: pip install "chutelab[video]"'
        )


class VideoWriter:
    """Writes frames to a video; a context manager.

    Parameters
    ----------
    path : Path
        Of the file.
    kind : str
        One of `VIDEOS`.
    fps : int
        Frames a second.
    width, height : int
        Pixels, even numbers.

    Raises
    ------
    VideoError
        If the extra is not installed.
    ValueError
        If the size is not even, which the formats cannot store.
    """

    def __init__(self, path: Path, kind: str, fps: int, width: int, height: int) -> None:
        if width % 2 or height % 2:
            raise ValueError(f"{width} x {height} pixels: allowed in a video are even numbers")
        need_video(kind)
        from imageio.v2 import get_writer

        self._each = 100 // fps
        self._writer: Any = get_writer(
            path,
            format="FFMPEG",
            mode="I",
            fps=fps,
            codec=CODECS[kind],
            quality=None,
            pixelformat="yuv420p",
            macro_block_size=2,
            output_params=QUALITY[kind],
            ffmpeg_log_level="error",
        )

    def __enter__(self) -> VideoWriter:
        return self

    def __exit__(self, *_exception: object) -> None:
        self._writer.close()

    def add(self, picture: NDArray[np.uint8], delay: int) -> None:
        """Append a picture, (height, width, 3), for a delay in hundredths of a second."""
        for _ in range(max(1, round(delay / self._each))):
            self._writer.append_data(picture)
