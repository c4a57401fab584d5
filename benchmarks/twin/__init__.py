"""How fast and how exact the digital twin is: camera, physics, forks.

`twin.py` (the verb) of `camera.py` `physics.py` `forks.py`; `physics_room.py` and `scan_like.py`
(an exact room as a scan would have it).
"""
