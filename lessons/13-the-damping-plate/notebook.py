# %% [markdown:en] 4
# The plate's angle beside the formula of a damped swing, and where its energy is:

# %% [markdown:de] 4
# Der Winkel der Platte neben der Formel einer gedämpften Schwingung, und wo ihre Energie ist:

# %% 4
import matplotlib.pyplot as plt
import numpy as np

import chutelab

run = chutelab.simulate(book.scene("damper-plate", "run.until=2.5"))
inertia, spring, damper = 0.002, 0.5, 0.01
(blow,) = run.select("impact", surface="plate")
after = np.linspace(0.0, 1.5, 400)
angle, rate = run.pose("plate", blow["t"] + after)[:, 2], run.swings["rate"].max()
decay = damper / (2 * inertia)
swift = np.sqrt(spring / inertia - decay**2)

# %% 4
fig, ax = plt.subplots()
ax.plot(after, np.degrees(angle), lw=4, color="0.8")
ax.plot(after, np.degrees(rate / swift * np.exp(-decay * after) * np.sin(swift * after)), "--")
_ = ax.set(xlabel="t, s", ylabel="θ, °")

# %% 4
run.ledger
