"""Pictures, films and pages.

- `plots`: figures of recordings, sweeps, designs, fits and benchmarks, by matplotlib.
- `animation`: the lesson picture, a film as GIF or video.
- `live`: one HTML page that answers when something is dragged, also in a notebook.

Here are the colours of all pictures, pages and notebooks: those of Okabe and Ito (2008), "Color
Universal Design", which readers with any common colour blindness can distinguish.
"""

from typing import Final

BLUE: Final = "#0072B2"
SKY: Final = "#56B4E9"
GREEN: Final = "#009E73"
ORANGE: Final = "#E69F00"
VERMILION: Final = "#D55E00"
PURPLE: Final = "#CC79A7"
GREY: Final = "#8C8C8C"
"""Not of that palette; visible on white and on black."""
