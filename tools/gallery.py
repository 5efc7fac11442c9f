"""Make the gallery of all shipped scenes: docs/gallery.md and a picture of each in docs/gallery.

    python tools/gallery.py [DIRECTORY]

The directory is ``docs`` beside this folder by default. Titles and what to look at are those of
the scene files. Of many particles the picture shows where they are at one time, of few their
tracks.
"""

from __future__ import annotations

import sys
from pathlib import Path

from chutelab.engines.simulation import simulate
from chutelab.pictures.plots import overlay
from chutelab.scene import load
from chutelab.scene.loading import about


def page() -> str:
    """Return the text of gallery.md."""
