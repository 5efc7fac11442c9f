# %% [markdown] Try it live
# Turn down the friction of the outgoing belt, then up. Which number does not change, and why?
