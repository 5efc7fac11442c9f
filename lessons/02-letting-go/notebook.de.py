# %% [markdown] Try it live
# Ab welcher Bandgeschwindigkeit löst sich das Teilchen schon im Scheitel? Verändere die Geschwindigkeit des Bandes, dann suche die Formel in Frage 1.
