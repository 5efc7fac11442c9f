# %% [markdown] Try it live
# Der Ball wird seitlich angestoßen, damit die Sprünge nebeneinander liegen. Kommt er auf einmal zur Ruhe oder erst nach unendlich vielen Sprüngen? Ändere ε, oder nimm den Ball mit auf den Mond.
