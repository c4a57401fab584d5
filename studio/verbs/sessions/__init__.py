"""Verbs that play a session, play it again, or set two beside each other.

`rehearse.py`, `live.py` (begin one), `replay.py`, `fork.py` (play a recorded one again, as it was
or otherwise), `compare.py`; `playing.py` (a plan played and its figures printed).
"""
