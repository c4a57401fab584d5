"""Computing a long search in a process beside the frames.

`runner.py` (orders them, takes results), `process.py` (computes them), `messages.py` (between the
two).
"""
