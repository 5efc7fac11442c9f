# needs: notebook,fit
# %% Run 1
runs = book.run("drop.toml")
runs

# %% [markdown] Run 1
# The points of `ball.csv`, and what a fit to all of them says of $g$, ε and the moment of release.

# %% Run 1
from chutelab import measured
from chutelab.classroom.lessons import find

film = measured.read(find("film-a-ball").folder / "ball.csv")
fit = measured.fit(book.scene("drop.toml"), film, ["gravity", "surface.table.restitution", "t0"])
fit

# %% [markdown] Run 1
# Noise, or a pattern? The left picture has the points on the fitted path, the right ones what is left of them.

# %% Run 1
from chutelab.pictures.plots.measured import measured as draw

draw(fit.after, fit)

# %% [markdown] Try it live
# The ball is pushed sideways, so that its bounces lie beside each other. Where does it stop bouncing? Change ε, or take it to the Moon.
