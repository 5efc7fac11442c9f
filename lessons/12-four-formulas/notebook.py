# %% [markdown:en] 5
# All methods in one picture, over the simulated stream: a bed that sticks to the belt, then one of which each particle slips by itself.

# %% [markdown:de] 5
# Alle Verfahren in einem Bild über dem simulierten Strom: eine Schicht, die am Band haftet, dann eine, von der jedes Teilchen für sich gleitet.

# %% 5
from chutelab.pictures.plots.studies import discharge_figure
from chutelab.studies.discharge import side_by_side

discharge_figure(side_by_side(book.scene("bed.toml"), heights=[0.0, -0.3]))

# %% 5
discharge_figure(side_by_side(book.scene("bed.toml", "incoming.friction=0.6"), heights=[0.0, -0.3]))
