# needs: notebook,fit

# %% [markdown:en] 4
# A fit uses all points of the track at once. `t0` is when the ball was released, between two frames.

# %% [markdown:de] 4
# Ein Fit nutzt alle Punkte der Messreihe auf einmal. `t0` ist der Zeitpunkt des Loslassens, zwischen zwei Bildern.

# %% 4
from chutelab import measured

scene = book.scene("drop.toml")
film = measured.read(book.file("ball.csv"))
film

# %% 4
measured.fit(scene, film, ["t0"])

# %% 4
measured.fit(scene, film, ["gravity", "surface.table.restitution", "t0"])
