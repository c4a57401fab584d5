"""Free floor of a room, and ways on it for people.

`floor.py` (where one can stand), `paths.py` (ways around furniture), `planar.py` (directions and
places on the floor).
"""
