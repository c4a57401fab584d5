"""Faults as knobs, and what they do to the tracker.

`knobs.py`, `plugin_faults.py` (those of the user's files), `trial.py` (short rehearsals),
`error_bars.py` (what the tracker made of them).
"""
