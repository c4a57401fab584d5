"""The physics of a scanned room: its surface, its objects and its twin.

`surface.py` (its mesh made ready), `objects.py` (what was cut out of it, on legs that the scan
missed), `twin.py` (the physics), `opening.py` (from a package or a room to that).
"""
