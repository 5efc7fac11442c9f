"""The lesson picture: a film of a recording, slowed down, that holds at important moments.

The background is drawn once, and moving parts for each frame. `animate` writes a film; `still` a
picture of the machine before it begins.

- `moments`: the moments that are shown, their duration, and what happened, in words.
- `actors`: moving parts: particles, arrows, belts, pulley, and the energy bars.
- `drawing`: draws them, and finds the pixels that change.
- `files`: how pictures become a GIF or a video.
"""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass, replace
from pathlib import Path
from textwrap import shorten
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.lines import Line2D
from matplotlib.text import Text
from matplotlib.transforms import Bbox
from numpy.typing import NDArray
from PIL import Image

from chutelab.pictures.animation.actors import (
    arrows,
    bars,
    bodies,
    crowd,
    drives,
    gates,
    names,
    seen,
    strobe,
    strung,
    trail,
)
from chutelab.pictures.animation.drawing import Bar, Canvas, Part, Writing, painter
from chutelab.pictures.animation.files import (
    VIDEOS,
    VideoError,
    need_video,
    write_gif,
    write_video,
)
from chutelab.pictures.animation.moments import Moment, asked, film, slowness, span
from chutelab.pictures.plots import Window, analytic_of, draw_analytic, draw_scene, style, window_of
from chutelab.pictures.plots.machinery import swept
from chutelab.pictures.plots.panels import path_of_arcs
from chutelab.pictures.plots.scenery import (
    FINE,
    around,
    as_crowd,
    energies,
    nominal,
    one_of_many,
    paid_by,
    round_step,
    strobe_step,
    track_times,
)
from chutelab.pictures.plots.style import Picture, figures, paid_words, say, spoken
from chutelab.results import Recording
from chutelab.results.quantities import need_recording
from chutelab.util.files import whole

__all__ = [
    "FORMATS", "SHOWS", "Moment", "Stage", "VideoError", "animate", "film", "need_video",
    "still",
]  # fmt: skip

SHOWS = ("parabola", "trails", "strobe", "velocity", "energy")
"""Parts of a picture besides the machine and the particles."""

TRAIL = 0.07
"""Length of the trail at the highest speed, as a share of the window's width."""


@dataclass(frozen=True)
class Layout:
    """Content and layout of the picture."""

    # pixels
    width: int
    height: int
    # texts above the scene; the question may be empty
    title: str
    question: str
    shows: frozenset[str]  # some of `SHOWS`
    # where the scene is: left, bottom, width and height as shares of the picture
    view: tuple[float, float, float, float]
    window: Window  # the part of the world that is shown, with the aspect ratio of `view`
    fastest: float  # m/s; particle 0's highest speed while it is in the window

    def reach(self, share: float, what: str) -> float:
        """Return the time (s) for a share of the window at particle 0's highest speed.

        It is the length of arrows (m for 1 m/s) and trails (s); 0 if `what` is not shown.
        """
        shown = what in self.shows and self.fastest > 0.0
        return share * self.window.width / self.fastest if shown else 0.0

    @property
    def arrow(self) -> float:
        """Length of the velocity's arrow for 1 m/s, m; 0 without an arrow.

        That of the highest speed is a tenth of the picture's width.
        """
        return self.reach(0.1, "velocity")

    @property
    def dpi(self) -> float:
        """Pixels to the inch: text keeps its share of 8 by 4.5 inches, or more."""
        return min(self.width / 8.0, self.height / 4.5)


def lay_out(
    recording: Recording,
    *,
    width: int,
    height: int,
    title: str | None = None,
    question: str = "",
    shows: frozenset[str] | None = None,
    energy: bool = True,
) -> Layout:
    """Choose the window such that everything that moves, arrows included, is in the picture.

    By default it shows everything, but for a crowd not the parts about particle 0.

    Raises a `ValueError` if the picture is too small, or `shows` has an unknown name.
    """
    if width < 320 or height < 180:  # text could not be read
        raise ValueError(f"{width} x {height} pixels: allowed are at least 320 x 180")
    usual = frozenset(SHOWS if energy else SHOWS[:-1])
    wanted, shows = shows, usual if shows is None else shows
    if unknown := sorted(shows - set(SHOWS)):
        raise ValueError(f"show = {unknown[0]!r}: allowed are {', '.join(SHOWS)}")
    if one_of_many(recording) or (wanted is None and as_crowd(recording)):
        shows -= {"strobe", "velocity"}  # of particle 0
    view = (0.015, 0.135, 0.675 if "energy" in shows else 0.97, 0.65 if question else 0.71)
    aspect = view[2] * width / (view[3] * height)
    pulley = recording.machine.pulley
    window = window_of(recording).fitted(aspect)
    begin, end = span(recording, window)
    last = min(end, float(recording.track(0)["t"][-1]))
    times = track_times(recording, begin, last, fine=FINE * window.width)
    position, velocity = nominal(recording, times)
    # Particles that have left for good should not make everything else small.
    inside = window.holds(position)
    position, velocity = position[inside], velocity[inside]
    fastest = float(np.hypot(*velocity.T).max(initial=0.0))
    said = spoken().title(recording.title) if title is None else title
    tight = Layout(width, height, said, question, shows, view, window, fastest)
    corners = [(window.left, window.bottom), (window.right, window.top)]
    if pulley is not None:
        # The incoming belt's name is left of it.
        corners.append((-pulley.radius - 0.21 * window.width, 0.0))
    if recording.scene.view is not None:
        return tight
    room = 0.015 * window.width
    tips = position + tight.arrow * velocity
    grown = around(np.concatenate([corners, tips - room, tips + room]))
    return replace(tight, window=grown.fitted(aspect))


RIGHT, GAP = 0.99, 0.015
"""Shares of the picture's width: right end of text, and gap between the clock and its pace."""

TITLE, LINE, CAPTION = 0.942, 0.065, 0.055
"""Shares of its height: the title's base line, a line below it, the middle of the caption."""


class Stage:
    """Draws the moments of a film: the background once, and moving parts for each moment.

    `slow` is seconds on the screen for one second of the recording. The analytic path is shown from
    the first moment on, or after the time `ask`, s. `figure` is the background and `view` the axes
    of the scene in it; `moving` has the moving parts, from back to front, `bars` those of the
    ledger, and `writings` the changing texts.
    """

    def __init__(
        self,
        recording: Recording,
        layout: Layout,
        moments: tuple[Moment, ...],
        *,
        slow: float,
        ask: float | None = None,
    ) -> None:
        times, shows = np.array([moment.t for moment in moments]), layout.shows
        # A hundredth of a pixel more: the canvas rounds down.
        inches = (layout.width + 0.01) / layout.dpi, (layout.height + 0.01) / layout.dpi
        self.figure = Picture(inches, layout.dpi)
        self.view = view = self.figure.add_axes(layout.view)
        parts = analytic_of(recording)[0] if "parabola" in shows else ()
        clear = [path_of_arcs(parts), *swept(recording)]
        draw_scene(view, recording.machine, layout.window, clear=clear)
        view.set(xticks=[], yticks=[])
        for spine in view.spines.values():
            spine.set_color(style.STEEL_LIGHT)
        draw_scale(view)
        drawn = len(view.lines)
        draw_analytic(view, parts)
        parabola = view.lines[drawn:]
        position, velocity = nominal(recording, times)
        reach = layout.reach(TRAIL, "trails")
        others, named = crowd(view, recording, times, reach)
        self.moving = [
            *gates(view, recording.machine, times),
            *drives(view, recording.machine, times),
            *strung(view, recording, times),
            *others,
        ]
        for dashed in [] if ask is None else parabola:
            # Below all moving parts.
            dashed.set_animated(True)
            self.moving.insert(0, seen(dashed, times > ask))
        # Entries of the legend, in order.
        dot: dict[str, Any] = {"ls": "none", "marker": "o", "ms": 6.0}
        handles = [Line2D([], [], **dot, color=style.STRIKE, label=say("particle-0")), *named]
        if parts:
            # Two dashes; the line's own would not fit.
            dashes: Any = (0, (1.5, 0.85))
            handles.append(
                Line2D([], [], color=style.ANALYTIC, lw=3.0, ls=dashes, label=say("analytic"))
            )
        if reach:
            self.moving.append(trail(view, recording, times, reach))
        if "strobe" in shows:
            self.moving.append(strobe(view, recording, times))
            said = say("every", step=figures(strobe_step(recording), "g"))
            handles.append(Line2D([], [], **style.RINGS, ms=4.5, label=said))
        if layout.arrow:
            self.moving.append(arrows(view, position, velocity, layout.arrow))
            handles.append(Line2D([], [], color=style.INK, lw=2.0, label=say("velocity")))
        _add_legend(view, handles, components=layout.arrow > 0.0)
        self.moving += bodies(view, recording, np.array([0]), times, "disk", style.STRIKE, 0.4)
        self.moving += names(view, recording.machine, times)
        self.writings = self._add_text(layout, pace_words(slow), moments)
        self.bars: list[Bar] = []
        if "energy" in shows:
            # Above the bars is room for their title, and the clock.
            top = layout.view[1] + layout.view[3] - 0.06
            axes = self.figure.add_axes((0.765, 0.43, 0.225, top - 0.43))
            table = 0.73, 0.125, 0.26, 0.245
            paid = paid_words(paid_by(recording))
            self.bars, column = bars(axes, table, energies(recording, times), drives=paid)
            self.writings += column
        self._canvas = Canvas(self.figure)
        self._painters = [painter(artist) for artist, _ in self.moving]
        self._painted: list[Part] = []

    def paint(self, index: int) -> tuple[NDArray[np.uint8], list[Part]]:
        """Draw one moment; return its pixels, (H, W, 4), RGBA, valid until the next is drawn.

        Also returned are the regions that may have changed since the moment painted before.
        """
        # Bars and texts overlap nothing else.
        panel: list[Bar | Writing] = [*self.bars, *self.writings]
        news = [one for one in panel if not one.stays(index)]
        before = [*self._painted, *(one.part for one in news)]
        self._canvas.clear(before)
        self._painted = []
        for (_, show), one in zip(self.moving, self._painters, strict=True):
            show(index)
            self._painted += one.paint(self._canvas)
        return self._canvas.rgba, [
            *before, *self._painted, *(one.paint(self._canvas, index) for one in news)
        ]  # fmt: skip

    def frame(self, index: int) -> Image.Image:
        """Return the picture of one moment, RGB."""
        return Image.fromarray(self.paint(index)[0]).convert("RGB")

    def _add_text(self, layout: Layout, pace: str, moments: tuple[Moment, ...]) -> list[Writing]:
        """Write title, question and pace; return clock and caption, which change."""
        text = self.figure.text
        said = [style.plain(" ".join(one.split())) for one in (layout.title, layout.question)]
        title = text(0.02, TITLE, said[0], fontsize=style.LARGE, fontweight="bold")
        _shorten(title, RIGHT * layout.width)
        if layout.question:
            asked = text(0.02, TITLE - LINE, said[1], fontsize=style.NORMAL)
            _shorten(asked, RIGHT * layout.width)
        # Near the moving parts, since a frame of the file takes the size of the rectangle around
        # all changes.
        above = layout.view[1] + layout.view[3] + 0.02
        slowed = text(RIGHT, above, pace, fontsize=style.NORMAL, ha="right")
        right = slowed.get_window_extent().x0 - GAP * layout.width
        # The clock has no digits that change too fast to be read; they would take as many bytes as
        # all particles.
        steps = np.diff([moment.t for moment in moments])
        digits = 2 if len(steps) and np.median(steps) >= 0.01 else 3
        times = [f"t = {figures(moment.t, f'.{digits}f')} s" for moment in moments]
        shown = {said: style.drawable(said) for said in {moment.words for moment in moments}}
        words = [shown[moment.words] for moment in moments]
        left, low, high = 0.02 * layout.width, 1.0 - CAPTION, 1.0 - above
        return [
            Writing(style.NORMAL, layout.dpi, right, layout.height * high, "rs", times),
            Writing(style.NORMAL, layout.dpi, left, layout.height * low, "lm", words),
        ]


def _add_legend(ax: Axes, handles: list[Line2D], *, components: bool) -> None:
    """Draw the legend above the scene, last the components of the velocity.

    Entries after the first five that do not fit are left out, the last first.
    """
    while True:
        legend = ax.legend(
            handles=handles,
            loc="lower left",
            bbox_to_anchor=(0.0, 1.0),
            ncols=len(handles),
            fontsize=style.SMALL,
            frameon=False,
            borderaxespad=0.1,
            borderpad=0.3,
            handlelength=1.5,
            columnspacing=0.8,
            handletextpad=0.3,
        )
        if len(handles) <= 5 or legend.get_window_extent().x1 <= ax.get_window_extent().x1:
            break
        handles, components = handles[:-1], False
    for place, (name, colour) in enumerate(style.VELOCITY.items() if components else ()):
        ax.annotate(
            f"$v_{name[1]}$",
            (1.0, 0.5),
            xycoords=legend.get_texts()[-1],
            xytext=(4.0 + 16.0 * place, 0.0),
            textcoords="offset points",
            fontsize=style.NORMAL,
            color=style.tint(colour, 0.8, style.INK),
            va="center",
            # Placed beside the entries placed before.
            zorder=legend.get_zorder() + 1.0,
        )


def _shorten(text: Text, right: float) -> None:
    """Cut a text off at the end of a word such that it ends before a column of pixels."""
    whole = text.get_text()
    length = len(whole)
    while text.get_window_extent().x1 > right and length > 1:
        length -= 1
        text.set_text(shorten(whole, length, placeholder=" …"))


def pace_words(slow: float) -> str:
    """Return the pace of the film's clock in words.

    >>> pace_words(10.0), pace_words(1.0), pace_words(0.5)
    ('10× slower', 'real time', '2× faster')
    """
    if slow == 1.0:
        return say("real-time")
    pace, times = ("slower", slow) if slow > 1.0 else ("faster", 1.0 / slow)
    return say(pace, times=figures(times))


def draw_scale(ax: Axes) -> None:
    """Draw a bar of round length in a corner where no name is: the picture has no ticks."""
    (left, right), (bottom, top) = ax.get_xlim(), ax.get_ylim()
    length = round_step(right - left, 6)
    taken = [text.get_window_extent().padded(2.0) for text in ax.texts]
    lines = [line.get_path().transformed(line.get_transform()) for line in ax.lines]
    (bar,) = ax.plot([], [], color=style.MUTED, linewidth=2.0, solid_capstyle="butt", gid="scale")
    said = ax.text(0.0, 0.0, f"{figures(length, 'g')} m", ha="center", va="bottom")
    said.set(fontsize=style.SMALL, color=style.MUTED)
    edge = 0.015 * (right - left)

    def hides(place: tuple[float, float]) -> int:
        """Put the bar there, and return how much it would hide; names count more than lines."""
        x, y = place
        bar.set_data([x, x + length], [y, y])
        said.set_position((x + 0.5 * length, y + 0.012 * (top - bottom)))
        ends = ax.transData.transform([(x, y), (x + length, y)])
        # Particles ride right above a belt's line.
        box = Bbox.union([said.get_window_extent(), Bbox(ends)]).padded(0.12 * ax.figure.dpi)
        crossed = sum(line.intersects_bbox(box, filled=False) for line in lines)
        return int(100 * box.count_overlaps(taken) + crossed)

    rows = top - 0.08 * (top - bottom), bottom + 0.03 * (top - bottom)
    hides(min(((x, y) for y in rows for x in (left + edge, right - edge - length)), key=hides))


FORMATS = ("gif", *VIDEOS)
"""Files that `animate` writes, by their suffix."""


def animate(
    recording: Recording,
    path: str | Path,
    *,
    fps: int | None = None,
    width: int = 1280,
    height: int = 720,
    slow: float | None = None,
    title: str | None = None,
    question: str = "",
    show: Collection[str] | None = None,
    energy: bool = True,
    predict: bool = False,
    comment: str = "",
) -> Path:
    """Write the lesson picture of a recording, a GIF that loops for ever, or a video.

    Parameters
    ----------
    recording : Recording
        From either engine, with at least one knot of particle 0.
    path : path
        The file; written whole or not at all. Its suffix gives the format: .gif, .mp4 or .webm, the
        last two with the extra ``chutelab[video]``.
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
        (the ledger as bars; without it the scene is wider). By default all, but for a crowd neither
        strobe dots nor velocity, and no impact of particle 0 is described.
    energy : bool, optional
        Whether `show` has "energy", if `show` is not given.
    predict : bool, optional
        Let viewers predict: the film begins without the analytic parabola, and waits as
        the particle comes to the top of the drive pulley, or as it begins.
    comment : str, optional
        A text that a GIF keeps, not shown.

    Colours and language are those of `plots.style`.

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
    need_recording(recording)
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
        recording, width=width, height=height, title=title, question=question, shows=shows,
        energy=energy,
    )  # fmt: skip
    begin, end = span(recording, layout.window)
    pace = slowness(end - begin) if slow is None else slow
    ask = asked(recording, begin) if predict else None
    crowd = as_crowd(recording) and "velocity" not in layout.shows
    moments = film(recording, begin, end, fps=fps, slow=pace, ask=ask, crowd=crowd)
    stage = Stage(recording, layout, moments, slow=pace, ask=ask)
    every, delays = range(len(moments)), [moment.delay for moment in moments]
    with whole(path) as unfinished:
        if kind == "gif":
            write_gif(unfinished, map(stage.paint, every), delays, comment)
        else:
            write_video(unfinished, kind, fps, map(stage.frame, every), delays)
    return path


def still(recording: Recording, path: str | Path, *, width: int = 1280, height: int = 720) -> Path:
    """Write the machine as the film begins, without a path, as a PNG: the scene of the film alone.

    Parameters, result and errors are those of `animate`; width and height are the film's, and the
    picture has twice as many pixels, for print.
    """
    shows = frozenset(("velocity", "energy"))
    wide, high = 2 * width, 2 * height
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
