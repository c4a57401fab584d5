"""Hypotheses of an object's pose: candidate positions, searches, joint assignment.

`proposals.py` (places × templates), `lens_look.py` (a whole lens against the room), `screening.py`
(proposals by a rough likelihood), `search.py` (turned and refined), `births.py` (around the
last place, in one picture), `refinement.py`, `yaws.py`, `prior.py`, `assignment.py` (which object
takes which place), `budget.py` (steps within a frame's time), `search_runner.py` (in the frames,
beside them, or as recorded).
"""
