# %% [markdown] Try it live
# Move the grip of the belt. Where is it most sensitive, and where does it hardly matter any more?
