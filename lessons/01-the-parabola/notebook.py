# %% [markdown] Try it live
# Move the speed of the belt, and how far down the second belt is. What changes in the picture, and which number does not?
