"""Content of a recording, read once, at any instant.

`reading.py` `index.py` `columns.py`, `spans.py` (states, faults), `errors.py`.
"""
