"""A session on the display of a HoloLens.

`drawing.py` (twenty times a second), `display.py` `edges.py` (a state as items on it), `view.py`
(what the wearer sees).
"""
