# %% 3
import chutelab

chutelab.overlay(book.noted[3][0])

# %% 3
chutelab.overlay(book.noted[3][1])

# %% 3
chutelab.overlay(book.noted[3][2])

# %% 3
chutelab.overlay(book.noted[3][3])

# %% 3
chutelab.overlay(book.noted[3][4])

# %% 3
chutelab.overlay(book.noted[3][5])
