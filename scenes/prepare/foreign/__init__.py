"""A splat scene of elsewhere made fit to live in: up, floor, unit, free space, collision mesh.

`level.py` (up, floor), `free_space.py` (where to look from), `foreign.py` (metres and a collision
mesh).
"""
