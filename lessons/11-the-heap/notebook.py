# %% Run 1
runs = book.run(
    "heap.toml",
    "heap.toml --set particle.rolling_friction=0",
    "heap.toml --set particle.rolling_friction=0.8",
    "heap.toml --set stream.count=75",
)
runs

# %% Run 1
import chutelab

chutelab.overlay(runs[0])

# %% Run 1
chutelab.overlay(runs[1])

# %% Run 1
chutelab.overlay(runs[2])

# %% Run 1
chutelab.overlay(runs[3])

# %% Run 2
others = book.run("heap.toml --set stream.seed=1", "heap.toml --set stream.seed=2")
others

# %% Run 2
chutelab.overlay(others[0])

# %% Run 2
chutelab.overlay(others[1])

# %% [markdown] Try it live
# Pour a heap, and measure its flanks with the tool "Angle". What becomes of it without rolling friction?
