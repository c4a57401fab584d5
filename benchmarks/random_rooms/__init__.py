"""Rooms by seed: other plans, floors, lights and lenses, and movable objects of many families.

`plan.py`, `families.py` (what moves), finishes, light.
"""
