"""Make the gallery of all shipped scenes: gallery.md, and a picture of each in gallery/.

    python tools/gallery.py [DIRECTORY]

They go to the directory, by default ``docs`` beside this folder. Titles and what to look at are
those of the scene files. With `--text` no pictures are made, which takes most of the time.
"""

from __future__ import annotations

from argparse import ArgumentParser, RawDescriptionHelpFormatter
from pathlib import Path

from chutelab.engines.simulation import simulate
from chutelab.pictures.plots import draw_view
from chutelab.pictures.plots.panels import analytic_of
from chutelab.pictures.plots.scenery import as_crowd, bodily
from chutelab.pictures.plots.style import Picture
from chutelab.scene import about, load

SIZE = (6.4, 4.2)
"""Width and height of a picture, inches."""

GROUPS = {
    "A belt, a plate, a second belt": (
        *("perpendicular", "inclined-20", "inclined-40", "inclined-60", "perpendicular-fast"),
        *("two-sizes", "low-speed", "slip", "belt-landing"),
    ),
    "Streams": ("stream", "stream-independent", "coal-transfer", "rock-box", "spoon"),
    "Bins, heaps, screens": ("hopper", "feeder", "silo", "heap", "mixture", "galton"),
    "Further machines": ("inclined-conveyor", "cascade", "free-fall"),
    "What moves": (
        *("damper-plate", "see-saw", "flap-gate", "vibrating-feeder", "drum", "bucket-elevator"),
    ),
    "Toys": ("dominoes", "domino-gate", "cradle", "arch", "loop"),
}
"""The scenes by what one comes for."""

DPI = 80
"""Dots to the inch: a picture has some 30 kB, one of a crowd up to 90."""


def text() -> str:
    """Return gallery.md."""
    parts = [
        "# The shipped scenes",
        "Made by `python tools/gallery.py` from `scenes/*.toml`; `chutelab run NAME --out DIR` runs"
        " one, and `chutelab verify NAME` checks what it promises.",
    ]
    told = {one.name: one for one in about()}
    for group, names in GROUPS.items():
        parts.append(f"## {group}")
        for name in names:
            one = told.pop(name)
            parts += [f"### `{name}`: {one.title}", f"![{one.title}](gallery/{name}.png)"]
            parts.append("\n".join(one.look))
    assert not told, f"in no group: {', '.join(told)}"
    return "\n\n".join(parts) + "\n"


def picture(name: str, path: Path) -> None:
    """Run a scene, and draw it with its particles, tracks, or the envelope of a crowd."""
    recording = simulate(load(name))
    figure = Picture(SIZE, DPI)
    ax = figure.add_axes((0.135, 0.13, 0.845, 0.74))
    parts = analytic_of(recording, recording.prediction)[0]
    bodies, crowd = not parts and bodily(recording), as_crowd(recording)
    draw_view(ax, recording, parts, bodies=bodies, crowd=crowd)
    figure.write(path)


def main() -> None:
    """Write the page and, unless asked for the text alone, the pictures."""
    parser = ArgumentParser(description=__doc__, formatter_class=RawDescriptionHelpFormatter)
    docs = Path(__file__).parents[1] / "docs"
    parser.add_argument("directory", type=Path, nargs="?", default=docs)
    parser.add_argument("--text", action="store_true", help="make gallery.md alone")
    asked = parser.parse_args()
    (asked.directory / "gallery").mkdir(parents=True, exist_ok=True)
    (asked.directory / "gallery.md").write_text(text(), encoding="utf-8", newline="\n")
    for one in () if asked.text else about():
        picture(one.name, asked.directory / "gallery" / f"{one.name}.png")


if __name__ == "__main__":
    main()
