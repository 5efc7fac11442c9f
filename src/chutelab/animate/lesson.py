"""The lesson picture as a file: a GIF, or a video for those who project from other programs."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from chutelab.animate.gif import GifWriter
from chutelab.animate.layout import SHOWS, lay_out
from chutelab.animate.moments import film, frame_delay, slowness, span
from chutelab.animate.stage import Stage
from chutelab.animate.video import VIDEOS, VideoWriter
from chutelab.compare import scene_of
from chutelab.files import whole
from chutelab.plots.scenery import machine_of
from chutelab.theory import predict

if TYPE_CHECKING:
    from collections.abc import Collection

    from chutelab.recording import Recording

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
    machine = machine_of(recording)
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
    stage = Stage(recording, machine, predict(scene_of(recording)), layout, moments, slow=pace)
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
