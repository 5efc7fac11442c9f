# %% [markdown] Try it live
# Move ε from 0 to 1. Which part of the bounce changes? At ε = 1, why is the speed after the plate the one before it?
