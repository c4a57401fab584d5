"""Moving bodies of a model: objects, virtual solids, people, and those a tracker moves.

`objects.py` `primitives.py`, `virtual.py` (either, where it exists in the physics alone),
`people.py` (torso and hands), `tracked.py` (what a tracker moves), `air.py` `rest.py`.
"""
