"""Films: what a simulated camera shows, drawn and encoded once, with the truth of every picture.

`film.py` (access units, their times, the truth of every picture), `film_file.py` (kept on the
disk), `drawn.py` (of a script), `found.py` (of a recording or any video), `layouts.py` (how the
lenses lie in a picture).
"""
