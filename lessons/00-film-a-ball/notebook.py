# needs: notebook,fit

# %% Run 1
from chutelab import measured

scene = book.scene("drop.toml")
film = measured.read(book.file("ball.csv"))
film

# %% Run 1
runs = book.run("drop.toml")
runs

# %% Run 1
began = measured.fit(scene, film, ["t0"])
began

# %% Run 1
found = measured.fit(scene, film, ["gravity", "surface.table.restitution", "t0"])
found

# %% [markdown] Try it live
# The ball is pushed sideways, so that the bounces lie beside each other. Does it stop at once, or after infinitely many bounces? Change ε, or take the ball to the Moon.
