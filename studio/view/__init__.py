"""The twin drawn for people: overlays, live surfaces, orbits.

`twin.py`, `contact_shadows.py` (what objects darken of what they stand on); `fonts.py` (the
program's own typefaces, in `studio/view/faces/` with their licence).
"""
