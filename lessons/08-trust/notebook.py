# %% Run 1
runs = book.run(
    "fixed-steps.toml --details",
    "fixed-steps.toml --set run.dt=0.0002 --details",
    "fixed-steps.toml --set run.dt=0.0001 --details",
    "fixed-steps.toml --set run.dt=0.00005 --details",
    "fixed-steps.toml --set run.dt=0.00002 --details",
)
book.errors(runs)

# %% Run 2
better = book.run("perpendicular --engine pymunk --details", "perpendicular --details")
book.errors(better)

# %% Run 3
from chutelab.checks.workprecision import measure
from chutelab.pictures.plots.studies import workprecision

scene = book.scene("perpendicular")
workprecision(measure(scene, repeats=1, max_seconds=2), scene.title, {})

# %% [markdown] Try it live
# A page has no steps to change: its engine ends its steps at impacts. Compare it with the dashed line, which is the closed form, at any distance of the plate. Could you see from the picture alone that a result is wrong by 1 %? What would you look at instead?
