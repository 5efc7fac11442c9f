"""`animate`: the lesson picture as a GIF, or as a video for those who project from other programs.

Pillow writes the GIF: one fixed palette for all frames, so that no colour can flicker, and of each
frame only the pixels that changed. Videos, mp4 or webm, go through imageio and its ffmpeg.
"""

from __future__ import annotations

from collections.abc import Collection, Iterable
from importlib.util import find_spec
from itertools import combinations
from pathlib import Path
from typing import Any, cast

import numpy as np
from PIL import Image

from chutelab.pictures import PURPLE
from chutelab.pictures.animation.moments import Moment, asked, film, slowness, span
from chutelab.pictures.animation.stage import Stage, lay_out
from chutelab.pictures.plots import style
from chutelab.pictures.plots.scenery import as_crowd
from chutelab.results import Recording
from chutelab.util.errors import MissingLibraryError
from chutelab.util.files import whole

HUES = (
    style.TRACK, style.ANALYTIC, style.BELT, style.STRIKE, style.STREAM, PURPLE,
)  # fmt: skip


def palette() -> tuple[str, ...]:
    """Return the colours of every GIF: few, since few make a small file.

    White, the greys and the colours with a meaning, unmixed, and the mixtures at which anti-aliased
    edges between them are read as smooth. Every other colour is shown as the nearest of these.
    """
    edges = [style.tint(hue, share) for share in (0.5, 0.75, 0.25) for hue in HUES]
    meeting = [style.tint(one, 0.5, other) for one, other in combinations(HUES, 2)]
    dark = [style.tint(hue, 0.6, "#000000") for hue in HUES]
    greys = [
        "#FFFFFF",
        "#000000",
        style.MUTED,
        style.STEEL,
        style.STEEL_LIGHT,
        style.ENERGY["start"],
    ]
    # Where a grey edge would otherwise be shown in a dull colour.
    greys += ["#303030", "#686868", "#787878", "#D4D4D4"]
    return tuple(dict.fromkeys([*greys, *HUES, *edges, *meeting, *dark]))


def write_gif(
    path: Path, pictures: Iterable[Image.Image], delays: Iterable[int], comment: str = ""
) -> None:
    """Write RGB pictures of one size as a GIF that loops for ever.

    Each stays for its delay in hundredths of a second; equal ones in a row become one frame. Pillow
    keeps a byte for each of their pixels until all are drawn. The comment is kept, not shown.
    """
    table = b"".join(bytes.fromhex(colour[1:]) for colour in palette())
    reference = Image.new("P", (1, 1))
    reference.putpalette(table)
    few = (one.quantize(palette=reference, dither=Image.Dither.NONE) for one in pictures)
    next(few).save(
        path,
        format="GIF",
        save_all=True,
        append_images=few,
        duration=[10 * delay for delay in delays],
        loop=0,
        # The table ends with a colour that no pixel has: there the last frame stays to be seen.
        palette=table + bytes(3),
        transparency=len(table) // 3,
        disposal=1,
        optimize=True,
        comment=comment,
    )


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

    Raises
    ------
    VideoError
        If the extra is not installed.
    """
    need_video(kind)
    from imageio.v2 import get_writer

    codec, parameters = VIDEOS[kind]
    # The same pictures make the same bytes: the encoders' work depends on how many threads share
    # it, and ffmpeg gives a webm a random number unless told.
    parameters += " -threads 4 -flags:v +bitexact -fflags +bitexact"
    options: dict[str, Any] = {
        "codec": codec,
        "quality": None,
        "pixelformat": "yuv420p",
        "macro_block_size": 2,
        "output_params": parameters.split(),
        "ffmpeg_log_level": "error",
    }
    with cast(Any, get_writer(path, format="FFMPEG", mode="I", fps=fps, **options)) as video:
        for picture, delay in zip(pictures, delays, strict=True):
            for _ in range(max(1, round(delay / (100 // fps)))):
                video.append_data(np.asarray(picture))


FORMATS = ("gif", *VIDEOS)
"""Files that `animate` writes, by their suffix."""


def animate(
    recording: Recording,
    path: str | Path,
    *,
    fps: int | None = None,
    width: int = 800,
    height: int = 450,
    slow: float | None = None,
    title: str | None = None,
    question: str = "",
    show: Collection[str] | None = None,
    predict: bool = False,
    comment: str = "",
) -> Path:
    """Write the lesson picture of a recording, a GIF that loops for ever, or a video.

    Parameters
    ----------
    recording : Recording
        From either engine, with at least one knot of particle 0.
    path : path
        Where to; written whole or not at all. Its suffix says what: .gif, .mp4 or .webm, the last
        two with the extra ``chutelab[video]``.
    fps : int, optional
        Pictures a second: 25 or 50, or another divisor of 100 below. By default 25; of a stream 20,
        since much of each picture changes.
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
        (the ledger as bars; without it the scene is wider). By default all, but of a crowd
        neither strobe dots nor velocity, and no impact of particle 0 is told.
    predict : bool, optional
        Let viewers predict: the film begins without the analytic parabola, and waits as
        the particle comes to the top of the drive pulley, or as it begins.
    comment : str, optional
        A text that a GIF keeps, not shown.

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
    if kind in VIDEOS and (width % 2 or height % 2):
        raise ValueError(f"{width} x {height} pixels: allowed in a video are even numbers")
    fps = (25 if recording.count == 1 else 20) if fps is None else fps
    shows = None if show is None else frozenset([show] if isinstance(show, str) else show)
    layout = lay_out(
        recording, width=width, height=height, title=title, question=question, shows=shows
    )
    begin, end = span(recording, layout.window)
    pace = slowness(end - begin) if slow is None else slow
    ask = asked(recording, begin) if predict else None
    crowd = as_crowd(recording) and "velocity" not in layout.shows
    moments = film(recording, begin, end, fps=fps, slow=pace, ask=ask, crowd=crowd)
    stage = Stage(recording, layout, moments, slow=pace, ask=ask)
    pictures = map(stage.frame, range(len(moments)))
    delays = [moment.delay for moment in moments]
    with whole(path) as unfinished:
        if kind == "gif":
            write_gif(unfinished, pictures, delays, comment)
        else:
            write_video(unfinished, kind, fps, pictures, delays)
    return path


def still(recording: Recording, path: str | Path, *, width: int = 800, height: int = 450) -> Path:
    """Write the machine as the film begins, without a path, as a PNG: the scene of the film alone.

    Parameters
    ----------
    recording : Recording
        As for `animate`.
    path : path
        Where to; written whole or not at all.
    width, height : int
        Pixels of the film.

    Returns
    -------
    Path
        Of the file.

    Raises
    ------
    ValueError
        If the size is not possible.
    OSError
        If the file cannot be written.
    """
    shows = frozenset(("velocity", "energy"))
    wide, high = 2 * width, 2 * height  # it is for print
    layout = lay_out(recording, width=wide, height=high, question="?", shows=shows)
    begin = span(recording, layout.window)[0]
    stage = Stage(recording, layout, (Moment(begin, 0, ""),), slow=1.0, ask=begin)
    left, bottom, across, up = layout.view
    top = 1.0 - bottom - up
    corners = (left * wide, top * high, (left + across) * wide, (top + up) * high)
    with whole(Path(path)) as unfinished:
        picture = stage.frame(0).crop(corners).quantize(64, dither=Image.Dither.NONE)
        picture.save(unfinished, format="PNG", optimize=True)
    return Path(path)
