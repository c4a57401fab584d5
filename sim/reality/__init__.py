"""Stand-in for the real room where only a scan of it exists.

`parts.py` (the second reconstruction taken apart), `room.py`, `scanned.py` (what a rehearsal is
given of it), `look.py` (drawn in layers), `light.py`, `world_error.py` (how far the scan's world
may be off).
"""
