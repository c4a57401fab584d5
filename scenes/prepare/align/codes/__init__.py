"""Printed codes: their corners in photos, and the metric squares that these are of.

`corners.py` `symbols.py` (in photos), `squares.py` `triangulate.py` (in metres), `anchors.py`
`usable_codes.py` (which of them hold).
"""
