"""Making movable objects of parts of a room.

`cutout.py` (the whole way), `proposals.py` (what looks movable), `likewise.py` (the same objects
out of another reconstruction); what all its rooms measure: `connected_bodies.py` `level_planes.py`
`colour_similarity.py`.
"""
