"""Small pictures over the view: what the camera, a person or an object sees.

`sources.py` (whose eyes), `inset_painter.py` (drawn in turn, in a share of the time), `insets.py`
(where they stand).
"""
