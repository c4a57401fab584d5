"""How fast the studio answers: `nexus bench studio`, a process a figure.

`child.py` (the process of a figure) by `process.py`, on `shown.py`; `seeking.py`; `walking.py` (a
random walk through all modes), `soaking.py` `using.py` (hours of one session, and of all that is
done in a window), `killing.py` (ended at random moments).
"""
