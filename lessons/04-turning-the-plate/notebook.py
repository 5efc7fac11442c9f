# %% [markdown] Try it live
# Lean the plate until the particle no longer touches it. At which angle is that? Then make the belt faster: does it happen earlier or later?
