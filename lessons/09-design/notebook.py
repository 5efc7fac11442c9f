# needs: notebook,design

# %% 3
from chutelab import design

scene = book.scene("inclined-20")
down = design.solve(scene, {"plate.angle_deg": (11, 60)}, {"landing.vx": 0})
down

# %% 3
design.solve(scene, {"plate.angle_deg": (11, 60)}, {"landing.vx": 1})

# %% 3
least = design.minimize(scene, {"plate.angle_deg": (11, 60)}, "belt_work")
least

# %% 3
from chutelab.pictures.plots.studies import scan, spread

scan(least)

# %% 3
design.minimize(scene, {"plate.angle_deg": (11, 60)}, "dEk")

# %% 4
slower = book.scene("inclined-20", "outgoing.speed=1")
design.minimize(slower, {"plate.angle_deg": (11, 60)}, "belt_work")

# %% 4
design.minimize(slower, {"plate.angle_deg": (11, 60)}, "slip_heat")

# %% 4
both = design.solve(
    scene,
    {"plate.angle_deg": (20, 60), "plate.restitution": (0.1, 0.9)},
    {"landing.vx": 1, "landing.x": 0.3},
    seed=1,
)
both

# %% 5
sure = design.uncertainty(
    book.scene("inclined-40"),
    {
        "restitution": (0.5, 0.05),
        "plate.angle_deg": (None, 0.5),
        "plate.distance": (None, "2 mm"),
        "incoming.speed": (None, "1%"),
    },
    samples=256,
)
sure

# %% 5
spread(sure)

# %% 5
from chutelab import figures
from chutelab.pictures.plots import paper_figure

paper_figure(figures.figure(6))

# %% [markdown:en] 7
# The machine with your numbers, for searches of your own, such as `design.solve(machine, {"plate.angle_deg": (5, 60)}, {"landing.vx": 0})`:

# %% [markdown:de] 7
# Die Maschine mit deinen Zahlen, für eine eigene Suche, zum Beispiel `design.solve(machine, {"plate.angle_deg": (5, 60)}, {"landing.vx": 0})`:

# %% 7
given = task.given
machine = book.scene(
    "inclined-20",
    "particle.radius=0",
    f"particle.mass={given.grams / 1000}",
    f"incoming.speed={given.v0}",
    f"incoming.pulley_radius={given.R}",
    f"plate.distance={given.d}",
    f"plate.pivot_height={given.pivot}",
    f"plate.angle_deg={given.alpha}",
    f"plate.restitution={given.e}",
    f"outgoing.speed={given.vb}",
)
