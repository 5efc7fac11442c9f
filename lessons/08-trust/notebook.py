# %% [markdown:en] 2
# The same runs, made here, and better ways:

# %% [markdown:de] 2
# Dieselben Läufe, hier gerechnet, und bessere Wege:

# %% 2
runs = book.run(
    "fixed-steps.toml --details",
    "fixed-steps.toml --set run.dt=0.0002 --details",
    "fixed-steps.toml --set run.dt=0.0001 --details",
    "fixed-steps.toml --set run.dt=0.00005 --details",
    "fixed-steps.toml --set run.dt=0.00002 --details",
)
book.errors(runs)

# %% 2
better = book.run("perpendicular --engine pymunk --details", "perpendicular --details")
book.errors(better)

# %% 2
from chutelab.checks.workprecision import measure
from chutelab.pictures.plots.studies import workprecision

scene = book.scene("perpendicular")
workprecision(measure(scene, repeats=1, max_seconds=2), scene.title, {})
