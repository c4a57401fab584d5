"""How fast and how exact the digital twin is: camera, physics, forks.

`twin.py` (the verb, and the camera) with `physics.py` `forks.py`; `scan_like.py` (an exact room as
a scan would have it).
"""
