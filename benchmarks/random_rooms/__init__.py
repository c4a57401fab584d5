"""Rooms by seed: other plans, floors, lights and lenses, and movable objects of many families.

`room.py` (all of it), `plan.py`, what moves, finishes, light.
"""
