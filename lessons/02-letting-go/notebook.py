# %% [markdown] Try it live
# Above which belt speed does the particle leave at the very top? Change the belt's speed, then look for the formula in question 1.
