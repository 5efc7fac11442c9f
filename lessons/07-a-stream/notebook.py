# %% Run 1
runs = book.run("bed.toml", "bed.toml --set stream.bed_height=0.1", "stream-independent")
runs

# %% [markdown] Run 1
# Where do they land? The line is their mean, the grey band one standard deviation to either side; the lowest and the highest layer of each bed are marked.

# %% Run 1
book.landings(runs)

# %% [markdown] Try it live
# Change the height of the bed, then the plate's angle. When is the stream narrowest at the belt?
