"""Coverage of an object by photos, and where to stand for what they missed.

`visibility.py` (what a view shows of splats and of a box), `in_photos.py` (the record of all
views), `standpoints.py` (where a photo would help most).
"""
