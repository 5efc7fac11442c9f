"""What is looked at.

- `colours`: the colours of all pictures, pages and notebooks.
- `plots`: figures of recordings, sweeps, designs, fits and benchmarks, by matplotlib.
- `animation`: the lesson picture, a film as GIF or video.
- `live`: one HTML page with sliders, and the sliders of a notebook.
"""
