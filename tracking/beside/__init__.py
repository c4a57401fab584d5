"""Computing long searches and looks in processes beside the frames.

`runner.py` (orders them, takes results), `process.py` (computes them), `messages.py` (between the
two).
"""
