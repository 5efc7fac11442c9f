# %% [markdown:en] 3
# Where do they land? The line is their mean, the grey band one standard deviation to either side; the lowest and the highest layer of each bed are marked.

# %% [markdown:de] 3
# Wo treffen sie auf? Die Linie ist ihr Mittelwert, das graue Band eine Standardabweichung nach beiden Seiten; die unterste und die oberste Lage jeder Schicht sind markiert.

# %% 3
book.landings(book.noted[3])
