# %% [markdown] Try it live
# From which belt speed on does the particle leave at the very top? Change the belt's speed, then look for the formula in question 1.
