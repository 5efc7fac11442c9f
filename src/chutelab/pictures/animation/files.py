"""`animate`: the lesson picture as a GIF, or as a video for those who project from other programs.

A GIF has one palette for all frames, and of each frame only the rectangle that changed. Videos, mp4
or webm, go through imageio and its ffmpeg.
"""

from __future__ import annotations

from collections.abc import Collection
from importlib.util import find_spec
from pathlib import Path
from struct import pack
from typing import Any, BinaryIO

import numpy as np
from numpy.typing import NDArray
from PIL import Image

from chutelab.pictures.animation.moments import film, frame_delay, slowness, span
from chutelab.pictures.animation.palette import BITS, CLEAR, Palette, Pixels
from chutelab.pictures.animation.stage import SHOWS, Stage, lay_out
from chutelab.results import Recording
from chutelab.util.arrays import Bools
from chutelab.util.files import whole

FOREVER = b"!\xff\x0bNETSCAPE2.0\x03\x01\x00\x00\x00"
"""The application extension that makes a GIF start again whenever it ends."""

LONGEST = 0xFFFF
"""Hundredths of a second that one frame can stay."""

KEEP, TRANSPARENT = 1 << 2, 1
"""Of a frame: the next one is drawn over it; it has a transparent index."""

Part = tuple[slice, slice]
"""Rows and columns of a picture, with starts and stops."""


class GifWriter:
    """Writes frames to a file; to be closed, or the last one is missing.

    Parameters
    ----------
    file : binary file
        Open for writing.
    width, height : int
        Pixels.
    """

    def __init__(self, file: BinaryIO, width: int, height: int) -> None:
        self._file = file
        self._palette = Palette()
        self._seen: Pixels | None = None
        self._screen: NDArray[np.uint8] = np.full((height, width), CLEAR, dtype=np.uint8)
        self._waiting: tuple[bytes, int] | None = None
        # A global table of 2**BITS colours, eight bits each; no background, square pixels.
        packed = 0x80 | 7 << 4 | (BITS - 1)
        file.write(pack("<6sHHBBB", b"GIF89a", width, height, packed, 0, 0))
        file.write(self._palette.bytes() + FOREVER)

    def add(self, pixels: Pixels, delay: int) -> None:
        """Append a picture.

        Parameters
        ----------
        pixels : ndarray, shape (height, width), uint32
            Red in the lowest byte; it may be overwritten afterwards.
        delay : int
            Hundredths of a second that it stays. A picture like the one before lengthens that.
        """
        data = self._data(pixels)
        if data is None and self._waiting is not None and self._waiting[1] + delay <= LONGEST:
            self._waiting = self._waiting[0], self._waiting[1] + delay
            return
        self._flush()
        # Nothing new, but too long for one frame: a pixel of nothing.
        self._waiting = data or _block(np.s_[0:1, 0:1], np.full((1, 1), CLEAR, np.uint8)), delay

    def close(self) -> None:
        """Write the last frame and the end."""
        self._flush()
        self._file.write(b";")

    def _flush(self) -> None:
        if self._waiting is not None:
            block, delay = self._waiting
            control = pack("<3sBHBB", b"!\xf9\x04", KEEP | TRANSPARENT, delay, CLEAR, 0)
            self._file.write(control + block)
        self._waiting = None

    def _data(self, pixels: Pixels) -> bytes | None:
        """Return the image block of what changed; None if nothing did."""
        whole = (slice(0, pixels.shape[0]), slice(0, pixels.shape[1]))
        if self._seen is None:
            self._seen = pixels.copy()
            self._screen = self._palette.indices(pixels.ravel()).reshape(pixels.shape)
            return _block(whole, self._screen)
        differs = pixels != self._seen
        self._seen[:] = pixels
        part = bounds(differs, whole)
        if part is None:
            return None
        changed = differs[part]
        screen = self._screen[part]
        new = self._palette.indices(pixels[part][changed])
        # Colours that differ may be shown as the same one.
        patch = np.full(changed.shape, CLEAR, dtype=np.uint8)
        patch[changed] = np.where(new == screen[changed], np.uint8(CLEAR), new)
        screen[changed] = new
        inner = bounds(patch != CLEAR, part)
        if inner is None:
            return None
        row, column = inner[0].start - part[0].start, inner[1].start - part[1].start
        rows, columns = inner[0].stop - inner[0].start, inner[1].stop - inner[1].start
        return _block(inner, patch[row : row + rows, column : column + columns])


def _block(part: Part, indices: NDArray[np.uint8]) -> bytes:
    """Return indices, (rows, columns), as the image block of a GIF."""
    rows, columns = indices.shape
    image = Image.frombytes("P", (columns, rows), indices.tobytes())
    place = pack("<cHHHHBB", b",", part[1].start, part[0].start, columns, rows, 0, BITS)
    return place + image.tobytes("gif", "P", BITS, 0) + b"\0"


def bounds(mask: Bools, part: Part) -> Part | None:
    """Return the smallest part that holds all that is true in the mask of a part, None if nothing.

    >>> bounds(np.array([[False, True, True], [False, False, False]]), np.s_[10:12, 20:23])
    (slice(10, 11, None), slice(21, 23, None))
    """
    rows = np.flatnonzero(mask.any(axis=1))
    if not len(rows):
        return None
    columns = np.flatnonzero(mask[rows[0] : rows[-1] + 1].any(axis=0))
    top, left = part[0].start, part[1].start
    return (
        slice(top + int(rows[0]), top + int(rows[-1]) + 1),
        slice(left + int(columns[0]), left + int(columns[-1]) + 1),
    )


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


FORMATS = ("gif", *VIDEOS)
"""Files that `animate` writes, by their suffix."""


def animate(
    recording: Recording,
    path: str | Path,
    *,
    fps: int = 25,
    width: int = 800,
    height: int = 450,
    slow: float | None = None,
    title: str | None = None,
    question: str = "",
    show: Collection[str] = SHOWS,
) -> Path:
    """Write the lesson picture of a recording, a GIF that loops for ever, or a video.

    Parameters
    ----------
    recording : Recording
        From either engine, with at least one knot of particle 0.
    path : path
        Where to; written whole or not at all. Its suffix says what: .gif, .mp4 or .webm, the last
        two with the extra ``chutelab[video]``.
    fps : int
        Pictures a second: 25 or 50, or another divisor of 100 below.
    width, height : int
        Pixels; even numbers for a video.
    slow : float, optional
        Seconds on the screen for one second of the recording; by default a round number that
        makes the motion take three to five seconds, holds not counted.
    title : str, optional
        By default the recording's.
    question : str, optional
        A line under the title.
    show : collection of str, optional
        Which of `SHOWS` to show: "parabola" (the analytic one, dashed), "trails", "strobe" (dots
        at round times), "velocity" (of particle 0, an arrow with its components) and "energy"
        (the ledger as bars; without it the scene is wider).

    Returns
    -------
    Path
        Of the file.

    Raises
    ------
    ValueError
        If the suffix, `fps`, `slow`, `show` or the size is not possible.
    VideoError
        If a video is asked for and the extra is not installed.
    OSError
        If the file cannot be written.
    """
    path = Path(path)
    kind = path.suffix.removeprefix(".").lower()
    if kind not in FORMATS:
        allowed = ", ".join(f".{name}" for name in FORMATS)
        raise ValueError(f"{path.name}: allowed are files that end in {allowed}")
    frame_delay(fps)
    shows = frozenset([show] if isinstance(show, str) else show)
    machine = recording.machine
    layout = lay_out(
        recording,
        machine,
        width=width,
        height=height,
        title=title,
        question=question,
        shows=shows,
    )
    begin, end = span(recording, layout.window)
    pace = slowness(end - begin) if slow is None else slow
    moments = film(recording, begin, end, fps=fps, slow=pace)
    stage = Stage(recording, machine, recording.prediction, layout, moments, slow=pace)
    with whole(path) as unfinished:
        if kind == "gif":
            with unfinished.open("wb") as file:
                gif = GifWriter(file, width, height)
                for index, moment in enumerate(moments):
                    gif.add(stage.paint(index), moment.delay)
                gif.close()
        else:
            with VideoWriter(unfinished, kind, fps, width, height) as video:
                for index, moment in enumerate(moments):
                    video.add(stage.frame(index), moment.delay)
    return path
