"""The twin drawn for people: overlays, live surfaces, orbits.

`twin.py`, `resting.py` (only what moved is drawn again), `contact_shadows.py` (what objects darken
of what they stand on), `furniture.py` (what people's hands stay out of), `attention.py` (what
people point and look at); `fonts.py` (the program's own typefaces, in `studio/view/faces/` with
their licence).
"""
