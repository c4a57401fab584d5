"""Evidence of one frame about one object, and the object's rendering there.

`evidence.py` (occlusion included), `observation.py` (what a window shows without the object),
`rendering.py` (how it would be drawn), `appearance_memory.py`.
"""
