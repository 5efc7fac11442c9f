# %% [markdown] Try it live
# Move ε from 0 to 1. Which part of the bounce changes? Why does the plate leave the speed unchanged at ε = 1?
