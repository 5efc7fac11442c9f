# %% [markdown] Try it live
# Verändere ε von 0 bis 1. Welcher Teil des Stoßes ändert sich? Warum lässt die Platte bei ε = 1 den Betrag der Geschwindigkeit unverändert?
