# %% Run 2
runs = book.run(
    "slot.toml --set surface.slider.from=[0.012,0]",
    "slot.toml --set surface.slider.from=[0.03,0]",
    "slot.toml --set surface.slider.from=[0.006,0]",
    "slot.toml --set surface.slider.from=[0.006,0] --set stream.seed=1",
)
runs

# %% Run 2
import chutelab

chutelab.overlay(runs[3])

# %% [markdown] Try it live
# Pull the end of the slider while the disks run. Where is the flow fast, where does nothing move, and when does an arch form?
