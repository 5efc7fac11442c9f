# %% [markdown:en] 3
# What happened in the last run?

# %% [markdown:de] 3
# Was ist im letzten Lauf geschehen?

# %% 3
import chutelab

chutelab.overlay(book.noted[3][5])
