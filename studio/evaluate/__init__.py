"""Tracks and preparations against the truth: errors, scores, verdicts.

`metrics.py`, `scores.py` (a rehearsal) of `samples.py`, `figures.py` (drawings),
`perfect_detector.py` (the masks that the paper's method is given); `verdict.py` (a preparation).
"""
