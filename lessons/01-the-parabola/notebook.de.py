# %% [markdown] Try it live
# Verändere die Geschwindigkeit des Bandes und die Tiefe des zweiten Bandes. Was ändert sich im Bild, und welche Zahl nicht?
