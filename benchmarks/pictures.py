"""Time and size of the lesson picture.

    python benchmarks/pictures.py

First 120 frames of 800 x 450 pixels with 60 particles, beside Matplotlib's FuncAnimation and its
PillowWriter drawing the same picture; then `lesson.gif` of each shipped scene with one particle.
Times are processor times of this process, imports and simulation not counted; medians.
"""

import tempfile
from pathlib import Path
from statistics import median
from time import process_time

from matplotlib.animation import FuncAnimation, PillowWriter

from chutelab.engines.simulation import simulate
from chutelab.pictures.animation import Stage, animate, film, lay_out
from chutelab.pictures.animation.moments import span
from chutelab.scene import load, shipped

FRAMES, PARTICLES, FPS = 120, 60, 25
REPEATS = 3


def timed(make, path):
    """Return the median of seconds, and bytes."""
    seconds = []
    for _ in range(REPEATS):
        begin = process_time()
        make(path)
        seconds.append(process_time() - begin)
    return median(seconds), path.stat().st_size


def slowed(recording):
    """Return the slowness at which the film has `FRAMES` frames."""
    layout = lay_out(recording, width=800, height=450)
    begin, end = span(recording, layout.window)
    low, high = 0.1, 100.0
    while True:
        slow = 0.5 * (low + high)
        found = len(film(recording, begin, end, fps=FPS, slow=slow))
        if found == FRAMES:
            return slow, layout, film(recording, begin, end, fps=FPS, slow=slow)
        low, high = (slow, high) if found < FRAMES else (low, slow)


def usual(recording, slow, layout, moments):
    """Return a function that writes the film by FuncAnimation, every frame drawn as a figure."""

    def make(path):
        stage = Stage(recording, layout, moments, slow=slow)
        figure, high = stage.figure, stage.figure.bbox.height
        texts = []
        for one in stage.writings:
            across, down = one.place
            align = {"ha": "right"} if one.anchor == "rs" else {"va": "center"}
            size = one.font.size * 72.0 / figure.dpi
            place = across / figure.bbox.width, 1.0 - down / high
            texts.append(figure.text(*place, "", fontsize=size, **align))

        def update(index):
            for _, show in stage.moving:
                show(index)
            for text, one in zip(texts, stage.writings, strict=True):
                text.set_text(one.said[index])
            return []

        animation = FuncAnimation(figure, update, init_func=list, frames=len(moments))
        animation.save(path, writer=PillowWriter(fps=FPS), dpi=figure.dpi)

    return make


def main():
    overrides = [f"stream.count={PARTICLES}", "stream.rate=200", "stream.bed_height=0.03"]
    recording = simulate(load("perpendicular", overrides))
    slow, layout, moments = slowed(recording)
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "lesson.gif"
        ours, small = timed(lambda path: animate(recording, path, fps=FPS, slow=slow), path)
        theirs, large = timed(usual(recording, slow, layout, moments), path)
        print(f"{FRAMES} frames of 800 x 450, {PARTICLES} particles")
        print(f"  chutelab.pictures.animation             {ours:6.2f} s {small / 1e3:6.0f} kB")
        print(f"  FuncAnimation, PillowWriter  {theirs:6.2f} s {large / 1e3:6.0f} kB")
        print(f"  {theirs / ours:.1f} times faster, {small / large:.2f} times the size")
        print("lesson.gif of each shipped scene with one particle")
        for name in sorted(shipped()):
            scene = load(name)
            if scene.stream.count == 1:
                recording = simulate(scene)
                seconds, size = timed(lambda path, one=recording: animate(one, path), path)
                print(f"  {name:20s} {seconds:6.2f} s {size / 1e3:6.0f} kB")


if __name__ == "__main__":
    main()
