"""Recorded sessions: any instant of them, errors over time, forks and comparisons.

`opening.py` `viewing.py` (the one that is open), `transport.py`, `rows.py` of `track_view.py`
`curves.py` (what is seen), `sessions_dock.py` (the list of recorded sessions).
"""
