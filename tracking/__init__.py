"""Frames in, object poses out. Never imports sim.

`tracker.py` (one frame, start to end), `options.py` (what a user may set), `schedule.py` (what is
done when, in which order), `output.py` (what every method takes and gives).
"""
